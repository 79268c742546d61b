// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/mr_skin.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/ct/head_mask.h"
#include "problems/ct/head_size.h"
#include "problems/ct/volume_surface.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr int kClasses = 256;

// The last class whose voxels belong to the dark ones.
int LastDarkClass(const std::array<double, kClasses>& counts) {
  double all = 0, all_sum = 0;
  for (int n = 0; n < kClasses; ++n) {
    all += counts[n];
    all_sum += n * counts[n];
  }
  double dark = 0, dark_sum = 0, best = -1;
  int last = 0;
  for (int n = 0; n + 1 < kClasses; ++n) {
    dark += counts[n];
    dark_sum += n * counts[n];
    const double bright = all - dark;
    if (dark > 0 && bright > 0) {
      const double apart = dark_sum / dark - (all_sum - dark_sum) / bright;
      const double between = dark * bright * apart * apart;
      if (between > best) {
        best = between;
        last = n;
      }
    }
  }
  return last;
}

// The value that one voxel in a thousand exceeds.
double NearlyBrightest(const CtVolume& volume) {
  std::array<std::int64_t, 65536> counts = {};
  for (const std::int16_t value : volume.values) {
    ++counts[value + 32768];
  }
  const auto most = static_cast<std::int64_t>(volume.values.size() / 1000);
  int value = 65535;
  for (std::int64_t above = counts[value]; above <= most && value > 0; above += counts[value]) {
    --value;
  }
  return value - 32768;
}

}  // namespace

double OtsuThreshold(const CtVolume& volume) {
  const double low = *std::ranges::min_element(volume.values);
  const double width = std::max(1.0, NearlyBrightest(volume) - low) / kClasses;
  std::array<double, kClasses> counts = {};
  for (const std::int16_t value : volume.values) {
    ++counts[std::min(kClasses - 1, static_cast<int>((value - low) / width))];
  }
  return low + width * (LastDarkClass(counts) + 1);
}

MrSkin ImportMrSkin(const CtVolume& volume, const MrSkinOptions& options,
                    const RunContext& context) {
  CheckVolume(volume, "import-ct");
  CheckHeadFits(volume);
  MrSkin result;
  result.skin_value = options.skin_value > 0 ? options.skin_value : OtsuThreshold(volume);
  context.Report("import mr", "head and outside air");
  const HeadMask mask = FindHeadMask(volume,
                                     {.skin_value = result.skin_value,
                                      .thinnest_head_mm = options.thinnest_head_mm,
                                      .widest_opening_mm = options.widest_opening_mm},
                                     context);
  context.Report("import mr", "skin");
  result.notes = mask.notes;
  result.skin = SkinSurface(volume, mask, result.skin_value, 2 * std::abs(result.skin_value) + 1,
                            context, result.dropped);
  CheckIsNotTooSmall(result.skin, "the skin");
  result.notes.push_back(fmt::format("skin at the grey value {:.0f}{}", result.skin_value,
                                     options.skin_value > 0 ? "" : ", found by Otsu's method"));
  result.notes.push_back(
      "no skull: bone is as dark as air in MR; take the skull from a CT of the same head");
  return result;
}

}  // namespace semblance
