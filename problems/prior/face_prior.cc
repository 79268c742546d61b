// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/face_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/npy.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

constexpr double kFarthestSiteMm = 5;

const std::filesystem::path& Named(const std::filesystem::path& path, const char* option) {
  if (path.empty()) {
    throw InputError(fmt::format(
        "prior.{}: no file is named; a prior of type modes needs mean, modes, sites and features",
        option));
  }
  return path;
}

// The array as the model has it: a column per mode.
Eigen::MatrixXd ReadModes(const ModesPrior& source, std::size_t points) {
  const NpyArray array = ReadNpy(Named(source.modes, "modes"));
  const std::string name = source.modes.string();
  if (array.shape.size() != 3 || array.shape[2] != 3 || array.shape[0] == 0) {
    throw InputError(fmt::format("{}: an array of shape ({}); modes are k x n x 3", name,
                                 fmt::join(array.shape, ", ")));
  }
  if (array.shape[1] != points) {
    throw InputError(fmt::format(
        "{}: the modes are of a mesh of {} points, and {} has {}; both must be of one mesh", name,
        array.shape[1], source.mean.string(), points));
  }
  const auto rows = static_cast<Eigen::Index>(3 * points);
  const Eigen::Index columns = std::min<Eigen::Index>(source.count, array.shape[0]);
  return source.scale * Eigen::Map<const Eigen::MatrixXd>(array.values.data(), rows, columns);
}

std::map<std::string, ModelPoint> ReadSites(const ModesPrior& source, const TriMesh& mean) {
  const std::string text = ReadFileBytes(Named(source.sites, "sites"));
  CsvReader table(text, source.sites.string());
  const std::size_t site = table.ColumnOf("site"), x = table.ColumnOf("x_mm"),
                    y = table.ColumnOf("y_mm"), z = table.ColumnOf("z_mm");
  const MeshQuery query(mean);
  std::map<std::string, ModelPoint> sites;
  while (table.NextRow()) {
    const std::string code(table.Cell(site));
    if (const std::string complaint = ComplaintAboutSite(code); !complaint.empty()) {
      table.Fail(complaint);
    }
    const MeshPoint at = query.Closest({table.Number(x), table.Number(y), table.Number(z)});
    if (at.distance_mm > kFarthestSiteMm) {
      table.Fail(
          fmt::format("site '{}' lies {:.1f} mm from {}, and at most {} mm are allowed; both "
                      "must be of one frame, in mm",
                      code, at.distance_mm, source.mean.string(), kFarthestSiteMm));
    }
    if (!sites.emplace(code, ModelPoint{at.triangle, at.weights}).second) {
      table.Fail(fmt::format("site '{}' appears twice", code));
    }
  }
  return sites;
}

// How far from its landmarks a feature reaches; 0 for landmarks of the outline and the brows.
double ClearanceOf(int multipie) {
  return multipie < 28 ? 0 : multipie <= 36 ? 14 : multipie <= 48 ? 15 : 16;
}

std::vector<ShapeFeature> ReadFeatures(const ModesPrior& source) {
  const std::string text = ReadFileBytes(Named(source.features, "features"));
  CsvReader table(text, source.features.string());
  const std::size_t number = table.ColumnOf("i_multipie"), x = table.ColumnOf("x"),
                    y = table.ColumnOf("y"), z = table.ColumnOf("z");
  std::vector<ShapeFeature> features;
  while (table.NextRow()) {
    const double value = table.Number(number);
    if (value < 1 || value > 68 || value != std::round(value)) {
      table.Fail(fmt::format("landmark {} is none of the 68", table.Cell(number)));
    }
    if (const double clearance = ClearanceOf(static_cast<int>(value)); clearance > 0) {
      features.push_back({{table.Number(x), table.Number(y), table.Number(z)}, clearance});
    }
  }
  return features;
}

}  // namespace

FacePrior LoadPrior(const ModesPrior& source) {
  FacePrior prior;
  prior.model.mean = ReadMesh(Named(source.mean, "mean"));
  prior.model.modes = ReadModes(source, prior.model.mean.points.size());
  CheckShapeModel(prior.model, source.mean.string());
  prior.sites = ReadSites(source, prior.model.mean);
  prior.features = ReadFeatures(source);
  return prior;
}

}  // namespace semblance
