// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
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
#include "surfaces/base/error.h"

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
  Tell("{} points, (u,v): {}; {} control vertices; RMS {:.4g} mm, largest {:.4g} mm\n",
       result.fit.residual_mm.size(), result.parameters,
       result.fit.surface.Net(0).vertices.size() + result.fit.surface.Offsets().size(),
       result.fit.point_rms_mm, result.distance.max_mm);
  if (result.fit.automatic) {
    Tell("{}", AutoText(*result.fit.automatic));
  }
  for (const std::string& note : notes) {
    Tell("{}\n", note);
  }
  if (const auto tolerance = CompareWithTolerance(options, result)) {
    Tell("{}\n", ToleranceText(*tolerance));
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

}  // namespace

std::span<const ProgramCommand> FitCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"fit", "fit an H-spline surface to any scattered points", &DeclareFit},
  };
  return kCommands;
}

}  // namespace semblance::problems
