// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/mandible.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_primitives.h"

namespace semblance::problems {
namespace {

std::vector<SitePoint> SitesOfJaw(std::span<const SitePoint> sites, bool mandible) {
  std::vector<SitePoint> part;
  std::ranges::copy_if(sites, std::back_inserter(part),
                       [mandible](const SitePoint& s) { return IsOfMandible(s.site) == mandible; });
  return part;
}

std::optional<SkullFit> FitPart(std::span<const SitePoint> sites) try {
  constexpr std::size_t kMinSites = 4;  // one more than a similarity needs, so that it is checked
  return sites.size() < kMinSites ? std::nullopt : std::optional(FitAverageSkull(sites));
} catch (const InputError&) {  // the sites lie on a line
  return std::nullopt;
}

// The rotation's angle about x, from y to z. With a hinge from right to left a mouth opens this
// way.
double TurnAboutX_deg(const Mat3& r) {
  return std::atan2(r(2, 1) - r(1, 2), r(1, 1) + r(2, 2)) * 180 / std::numbers::pi;
}

constexpr double kDegree = std::numbers::pi / 180;
// Condyles of adults are 80 to 120 mm apart; 40 leaves a wide margin for small skulls.
constexpr double kMinCondyleDistance_mm = 40;

Vec3 BitePoint(const LandmarkFile& file, const std::string& site) {
  const Landmark* const found = file.Find(site);
  if (found == nullptr) {
    throw InputError(fmt::format(
        "subject.mandible.bite_mm: the bite is the distance from pr to id, and there is no "
        "landmark {}; place it, or give opening_deg",
        DescribeSite(site)));
  }
  return found->Position();
}

double ChosenOpening_deg(const MandibleOptions& options, const Hinge& hinge,
                         const LandmarkFile& file) {
  return options.bite_mm ? OpeningForBite_deg(hinge, BitePoint(file, "pr"), BitePoint(file, "id"),
                                              *options.bite_mm)
                         : options.opening_deg.value_or(0);
}

void TurnLandmark(const Hinge& hinge, double opening_deg, Landmark& landmark) {
  const Vec3 from = landmark.Position(), to = hinge.Opened(from, opening_deg);
  landmark.MoveTo(to);
  if (landmark.normal) {
    const Vec3 tip = hinge.Opened(from + Vec3(landmark.normal->data()), opening_deg);
    landmark.normal = {tip.x() - to.x(), tip.y() - to.y(), tip.z() - to.z()};
  }
}

}  // namespace

bool IsOfMandible(std::string_view site) {
  constexpr std::array<std::string_view, 10> kMandible = {"id", "sm",  "pg", "me", "go",
                                                          "mr", "iM2", "gn", "iC", "mmb"};
  return std::ranges::find(kMandible, WithoutSide(site)) != kMandible.end();
}

std::array<Vec3, 2> AverageCondyles() {
  const Vec3 left = AverageSite("sgl_l") + Vec3(-10, -5, -11);
  return {left, Vec3(-left.x(), left.y(), left.z())};
}

std::optional<JawPose> FindJawPose(std::span<const SitePoint> sites) {
  const std::vector<SitePoint> lower = SitesOfJaw(sites, /*mandible=*/true);
  const auto cranium = FitPart(SitesOfJaw(sites, /*mandible=*/false)), mandible = FitPart(lower);
  if (!cranium || !mandible) {
    return std::nullopt;
  }
  std::vector<double> off_mm;
  off_mm.reserve(lower.size());
  for (const SitePoint& s : lower) {
    off_mm.push_back((s.point - cranium->Predicted(s.site)).norm());
  }
  const Mat3 between =
      cranium->skull_from_average.rotation.transpose() * mandible->skull_from_average.rotation;
  return JawPose{.opening_deg = TurnAboutX_deg(between), .off_mm = UpperMedian(off_mm)};
}

std::string CondyleFault(const std::array<double, 3>& left, const std::array<double, 3>& right) {
  const double apart_mm = (Vec3(left.data()) - Vec3(right.data())).norm();
  if (!(apart_mm >= kMinCondyleDistance_mm)) {
    return fmt::format(
        "the condyles are {:.1f} mm apart, and an axis needs at least {} mm; give the middle of "
        "each, in mm",
        apart_mm, kMinCondyleDistance_mm);
  }
  if (!(left[0] > right[0])) {
    return fmt::format(
        "the left condyle lies to the right of the right one (x of {} and {} mm; in LPS +x is the "
        "subject's left); exchange the two, or negate x and y of points that are RAS",
        left[0], right[0]);
  }
  return "";
}

Vec3 Hinge::Opened(const Vec3& p, double opening_deg) const {
  if (opening_deg == 0) {
    return p;
  }
  return left + Eigen::AngleAxisd(opening_deg * kDegree, (left - right).normalized()) * (p - left);
}

Hinge FindHinge(const MandibleOptions& options, const LandmarkFile& landmarks) {
  if (options.condyle_left && options.condyle_right) {
    if (const std::string fault = CondyleFault(*options.condyle_left, *options.condyle_right);
        !fault.empty()) {
      throw InputError("subject.mandible.condyle_left: " + fault);
    }
    return {Vec3(options.condyle_left->data()), Vec3(options.condyle_right->data())};
  }
  std::vector<SitePoint> cranium = landmarks.Points();
  std::erase_if(cranium,
                [](const SitePoint& s) { return !IsStandardSite(s.site) || IsOfMandible(s.site); });
  const Similarity pose = FitAverageSkull(cranium).skull_from_average;
  const auto [left, right] = AverageCondyles();
  return {pose * left, pose * right};
}

// The law of cosines: the squared distance is d^2 = a - b cos(angle - at), where a and b follow
// from the distances of both points from the axis, and a also contains their distance along it.
double OpeningForBite_deg(const Hinge& hinge, const Vec3& upper, const Vec3& lower,
                          double bite_mm) {
  const Vec3 axis = (hinge.left - hinge.right).normalized();
  const auto off_axis = [&](const Vec3& p) {
    const Vec3 d = p - hinge.left;
    return Vec3(d - d.dot(axis) * axis);
  };
  const Vec3 u = off_axis(upper), l = off_axis(lower);
  const double along = (lower - upper).dot(axis);
  const double a = u.squaredNorm() + l.squaredNorm() + along * along, b = 2 * u.norm() * l.norm();
  const double at = std::atan2(axis.dot(l.cross(u)), l.dot(u));
  const double cosine = (a - bite_mm * bite_mm) / b;
  if (!(std::abs(cosine) <= 1)) {
    throw InputError(fmt::format(
        "subject.mandible.bite_mm: pr and id cannot be {} mm apart: turned about the condyles they "
        "are {:.1f} to {:.1f} mm apart; give another distance, or correct the landmarks",
        bite_mm, std::sqrt(std::max(0.0, a - b)), std::sqrt(a + b)));
  }
  const double first = at + std::acos(cosine), second = at - std::acos(cosine);
  return (std::abs(first) <= std::abs(second) ? first : second) / kDegree;
}

std::vector<std::string> AddMandible(const MandibleOptions& options, TriMesh mandible,
                                     TriMesh& skull, LandmarkFile& landmarks) {
  std::vector<std::string> notes;
  if (options.opening_deg.value_or(0) != 0 || options.bite_mm) {
    const Hinge hinge = FindHinge(options, landmarks);
    const double opening_deg = ChosenOpening_deg(options, hinge, landmarks);
    for (Vec3& p : mandible.points) {
      p = hinge.Opened(p, opening_deg);
    }
    for (Landmark& landmark : landmarks.landmarks) {
      if (IsOfMandible(landmark.site)) {
        TurnLandmark(hinge, opening_deg, landmark);
      }
    }
    notes.push_back(fmt::format(
        "the mandible and its landmarks are {} by {:.1f} degrees about the condyles, at ({:.0f}, "
        "{:.0f}, {:.0f}) and ({:.0f}, {:.0f}, {:.0f}); a true skin stays as it was scanned",
        opening_deg > 0 ? "opened" : "closed", std::abs(opening_deg), hinge.left.x(),
        hinge.left.y(), hinge.left.z(), hinge.right.x(), hinge.right.y(), hinge.right.z()));
  }
  Append(skull, mandible);
  return notes;
}

}  // namespace semblance::problems
