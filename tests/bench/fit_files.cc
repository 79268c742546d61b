// SPDX-License-Identifier: GPL-3.0-or-later
// The fit of files of points, with nothing chosen, against MBA with the number of levels whose
// error at places that were kept back is least.
#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "problems/points/point_files.h"
#include "problems/points/prediction.h"
#include "surfaces/base/error.h"
#include "surfaces/base/npy.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/bench/fit_parts.h"
#include "tests/bench/mba.h"

namespace semblance::bench {
using namespace problems;
namespace {

namespace fs = std::filesystem;

constexpr const char* kPointsEnding = ".csv.gz";
constexpr const char* kTruthEnding = ".truth.npz";

// The array of a name in NumPy's archive of arrays.
NpyArray ReadNpz(const fs::path& path, const std::string& array) {
  const std::unique_ptr<archive, decltype(&archive_read_free)> file(archive_read_new(),
                                                                    archive_read_free);
  archive_read_support_format_zip(file.get());
  if (archive_read_open_filename(file.get(), path.c_str(), 1 << 16) != ARCHIVE_OK) {
    throw IoError(fmt::format("{}: cannot be read", path.string()));
  }
  archive_entry* entry = nullptr;
  while (archive_read_next_header(file.get(), &entry) == ARCHIVE_OK) {
    if (archive_entry_pathname(entry) == array + ".npy") {
      std::string bytes;
      std::array<char, 1 << 16> block;
      la_ssize_t got = 0;
      while ((got = archive_read_data(file.get(), block.data(), block.size())) > 0) {
        bytes.append(block.data(), static_cast<std::size_t>(got));
      }
      return ParseNpy(bytes, path.string());
    }
  }
  throw IoError(fmt::format("{}: has no array {}", path.string(), array));
}

struct HeightSet {
  PointTable points;
  std::vector<Vec2> xy;   // places that were kept back
  std::vector<double> z;  // their heights
};

HeightSet ReadSet(const fs::path& folder, const std::string& name) {
  HeightSet set{.points = ReadPointFile(folder / (name + kPointsEnding)).points, .xy = {}, .z = {}};
  const NpyArray xyz = ReadNpz(folder / (name + kTruthEnding), "xyz");
  for (std::size_t k = 0; k + 2 < xyz.values.size(); k += 3) {
    set.xy.emplace_back(xyz.values[k], xyz.values[k + 1]);
    set.z.push_back(xyz.values[k + 2]);
  }
  return set;
}

// The set without the given points that lie at a place that was kept back: copies of a kept height,
// such as a station's second receiver, would make its prediction a look-up.
HeightSet WithoutCopies(HeightSet set) {
  std::vector<Vec3> kept;
  for (const Vec2& xy : set.xy) {
    kept.emplace_back(xy.x(), xy.y(), 0);
  }
  Box3 box;
  for (const Vec3& p : set.points.positions) {
    box.extend(Vec3(p.x(), p.y(), 0));
  }
  const PointQuery query(kept);
  std::erase_if(set.points.positions, [&](const Vec3& p) {
    return query.DistanceTo({p.x(), p.y(), 0}) < 1e-6 * box.diagonal().norm();
  });
  return set;
}

struct FileScore {
  Measured ours, mba;
  // Shares of the heights that were kept back: within 1.645 standard deviations of the surface, for
  // sets whose kept heights are those of the true surface; and within the interval of new
  // observations, for sets whose kept heights were measured.
  double of_surface = kNaN, of_observations = kNaN;
};

double Rms(const std::vector<double>& found, const std::vector<double>& z) {
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < z.size(); ++k) {
    if (std::isfinite(found[k])) {  // NaN: beyond the points
      sum += std::pow(found[k] - z[k], 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

void ScoreOurs(const HeightSet& set, FileScore& score) {
  constexpr double kLevel = 0.9, kQuantile = 1.645;
  const double begin = CpuSecondsSoFar();
  PointFit fit = FitPoints(set.points, {}, {});
  score.ours.seconds = CpuSecondsSoFar() - begin;
  const HeightPredictor predictor(fit.fit.surface, CollectEvidence(fit));
  const PredictedHeights heights = predictor.At(set.xy, kLevel, 1);
  score.ours.rms_mm = Rms(heights.z, set.z);
  score.of_surface = score.of_observations = 0;
  const double share = 1 / static_cast<double>(set.z.size());
  for (std::size_t k = 0; k < set.z.size(); ++k) {
    const double off = std::abs(heights.z[k] - set.z[k]);
    score.of_surface += off < kQuantile * heights.sd[k] ? share : 0;
    score.of_observations += set.z[k] >= heights.low[k] && set.z[k] <= heights.high[k] ? share : 0;
  }
}

// The places of MBA are those of the points' box.
Measured Mba(const HeightSet& set, int levels) {
  Eigen::AlignedBox2d box;
  for (const Vec3& p : set.points.positions) {
    box.extend(Vec2(p.head<2>()));
  }
  const auto place = [&](const Vec2& xy) {
    return Vec2((xy - box.min()).cwiseQuotient(box.sizes()).cwiseMax(0).cwiseMin(1));
  };
  std::vector<HeightPoint> points;
  for (const Vec3& p : set.points.positions) {
    const Vec2 uv = place(p.head<2>());
    points.push_back({uv.x(), uv.y(), p.z()});
  }
  Measured measured;
  const double begin = CpuSecondsSoFar();
  const MultilevelBSpline spline(std::move(points), levels);
  measured.seconds = CpuSecondsSoFar() - begin;
  std::vector<double> found;
  for (const Vec2& xy : set.xy) {
    const Vec2 uv = place(xy);
    found.push_back(spline.Height(uv.x(), uv.y()));
  }
  measured.rms_mm = Rms(found, set.z);
  return measured;
}

FileScore Score(const HeightSet& set) {
  FileScore score;
  ScoreOurs(set, score);
  for (int levels = 4; levels <= 11; ++levels) {
    const Measured measured = Mba(set, levels);
    score.mba = measured.rms_mm >= score.mba.rms_mm ? score.mba : measured;
  }
  return score;
}

void PrintScore(const std::string& name, const FileScore& score) {
  const std::string entry = "fit.files." + name;
  // Print's goals are of the peer's figure over ours.
  Print(entry + "_rms_vs_mba", score.ours.rms_mm, score.mba.rms_mm, 1 / 1.1, "mm");
  Print(entry + "_seconds_vs_mba", score.ours.seconds, score.mba.seconds, 1.0 / 3, "s");
  Print(entry + "_coverage_90_of_surface", score.of_surface, kNaN, kNaN, "share");
  Print(entry + "_coverage_90_of_observations", score.of_observations, kNaN, kNaN, "share");
  fmt::print(stderr, "| {} | {:.2f} | {:.1f} | {:.2f} | {:.2f} | {:.2f} |\n", name,
             score.ours.rms_mm / score.mba.rms_mm, score.ours.seconds,
             score.ours.seconds / score.mba.seconds, score.of_surface, score.of_observations);
}

std::vector<std::string> SetsIn(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& file : fs::directory_iterator(folder)) {
    const std::string name = file.path().filename().string();
    if (name.ends_with(kTruthEnding)) {
      names.push_back(name.substr(0, name.size() - std::string(kTruthEnding).size()));
    }
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace

void RunFiles(const std::string& folder) {
  fmt::print(stderr,
             "| set | RMS, ours / MBA | CPU s | CPU, ours / MBA | surface | observations |\n"
             "|---|--:|--:|--:|--:|--:|\n");
  for (const std::string& name : SetsIn(folder)) {
    try {
      const HeightSet set = ReadSet(folder, name);
      PrintScore(name, Score(set));
      const bool has_positions_alone = set.points.uv.empty() && set.points.weights.empty();
      if (const HeightSet apart = has_positions_alone ? WithoutCopies(set) : set;
          apart.points.positions.size() < set.points.positions.size()) {
        PrintScore(name + "_without_copies", Score(apart));
      }
    } catch (const InputError& refusal) {
      fmt::print(stderr, "{} is refused: {}\n", name, refusal.what());
    }
  }
}

}  // namespace semblance::bench
