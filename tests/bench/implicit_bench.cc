// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit face: our polygonizer against the thesis's three and CGAL's implicit mesher on the
// same field, how time grows with the grid and with the skull, how far the surface depends on the
// skull's mesh. Arguments: names of parts (below, in main); none: all.
#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>

#include <chrono>
#include <filesystem>
#include <map>

#include "problems/phantom.h"
#include "surfaces/decimate.h"
#include "surfaces/flat_batch.h"
#include "surfaces/implicit_face.h"
#include "surfaces/mesh_io.h"
#include "surfaces/skull_fill.h"
#include "tests/bench/entry.h"

namespace semblance {
namespace {

using bench::CpuSeconds;
using bench::Entry;

struct Head {
  TriMesh skull;
  std::vector<double> depth_mm;
};

Head PhantomHead(int rings) {
  Phantom phantom = MakePhantom({.random_seed = 1, .rings = rings});
  return {std::move(phantom.skull), std::move(phantom.depth_mm)};
}

// About 10, 40 and 160 thousand triangles.
constexpr std::array<int, 3> kRings = {58, 115, 231};

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

// The thesis's case: n = 150, k = 6, t = 0.5, on 40 thousand triangles.
void AgainstThesis() {
  const Head head = PhantomHead(kRings[1]);
  const SplitEmitter emitter{.cut_below = 0.002};
  const Run ours = Build(head, Options(emitter, NarrowBand{}, 150));
  const std::vector<std::pair<std::string, Polygonizer>> peers = {
      {"minmax_octree", MinMaxOctree{.least_emission = 0.002}},
      {"mc_octree", McOctree{}},
      {"brute_force", BruteForce{}}};
  for (const auto& [name, peer] : peers) {
    const Run theirs = Build(head, Options(emitter, peer, 150));
    const double goal = name == "minmax_octree" ? 5 : kNaN;
    Report(
        {"implicit.vs_" + name, ours.seconds, theirs.seconds, theirs.seconds / ours.seconds, goal},
        "thesis");
    const PolygonizeSummary &a = ours.face.counts, &b = theirs.face.counts;
    Report({"implicit.emitters_vs_" + name, double(a.emitter_evaluations),
            double(b.emitter_evaluations + b.bound_evaluations),
            double(b.emitter_evaluations + b.bound_evaluations) / double(a.emitter_evaluations),
            kNaN, "emitters and bounds"},
           "thesis");
    Report({"implicit.evaluations_vs_" + name, double(a.corner_evaluations + a.edge_evaluations),
            double(b.corner_evaluations + b.edge_evaluations),
            double(b.corner_evaluations + b.edge_evaluations) /
                double(a.corner_evaluations + a.edge_evaluations),
            kNaN, "points"},
           "thesis");
  }
  Report({"implicit.thesis_case_triangles", double(ours.face.dense.triangles.size()), kNaN, kNaN,
          kNaN, "triangles"},
         "thesis");
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

void TwoThreads() {
  const Head head = PhantomHead(kRings[1]);
  const auto wall = [&](int threads) {
    const auto start = std::chrono::steady_clock::now();
    Build(head, Options(FlatEmitter{}, NarrowBand{}, 150), threads);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::vector<double> one, two;
  for (int n = 0; n < 5; ++n) {
    one.push_back(wall(1));
    two.push_back(wall(2));
  }
  const double best_one = *std::min_element(one.begin(), one.end()),
               best_two = *std::min_element(two.begin(), two.end());
  Report({"implicit.two_threads", best_two, best_one, best_one / best_two, 1.7}, "threads");
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
  std::array<FlatBatch, 32> batches;
  for (int b = 0; b < 32; ++b) {
    for (int l = 0; l < FlatBatch::kLanes; ++l) {
      const Vec3 at(b, l, 0);
      batches[b].Set(l, at, at + Vec3(1, 0, 0), at + Vec3(0, 1, 0), Vec3::UnitZ(), 1);
    }
  }
  constexpr int kRounds = 40000;
  const double bare = CpuSeconds([&] {
    FlatBatch::Lanes emission;
    for (int n = 0; n < kRounds; ++n) {
      for (const FlatBatch& batch : batches) {
        EmitFlat(batch, Vec3(0.001 * n, 4, 40), 9, emission);
        sum += emission[0];
      }
    }
  });
  const double ours = double(emitters) / seconds,
               peak = kRounds * double(batches.size()) * FlatBatch::kLanes / bare;
  Report({"implicit.emitters_per_second_vs_peak", ours, peak, sum == 0 ? kNaN : ours / peak, kNaN,
          "1/s"},
         "kernel");
}

// Where the outermost surface lies over some vertices of a skull, along their normals.
std::vector<double> Heights(const ImplicitSurface& surface, const Head& from) {
  constexpr std::size_t kEach = 701;
  const std::vector<Vec3> normals = VertexNormals(from.skull);
  std::vector<double> heights;
  for (std::size_t v = 0; v < normals.size(); v += kEach) {
    const double step = 0.25 * from.depth_mm[v];
    const auto inside = [&](double h) {
      return surface.Value(from.skull.points[v] + h * normals[v]) > 0;
    };
    double low = 0;
    for (double h = step; h < 24 * step; h += step) {
      low = inside(h) ? h : low;
    }
    double high = low + step;
    for (int n = 0; n < 10; ++n) {
      const double middle = 0.5 * (low + high);
      (inside(middle) ? low : high) = middle;
    }
    heights.push_back(low);
  }
  return heights;
}

double RmsDifference(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    sum += (a[n] - b[n]) * (a[n] - b[n]);
  }
  return std::sqrt(sum / double(a.size()));
}

// How far the surfaces of coarser meshes of one skull lie from that of the finest.
void Independence(const std::string& subject, const std::vector<Head>& coarse_to_fine) {
  const std::map<std::string, Emitter> emitters = {
      {"flat", FlatEmitter{}},
      {"flat_linear", FlatEmitter{6, EmitterDepth::kLinear}},
      {"split", SplitEmitter{.cut_below = 0.002}},
      {"thesis", ThesisEmitter{.cut_below = 0.002}}};
  const Head& finest = coarse_to_fine.back();
  for (const auto& [name, emitter] : emitters) {
    const auto heights = [&](const Head& head) {
      return Heights(ImplicitSurface(head.skull, head.depth_mm, {emitter, 1e-3}), finest);
    };
    const std::vector<double> reference = heights(finest);
    for (std::size_t n = 0; n + 1 < coarse_to_fine.size(); ++n) {
      Report({fmt::format("implicit.{}_{}_rms_from_{}_to_{}", subject, name,
                          coarse_to_fine[n].skull.triangles.size(), finest.skull.triangles.size()),
              RmsDifference(heights(coarse_to_fine[n]), reference), kNaN, kNaN,
              name.starts_with("flat") ? 0.15 : kNaN, "mm", true},
             "independence");
    }
  }
}

void MeshIndependence() {
  std::vector<Head> phantoms;
  for (const int rings : kRings) {
    phantoms.push_back(PhantomHead(rings));
  }
  Independence("phantom", phantoms);
  const std::filesystem::path cranium = SEMBLANCE_SOURCE_DIR "/../shared/data/cranium/skull.ply";
  if (!std::filesystem::exists(cranium)) {
    return;
  }
  const TriMesh shell = FillSkull(ReadMesh(cranium), WrapFill{.edge_mm = 1}, {});
  std::vector<Head> heads;
  for (const int count : {10000, 40000, 160000}) {
    Head head{Decimate(shell, count), {}};
    for (const Vec3& p : head.skull.points) {
      head.depth_mm.push_back(7 + 3 * std::sin(0.03 * p.x()) * std::cos(0.04 * p.z()));
    }
    heads.push_back(std::move(head));
  }
  Independence("cranium", heads);
}

}  // namespace
}  // namespace semblance

int main(int count, char** arguments) {
  const std::vector<std::pair<std::string, void (*)()>> parts = {
      {"thesis", semblance::AgainstThesis}, {"floor", semblance::AgainstFloor},
      {"growth", semblance::Growth},        {"emitters", semblance::EmitterGrowth},
      {"threads", semblance::TwoThreads},   {"cgal", semblance::AgainstCgal},
      {"kernel", semblance::Kernel},        {"independence", semblance::MeshIndependence}};
  const std::vector<std::string> asked(arguments + 1, arguments + count);
  for (const auto& [name, run] : parts) {
    if (asked.empty() || std::find(asked.begin(), asked.end(), name) != asked.end()) {
      run();
    }
  }
}
