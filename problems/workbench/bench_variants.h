// SPDX-License-Identifier: GPL-3.0-or-later
// The folder's variants/: full faces of other builds and depths, each beside the key of what it was
// made from.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "problems/workbench/bench_faces.h"

namespace semblance {

// A full face, edits and all.
struct VariantFace {
  BenchFace face;
  std::string key;  // of the state that it was made from
};
using VariantFaces = std::map<BenchVariant, VariantFace>;

// Replaces the variant's files. Throws IoError.
void StoreVariant(const std::filesystem::path& folder, BenchVariant variant,
                  const VariantFace& made);

// The surfaces whose key is `key`; their dowels are those that `dowels` gives for the variant.
VariantFaces StoredVariants(const std::filesystem::path& folder, const std::string& key,
                            const std::function<std::vector<Dowel>(BenchVariant)>& dowels);

}  // namespace semblance
