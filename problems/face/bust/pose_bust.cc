// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/pose_bust.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "fitting/problem/placement.h"
#include "problems/face/bust/soft_deformation.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/correspondences.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr int kQuadsPerPatch = 4;
constexpr double kOnFace_mm = 1;       // vertices at rest within this of the template follow it
constexpr double kBustCosine = 0.6;    // between normals; a smaller one lets walls follow as well
constexpr double kLids = 1.45;         // lids reach to so many radii from the eyeball's centre
constexpr double kLidTrust = 0.05;     // of the lids, so that they keep much of their shape
constexpr double kSkullTrust = 0.1;    // of the scalp, against 1 of the face
constexpr double kScalpReach_mm = 20;  // scalp farther from the skull's tissue does not follow it
constexpr double kEar_mm = 45;         // radius of the ears, which do not follow the skull
constexpr double kLeastTrust = 1e-3;   // vertices with less follow nothing
constexpr int kRounds = 2;  // the second round finds better matches, within half the reach

// The weight with which a bust follows the face: 0 at the border, where no data hold the face.
double FaceTrust(const Vec2& uv) {
  const double side = SmoothStep(std::min(uv.x(), 1 - uv.x()) / 0.08);
  return side * SmoothStep((uv.y() - 0.02) / 0.09) * SmoothStep((1 - uv.y()) / 0.09);
}

// A vertex of the bust and the point of the face that it follows.
struct OnFace {
  std::int32_t vertex = -1;
  int triangle = -1;
  Vec3 weights = Vec3::Constant(kNaN);
  Vec3 beside = Vec3::Zero();  // from the face to the vertex, at rest
  Vec3 normal = Vec3::Zero();  // of the face there
  double trust = 0;
};

class FaceMesh {
 public:
  explicit FaceMesh(const HSplineSurface& surface)
      : tessellation_(Tessellate(surface, kQuadsPerPatch)) {}

  const TriMesh& mesh() const { return tessellation_.mesh; }
  const std::vector<Vec3>& normals() const { return tessellation_.normals; }
  template <class Value>
  Value At(const std::vector<Value>& values, int triangle, const Vec3& weights) const {
    const Triangle& t = mesh().triangles[triangle];
    return values[t[0]] * weights[0] + values[t[1]] * weights[1] + values[t[2]] * weights[2];
  }
  Vec3 Point(int triangle, const Vec3& weights) const {
    return At(mesh().points, triangle, weights);
  }
  Vec3 Normal(int triangle, const Vec3& weights) const {
    return At(tessellation_.normals, triangle, weights).normalized();
  }
  Vec2 Uv(int triangle, const Vec3& weights) const {
    return At(tessellation_.uv, triangle, weights);
  }

 private:
  Tessellation tessellation_;
};

// The vertices of `mesh` that correspond to a point of the face within reach_mm.
std::vector<OnFace> FindOnFace(const TriMesh& mesh, const FaceMesh& face, double reach_mm,
                               std::span<const Sphere> eyes, int threads) {
  const Correspondences on_face(face.mesh(), face.normals());
  const CorrespondenceOptions match{.reach_mm = reach_mm, .least_cosine = kBustCosine};
  const std::vector<Vec3> normals = VertexNormals(mesh);
  std::vector<OnFace> found(mesh.points.size());
  ParallelFor(mesh.points.size(), threads, 256, [&](std::size_t v) {
    const Vec3& p = mesh.points[v];
    const auto correspondence = on_face.Find(p, normals[v], match);
    if (!correspondence) {
      return;
    }
    const MeshPoint& at = correspondence->point;
    double trust = FaceTrust(face.Uv(at.triangle, at.weights));
    for (const Sphere& eye : eyes) {
      const double lids = (p - eye.center).norm() / eye.radius_mm;
      trust *= kLidTrust + (1 - kLidTrust) * SmoothStep((lids - kLids) / 0.5);
    }
    found[v] = {.vertex = static_cast<std::int32_t>(v),
                .triangle = at.triangle,
                .weights = at.weights,
                .beside = p - at.position,
                .normal = correspondence->normal,
                .trust = trust};
  });
  std::erase_if(found, [](const OnFace& f) { return f.vertex < 0 || f.trust < kLeastTrust; });
  return found;
}

// The part of the head over the brain case, in the subject's frame. It lies above the ears and the
// lower border of the orbits, and excludes the ears.
class Scalp {
 public:
  Scalp(const HSplineSurface& face, const std::map<std::string, Vec2>& site_uv) {
    const auto at = [&](const char* code) { return face.Point(site_uv.at(code)); };
    const Vec3 left = at("sgl_l"), right = at("sgl_r");
    const Vec3 front = (at("mio_l") + at("mio_r")) / 2, middle = (left + right) / 2;
    const Vec3 back = (middle - front).normalized();
    up_ = (left - right).cross(back).normalized();
    middle_ = middle;
    for (const Vec3& side : {left, right}) {
      ears_.push_back({side + 14 * back - 12 * up_, kEar_mm});  // behind and below sgl
    }
  }
  bool InEar(const Vec3& p) const {
    return std::ranges::any_of(ears_, [&](const Sphere& ear) { return ear.Contains(p); });
  }
  // 1 on the scalp, 0 off it, smooth between.
  double At(const Vec3& p) const {
    // One factor rises from 0 at 25 mm over the ears to 1 at 45 mm higher. The others rise from 0
    // at the ears to 1 at 20 mm outside them.
    constexpr double kFirst_mm = 25, kWidth_mm = 45, kBeside_mm = 20;
    double part = SmoothStep((up_.dot(p - middle_) - kFirst_mm) / kWidth_mm);
    for (const Sphere& ear : ears_) {
      part *= SmoothStep(((p - ear.center).norm() - ear.radius_mm) / kBeside_mm);
    }
    return part;
  }

 private:
  Vec3 up_, middle_;
  std::vector<Sphere> ears_;
};

// ---------------------------------------------------------------------------------------------
// Eyes by formula
// ---------------------------------------------------------------------------------------------

constexpr int kRingPoints = 64;
// Radii. That of the limbus, the border of the iris, is from Ruefer et al. (2005). They do not
// depend on the size of the ball.
constexpr double kPupil_mm = 1.9, kIris_mm = 5.4, kLimbus_mm = 5.9;
constexpr double kCornea_mm = 0.5;                // height of the cornea over the sphere
constexpr double kBack = 0.6 * std::numbers::pi;  // angle from the gaze at which the shell ends

// A sphere with a slightly steeper cornea in the direction of the gaze.
class EyeShell {
 public:
  EyeShell(const Sphere& ball, const Vec3& gaze, const Vec3& up) : ball_(ball), gaze_(gaze) {
    right_ = gaze.cross(up).normalized();
    up_ = right_.cross(gaze);
  }

  // The shell between two angles from the gaze.
  TriMesh Ring(double from, double to, int steps) const {
    TriMesh mesh;
    for (int s = 0; s <= steps; ++s) {
      for (int k = 0; k < kRingPoints; ++k) {
        mesh.points.push_back(
            At(from + (to - from) * s / steps, 2 * std::numbers::pi * k / kRingPoints));
      }
    }
    for (int s = 0; s < steps; ++s) {
      for (int k = 0; k < kRingPoints; ++k) {
        const int a = s * kRingPoints + k, b = s * kRingPoints + (k + 1) % kRingPoints;
        if (from > 0 || s > 0) {
          mesh.triangles.push_back({a, b, a + kRingPoints});
        }
        mesh.triangles.push_back({b, b + kRingPoints, a + kRingPoints});
      }
    }
    return mesh;
  }

 private:
  Vec3 At(double angle, double round) const {
    const double end = 1.15 * std::asin(std::min(kLimbus_mm / ball_.radius_mm, 0.8));
    const double t = std::max(0.0, 1 - angle * angle / (end * end));
    const double radius = ball_.radius_mm + kCornea_mm * t * t;
    const Vec3 side = std::cos(round) * right_ + std::sin(round) * up_;
    return ball_.center + radius * (std::cos(angle) * gaze_ + std::sin(angle) * side);
  }

  Sphere ball_;
  Vec3 gaze_, right_, up_;
};

// The front of the eye. gaze: unit, the direction of view; up: not parallel to it.
std::vector<EyePart> EyeParts(const Sphere& ball, const Vec3& gaze, const Vec3& up) {
  const EyeShell shell(ball, gaze, up);
  const auto angle = [&](double radius_mm) {
    return std::asin(std::min(radius_mm / ball.radius_mm, 0.9));
  };
  const double pupil = angle(kPupil_mm), iris = angle(kIris_mm), limbus = angle(kLimbus_mm);
  return {{"sclera", {0.93, 0.91, 0.89}, shell.Ring(limbus, kBack, 16)},
          {"limbus", {0.20, 0.19, 0.19}, shell.Ring(iris, limbus, 2)},
          {"iris", {0.39, 0.36, 0.31}, shell.Ring(pupil, iris, 6)},
          {"pupil", {0.03, 0.03, 0.03}, shell.Ring(0, pupil, 3)}};
}

// ---------------------------------------------------------------------------------------------
// The pose
// ---------------------------------------------------------------------------------------------

class BustPoser {
 public:
  BustPoser(const BustInput& in, const RunContext& context)
      : in_(in), context_(context), face_(in.face), released_(in.model.mesh.points.size(), false) {}

  Bust Pose() {
    Place();
    if (!in_.over_skull.triangles.empty()) {
      over_skull_.emplace(in_.over_skull);
    }
    posed_ = placed_;
    deformation_.emplace(placed_, DeformOptions{});
    for (int round = 0; round < kRounds; ++round) {
      context_.ThrowIfStopped();
      Follow(round);
    }
    Release();
    return MakeResult();
  }

 private:
  void Place() {
    std::vector<Vec3> from, to;
    std::vector<double> weights;
    if (in_.model.rest) {
      const FaceMesh rest(in_.model.rest->surface);
      on_face_ = FindOnFace(in_.model.mesh, rest, kOnFace_mm, in_.model.eyeballs, context_.threads);
      for (const OnFace& f : on_face_) {
        from.push_back(rest.Point(f.triangle, f.weights));
        to.push_back(face_.Point(f.triangle, f.weights));
        weights.push_back(f.trust);
      }
    } else {
      for (const auto& [code, uv] : in_.site_uv) {
        if (const auto site = in_.model.sites.find(code); site != in_.model.sites.end()) {
          from.push_back(site->second);
          to.push_back(in_.face.Point(uv));
        }
      }
    }
    if (from.size() < 4) {
      throw InputError(fmt::format("{}: it shares {} sites with the face; at least 4 are needed",
                                   in_.model.name, from.size()));
    }
    subject_from_model_ = PlaceTemplate(from, to, weights);
    placed_ = Transformed(in_.model.mesh, subject_from_model_);
    if (!in_.model.rest) {
      BendToSites(from, to);
      FindOuter();
    }
  }

  // Finds the vertices seen from outside. The walls of nostrils and ears do not follow the face.
  void FindOuter() {
    outer_.assign(placed_.points.size(), true);
    const std::vector<bool> seen = SeenFromOutside(placed_, context_.threads);
    for (std::size_t t = 0; t < seen.size(); ++t) {
      for (const std::int32_t v : placed_.triangles[t]) {
        outer_[v] = outer_[v] && seen[t];
      }
    }
  }

  void BendToSites(std::vector<Vec3> from, const std::vector<Vec3>& to) {
    for (Vec3& p : from) {
      p = subject_from_model_ * p;
    }
    const ThinPlate bend = FitThinPlate(from, to, {}, {.stiffness_mm = 1});
    for (Vec3& p : placed_.points) {
      p = bend(p);
    }
  }

  void Follow(int round) {
    if (!in_.model.rest) {
      constexpr std::array kReach_mm = {8.0, 4.0};
      on_face_ = FindOnFace(posed_, face_, kReach_mm[round], {}, context_.threads);
      const Scalp head(in_.face, in_.site_uv);
      std::erase_if(on_face_, [&](const OnFace& f) {
        return !outer_[f.vertex] || head.InEar(posed_.points[f.vertex]);
      });
      for (OnFace& f : on_face_) {
        f.beside.setZero();
      }
    }
    FindScalp();
    Solve();
  }

  void FindScalp() {
    scalp_.clear();
    if (!over_skull_) {
      return;
    }
    const Scalp scalp(in_.face, in_.site_uv);
    constexpr CorrespondenceOptions kMatch = {.reach_mm = kScalpReach_mm,
                                              .least_cosine = kBustCosine};
    const std::vector<Vec3> normals = VertexNormals(posed_);
    std::vector<SoftTarget> found(posed_.points.size());
    ParallelFor(found.size(), context_.threads, 256, [&](std::size_t v) {
      const Vec3& p = posed_.points[v];
      const double part = scalp.At(p);
      if (part < kLeastTrust) {
        return;
      }
      if (const auto at = over_skull_->Find(p, normals[v], kMatch)) {
        const Vec3& normal = at->normal;
        found[v] = {static_cast<std::int32_t>(v), p + normal * normal.dot(at->point.position - p),
                    kSkullTrust * part};
      }
    });
    for (const OnFace& f : on_face_) {
      found[f.vertex].weight *= std::max(1 - f.trust, 0.0);
    }
    for (const SoftTarget& target : found) {
      if (target.vertex >= 0 && target.weight > kLeastTrust * kSkullTrust) {
        scalp_.push_back(target);
      }
    }
  }

  // The vertex's offset from the face turns with the face.
  Vec3 FindTarget(const OnFace& f) const {
    const Vec3 normal = face_.Normal(f.triangle, f.weights);
    const auto turn =
        Eigen::Quaterniond::FromTwoVectors(subject_from_model_.rotation * f.normal, normal);
    return face_.Point(f.triangle, f.weights) +
           subject_from_model_.scale * (turn * (subject_from_model_.rotation * f.beside));
  }

  void Solve() {
    std::vector<SoftTarget> targets;
    for (const OnFace& f : on_face_) {
      if (!released_[f.vertex]) {
        targets.push_back({f.vertex, FindTarget(f), f.trust});
      }
    }
    for (const SoftTarget& target : scalp_) {
      if (!released_[target.vertex]) {
        targets.push_back(target);
      }
    }
    posed_.points = deformation_->Follow(targets);
  }

  // Releases the vertices of triangles that turn over, with two rings around them. Repeats this
  // with the new result, so that the released parts grow until no triangle turns over.
  void Release() {
    constexpr int kAttempts = 6;  // Bust::turned_over reports what then is left
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::vector<std::int32_t> turned = TurnedOver(placed_, posed_, Mat3::Identity());
      if (turned.empty()) {
        return;
      }
      context_.ThrowIfStopped();
      std::vector<bool> wider = released_;
      for (const std::int32_t t : turned) {
        for (const std::int32_t v : placed_.triangles[t]) {
          wider[v] = true;
        }
      }
      for (int ring = 0; ring < 2; ++ring) {
        Widen(wider);
      }
      released_ = std::move(wider);
      Solve();
    }
  }

  void Widen(std::vector<bool>& chosen) const {
    const std::vector<bool> before = chosen;
    for (const Triangle& t : placed_.triangles) {
      if (before[t[0]] || before[t[1]] || before[t[2]]) {
        chosen[t[0]] = chosen[t[1]] = chosen[t[2]] = true;
      }
    }
  }

  // An eye moves with its lids, which touch it.
  void PoseEyes(Bust& bust) const {
    for (const Sphere& eye : in_.model.eyeballs) {
      std::vector<Vec3> from, to;
      for (std::size_t v = 0; v < posed_.points.size(); ++v) {
        const Vec3& p = in_.model.mesh.points[v];
        if (std::abs((p - eye.center).norm() - eye.radius_mm) < 1 && p.y() < eye.center.y()) {
          from.push_back(p);
          to.push_back(posed_.points[v]);
        }
      }
      const Similarity moved = from.size() < 10 ? subject_from_model_ : PlaceTemplate(from, to);
      const Sphere ball{moved * eye.center, moved.scale * eye.radius_mm};
      bust.eyeballs.push_back(ball);
      for (EyePart& part : EyeParts(ball, subject_from_model_.rotation * -Vec3::UnitY(),
                                    subject_from_model_.rotation * Vec3::UnitZ())) {
        bust.eyes.push_back(std::move(part));
      }
    }
  }

  Bust MakeResult() const {
    Bust bust{
        .skin = posed_, .eyes = {}, .eyeballs = {}, .subject_from_model = subject_from_model_};
    double sum = 0, weight = 0;
    for (const OnFace& f : on_face_) {
      sum += f.trust * (posed_.points[f.vertex] - FindTarget(f)).squaredNorm();
      weight += f.trust;
    }
    bust.on_face = static_cast<int>(on_face_.size());
    bust.face_rms_mm = weight > 0 ? std::sqrt(sum / weight) : kNaN;
    double skull = 0;
    for (const SoftTarget& target : scalp_) {
      skull += (posed_.points[target.vertex] - target.position).squaredNorm();
    }
    bust.on_skull = static_cast<int>(scalp_.size());
    bust.skull_rms_mm =
        scalp_.empty() ? kNaN : std::sqrt(skull / static_cast<double>(scalp_.size()));
    bust.turned_over = static_cast<int>(TurnedOver(placed_, posed_, Mat3::Identity()).size());
    bust.released = static_cast<int>(std::ranges::count(released_, true));
    PoseEyes(bust);
    return bust;
  }

  const BustInput& in_;
  const RunContext& context_;
  const FaceMesh face_;
  std::optional<SoftDeformation> deformation_;  // of placed_
  std::optional<Correspondences> over_skull_;
  std::vector<bool> outer_;  // one per vertex; of a model without `rest`
  std::vector<bool> released_;
  std::vector<OnFace> on_face_;
  std::vector<SoftTarget> scalp_;
  Similarity subject_from_model_;
  TriMesh placed_, posed_;
};

}  // namespace

Bust PoseBust(const BustInput& in, const RunContext& context) {
  return BustPoser(in, context).Pose();
}

}  // namespace semblance::problems
