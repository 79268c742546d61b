// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/patch_move.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/mesh/point_triangle.h"

namespace semblance {
namespace {

// A corner of a sheet over the common plane, seen from where the collapsed edge goes: z is the
// height.
double Cross2(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

// Where a point lies in a triangle, over the plane: weights of its second and third corner.
struct InTriangle {
  double second = kNaN, third = kNaN;
  double Inside() const { return std::min({second, third, 1 - second - third}); }
};

InTriangle LocateOver(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double area = Cross2(ab, ac);
  return {Cross2(ap, ac) / area, Cross2(ab, ap) / area};
}

// How far, over the plane, a point may be outside of a sheet and still count as on its rim.
constexpr double kRim = 1e-9;
// Triangles that stand steeper are not seen as a height field.
constexpr double kLeastCosine = 0.1;

// Two sheets over one plane.
class SheetPair {
 public:
  explicit SheetPair(const PatchPlaces& patch);

  // LargestComponent difference of height where both sheets are; NaN where they are no two height
  // fields over the same ring.
  double Difference() const;
  // The largest 1 / cosine of the slopes.
  double Steepness() const { return 1 / least_cosine_; }
  // For each sample a triangle of the new sheet and a distance.
  void PutSamples(PatchMove& move) const;

 private:
  std::size_t Next(std::size_t i) const { return i + 1 < ring_.size() ? i + 1 : 0; }
  void SeeSlope(const Vec3& a, const Vec3& b, const Vec3& c);
  bool GoesRoundOnce() const;
  double AtEnd(const Vec3& end) const;
  double AtPlace() const;
  double AtCrossings(const Vec3& from, const Vec3& to) const;
  int SectorOf(const Vec3& p) const;
  int NearestTriangle(const Vec3& p) const;

  const PatchPlaces& patch_;
  std::vector<Vec3> ring_, opposite_;  // relative to the place
  Vec3 keep_, gone_;
  Mat3 frame_ = Mat3::Identity();
  double least_cosine_ = 0;  // of the slopes; not above 0: no height field
};

// Rows: an orthonormal frame whose last is along `up`.
Mat3 FrameAlong(const Vec3& up) {
  Mat3 frame;
  frame.row(2) = up.normalized();
  frame.row(0) = frame.row(2).transpose().unitOrthogonal();
  frame.row(1) = frame.row(2).cross(frame.row(0));
  return frame;
}

SheetPair::SheetPair(const PatchPlaces& patch) : patch_(patch) {
  for (const Vec3& p : patch.ring) {
    ring_.push_back(p - patch.place);
  }
  Vec3 up = Vec3::Zero();
  for (std::size_t i = 0; i < patch.at_gone.size(); ++i) {
    up += ring_[i].cross(ring_[Next(i)]);
  }
  if (!(up.squaredNorm() > 0)) {
    return;
  }
  frame_ = FrameAlong(up);
  for (Vec3& p : ring_) {
    p = frame_ * p;
  }
  keep_ = frame_ * (patch.keep - patch.place);
  gone_ = frame_ * (patch.gone - patch.place);
  for (const Vec3& p : patch.opposite) {
    opposite_.push_back(frame_ * (p - patch.place));
  }
  least_cosine_ = 1;
  for (std::size_t i = 0; i < patch.at_gone.size(); ++i) {
    SeeSlope(Vec3::Zero(), ring_[i], ring_[Next(i)]);
    if (patch.on_border) {  // where the old sheet has more than its ring
      SeeSlope(patch.at_gone[i] ? gone_ : keep_, ring_[i], ring_[Next(i)]);
    }
  }
  if (patch.on_border) {
    SeeSlope(keep_, gone_, opposite_.front());
  }
}

void SheetPair::SeeSlope(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  least_cosine_ = std::min(least_cosine_, n.z() / n.norm());
}

// Each triangle of the new sheet stands upright already: so the ring goes around in one sense, and
// once if it passes one side of the place once.
bool SheetPair::GoesRoundOnce() const {
  int upward = 0;
  for (std::size_t i = 0; i < patch_.at_gone.size(); ++i) {
    const Vec3 &a = ring_[i], &b = ring_[Next(i)];
    upward += a.y() <= 0 && b.y() > 0 ? 1 : 0;
  }
  return upward <= 1;
}

// An end of the edge over the new sheet. NaN: outside, which is possible at a border alone.
double SheetPair::AtEnd(const Vec3& end) const {
  double most_inside = -kRim, difference = kNaN;
  for (std::size_t i = 0; i < patch_.at_gone.size(); ++i) {
    const Vec3 &a = ring_[i], &b = ring_[Next(i)];
    const InTriangle at = LocateOver(end, Vec3::Zero(), a, b);
    if (at.Inside() > most_inside) {
      most_inside = at.Inside();
      difference = std::abs(end.z() - at.second * a.z() - at.third * b.z());
    }
  }
  return difference;
}

// The place over the old sheet.
double SheetPair::AtPlace() const {
  double most_inside = -kRim, difference = kNaN;
  const auto visit = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const InTriangle at = LocateOver(Vec3::Zero(), a, b, c);
    if (at.Inside() > most_inside) {
      most_inside = at.Inside();
      difference = std::abs(a.z() + at.second * (b.z() - a.z()) + at.third * (c.z() - a.z()));
    }
  };
  for (std::size_t i = 0; i < patch_.at_gone.size(); ++i) {
    visit(patch_.at_gone[i] ? gone_ : keep_, ring_[i], ring_[Next(i)]);
  }
  for (const Vec3& p : opposite_) {
    visit(keep_, gone_, p);
  }
  return difference;
}

// An edge of the old sheet over those of the new one, all of which start at the place.
double SheetPair::AtCrossings(const Vec3& from, const Vec3& to) const {
  const Vec3 along = to - from;
  double difference = 0;
  for (const Vec3& spoke : ring_) {
    const double turn = Cross2(spoke, along);
    const double on_spoke = Cross2(from, along) / turn, on_edge = Cross2(from, spoke) / turn;
    if (on_spoke > 0 && on_spoke < 1 && on_edge > 0 && on_edge < 1) {
      difference =
          std::max(difference, std::abs(on_spoke * spoke.z() - from.z() - on_edge * along.z()));
    }
  }
  return difference;
}

double SheetPair::Difference() const {
  if (!(least_cosine_ > kLeastCosine) || !GoesRoundOnce()) {
    return kNaN;
  }
  double most = AtCrossings(keep_, gone_);
  for (const double d : {AtEnd(keep_), AtEnd(gone_), AtPlace()}) {
    if (std::isnan(d) && !patch_.on_border) {
      return kNaN;
    }
    most = std::fmax(most, d);
  }
  for (std::size_t i = 0; i < patch_.at_gone.size(); ++i) {
    const Vec3& apex = patch_.at_gone[i] ? gone_ : keep_;
    most = std::max(most, AtCrossings(apex, ring_[i]));
    const std::size_t next = i + 1 < patch_.at_gone.size() || patch_.closed ? Next(i) : i;
    if (next == i || patch_.at_gone[next] != patch_.at_gone[i]) {
      most = std::max(most, AtCrossings(apex, ring_[Next(i)]));
    }
  }
  return most;
}

// The triangle of the new sheet in whose sector around the place p is; -1 if none.
int SheetPair::SectorOf(const Vec3& p) const {
  double from = Cross2(ring_[0], p);
  for (std::size_t i = 0; i < patch_.at_gone.size(); ++i) {
    const double to = Cross2(ring_[Next(i)], p);
    if (from >= 0 && to <= 0 && p.head<2>().dot((ring_[i] + ring_[Next(i)]).head<2>()) >= 0) {
      return static_cast<int>(i);
    }
    from = to;
  }
  return -1;
}

double DistanceTo(const Vec3& p, const Vec3& a, const Vec3& b) {
  return (p - ClosestPointOnTriangle(p, Vec3::Zero(), a, b).position).norm();
}

int SheetPair::NearestTriangle(const Vec3& p) const {
  double least = std::numeric_limits<double>::infinity();
  int nearest = 0;
  for (std::size_t i = 0; i < patch_.at_gone.size(); ++i) {
    const double distance = DistanceTo(p, ring_[i], ring_[Next(i)]);
    if (distance < least) {
      least = distance;
      nearest = static_cast<int>(i);
    }
  }
  return nearest;
}

void SheetPair::PutSamples(PatchMove& move) const {
  move.under.clear();
  move.distance_mm.clear();
  for (const Vec3& sample : patch_.samples) {
    const Vec3 p = frame_ * (sample - patch_.place);
    const int sector = least_cosine_ > kLeastCosine ? SectorOf(p) : -1;
    const int under = sector < 0 ? NearestTriangle(p) : sector;
    const Vec3 &a = ring_[under], &b = ring_[Next(under)];
    const InTriangle at = LocateOver(p, Vec3::Zero(), a, b);
    const bool over = sector >= 0 && at.Inside() >= 0;
    move.under.push_back(under);
    move.distance_mm.push_back(over ? std::abs(p.z() - at.second * a.z() - at.third * b.z())
                                    : DistanceTo(p, a, b));
  }
}

double ToSegment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0;
  return (p - a - t * (b - a)).norm();
}

// How far the border itself moves: from ring's end over keep and gone to the ring's start, and from
// there over the place.
double BorderDistance(const PatchPlaces& patch) {
  return std::max({ToSegment(patch.keep, patch.ring.back(), patch.place),
                   ToSegment(patch.gone, patch.place, patch.ring.front()),
                   ToSegment(patch.place, patch.keep, patch.gone)});
}

}  // namespace

void MeasureMove(const PatchPlaces& patch, PatchMove& move) {
  const SheetPair sheets(patch);
  const double of_ends =
      std::max((patch.keep - patch.place).norm(), (patch.gone - patch.place).norm());
  const double beside = patch.on_border ? BorderDistance(patch) * sheets.Steepness() : 0;
  move.sheets_mm = std::fmin(of_ends, sheets.Difference() + beside);
  sheets.PutSamples(move);
}

}  // namespace semblance
