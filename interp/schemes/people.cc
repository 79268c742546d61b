// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/people.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "interp/schemes/people_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/mesh/correspondences.h"

namespace semblance::interp {
namespace {

// ---------------------------------------------------------------------------------------------
// The file
// ---------------------------------------------------------------------------------------------

class PointReader {
 public:
  explicit PointReader(CsvReader& csv) : csv_(csv), site_(csv.RequireColumn("site")) {
    constexpr std::array<std::string_view, 9> kNumbers = {"x_mm",     "y_mm",     "z_mm",
                                                          "normal_x", "normal_y", "normal_z",
                                                          "log_mean", "log_sd",   "loading"};
    for (std::size_t k = 0; k < kNumbers.size(); ++k) {
      numbers_[k] = csv.RequireColumn(kNumbers[k]);
    }
  }

  std::string Site() const { return std::string(csv_.Cell(site_)); }

  PeoplePoint Point() const {
    const auto at = [&](std::size_t k) { return csv_.Number(numbers_[k]); };
    const Vec3 normal(at(3), at(4), at(5));
    const PeoplePoint point{{at(0), at(1), at(2)}, normal.normalized(), {at(6), at(7), at(8)}};
    if (!(normal.norm() > 0) || !(point.depth.sd > 0) || std::abs(point.depth.loading) > 1) {
      csv_.Fail("the normal must not be 0, log_sd must be above 0, and loading between -1 and 1");
    }
    return point;
  }

 private:
  CsvReader& csv_;
  std::size_t site_;
  std::array<std::size_t, 9> numbers_{};
};

// ---------------------------------------------------------------------------------------------
// Onto the subject
// ---------------------------------------------------------------------------------------------

// The deformed mean bone, point by point, then the sites in the order of their codes. The sites are
// carried along, and move no other point.
struct Carried {
  std::vector<Vec3> points, normals;
};

// Finds where the people's sites stand on the subject, by site code.
std::map<std::string, Vec3> KnownSites(const People& people, const DepthInput& input) {
  std::map<std::string, Vec3> seen;
  for (const std::span<const Dowel> dowels : {input.expected, input.dowels}) {
    for (const Dowel& dowel : dowels) {
      if (people.sites.contains(dowel.site)) {
        seen[dowel.site] = dowel.base;
      }
    }
  }
  return seen;
}

// Returns true if the sites do not fix the size of the head in all directions, as those in the
// middle of the face.
bool LieInAPlane(const People& people, const std::map<std::string, Vec3>& sites) {
  // Standard deviation; all sites have 24, one side with the middle 7. With less, landmarks that
  // are 2 mm off would turn or stretch the far side by 10 mm.
  constexpr double kThinnest_mm = 6;
  Eigen::Matrix3Xd places(3, std::ssize(sites));
  Eigen::Index k = 0;
  for (const auto& [site, base] : sites) {
    places.col(k++) = people.sites.at(site).position;
  }
  places.colwise() -= places.rowwise().mean().eval();
  const double thinnest = Eigen::JacobiSVD<Eigen::Matrix3Xd>(places).singularValues()[2];
  return thinnest < kThinnest_mm * std::sqrt(static_cast<double>(sites.size()));
}

ThinPlate PlateThrough(const People& people, const std::map<std::string, Vec3>& sites) {
  // Landmarks are some 2 mm off. A stiffness of half of this smooths them and keeps the head's
  // size.
  constexpr double kStiffness_mm = 1;
  std::vector<Vec3> from, to;
  for (const auto& [site, base] : sites) {
    from.push_back(people.sites.at(site).position);
    to.push_back(base);
  }
  return FitThinPlate(from, to, {}, {.stiffness_mm = kStiffness_mm});
}

Carried Place(const People& people, const ThinPlate& plate) {
  const Eigen::JacobiSVD<Mat3> svd(plate.affine.leftCols<3>(),
                                   Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 turn = svd.matrixU() * svd.matrixV().transpose();
  Carried carried;
  const auto carry = [&](const PeoplePoint& point) {
    carried.points.push_back(plate(point.position));
    carried.normals.emplace_back(turn * point.normal);
  };
  std::ranges::for_each(people.bone, carry);
  std::ranges::for_each(people.sites, [&](const auto& site) { carry(site.second); });
  return carried;
}

using Feet = std::vector<std::optional<Vec3>>;

// The bone that belongs to each carried point.
Feet FindFeet(const Carried& carried, const Correspondences& bone, double reach_mm, int threads) {
  constexpr double kLeastCosine = 0.5;  // turned by at most 60 degrees
  Feet feet(carried.points.size());
  ParallelFor(feet.size(), threads, 64, [&](std::size_t i) {
    if (const auto found = bone.Find(carried.points[i], carried.normals[i],
                                     {.reach_mm = reach_mm, .least_cosine = kLeastCosine})) {
      feet[i] = found->point.position;
    }
  });
  return feet;
}

// Moves each point by the mean way of the first `leading` points to their feet, with Gaussian
// weights.
void MoveSmoothly(Carried& carried, const Feet& feet, std::size_t leading, double width_mm,
                  int threads) {
  const std::vector<Vec3> from = carried.points;
  ParallelFor(from.size(), threads, 16, [&](std::size_t i) {
    Vec3 way = Vec3::Zero();
    double weights = 0;
    for (std::size_t k = 0; k < leading; ++k) {
      if (feet[k]) {
        const double weight =
            std::exp(-(from[k] - from[i]).squaredNorm() / (2 * width_mm * width_mm));
        way += weight * (*feet[k] - from[k]);
        weights += weight;
      }
    }
    carried.points[i] += way / std::max(weights, 1e-3);
  });
}

// A person's bone differs from the mean first in size and proportions, then in ever smaller forms.
// The widths are those with which the mean bone itself was laid on the 54 heads. A wider reach
// finds bone of another part, a narrower one loses a long face.
void FollowBone(Carried& carried, std::size_t leading, const Correspondences& bone,
                const RunContext& run) {
  struct Stage {
    double width_mm;
    int rounds;
  };
  constexpr double kReach_mm = 12;
  for (const Stage stage : {Stage{60, 4}, Stage{25, 4}, Stage{12, 6}}) {
    for (int round = 0; round < stage.rounds; ++round) {
      run.ThrowIfStopped();
      const Feet feet = FindFeet(carried, bone, kReach_mm, run.threads);
      MoveSmoothly(carried, feet, leading, stage.width_mm, run.threads);
    }
  }
}

// The distance from a point of the bone out to the filled skull.
double GapTo(const MeshQuery& skull, const Vec3& point, const Vec3& normal) {
  constexpr double kMost_mm = 40;   // deeper than any temporal fossa
  constexpr double kNone_mm = 1.5;  // as far as the carried bone may lie below the true one
  const std::optional<MeshPoint> hit = skull.FirstHit(point, normal, kMost_mm);
  return hit && hit->distance_mm > kNone_mm ? hit->distance_mm : 0;
}

std::vector<SubjectPoint> PointsOnSkull(const People& people, const Carried& carried,
                                        const Feet& feet, const DepthInput& input) {
  const MeshQuery skull(input.skull);
  std::vector<SubjectPoint> points;
  for (std::size_t i = 0; i < people.bone.size(); ++i) {
    const Vec3& normal = carried.normals[i];
    const double gap_mm =
        feet[i] && input.bone != nullptr ? GapTo(skull, carried.points[i], normal) : 0;
    if (feet[i]) {
      points.push_back({carried.points[i] + gap_mm * normal, normal, people.bone[i].depth, gap_mm});
    }
  }
  return points;
}

std::map<std::string, Vec3> SitesOnBone(const People& people, const Feet& feet) {
  std::map<std::string, Vec3> sites;
  std::size_t at = people.bone.size();
  for (const auto& [site, point] : people.sites) {
    if (const std::optional<Vec3>& foot = feet[at++]) {
      sites[site] = *foot;
    }
  }
  return sites;
}

CarriedBone Fault(std::string words) { return {{}, {}, std::move(words)}; }

}  // namespace

People ReadPeople(std::string_view text, std::string_view name) {
  CsvReader csv(text, name);
  const PointReader reader(csv);
  People people;
  while (csv.NextRow()) {
    const PeoplePoint point = reader.Point();
    if (reader.Site().empty()) {
      people.bone.push_back(point);
    } else if (!people.sites.emplace(reader.Site(), point).second) {
      csv.Fail(fmt::format("site {} has a second row", reader.Site()));
    }
  }
  return people;
}

const People& CarriedPeople() {
  static const People kPeople = ReadPeople(PeopleFile(), "the program's people");
  return kPeople;
}

CarriedBone CarryToSubject(const People& people, const DepthInput& input, const RunContext& run) {
  constexpr double kFarthest_mm = 6;  // from the bone; a point farther off stands for missing bone
  constexpr std::size_t kFewestSites = 6;
  constexpr std::size_t kFewest = 4;  // one in so many points; skulls without mandible have most
  const std::map<std::string, Vec3> sites = KnownSites(people, input);
  if (sites.size() < kFewestSites) {
    return Fault(fmt::format(
        "{} dowels stand at sites whose depth in people is known, and at least {} place it",
        sites.size(), kFewestSites));
  }
  if (LieInAPlane(people, sites)) {
    return Fault("the dowels at known sites lie almost in one plane");
  }
  const TriMesh& bone = input.bone != nullptr ? *input.bone : input.skull;
  Carried carried = Place(people, PlateThrough(people, sites));
  // Points beyond the end of a scan would pile up at its border.
  const Correspondences on_bone(bone, OpenBorder::kReject);
  FollowBone(carried, people.bone.size(), on_bone, run);
  const Feet feet = FindFeet(carried, on_bone, kFarthest_mm, run.threads);
  std::vector<SubjectPoint> points = PointsOnSkull(people, carried, feet, input);
  if (points.size() * kFewest < people.bone.size()) {
    return Fault(fmt::format(
        "bone is found at {} of {} points of people's facial bone; the skull lacks most of its "
        "face, or its landmarks are wrong",
        points.size(), people.bone.size()));
  }
  return {std::move(points), SitesOnBone(people, feet), {}};
}

}  // namespace semblance::interp
