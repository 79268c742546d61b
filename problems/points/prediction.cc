// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/prediction.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/mesh_files/read_ply.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

GraphMap RequireGraph(const HSplineSurface& surface) {
  const std::optional<GraphMap> map = GraphMap::Of(surface);
  if (!map) {
    throw InputError(
        "predict: the surface is not a height z over x and y; fit points whose z is one height for "
        "each place, or evaluate the surface at (u,v) in Python (surface.points)");
  }
  return *map;
}

// The weight of a point over the mean weight; 1 if all points count alike. Its error has the
// variance of a point of mean weight over this.
double RelativeWeight(const HeightEvidence& evidence, double mean_weight, std::size_t point) {
  return evidence.weights.empty() ? 1 : evidence.weights[point] / mean_weight;
}

double MeanWeight(const HeightEvidence& evidence) {
  double sum = 0;
  for (const double weight : evidence.weights) {
    sum += weight;
  }
  return evidence.weights.empty() ? 1 : sum / static_cast<double>(evidence.weights.size());
}

// The mean square of the distances with the points' weights, as that of HeightEvidence::noise_mm.
double WeightedMeanSquare(const HeightEvidence& evidence) {
  const double mean_weight = MeanWeight(evidence);
  double sum = 0;
  for (std::size_t k = 0; k < evidence.residual_mm.size(); ++k) {
    sum += RelativeWeight(evidence, mean_weight, k) * evidence.residual_mm[k] *
           evidence.residual_mm[k];
  }
  return sum / static_cast<double>(evidence.residual_mm.size());
}

int CellAt(const Vec2& uv, int across) {
  const auto place = [&](double t) {
    return std::clamp(static_cast<int>(t * across), 0, across - 1);
  };
  return place(uv.y()) * across + place(uv.x());
}

}  // namespace

HeightEvidence CollectEvidence(const PointFit& fit) {
  const AutoReport& report = fit.fit.automatic.value();
  std::vector<char> counts(fit.fit.uv.size(), 1);
  for (const std::vector<std::uint32_t>* const indices : {&report.outliers, &report.repeated}) {
    std::ranges::for_each(*indices, [&](std::uint32_t k) { counts[k] = 0; });
  }
  HeightEvidence evidence{.noise_mm = report.noise_mm,
                          .energy_weight = fit.energy_weight,
                          .stretch = report.stretch,
                          .direction_deg = report.direction_deg,
                          .effective_share = report.effective_share};
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (counts[k] != 0 && fit.fit.uv[k].allFinite()) {
      evidence.uv.push_back(fit.fit.uv[k]);
      evidence.residual_mm.push_back(fit.fit.residual_mm[k]);
      if (!fit.weights.empty()) {
        evidence.weights.push_back(fit.weights[k]);
      }
    }
  }
  return evidence;
}

HeightPredictor::HeightPredictor(HSplineSurface surface, std::optional<HeightEvidence> evidence)
    : surface_(std::move(surface)), map_(RequireGraph(surface_)), evidence_(std::move(evidence)) {
  if (!evidence_) {
    return;
  }
  sigma_ = std::make_shared<const SurfaceSigma>(
      surface_, AttributeColumns{.uv = evidence_->uv, .weights = evidence_->weights, .columns = {}},
      std::span<const std::uint32_t>(),
      SigmaOptions{.noise_mm = evidence_->noise_mm,
                   .weight = evidence_->energy_weight,
                   .stretch = evidence_->stretch,
                   .direction_deg = evidence_->direction_deg,
                   .lengths_mm = map_.Lengths()});
  noise_ = FindNoise();
  limit_ = FindLimit();
}

// Cells of about 64 points. A cell's mean square counts with sixteen points' worth of that of all,
// which trades the detail of the noise for its error (12 % with 64 points). Distances count with
// their weights, so that points of known and different deviations do not pass for noise that varies
// beyond them. The parameters that the fit spent make residuals smaller than the noise everywhere
// alike.
HeightPredictor::NoiseGrid HeightPredictor::FindNoise() const {
  constexpr double kPointsPerCell = 64, kPointsOfAll = 16;
  constexpr int kMostAcross = 64;
  const std::vector<double>& residuals = evidence_->residual_mm;
  const int across = std::clamp(
      static_cast<int>(std::sqrt(static_cast<double>(residuals.size()) / kPointsPerCell)), 1,
      kMostAcross);
  const std::size_t cells = static_cast<std::size_t>(across) * across;
  const double mean_weight = MeanWeight(*evidence_), all = WeightedMeanSquare(*evidence_),
               spent = all > 0 ? evidence_->noise_mm * evidence_->noise_mm / all : 1;
  std::vector<double> squares(cells, kPointsOfAll * all), counts(cells, 0), variances(cells, 0);
  double variance_of_all = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const int cell = CellAt(evidence_->uv[k], across);
    const double weight = RelativeWeight(*evidence_, mean_weight, k);
    squares[cell] += weight * residuals[k] * residuals[k];
    counts[cell] += 1;
    variances[cell] += 1 / weight;
    variance_of_all += 1 / weight / static_cast<double>(residuals.size());
  }
  NoiseGrid grid{.across = across, .of_mean_weight = {}, .sd = {}};
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const double variance = counts[cell] > 0 ? variances[cell] / counts[cell] : variance_of_all;
    grid.of_mean_weight.push_back(std::sqrt(spent * squares[cell] / (counts[cell] + kPointsOfAll)));
    grid.sd.push_back(grid.of_mean_weight.back() * std::sqrt(variance));
  }
  return grid;
}

double HeightPredictor::NoiseGrid::At(const Vec2& uv) const { return sd[CellAt(uv, across)]; }

double HeightPredictor::NoiseGrid::OfMeanWeightAt(const Vec2& uv) const {
  return of_mean_weight[CellAt(uv, across)];
}

// A place is supported if the surface is known at least as well as by one observation, or if its sd
// is at most twice the 95 % quantile of the points'. The latter keeps borders of data without
// noise.
double HeightPredictor::FindLimit() const {
  constexpr std::size_t kSample = 5000;  // points; bounds the time
  constexpr double kOfPoints = 2, kShare = 0.95;
  std::vector<Vec2> some;
  for (std::size_t k = 0; k < evidence_->uv.size();
       k += std::max<std::size_t>(evidence_->uv.size() / kSample, 1)) {
    some.push_back(evidence_->uv[k]);
  }
  std::vector<double> sd = sigma_->OfChosen(some);
  return std::max(evidence_->noise_mm, kOfPoints * Quantile(sd, kShare));
}

namespace {

// The quantile of the points' distances over the noise around them.
template <class NoiseAt>
double IntervalFactor(const HeightEvidence& evidence, const NoiseAt& noise_at, double level) {
  std::vector<double> relative;
  for (std::size_t k = 0; k < evidence.uv.size(); ++k) {
    if (const double noise = noise_at(evidence.uv[k]); noise > 0) {
      relative.push_back(evidence.residual_mm[k] / noise);
    }
  }
  const double spent =
      evidence.noise_mm / std::sqrt(std::max(WeightedMeanSquare(evidence), 1e-300));
  return relative.empty() ? 0 : spent * Quantile(relative, level);
}

}  // namespace

PredictedHeights HeightPredictor::At(std::span<const Vec2> xy, double level, int threads) const {
  constexpr double kRounding = 1e-9;  // of the domain, beyond its border
  if (!(level > 0 && level < 1)) {
    throw InputError(fmt::format("predict: the level is {}; give one between 0 and 1", level));
  }
  PredictedHeights heights;
  heights.z.assign(xy.size(), kNaN);
  heights.sd = heights.low = heights.high = heights.z;
  heights.supported.assign(xy.size(), 0);
  std::vector<Vec2> uv;
  std::vector<std::size_t> inside;
  for (std::size_t k = 0; k < xy.size(); ++k) {
    const Vec2 at = map_.UvAt(xy[k]);
    if (at.minCoeff() >= -kRounding && at.maxCoeff() <= 1 + kRounding) {
      uv.push_back(at.cwiseMax(0).cwiseMin(1));
      inside.push_back(k);
    }
  }
  const std::vector<Vec3> points = HSplineBatch(surface_).Points(uv, threads);
  const std::vector<double> sd = evidence_ ? sigma_->OfChosen(uv) : std::vector<double>();
  const auto noise_at = [&](const Vec2& at) { return noise_.At(at); };
  const double factor = evidence_ ? IntervalFactor(*evidence_, noise_at, level) : kNaN;
  for (std::size_t n = 0; n < uv.size(); ++n) {
    const std::size_t k = inside[n];
    heights.z[k] = points[n].z();
    heights.supported[k] = !evidence_ || sd[n] <= limit_ ? 1 : 0;
    if (evidence_) {
      const double noise = noise_.At(uv[n]);
      const double rougher =
          evidence_->noise_mm > 0 ? noise_.OfMeanWeightAt(uv[n]) / evidence_->noise_mm : 1;
      heights.sd[k] = sd[n] * rougher / std::sqrt(evidence_->effective_share);
      const double half = factor * std::hypot(noise, heights.sd[k]);
      heights.low[k] = heights.z[k] - half;
      heights.high[k] = heights.z[k] + half;
    }
  }
  return heights;
}

// ------------------------------------------------------------------- files of a fit

namespace {

struct ResidualRow {
  Vec2 uv;
  double residual_mm = kNaN, outlier = 0, weight = kNaN;
};

std::vector<ResidualRow> ReadResidualsCsv(const std::string& text, const std::string& name) {
  CsvReader csv(text, name);
  const std::size_t u = csv.RequireColumn("u"), v = csv.RequireColumn("v"),
                    residual = csv.RequireColumn("residual_mm");
  const auto outlier = csv.Find("outlier"), weight = csv.Find("weight");
  std::vector<ResidualRow> rows;
  while (csv.NextRow()) {
    rows.push_back({.uv = {csv.NumberOrNan(u), csv.NumberOrNan(v)},
                    .residual_mm = csv.NumberOrNan(residual),
                    .outlier = outlier ? csv.NumberOrNan(*outlier) : 0,
                    .weight = weight ? csv.NumberOrNan(*weight) : kNaN});
  }
  return rows;
}

std::vector<ResidualRow> ReadResidualsPly(const std::string& bytes, const std::string& name) {
  const auto column = [&](const char* of) { return ReadPlyVertexScalar(bytes, of, name); };
  const std::vector<double> u = column("x"), v = column("y"), residual = column("residual_mm"),
                            outlier = column("outlier");
  const bool weighted =
      std::string_view(bytes).substr(0, bytes.find("end_header")).find("float weight\n") !=
      std::string_view::npos;
  const std::vector<double> weight = weighted ? column("weight") : std::vector<double>();
  std::vector<ResidualRow> rows;
  for (std::size_t k = 0; k < u.size(); ++k) {
    rows.push_back({.uv = {u[k], v[k]},
                    .residual_mm = residual[k],
                    .outlier = outlier[k],
                    .weight = weighted ? weight[k] : kNaN});
  }
  return rows;
}

// Keeps the points that count: those with a distance that are neither outliers nor exact copies.
void AddRows(const std::vector<ResidualRow>& rows, HeightEvidence& evidence) {
  std::set<std::array<double, 3>> known;
  for (const ResidualRow& row : rows) {
    if (std::isfinite(row.residual_mm) && row.uv.allFinite() && row.outlier == 0 &&
        known.insert({row.uv.x(), row.uv.y(), row.residual_mm}).second) {
      evidence.uv.push_back(row.uv.cwiseMax(0).cwiseMin(1));
      evidence.residual_mm.push_back(row.residual_mm);
      if (std::isfinite(row.weight)) {
        evidence.weights.push_back(row.weight);
      }
    }
  }
}

std::optional<HeightEvidence> ReadEvidence(const fs::path& folder, std::string& note) {
  const fs::path result = folder / "result.json";
  if (!fs::exists(result)) {
    note = "no result.json beside the surface: no sd, and no intervals";
    return std::nullopt;
  }
  const nlohmann::json json = nlohmann::json::parse(ReadFileBytes(result), nullptr, false);
  if (!json.is_object() || !json.contains("automatic") ||
      !json["automatic"].contains("energy_weight")) {
    note =
        "the fit beside the surface was not by plan: auto with solver: fastest: no sd, and no "
        "intervals";
    return std::nullopt;
  }
  const nlohmann::json& automatic = json["automatic"];
  const auto number = [&](const char* key) {
    return automatic.contains(key) && automatic[key].is_number() ? automatic[key].get<double>()
                                                                 : kNaN;
  };
  HeightEvidence evidence{.noise_mm = number("noise_mm"),
                          .energy_weight = number("energy_weight"),
                          .stretch = number("stretch"),
                          .direction_deg = number("direction_deg"),
                          .effective_share = number("effective_share")};
  const fs::path csv = folder / "residuals.csv", ply = folder / "residuals.ply";
  if (fs::exists(csv)) {
    AddRows(ReadResidualsCsv(ReadFileBytes(csv), csv.string()), evidence);
  } else if (fs::exists(ply)) {
    AddRows(ReadResidualsPly(ReadFileBytes(ply), ply.string()), evidence);
  }
  if (evidence.uv.empty()) {
    note = "no residuals.csv or residuals.ply beside the surface: no sd, and no intervals";
    return std::nullopt;
  }
  return evidence;
}

}  // namespace

FittedHeights ReadFittedHeights(const fs::path& path) {
  const fs::path file = fs::is_directory(path) ? path / "surface.hspline.json" : path;
  FittedHeights fitted{.surface = ReadHSpline(file), .evidence = {}, .note = {}};
  fitted.evidence = ReadEvidence(file.parent_path(), fitted.note);
  return fitted;
}

// -------------------------------------------------------------------- grids and files

std::vector<Vec2> PlaceGrid::Places() const {
  std::vector<Vec2> places;
  places.reserve(static_cast<std::size_t>(columns) * rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      places.push_back(origin + step * Vec2(i, j));
    }
  }
  return places;
}

PlaceGrid MakePlaceGrid(const GraphMap& map, double step) {
  constexpr double kMostNodes = 1e8;
  constexpr double kRounding = 1e-9;  // of a step, so that the far border is a node
  const Vec2 sizes = map.Box().sizes();
  if (!(step > 0) || !std::isfinite(step) ||
      (sizes.x() / step + 1) * (sizes.y() / step + 1) > kMostNodes) {
    throw InputError(fmt::format(
        "predict: a grid of step {} over {:.6g} x {:.6g} is not possible; give a positive step "
        "with at most 1e8 nodes",
        step, sizes.x(), sizes.y()));
  }
  return {.step = step,
          .columns = static_cast<int>(sizes.x() / step + kRounding) + 1,
          .rows = static_cast<int>(sizes.y() / step + kRounding) + 1,
          .origin = map.Box().min()};
}

std::string PredictionCsv(std::span<const Vec2> xy, const PredictedHeights& heights) {
  CsvWriter csv({"x", "y", "z", "sd", "low", "high", "supported"});
  for (std::size_t k = 0; k < xy.size(); ++k) {
    csv.Row(xy[k].x(), xy[k].y(), heights.z[k], heights.sd[k], heights.low[k], heights.high[k],
            int{heights.supported[k]});
  }
  return csv.Text();
}

std::string PredictionNpy(std::span<const Vec2> xy, const PredictedHeights& heights) {
  static_assert(std::endian::native == std::endian::little);
  constexpr std::size_t kColumns = 7, kAlignment = 64, kPrefix = 10;
  std::string head = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}",
                                 xy.size(), kColumns);
  head.append(kAlignment - 1 - (kPrefix + head.size()) % kAlignment, ' ');
  head += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(head.size() & 0xff);
  bytes += static_cast<char>(head.size() >> 8);
  bytes += head;
  for (std::size_t k = 0; k < xy.size(); ++k) {
    const std::array<double, kColumns> row = {xy[k].x(),
                                              xy[k].y(),
                                              heights.z[k],
                                              heights.sd[k],
                                              heights.low[k],
                                              heights.high[k],
                                              static_cast<double>(heights.supported[k])};
    std::array<char, sizeof row> raw;
    std::memcpy(raw.data(), row.data(), sizeof row);
    bytes.append(raw.data(), raw.size());
  }
  return bytes;
}

std::string PredictionAsc(const PlaceGrid& grid, const PredictedHeights& heights) {
  std::string text = fmt::format(
      "ncols {}\nnrows {}\nxllcenter {:.17g}\nyllcenter {:.17g}\ncellsize {:.17g}\n"
      "NODATA_value -9999\n",
      grid.columns, grid.rows, grid.origin.x(), grid.origin.y(), grid.step);
  for (int j = grid.rows - 1; j >= 0; --j) {  // the first line is the highest y
    for (int i = 0; i < grid.columns; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * grid.columns + i;
      text += i > 0 ? " " : "";
      text += heights.supported[k] != 0 ? fmt::format("{:.9g}", heights.z[k]) : "-9999";
    }
    text += '\n';
  }
  return text;
}

}  // namespace semblance::problems
