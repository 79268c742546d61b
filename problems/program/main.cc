// SPDX-License-Identifier: GPL-3.0-or-later
// The command line. Exit codes: 0 done, 1 ran but the result is not usable, 2 bad input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "problems/metrics/face_metrics_json.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/points/point_fit.h"
#include "problems/program/exit_code.h"
#include "problems/program/face_commands.h"
#include "problems/program/progress.h"
#include "problems/program/study_commands.h"
#include "problems/report/run_folder.h"
#include "problems/study/depth_study.h"
#include "problems/study/study_report.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh/mesh_io.h"

namespace semblance {
namespace {

// What the user typed; each command reads its part.
struct Arguments {
  std::vector<std::string> files;
  std::vector<std::string> overrides;
  std::string out;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool force = false, quiet = false, schema = false;
  CtImportOptions ct;
  std::string ct_edges = "threshold";
};

std::stop_source& StopSource() {
  static std::stop_source source;  // a signal handler has no other way in
  return source;
}

RunContext MakeContext(const Arguments& arguments) {
  RunContext context;
  context.threads = arguments.threads;
  context.stop_token = StopSource().get_token();
  if (!arguments.quiet) {
    context.on_event = ProgressPrinter(stderr);
  }
  return context;
}

OutputFolder MakeFolder(const Arguments& arguments, const std::string& default_out) {
  return {arguments.out.empty() ? default_out : arguments.out,
          arguments.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse};
}

void PrintFaceError(const char* what, const FaceMetrics& m) {
  const DistanceSummary& s = m.truth_to_face;
  fmt::print(
      "{}: mean {:.2f} mm, RMS {:.2f} mm, median {:.2f} mm, p95 {:.2f} mm, within 2.5 mm {:.1f} % "
      "of {:.0f} cm² of true skin\n",
      what, s.mean_abs_mm, s.rms_mm, s.median_mm, s.p95_mm, 100 * s.within_2_5mm, s.area_cm2);
}

int RunCommand(const Arguments& arguments) {
  const std::filesystem::path config = arguments.files.at(0);
  const auto experiment = ReadConfig<Experiment>(config, arguments.overrides);
  OutputFolder folder = MakeFolder(arguments, "out/" + config.stem().string());
  const RunContext context = MakeContext(arguments);
  const RunResult result = Run(experiment, context);
  WriteRun(experiment, result, folder, context);
  for (const std::string& note : result.subject.notes) {
    fmt::print("note: {}\n", note);
  }
  if (result.truth) {
    fmt::print(
        "scored: the skin in front of the dowel network, without excluded zones; closest-point "
        "distances\n");
    PrintFaceError("implicit face", result.truth->implicit);
    PrintFaceError("H-spline face", result.truth->face);
  }
  fmt::print("report: {}\n",
             std::filesystem::absolute(folder.Root() / "report.html").lexically_normal().string());
  return result.usable() ? kDone : kNotUsable;
}

int DepthCommand(const Arguments& arguments) {
  const std::filesystem::path config = arguments.files.at(0);
  const auto experiment = ReadConfig<Experiment>(config, arguments.overrides);
  OutputFolder folder = MakeFolder(arguments, "out/" + config.stem().string() + "_depth");
  const RunContext context = MakeContext(arguments);
  const DepthResult result = MeasureDepth(experiment, context);
  WriteDepth(experiment, result, folder, context);
  fmt::print("{}folder: {}\n", DepthText(result), folder.Root().string());
  return result.usable() ? kDone : kNotUsable;
}

int FitCommand(const Arguments& arguments) {
  const std::filesystem::path points = arguments.files.at(0), config = arguments.files.at(1);
  const auto options = ReadConfig<PointFitOptions>(config, arguments.overrides);
  const PointTable table = ReadPointTable(points);
  OutputFolder folder = MakeFolder(arguments, fmt::format("out/{}", points.stem().string()));
  const RunContext context = MakeContext(arguments);
  const PointFit result = FitPoints(table, options, context);
  WritePointFit(options, points, result, folder, context);
  fmt::print("{} points, (u,v): {}; {} control vertices; RMS {:.4g} mm, largest {:.4g} mm\n",
             table.positions.size(), result.parameters,
             result.fit.surface.Net(0).vertices.size() + result.fit.surface.Offsets().size(),
             result.fit.point_rms_mm,
             *std::max_element(result.fit.residual_mm.begin(), result.fit.residual_mm.end()));
  fmt::print("folder: {}\n", std::filesystem::absolute(folder.Root()).lexically_normal().string());
  return result.fit.usable ? kDone : kNotUsable;
}

// An experiment, unless more of its keys are those of a fit of points.
void CheckConfig(const std::string& file, std::span<const std::string> overrides) {
  if (KnownKeys<PointFitOptions>(file) > KnownKeys<Experiment>(file)) {
    ReadConfig<PointFitOptions>(file, overrides);
  } else {
    ReadConfig<Experiment>(file, overrides);
  }
}

int CheckCommand(const Arguments& arguments) {
  bool sound = true;
  for (const std::string& file : arguments.files) {
    try {
      CheckConfig(file, arguments.overrides);
      fmt::print("{}: no fault found\n", file);
    } catch (const Error& e) {
      fmt::print(stderr, "{}\n", e.what());
      sound = false;
    }
  }
  return sound ? kDone : kBadInput;
}

int OptionsCommand(const Arguments& arguments) {
  fmt::print("{}", arguments.schema ? OptionsSchema<Experiment>() : OptionsReference<Experiment>());
  return kDone;
}

int ImportCtCommand(const Arguments& arguments) {
  const std::filesystem::path volume = arguments.files.at(0);
  CtImportOptions options = arguments.ct;
  options.edges = arguments.ct_edges == "threshold" ? CtEdges::kThreshold : CtEdges::kHalfMaximum;
  OutputFolder folder = MakeFolder(arguments, "out/" + volume.stem().string());
  const CtImport import = ImportCt(ReadInvesalius(volume), options, MakeContext(arguments));
  folder.Write("skull.ply", EncodeMesh(import.skull, ".ply"));
  folder.Write("skin.ply", EncodeMesh(import.skin, ".ply"));
  fmt::print("skull.ply: {} triangles; {} pieces below {} cm^2 dropped\n",
             import.skull.triangles.size(), import.dropped_bone, options.smallest_bone_cm2);
  fmt::print("skin.ply: {} triangles; {} pieces apart from the largest dropped\n",
             import.skin.triangles.size(), import.dropped_skin);
  for (const std::string& note : import.notes) {
    fmt::print("note: {}\n", note);
  }
  fmt::print("folder: {}\n", std::filesystem::absolute(folder.Root()).lexically_normal().string());
  return kDone;
}

int EvaluateCommand(const Arguments& arguments) {
  const TriMesh face = ReadMesh(arguments.files.at(0)), truth = ReadMesh(arguments.files.at(1));
  CheckHeadMesh(face, arguments.files.at(0));
  CheckHeadMesh(truth, arguments.files.at(1));
  fmt::print("{}\n",
             MetricsToJson(CompareFaces(truth, WholeSurface(truth), face, MakeContext(arguments)))
                 .dump(2));
  return kDone;
}

int ReportCommand(const Arguments& arguments) {
  const std::filesystem::path root = arguments.files.at(0);
  if (!std::filesystem::is_directory(root)) {
    throw IoError(fmt::format("{}: no such folder; name the folder of a run", root.string()));
  }
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  if (std::filesystem::exists(root / "plan.json")) {
    WriteStudyTables(folder);
  } else {
    WriteReport(folder);
  }
  fmt::print("report: {}\n", (root / "report.html").string());
  return kDone;
}

using Command = int (*)(const Arguments&);

// Declares the commands; the one that is named on the line sets `chosen`.
void Declare(CLI::App& app, Arguments& a, Command& chosen) {
  app.require_subcommand(1);
  const auto add = [&](const char* name, const char* help, Command command) {
    CLI::App* sub = app.add_subcommand(name, help);
    sub->callback([&chosen, command] { chosen = command; });
    return sub;
  };
  const auto add_output = [&](CLI::App* sub) {
    sub->add_option("--out", a.out, "folder for the results");
    sub->add_flag("--force", a.force,
                  "replace files of the same name in a folder that is not empty");
  };
  const auto add_work = [&](CLI::App* sub) {
    sub->add_option("--threads", a.threads, "threads to use; the result does not depend on it")
        ->check(CLI::Range(1, 1024));
    sub->add_flag("--quiet", a.quiet, "no progress");
  };
  CLI::App* run = add("run", "reconstruct a face, as a configuration says", &RunCommand);
  run->add_option("CONFIG", a.files, "YAML file of the experiment")->required()->expected(1);
  run->add_option("--set", a.overrides, "path=value, laid over the configuration; may be repeated")
      ->allow_extra_args(false);
  add_output(run);
  add_work(run);
  CLI::App* depth =
      add("depth", "interpolate depth alone: against the true skin, and with dowels left out",
          &DepthCommand);
  depth->add_option("CONFIG", a.files, "YAML file of the experiment")->required()->expected(1);
  depth->add_option("--set", a.overrides, "path=value, as in run")->allow_extra_args(false);
  add_output(depth);
  add_work(depth);
  CLI::App* fit = add("fit", "an H-spline surface through any scattered points", &FitCommand);
  fit->add_option(
         "POINTS CONFIG", a.files,
         "CSV file with the columns x,y,z and, if known, u,v, weight; YAML file of the fit")
      ->required()
      ->expected(2);
  fit->add_option("--set", a.overrides, "path=value, laid over the configuration; may be repeated")
      ->allow_extra_args(false);
  add_output(fit);
  add_work(fit);
  CLI::App* import =
      add("import-ct", "meshes of skull and skin from a CT volume, in mm", &ImportCtCommand);
  import->add_option("VOLUME", a.files, "InVesalius project (.inv3)")->required()->expected(1);
  import->add_option("--bone-hu", a.ct.bone_hu, "Hounsfield value of the skull's surface")
      ->check(CLI::Range(50.0, 3000.0))
      ->capture_default_str();
  import->add_option("--skin-hu", a.ct.skin_hu, "Hounsfield value of the skin's surface")
      ->check(CLI::Range(-900.0, 0.0))
      ->capture_default_str();
  import->add_option("--edges", a.ct_edges, "threshold, or half_maximum, which thins tissue less")
      ->check(CLI::IsMember({"threshold", "half_maximum"}))
      ->capture_default_str();
  add_output(import);
  add_work(import);
  CLI::App* check =
      add("check", "validate configurations, of experiments and of fits of points, and run nothing",
          &CheckCommand);
  check->add_option("CONFIG", a.files, "YAML files")->required();
  check->add_option("--set", a.overrides, "path=value, laid over each")->allow_extra_args(false);
  CLI::App* options =
      add("options", "every option: default, unit, range, meaning", &OptionsCommand);
  options->add_flag("--schema", a.schema, "as a JSON Schema for editors");
  CLI::App* evaluate =
      add("evaluate", "how far a face is from the true one, as JSON", &EvaluateCommand);
  evaluate->add_option("FACE TRUTH", a.files, "the reconstructed mesh and the true one")
      ->required()
      ->expected(2);
  add_work(evaluate);
  CLI::App* report = add("report", "build the report of a run anew", &ReportCommand);
  report->add_option("DIR", a.files, "folder of a run")->required()->expected(1);
}

int Main(int argc, char** argv) {
  CLI::App app("Recovers a face from a skull, and compares the ways of doing so.", "semblance");
  app.set_version_flag("--version", "semblance " SEMBLANCE_VERSION);
  Arguments arguments;
  Command chosen = nullptr;
  std::function<int()> other;
  Declare(app, arguments, chosen);
  DeclareStudyCommands(app, StopSource().get_token(), other);
  DeclareFaceCommands(app, other);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kBadInput;
  }
  try {
    return other ? other() : chosen(arguments);
  } catch (const Error& e) {
    fmt::print(stderr, "semblance: {}\n", e.what());
    return kBadInput;
  } catch (const Cancelled&) {
    fmt::print(
        stderr,
        "semblance: stopped; no run was written, and the finished trials of a study are kept\n");
    return kNotUsable;
  }
}

}  // namespace
}  // namespace semblance

int main(int argc, char** argv) {
  const auto stop = [](int) { semblance::StopSource().request_stop(); };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  return semblance::Main(argc, argv);
}
