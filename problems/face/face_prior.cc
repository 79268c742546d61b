// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/face_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/base/npy.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr double kFarthestFromMean_mm = 5;       // of sites and landmarks from the mean
constexpr int kFirstUsed = 28, kLandmarks = 68;  // of Multi-PIE; 1 to 27 are outline and brows
// Bounds of the RMS of the largest mode, which is some mm for faces. They are a factor of 1000
// apart, so that no model lies within them in two of the units m, mm and um.
constexpr double kLeastMode_mm = 0.05, kMostMode_mm = 50;

const fs::path& Named(const fs::path& path, const char* option) {
  if (path.empty()) {
    throw InputError(fmt::format(
        "prior.{}: no file is named; a prior of type modes needs mean, modes, sites and features",
        option));
  }
  return path;
}

TriMesh ReadMean(const fs::path& path) {
  if (LowerCase(path.extension().string()) == ".stl") {
    throw InputError(fmt::format(
        "{}: an STL has no order of points, and modes move the mean's points in their order; save "
        "the mean as PLY, OBJ or OFF",
        path.string()));
  }
  return ReadMesh(path);
}

// Returns one column per mode.
Eigen::MatrixXd ReadModesArray(const ModesPrior& source, std::size_t points) {
  const NpyArray array = ReadNpy(source.modes);
  const std::string name = source.modes.string();
  if (array.shape.size() != 3 || array.shape[2] != 3) {
    throw InputError(fmt::format("{}: an array of shape ({}); modes are k x n x 3", name,
                                 fmt::join(array.shape, ", ")));
  }
  if (array.shape[0] == 0) {
    throw InputError(
        fmt::format("{}: there is no mode in an array of shape ({}); save k x n x 3 "
                    "numbers, k at least 1",
                    name, fmt::join(array.shape, ", ")));
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

bool IsFolder(const fs::path& path) {
  std::error_code ignored;  // whoever reads the path reports the error
  return fs::is_directory(path, ignored);
}

std::vector<fs::path> ListRegularFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  try {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.is_regular_file()) {
        files.push_back(entry.path());
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw IoError(fmt::format("{}: {}", folder.string(), error.code().message()));
  }
  std::ranges::sort(files);
  return files;
}

// The first `count` meshes, by name. Hidden files and files that are no mesh, such as the materials
// of an OBJ, are skipped.
std::vector<fs::path> FindMeshes(const fs::path& folder, int count) {
  std::vector<fs::path> meshes;
  for (const fs::path& file : ListRegularFiles(folder)) {
    const std::string ending = LowerCase(file.extension().string());
    const bool hidden = file.filename().string().starts_with('.');
    if (ending == ".stl" && !hidden) {
      throw InputError(fmt::format(
          "{}: an STL has no order of points, so it can be no mode; save it as PLY, OBJ or OFF",
          file.string()));
    }
    if ((ending == ".ply" || ending == ".obj" || ending == ".off") && !hidden) {
      meshes.push_back(file);
    }
  }
  if (meshes.empty()) {
    throw InputError(
        fmt::format("{}: there is no mesh (.ply, .obj, .off) in this folder of modes; "
                    "put one per mode there",
                    folder.string()));
  }
  meshes.resize(std::min(meshes.size(), static_cast<std::size_t>(count)));
  return meshes;
}

void CheckSameMesh(const TriMesh& mesh, const fs::path& file, const TriMesh& mean,
                   const fs::path& mean_file) {
  if (mesh.points.size() != mean.points.size()) {
    throw InputError(
        fmt::format("{}: a mesh of {} points, and {} has {}; a mode is the mean's own "
                    "mesh with its points moved",
                    file.string(), mesh.points.size(), mean_file.string(), mean.points.size()));
  }
  if (mesh.triangles != mean.triangles) {
    throw InputError(
        fmt::format("{}: its triangles are not those of {}, in their order; a mode is "
                    "the mean's own mesh with its points moved",
                    file.string(), mean_file.string()));
  }
}

double ModeRms_mm(const Eigen::VectorXd& mode) {
  return mode.stableNorm() / std::sqrt(static_cast<double>(mode.size()) / 3);
}

Eigen::VectorXd ReadModeMesh(const fs::path& file, const TriMesh& mean, const fs::path& mean_file) {
  constexpr double kTextRounding_mm = 0.001;  // rounding of a text file with three decimals
  const TriMesh mesh = ReadMesh(file);
  CheckSameMesh(mesh, file, mean, mean_file);
  Eigen::VectorXd mode(3 * std::ssize(mean.points));
  for (std::size_t v = 0; v < mean.points.size(); ++v) {
    mode.segment<3>(3 * static_cast<Eigen::Index>(v)) = mesh.points[v] - mean.points[v];
  }
  if (ModeRms_mm(mode) <= kTextRounding_mm) {
    throw InputError(fmt::format("{}: it is the mean, and so no mode; take it out of the folder",
                                 file.string()));
  }
  return mode;
}

Eigen::MatrixXd ReadModesFolder(const ModesPrior& source, const TriMesh& mean) {
  if (source.scale != 1) {
    throw InputError(
        fmt::format("{}: the modes are a folder of meshes, which are in mm, and the scale is "
                    "{:.6g}; leave it out",
                    source.modes.string(), source.scale));
  }
  const std::vector<fs::path> meshes = FindMeshes(source.modes, source.count);
  Eigen::MatrixXd modes(3 * std::ssize(mean.points), std::ssize(meshes));
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    modes.col(static_cast<Eigen::Index>(k)) = ReadModeMesh(meshes[k], mean, source.mean);
  }
  return modes;
}

Eigen::MatrixXd ReadModes(const ModesPrior& source, const TriMesh& mean) {
  return IsFolder(Named(source.modes, "modes")) ? ReadModesFolder(source, mean)
                                                : ReadModesArray(source, mean.points.size());
}

bool IsPlausibleMode(double rms_mm) { return rms_mm >= kLeastMode_mm && rms_mm <= kMostMode_mm; }

// If a mistaken unit explains the size of the largest mode, states the scale that corrects it.
std::string ScaleRemedy(const ModesPrior& source, double rms_mm) {
  if (IsFolder(source.modes)) {
    return "its meshes must be in mm and in the frame of the mean";
  }
  if (rms_mm == 0) {
    return "give modes that move points";
  }
  for (const double factor : {0.001, 1000.0}) {
    if (IsPlausibleMode(factor * rms_mm)) {
      return fmt::format("a scale of {:.6g} would make it {:.3g} mm", factor * source.scale,
                         factor * rms_mm);
    }
  }
  return fmt::format("correct the scale, which is {:.6g}, or the modes", source.scale);
}

// The largest mode of a population of faces moves points by some millimetres.
void CheckSize(const ModesPrior& source, const Eigen::MatrixXd& modes) {
  Eigen::Index largest = 0;
  double rms_mm = 0;
  for (Eigen::Index k = 0; k < modes.cols(); ++k) {
    if (const double rms = ModeRms_mm(modes.col(k)); rms > rms_mm) {
      rms_mm = rms;
      largest = k;
    }
  }
  if (!IsPlausibleMode(rms_mm)) {
    throw InputError(fmt::format(
        "{}: the largest mode, number {}, moves the points by {:.3g} mm (RMS), and {} to {} mm are "
        "allowed; {}",
        source.modes.string(), largest + 1, rms_mm, kLeastMode_mm, kMostMode_mm,
        ScaleRemedy(source, rms_mm)));
  }
}

void CheckNear(const CsvReader& table, const std::string& what, double distance_mm,
               const fs::path& mean) {
  if (!(distance_mm <= kFarthestFromMean_mm)) {
    table.Fail(
        fmt::format("{} lies {:.1f} mm from {}, and at most {} mm are allowed; both must be "
                    "of one frame, in mm",
                    what, distance_mm, mean.string(), kFarthestFromMean_mm));
  }
}

std::map<std::string, ModelPoint> ReadSites(const ModesPrior& source, const TriMesh& mean) {
  const std::string text = ReadFileBytes(Named(source.sites, "sites"));
  CsvReader table(text, source.sites.string());
  const std::size_t site = table.RequireColumn("site"), x = table.RequireColumn("x_mm"),
                    y = table.RequireColumn("y_mm"), z = table.RequireColumn("z_mm");
  const MeshQuery query(mean);
  std::map<std::string, ModelPoint> sites;
  while (table.NextRow()) {
    const std::string code(table.Cell(site));
    if (const std::string complaint = StandardSiteFault(code); !complaint.empty()) {
      table.Fail(complaint);
    }
    const MeshPoint at = query.Closest({table.Number(x), table.Number(y), table.Number(z)});
    CheckNear(table, fmt::format("site '{}'", code), at.distance_mm, source.mean);
    if (!sites.emplace(code, ModelPoint{at.triangle, at.weights}).second) {
      table.Fail(fmt::format("site '{}' appears twice", code));
    }
  }
  return sites;
}

// The radius (mm) around a landmark that belongs to its feature: nose, eyes or mouth.
double FindClearance(int multipie) { return multipie <= 36 ? 14 : multipie <= 48 ? 15 : 16; }

int ReadMultiPieNumber(const CsvReader& table, std::size_t column) {
  const double value = table.Number(column);
  if (!(value >= 1 && value <= kLandmarks && value == std::round(value))) {
    table.Fail(
        fmt::format("landmark {} is none of the 68; i_multipie is a whole number from 1 to "
                    "68",
                    table.Cell(column)));
  }
  return static_cast<int>(value);
}

// Rules find the features by their number, so all must be present.
void RequireUsed(const std::map<int, Vec3>& landmarks, const std::string& name) {
  std::vector<int> missing;
  for (int n = kFirstUsed; n <= kLandmarks; ++n) {
    if (!landmarks.contains(n)) {
      missing.push_back(n);
    }
  }
  if (!missing.empty()) {
    const bool all = missing.size() == kLandmarks - kFirstUsed + 1;
    throw InputError(fmt::format(
        "{}: a prior needs the landmarks {} to {} of Multi-PIE (nose, eyes, mouth), and {} {} "
        "missing; add a row for each",
        name, kFirstUsed, kLandmarks, all ? "all" : fmt::format("{}", fmt::join(missing, ", ")),
        missing.size() == 1 ? "is" : "are"));
  }
}

std::map<int, Vec3> ReadMultiPie(const ModesPrior& source, const TriMesh& mean) {
  const std::string text = ReadFileBytes(Named(source.features, "features"));
  CsvReader table(text, source.features.string());
  const std::size_t number = table.RequireColumn("i_multipie"), x = table.RequireColumn("x"),
                    y = table.RequireColumn("y"), z = table.RequireColumn("z");
  const MeshQuery query(mean);
  std::map<int, Vec3> landmarks;
  while (table.NextRow()) {
    const int n = ReadMultiPieNumber(table, number);
    const Vec3 at(table.Number(x), table.Number(y), table.Number(z));
    if (!landmarks.emplace(n, at).second) {
      table.Fail(fmt::format("landmark {} appears twice; keep one of the two", n));
    }
    if (n >= kFirstUsed) {
      CheckNear(table, fmt::format("landmark {}", n), query.Closest(at).distance_mm, source.mean);
    }
  }
  RequireUsed(landmarks, source.features.string());
  return landmarks;
}

// Returns the features by number, whatever the order of the rows.
std::vector<ShapeFeature> ReadFeatures(const ModesPrior& source, const TriMesh& mean) {
  std::vector<ShapeFeature> features;
  for (const auto& [number, position] : ReadMultiPie(source, mean)) {
    if (number >= kFirstUsed) {
      features.push_back({position, FindClearance(number)});
    }
  }
  return features;
}

}  // namespace

FacePrior LoadPrior(const ModesPrior& source) {
  FacePrior prior;
  prior.model.mean = ReadMean(Named(source.mean, "mean"));
  prior.model.modes = ReadModes(source, prior.model.mean);
  CheckShapeModel(prior.model, source.mean.string());
  CheckSize(source, prior.model.modes);
  prior.sites = ReadSites(source, prior.model.mean);
  prior.features = ReadFeatures(source, prior.model.mean);
  return prior;
}

std::vector<fs::path> ModesPriorFiles(const ModesPrior& source) {
  std::vector<fs::path> files = {source.mean, source.sites, source.features};
  const std::vector<fs::path> modes =
      IsFolder(source.modes) ? FindMeshes(source.modes, source.count) : std::vector{source.modes};
  files.insert(files.begin() + 1, modes.begin(), modes.end());
  return files;
}

}  // namespace semblance::problems
