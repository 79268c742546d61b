// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit face, the longest step of a run, from a cache that processes share.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "problems/output/disk_cache.h"
#include "surfaces/implicit_face.h"

namespace semblance {

// BuildImplicitFace, or what this very program made before of the same shell, depths and options,
// to the bit. Without a cache: BuildImplicitFace. Throws as that does.
ImplicitFace CachedImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                                const ImplicitFaceOptions& options, const DiskCache* cache,
                                const RunContext& context);

// All of a face as bytes of this machine, and back; nothing if the bytes are not such.
std::string ToBytes(const ImplicitFace& face);
std::optional<ImplicitFace> ImplicitFaceFrom(std::string_view bytes);

}  // namespace semblance
