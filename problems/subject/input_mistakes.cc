// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/input_mistakes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

// ---------------------------------------------------------------------------------------------
// Forgotten conversions
// ---------------------------------------------------------------------------------------------

// The matrices that exchange and negate axes without a mirror, the one between LPS and RAS first.
// The identity is left out.
std::vector<Mat3> AxisTurns() {
  std::vector<Mat3> turns = {Vec3(-1, -1, 1).asDiagonal()};
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 turn = Mat3::Zero();
      for (int row = 0; row < 3; ++row) {
        turn(row, order[row]) = (signs >> row) % 2 == 0 ? 1 : -1;
      }
      if (turn.determinant() > 0 && turn != Mat3::Identity() && turn != turns.front()) {
        turns.push_back(turn);
      }
    }
  } while (std::ranges::next_permutation(order).found);
  return turns;
}

// E.g. "x", "-z".
std::string SignedAxis(const Vec3& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::string(direction[axis] < 0 ? "-" : "") + "xyz"[axis];
}

std::string DescribeTurn(const Mat3& turn) {
  return turn == Mat3(Vec3(-1, -1, 1).asDiagonal())
             ? "x and y negated"
             : fmt::format("taken as ({}, {}, {})", SignedAxis(turn.row(0)),
                           SignedAxis(turn.row(1)), SignedAxis(turn.row(2)));
}

void AddMirrors(const Vec3& middle, std::vector<FrameChange>& changes) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double about : {0.0, middle[axis]}) {
      FrameChange change{
          .what = fmt::format("{} mirrored{}", "xyz"[axis], about == 0 ? "" : " at the middle"),
          .mirrored = true};
      change.linear(axis, axis) = -1;
      change.shift[axis] = 2 * about;
      changes.push_back(std::move(change));
    }
  }
}

// ---------------------------------------------------------------------------------------------
// Skull and skin
// ---------------------------------------------------------------------------------------------

// A place of the bone as seen from the middle of the head.
struct BonePlace {
  Vec3 direction;  // unit, outwards
  double radius_mm = kNaN;
};

struct BoneView {
  Vec3 middle = Vec3::Zero();
  double far_mm = 0;  // rays start at this distance
  std::vector<BonePlace> places;
};

// From below, necks end. In front, the chin is still seen.
bool IsSeen(const Vec3& direction_in_head) {
  constexpr double kLowest = -0.3, kFront = 0.3, kLowestInFront = -0.8;
  return direction_in_head.z() > kLowest ||
         (direction_in_head.z() > kLowestInFront && -direction_in_head.y() > kFront);
}

// Directions of a Fibonacci sphere.
std::vector<Vec3> AllDirections(int count) {
  std::vector<Vec3> directions;
  for (int n = 0; n < count; ++n) {
    const double z = 1 - (2 * n + 1.0) / count, angle = n * std::numbers::pi * (3 - std::sqrt(5.0)),
                 r = std::sqrt(1 - z * z);
    directions.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return directions;
}

// The middle of the braincase, in the frame of the average skull.
const Vec3 kMiddleOfHead(0, 70, 5);

// The pose of the head, if enough standard sites determine it.
std::optional<Similarity> FindHeadPose(const SkinInputs& inputs) {
  constexpr std::size_t kFewest = 6;
  std::vector<SitePoint> sites = inputs.landmarks.Points();
  std::erase_if(sites, [](const SitePoint& s) { return !IsStandardSite(s.site); });
  return inputs.landmarks_fit && sites.size() >= kFewest
             ? std::optional(FitAverageSkull(sites).skull_from_average)
             : std::nullopt;
}

BoneView SeeBone(const SkinInputs& inputs, const std::optional<Similarity>& pose) {
  constexpr int kDirections = 700;
  BoneView view{.middle = pose ? *pose * kMiddleOfHead : inputs.extent.center(),
                .far_mm = 2 * inputs.extent.diagonal().norm(),
                .places = {}};
  for (const Vec3& in_head : AllDirections(kDirections)) {
    const Vec3 direction = pose ? Vec3(pose->rotation * in_head) : in_head;
    const auto hit = IsSeen(in_head) ? inputs.skull->FirstHit(view.middle + view.far_mm * direction,
                                                              -direction, view.far_mm)
                                     : std::nullopt;
    if (hit) {
      view.places.push_back({direction, view.far_mm - hit->distance_mm});
    }
  }
  return view;
}

// The standard landmarks stand for the bone.
BoneView SeeLandmarks(const SkinInputs& inputs, const Similarity& pose) {
  BoneView view{.middle = pose * kMiddleOfHead, .far_mm = 600, .places = {}};
  for (const Landmark& landmark : inputs.landmarks.landmarks) {
    const Vec3 out = landmark.Position() - view.middle;
    if (IsStandardSite(landmark.site)) {
      view.places.push_back({out.normalized(), out.norm()});
    }
  }
  return view;
}

// The depths of bone under skin, one per place: the distance from the bone to the first skin that
// a ray from outside meets. Negative if it meets the bone first, NaN if it meets no skin.
std::vector<double> MeasureCover(const BoneView& view, const TriMesh& skin, const MeshQuery& query,
                                 const FrameChange& skull_from_skin) {
  const Mat3 back = skull_from_skin.linear.inverse();
  std::vector<double> depth_mm;
  for (const BonePlace& place : view.places) {
    const Vec3 from = view.middle + view.far_mm * place.direction - skull_from_skin.shift,
               along = back * -place.direction;
    double depth = kNaN;
    for (const MeshPoint& hit :
         query.AllHits(back * from, along, view.far_mm / skull_from_skin.factor)) {
      if (TriangleAreaVector(skin, skin.triangles[hit.triangle]).dot(along) < 0) {
        depth = view.far_mm - skull_from_skin.factor * hit.distance_mm - place.radius_mm;
        break;
      }
    }
    depth_mm.push_back(depth);
  }
  return depth_mm;
}

SkinCover Summarise(const std::vector<double>& depth_mm) {
  constexpr double kBare_mm = 1, kSame_mm = 0.2;
  std::vector<double> met;
  int bare = 0, same = 0;
  for (const double depth : depth_mm) {
    if (std::isfinite(depth)) {
      met.push_back(depth);
      bare += depth < -kBare_mm;
      same += std::abs(depth) < kSame_mm;
    }
  }
  if (met.empty()) {
    return {};
  }
  const auto count = static_cast<double>(met.size());
  SkinCover cover{.met_share = count / static_cast<double>(depth_mm.size()),
                  .bare_share = bare / count,
                  .median_mm = UpperMedian(met),
                  .same_share = same / count};
  for (double& depth : met) {
    depth = std::abs(depth - cover.median_mm);
  }
  cover.spread_mm = UpperMedian(met);
  return cover;
}

// Depths over the head as base + shift . direction: a skin that was moved by `shift`. Weights
// 1 / (1 + (r / 5 mm)^2) make places without a usual depth (temples, below the chin) count little.
Vec3 EstimateShift(const BoneView& view, const std::vector<double>& depth_mm) {
  constexpr double kWidth_mm = 5;
  constexpr int kSteps = 20;
  Eigen::Vector4d model = Eigen::Vector4d::Zero();
  std::vector<double> met;
  std::ranges::copy_if(depth_mm, std::back_inserter(met),
                       [](double d) { return std::isfinite(d); });
  model[0] = met.empty() ? 0 : UpperMedian(met);
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix4d normal = 1e-6 * Eigen::Matrix4d::Identity();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (std::size_t k = 0; k < depth_mm.size(); ++k) {
      if (std::isfinite(depth_mm[k])) {
        Eigen::Vector4d row;
        row << 1, view.places[k].direction;
        const double residual = (depth_mm[k] - row.dot(model)) / kWidth_mm;
        const double weight = 1 / (1 + residual * residual);
        normal += weight * row * row.transpose();
        right += weight * depth_mm[k] * row;
      }
    }
    model = normal.ldlt().solve(right);
  }
  return model.tail<3>();
}

// The bounds of all heads that were compared (three CTs and phantoms): no bone
// is bare; the median depth is 3 to 13 mm; the shift is -1..1, -2..1 and -12..-3 mm.
const Vec3 kUsualShift_mm(0, -1, -5);
constexpr double kLeastMet = 0.25, kMostBare = 0.01, kLeastMedian_mm = 1.5, kMostMedian_mm = 18;

bool IsUsual(const SkinCover& cover) {
  return cover.met_share >= kLeastMet && cover.bare_share <= kMostBare &&
         cover.median_mm >= kLeastMedian_mm && cover.median_mm <= kMostMedian_mm;
}

class SkinSearch {
 public:
  explicit SkinSearch(const SkinInputs& inputs)
      : inputs_(inputs),
        query_(inputs.skin),
        pose_(FindHeadPose(inputs)),
        view_(inputs.skull ? SeeBone(inputs, pose_)
              : pose_      ? SeeLandmarks(inputs, *pose_)
                           : BoneView()),
        depth_mm_(Cover({})),
        cover_(Summarise(depth_mm_)) {}

  InputMistakes Run() {
    if (view_.places.size() < kFewestPlaces || IsSameSurface() || IsExchanged() ||
        !inputs_.landmarks_fit || HasAnotherFrame()) {
      return std::move(found_);
    }
    NoteUnusualCover();
    CompareDepths();
    return std::move(found_);
  }

 private:
  static constexpr std::size_t kFewestPlaces = 6;

  template <class... Args>
  bool Error(fmt::format_string<Args...> format, Args&&... args) {
    found_.errors.push_back("skin: " + fmt::format(format, std::forward<Args>(args)...));
    return true;
  }
  template <class... Args>
  void Note(fmt::format_string<Args...> format, Args&&... args) {
    found_.notes.push_back("skin: " + fmt::format(format, std::forward<Args>(args)...));
  }

  std::vector<double> Cover(const FrameChange& skull_from_skin) const {
    return MeasureCover(view_, inputs_.skin, query_, skull_from_skin);
  }

  bool IsSameSurface() {
    return cover_.same_share > 0.5 && cover_.met_share > 0.5 &&
           Error(
               "it is the same surface as the skull ({:.0f} % of the bone lies within 0.2 mm of "
               "it); name the skin's own file under `skin`, or leave it out",
               100 * cover_.same_share);
  }

  // Bone lies outside everywhere, and the landmarks do not lie on it.
  bool IsExchanged() {
    constexpr double kOutside = 0.95, kMost_mm = 25;
    return !inputs_.landmarks_fit && cover_.bare_share > kOutside && cover_.median_mm > -kMost_mm &&
           Error(
               "it lies inside the skull (median {:.1f} mm): the files of `skull` and `skin` are "
               "exchanged",
               -cover_.median_mm);
  }

  bool HasAnotherFrame() {
    constexpr double kBare = 0.04, kBareLandmarks = 0.2, kLeastMetAtAll = 0.1, kFar_mm = 45;
    const bool bare = cover_.bare_share > (inputs_.skull ? kBare : kBareLandmarks);
    if (!bare && cover_.met_share >= kLeastMetAtAll && cover_.median_mm <= kFar_mm) {
      return false;
    }
    const std::string where =
        bare ? fmt::format("{:.0f} % of the bone lies outside it", 100 * cover_.bare_share)
        : cover_.met_share < kLeastMetAtAll
            ? fmt::format("it lies over {:.0f} % of the bone only", 100 * cover_.met_share)
            : fmt::format("it lies {:.0f} mm (median) off the bone", cover_.median_mm);
    if (const auto change = FindChange()) {
      return Error("{}; {} it covers the bone by {:.1f} mm (median): {}", where, change->what,
                   Summarise(Cover(*change)).median_mm, Remedy(*change));
    }
    return Error("{}; take skull and skin of one person from one scan, in one frame and unit",
                 where);
  }

  std::optional<FrameChange> FindChange() const {
    std::optional<FrameChange> best;
    double least_mm = std::numeric_limits<double>::infinity();
    for (const FrameChange& change : ForgottenChanges(view_.middle)) {
      const SkinCover cover = Summarise(Cover(change));
      if (IsUsual(cover) && cover.spread_mm < least_mm) {
        least_mm = cover.spread_mm;
        best = change;
      }
    }
    return best ? best : FindMove();
  }

  // A shift, and a scale if the shift alone is not enough.
  std::optional<FrameChange> FindMove() const {
    for (const bool scales : {false, true}) {
      FrameChange change;
      for (int step = 0; step < 12; ++step) {
        const std::vector<double> depth_mm = Cover(change);
        change.shift -= UnusualShift(depth_mm);
        if (scales) {
          Enlarge(ScaleFrom(depth_mm), change);
        }
      }
      if (IsUsual(Summarise(Cover(change)))) {
        const Vec3 by = change.shift + (change.factor - 1) * view_.middle;
        change.what = fmt::format("moved by ({:.0f}, {:.0f}, {:.0f}) mm", by.x(), by.y(), by.z());
        if (scales) {
          change.what =
              fmt::format("made {:.2f} times as large and {}", change.factor, change.what);
        }
        return change;
      }
    }
    return std::nullopt;
  }

  Mat3 HeadRotation() const { return pose_ ? pose_->rotation : Mat3(Mat3::Identity()); }

  // The shift beyond that of the depths of a usual head, which are thicker below.
  Vec3 UnusualShift(const std::vector<double>& depth_mm) const {
    return EstimateShift(view_, depth_mm) - HeadRotation() * kUsualShift_mm;
  }

  // The factor that gives the median place a usual depth.
  double ScaleFrom(const std::vector<double>& depth_mm) const {
    constexpr double kUsual_mm = 6;
    std::vector<double> factors;
    for (std::size_t k = 0; k < depth_mm.size(); ++k) {
      const double skin_mm = view_.places[k].radius_mm + depth_mm[k];
      if (std::isfinite(skin_mm) && skin_mm > 0) {
        factors.push_back((view_.places[k].radius_mm + kUsual_mm) / skin_mm);
      }
    }
    return factors.empty() ? 1 : UpperMedian(factors);
  }

  // Enlarges about the middle of the head.
  void Enlarge(double factor, FrameChange& change) const {
    change.linear *= factor;
    change.factor *= factor;
    change.shift = factor * change.shift + (1 - factor) * view_.middle;
  }

  static std::string Remedy(const FrameChange& change) {
    if (change.mirrored) {
      return "it is a mirror image of the head; export it again from the scan of the skull";
    }
    if (change.turned) {
      return fmt::format("the skin {}, and the skull is LPS; export both in one frame",
                         DescribeFrame(change.linear.inverse() * change.factor));
    }
    return change.factor != 1 && change.shift.isZero()
               ? "it is in another unit than the skull; export both in one unit"
               : "take skull and skin from one scan, in one frame and unit";
  }

  void NoteUnusualCover() {
    constexpr double kAside_mm = 4, kForward_mm = 5, kUp_mm = 6, kDown_mm = 10;
    constexpr double kMetAround = 0.6;  // fewer places do not determine a shift
    const Vec3 off = HeadRotation().transpose() * UnusualShift(depth_mm_);
    if (!IsUsual(cover_)) {
      Note(
          "{:.1f} % of the bone lies outside it, and its median distance from the bone is {:.1f} "
          "mm; heads have none and {} to {} mm; check that skull and skin are of one person, in "
          "one frame and unit",
          100 * cover_.bare_share, cover_.median_mm, kLeastMedian_mm, kMostMedian_mm);
    } else if (inputs_.skull && cover_.met_share > kMetAround &&
               (std::abs(off.x()) > kAside_mm || std::abs(off.y()) > kForward_mm ||
                off.z() > kUp_mm || off.z() < -kDown_mm)) {
      Note(
          "it lies over the bone as if it were moved by ({:.0f}, {:.0f}, {:.0f}) mm; check that "
          "skull and skin are of one person and in one frame",
          off.x(), off.y(), off.z());
    }
  }

  // Median difference between the stated depths and those of the skin under `change`; NaN if few
  // are stated.
  double DepthMisfit(const FrameChange& skull_from_skin) const {
    constexpr std::size_t kFewest = 6;
    std::vector<double> off_mm;
    for (const Landmark& landmark : inputs_.landmarks.landmarks) {
      if (landmark.depth_along_normal_mm && landmark.normal) {
        const double depth_mm = DepthAt(landmark, skull_from_skin);
        off_mm.push_back(std::abs(depth_mm - *landmark.depth_along_normal_mm));
      }
    }
    std::erase_if(off_mm, [](double mm) { return !std::isfinite(mm); });
    return off_mm.size() >= kFewest ? UpperMedian(off_mm) : kNaN;
  }

  // The distance to the first skin through which the normal leaves.
  double DepthAt(const Landmark& landmark, const FrameChange& skull_from_skin) const {
    constexpr double kFar_mm = 80;
    const Mat3 back = skull_from_skin.linear.inverse();
    const Vec3 along = back * Vec3(landmark.normal->data()).normalized();
    for (const MeshPoint& hit :
         query_.AllHits(back * (landmark.Position() - skull_from_skin.shift), along, kFar_mm)) {
      const Triangle& t = inputs_.skin.triangles[hit.triangle];
      if (TriangleAreaVector(inputs_.skin, t).dot(along) > 0) {
        return hit.distance_mm;
      }
    }
    return kNaN;
  }

  // The reflection at the head's middle plane.
  FrameChange MirroredSides() const {
    const Vec3 left = pose_->rotation.col(0);
    FrameChange change;
    change.linear -= 2 * left * left.transpose();
    change.shift = 2 * left.dot(pose_->translation) * left;
    return change;
  }

  // Depths that were measured on this skin along these normals are met within 0.003 mm on three
  // heads, and within 0.25 mm where they are rounded to half millimetres. On the skin of another
  // phantom of much the same shape they are 0.7 mm off, and depths to the closest skin of a real
  // head 0.6 mm.
  void CompareDepths() {
    constexpr double kMost_mm = 0.3, kClear_mm = 0.5;
    const double most_mm = kMost_mm + SagittaOfTriangles_mm(inputs_.skin);
    const double off_mm = DepthMisfit({}),
                 mirrored_mm = pose_ ? DepthMisfit(MirroredSides()) : kNaN;
    if (off_mm > kClear_mm && mirrored_mm < off_mm / 4) {
      Error(
          "the depths of the landmark file are {:.1f} mm (median) from those of the skin, and "
          "{:.1f} "
          "mm from those of its mirror image: left and right of the skin are exchanged; negate x",
          off_mm, mirrored_mm);
    } else if (off_mm > most_mm) {
      Note(
          "the depths of the landmark file are {:.1f} mm (median) from those of skull and skin; "
          "check that they were measured on this skin, that it is not another person's, and that "
          "it lies right over the skull",
          off_mm);
    }
  }

  const SkinInputs& inputs_;
  MeshQuery query_;
  std::optional<Similarity> pose_;
  BoneView view_;
  std::vector<double> depth_mm_;
  SkinCover cover_;
  InputMistakes found_;
};

// ---------------------------------------------------------------------------------------------
// Two faces
// ---------------------------------------------------------------------------------------------

std::vector<Vec3> SomePoints(const TriMesh& mesh) {
  constexpr std::size_t kMost = 300;
  std::vector<Vec3> some;
  const std::size_t step = mesh.points.size() / kMost + 1;
  for (std::size_t v = 0; v < mesh.points.size(); v += step) {
    some.push_back(mesh.points[v]);
  }
  return some;
}

double MedianDistance(const std::vector<Vec3>& points, const MeshQuery& mesh,
                      const FrameChange& change) {
  std::vector<double> mm;
  for (const Vec3& p : points) {
    mm.push_back(mesh.Closest(change(p)).distance_mm);
  }
  return UpperMedian(mm);
}

// The similarity that brings points nearest to a mesh, from where they are: iterated closest points
// (Besl and McKay 1992), of which the farther half does not count.
Similarity FindSimilarity(const std::vector<Vec3>& points, const MeshQuery& mesh) {
  constexpr int kSteps = 60;
  Similarity found;
  for (int step = 0; step < kSteps; ++step) {
    std::vector<std::pair<double, std::size_t>> order;
    std::vector<Vec3> feet;
    for (const Vec3& p : points) {
      const MeshPoint foot = mesh.Closest(found * p);
      order.emplace_back(foot.distance_mm, feet.size());
      feet.push_back(foot.position);
    }
    std::ranges::sort(order);
    const auto count = static_cast<Eigen::Index>((order.size() + 1) / 2);
    Eigen::Matrix3Xd from(3, count), to(3, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      from.col(k) = points[order[k].second];
      to.col(k) = feet[order[k].second];
    }
    const Eigen::Matrix4d moved = Eigen::umeyama(from, to, /*with_scaling=*/true);
    found.scale = std::cbrt(moved.topLeftCorner<3, 3>().determinant());
    found.rotation = moved.topLeftCorner<3, 3>() / found.scale;
    found.translation = moved.topRightCorner<3, 1>();
  }
  return found;
}

// "scaled by 1.11", "moved by (0, 10, 0) mm", whatever moves the points by more than a millimetre.
std::string DescribeSimilarity(const Similarity& found, const Vec3& middle, double radius_mm) {
  std::vector<std::string> words;
  if (std::abs(found.scale - 1) * radius_mm > 1) {
    words.push_back(fmt::format("scaled by {:.3g}", found.scale));
  }
  if (const double angle = Eigen::AngleAxisd(found.rotation).angle(); angle * radius_mm > 1) {
    words.push_back(fmt::format("turned by {:.0f} degrees", angle * 180 / std::numbers::pi));
  }
  if (const Vec3 shift = found * middle - middle; shift.norm() > 1) {
    words.push_back(fmt::format("moved by ({}, {}, {}) mm", std::lround(shift.x()),
                                std::lround(shift.y()), std::lround(shift.z())));
  }
  return fmt::format("{}", fmt::join(words, " and "));
}

// Notes a face that another size or place would bring far nearer to the truth.
void NoteSimilarity(const TriMesh& face, const std::vector<Vec3>& points, const MeshQuery& truth,
                    double as_is_mm, const std::string& where, InputMistakes& found) {
  constexpr double kMuchNearer = 3, kLeastScale = 0.5, kMostScale = 2;
  const Similarity best = FindSimilarity(points, truth);
  const double best_mm = MedianDistance(
      points, truth, {.what = "", .linear = best.scale * best.rotation, .shift = best.translation});
  const std::string words =
      DescribeSimilarity(best, Bounds(face).center(), 0.5 * Bounds(face).diagonal().norm());
  if (best_mm * kMuchNearer < as_is_mm && best.scale > kLeastScale && best.scale < kMostScale &&
      !words.empty()) {
    found.notes.push_back(
        fmt::format("{}; {} it would lie {:.1f} mm from it: check that both are of one head, in "
                    "one frame and unit",
                    where, words, best_mm));
  }
}

}  // namespace

std::vector<FrameChange> ForgottenChanges(const Vec3& middle) {
  std::vector<FrameChange> changes;
  const std::vector<Mat3> turns = AxisTurns();
  for (const Mat3& turn : turns) {
    changes.push_back({.what = DescribeTurn(turn), .linear = turn, .turned = true});
  }
  for (const LengthUnit unit : {LengthUnit::kCentimetre, LengthUnit::kInch, LengthUnit::kMetre}) {
    const double factor = Millimetres(unit);
    const std::string what = fmt::format("multiplied by {}", factor);
    changes.push_back({.what = what, .linear = factor * Mat3::Identity(), .factor = factor});
    for (const Mat3& turn : turns) {
      changes.push_back({.what = what + " and " + DescribeTurn(turn),
                         .linear = factor * turn,
                         .factor = factor,
                         .turned = true});
    }
  }
  AddMirrors(middle, changes);
  return changes;
}

std::string DescribeFrame(const Mat3& file_from_lps) {
  const Vec3 front = file_from_lps * Vec3(0, -1, 0), up = file_from_lps * Vec3(0, 0, 1);
  const std::string to = SignedAxis(front), top = SignedAxis(up);
  if (to == "y" && top == "z") {
    return "is RAS";
  }
  if (to == "z" && top == "y") {
    return "is y up, as Blender writes OBJ by default; export it with `Forward: Y` and `Up: Z`";
  }
  return fmt::format(
      "looks to {} and its top to {}; turn it so that it looks to -y and its top to z (LPS)", to,
      top);
}

std::optional<FoundChange> FindForgottenChange(
    const std::vector<Vec3>& points, const MeshQuery& mesh, const Vec3& middle, double within_mm,
    const std::function<bool(const FrameChange&)>& may_be) {
  std::optional<FoundChange> best;
  for (const FrameChange& change : ForgottenChanges(middle)) {
    if (!may_be(change)) {
      continue;
    }
    const double mm = MedianDistance(points, mesh, change);
    if (mm <= within_mm && (!best || mm < best->median_mm)) {
      best = FoundChange{change, mm};
    }
  }
  return best;
}

double SagittaOfTriangles_mm(const TriMesh& mesh) {
  constexpr double kHeadRadius_mm = 80;
  const double area_mm2 =
      mesh.triangles.empty() ? 0 : Area(mesh) / static_cast<double>(mesh.triangles.size());
  const double side2_mm2 = 4 / std::sqrt(3.0) * area_mm2;
  return side2_mm2 / (6 * kHeadRadius_mm);
}

InputMistakes FindSkinMistakes(const SkinInputs& inputs) { return SkinSearch(inputs).Run(); }

InputMistakes FindFaceMistakes(const TriMesh& face, const TriMesh& truth) {
  constexpr double kSame_mm = 1e-4, kOff_mm = 3, kFar_mm = 8, kNear_mm = 4;
  const MeshQuery query(truth);
  const std::vector<Vec3> points = SomePoints(face);
  // Either may be a part of the other.
  const double as_is_mm = std::min(MedianDistance(points, query, {}),
                                   MedianDistance(SomePoints(truth), MeshQuery(face), {}));
  InputMistakes found;
  const std::string where =
      fmt::format("the face lies {:.1f} mm (median) from the true skin", as_is_mm);
  if (as_is_mm < kSame_mm) {
    found.notes.emplace_back(
        "the face is the same surface as the true skin: the same file may be named twice");
  }
  if (as_is_mm > kOff_mm && !(as_is_mm > kFar_mm)) {
    NoteSimilarity(face, points, query, as_is_mm, where, found);
  }
  if (!(as_is_mm > kFar_mm)) {
    return found;
  }
  const auto change =
      FindForgottenChange(points, query, Bounds(truth).center(), std::min(kNear_mm, as_is_mm / 4),
                          [](const FrameChange&) { return true; });
  if (change) {
    found.errors.push_back(fmt::format("{}; {} it lies {:.1f} mm from it: bring both into one {}",
                                       where, change->change.what, change->median_mm,
                                       change->change.mirrored      ? "orientation"
                                       : change->change.factor != 1 ? "unit and frame"
                                                                    : "frame (LPS)"));
    return found;
  }
  NoteSimilarity(face, points, query, as_is_mm, where, found);
  if (found.notes.empty()) {
    found.notes.push_back(where + "; check that both are of one head, in one frame and unit");
  }
  return found;
}

}  // namespace semblance::problems
