// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/head_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr int kLowest = -32768, kValues = 65536;

// Numbers of voxels up to each value.
class Histogram {
 public:
  explicit Histogram(const CtVolume& volume) : below_(kValues + 1, 0) {
    constexpr double kInside = 0.96;  // of the ellipse's axes: its border may be blurred
    const Vec2 middle(0.5 * (volume.columns - 1), 0.5 * (volume.rows - 1));
    for (int j = 0; j < volume.rows; ++j) {
      const double y = (j - middle.y()) / (0.5 * kInside * volume.rows);
      const double half = 0.5 * kInside * volume.columns * std::sqrt(std::max(0.0, 1 - y * y));
      const int first = static_cast<int>(std::ceil(middle.x() - half));
      const int last = static_cast<int>(std::floor(middle.x() + half));
      for (int k = 0; k < volume.slices; ++k) {
        for (int i = first; i <= last; ++i) {
          ++below_[volume.values[volume.Index(i, j, k)] - kLowest + 1];
        }
      }
    }
    below_[1] = 0;  // values that are not numbers
    for (int v = 1; v <= kValues; ++v) {
      below_[v] += below_[v - 1];
    }
  }

  // The number of voxels from `low` to `high`, both included.
  std::int64_t Count(int low, int high) const {
    const int from = std::clamp(low - kLowest, 0, kValues),
              to = std::clamp(high - kLowest + 1, 0, kValues);
    return std::max<std::int64_t>(0, below_[to] - below_[from]);
  }
  std::int64_t All() const { return below_.back(); }
  // The lowest value that at least this share of the voxels does not exceed.
  int Quantile(double share) const {
    const auto wanted = static_cast<std::int64_t>(std::ceil(share * static_cast<double>(All())));
    return static_cast<int>(std::ranges::lower_bound(below_, std::max<std::int64_t>(1, wanted)) -
                            below_.begin()) -
           1 + kLowest;
  }

 private:
  std::vector<std::int64_t> below_;
};

// The maxima of the histogram, smoothed over a fortieth of its range.
struct Peaks {
  std::vector<int> values;
  std::vector<std::int64_t> counts;  // voxels near each value
  int radius = 0;
  int range = 0;
};

Peaks FindPeaks(const Histogram& histogram) {
  constexpr double kTail = 0.001;  // metal and noise
  constexpr int kMinRadius = 3;
  Peaks peaks;
  const int low = histogram.Quantile(kTail), high = histogram.Quantile(1 - kTail);
  peaks.range = std::max(1, high - low);
  peaks.radius = std::max(kMinRadius, peaks.range / 40);
  const int half = peaks.radius / 2;
  const auto near = [&](int value) { return histogram.Count(value - half, value + half); };
  for (int value = low - half; value <= high + half; ++value) {
    const std::int64_t count = near(value);
    bool is_peak = count > 0;
    for (int other = value - peaks.radius; is_peak && other <= value + peaks.radius; ++other) {
      is_peak = other < value ? near(other) < count : near(other) <= count;
    }
    if (is_peak) {
      peaks.values.push_back(value);
      peaks.counts.push_back(count);
    }
  }
  return peaks;
}

// The mean of the values near a peak, of which the smoothed maximum is the lowest.
double Centre(const Histogram& histogram, int peak, int half) {
  double sum = 0;
  for (int value = peak - half; value <= peak + half; ++value) {
    sum += value * static_cast<double>(histogram.Count(value, value));
  }
  return sum / static_cast<double>(histogram.Count(peak - half, peak + half));
}

GreyLevels LevelsAbove(const Histogram& histogram, const Peaks& peaks, std::size_t air) {
  constexpr double kGap = 0.15;  // of the range: air and lung are no tissue
  const int least = peaks.values[air] + static_cast<int>(kGap * peaks.range);
  GreyLevels levels{.air = Centre(histogram, peaks.values[air], peaks.radius / 2)};
  std::int64_t most = 0;
  for (std::size_t n = air + 1; n < peaks.values.size(); ++n) {
    if (peaks.values[n] > least && peaks.counts[n] > most) {
      most = peaks.counts[n];
      levels.tissue = Centre(histogram, peaks.values[n], peaks.radius / 2);
    }
  }
  if (most > 0) {
    const auto tissue = static_cast<int>(std::lround(levels.tissue));
    levels.tissue_share =
        static_cast<double>(histogram.Count(tissue - 2 * peaks.radius, tissue + 2 * peaks.radius)) /
        static_cast<double>(histogram.Count(least, -kLowest));
  }
  return levels;
}

bool IsAir(double value) { return value >= -1100 && value <= -880; }
bool IsSoftTissue(double value) { return value >= -160 && value <= 160; }

// The least share of soft tissue among what is denser than air in a head. In a dry skull no narrow
// range of values holds as much.
constexpr double kMinTissueShare = 0.3;

bool IsHead(const GreyLevels& levels) {
  return IsAir(levels.air) && IsSoftTissue(levels.tissue) && levels.tissue_share >= kMinTissueShare;
}

bool HasBone(const Histogram& histogram, const GreyLevels& levels) {
  constexpr double kMinBone = 0.02;  // of what is denser than air
  const auto count = [&](double low) {
    return static_cast<double>(histogram.Count(static_cast<int>(low), -kLowest));
  };
  return count(levels.tissue + 300) > kMinBone * count(levels.air + 300);
}

constexpr double kAirToTissue = 1040;

std::string DescribeLevels(const GreyLevels& levels) {
  const double distance = levels.tissue - levels.air;
  const std::string what = fmt::format(
      "air has about {:.0f} and soft tissue about {:.0f}, instead of -1000 and 0 to 100 HU",
      levels.air, levels.tissue);
  constexpr double kSameScale = 0.15;
  const double shift = 0.5 * (levels.air + 1000 + levels.tissue - 40);
  if (std::abs(distance / kAirToTissue - 1) < kSameScale) {
    return fmt::format("{}: the values look {:.0f} too {}", what, std::abs(shift),
                       shift > 0 ? "high" : "low");
  }
  return fmt::format("{}: the values look scaled by {:.3g}", what, distance / kAirToTissue);
}

// The thresholds that lie between the levels as -200 and 226 HU do in a correct volume.
std::string SuggestThresholds(const GreyLevels& levels) {
  const double distance = levels.tissue - levels.air;
  const double skin = levels.air + 0.77 * distance, bone = levels.tissue + 0.18 * distance;
  return skin >= -900 && skin <= 0 && bone >= 50 && bone <= 3000
             ? fmt::format(", or set skin_hu and bone_hu to about {:.0f} and {:.0f}", skin, bone)
             : "";
}

// Notes bone whose brightest values have wrapped around to large negative ones, as 12 bits do above
// their limit. Air beside bone is not that low.
void NoteWrappedValues(const CtVolume& volume, double bone_hu, std::vector<std::string>& notes) {
  constexpr double kWrapped = -1500, kMinShare = 0.01;  // of the neighbours of bone along a row
  std::int64_t wrapped = 0, all = 0;
  for (std::size_t n = 1; n < volume.values.size(); ++n) {
    const auto [low, high] = std::minmax(volume.values[n - 1], volume.values[n]);
    all += high > bone_hu ? 1 : 0;
    wrapped += high > bone_hu && low < kWrapped ? 1 : 0;
  }
  if (static_cast<double>(wrapped) > kMinShare * static_cast<double>(all)) {
    notes.push_back(fmt::format(
        "{} voxels below {:.0f} HU lie beside bone: its brightest values may have wrapped around, "
        "and dense bone is then lost; export the volume again with 16 bits",
        wrapped, kWrapped));
  }
}

}  // namespace

GreyLevels FindGreyLevels(const CtVolume& volume) {
  constexpr double kMinShare = 0.02;  // of all voxels, for air
  const Histogram histogram(volume);
  const Peaks peaks = FindPeaks(histogram);
  GreyLevels lowest;
  for (std::size_t n = 0; n < peaks.values.size(); ++n) {
    if (static_cast<double>(peaks.counts[n]) < kMinShare * static_cast<double>(histogram.All())) {
      continue;
    }
    const GreyLevels levels = LevelsAbove(histogram, peaks, n);
    if (std::isnan(lowest.air)) {
      lowest = levels;
    }
    // Lower peaks are values that fill what was not scanned, if there is bone above the tissue.
    if (IsHead(levels) && HasBone(histogram, levels)) {
      return levels;
    }
  }
  return lowest;
}

void CheckHounsfieldUnits(const CtVolume& volume, double skin_hu, double bone_hu,
                          std::vector<std::string>& notes) {
  NoteWrappedValues(volume, bone_hu, notes);
  const GreyLevels levels = FindGreyLevels(volume);
  if (IsHead(levels) || std::isnan(levels.tissue)) {
    return;  // a head, or nothing to compare
  }
  const bool has_tissue = levels.tissue_share >= kMinTissueShare;
  if (!has_tissue) {
    if (IsAir(levels.air)) {
      notes.push_back(fmt::format(
          "no soft tissue near 0 to 100 HU stands out (air has about {:.0f}): a dry skull, or "
          "values of another scale",
          levels.air));
    }
    return;
  }
  const double distance = levels.tissue - levels.air;
  const double skin = (skin_hu - levels.air) / distance,
               bone = (bone_hu - levels.tissue) / distance;
  if (skin > 0.65 && skin < 0.92 && bone > 0.1 && bone < 0.45) {  // 0.77 and 0.18 in a CT
    notes.push_back(fmt::format("{}; check the surfaces", DescribeLevels(levels)));
    return;
  }
  throw InputError(fmt::format(
      "import-ct: the volume is not in Hounsfield units: {}; export it again with its rescale "
      "slope and intercept{} (for an MR, import-ct --modality mr extracts the skin)",
      DescribeLevels(levels), SuggestThresholds(levels)));
}

// ---------------------------------------------------------------------------------------------
// Size
// ---------------------------------------------------------------------------------------------

namespace {

struct SizeRange {
  const char* direction;
  const char* voxels;  // whose spacing is along the direction
  double low_mm, high_mm;
};
// Newborns to the largest adults, with soft tissue, ears and nose.
constexpr std::array kHeadSizes = {SizeRange{"wide", "columns", 90, 230},
                                   SizeRange{"long from front to back", "rows", 110, 290},
                                   SizeRange{"high", "slices", 110, 400}};

// The area of tissue on a side of the volume, and that of the whole side.
struct SideContact {
  double cm2 = 0, side_cm2 = 0;
};

SideContact FindContact(const CtVolume& volume, const VoxelMask& head, int axis, bool is_last) {
  const std::array<int, 3> counts = {volume.columns, volume.rows, volume.slices};
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  std::array<int, 3> at{};
  at[axis] = is_last ? counts[axis] - 1 : 0;
  std::int64_t touching = 0;
  for (at[b] = 0; at[b] < counts[b]; ++at[b]) {
    for (at[c] = 0; at[c] < counts[c]; ++at[c]) {
      touching += head[volume.Index(at[0], at[1], at[2])];
    }
  }
  const double voxel_cm2 = volume.spacing_mm[b] * volume.spacing_mm[c] / 100;
  return {voxel_cm2 * static_cast<double>(touching), voxel_cm2 * counts[b] * counts[c]};
}

constexpr double kCut_cm2 = 4;  // a larger contact cuts the head

// Throws InputError if tissue covers most of three or more of the four sides, notes one that
// touches as many.
void CheckSides(const CtVolume& volume, const HeadMask& mask, std::vector<std::string>& notes) {
  constexpr int kMostSides = 3;
  int touched = 0, covered = 0;
  for (const int axis : {0, 1}) {
    for (const bool is_last : {false, true}) {
      const SideContact contact = FindContact(volume, mask.head, axis, is_last);
      touched += contact.cm2 > kCut_cm2 ? 1 : 0;
      covered += contact.cm2 > 0.5 * contact.side_cm2 ? 1 : 0;
    }
  }
  if (covered >= kMostSides) {
    throw InputError(
        "import-ct: tissue covers the sides of the volume: voxels outside the scanned field may "
        "have the value of tissue, such as 0, instead of air, -1000; export the volume again");
  }
  if (touched >= kMostSides) {
    notes.push_back(fmt::format(
        "the head reaches {} of the 4 sides of the volume and is cut off there; if the scan shows "
        "the whole head, voxels outside the scanned field have the value of tissue",
        touched));
  }
}

// The part of the mesh from which the head is measured: neck and shoulders are wider.
Box3 BoundsNearTop(const TriMesh& mesh) {
  constexpr double kTop_mm = 120;
  const double top = Bounds(mesh).max().z();
  Box3 box;
  for (const Vec3& p : mesh.points) {
    if (p.z() > top - kTop_mm) {
      box.extend(p);
    }
  }
  return box;
}

void CheckSize(const SizeRange& range, double size_mm, bool is_cut, double spacing_mm,
               std::vector<std::string>& notes) {
  constexpr double kFarOff = 1.5;  // beyond a range by this factor, it is no head
  const bool too_small = !is_cut && size_mm<range.low_mm, too_large = size_mm> range.high_mm;
  if (!too_small && !too_large) {
    return;
  }
  const std::string words = fmt::format(
      "the head is {:.0f} mm {}, and heads are {:.0f} to {:.0f} mm: check the spacing of {}, "
      "{:.4g} mm",
      size_mm, range.direction, range.low_mm, range.high_mm, range.voxels, spacing_mm);
  if ((too_small && size_mm * kFarOff < range.low_mm) ||
      (too_large && size_mm > kFarOff * range.high_mm)) {
    throw InputError("import-ct: " + words);
  }
  notes.push_back(words + ", unless it is a part of a head");
}

}  // namespace

void CheckHeadExtent(const CtVolume& volume, const HeadMask& mask, const TriMesh& skin,
                     std::vector<std::string>& notes) {
  CheckSides(volume, mask, notes);
  const Box3 top = BoundsNearTop(skin), whole = Bounds(skin);
  const std::array<double, 3> sizes = {top.sizes().x(), top.sizes().y(), whole.sizes().z()};
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_cut = FindContact(volume, mask.head, axis, false).cm2 > kCut_cm2 ||
                        FindContact(volume, mask.head, axis, true).cm2 > kCut_cm2;
    CheckSize(kHeadSizes[axis], sizes[axis], is_cut, volume.spacing_mm[axis], notes);
  }
  // The breadth of a living head is two thirds to all of its length, nose and ears included.
  constexpr double kNarrow = 0.5, kBroad = 1.05;
  const double ratio = sizes[0] / sizes[1];
  if (ratio < kNarrow || ratio > kBroad) {
    notes.push_back(fmt::format(
        "the head is {:.0f} mm wide and {:.0f} mm long: check the spacing of columns and rows, "
        "{:.4g} x {:.4g} mm, unless it is a part of a head",
        sizes[0], sizes[1], volume.spacing_mm.x(), volume.spacing_mm.y()));
  }
}

}  // namespace semblance::problems
