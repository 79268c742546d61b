// SPDX-License-Identifier: GPL-3.0-or-later
// Points that were held out: a terrain without noise, a deep-drawn part with noise and gaps, and
// real faces.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/bench/fit_parts.h"
#include "tests/bench/mba.h"
#include "tests/bench/peer_program.h"
#include "tests/testing/drawn_part.h"
#include "tests/testing/terrain.h"

namespace semblance::bench {
using namespace problems;
namespace {

using Height = std::function<double(const Vec2&)>;

struct Scene {
  FitTarget fitted;
  std::vector<FitPoint> held;  // one in ten
  std::vector<FitPoint> gaps;  // without noise, where no point was seen
  double lowest = kNaN, highest = kNaN;
};

constexpr std::size_t kTenth = 9;  // that is held out where one is

Scene Split(FitTarget all, std::size_t tenth = kTenth) {
  Scene scene;
  for (std::size_t k = 0; k < all.points.size(); ++k) {
    FitPoint& p = all.points[k];
    p.position.head<2>() = p.uv;  // a height field, as the peers see it
    scene.lowest = std::fmin(scene.lowest, p.position.z());
    scene.highest = std::fmax(scene.highest, p.position.z());
    (k % 10 == tenth ? scene.held : scene.fitted.points).push_back(p);
  }
  return scene;
}

Scene SheetScene() {
  Scene scene = Split(testing::DrawnScan(50000, 1e-4, 5));
  Random random(9);
  while (scene.gaps.size() < 5000) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    if (testing::InDrawnGap(uv)) {
      scene.gaps.push_back({.label = {}, .position = testing::DrawnPoint(uv), .uv = uv});
    }
  }
  return scene;
}

// The front of a head's skin down to 200 mm below its top, as distances from a vertical axis over
// angle and height; of what lies behind each other, as in airways, the outermost. None
// without the mesh, which lies beside the project.
std::optional<FitTarget> FacePoints(const std::string& person) {
  constexpr double kDown_mm = 200, kSide_deg = 55, kCell_mm = 2, kSkin_mm = 1;
  const std::filesystem::path path =
      std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "../shared/data" / person / "skin.ply";
  if (!std::filesystem::exists(path)) {
    return std::nullopt;
  }
  const std::vector<Vec3> skin = ReadMesh(path).points;
  const double top = std::ranges::max(skin, {}, [](const Vec3& p) { return p.z(); }).z();
  Vec3 sum = Vec3::Zero();
  double count = 0;
  for (const Vec3& p : skin) {
    if (p.z() > top - kDown_mm) {
      sum += p;
      ++count;
    }
  }
  const Vec3 centre = sum / count;
  FitTarget face;
  std::map<std::array<int, 2>, double> farthest;  // of a cell
  const auto cell_of = [&](const FitPoint& p) {
    return std::array{static_cast<int>(p.uv.x() * kDown_mm / kCell_mm),
                      static_cast<int>(p.uv.y() * kDown_mm / kCell_mm)};
  };
  for (const Vec3& p : skin) {
    const double turn_deg =
        std::atan2(p.x() - centre.x(), centre.y() - p.y()) * 180 / std::numbers::pi;
    if (p.z() > top - kDown_mm && std::abs(turn_deg) < kSide_deg) {
      const Vec2 uv(0.5 + turn_deg / (2 * kSide_deg), 1 - (top - p.z()) / kDown_mm);
      const double radius = (p - centre).head<2>().norm();
      face.points.push_back({.label = {}, .position = Vec3(0, 0, radius), .uv = uv});
      double& cell = farthest[cell_of(face.points.back())];
      cell = std::max(cell, radius);
    }
  }
  std::erase_if(face.points, [&](const FitPoint& p) {
    return p.position.z() < farthest.at(cell_of(p)) - kSkin_mm;
  });
  return face;
}

double RmsAt(const std::vector<FitPoint>& points, const Height& height) {
  double sum = 0;
  for (const FitPoint& p : points) {
    sum += std::pow(height(p.uv) - p.position.z(), 2);
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

// How far the surface in the gaps goes beyond all points, of the range of their heights.
double Beyond(const Scene& scene, const Height& height) {
  double beyond = 0;
  for (const FitPoint& p : scene.gaps) {
    const double z = height(p.uv);
    beyond = std::max({beyond, z - scene.highest, scene.lowest - z});
  }
  return beyond / (scene.highest - scene.lowest);
}

Measured Score(const Scene& scene, double begin, const Height& height) {
  Measured measured;
  measured.seconds = CpuSecondsSoFar() - begin;
  measured.peak_mb = PeakMb();
  measured.rms_mm = RmsAt(scene.held, height);
  measured.largest_mm = Beyond(scene, height);
  return measured;
}

// Nothing tuned: smoothness of the surface, its weight chosen by cross-validation, down to the
// level that has about as many vertices as there are points.
Measured FitScene(const Scene& scene, const SchedulePlan& plan) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = FinestPlanLevel(plan)};
  const SmoothnessTerm smooth{
      .weight = AutoOr<double>::Auto(), .of = SmoothnessOf::kSurface, .length_mm = 1};
  const FitOptions options{
      .plan = plan, .terms = {PointTerm{}, smooth}, .solver = Solver::kFastest};
  const double begin = CpuSecondsSoFar();
  const FitResult result = Fit(testing::PlainStart(shape), scene.fitted, {}, options, {});
  return Score(scene, begin, [&](const Vec2& uv) { return result.surface.Point(uv).z(); });
}

// Nothing chosen at all.
Measured FitUntold(const Scene& scene) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0};
  const FitOptions options{.plan = AutoPlan{},
                           .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
                           .solver = Solver::kFastest};
  const double begin = CpuSecondsSoFar();
  const FitResult result = Fit(testing::PlainStart(shape), scene.fitted, {}, options, {});
  return Score(scene, begin, [&](const Vec2& uv) { return result.surface.Point(uv).z(); });
}

Measured Mba(const Scene& scene, int levels) {
  std::vector<HeightPoint> points;
  for (const FitPoint& p : scene.fitted.points) {
    points.push_back({p.uv.x(), p.uv.y(), p.position.z()});
  }
  const double begin = CpuSecondsSoFar();
  const MultilevelBSpline surface(std::move(points), levels);
  return Score(scene, begin, [&](const Vec2& uv) { return surface.Height(uv.x(), uv.y()); });
}

// With the number of levels that is best for the points held out, which its user would not know.
Measured BestMba(const Scene& scene) {
  Measured best;
  for (int levels = 6; levels <= 11; ++levels) {
    const Measured measured = MeasureApart([&] { return Mba(scene, levels); });
    best = measured.rms_mm >= best.rms_mm ? best : measured;
  }
  return best;
}

// With the number of patches that is best for them; NaN without scipy.
Measured BestFitpack(const Scene& scene) {
  const auto values = [](const std::vector<FitPoint>& points) {
    std::vector<double> numbers;
    for (const FitPoint& p : points) {
      numbers.insert(numbers.end(), {p.uv.x(), p.uv.y(), p.position.z()});
    }
    return numbers;
  };
  const PeerFiles files({{"points", values(scene.fitted.points)}, {"held", values(scene.held)}});
  return AskScipy(
      fmt::format("'{}' {} 16 32 48 64", SEMBLANCE_FITPACK_HELDOUT_PEER, files.Names()));
}

void PrintScene(const std::string& name, const Measured& ours, double peer_rms, double goal) {
  Print(name, ours.rms_mm, peer_rms, goal, "mm");
  Print(name + "_seconds", ours.seconds, kNaN, kNaN, "s");
}

const ListedPlan kLevel5{.schedule = {{5, 1}}};

// The adaptive plan leaves patches with few points as they are, so that it cannot follow each point
// of a rough terrain without noise: no goal.
void RunTerrain() {
  const Scene scene = Split(testing::Scattered(testing::Terrain(7), 60000, 0, 5));
  const Measured mba = BestMba(scene), fitpack = BestFitpack(scene);
  const Measured level = MeasureApart([&] { return FitScene(scene, kLevel5); });
  PrintScene("fit.terrain_heldout_rms_vs_mba", level, mba.rms_mm, 1);
  if (!std::isnan(fitpack.rms_mm)) {
    Print("fit.terrain_heldout_rms_vs_fitpack", level.rms_mm, fitpack.rms_mm, 1, "mm");
  }
  const Measured adaptive = MeasureApart(
      [&] { return FitScene(scene, AdaptivePlan{.tolerance_mm = 1e-3, .finest = 5}); });
  PrintScene("fit.terrain_heldout_adaptive_rms_vs_mba", adaptive, mba.rms_mm, kNaN);
}

// The adaptive plan's tolerance, five times the noise as its documentation has it, says what is
// good enough, so that its user has not asked for the least error held out: no goal.
void RunSheet() {
  const Scene scene = SheetScene();
  const Measured mba = BestMba(scene), fitpack = BestFitpack(scene);
  const double best = std::fmin(mba.rms_mm, fitpack.rms_mm);
  const Measured level = MeasureApart([&] { return FitScene(scene, kLevel5); });
  const Measured adaptive = MeasureApart(
      [&] { return FitScene(scene, AdaptivePlan{.tolerance_mm = 5e-4, .finest = 5}); });
  PrintScene("fit.sheet_heldout_rms_vs_best", level, best, 1);
  PrintScene("fit.sheet_heldout_adaptive_rms_vs_best", adaptive, best, kNaN);
  Print("fit.sheet_gap_max_vs_range", std::max(level.largest_mm, adaptive.largest_mm), kNaN, 0.1,
        "1");
  Print("fit.sheet_gap_max_vs_range_of_mba", mba.largest_mm, kNaN, kNaN, "1");
}

// A tenth is a few dozen points at steps; all ten in turn are every point once. MBA with the number
// of levels that is best for each tenth.
void RunAllTenths(const std::string& person, const FitTarget& face) {
  double ours = 0, mba = 0;
  for (std::size_t tenth = 0; tenth < 10; ++tenth) {
    const Scene scene = Split(face, tenth);
    const auto count = static_cast<double>(scene.held.size());
    ours += std::pow(MeasureApart([&] { return FitUntold(scene); }).rms_mm, 2) * count;
    mba += std::pow(BestMba(scene).rms_mm, 2) * count;
  }
  const auto count = static_cast<double>(face.points.size());
  Print("fit.untuned.skin_" + person + "_each_tenth_rms_vs_mba", std::sqrt(ours / count),
        std::sqrt(mba / count), 1 / 1.1, "mm");
}

// Against the peer that is best on the very points held out.
void RunFaces() {
  for (const std::string person : {"vhm", "cthead", "cranium"}) {
    const std::string name = "fit.untuned.skin_" + person + "_heldout_rms_vs_best_peer";
    const std::optional<FitTarget> face = FacePoints(person);
    if (!face) {
      fmt::print(stderr, "no skin of {}: {} is skipped\n", person, name);
      continue;
    }
    const Scene scene = Split(*face);
    const Measured ours = MeasureApart([&] { return FitUntold(scene); });
    const Measured mba = BestMba(scene), fitpack = BestFitpack(scene);
    PrintScene(name, ours, std::fmin(mba.rms_mm, fitpack.rms_mm), 1 / 1.1);
    fmt::print(stderr,
               "{}: {} points; ours {:.3f} mm in {:.2f} s, MBA {:.3f} in {:.2f}, FITPACK "
               "{:.3f} in {:.1f}\n",
               person, scene.fitted.points.size(), ours.rms_mm, ours.seconds, mba.rms_mm,
               mba.seconds, fitpack.rms_mm, fitpack.seconds);
    RunAllTenths(person, *face);
  }
}

}  // namespace

void RunHeldOut() {
  RunSheet();
  RunTerrain();
  RunFaces();
}

}  // namespace semblance::bench
