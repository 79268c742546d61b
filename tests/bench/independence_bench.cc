// SPDX-License-Identifier: GPL-3.0-or-later
// How far the implicit surface depends on the skull's mesh: 10, 40 and 160 thousand triangles of
// one skull, each emitter, over the whole skull and where the coarser skull itself is the finer
// one.
#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/quantile.h"
#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/bench/entry.h"
#include "tests/bench/real_head.h"

namespace semblance::problems {
namespace {

using bench::Head;

constexpr std::size_t kEach = 701;  // every so many vertices are looked at
// For quantiles: an RMS of a hundred places hangs on which they are, where two skulls differ at a
// crack of the bone.
constexpr std::size_t kEachDense = 53;

// Where the outermost surface lies over every so many vertices of a skull, along their normals.
std::vector<double> Heights(const ImplicitSurface& surface, const Head& from, std::size_t each) {
  const std::vector<Vec3> normals = VertexNormals(from.skull);
  std::vector<double> heights;
  for (std::size_t v = 0; v < normals.size(); v += each) {
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

// The furthest that the finest skull is from a coarser one within one depth of those vertices.
std::vector<double> SkullDistances(const Head& finest, const TriMesh& coarse) {
  const MeshQuery query(coarse);
  std::vector<double> distance;
  for (const Vec3& p : finest.skull.points) {
    distance.push_back(query.Closest(p).distance_mm);
  }
  std::vector<double> worst;
  for (std::size_t v = 0; v < distance.size(); v += kEach) {
    double most = 0;
    for (std::size_t w = 0; w < distance.size(); ++w) {
      const double apart = (finest.skull.points[w] - finest.skull.points[v]).norm();
      most = apart <= finest.depth_mm[v] ? std::max(most, distance[w]) : most;
    }
    worst.push_back(most);
  }
  return worst;
}

struct Difference {
  double rms_mm = 0;
  std::size_t count = 0, over_1mm = 0;
};

Difference Compare(const std::vector<double>& a, const std::vector<double>& b,
                   const std::vector<double>& skull_mm, double at_most_mm) {
  Difference difference;
  for (std::size_t n = 0; n < a.size(); ++n) {
    if (skull_mm[n] <= at_most_mm) {
      const double apart = std::abs(a[n] - b[n]);
      difference.rms_mm += apart * apart;
      ++difference.count;
      difference.over_1mm += apart > 1 ? 1 : 0;
    }
  }
  difference.rms_mm = std::sqrt(difference.rms_mm / double(difference.count));
  return difference;
}

// The quantiles of how far apart two heights are.
std::vector<double> Apart(const std::vector<double>& a, const std::vector<double>& b,
                          std::span<const double> shares) {
  std::vector<double> apart, quantiles;
  for (std::size_t n = 0; n < a.size(); ++n) {
    apart.push_back(std::abs(a[n] - b[n]));
  }
  for (const double share : shares) {
    quantiles.push_back(Quantile(apart, share));
  }
  return quantiles;
}

void Print(const std::string& name, double ours, double goal, const char* unit) {
  bench::Print({"implicit." + name, ours, kNaN, kNaN, goal, unit, true},
               "build/tests/bench/independence_bench");
}

// How far the surfaces of coarser meshes of one skull lie from that of the finest.
void Independence(const std::string& subject, const std::vector<Head>& coarse_to_fine) {
  constexpr double kAgreement_mm = 0.3;
  const std::map<std::string, Emitter> emitters = {
      {"flat", FlatEmitter{}},
      {"flat_linear", FlatEmitter{6, EmitterDepth::kLinear}},
      {"split", SplitEmitter{.cut_below = 0.002}},
      {"thesis", ThesisEmitter{.cut_below = 0.002}}};
  const Head& finest = coarse_to_fine.back();
  for (std::size_t n = 0; n + 1 < coarse_to_fine.size(); ++n) {
    const Head& coarse = coarse_to_fine[n];
    const std::vector<double> skull_mm = SkullDistances(finest, coarse.skull);
    for (const auto& [emitter_name, emitter] : emitters) {
      const ImplicitSurface coarse_surface(coarse.skull, coarse.depth_mm, {emitter, 1e-3}),
          finest_surface(finest.skull, finest.depth_mm, {emitter, 1e-3});
      const std::vector<double> here = Heights(coarse_surface, finest, kEach),
                                reference = Heights(finest_surface, finest, kEach);
      const std::string name =
          fmt::format("{}_{}_rms_from_{}_to_{}", subject, emitter_name,
                      coarse.skull.triangles.size(), finest.skull.triangles.size());
      const Difference all = Compare(here, reference, skull_mm, 1e300),
                       agreed = Compare(here, reference, skull_mm, kAgreement_mm);
      Print(name, all.rms_mm, kNaN, "mm");
      Print(name + "_over_1mm", double(all.over_1mm) / double(all.count), kNaN, "share");
      Print(name + "_where_skulls_agree", agreed.rms_mm,
            emitter_name.starts_with("flat") ? 0.15 : kNaN, "mm");
      Print(name + "_skulls_agree", double(agreed.count) / double(all.count), kNaN, "share");
      if (emitter_name.starts_with("flat")) {
        const std::vector<double> apart =
            Apart(Heights(coarse_surface, finest, kEachDense),
                  Heights(finest_surface, finest, kEachDense), std::array{0.5, 0.95});
        Print(name + "_dense_median", apart[0], kNaN, "mm");
        Print(name + "_dense_p95", apart[1], kNaN, "mm");
      }
    }
  }
}

void MeasureAll() {
  std::vector<Head> phantoms;
  for (const int rings : bench::kRings) {
    phantoms.push_back(bench::PhantomHead(rings));
  }
  Independence("phantom", phantoms);
  const std::optional<TriMesh> shell = bench::RealShell("the real head");
  if (!shell) {
    return;
  }
  std::vector<Head> heads;
  for (const int count : {10000, 40000, 160000}) {
    heads.push_back(bench::RealHead(*shell, count));
  }
  Independence("cranium", heads);
}

}  // namespace
}  // namespace semblance::problems

int main() { semblance::problems::MeasureAll(); }
