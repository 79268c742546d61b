// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points and rays on a real skull against CGAL's AABB tree and VTK's locator, and
// `import-ct` against VTK's reader and flying edges; each beside what no program can avoid: to
// evaluate one triangle per question, and to read the file once.
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/bench/entry.h"
#include "tests/bench/program_call.h"
#ifdef SEMBLANCE_HAS_VTK
#include "tests/bench/vtk_peer.h"
#endif

namespace semblance::bench {
namespace {

namespace fs = std::filesystem;
using CgalKernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<CgalKernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<CgalKernel, Triangles::const_iterator>;
using CgalTree = CGAL::AABB_tree<CGAL::AABB_traits<CgalKernel, Primitive>>;

constexpr int kRounds = 5;  // programs take turns; medians count

void PrintRatio(const std::string& name, double ours, double peer, double goal) {
  Print({.name = name, .ours = ours, .peer = peer, .ratio = peer / ours, .goal = goal},
        "mesh_bench");
}

// Medians of the CPU seconds of calls that take turns.
std::vector<double> InTurns(const std::vector<std::function<void()>>& calls) {
  std::vector<std::array<double, kRounds>> cost_s(calls.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t k = 0; k < calls.size(); ++k) {
      cost_s[k][round] = CpuSeconds(calls[k]);
    }
  }
  std::vector<double> medians_s;
  for (auto& of_call : cost_s) {
    std::ranges::sort(of_call);
    medians_s.push_back(of_call[kRounds / 2]);
  }
  return medians_s;
}

// ---------------------------------------------------------------------------------------------
// Closest points and rays
// ---------------------------------------------------------------------------------------------

// Every third point of the skin asks for its closest bone.
struct Questions {
  TriMesh skull;
  std::vector<Vec3> points;
  Vec3 middle;
};

Questions SkinToSkull(const fs::path& head) {
  Questions questions{.skull = ReadMesh(head / "skull.ply"), .points = {}, .middle = {}};
  const TriMesh skin = ReadMesh(head / "skin.ply");
  for (std::size_t v = 0; v < skin.points.size(); v += 3) {
    questions.points.push_back(skin.points[v]);
  }
  questions.middle = Bounds(questions.skull).center();
  return questions;
}

CgalKernel::Point_3 CgalPoint(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

// Single triangles, because skulls are not manifolds.
Triangles ToCgal(const TriMesh& mesh) {
  Triangles triangles;
  for (const Triangle& t : mesh.triangles) {
    triangles.emplace_back(CgalPoint(mesh.points[t[0]]), CgalPoint(mesh.points[t[1]]),
                           CgalPoint(mesh.points[t[2]]));
  }
  return triangles;
}

// The sums keep the compiler from leaving out the work, and prove that both found the same points.
void CheckSame(const std::string& what, double ours, double theirs) {
  if (!(std::abs(ours - theirs) <= 1e-6 * std::abs(theirs))) {
    fmt::print(stderr, "{}: the sums of distances differ: {} and {}\n", what, ours, theirs);
  }
}

void MeasureClosest(const Questions& questions) {
  const Triangles triangles = ToCgal(questions.skull);
  double ours_mm = 0, cgal_mm = 0, floor_mm = 0;
  const auto ours = [&] {
    const MeshQuery query(questions.skull);
    ours_mm = 0;
    for (const Vec3& p : questions.points) {
      ours_mm += query.Closest(p).distance_mm;
    }
  };
  const auto cgal = [&] {
    CgalTree tree(triangles.begin(), triangles.end());
    tree.accelerate_distance_queries();
    cgal_mm = 0;
    for (const Vec3& p : questions.points) {
      cgal_mm += std::sqrt(tree.squared_distance(CgalPoint(p)));
    }
  };
  const auto one_triangle_each = [&] {
    const TriMesh& mesh = questions.skull;
    floor_mm = 0;
    for (std::size_t k = 0; k < questions.points.size(); ++k) {
      const Triangle& t = mesh.triangles[k % mesh.triangles.size()];
      const Vec3& p = questions.points[k];
      floor_mm +=
          (ClosestPointOnTriangle(p, mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]])
               .position -
           p)
              .norm();
    }
  };
  std::vector<std::function<void()>> calls = {ours, cgal, one_triangle_each};
#ifdef SEMBLANCE_HAS_VTK
  double vtk_mm = 0;
  calls.emplace_back([&] { vtk_mm = ClosestByVtk(questions.skull, questions.points); });
#endif
  const std::vector<double> cost_s = InTurns(calls);
  CheckSame("CGAL", ours_mm, cgal_mm);
  PrintRatio("closest.vs_cgal", cost_s[0], cost_s[1], 1);
  PrintRatio("closest.vs_one_triangle_each", cost_s[0], cost_s[2], NAN);
#ifdef SEMBLANCE_HAS_VTK
  CheckSame("VTK", ours_mm, vtk_mm);
  PrintRatio("closest.vs_vtk", cost_s[0], cost_s[3], 1);
#endif
}

void MeasureRays(const Questions& questions) {
  const Triangles triangles = ToCgal(questions.skull);
  double ours_mm = 0, cgal_mm = 0;
  const auto ours = [&] {
    const MeshQuery query(questions.skull);
    ours_mm = 0;
    for (const Vec3& p : questions.points) {
      const auto hit = query.FirstHit(p, questions.middle - p, 1e4);
      ours_mm += hit ? hit->distance_mm : 0;
    }
  };
  const auto cgal = [&] {
    CgalTree tree(triangles.begin(), triangles.end());
    cgal_mm = 0;
    for (const Vec3& p : questions.points) {
      const auto hit =
          tree.first_intersection(CgalKernel::Ray_3(CgalPoint(p), CgalPoint(questions.middle)));
      if (const auto* at = hit ? boost::get<CgalKernel::Point_3>(&hit->first) : nullptr) {
        cgal_mm += (Vec3(at->x(), at->y(), at->z()) - p).norm();
      }
    }
  };
  const std::vector<double> cost_s = InTurns({ours, cgal});
  CheckSame("CGAL's rays", ours_mm, cgal_mm);
  PrintRatio("rays.vs_cgal", cost_s[0], cost_s[1], 1);
}

// ---------------------------------------------------------------------------------------------
// Imports
// ---------------------------------------------------------------------------------------------

// The phantom of 0.5 mm, about 512 x 512 x 500 voxels, as one NIfTI file. Ours writes two files,
// drops inner walls and decimates; VTK only makes its triangles in memory.
void MeasureImport(const fs::path& folder) {
  const std::string volume = (folder / "phantom/head.nii").string();
  CallProgram({"phantom", "--head", "smooth", "--out", (folder / "phantom").string(), "--pixel-mm",
               "0.5", "--slice-mm", "0.5", "--volume", "head.nii"});
  const double ours_s =
      MedianCall({"import-ct", volume, "--out", (folder / "import").string(), "--force", "--quiet"})
          .cpu_s;
  std::vector<std::function<void()>> calls = {[&] { ReadFileBytes(volume); }};
#ifdef SEMBLANCE_HAS_VTK
  calls.emplace_back([&] { SurfacesByVtk(volume, {226, -200}); });
#endif
  const std::vector<double> cost_s = InTurns(calls);
  PrintRatio("import.vs_reading_once", ours_s, cost_s[0], NAN);
#ifdef SEMBLANCE_HAS_VTK
  PrintRatio("import.vs_vtk", ours_s, cost_s[1], 1);
#endif
}

void Measure() {
  const fs::path head = fs::path(SEMBLANCE_SOURCE_DIR) / "../shared/data/vhm";
  if (fs::exists(head / "skull.ply")) {
    const Questions questions = SkinToSkull(head);
    MeasureClosest(questions);
    MeasureRays(questions);
  } else {
    fmt::print(stderr, "no {}: closest.* and rays.* are skipped\n", head.string());
  }
  std::string folder = (fs::temp_directory_path() / "semblance_mesh_XXXXXX").string();
  if (mkdtemp(folder.data()) != nullptr) {
    MeasureImport(folder);
    fs::remove_all(folder);
  }
}

}  // namespace
}  // namespace semblance::bench

int main() { semblance::bench::Measure(); }
