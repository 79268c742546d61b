// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_variants.h"

#include <string>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

struct VariantFiles {
  fs::path face, key;
};

VariantFiles FilesOf(const fs::path& folder, BenchVariant variant) {
  const std::string name(NameOf(variant));
  return {folder / "variants" / (name + ".hspline.json"),
          folder / "variants" / (name + ".key.txt")};
}

}  // namespace

void StoreVariant(const fs::path& folder, BenchVariant variant, const VariantFace& made) {
  const VariantFiles files = FilesOf(folder, variant);
  fs::create_directories(files.face.parent_path());
  fs::remove(files.key);  // a face that is cut short has none
  WriteHSpline(files.face, made.face.surface);
  WriteFileAtomically(files.key, made.key);
}

VariantFaces StoredVariants(const fs::path& folder, const std::string& key,
                            const std::function<std::vector<Dowel>(BenchVariant)>& dowels) {
  VariantFaces found;
  for (const BenchVariant variant : kBenchVariants) {
    const VariantFiles files = FilesOf(folder, variant);
    if (fs::exists(files.key) && fs::exists(files.face) && ReadFileBytes(files.key) == key) {
      found.emplace(variant,
                    VariantFace{{ReadHSpline(files.face), dowels(variant), /*notes=*/{}}, key});
    }
  }
  return found;
}

}  // namespace semblance
