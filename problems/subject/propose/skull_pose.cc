// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "problems/subject/propose/skull_pose.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {
namespace {

constexpr double kMaxDistance_mm = 15;  // a larger distance carries no more information
constexpr double kMinScale = 0.7, kMaxScale = 1.4;
// Fraction of the matches that is kept; the rest are parts that only one skull has.
constexpr double kKept = 0.7;

// A stage of the search. Each stage refines fewer poses on more points than the one before.
struct Stage {
  double cell_mm;  // distance of the points
  int rounds;
  std::size_t poses;  // number of poses that the stage refines
};
constexpr Stage kFirst = {.cell_mm = 40, .rounds = 5, .poses = 144};
constexpr Stage kMiddle = {.cell_mm = 20, .rounds = 12, .poses = 12};
constexpr Stage kLast = {.cell_mm = 8, .rounds = 20, .poses = 1};
constexpr double kSearchCell_mm = 6;  // cell of the coarse shells on which the search runs

// Two shells, and the points of each that are matched with the other.
struct ShellPair {
  const SkullShell& reference;
  const SkullShell& skull;
  std::vector<ShellPoint> of_reference, of_skull;

  ShellPair(const SkullShell& from, const SkullShell& to, double cell_mm)
      : reference(from),
        skull(to),
        of_reference(SpreadPoints(from, cell_mm)),
        of_skull(SpreadPoints(to, cell_mm)) {}
};

constexpr CorrespondenceOptions kSameWay = {.least_cosine = 0.34};  // within 70 degrees

ShellMatch MakeMatch(const ShellPoint& from, const ShellPoint& to) {
  return {.from = from.position,
          .to = to.position,
          .normal = to.normal,
          .distance_mm = (to.position - from.position).norm()};
}

ShellPoint Moved(const ShellPoint& p, const Similarity& pose) {
  return {pose * p.position, pose.rotation * p.normal};
}

std::vector<ShellMatch> MatchBothWays(const ShellPair& pair, const Similarity& pose) {
  const Similarity back = Inverse(pose);
  std::vector<ShellMatch> matches;
  for (const ShellPoint& p : pair.of_reference) {
    const ShellPoint moved = Moved(p, pose);
    const auto to = pair.skull.surface.Find(moved.position, moved.normal, kSameWay);
    matches.push_back(to ? MakeMatch(moved, {to->point.position, to->normal}) : ShellMatch());
  }
  for (const ShellPoint& q : pair.of_skull) {
    const auto from =
        pair.reference.surface.Find(back * q.position, back.rotation * q.normal, kSameWay);
    matches.push_back(from ? MakeMatch(Moved({from->point.position, from->normal}, pose), q)
                           : ShellMatch());
  }
  return matches;
}

// The mean distance of the kept matches. Parts that only one skull has do not count.
double Misfit_mm(const std::vector<ShellMatch>& matches) {
  std::vector<double> distances_mm;
  for (const ShellMatch& m : matches) {
    distances_mm.push_back(
        std::fmin(m.distance_mm, kMaxDistance_mm));  // the latter without a match
  }
  std::ranges::sort(distances_mm);
  distances_mm.resize(static_cast<std::size_t>(kKept * static_cast<double>(matches.size())));
  return ArithmeticMean(distances_mm);
}

struct Candidate {
  Similarity pose;
  double misfit_mm = std::numeric_limits<double>::infinity();
};

Candidate Refine(const ShellPair& pair, Similarity pose, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    const std::vector<ShellMatch> kept = KeepClosest(MatchBothWays(pair, pose), kKept);
    if (kept.size() < 20) {  // too few for a stable step
      break;
    }
    Similarity step = StepTowards(kept, /*scale_too=*/true);
    const double scale = std::clamp(step.scale * pose.scale, kMinScale, kMaxScale);
    step.scale = scale / pose.scale;
    pose = step * pose;
  }
  const double misfit_mm = Misfit_mm(MatchBothWays(pair, pose));
  return {pose, std::isfinite(misfit_mm) ? misfit_mm : std::numeric_limits<double>::infinity()};
}

// Refines all poses and sorts them, the best first. Ties keep their order.
std::vector<Candidate> RefineAll(const ShellPair& pair, const std::vector<Similarity>& poses,
                                 int rounds, int threads) {
  std::vector<Candidate> candidates(poses.size());
  ParallelFor(poses.size(), threads, 1,
              [&](std::size_t k) { candidates[k] = Refine(pair, poses[k], rounds); });
  std::ranges::stable_sort(candidates, {}, &Candidate::misfit_mm);
  return candidates;
}

// The 24 proper rotations of a cube.
std::vector<Mat3> CubeRotations() {
  std::vector<Mat3> rotations;
  std::array<int, 3> axis = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 r = Mat3::Zero();
      for (int i = 0; i < 3; ++i) {
        r(axis[i], i) = (signs >> i & 1) != 0 ? -1 : 1;
      }
      if (r.determinant() > 0) {
        rotations.push_back(r);
      }
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
  return rotations;
}

struct Frame {
  Vec3 middle = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  // principal axes, right-handed
};

Frame PrincipalFrame(const std::vector<ShellPoint>& points) {
  Frame frame;
  for (const ShellPoint& p : points) {
    frame.middle += p.position / static_cast<double>(points.size());
  }
  Mat3 spread = Mat3::Zero();
  for (const ShellPoint& p : points) {
    const Vec3 d = p.position - frame.middle;
    spread += d * d.transpose();
  }
  frame.axes = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors();
  frame.axes.col(2) = frame.axes.col(0).cross(frame.axes.col(1));
  return frame;
}

// Lays the middles on each other, at three heights: skulls may lack a mandible or a vault.
void AddStarts(const Mat3& rotation, const Vec3& reference_middle, const Vec3& skull_middle,
               std::vector<Similarity>& starts) {
  for (const double up_mm : {0.0, 35.0, -35.0}) {
    const Vec3 middle = reference_middle + Vec3(0, 0, up_mm);
    starts.push_back(
        {.scale = 1, .rotation = rotation, .translation = skull_middle - rotation * middle});
  }
}

std::vector<Similarity> Starts(const ShellPair& pair) {
  const Frame reference = PrincipalFrame(pair.of_reference), skull = PrincipalFrame(pair.of_skull);
  std::vector<Similarity> starts;
  for (const Mat3& turn : CubeRotations()) {
    for (const Mat3& rotation : {Mat3(skull.axes * turn * reference.axes.transpose()), turn}) {
      AddStarts(rotation, reference.middle, skull.middle, starts);
    }
  }
  return starts;
}

std::vector<Similarity> UprightStarts(const ShellPair& pair) {
  const Frame reference = PrincipalFrame(pair.of_reference), skull = PrincipalFrame(pair.of_skull);
  std::vector<Similarity> starts;
  AddStarts(Mat3::Identity(), reference.middle, skull.middle, starts);
  AddStarts(Vec3(-1, -1, 1).asDiagonal(), reference.middle, skull.middle, starts);
  return starts;
}

std::vector<Similarity> FirstPoses(const std::vector<Candidate>& candidates, std::size_t count) {
  std::vector<Similarity> poses;
  for (std::size_t k = 0; k < std::min(count, candidates.size()); ++k) {
    poses.push_back(candidates[k].pose);
  }
  return poses;
}

double Degrees(const Mat3& rotation) {
  return Eigen::AngleAxisd(rotation).angle() * 180 / std::numbers::pi;
}

// The misfit of the best candidate that differs from the very best by more than a small turn.
double RivalMisfit_mm(const std::vector<Candidate>& candidates) {
  constexpr double kTurned_deg = 45;
  const Mat3& best = candidates.front().pose.rotation;
  for (const Candidate& c : candidates) {
    if (Degrees(best.transpose() * c.pose.rotation) > kTurned_deg) {
      return c.misfit_mm;
    }
  }
  return std::numeric_limits<double>::infinity();
}

// The angle to the nearer one of LPS and RAS.
double Tilt_deg(const Mat3& rotation) {
  const double cosine = std::max((rotation.trace() - 1) / 2,
                                 (rotation(2, 2) - rotation(0, 0) - rotation(1, 1) - 1) / 2);
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

// True if the best upright pose needs no search for a better one. Two different adult skulls fit
// each other within 2 to 4 mm; the opposite orientation of the same two is off by twice as much. A
// pose that has turned far from where it began may still be on its way.
bool IsPlain(const std::vector<Candidate>& upright) {
  constexpr double kMaxMisfit_mm = 4, kMaxRivalRatio = 0.7, kMaxTilt_deg = 15;
  return upright.front().misfit_mm < kMaxMisfit_mm &&
         Tilt_deg(upright.front().pose.rotation) < kMaxTilt_deg &&
         upright.front().misfit_mm < kMaxRivalRatio * RivalMisfit_mm(upright);
}

}  // namespace

Similarity operator*(const Similarity& c_from_b, const Similarity& b_from_a) {
  return {.scale = c_from_b.scale * b_from_a.scale,
          .rotation = c_from_b.rotation * b_from_a.rotation,
          .translation = c_from_b * b_from_a.translation};
}

Similarity Inverse(const Similarity& b_from_a) {
  const Mat3 rotation = b_from_a.rotation.transpose();
  return {.scale = 1 / b_from_a.scale,
          .rotation = rotation,
          .translation = -(rotation * b_from_a.translation) / b_from_a.scale};
}

std::vector<ShellMatch> KeepClosest(const std::vector<ShellMatch>& matches, double share) {
  std::vector<ShellMatch> kept;
  std::ranges::copy_if(matches, std::back_inserter(kept),
                       [](const ShellMatch& m) { return std::isfinite(m.distance_mm); });
  std::ranges::stable_sort(kept, {}, &ShellMatch::distance_mm);
  kept.resize(static_cast<std::size_t>(share * static_cast<double>(kept.size())));
  return kept;
}

Similarity StepTowards(const std::vector<ShellMatch>& matches, bool scale_too) {
  constexpr double kAcross = 0.1;  // weight of distances across the normal; small: points may slide
  constexpr double kMaxTurn = 0.3, kMaxGrowth = 0.1;  // radians, log scale; they damp the step
  Vec3 middle = Vec3::Zero();
  for (const ShellMatch& m : matches) {
    middle += m.from / static_cast<double>(matches.size());
  }
  Eigen::Matrix<double, 7, 7> normal_matrix = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
  for (const ShellMatch& m : matches) {
    const Vec3 arm = m.from - middle;
    Eigen::Matrix<double, 3, 7> jacobian;
    jacobian << -CrossMatrix(arm), Mat3::Identity(), (scale_too ? arm : Vec3::Zero().eval());
    const Mat3 weight = m.normal * m.normal.transpose() + kAcross * Mat3::Identity();
    normal_matrix += jacobian.transpose() * weight * jacobian;
    right += jacobian.transpose() * weight * (m.to - m.from);
  }
  normal_matrix.diagonal().array() += 1e-6;  // keeps it regular without scale and for few matches
  const Eigen::Matrix<double, 7, 1> x = normal_matrix.ldlt().solve(right);
  Vec3 turn = x.head<3>();
  turn *= std::min(1.0, kMaxTurn / std::max(turn.norm(), 1e-12));
  Similarity step;
  step.scale = std::exp(std::clamp(x[6], -kMaxGrowth, kMaxGrowth));
  if (turn.norm() > 1e-12) {
    step.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }
  step.translation = middle + x.segment<3>(3) - step.scale * (step.rotation * middle);
  return step;
}

SkullPose FindPose(const SkullShell& reference, const SkullShell& skull, int threads,
                   SkullLies lies) {
  const SkullShell from = AsShell(ClusterVertices(reference.mesh, kSearchCell_mm));
  const SkullShell to = AsShell(ClusterVertices(skull.mesh, kSearchCell_mm));
  const auto refine = [&](const Stage& stage, const std::vector<Similarity>& poses) {
    return RefineAll(ShellPair(from, to, stage.cell_mm), poses, stage.rounds, threads);
  };
  const ShellPair coarse(from, to, kFirst.cell_mm);
  std::vector<Candidate> some = refine(kMiddle, UprightStarts(coarse));
  if (lies == SkullLies::kAnyhow && !IsPlain(some)) {
    some = refine(kMiddle, FirstPoses(refine(kFirst, Starts(coarse)), kMiddle.poses));
  }
  constexpr int kRoundsToRest = 40;
  const ShellPair fine(from, to, kLast.cell_mm);
  return {.skull_from_reference = Refine(fine, some.front().pose, kRoundsToRest).pose,
          .misfit_mm = some.front().misfit_mm,
          .rival_misfit_mm = RivalMisfit_mm(some)};
}

double PoseMisfit_mm(const SkullShell& reference, const SkullShell& skull,
                     const Similarity& skull_from_reference) {
  return Misfit_mm(
      MatchBothWays(ShellPair(reference, skull, kMiddle.cell_mm), skull_from_reference));
}

Similarity RefinePose(const SkullShell& reference, const SkullShell& skull,
                      const Similarity& skull_from_reference,
                      const std::function<bool(const Vec3&)>& counts) {
  ShellPair pair(reference, skull, kLast.cell_mm);
  const Similarity back = Inverse(skull_from_reference);
  std::erase_if(pair.of_reference, [&](const ShellPoint& p) { return !counts(p.position); });
  std::erase_if(pair.of_skull, [&](const ShellPoint& q) { return !counts(back * q.position); });
  return Refine(pair, skull_from_reference, kLast.rounds).pose;
}

std::string PoseFault(const SkullPose& pose) {
  // The next step, which works in the program's commands and in the workbench alike.
  constexpr const char* kPlaceThree =
      "place nasion (n) and both zygia (zy_l, zy_r) by hand and propose again from these "
      "(--landmarks FILE; in the workbench: click the three, then suggest the others)";
  constexpr double kMaxMisfit_mm = 7;      // phantoms are off by 6.4 from the mean skull
  constexpr double kMaxRivalRatio = 0.85;  // best over rival misfit; nearer to 1 is undecided
  if (!(pose.misfit_mm < kMaxMisfit_mm)) {
    return fmt::format(
        "no pose brings it within {} mm of a skull (mean distance, best {:.1f} mm); check that the "
        "file holds a skull, its unit, and that nothing else is in it; if it does, {}",
        kMaxMisfit_mm, pose.misfit_mm, kPlaceThree);
  }
  if (pose.misfit_mm > kMaxRivalRatio * pose.rival_misfit_mm) {
    return fmt::format(
        "its shape does not determine its pose: the best pose is off by {:.1f} mm and one turned "
        "by "
        "more than 45 degrees by {:.1f} mm; check that the file holds a skull; if it does, {}",
        pose.misfit_mm, pose.rival_misfit_mm, kPlaceThree);
  }
  return "";
}

}  // namespace semblance::problems
