// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/folds/fold_check.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "fitting/folds/turned_samples.h"
#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

// Bounds the time, which grows with the square of the number of means.
constexpr std::size_t kMostMeans = 2000;
// Below this share of its area in space a place has collapsed. A wall of 88.5 degrees seen from
// above keeps that much; a higher share refuses steeper height fields.
constexpr double kLeastArea = 1.0 / 40;

// A sample and the 16 others that are nearest on the map, and in space.
struct PointNeighbourhood {
  NearestSamples on_map{}, in_space{};
  double spacing_mm = kNaN;  // distance of the 4th in space
};

// Judges some of the samples by their neighbours on the map and in space.
class Prober {
 public:
  Prober(std::vector<MapSample> samples, double period_mm, std::size_t most_probes)
      : period_mm_(period_mm), samples_(std::move(samples)), most_probes_(most_probes) {}

  MapFaults Run() const {
    const std::vector<PointNeighbourhood> probes = Probes();
    if (probes.size() < kFewestSamples) {
      return {};
    }
    std::vector<double> spacings_mm;
    for (const PointNeighbourhood& probe : probes) {
      spacings_mm.push_back(probe.spacing_mm);
    }
    const double usual_mm = UpperMedian(spacings_mm);
    int folded = 0, collapsed = 0;
    for (const PointNeighbourhood& probe : probes) {
      const bool mixes = IsFolded(probe, std::max(usual_mm, probe.spacing_mm));
      folded += mixes ? 1 : 0;
      collapsed += !mixes && IsCollapsed(probe) ? 1 : 0;
    }
    const double all = static_cast<double>(probes.size());
    return {.folded = folded / all, .collapsed = collapsed / all};
  }

 private:
  std::uint32_t Count() const { return static_cast<std::uint32_t>(samples_.size()); }

  // The neighbourhoods of the probed samples that lie on a sheet.
  std::vector<PointNeighbourhood> Probes() const {
    const std::size_t every = (samples_.size() + most_probes_ - 1) / most_probes_;
    std::vector<PointNeighbourhood> probes;
    for (std::size_t k = 0; Count() >= kFewestSamples && k < samples_.size(); k += every) {
      const auto own = static_cast<std::uint32_t>(k);
      PointNeighbourhood probe{.in_space = NearestInSpace(samples_, own)};
      if (PlaneAround(samples_, probe.in_space).is_sheet) {
        probe.on_map = NearestBy(Count(), own, [&](std::uint32_t n) {
          return Way(samples_[own].at, samples_[n].at, period_mm_).squaredNorm();
        });
        probe.spacing_mm = (samples_[probe.in_space[4]].position - samples_[own].position).norm();
        probes.push_back(probe);
      }
    }
    return probes;
  }

  // Compares the second moments of the nearest samples on the map and in space. Samples on one scan
  // line, with noise across it, do not decide.
  bool IsCollapsed(const PointNeighbourhood& probe) const {
    // Least product of two variances over the square of their sum, for samples that spread over an
    // area. A line whose width is a third of its length has 0.09.
    constexpr double kOnLine = 0.08;
    const MapSample& own = samples_[probe.in_space[0]];
    Eigen::Matrix2d on_map = Eigen::Matrix2d::Zero();
    Mat3 in_space = Mat3::Zero();
    for (const std::uint32_t n : probe.in_space) {
      const Vec2 way = Way(own.at, samples_[n].at, period_mm_);
      const Vec3 off = samples_[n].position - own.position;
      on_map += way * way.transpose();
      in_space += off * off.transpose();
    }
    const double trace = in_space.trace(),
                 square = (trace * trace - (in_space * in_space).trace()) / 2;  // of an area
    return square > kOnLine * trace * trace &&
           on_map.determinant() < kLeastArea * kLeastArea * square;
  }

  // Groups the samples of a neighbourhood that are connected in space by links up to link_mm long.
  // Group 0 is that of the sample itself.
  std::array<int, kNearWithItself> ClustersOf(const PointNeighbourhood& probe,
                                              double link_mm) const {
    std::array<int, kNearWithItself> cluster;
    cluster.fill(-1);
    int count = 0;
    for (int first = 0; first < kNearWithItself; ++first) {
      std::vector<int> open;
      if (cluster[first] < 0) {
        cluster[first] = count++;
        open.push_back(first);
      }
      while (!open.empty()) {
        const int a = open.back();
        open.pop_back();
        for (int b = 0; b < kNearWithItself; ++b) {
          const Vec3 apart = PositionOf(probe, a) - PositionOf(probe, b);
          if (cluster[b] < 0 && apart.squaredNorm() < link_mm * link_mm) {
            cluster[b] = cluster[a];
            open.push_back(b);
          }
        }
      }
    }
    return cluster;
  }

  const Vec3& PositionOf(const PointNeighbourhood& probe, int n) const {
    return samples_[probe.on_map[n]].position;
  }

  bool IsFolded(const PointNeighbourhood& probe, double spacing_mm) const {
    // Links up to three spacings connect samples of one sheet across holes and noise; sheets that
    // lie closer together are not told apart.
    constexpr double kLink = 3;
    const std::array<int, kNearWithItself> cluster = ClustersOf(probe, kLink * spacing_mm);
    const int last = *std::max_element(cluster.begin(), cluster.end());
    for (int other = 1; other <= last; ++other) {
      if (AreMixed(probe, cluster, other) && IsSheet(probe, cluster, 0) &&
          IsSheet(probe, cluster, other)) {
        return true;
      }
    }
    return false;
  }

  // Returns whether at least three samples and two thirds of a cluster lie on sheets.
  bool IsSheet(const PointNeighbourhood& probe, const std::array<int, kNearWithItself>& cluster,
               int which) const {
    constexpr int kFewest = 3;
    int count = 0, on_sheet = 0;
    for (int n = 0; n < kNearWithItself; ++n) {
      if (cluster[n] == which) {
        ++count;
        on_sheet +=
            PlaneAround(samples_, NearestInSpace(samples_, probe.on_map[n])).is_sheet ? 1 : 0;
      }
    }
    return on_sheet >= kFewest && 3 * on_sheet >= 2 * count;
  }

  // Returns whether the map mixes a cluster with that of the sample, instead of putting them side
  // by side.
  bool AreMixed(const PointNeighbourhood& probe, const std::array<int, kNearWithItself>& cluster,
                int other) const {
    // Two clusters side by side have their means about one sum of radii apart, mixed ones none.
    constexpr double kApart = 0.5;
    Vec2 mean[2] = {Vec2::Zero(), Vec2::Zero()};
    double squares[2] = {0, 0}, count[2] = {0, 0};
    for (int n = 0; n < kNearWithItself; ++n) {
      if (cluster[n] == 0 || cluster[n] == other) {
        const int which = cluster[n] == 0 ? 0 : 1;
        const Vec2 way =
            Way(samples_[probe.on_map[0]].at, samples_[probe.on_map[n]].at, period_mm_);
        mean[which] += way;
        squares[which] += way.squaredNorm();
        count[which] += 1;
      }
    }
    double radii = 0;
    for (const int which : {0, 1}) {
      mean[which] /= count[which];
      radii += std::sqrt(std::max(squares[which] / count[which] - mean[which].squaredNorm(), 0.0));
    }
    return (mean[0] - mean[1]).norm() < kApart * radii;
  }

  double period_mm_;
  std::vector<MapSample> samples_;
  std::size_t most_probes_;
};

// Area of triangles. On the map it is negative for those that run clockwise.
struct MappedArea {
  double in_space = 0, on_map = 0;

  MappedArea& operator+=(const MappedArea& other) {
    in_space += other.in_space;
    on_map += other.on_map;
    return *this;
  }
};

double AreaInSpace(std::span<const Vec3> positions, const Triangle& t) {
  const Vec3& p = positions[t[0]];
  return (positions[t[1]] - p).cross(positions[t[2]] - p).norm() / 2;
}

double AreaOnMap(const PlaneMap& map, const Triangle& t) {
  const Vec2 a = Way(map.at[t[0]], map.at[t[1]], map.period_mm),
             b = Way(map.at[t[0]], map.at[t[2]], map.period_mm);
  return (a.x() * b.y() - a.y() * b.x()) / 2;
}

class FaultSum {
 public:
  // weight: the area of the surface that is judged.
  void Add(const MappedArea& area, double weight) {
    if (std::abs(area.on_map) < kLeastArea * area.in_space) {
      collapsed_ += weight;
    } else {
      turned_[area.on_map > 0 ? 1 : 0] += weight;
    }
  }
  MapFaults Faults() const {
    const double all = turned_[0] + turned_[1] + collapsed_;
    return all > 0 ? MapFaults{.folded = std::min(turned_[0], turned_[1]) / all,
                               .collapsed = collapsed_ / all,
                               .mirrored = turned_[0] > turned_[1]}
                   : MapFaults{};
  }

 private:
  double turned_[2] = {0, 0}, collapsed_ = 0;
};

// The areas around a point.
struct PointAreas {
  MappedArea around;   // sum over two rings of triangles, in which the nearer ones count more often
  double own_mm2 = 0;  // a third of the triangles of which the point is a corner
};

std::vector<PointAreas> AreasAround(std::span<const Vec3> positions,
                                    std::span<const Triangle> triangles,
                                    std::span<const double> on_map) {
  constexpr int kRings = 2;
  std::vector<PointAreas> points(positions.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const MappedArea area{AreaInSpace(positions, triangles[k]), on_map[k]};
    for (const std::int32_t corner : triangles[k]) {
      points[corner].around += area;
      points[corner].own_mm2 += area.in_space / 3;
    }
  }
  std::vector<MappedArea> wider(positions.size());
  for (int ring = 0; ring < kRings; ++ring) {
    std::ranges::fill(wider, MappedArea());
    for (const Triangle& t : triangles) {
      MappedArea sum;
      for (const std::int32_t corner : t) {
        sum += points[corner].around;
      }
      for (const std::int32_t corner : t) {
        wider[corner] += sum;
      }
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      points[k].around = wider[k];
    }
  }
  return points;
}

}  // namespace

MapFaults FaultsOfPoints(const PlaneMap& map) {
  // More probes cost time in proportion; with 500 a share of 2 % has a standard error of 0.6 %.
  constexpr std::size_t kProbes = 500, kFineProbes = 300;
  constexpr std::size_t kFewerMeans = 1000, kPerMean = 6;  // means over at least six points
  constexpr double kMostly = 0.5;  // share of samples on sheets, below which noise is too wide
  const std::size_t count = map.positions.size();
  const bool many = count > kMostMeans;
  const std::vector<MapSample> points = ThinnedSamples(map);
  const std::vector<MapSample> most = many ? MeanSamples(map, kMostMeans) : points;
  MapFaults faults = Prober(points, map.period_mm, many ? kFineProbes : kProbes).Run();
  if (many) {
    const MapFaults of_means = Prober(most, map.period_mm, kProbes).Run();
    // The points of one scan line are closer together than their noise and look like a wall.
    faults = {.folded = std::max(faults.folded, of_means.folded), .collapsed = of_means.collapsed};
  }
  const TurnedSamples of_most = FindTurned(most, map.period_mm);
  faults.folded = std::max(faults.folded, of_most.turned);
  // If noise is as wide as the spacing of the points, only means over more of them lie on sheets.
  if (const std::size_t fewer = std::min(kFewerMeans, count / kPerMean);
      of_most.on_sheet < kMostly && fewer >= kFewestSamples) {
    const TurnedSamples of_few = FindTurned(MeanSamples(map, fewer), map.period_mm);
    faults.folded = std::max(faults.folded, of_few.turned);
  }
  return faults;
}

MapFaults FaultsOfTriangles(const PlaneMap& map, std::span<const Triangle> triangles) {
  FaultSum sum;
  for (const Triangle& t : triangles) {
    const MappedArea area{AreaInSpace(map.positions, t), AreaOnMap(map, t)};
    sum.Add(area, area.in_space);
  }
  return sum.Faults();
}

MapFaults FaultsBeyondNoise(const PlaneMap& map, std::span<const Triangle> triangles) {
  std::vector<double> on_map;
  on_map.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    on_map.push_back(AreaOnMap(map, t));
  }
  FaultSum sum;
  for (const PointAreas& point : AreasAround(map.positions, triangles, on_map)) {
    sum.Add(point.around, point.own_mm2);
  }
  return sum.Faults();
}

namespace {

// Scales the positions to unit variance along each principal axis along which they have one.
std::vector<MapSample> Whitened(std::vector<MapSample> samples) {
  constexpr double kRoundOff = 1e-12;  // relative to the largest variance
  Vec3 mean = Vec3::Zero();
  for (const MapSample& sample : samples) {
    mean += sample.position / static_cast<double>(samples.size());
  }
  Mat3 moments = Mat3::Zero();
  for (const MapSample& sample : samples) {
    const Vec3 off = sample.position - mean;
    moments += off * off.transpose() / static_cast<double>(samples.size());
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  for (MapSample& sample : samples) {
    Vec3 along = eigen.eigenvectors().transpose() * (sample.position - mean);
    for (int c = 0; c < 3; ++c) {
      const double square = eigen.eigenvalues()[c];
      along[c] *= square > kRoundOff * eigen.eigenvalues()[2] ? 1 / std::sqrt(square) : 0;
    }
    sample.position = along;
  }
  return samples;
}

// At most `most` samples, evenly chosen.
std::vector<MapSample> FewerSamples(const PlaneMap& map, std::size_t most) {
  std::vector<MapSample> samples = ThinnedSamples(map), fewer;
  const std::size_t every = (samples.size() + most - 1) / most;
  for (std::size_t k = 0; k < samples.size(); k += std::max<std::size_t>(every, 1)) {
    fewer.push_back(samples[k]);
  }
  return fewer;
}

double SquaresAroundMean(const std::vector<MapSample>& samples, const NearestSamples& indices) {
  Vec3 mean = Vec3::Zero();
  for (const std::uint32_t n : indices) {
    mean += samples[n].position / kNearWithItself;
  }
  double sum = 0;
  for (const std::uint32_t n : indices) {
    sum += (samples[n].position - mean).squaredNorm();
  }
  return sum / (kNearWithItself - 1);
}

double SquaresAroundPlane(const std::vector<MapSample>& samples, const NearestSamples& indices,
                          double period_mm) {
  Eigen::Matrix<double, kNearWithItself, 3> rows, values;
  for (int n = 0; n < kNearWithItself; ++n) {
    const Vec2 way = Way(samples[indices[0]].at, samples[indices[n]].at, period_mm);
    rows.row(n) << 1, way.x(), way.y();
    values.row(n) = (samples[indices[n]].position - samples[indices[0]].position).transpose();
  }
  const auto decomposition = rows.colPivHouseholderQr();
  return (values - rows * decomposition.solve(values)).squaredNorm() /
         static_cast<double>(kNearWithItself - decomposition.rank());
}

// Samples from everywhere: spread over the order, from `own` on.
NearestSamples FromEverywhere(std::size_t count, std::size_t own) {
  NearestSamples indices;
  for (std::size_t n = 0; n < indices.size(); ++n) {
    indices[n] = static_cast<std::uint32_t>((own + n * count / indices.size()) % count);
  }
  return indices;
}

// The square of the shortest range that holds eleven of the seventeen x. Outliers that are fewer
// than a third of them do not count.
double ShortestSpread(const std::vector<MapSample>& samples, const NearestSamples& indices) {
  constexpr int kMost = 11;
  std::array<double, kNearWithItself> x;
  std::ranges::transform(indices, x.begin(),
                         [&](std::uint32_t n) { return samples[n].position.x(); });
  std::ranges::sort(x);
  double shortest = x.back() - x.front();
  for (int n = 0; n + kMost <= kNearWithItself; ++n) {
    shortest = std::min(shortest, x[n + kMost - 1] - x[n]);
  }
  return shortest * shortest;
}

// The median of a measure of neighbours over the median of a measure of samples from everywhere.
template <class Near, class Anywhere>
double RatioToAnywhere(const std::vector<MapSample>& samples, double period_mm,
                       const Near& near_measure, const Anywhere& anywhere_measure) {
  constexpr std::size_t kProbes = 300;
  if (samples.size() <= kNearWithItself) {
    return 0;
  }
  const auto count = static_cast<std::uint32_t>(samples.size());
  std::vector<double> near, anywhere;
  for (std::uint32_t own = 0; own < count; own += std::max<std::size_t>(count / kProbes, 1)) {
    near.push_back(near_measure(NearestBy(count, own, [&](std::uint32_t n) {
      return Way(samples[own].at, samples[n].at, period_mm).squaredNorm();
    })));
    anywhere.push_back(anywhere_measure(FromEverywhere(count, own)));
  }
  const double all = UpperMedian(anywhere);
  return all > 0 ? UpperMedian(near) / all : 0;
}

constexpr std::size_t kMostSamples = 8000;  // bounds the time of the following

}  // namespace

double MixedShare(const PlaneMap& map) {
  constexpr std::size_t kProbes = 300;  // a share of 10 % has a standard error of 2 %
  return Prober(Whitened(FewerSamples(map, kMostSamples)), map.period_mm, kProbes).Run().folded;
}

double NeighbourScatter(const PlaneMap& map) {
  const std::vector<MapSample> samples = FewerSamples(map, kMostSamples);
  return RatioToAnywhere(
      samples, map.period_mm,
      [&](const NearestSamples& near) { return SquaresAroundPlane(samples, near, map.period_mm); },
      [&](const NearestSamples& anywhere) { return SquaresAroundMean(samples, anywhere); });
}

double ScatterOfMostHeights(const PlaneMap& map) {
  const std::vector<MapSample> samples = FewerSamples(map, kMostSamples);
  const auto spread = [&](const NearestSamples& indices) {
    return ShortestSpread(samples, indices);
  };
  return RatioToAnywhere(samples, map.period_mm, spread, spread);
}

}  // namespace semblance::fitting
