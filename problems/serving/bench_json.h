// SPDX-License-Identifier: GPL-3.0-or-later
// What the page is told, as JSON.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/workbench/bench.h"

namespace semblance {

// Landmarks with their checks, settings, values of all options, what can be undone, the job.
std::string SnapshotJson(const Bench::Snapshot& shot, const std::filesystem::path& folder);

// {mesh: {blobs of view_mesh.h}, dowels, notes, finest_level, seconds}: null but of a coarse one.
std::string FaceJson(const BenchFace& face);

// {per_mm: three for pulls along x, y and z, each with the x, y and z of the vertices' ways as
// blobs of values}, in hundredths of the pull.
std::string PullMovesJson(const std::array<std::vector<Vec3>, 3>& moves);

// {kind, path, name, ways}: what was brought, and as what it can be opened.
std::string ImportedFileJson(const ImportedFile& brought);

// {skull, skin}: blobs, null where there is none.
std::string MeshesJson(const BenchSubject& subject);

// Every site: code, name, number, partner, its place on the bone in words, and where it lies on a
// phantom's skull, for the picture.
std::string SitesJson();

}  // namespace semblance
