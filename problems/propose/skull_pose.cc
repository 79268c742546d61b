// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/propose/skull_pose.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "fitting/shape_model/shape_parameters.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {
namespace {

constexpr double kFarthest_mm = 15;  // beyond, a distance says no more
constexpr double kLeastScale = 0.7, kMostScale = 1.4;
constexpr double kKept = 0.7;  // of the matches; the rest are parts that only one skull has

// Fewer poses, more points.
struct Stage {
  double cell_mm;
  int rounds;
  std::size_t poses;  // that go on from the stage before
};
constexpr Stage kFirst = {.cell_mm = 40, .rounds = 5, .poses = 144};
constexpr Stage kMiddle = {.cell_mm = 20, .rounds = 12, .poses = 12};
constexpr Stage kLast = {.cell_mm = 8, .rounds = 20, .poses = 1};
constexpr double kSearchCell_mm = 6;  // of the shells that the first two are searched on

// Two skulls, and the points of each that are asked for the other.
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

ShellMatch MatchOf(const ShellPoint& from, const ShellPoint& to) {
  constexpr double kAlike = 0.34;  // cosine of 70 degrees
  return {.from = from.position,
          .to = to.position,
          .normal = to.normal,
          .distance_mm = (to.position - from.position).norm(),
          .faces_alike = from.normal.dot(to.normal) > kAlike};
}

ShellPoint Moved(const ShellPoint& p, const Similarity& pose) {
  return {pose * p.position, pose.rotation * p.normal};
}

std::vector<ShellMatch> MatchBothWays(const ShellPair& pair, const Similarity& pose) {
  const Similarity back = Inverse(pose);
  std::vector<ShellMatch> matches;
  for (const ShellPoint& p : pair.of_reference) {
    const ShellPoint moved = Moved(p, pose);
    matches.push_back(MatchOf(moved, pair.skull.Closest(moved.position)));
  }
  for (const ShellPoint& q : pair.of_skull) {
    matches.push_back(MatchOf(Moved(pair.reference.Closest(back * q.position), pose), q));
  }
  return matches;
}

// Of the share that is kept: what only one skull has says nothing of its pose.
double Misfit_mm(const std::vector<ShellMatch>& matches) {
  std::vector<double> distances_mm;
  for (const ShellMatch& m : matches) {
    distances_mm.push_back(m.faces_alike ? std::min(m.distance_mm, kFarthest_mm) : kFarthest_mm);
  }
  std::ranges::sort(distances_mm);
  distances_mm.resize(static_cast<std::size_t>(kKept * static_cast<double>(matches.size())));
  return distances_mm.empty() ? kNaN
                              : std::accumulate(distances_mm.begin(), distances_mm.end(), 0.0) /
                                    static_cast<double>(distances_mm.size());
}

struct Candidate {
  Similarity pose;
  double misfit_mm = std::numeric_limits<double>::infinity();
};

Candidate Refined(const ShellPair& pair, Similarity pose, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    const std::vector<ShellMatch> kept = KeepClosest(MatchBothWays(pair, pose), kKept);
    if (kept.size() < 20) {
      break;
    }
    Similarity step = StepTowards(kept, /*scale_too=*/true);
    const double scale = std::clamp(step.scale * pose.scale, kLeastScale, kMostScale);
    step.scale = scale / pose.scale;
    pose = step * pose;
  }
  const double misfit_mm = Misfit_mm(MatchBothWays(pair, pose));
  return {pose, std::isfinite(misfit_mm) ? misfit_mm : std::numeric_limits<double>::infinity()};
}

// The best first; of equals, the one that came first.
std::vector<Candidate> RefinedAll(const ShellPair& pair, const std::vector<Similarity>& poses,
                                  int rounds, int threads) {
  std::vector<Candidate> candidates(poses.size());
  ParallelFor(poses.size(), threads, 1,
              [&](std::size_t k) { candidates[k] = Refined(pair, poses[k], rounds); });
  std::ranges::stable_sort(candidates, {}, &Candidate::misfit_mm);
  return candidates;
}

// The proper rotations of a cube.
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
  Mat3 axes = Mat3::Identity();  // principal, right-handed
};

Frame FrameOf(const std::vector<ShellPoint>& points) {
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

std::vector<Similarity> Starts(const ShellPair& pair) {
  const Frame reference = FrameOf(pair.of_reference), skull = FrameOf(pair.of_skull);
  std::vector<Similarity> starts;
  for (const Mat3& turn : CubeRotations()) {
    for (const Mat3& rotation : {Mat3(skull.axes * turn * reference.axes.transpose()), turn}) {
      for (const double up_mm : {0.0, 35.0, -35.0}) {
        const Vec3 middle = reference.middle + Vec3(0, 0, up_mm);
        starts.push_back(
            {.scale = 1, .rotation = rotation, .translation = skull.middle - rotation * middle});
      }
    }
  }
  return starts;
}

std::vector<Similarity> PosesOf(const std::vector<Candidate>& candidates, std::size_t count) {
  std::vector<Similarity> poses;
  for (std::size_t k = 0; k < std::min(count, candidates.size()); ++k) {
    poses.push_back(candidates[k].pose);
  }
  return poses;
}

double Degrees(const Mat3& rotation) {
  return Eigen::AngleAxisd(rotation).angle() * 180 / std::numbers::pi;
}

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
  std::ranges::copy_if(matches, std::back_inserter(kept), &ShellMatch::faces_alike);
  std::ranges::stable_sort(kept, {}, &ShellMatch::distance_mm);
  kept.resize(static_cast<std::size_t>(share * static_cast<double>(kept.size())));
  return kept;
}

Similarity StepTowards(const std::vector<ShellMatch>& matches, bool scale_too) {
  constexpr double kAcross = 0.1;  // weight of distances across the normal: points may slide
  constexpr double kMostTurn = 0.3, kMostGrowth = 0.1;
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
  normal_matrix.diagonal().array() += 1e-6;  // also where the scale is not asked for
  const Eigen::Matrix<double, 7, 1> x = normal_matrix.ldlt().solve(right);
  Vec3 turn = x.head<3>();
  turn *= std::min(1.0, kMostTurn / std::max(turn.norm(), 1e-12));
  Similarity step;
  step.scale = std::exp(std::clamp(x[6], -kMostGrowth, kMostGrowth));
  if (turn.norm() > 1e-12) {
    step.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }
  step.translation = middle + x.segment<3>(3) - step.scale * (step.rotation * middle);
  return step;
}

SkullPose FindPose(const SkullShell& reference, const SkullShell& skull, int threads) {
  const SkullShell from = AsShell(ClusterVertices(reference.mesh, kSearchCell_mm));
  const SkullShell to = AsShell(ClusterVertices(skull.mesh, kSearchCell_mm));
  const auto refine = [&](const Stage& stage, const std::vector<Similarity>& poses) {
    return RefinedAll(ShellPair(from, to, stage.cell_mm), poses, stage.rounds, threads);
  };
  const std::vector<Candidate> all = refine(kFirst, Starts(ShellPair(from, to, kFirst.cell_mm)));
  const std::vector<Candidate> some = refine(kMiddle, PosesOf(all, kMiddle.poses));
  constexpr int kRoundsToRest = 40;
  const ShellPair fine(from, to, kLast.cell_mm);
  return {.skull_from_reference = Refined(fine, some.front().pose, kRoundsToRest).pose,
          .misfit_mm = some.front().misfit_mm,
          .rival_misfit_mm = RivalMisfit_mm(some)};
}

Similarity RefinePose(const SkullShell& reference, const SkullShell& skull,
                      const Similarity& skull_from_reference,
                      const std::function<bool(const Vec3&)>& counts) {
  ShellPair pair(reference, skull, kLast.cell_mm);
  const Similarity back = Inverse(skull_from_reference);
  std::erase_if(pair.of_reference, [&](const ShellPoint& p) { return !counts(p.position); });
  std::erase_if(pair.of_skull, [&](const ShellPoint& q) { return !counts(back * q.position); });
  return Refined(pair, skull_from_reference, kLast.rounds).pose;
}

std::string ComplaintAbout(const SkullPose& pose) {
  constexpr double kWorst_mm = 6, kClear = 0.85;
  if (!(pose.misfit_mm < kWorst_mm)) {
    return fmt::format(
        "no pose brings it within {} mm of a skull (mean distance, best {:.1f} mm); check that the "
        "file holds a skull, its unit, and that nothing else is in it",
        kWorst_mm, pose.misfit_mm);
  }
  if (pose.misfit_mm > kClear * pose.rival_misfit_mm) {
    return fmt::format(
        "its shape does not say how it lies: the best pose is off by {:.1f} mm and one turned by "
        "more than 45 degrees by {:.1f} mm; check that the file holds a skull, or add one like it "
        "as --reference",
        pose.misfit_mm, pose.rival_misfit_mm);
  }
  return "";
}

}  // namespace semblance
