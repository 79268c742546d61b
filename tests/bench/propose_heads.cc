// SPDX-License-Identifier: GPL-3.0-or-later
// How far proposed landmarks are from those that a person placed, on heads that took no part in the
// mean skull: each head with the sites of the others alone.
//   propose_heads DATA           measures; DATA holds HEAD/skull.ply of the three heads below
//   propose_heads DATA --sites   prints configs/mean_skull/sites.csv from all three
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/propose/propose_landmarks.h"
#include "problems/subject/propose/skull_warp.h"
#include "problems/subject/sites.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

struct MarkedHead {
  std::string name;
  TriMesh skull;
  LandmarkFile landmarks;
};

MarkedHead ReadHead(const std::filesystem::path& data, const std::string& name) {
  std::vector<std::string> ignored;
  return {name, ReadMeshInLps(data / name / "skull.ply", ignored),
          ReadLandmarks(std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "configs/landmarks" /
                        (name + ".yaml"))
              .file};
}

// The points of the mean skull that lie on a head's landmarks after the warp, in the direction in
// which proposals use it, so that the warp's own errors cancel.
std::vector<SitePoint> SitesOnMean(const MeanSkull& mean, const MarkedHead& head) {
  const SkullShell shell = MakeShell(head.skull, head.name, /*threads=*/1);
  const Similarity start = FitAverageSkull(head.landmarks.Points()).skull_from_average;
  const AdaptedSkull adapted =
      AdaptMeanSkull(mean, shell, FacePose(mean.head, shell, start), /*known=*/{});
  const ThinPlate plate = WarpOnto(adapted.head, shell, adapted.skull_from_head);
  TriMesh warped = adapted.head.shell.mesh;
  std::ranges::transform(warped.points, warped.points.begin(), plate);
  const MeshQuery query(warped);
  const std::vector<Vec3>& points = mean.head.shell.mesh.points;
  std::vector<SitePoint> sites;
  for (const SitePoint& s : head.landmarks.Points()) {
    const MeshPoint at = query.Closest(s.point);
    const Triangle& t = warped.triangles[at.triangle];
    sites.push_back({s.site, at.weights[0] * points[t[0]] + at.weights[1] * points[t[1]] +
                                 at.weights[2] * points[t[2]]});
  }
  return sites;
}

// The mean of the heads and their mirror images, on the mean skull. The error is the standard
// deviation of one head's site.
void SetSites(std::span<const std::vector<SitePoint>> heads, ReferenceHead& mean) {
  constexpr double kLeastError_mm = 1.5;  // as far as a person repeats a point
  std::map<std::string, std::vector<Vec3>> found;
  for (const std::vector<SitePoint>& sites : heads) {
    for (const SitePoint& s : sites) {
      found[s.site].push_back(s.point);
      found[MirroredSite(s.site)].emplace_back(-s.point.x(), s.point.y(), s.point.z());
    }
  }
  mean.sites.clear();
  for (const std::string& site : StandardSiteCodes()) {
    const std::vector<Vec3>& points = found[site];
    if (points.empty()) {
      continue;
    }
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : points) {
      middle += p / static_cast<double>(points.size());
    }
    double squares = 0;
    for (const Vec3& p : points) {
      squares += (p - middle).squaredNorm();
    }
    const double samples = static_cast<double>(points.size()) / 2;  // both sides of one head
    mean.error_of_site_mm[site] =
        std::max(kLeastError_mm, std::sqrt(squares / 2 / std::max(samples - 1, 1.0)));
    mean.sites.push_back({site, mean.shell.surface.query().Closest(middle).position});
  }
}

double Seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void Measure(const MeanSkull& mean, const MarkedHead& head, std::span<const SitePoint> known,
             std::vector<double>& errors_mm) {
  const double start = Seconds();
  const Proposal proposal = ProposeLandmarks(head.skull, head.name, mean, {}, known);
  const ProposalComparison found =
      CompareProposal(ProposalFile(proposal, head.name), head.landmarks);
  fmt::print(
      "{:8} {} clicks: {} sites, median {:.1f} mm, 90 % {:.1f}, most {:.1f}; {:.1f} s CPU\n ",
      head.name, known.size(), found.compared, found.median_mm, found.nine_tenths_mm, found.most_mm,
      Seconds() - start);
  for (const SiteDifference& s : found.sites) {
    const auto site = std::ranges::find(proposal.sites, s.site, &ProposedSite::site);
    if (std::isfinite(s.error_mm)) {
      errors_mm.push_back(s.error_mm);
      fmt::print(" {} {:.1f}({:.1f})", s.site, s.error_mm, site->expected_error_mm);
    }
  }
  for (const AbsentLandmark& absent : proposal.absent) {
    fmt::print(" [{}{}: {}]", absent.site,
               head.landmarks.Find(absent.site) != nullptr ? ", which it has" : "", absent.reason);
  }
  fmt::print("\n");
  std::fflush(stdout);
}

std::vector<SitePoint> ThreeClicks(const LandmarkFile& landmarks) {
  std::vector<SitePoint> clicks;
  for (const char* site : {"n", "zy_l", "zy_r"}) {
    clicks.push_back({site, landmarks.Find(site)->Position()});
  }
  return clicks;
}

void PrintAll(const char* what, std::vector<double> errors_mm) {
  std::ranges::sort(errors_mm);
  const auto at = [&](double share) {
    return errors_mm[static_cast<std::size_t>(share * static_cast<double>(errors_mm.size() - 1))];
  };
  fmt::print("{}: {} sites, median {:.1f} mm, 90 % within {:.1f} mm\n", what, errors_mm.size(),
             at(0.5), at(0.9));
}

void Run(const std::filesystem::path& data, bool prints_sites) {
  MeanSkull mean = ReadMeanSkull();
  std::vector<MarkedHead> heads;
  std::vector<std::vector<SitePoint>> sites;
  for (const char* name : {"vhm", "cthead", "cranium"}) {
    heads.push_back(ReadHead(data, name));
    sites.push_back(SitesOnMean(mean, heads.back()));
  }
  if (prints_sites) {
    SetSites(sites, mean.head);
    fmt::print("site,x,y,z,error_mm\n");
    for (const SitePoint& s : mean.head.sites) {
      fmt::print("{},{:.2f},{:.2f},{:.2f},{:.1f}\n", s.site, s.point.x(), s.point.y(), s.point.z(),
                 mean.head.SiteError_mm(s.site));
    }
    return;
  }
  std::array<std::vector<double>, 2> errors_mm;
  for (std::size_t k = 0; k < heads.size(); ++k) {
    std::vector<std::vector<SitePoint>> others = sites;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    SetSites(others, mean.head);
    Measure(mean, heads[k], {}, errors_mm[0]);
    Measure(mean, heads[k], ThreeClicks(heads[k].landmarks), errors_mm[1]);
  }
  PrintAll("without clicks", errors_mm[0]);
  PrintAll("with three clicks", errors_mm[1]);
}

}  // namespace
}  // namespace semblance::problems

int main(int argc, char** argv) {
  try {
    semblance::problems::Run(argc > 1 ? argv[1] : SEMBLANCE_SOURCE_DIR "/../shared/data",
                             argc > 2 && std::string(argv[2]) == "--sites");
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
