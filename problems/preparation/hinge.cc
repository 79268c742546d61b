// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/preparation/hinge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "problems/pictures/mesh_primitives.h"
#include "problems/subject/jaw_pose.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLeastCondyles_mm = 40;  // apart; those of adults are 80 to 120

Vec3 PointOf(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

Vec3 PointAt(const LandmarkFile& file, const std::string& site) {
  const auto found = std::ranges::find(file.landmarks, site, &Landmark::site);
  if (found == file.landmarks.end()) {
    throw InputError(fmt::format(
        "subject.mandible.bite_mm: the bite is the distance of pr and id, and there is no landmark "
        "{}; place it, or give opening_deg",
        SiteInWords(site)));
  }
  return PointOf(found->point);
}

double OpeningOf(const MandibleOptions& options, const Hinge& hinge, const LandmarkFile& file) {
  return options.bite_mm
             ? OpeningForBite_deg(hinge, PointAt(file, "pr"), PointAt(file, "id"), *options.bite_mm)
             : options.opening_deg.value_or(0);
}

void TurnLandmark(const Hinge& hinge, double opening_deg, Landmark& landmark) {
  const Vec3 from = PointOf(landmark.point), to = hinge.Opened(from, opening_deg);
  landmark.point = {to.x(), to.y(), to.z()};
  if (landmark.normal) {
    const Vec3 tip = hinge.Opened(from + PointOf(*landmark.normal), opening_deg);
    landmark.normal = {tip.x() - to.x(), tip.y() - to.y(), tip.z() - to.z()};
  }
}

}  // namespace

std::string CondyleFault(const std::array<double, 3>& left, const std::array<double, 3>& right) {
  const double apart_mm = (PointOf(left) - PointOf(right)).norm();
  if (!(apart_mm >= kLeastCondyles_mm)) {
    return fmt::format(
        "the condyles are {:.1f} mm apart, and an axis needs at least {} mm; give the middle of "
        "each, in mm",
        apart_mm, kLeastCondyles_mm);
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

Hinge HingeOf(const MandibleOptions& options, const LandmarkFile& landmarks) {
  if (options.condyle_left && options.condyle_right) {
    if (const std::string fault = CondyleFault(*options.condyle_left, *options.condyle_right);
        !fault.empty()) {
      throw InputError("subject.mandible.condyle_left: " + fault);
    }
    return {PointOf(*options.condyle_left), PointOf(*options.condyle_right)};
  }
  std::vector<SitePoint> cranium;
  for (const Landmark& l : landmarks.landmarks) {
    if (IsStandardSite(l.site) && !IsOfMandible(l.site)) {
      cranium.push_back({l.site, PointOf(l.point)});
    }
  }
  const Similarity pose = FitAverageSkull(cranium).skull_from_average;
  const auto [left, right] = AverageCondyles();
  return {pose * left, pose * right};
}

// The distance is d^2 = a - b cos(angle - at): both ends, less what lies along the axis.
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
    const Hinge hinge = HingeOf(options, landmarks);
    const double opening_deg = OpeningOf(options, hinge, landmarks);
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

}  // namespace semblance
