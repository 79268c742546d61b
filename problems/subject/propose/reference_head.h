// SPDX-License-Identifier: GPL-3.0-or-later
// The outer shell of a skull, coarse and without specks, by which two skulls are aligned; and the
// reference heads, whose sites are known, that are aligned with a skull whose sites are not.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "problems/subject/average_skull.h"
#include "surfaces/mesh/correspondences.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct ShellPoint {
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 normal = Vec3::Constant(kNaN);    // unit, outward
};

struct SkullShell {
  TriMesh mesh;             // need not be manifold
  Correspondences surface;  // finds closest points of the mesh and their normals
};

// Makes the shell of a skull: vertices 2 mm apart, and only triangles that are visible from outside
// (outer_surface.h) in bodies of 3 cm^2 or more. Inner table, sinuses and specks are removed; bone
// that is visible through orbits and openings stays. The skull must pass CheckHeadMesh. `name` is
// for messages. Throws InputError if nothing is left, or if two bodies have the size of a skull.
SkullShell MakeShell(const TriMesh& skull, const std::string& name, int threads);

// Wraps a mesh that already is a shell.
SkullShell AsShell(TriMesh mesh);

// Points spread evenly over the shell: the centroid of the first triangle in each cell of a grid.
std::vector<ShellPoint> SpreadPoints(const SkullShell& shell, double cell_mm);

struct ReferenceHead {
  std::string name;
  SkullShell shell;              // moved and turned onto the average skull, not scaled
  std::vector<SitePoint> sites;  // in the shell's frame
  double site_error_mm = kNaN;   // expected rms difference between a person's sites and those of a
                                 // perfect warp of this head
  std::map<std::string, double> error_of_site_mm = {};  // replaces site_error_mm where it is known

  double SiteError_mm(const std::string& site) const {
    const auto found = error_of_site_mm.find(site);
    return found != error_of_site_mm.end() ? found->second : site_error_mm;
  }
};

// Throws InputError as MakeShell and FitAverageSkull do.
ReferenceHead MakeReference(const std::string& name, const TriMesh& skull,
                            std::span<const SitePoint> sites, int threads);

// Reads a reference from files. Throws IoError, ConfigError or InputError if they cannot be read,
// or if the landmarks do not belong to the skull (landmark_mistakes.h).
ReferenceHead ReadReference(const std::filesystem::path& skull,
                            const std::filesystem::path& landmarks, int threads);

// A phantom as reference: a made-up smooth skull without orbits, teeth and arches.
ReferenceHead PhantomReference(std::uint64_t random_seed);

// The mirror image of a head. Left and right sites exchange their names.
ReferenceHead Mirrored(const ReferenceHead& head);

}  // namespace semblance::problems
