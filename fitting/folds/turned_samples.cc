// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/folds/turned_samples.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace semblance::fitting {
namespace {

struct SheetSample {
  NearestSamples nearest{};
  bool is_sheet = false;
  Vec3 normal = Vec3::Zero();  // unit; to either side
  double area_left = 0;        // area on the map over area in space; negative if turned over
};

// The area on the map over the area on the plane, counter-clockwise seen from the plane's normal:
// the determinant of the linear map of least squares.
double AreaLeft(const SheetPlane& plane, const std::vector<MapSample>& samples,
                const NearestSamples& nearest, double period_mm) {
  const Vec3 across = plane.axes.col(2), third = plane.axes.col(0).cross(across);
  const Vec2& own = samples[nearest[0]].at;
  Vec2 mean = Vec2::Zero();
  for (int n = 1; n < kNearWithItself; ++n) {
    mean += Way(own, samples[nearest[n]].at, period_mm) / kNearSamples;
  }
  Eigen::Matrix2d mixed = Eigen::Matrix2d::Zero(), on_plane = Eigen::Matrix2d::Zero();
  for (int n = 1; n < kNearWithItself; ++n) {
    const Vec3 off = samples[nearest[n]].position - plane.mean;
    const Vec2 place(off.dot(across), off.dot(third));
    mixed += (Way(own, samples[nearest[n]].at, period_mm) - mean) * place.transpose();
    on_plane += place * place.transpose();
  }
  return mixed.determinant() / on_plane.determinant();
}

std::vector<SheetSample> SheetSamples(const std::vector<MapSample>& samples, double period_mm) {
  std::vector<SheetSample> sheets;
  sheets.reserve(samples.size());
  for (std::uint32_t k = 0; k < samples.size(); ++k) {
    SheetSample sheet{.nearest = NearestInSpace(samples, k)};
    const SheetPlane plane = PlaneAround(samples, sheet.nearest);
    sheet.is_sheet = plane.is_sheet;
    sheet.normal = plane.axes.col(0);
    sheet.area_left = AreaLeft(plane, samples, sheet.nearest, period_mm);
    sheets.push_back(sheet);
  }
  return sheets;
}

// Disjoint sets of samples that form one piece, in which each sample has the side of its normal
// against that of the piece's first sample.
class Pieces {
 public:
  explicit Pieces(std::size_t count) : up_(count), side_(count, 1) {
    std::iota(up_.begin(), up_.end(), 0U);
  }

  struct Place {
    std::uint32_t piece;
    int side;  // 1 or -1
  };
  Place PlaceOf(std::uint32_t k) const {
    int side = 1;
    for (; up_[k] != k; k = up_[k]) {
      side *= side_[k];
    }
    return {k, side};
  }
  // side: 1 if the normals of a and b look to the same side, else -1.
  void Join(std::uint32_t a, std::uint32_t b, int side) {
    const Place of_a = PlaceOf(a), of_b = PlaceOf(b);
    if (of_a.piece != of_b.piece) {
      up_[of_a.piece] = of_b.piece;
      side_[of_a.piece] = of_a.side * of_b.side * side;
    }
  }

 private:
  std::vector<std::uint32_t> up_;
  std::vector<int> side_;
};

Pieces Join(const std::vector<SheetSample>& sheets) {
  constexpr int kNext = 8;  // neighbours per sample; more would join sheets that lie close together
  // Cosine of 60 degrees: across a sharper bend the side of a normal is not carried on.
  constexpr double kLeastAlike = 0.5;
  struct Pair {
    double alike;
    std::uint32_t a, b;
  };
  std::vector<Pair> pairs;
  for (std::uint32_t a = 0; a < sheets.size(); ++a) {
    for (int n = 1; n <= kNext && sheets[a].is_sheet; ++n) {
      const std::uint32_t b = sheets[a].nearest[n];
      const double alike = std::abs(sheets[a].normal.dot(sheets[b].normal));
      if (sheets[b].is_sheet && alike > kLeastAlike) {
        pairs.push_back({alike, a, b});
      }
    }
  }
  std::ranges::stable_sort(pairs, std::ranges::greater(), &Pair::alike);
  Pieces pieces(sheets.size());
  for (const Pair& pair : pairs) {
    pieces.Join(pair.a, pair.b, sheets[pair.a].normal.dot(sheets[pair.b].normal) > 0 ? 1 : -1);
  }
  return pieces;
}

// Samples that have a side, because more than a share of their area is left on the map.
struct Sided {
  std::size_t count = 0, turned = 0;
};
Sided CountTurned(const std::vector<SheetSample>& sheets, const Pieces& pieces, double least_left) {
  std::vector<std::array<std::size_t, 2>> sides(sheets.size(), {0, 0});  // of each piece
  Sided sided;
  for (std::uint32_t k = 0; k < sheets.size(); ++k) {
    if (sheets[k].is_sheet && std::abs(sheets[k].area_left) > least_left) {
      const auto [piece, side] = pieces.PlaceOf(k);
      ++sided.count;
      ++sides[piece][side * sheets[k].area_left > 0 ? 1 : 0];
    }
  }
  for (const auto& [one, other] : sides) {
    sided.turned += std::min(one, other);
  }
  return sided;
}

}  // namespace

TurnedSamples FindTurned(const std::vector<MapSample>& samples, double period_mm) {
  if (samples.size() < kFewestSamples) {
    return {};
  }
  const std::vector<SheetSample> sheets = SheetSamples(samples, period_mm);
  const Pieces pieces = Join(sheets);
  const auto on_sheet = static_cast<double>(std::ranges::count_if(sheets, &SheetSample::is_sheet));
  TurnedSamples found{.on_sheet = on_sheet / static_cast<double>(samples.size())};
  for (const double least_left : {0.1, 0.02}) {  // see turned_samples.h
    const Sided sided = CountTurned(sheets, pieces, least_left);
    if (sided.count >= kFewestSamples) {
      found.turned = static_cast<double>(sided.turned) / static_cast<double>(sided.count);
      break;
    }
  }
  return found;
}

}  // namespace semblance::fitting
