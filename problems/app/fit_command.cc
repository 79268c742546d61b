// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "problems/app/work_options.h"
#include "problems/config/config.h"
#include "problems/config/config_binder.h"
#include "problems/config/terminal_text.h"
#include "problems/points/fit_report.h"
#include "problems/points/point_files.h"
#include "problems/points/point_fit.h"
#include "problems/points/prediction.h"
#include "problems/report/plain_names.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

struct FitArguments : WorkOptions {
  std::vector<std::string> files;  // the points, and perhaps a configuration
};

PointFitOptions ReadFitOptions(const FitArguments& arguments) {
  return arguments.files.size() > 1
             ? ReadConfig<PointFitOptions>(arguments.files[1], arguments.overrides)
             : ReadConfigText<PointFitOptions>("{}", "the options of the command",
                                               arguments.overrides);
}

bool IsConfigName(const std::filesystem::path& file) {
  return file.extension() == ".yaml" || file.extension() == ".yml";
}

// Refuses the configuration before the points, which is a common slip.
void CheckOrder(const std::vector<std::string>& files) {
  if (files.size() == 2 && IsConfigName(files[0]) && !IsConfigName(files[1])) {
    throw InputError(fmt::format("fit {0} {1}: the points come first: semblance fit {1} {0}",
                                 files[0], files[1]));
  }
}

// The files that are read, and those that may be written.
GivenFiles ListFiles(const FitArguments& arguments) {
  return {.files = {arguments.files.begin(), arguments.files.end()},
          .outputs = kPointFitFiles,
          .marks = kPointFitMarks};
}

int FitCommand(const FitArguments& arguments) {
  CheckOrder(arguments.files);
  const std::filesystem::path path = arguments.files.at(0);
  const PointFitOptions options = ReadFitOptions(arguments);
  const std::string name = path == "-" ? "standard input" : path.filename().string();
  StagedFolder folder = MakeStagedFolder(
      arguments, "out/" + (path == "-" ? "points" : PlainName(path)), ListFiles(arguments));
  PointFile file = ReadPointFile(path, options.attributes);
  const RunContext context = MakeRunContext(arguments);
  const PointFit result = FitPoints(std::move(file.points), options, context);
  const std::vector<std::string> notes = WritePointFit(
      options, {.name = name, .sha256 = file.sha256}, result, folder.Files(), context);
  folder.Publish();
  Tell("{} points, (u,v): {}; {} control vertices; RMS {}, largest {}\n",
       result.fit.residual_mm.size(), result.parameters,
       result.fit.surface.Net(0).vertices.size() + result.fit.surface.Offsets().size(),
       LengthText(result.fit.point_rms_mm, result.unit),
       LengthText(result.distance.max_mm, result.unit));
  if (!result.fit.levels.empty()) {
    Tell("solver: {}\n", result.fit.levels.back().solver);
  }
  if (result.fit.automatic) {
    Tell("{}", AutoText(*result.fit.automatic, result.unit));
  }
  for (const std::string& note : notes) {
    Tell("{}\n", note);
  }
  if (const auto tolerance = CompareWithTolerance(options, result)) {
    Tell("{}\n", ToleranceText(*tolerance, result.unit));
  }
  Tell("folder: {}\n", folder.Root().string());
  return PrintFaults(result.Faults());
}

void DeclareFit(CLI::App& command, CommandLine& line) {
  FitArguments& a = *Bind(command, line, &FitCommand);
  AddSet(command, a);
  AddOutput(command, a);
  AddWork(command, line, a);
  command
      .add_option(
          "POINTS [CONFIG]", a.files,
          "points: .csv with the columns x,y,z and, if known, u,v, weight or sigma; .xyz .npy .ply "
          ".obj .stl .off; each also .gz; - for a CSV on standard input. YAML file of the fit; "
          "without it everything follows from the points")
      ->required()
      ->expected(1, 2);
}

// ------------------------------------------------------------------------- predict

struct PredictArguments {
  std::string surface, places, out;
  double grid = kNaN, level = 0.9;
  bool values_only = false;
  bool force = false;
  int threads = DefaultThreads();
};

std::string EncodePrediction(const std::string& ending, std::span<const Vec2> places,
                             const std::optional<PlaceGrid>& grid,
                             const PredictedHeights& heights) {
  return ending == ".csv"   ? PredictionCsv(places, heights)
         : ending == ".npy" ? PredictionNpy(places, heights)
                            : PredictionAsc(*grid, heights);
}

// Returns the ending of the output, in small letters.
std::string CheckPrediction(const PredictArguments& a) {
  const std::string ending = LowerCase(std::filesystem::path(a.out).extension().string());
  if (a.places.empty() == std::isnan(a.grid)) {
    throw InputError("predict: give either a file of places or --grid STEP");
  }
  if (ending != ".csv" && ending != ".npy" && (ending != ".asc" || std::isnan(a.grid))) {
    throw InputError(fmt::format(
        "predict: {}: the file ends in .csv or .npy, or with --grid also in .asc", a.out));
  }
  RefuseToReplace(a.out, std::vector<std::filesystem::path>{a.surface, a.places});
  RefuseExisting(a.out, a.force);
  return ending;
}

int Predict(const PredictArguments& a) {
  const std::string ending = CheckPrediction(a);
  FittedHeights fitted = ReadFittedHeights(a.surface);
  const HeightPredictor predictor(std::move(fitted.surface),
                                  a.values_only ? std::nullopt : std::move(fitted.evidence));
  const std::optional<PlaceGrid> grid =
      std::isnan(a.grid) ? std::nullopt : std::optional(MakePlaceGrid(predictor.map(), a.grid));
  const std::vector<Vec2> places = grid ? grid->Places() : ReadPlaces(a.places);
  const PredictedHeights heights = predictor.At(places, a.level, a.threads);
  WriteFileAtomically(a.out, EncodePrediction(ending, places, grid, heights));
  if (!a.values_only && !fitted.note.empty()) {
    Tell("{}\n", fitted.note);
  }
  Tell("{} predicted, {} of them without support; {}\n", Counted(std::ssize(places), "height"),
       std::ranges::count(heights.supported, char{0}), a.out);
  return 0;
}

void DeclarePredict(CLI::App& command, CommandLine& line) {
  PredictArguments& a = *Bind(command, line, &Predict);
  command.add_option("SURFACE", a.surface, "folder of a fit, or its surface.hspline.json")
      ->required();
  command.add_option("PLACES", a.places,
                     "table (.csv .txt) with columns x and y (or lon and lat, easting and "
                     "northing), or .npy; each also .gz; - for a table on standard input");
  command.add_option("--grid", a.grid, "in place of PLACES: a grid of this step over all points")
      ->check(Finite());
  command
      .add_option("--to", a.out,
                  "file with x, y, z, sd, low, high, supported: .csv or .npy; of a grid also .asc, "
                  "with -9999 where the points do not support z")
      ->required();
  command.add_option("--level", a.level, "share of new observations between low and high [0.9]")
      ->check(CLI::Range(0.001, 0.999));
  command.add_flag("--values-only", a.values_only, "no sd and no interval, which take time");
  command.add_flag("--force", a.force, "replace the file");
  AddThreads(command, a.threads);
}

}  // namespace

std::span<const ProgramCommand> FitCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"fit", "fit an H-spline surface to any scattered points", &DeclareFit},
      ProgramCommand{"predict", "heights of a fitted surface anywhere, with their uncertainty",
                     &DeclarePredict},
  };
  return kCommands;
}

}  // namespace semblance::problems
