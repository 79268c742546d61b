// SPDX-License-Identifier: GPL-3.0-or-later
// Two halves of a surface fitted one after the other: how well the second continues the first, and
// what that costs its points.
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/start_surface.h"
#include "problems/points/fit_joins.h"
#include "tests/bench/fit_measure.h"
#include "tests/testing/scattered_data.h"

namespace semblance::bench {
namespace {

struct JoinedCase {
  std::string name;
  std::function<Vec3(const Vec2&)> surface;  // over the unit square, split at u = 1/2
  int its_patches = 8;                       // of the first half, along the edge
  SchedulePlan its_plan = AutoPlan{};
};

Vec3 Quadratic(const Vec2& q) {
  return {q.x(), q.y(), 0.3 * q.x() * q.x() - 0.2 * q.x() * q.y() + 0.1 * q.y() * q.y()};
}

std::vector<JoinedCase> Cases() {
  return {{.name = "quadratic", .surface = Quadratic},
          {.name = "franke", .surface = testing::FrankePoint},
          {.name = "franke_finer_edge",
           .surface = testing::FrankePoint,
           .its_plan = AdaptivePlan{.tolerance_mm = 1e-3, .finest = 4}},
          {.name = "franke_16_patches", .surface = testing::FrankePoint, .its_patches = 16},
          {.name = "franke_6_patches", .surface = testing::FrankePoint, .its_patches = 6}};
}

FitTarget Half(const JoinedCase& joined, double from, std::uint64_t random_seed) {
  return testing::Scattered(
      [&](const Vec2& uv) { return joined.surface(Vec2(from + uv.x() / 2, uv.y())); }, 10'000, 1e-3,
      random_seed);
}

HSplineSurface StartOf(const FitTarget& target, int patches_v, const SchedulePlan& plan) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  return StartSurface({.patches_v = patches_v, .max_level = FinestLevelOf(plan)}, positions, uv);
}

FitOptions OptionsOf(const SchedulePlan& plan) {
  return {.plan = plan,
          .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto(), .length_mm = 1}},
          .solver = Solver::kFastest};
}

EdgeMeeting WorstOf(const HSplineSurface& second, const HSplineSurface& first) {
  EdgeMeeting worst{.gap_mm = 0, .angle_deg = 0};
  for (const EdgeMeeting& meeting :
       MeetingsAlong({second, SurfaceEdge::kU0}, {first, SurfaceEdge::kU1}, {})) {
    worst.gap_mm = std::max(worst.gap_mm, meeting.gap_mm);
    worst.angle_deg = std::max(worst.angle_deg, meeting.angle_deg);
  }
  return worst;
}

void RunOne(const JoinedCase& one) {
  const FitTarget first = Half(one, 0, 1), second = Half(one, 0.5, 2);
  const HSplineSurface given =
      Fit(StartOf(first, one.its_patches, one.its_plan), first, {}, OptionsOf(one.its_plan), {})
          .surface;
  const FitOptions options = OptionsOf(AutoPlan{});
  const HSplineSurface start = StartOf(second, 8, options.plan);
  const double begin_s = CpuSecondsSoFar();
  const FitResult free = Fit(start, second, {}, options, {});
  const double free_s = CpuSecondsSoFar() - begin_s;
  const OpenedJoin join{.join = {}, .sha256 = "", .surface = given};
  const JoinedFit joined = FitJoined(start, second, std::span(&join, 1), options, {});
  const double joined_s = CpuSecondsSoFar() - begin_s - free_s;
  const EdgeMeeting apart = WorstOf(free.surface, given), held = WorstOf(joined.fit.surface, given);
  const std::string name = "fit.joined_" + one.name;
  Print(name + "_gap", held.gap_mm, apart.gap_mm, kNaN, "mm");
  Print(name + "_angle", held.angle_deg, apart.angle_deg, kNaN, "deg");
  Print(name + "_rms", joined.fit.point_rms_mm, free.point_rms_mm, kNaN, "mm");
  Print(name + "_places", joined.joins[0].places, kNaN, kNaN, "places");
  Print(name + "_cpu", joined_s, free_s, kNaN, "s");
}

void RunAll() {
  for (const JoinedCase& one : Cases()) {
    RunOne(one);
  }
}

}  // namespace
}  // namespace semblance::bench

// The peer is the fit that knows nothing of the join.
int main() { semblance::bench::RunAll(); }
