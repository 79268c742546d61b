// SPDX-License-Identifier: GPL-3.0-or-later
// JSON texts for the page.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/app/workbench/bench.h"

namespace semblance::problems {

// Landmarks with their checks, settings, values of all options, the steps that undo and redo reach,
// and the job.
std::string SnapshotJson(const Bench::Snapshot& shot, const std::filesystem::path& folder);

// {mesh: {blobs of view_mesh.h}, dowels, notes, finest_level, seconds}. seconds is null for a full
// face.
std::string FaceJson(const BenchFace& face);

// {per_mm: [px, py, pz]}, for pulls of 1 mm along x, y and z. Each is an array of three blobs, the
// x, y and z components of the vertices' displacements in hundredths of a mm.
std::string PullMovesJson(const std::array<std::vector<Vec3>, 3>& moves);

// {kind, path, name, ways}, with the roles in which the file can be opened.
std::string ImportedFileJson(const ImportedFile& file);

// {skull, skin}: blobs, or null for a missing mesh.
std::string MeshesJson(const BenchSubject& subject);

// Every site: code, name, number, partner and definition; standard sites with their position on the
// average skull.
std::string SitesJson();

}  // namespace semblance::problems
