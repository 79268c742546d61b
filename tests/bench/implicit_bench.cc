// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit face: our polygonizer against the thesis's three and CGAL's implicit mesher on the
// same field and VTK's, how time and memory grow with the grid and with the skull. Arguments: names
// of parts (below, in main); none: all.
#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>

#include <sys/resource.h>

#include <numeric>

#include "surfaces/emitters/flat_kernel.h"
#include "surfaces/implicit_face.h"
#include "tests/bench/entry.h"
#include "tests/bench/other_work.h"
#include "tests/bench/real_head.h"
#ifdef SEMBLANCE_HAS_VTK
#include "tests/bench/emitter_grid.h"
#include "tests/bench/vtk_peer.h"
#endif

namespace semblance::problems {
namespace {

using bench::CpuSeconds;
using bench::Entry;
using bench::Head;
using bench::kRings;
using bench::PhantomHead;

void Report(const Entry& entry, const std::string& part) {
  bench::Print(entry, "build/tests/bench/implicit_bench " + part);
}

ImplicitFaceOptions Options(const Emitter& emitter, const Polygonizer& polygonizer, int n) {
  ImplicitFaceOptions options{.field = {.emitter = emitter},
                              .resolution = n,
                              .polygonizer = polygonizer,
                              .target_triangles = 10000000};
  if (!std::holds_alternative<NarrowBand>(polygonizer)) {
    options.edges.method = EdgeSearch::kBisection;
  }
  return options;
}

struct Run {
  double seconds = kNaN;
  ImplicitFace face;
};

Run Build(const Head& head, const ImplicitFaceOptions& options, int threads = 1) {
  Run run;
  RunContext context;
  context.threads = threads;
  run.seconds = CpuSeconds(
      [&] { run.face = BuildImplicitFace(head.skull, head.depth_mm, options, context); });
  return run;
}

double PeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Two ways to the same face, and the name of the second in the entries.
struct Contest {
  std::string name;
  ImplicitFaceOptions ours, theirs;
  int runs = 1;
  double goal = kNaN;
  std::string part;
};

// Medians of some runs in turns.
void Compare(const Head& head, const Contest& contest) {
  std::vector<double> our_s, their_s;
  PolygonizeSummary a, b;
  for (int n = 0; n < contest.runs; ++n) {
    const Run ours = Build(head, contest.ours), theirs = Build(head, contest.theirs);
    our_s.push_back(ours.seconds);
    their_s.push_back(theirs.seconds);
    a = ours.face.counts;
    b = theirs.face.counts;
  }
  const auto report = [&](const std::string& of, double ours, double theirs, double to_meet,
                          const std::string& unit) {
    Report({"implicit." + of + "_" + contest.name, ours, theirs, theirs / ours, to_meet, unit},
           contest.part);
  };
  report("vs", Median(our_s), Median(their_s), contest.goal, "s");
  report("emitters_vs", double(a.emitter_evaluations),
         double(b.emitter_evaluations + b.bound_evaluations), kNaN, "emitters and bounds");
  report("evaluations_vs", double(a.corner_evaluations + a.edge_evaluations),
         double(b.corner_evaluations + b.edge_evaluations), kNaN, "points");
}

// The thesis's case: n = 150, k = 6, t = 0.5, on 40 thousand triangles.
ImplicitFaceOptions ThesisCase(const Polygonizer& polygonizer) {
  return Options(SplitEmitter{.cut_below = 0.002}, polygonizer, 150);
}

void AgainstPeer(const Head& head, const std::string& name, const Polygonizer& peer, int runs,
                 double goal) {
  Compare(head, {name, ThesisCase(NarrowBand{}), ThesisCase(peer), runs, goal, "thesis"});
}

void AgainstThesis() {
  const MinMaxOctree minmax{.least_emission = 0.002};
  const Head head = PhantomHead(kRings[1]);
  AgainstPeer(head, "minmax_octree", minmax, 5, 5);
  AgainstPeer(head, "mc_octree", McOctree{}, 1, kNaN);
  AgainstPeer(head, "brute_force", BruteForce{}, 1, kNaN);
  if (const std::optional<TriMesh> shell = bench::RealShell("implicit.vs_minmax_octree_skull")) {
    AgainstPeer(bench::RealHead(*shell, 40000), "minmax_octree_skull", minmax, 3, 5);
  }
}

MinMaxOctree Octree(EmitterMinimum minimum, ListSums sums) {
  return {.least_emission = 0.002, .minimum = minimum, .sums = sums};
}

// What of the lead over the min-max octree is our search along edges, what our summing eight
// emitters at once, and what the thesis's cache takes of it: each made equal in turn, then all.
void AgainstThesisAtPar() {
  const Head head = PhantomHead(kRings[1]);
  const ImplicitFaceOptions ours = ThesisCase(NarrowBand{});
  ImplicitFaceOptions bisecting = ours;
  bisecting.edges.method = EdgeSearch::kBisection;
  const auto compare = [&](const std::string& name, const ImplicitFaceOptions& a,
                           const MinMaxOctree& peer) {
    Compare(head, {"minmax_octree_" + name, a, ThesisCase(peer), 3, kNaN, "par"});
  };
  compare("same_search", bisecting, Octree(EmitterMinimum::kBall, ListSums::kOneByOne));
  compare("same_lanes", ours, Octree(EmitterMinimum::kBall, ListSums::kLanes));
  compare("cached", ours, Octree(EmitterMinimum::kCachedCorners, ListSums::kOneByOne));
  compare("same_search_and_lanes", bisecting, Octree(EmitterMinimum::kBall, ListSums::kLanes));
  compare("cached_same_search_and_lanes", bisecting,
          Octree(EmitterMinimum::kCachedCorners, ListSums::kLanes));
}

// The thesis's cache against asking each corner's emitters anew for each node.
void EmitterCacheSaves() {
  const Head head = PhantomHead(kRings[1]);
  const auto build = [&](EmitterMinimum minimum) {
    return Build(head, ThesisCase(Octree(minimum, ListSums::kOneByOne)));
  };
  const Run cached = build(EmitterMinimum::kCachedCorners), anew = build(EmitterMinimum::kCorners);
  Report({"implicit.emitter_cache", cached.seconds, anew.seconds, anew.seconds / cached.seconds},
         "par");
  const auto emitters = double(cached.face.counts.emitter_evaluations),
             emitters_anew = double(anew.face.counts.emitter_evaluations);
  Report({"implicit.emitter_cache_evaluations", emitters, emitters_anew, emitters_anew / emitters,
          kNaN, "emitters"},
         "par");
}

void AtPar() {
  AgainstThesisAtPar();
  EmitterCacheSaves();
}

// Every crossed cell's corners once, every crossed edge once: fewer evaluations cannot do.
void AgainstFloor() {
  const Head head = PhantomHead(kRings[1]);
  for (const Emitter& emitter :
       {Emitter(FlatEmitter{}), Emitter(SplitEmitter{.cut_below = 0.002})}) {
    const ImplicitFace face = Build(head, Options(emitter, NarrowBand{}, 150)).face;
    const PolygonizeSummary& counts = face.counts;
    // Of a closed surface, corners of crossed cells are what NarrowBand asks for; points are edges.
    const double floor = double(counts.corner_evaluations) + double(face.dense.points.size());
    const double ours = double(counts.corner_evaluations + counts.edge_evaluations);
    const bool flat = std::holds_alternative<FlatEmitter>(emitter);
    Report({flat ? "implicit.evaluations_vs_floor" : "implicit.evaluations_vs_floor_split", ours,
            floor, floor / ours, 0.67, "points"},
           "floor");
  }
}

void Growth() {
  const Head head = PhantomHead(kRings[1]);
  std::vector<double> seconds;
  const std::vector<int> sizes = {75, 150, 300, 600};
  for (const int n : sizes) {
    seconds.push_back(Build(head, Options(FlatEmitter{}, NarrowBand{}, n)).seconds);
    Report({fmt::format("implicit.seconds_n{}", n), seconds.back()}, "growth");
  }
  Report({"implicit.exponent_n", std::log2(seconds.back() / seconds.front()) / 3, kNaN, kNaN, 2.1,
          "1", true},
         "growth");
}

// How the program's greatest memory grows with the grid, from when nothing is polygonised yet.
void Memory() {
  const Head head = PhantomHead(kRings[1]);
  const double before = PeakMegabytes();
  std::vector<double> used;
  for (const int n : {150, 300, 600}) {  // rising: the peak never falls
    Build(head, Options(FlatEmitter{}, NarrowBand{}, n));
    used.push_back(PeakMegabytes() - before);
    Report({fmt::format("implicit.megabytes_n{}", n), used.back(), kNaN, kNaN, kNaN, "MB"},
           "memory");
  }
  Report({"implicit.exponent_memory", std::log2(used.back() / used.front()) / 2, kNaN, kNaN, 2.1,
          "1", true},
         "memory");
}

void EmitterGrowth() {
  std::vector<double> seconds;
  for (const int rings : kRings) {
    const Head head = PhantomHead(rings);
    seconds.push_back(Build(head, Options(FlatEmitter{}, NarrowBand{}, 150)).seconds);
    Report(
        {fmt::format("implicit.seconds_{}_emitters", head.skull.triangles.size()), seconds.back()},
        "emitters");
  }
  Report({"implicit.exponent_emitters", std::log2(seconds.back() / seconds.front()) / 4, kNaN, kNaN,
          1, "1", true},
         "emitters");
}

// The real skull, each number of triangles with each grid.
void RealSkull() {
  const std::optional<TriMesh> shell = bench::RealShell("implicit.skull");
  if (!shell) {
    return;
  }
  for (const int triangles : {10000, 40000, 160000}) {
    const Head head = bench::RealHead(*shell, triangles);
    for (const int n : {75, 150, 300, 600}) {
      const Run run = Build(head, Options(FlatEmitter{}, NarrowBand{}, n));
      Report({fmt::format("implicit.skull_{}_seconds_n{}", triangles, n), run.seconds}, "skull");
    }
  }
}

// Wall time of one thread over that of two, in turns: the median of the pairs during which other
// programs took next to nothing of the machine.
void TwoThreads() {
  constexpr double kMostOthers = 0.05;  // processors
  constexpr int kPairs = 9;
  constexpr std::size_t kEnough = 3;
  const Head head = PhantomHead(kRings[1]);
  const auto wall = [&](int threads) {
    const bench::OtherWork others;
    Build(head, Options(FlatEmitter{}, NarrowBand{}, 150), threads);
    return others.WallSeconds();
  };
  std::vector<double> one, two, ratios;
  for (int n = 0; n < kPairs; ++n) {
    const bench::OtherWork others;
    const double alone = wall(1), both = wall(2);
    if (others.Processors() > kMostOthers) {
      continue;
    }
    one.push_back(alone);
    two.push_back(both);
    ratios.push_back(alone / both);
  }
  Entry entry{"implicit.two_threads", kNaN, kNaN, kNaN, 1.7};
  entry.busy = ratios.size() < kEnough;
  if (!entry.busy) {
    entry.ours = Median(two);
    entry.peer = Median(one);
    entry.ratio = Median(ratios);
  }
  Report(entry, "threads");
}

// CGAL's Delaunay refinement (Boissonnat & Oudot 2005) of the same field, to triangles of about the
// same size.
void AgainstCgal() {
  using Triangulation = CGAL::Surface_mesh_default_triangulation_3;
  using Traits = Triangulation::Geom_traits;
  const Head head = PhantomHead(kRings[1]);
  const Run ours = Build(head, Options(FlatEmitter{}, NarrowBand{}, 75));
  const ImplicitSurface field(head.skull, head.depth_mm, {});
  const Box3 box = Bounds(ours.face.dense);
  const Vec3 middle = box.center();
  std::int64_t asked = 0;
  const std::function<double(Traits::Point_3)> outside = [&](const Traits::Point_3& p) {
    ++asked;
    return -field.Flattened(Vec3(p.x(), p.y(), p.z()));
  };
  std::size_t facets = 0;
  const double seconds = CpuSeconds([&] {
    Triangulation triangulation;
    CGAL::Complex_2_in_triangulation_3<Triangulation> surface(triangulation);
    const Traits::Sphere_3 ball({middle.x(), middle.y(), middle.z()}, box.sizes().squaredNorm());
    const CGAL::Implicit_surface_3<Traits, std::function<double(Traits::Point_3)>> implicit(
        outside, ball, 1e-4);
    const double size = ours.face.cell_mm;
    const CGAL::Surface_mesh_default_criteria_3<Triangulation> criteria(30, size, size);
    CGAL::make_surface_mesh(surface, implicit, criteria, CGAL::Manifold_tag());
    facets = surface.number_of_facets();
  });
  const double per_triangle = seconds / double(facets),
               ours_per_triangle = ours.seconds / double(ours.face.dense.triangles.size());
  Report({"implicit.vs_cgal_per_triangle", 1e6 * ours_per_triangle, 1e6 * per_triangle,
          per_triangle / ours_per_triangle, kNaN, "us"},
         "cgal");
  Report({"implicit.points_per_triangle_vs_cgal",
          double(ours.face.counts.corner_evaluations + ours.face.counts.edge_evaluations) /
              double(ours.face.dense.triangles.size()),
          double(asked) / double(facets), kNaN, kNaN, "points"},
         "cgal");
}

// VTK asks the same field at every corner of a grid that is no larger than the surface needs.
#ifdef SEMBLANCE_HAS_VTK
SampleGrid GridAround(const ImplicitFace& face) {
  const Box3 box = Bounds(face.dense);
  SampleGrid grid{box.min() - Vec3::Constant(face.cell_mm), Vec3::Constant(face.cell_mm), {}};
  for (int axis = 0; axis < 3; ++axis) {
    grid.counts[axis] = static_cast<int>(std::ceil(box.sizes()[axis] / face.cell_mm)) + 3;
  }
  return grid;
}

// The thesis's case, the field by a grid of emitters; of three sizes of its cells that which serves
// VTK best.
void AgainstVtkByGrid(const std::string& name, const Head& head) {
  constexpr double kInfluence = 500;
  const SplitEmitter emitter{.cut_below = 1 / kInfluence};
  std::vector<double> ours, theirs;
  for (int n = 0; n < 3; ++n) {
    const Run run = Build(head, Options(emitter, NarrowBand{}, 150));
    ours.push_back(run.seconds);
    const SampleGrid grid = GridAround(run.face);
    double best = kNaN;
    for (const double cell_mm : {2.0, 4.0, 8.0}) {
      const double seconds = CpuSeconds([&] {
        const ImplicitSurface surface(head.skull, head.depth_mm, {emitter, 1e-3});
        const bench::EmitterGrid field(surface, Bounds(run.face.dense), cell_mm, kInfluence);
        bench::TrianglesByVtk([&field](const Vec3& p) { return field.Flattened(p); }, grid);
      });
      best = std::fmin(best, seconds);
    }
    theirs.push_back(best);
  }
  Report({name, Median(ours), Median(theirs), Median(theirs) / Median(ours), 20}, "vtk");
}

// The field by our own tree and cubes, which answer at once away from the skull.
void AgainstVtkByOurLists() {
  const Head head = PhantomHead(kRings[1]);
  for (const Emitter& emitter :
       {Emitter(SplitEmitter{.cut_below = 0.002}), Emitter(FlatEmitter{})}) {
    const bool split = std::holds_alternative<SplitEmitter>(emitter);
    std::vector<double> ours, theirs;
    std::size_t our_triangles = 0, their_triangles = 0;
    for (int n = 0; n < 3; ++n) {
      const Run run = Build(head, Options(emitter, NarrowBand{}, 150));
      ours.push_back(run.seconds);
      our_triangles = run.face.dense.triangles.size();
      const SampleGrid grid = GridAround(run.face);
      theirs.push_back(CpuSeconds([&] {
        const ImplicitSurface field(head.skull, head.depth_mm, {emitter, 1e-3});
        their_triangles =
            bench::TrianglesByVtk([&field](const Vec3& p) { return field.Flattened(p); }, grid);
      }));
    }
    const double our_s = Median(ours), their_s = Median(theirs);
    const std::string of = split ? "" : "_flat";
    Report({"implicit.vs_vtk_with_our_lists" + of, our_s, their_s, their_s / our_s}, "vtk");
    Report({"implicit.triangles_vtk" + of, double(our_triangles), double(their_triangles), kNaN,
            kNaN, "triangles"},
           "vtk");
  }
}

void AgainstVtk() {
  AgainstVtkByGrid("implicit.vs_vtk", PhantomHead(kRings[1]));
  if (const std::optional<TriMesh> shell = bench::RealShell("implicit.vs_vtk_skull")) {
    AgainstVtkByGrid("implicit.vs_vtk_skull", bench::RealHead(*shell, 40000));
  }
  AgainstVtkByOurLists();
}
#else
void AgainstVtk() {
  fmt::print(stderr,
             "implicit_bench: no VTK here, implicit.vs_vtk is skipped; for it install "
             "libvtk9-dev\n");
}
#endif

// Emitters a second in the whole program against a bare loop over batches that stay in the cache.
void Kernel() {
  const Head head = PhantomHead(kRings[1]);
  const ImplicitSurface surface(head.skull, head.depth_mm, {});
  const Run run = Build(head, Options(FlatEmitter{}, NarrowBand{}, 150));
  std::int64_t emitters = 0;
  double sum = 0;
  const double seconds = CpuSeconds([&] {
    for (const Vec3& p : run.face.dense.points) {
      sum += surface.Flattened(p, emitters);
    }
  });
  std::array<FlatEmitterLanes, 32> lanes;
  for (int b = 0; b < 32; ++b) {
    for (int l = 0; l < FlatEmitterLanes::kLanes; ++l) {
      const Vec3 at(b, l, 0);
      lanes[b].Set(l, at, at + Vec3(1, 0, 0), at + Vec3(0, 1, 0), Vec3::UnitZ(), 1);
    }
  }
  std::array<std::int32_t, 64> runs;
  std::iota(runs.begin(), runs.end(), 0);
  const FlatQuadrature quadrature(9);
  constexpr int kRounds = 40000;
  const double bare = CpuSeconds([&] {
    for (int n = 0; n < kRounds; ++n) {
      FlatWalk walk;
      AddFlat(lanes, runs, Vec3(0.001 * n, 4, 40), quadrature, walk);
      sum += walk.sum[0];
    }
  });
  const double ours = double(emitters) / seconds,
               peak = kRounds * double(lanes.size()) * FlatEmitterLanes::kLanes / bare;
  Report({"implicit.emitters_per_second_vs_peak", ours, peak, sum == 0 ? kNaN : ours / peak, kNaN,
          "1/s"},
         "kernel");
}

}  // namespace
}  // namespace semblance::problems

int main(int count, char** arguments) {
  const std::vector<std::pair<std::string, void (*)()>> parts = {
      {"memory", semblance::problems::Memory},  // before others have needed any
      {"thesis", semblance::problems::AgainstThesis},
      {"par", semblance::problems::AtPar},
      {"floor", semblance::problems::AgainstFloor},
      {"growth", semblance::problems::Growth},
      {"emitters", semblance::problems::EmitterGrowth},
      {"threads", semblance::problems::TwoThreads},
      {"cgal", semblance::problems::AgainstCgal},
      {"skull", semblance::problems::RealSkull},
      {"vtk", semblance::problems::AgainstVtk},
      {"kernel", semblance::problems::Kernel}};
  const std::vector<std::string> asked(arguments + 1, arguments + count);
  for (const auto& [name, run] : parts) {
    if (asked.empty() || std::find(asked.begin(), asked.end(), name) != asked.end()) {
      run();
    }
  }
}
