// SPDX-License-Identifier: GPL-3.0-or-later
// The fit of many points on one level against a direct solve of the same normal equations, and the
// adaptive fit of a head-like surface, against FITPACK and ITK where they are there.
// Each case runs in a process of its own, so that its peak of memory is its own.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/CholmodSupport>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "fitting/fit.h"
#include "surfaces/hspline_project.h"
#include "tests/testing/scattered_data.h"

namespace semblance {
namespace {

constexpr int kPatches = 128;  // 131 x 131 control vertices

struct Measured {
  double seconds = kNaN;
  double peak_mb = kNaN;
  double rms_mm = kNaN;
  double largest_mm = kNaN;  // of the head, against the clean surface, as rms_mm
  double vertices = kNaN;
};

HSplineSurface Sheet() {
  const HSplineShape shape{.patches_u = kPatches, .patches_v = kPatches, .max_level = 0};
  ControlNet net{.columns = shape.Columns(0), .rows = shape.Rows(0), .vertices = {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.emplace_back(200.0 * (i - 1) / kPatches, 200.0 * (j - 1) / kPatches, 0);
    }
  }
  return HSplineSurface(shape, net);
}

FitPoint PointAt(double u, double v) {
  const double z = 20 * std::sin(9 * u) * std::cos(7 * v) + 3 * std::sin(40 * u * v);
  return {.label = {}, .position = Vec3(200 * u, 200 * v, z), .uv = Vec2(u, v)};
}

FitTarget Points(int count) {
  std::mt19937_64 bits(1);
  const auto uniform = [&] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
  FitTarget target;
  target.points.reserve(count);
  for (int k = 0; k < count; ++k) {
    const double u = uniform(), v = uniform();
    target.points.push_back(PointAt(u, v));
  }
  return target;
}

LevelView ViewOf(const HSplineSurface& sheet, const FitTarget& target) {
  LevelView view{.grid = {.patches_u = kPatches, .patches_v = kPatches},
                 .start = sheet.Net(0),
                 .rest = sheet.Net(0),
                 .lengths_mm = Vec2(200, 200),
                 .observations = {}};
  view.observations.reserve(target.points.size());
  for (const FitPoint& p : target.points) {
    view.observations.push_back({.uv = p.uv, .position = p.position});
  }
  return view;
}

// The peer: Gram matrix of every patch, point by point, one CHOLMOD factor, three right-hand sides.
double SolveDirectly(const HSplineSurface& sheet, const FitTarget& target) {
  using Matrix = Eigen::SparseMatrix<double>;
  using Gram = Eigen::Matrix<double, 16, 16>;
  const PatchGrid grid{.patches_u = kPatches, .patches_v = kPatches};
  const int vertices = sheet.Columns(0) * sheet.Rows(0);
  std::vector<Gram> grams(vertices, Gram::Zero());
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(vertices, 3);
  for (const FitPoint& p : target.points) {
    const Stencil s = sheet.StencilAt(0, p.uv);
    const Eigen::Map<const Eigen::Matrix<double, 16, 1>> w(s.weight.data());
    grams[s.index[0]].noalias() += w * w.transpose();
    for (int k = 0; k < 16; ++k) {
      right.row(s.index[k]) += w[k] * p.position.transpose();
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int patch = 0; patch < kPatches * kPatches; ++patch) {
    const std::array<int, 16> index = grid.PatchVertices(patch % kPatches, patch / kPatches);
    for (int k = 0; k < 256; ++k) {
      const int row = index[k % 16], column = index[k / 16];
      if (row >= column) {
        entries.emplace_back(row, column, grams[index[0]](k % 16, k / 16));
      }
    }
  }
  Matrix normal(vertices, vertices);
  normal.setFromTriplets(entries.begin(), entries.end());
  Eigen::CholmodSupernodalLLT<Matrix, Eigen::Lower> factor;
  factor.setShift(1e-8);
  factor.compute(normal);
  const Eigen::MatrixX3d x = factor.solve(right);
  double sum = 0;
  for (const FitPoint& p : target.points) {
    const Stencil s = sheet.StencilAt(0, p.uv);
    Vec3 at = -p.position;
    for (int k = 0; k < 16; ++k) {
      at += s.weight[k] * x.row(s.index[k]).transpose();
    }
    sum += at.squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(target.points.size()));
}

const std::vector<Term> kPoints = {PointTerm{}};

double SolveLevel(const HSplineSurface& sheet, const FitTarget& target, LevelSolver solver) {
  return FitLevel(ViewOf(sheet, target), kPoints, solver).summary.rms_after_mm;
}

double SolveFit(const HSplineSurface& sheet, const FitTarget& target) {
  return Fit(sheet, target, {},
             {.schedule = {{0, 1}}, .terms = kPoints, .solver = LevelSolver::kFastest}, {})
      .point_rms_mm;
}

using Way = std::function<double(const HSplineSurface&, const FitTarget&)>;

// Of this process so far, user and system: what a loaded machine does not change much.
double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double PeakMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Measured MeasureHere(int count, const Way& way) {
  const HSplineSurface sheet = Sheet();
  const FitTarget target = Points(count);
  const double begin = CpuSeconds();
  Measured measured;
  measured.rms_mm = way(sheet, target);
  measured.seconds = CpuSeconds() - begin;
  measured.peak_mb = PeakMb();
  return measured;
}

// The head-like surface, closed in u, noise 1e-4; finer vertices where a point is farther off than
// the tolerance. Errors on a grid of 400 x 400 that was not fitted.
Measured MeasureHead(int count, double tolerance) {
  const HSplineShape shape{
      .patches_u = 8, .patches_v = 8, .max_level = 5, .closure = Closure::kPeriodicU};
  const HSplineSurface start = testing::PlainStart(shape);
  const FitTarget target = testing::Scattered(testing::HeadPoint, count, 1e-4, 206);
  const double begin = CpuSeconds();
  const FitResult result =
      Fit(start, target, {},
          {.terms = kPoints, .plan = AdaptivePlan{.tolerance_mm = tolerance, .finest = 5}}, {});
  Measured measured;
  measured.seconds = CpuSeconds() - begin;
  measured.peak_mb = PeakMb();
  const testing::CleanError error = testing::ErrorAgainst(testing::HeadPoint, result.surface);
  measured.rms_mm = error.rms;
  measured.largest_mm = error.largest;
  measured.vertices = static_cast<double>(start.Columns(0) * start.Rows(0)) +
                      static_cast<double>(result.surface.Offsets().size());
  return measured;
}

// 1e5 points of the head, noise 1e-4, whose (u,v) are off by up to 0.005 along each axis, a third
// of a patch; one level of 64 x 64 patches. rms_mm: distance of clean points from the nearest point
// of the surface.
Measured MeasureRelaxation(int rounds) {
  const HSplineShape shape{
      .patches_u = 64, .patches_v = 64, .max_level = 0, .closure = Closure::kPeriodicU};
  const HSplineSurface start = testing::PlainStart(shape);
  FitTarget target = testing::Scattered(testing::HeadPoint, 100000, 1e-4, 206);
  testing::Random random(1);
  for (FitPoint& p : target.points) {
    const double u = p.uv.x() + random.Uniform(-0.005, 0.005);
    p.uv = Vec2(u - std::floor(u), std::clamp(p.uv.y() + random.Uniform(-0.005, 0.005), 0.0, 1.0));
  }
  FitOptions options{.schedule = {{0, 1}}, .terms = kPoints, .solver = LevelSolver::kFastest};
  options.relaxation = {.mode = RelaxationMode::kTangentDistance,
                        .rounds = 2,
                        .damping = 0,
                        .max_move_mm = 0.1,
                        .bunching = 0,
                        .distortion = 0,
                        .tangent_rounds = rounds,
                        .tangential = 0.01,
                        .barrier = false};
  const double begin = CpuSeconds();
  const FitResult result = Fit(start, target, {}, options, {});
  Measured measured;
  measured.seconds = CpuSeconds() - begin;
  measured.peak_mb = PeakMb();
  constexpr int kSide = 120;
  const SurfaceProjector projector(result.surface);
  double sum = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 uv((k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide);
    sum += std::pow(projector.Project(testing::HeadPoint(uv)).distance_mm, 2);
  }
  measured.rms_mm = std::sqrt(sum / kSide / kSide);
  return measured;
}

Measured MeasureApart(const std::function<Measured()>& here) {
  std::array<int, 2> ends{};
  Measured measured;
  if (pipe(ends.data()) != 0) {
    return measured;
  }
  const pid_t child = fork();
  if (child == 0) {
    measured = here();
    const bool sent = write(ends[1], &measured, sizeof measured) == sizeof measured;
    _exit(sent ? 0 : 1);
  }
  close(ends[1]);
  if (read(ends[0], &measured, sizeof measured) != sizeof measured) {
    measured = {};
  }
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return measured;
}

Measured MeasureApart(int count, const Way& way) {
  return MeasureApart([&] { return MeasureHere(count, way); });
}

// `ratio` is how many times less than the peer; met if it is at least the goal, or without a peer
// if ours is at most the goal.
void Print(const std::string& name, double ours, double peer, double goal, const char* unit) {
  const double ratio = peer / ours;
  const bool met = std::isnan(peer) ? ours <= goal : ratio >= goal;
  const auto number = [](double x) {
    return !std::isfinite(x) ? "null" : fmt::format("{:.6g}", x);
  };
  fmt::print(
      "{{\"name\":\"{}\",\"ours\":{},\"peer\":{},\"ratio\":{},\"goal\":{},\"met\":{},\"unit\":\"{}"
      "\",\"command\":\"fit_bench\"}}\n",
      name, number(ours), number(peer), number(ratio), number(goal),
      std::isnan(goal) ? "null" : (met ? "true" : "false"), unit);
  std::fflush(stdout);
}

// The head's points, and the clean surface on the grid of ErrorAgainst, as the peers read them.
class HeadFiles {
 public:
  explicit HeadFiles(int count) {
    std::vector<double> points, grid;
    for (const FitPoint& p : testing::Scattered(testing::HeadPoint, count, 1e-4, 206).points) {
      points.insert(points.end(),
                    {p.uv.x(), p.uv.y(), p.position.x(), p.position.y(), p.position.z()});
    }
    constexpr int kSide = 400;
    for (int k = 0; k < kSide * kSide; ++k) {
      const Vec3 p = testing::HeadPoint({(k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide});
      grid.insert(grid.end(), {p.x(), p.y(), p.z()});
    }
    Write("points", points);
    Write("grid", grid);
  }
  ~HeadFiles() { std::filesystem::remove_all(folder_); }
  HeadFiles(const HeadFiles&) = delete;
  HeadFiles& operator=(const HeadFiles&) = delete;

  std::string Names() const { return fmt::format("'{0}/points' '{0}/grid'", folder_.string()); }

 private:
  void Write(const char* name, const std::vector<double>& values) const {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof(double)));
  }

  std::filesystem::path folder_ = [] {
    std::string name = (std::filesystem::temp_directory_path() / "fit_bench_XXXXXX").string();
    return std::filesystem::path(mkdtemp(name.data()) == nullptr ? "" : name);
  }();
};

// What a peer's program says: seconds, RMS, largest distance; NaN if it cannot be run.
Measured AskPeer(const std::string& command) {
  Measured measured;
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) {
    return measured;
  }
  const int read =
      std::fscanf(pipe, "%lf %lf %lf", &measured.seconds, &measured.rms_mm, &measured.largest_mm);
  return pclose(pipe) == 0 && read == 3 ? measured : Measured{};
}

// Their seconds over ours; met if that is the goal or more with an RMS of ours that is no worse.
void PrintAgainst(const char* peer, const Measured& ours, const Measured& theirs, double goal,
                  const char* package) {
  if (std::isnan(theirs.seconds)) {
    fmt::print(stderr, "fit_bench: {} is not measured: the Debian package {} is not there\n", peer,
               package);
    return;
  }
  const bool as_good = ours.rms_mm <= theirs.rms_mm;
  Print(fmt::format("fit.head_1e5_vs_{}", peer), ours.seconds, theirs.seconds,
        as_good ? goal : std::numeric_limits<double>::infinity(), "s");
  Print(fmt::format("fit.head_1e5_rms_vs_{}", peer), ours.rms_mm, theirs.rms_mm, 1, "mm");
}

// FITPACK with 64 x 64 patches, which it needs for the RMS; ITK with 128 x 128, and even so it is
// coarser, for it approximates level by level. No goal was set against ITK.
void RunPeers() {
  const Measured ours = MeasureApart([] { return MeasureHead(100000, 9e-4); });
  const HeadFiles files(100000);
  // The system's Python: another one that comes first does not see Debian's packages.
  const bool scipy = std::system("/usr/bin/python3 -c 'import scipy.interpolate' 2>/dev/null") == 0;
  PrintAgainst("fitpack", ours,
               scipy ? AskPeer(fmt::format("/usr/bin/python3 '{}' {} 64", SEMBLANCE_FITPACK_PEER,
                                           files.Names()))
                     : Measured{},
               50, "python3-scipy");
#ifdef SEMBLANCE_ITK_PEER
  PrintAgainst("itk", ours, AskPeer(fmt::format("'{}' {} 8", SEMBLANCE_ITK_PEER, files.Names())),
               kNaN, "libinsighttoolkit5-dev");
#else
  PrintAgainst("itk", ours, {}, kNaN, "libinsighttoolkit5-dev");
#endif
}

// Goals: G+Smo's and GoTools' figures on the same surface (G+Smo 276 s, 1,456 vertices, RMS 5.9e-5,
// largest 8.3e-4; GoTools 100 s, 1,077 vertices, 220 MB; at 1e5 points RMS 7.4e-5), at least 50
// times as fast as the faster one, with at most twice the vertices of the sparser one.
void RunHead() {
  const Measured few = MeasureApart([] { return MeasureHead(10000, 1.5e-3); }),
                 some = MeasureApart([] { return MeasureHead(100000, 9e-4); }),
                 many = MeasureApart([] { return MeasureHead(1000000, 8e-4); });
  Print("fit.head_1e6_adaptive_seconds", many.seconds, kNaN, 2.0, "s");
  Print("fit.head_1e6_adaptive_rms", many.rms_mm, kNaN, 5.9e-5, "mm");
  Print("fit.head_1e6_adaptive_largest", many.largest_mm, kNaN, 8.3e-4, "mm");
  Print("fit.head_1e6_adaptive_vertices", many.vertices, kNaN, 2 * 1077, "1");
  Print("fit.head_1e6_adaptive_peak_mb", many.peak_mb, kNaN, 220, "MB");
  Print("fit.head_1e5_seconds", some.seconds, kNaN, kNaN, "s");
  Print("fit.head_1e5_rms", some.rms_mm, kNaN, 7.4e-5, "mm");
  Print("fit.head_1e5_vertices", some.vertices, kNaN, 2 * 1046, "1");
  Print("fit.head_exponent_N", std::log10(many.seconds / some.seconds), kNaN, 1.1, "1");
  Print("fit.head_1e4_seconds", few.seconds, kNaN, kNaN, "s");
}

// The fewest sliding rounds that come within 1e-4 of the clean surface; a prototype on Ceres took
// 18 s for 20 rounds and reached 4.4e-5.
void RunRelaxation() {
  Measured measured;
  int rounds = 1;
  for (; rounds <= 16; rounds *= 2) {
    measured = MeasureApart([&] { return MeasureRelaxation(rounds); });
    if (measured.rms_mm <= 1e-4) {
      break;
    }
  }
  const bool reached = measured.rms_mm <= 1e-4;
  Print("fit.relax_1e5_seconds_to_geometric_rms_1e-4", reached ? measured.seconds : kNaN, kNaN, 18,
        "s");
  Print("fit.relax_1e5_geometric_rms", measured.rms_mm, kNaN, 1e-4, "mm");
  Print("fit.relax_1e5_tangent_rounds", rounds, kNaN, kNaN, "1");
}

void Run() {
  const Way fit = SolveFit, peer = SolveDirectly;
  const Way level = [](const auto& s, const auto& t) {
    return SolveLevel(s, t, LevelSolver::kFastest);
  };
  const Way ceres = [](const auto& s, const auto& t) {
    return SolveLevel(s, t, LevelSolver::kCeres);
  };
  const Way none = [](const auto&, const auto&) { return 0.0; };
  constexpr int kMany = 1000000;
  const double data_mb = MeasureApart(kMany, none).peak_mb;
  const Measured direct = MeasureApart(kMany, peer), ours = MeasureApart(kMany, fit);
  const Measured at_level = MeasureApart(kMany, level), by_ceres = MeasureApart(kMany, ceres);
  Print("fit.linear_1e6_vs_direct", ours.seconds, direct.seconds, 0.33, "s");
  Print("fit.level_1e6_vs_direct", at_level.seconds, direct.seconds, 0.33, "s");
  Print("fit.ceres_reduced_1e6_vs_direct", by_ceres.seconds, direct.seconds, kNaN, "s");
  Print("fit.linear_1e6_peak_mb", ours.peak_mb, kNaN, 300, "MB");
  Print("fit.linear_1e6_data_mb", data_mb, kNaN, kNaN, "MB");
  Print("fit.direct_1e6_peak_mb", direct.peak_mb, kNaN, kNaN, "MB");
  Print("fit.linear_1e6_rms", ours.rms_mm, direct.rms_mm, 1 - 1e-6, "mm");
  const Measured few = MeasureApart(kMany / 100, fit), some = MeasureApart(kMany / 10, fit);
  Print("fit.linear_1e4_seconds", few.seconds, kNaN, kNaN, "s");
  Print("fit.linear_1e5_seconds", some.seconds, kNaN, kNaN, "s");
  Print("fit.exponent_N", std::log10(ours.seconds / few.seconds) / 2, kNaN, 1.1, "1");
}

}  // namespace
}  // namespace semblance

// One BLAS thread for every case; OpenBLAS looks at the variable only when it is loaded.
// fit_bench [head] [peers] [relax] [linear]: parts; none: all of them.
int main(int argc, char** argv) {
  if (std::getenv("OPENBLAS_NUM_THREADS") == nullptr) {
    setenv("OPENBLAS_NUM_THREADS", "1", 1);
    execv("/proc/self/exe", argv);
  }
  const auto wanted = [&](const char* part) {
    return argc == 1 || std::any_of(argv + 1, argv + argc,
                                    [&](const char* name) { return std::strcmp(name, part) == 0; });
  };
  if (wanted("head")) {
    semblance::RunHead();
  }
  if (wanted("peers")) {
    semblance::RunPeers();
  }
  if (wanted("relax")) {
    semblance::RunRelaxation();
  }
  if (wanted("linear")) {
    semblance::Run();
  }
  return 0;
}
