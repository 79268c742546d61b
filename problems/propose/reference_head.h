// SPDX-License-Identifier: GPL-3.0-or-later
// A skull whose sites are known, to be laid over one whose sites are not.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "problems/propose/skull_shell.h"
#include "problems/subject/average_skull.h"

namespace semblance {

struct ReferenceHead {
  std::string name;
  SkullShell shell;              // moved and turned onto the average skull, of its own size
  std::vector<SitePoint> sites;  // there
  double site_error_mm = kNaN;   // rms, by which a person's sites are expected to differ from those
                                 // that a perfect warp of this head gives
};

// Throws InputError as MakeShell and FitAverageSkull do.
ReferenceHead MakeReference(const std::string& name, const TriMesh& skull,
                            std::span<const SitePoint> sites, int threads);

// From files. Throws IoError, ConfigError or InputError if they cannot be read, or if the landmarks
// are not the skull's (landmark_mistakes.h).
ReferenceHead ReadReference(const std::filesystem::path& skull,
                            const std::filesystem::path& landmarks, int threads);

// The made-up head: no one's skull, smooth, without orbits, teeth and arches.
ReferenceHead PhantomReference(std::uint64_t random_seed);

// The mirror image; its left sites are those that were right.
ReferenceHead Mirrored(const ReferenceHead& head);

}  // namespace semblance
