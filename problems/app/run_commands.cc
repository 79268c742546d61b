// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "problems/app/evaluate.h"
#include "problems/app/exit_code.h"
#include "problems/app/keep_memory.h"
#include "problems/app/program_end.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_files.h"
#include "problems/experiment/stage_cache.h"
#include "problems/io/output_folder.h"
#include "problems/io/staged_folder.h"
#include "problems/io/volumes/import_ct.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/points/point_fit.h"
#include "problems/population/population_file.h"
#include "problems/report/alternatives.h"
#include "problems/report/run_folder.h"
#include "problems/report/run_report.h"
#include "problems/study/depth_study.h"
#include "problems/study/report/study_report.h"
#include "problems/study/study_metrics.h"
#include "problems/study/study_plan.h"
#include "surfaces/base/error.h"
#include "surfaces/decimate/decimate.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

// The arguments of all commands of this file. Each command reads its part.
struct Arguments : WorkOptions {
  std::vector<std::string> files;
  bool schema = false, without_inputs = false;
  std::string options_of = "experiment", job = "face";
  std::string config, landmarks;
  std::vector<std::string> exclude;
  CtImportOptions ct;
  ReadVolumeOptions reading;
  MrSkinOptions mr;
  std::string modality = "auto";
};

void PrintFaceError(const char* what, const FaceMetrics& m) {
  const DistanceSummary& s = m.truth_to_face;
  Tell(
      "{}: mean {:.2f} mm, RMS {:.2f} mm, median {:.2f} mm, p95 {:.2f} mm, within 2.5 mm {:.1f} % "
      "of {:.0f} cm² of true skin\n",
      what, s.mean_abs_mm, s.rms_mm, s.median_mm, s.p95_mm, 100 * s.within_2_5mm, s.area_cm2);
}

void PrintNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    Tell("note: {}\n", note);
  }
}

// Reads the alternatives of the experiment in the file.
std::vector<NamedExperiment> ReadAlternatives(const std::filesystem::path& file,
                                              const Arguments& arguments,
                                              const Experiment& experiment) {
  ConfigErrors errors;
  const ConfigNode tree =
      LoadConfigTree(file, arguments.overrides, MakeConfigTree(Experiment{}), errors);
  return MakeAlternatives(experiment, file.parent_path(), tree);
}

// Throws InputError for faults of the alternatives before the long work begins. The run itself
// reports faults of the experiment.
void RequireSoundAlternatives(const std::filesystem::path& config, const Experiment& experiment,
                              const std::vector<NamedExperiment>& named, StageCache& cache,
                              const RunContext& context) {
  if (named.empty()) {
    return;
  }
  InputCheck inputs(context, &cache);
  const CheckFindings own = inputs.Look(experiment);
  std::vector<std::string> faults = CheckAlternatives(named, own, inputs).faults;
  if (own.sound() && !faults.empty()) {
    for (std::string& fault : faults) {
      fault = fmt::format("{}: {}", config.string(), fault);
    }
    throw InputError(fmt::format("{}", fmt::join(faults, "\n")));
  }
}

void PrintPlace(const std::filesystem::path& folder, const std::filesystem::path& config,
                const Experiment& experiment) {
  if (!experiment.report) {
    Tell("folder: {}\n", folder.string());
    return;
  }
  Tell("report: {}\n", (folder / "report.html").string());
  Tell("next: open the report in a browser; semblance workbench {} changes this face there\n",
       config.string());
}

int RunCommand(const Arguments& arguments) {
  KeepFreedMemory();
  const std::filesystem::path config = arguments.files.at(0);
  const auto experiment = ReadConfig<Experiment>(config, arguments.overrides);
  CheckNetworkNamed(experiment, config);
  const std::vector<NamedExperiment> named = ReadAlternatives(config, arguments, experiment);
  GivenFiles given = GivenTo(experiment, config, kRunFiles);
  for (const NamedExperiment& alternative : named) {
    std::ranges::copy(InputFiles(alternative.experiment), std::back_inserter(given.files));
  }
  StagedFolder folder =
      MakeStagedFolder(arguments, "out/" + config.stem().string(), std::move(given));
  const RunContext context = MakeRunContext(arguments);
  StageCache cache(16);
  RequireSoundAlternatives(config, experiment, named, cache, context);
  const RunResult result = Run(experiment, context, &cache);
  std::vector<std::string> faults = result.Faults();
  std::ranges::copy(RunAlternatives(experiment, named, result, cache, folder.Files(), context),
                    std::back_inserter(faults));
  WriteRun(experiment, result, folder.Files(), context);
  folder.Publish();
  PrintNotes(result.Notes());
  if (result.truth) {
    Tell("{}; closest-point distances\n", ToPhrase(result.truth->skin));
    PrintFaceError("first face", result.truth->implicit);
    PrintFaceError("recovered face", result.truth->face);
  }
  PrintPlace(folder.Root(), config, experiment);
  return PrintFaults(faults);
}

int DepthCommand(const Arguments& arguments) {
  const std::filesystem::path config = arguments.files.at(0);
  const auto experiment = ReadConfig<Experiment>(config, arguments.overrides);
  CheckNetworkNamed(experiment, config);
  StagedFolder folder = MakeStagedFolder(arguments, "out/" + config.stem().string() + "_depth",
                                         GivenTo(experiment, config, kDepthFiles));
  const RunContext context = MakeRunContext(arguments);
  const DepthResult result = MeasureDepth(experiment, context);
  WriteDepth(experiment, result, folder.Files(), context);
  folder.Publish();
  PrintNotes(result.stage->subject.notes);
  Tell("{}folder: {}\n", DepthText(result), folder.Root().string());
  return PrintFaults(result.Faults());
}

// Adds an error for each missing file, at the place of its name. Files of template and bust are
// read together with the options and reported there.
void AddMissing(std::span<const NamedFile> named, const ConfigNode& tree, ConfigErrors& errors) {
  std::error_code ignored;
  for (const NamedFile& input : named) {
    const bool is_reported =
        input.option.starts_with("template.") || input.option.starts_with("bust.");
    if (!is_reported && !std::filesystem::exists(input.file, ignored)) {
      errors.Add(FindLocation(tree, input.option), input.option,
                 fmt::format("no such file: {}; paths are relative to the file that names them",
                             input.file.string()));
    }
  }
}

// Reads a configuration. Throws ConfigError with all its faults, missing files included.
template <class Options>
Options ReadChecked(const std::string& file, const Arguments& arguments,
                    std::vector<NamedFile> (*inputs_of)(const Options&)) {
  ConfigErrors errors;
  const ConfigNode tree =
      LoadConfigTree(file, arguments.overrides, MakeConfigTree(Options{}), errors);
  const auto options = ReadConfigTree<Options>(tree, errors);
  if (!arguments.without_inputs) {
    AddMissing(inputs_of(options), tree, errors);
  }
  errors.ThrowIfAny();
  return options;
}

CheckFindings CheckStudy(const std::string& file, const Arguments& arguments, InputCheck& inputs) {
  if (!arguments.overrides.empty()) {
    throw InputError(fmt::format(
        "{}: --set is for experiments and fits; write it into the study, under set:", file));
  }
  CheckFindings findings;
  const StudyPlan plan = ReadStudy(file, WithoutSubjects::kNote);
  findings.warnings = plan.notes;
  for (const StudyTrial& trial : plan.trials) {
    if (!arguments.without_inputs) {
      findings.Add(inputs.Look(trial.experiment));
    }
  }
  return findings;
}

CheckFindings CheckExperiment(const std::string& file, const Arguments& arguments,
                              InputCheck& inputs) {
  const auto experiment = ReadChecked<Experiment>(file, arguments, &NamedInputs);
  const std::vector<NamedExperiment> named = ReadAlternatives(file, arguments, experiment);
  CheckFindings findings;
  if (!arguments.without_inputs) {
    findings = inputs.Look(experiment);
    findings.Add(CheckAlternatives(named, findings, inputs));
  }
  return findings;
}

CheckFindings CheckPopulation(const std::string& file, const Arguments& arguments) {
  if (!arguments.overrides.empty()) {
    throw InputError(
        fmt::format("{}: --set is for experiments and fits; write it into the population", file));
  }
  ReadChecked<PopulationFile>(file, arguments, &NamedInputs);
  CheckFindings findings;
  if (!arguments.without_inputs) {
    findings.warnings = ReadPopulation(file).notes;
  }
  return findings;
}

// True if the file can be read as such options. Files that it names are not opened.
template <class Options>
bool Reads(const std::string& file, const Arguments& arguments) try {
  ConfigErrors errors;
  ReadConfigTree<Options>(
      LoadConfigTree(file, arguments.overrides, MakeConfigTree(Options{}), errors), errors);
  errors.ThrowIfAny();
  return true;
} catch (const ConfigError&) {
  return false;
}

// Checks a file that is a sound configuration of a fit and may be an experiment too. Faults of the
// experiment are warnings.
CheckFindings CheckFitOrExperiment(const std::string& file, const Arguments& arguments,
                                   InputCheck& inputs) {
  CheckFindings findings;
  try {
    findings = CheckExperiment(file, arguments, inputs);
  } catch (const ConfigError& error) {
    findings.faults.emplace_back(error.what());
  }
  for (const std::string& fault : std::exchange(findings.faults, {})) {
    findings.warnings.push_back(
        "it is a configuration of `semblance fit`; `semblance run` would report: " + fault);
  }
  return findings;
}

// Finds the kind of file by its top-level keys. It is an experiment unless another kind has more of
// the keys. A file whose keys all belong to experiments and to fits may be either.
CheckFindings CheckConfig(const std::string& file, const Arguments& arguments, InputCheck& inputs) {
  const int of_study = OwnKeys<StudyFile>(file), of_population = OwnKeys<PopulationFile>(file);
  if (of_study > OwnKeys<Experiment>(file) && of_study >= of_population) {
    return CheckStudy(file, arguments, inputs);
  }
  if (of_population > OwnKeys<Experiment>(file)) {
    return CheckPopulation(file, arguments);
  }
  if (KnownKeys<PointFitOptions>(file) > KnownKeys<Experiment>(file)) {
    ReadChecked<PointFitOptions>(file, arguments, &NamedFiles<PointFitOptions>);
    return {};
  }
  if (Reads<PointFitOptions>(file, arguments)) {
    return CheckFitOrExperiment(file, arguments, inputs);
  }
  return CheckExperiment(file, arguments, inputs);
}

// Prints the findings and returns true if there was no fault.
bool PrintFindings(const std::string& file, const CheckFindings& findings) {
  for (const std::string& warning : findings.warnings) {
    Tell("{}: warning: {}\n", file, warning);
  }
  for (const std::string& fault : findings.faults) {
    Tell(stderr, "{}\n", Shortened(fmt::format("{}: {}", file, fault)));
  }
  if (findings.sound()) {
    Tell("{}: no fault found\n", file);
  }
  return findings.sound();
}

// The message of an exception. The name of the file is added if the message does not begin with it.
std::string DescribeFault(const std::string& file, const std::exception_ptr& thrown) {
  const std::string words = DescribeFailure(thrown).words;
  return words.starts_with(file) ? words : Shortened(fmt::format("{}: {}", file, words));
}

int CheckCommand(const Arguments& arguments) {
  RunContext context;
  context.threads = arguments.threads;
  InputCheck inputs(context);
  bool sound = true;
  for (const std::string& file : arguments.files) {
    try {
      sound = PrintFindings(file, CheckConfig(file, arguments, inputs)) && sound;
    } catch (const ConfigError& error) {
      Tell(stderr, "{}\n", Shortened(error.what()));
      sound = false;
    } catch (...) {
      Tell(stderr, "{}\n", DescribeFault(file, std::current_exception()));
      sound = false;
    }
  }
  return sound ? kDone : kBadInput;
}

template <class Options>
std::string OptionsText(bool schema) {
  return schema ? OptionsSchema<Options>() : OptionsReference<Options>();
}

// Prints the numbers that a study can rank by.
int PrintMetrics(const Arguments& arguments) {
  if (arguments.schema) {
    throw InputError("options metrics: metrics have no schema; leave --schema out");
  }
  const auto job = arguments.job == "depth"      ? StudyJob::kDepth
                   : arguments.job == "identify" ? StudyJob::kIdentify
                                                 : StudyJob::kFace;
  fmt::print("{}", MetricsText(job));
  return kDone;
}

int OptionsCommand(const Arguments& arguments) {
  const bool schema = arguments.schema;
  if (arguments.options_of == "metrics") {
    return PrintMetrics(arguments);
  }
  fmt::print("{}", arguments.options_of == "population" ? OptionsText<PopulationFile>(schema)
                   : arguments.options_of == "study"    ? OptionsText<StudyFile>(schema)
                   : arguments.options_of == "fit"      ? OptionsText<PointFitOptions>(schema)
                                                        : OptionsText<Experiment>(schema));
  return kDone;
}

// Checks the mesh as its readers do, and writes it.
void WriteSkin(const TriMesh& skin, int dropped, OutputFolder& folder) {
  CheckHeadMesh(skin, "the imported skin");
  folder.Write("skin.ply", EncodeMesh(skin, ".ply"));
  Tell("skin.ply: {} triangles; {} smaller pieces dropped\n", skin.triangles.size(), dropped);
}

// Marching cubes make triangles of the size of a voxel also where the bone is flat. 0.1 mm is a
// tenth of the finest voxels, and far less than the uncertainty of the edges.
TriMesh Thinned(const TriMesh& mesh) {
  constexpr double kTolerance_mm = 0.1;
  return Decimate(mesh, {.tolerance_mm = kTolerance_mm}).mesh;
}

void WriteImport(CtImport import, OutputFolder& folder) {
  import.skull = Thinned(import.skull);
  import.skin = Thinned(import.skin);
  CheckHeadMesh(import.skull, "the imported skull");
  folder.Write("skull.ply", EncodeMesh(import.skull, ".ply"));
  Tell("skull.ply: {} triangles\n", import.skull.triangles.size());
  WriteSkin(import.skin, import.dropped_skin, folder);
  PrintNotes(import.notes);
}

bool IsMr(const Arguments& arguments, const VolumeReading& reading) {
  return arguments.modality == "auto" ? reading.modality == Modality::kMr
                                      : arguments.modality == "mr";
}

// Writes the meshes. Messages about faults begin with the name of the volume.
void Import(const Arguments& arguments, const VolumeReading& reading, bool mr, OutputFolder& folder,
            const RunContext& context) try {
  if (mr) {
    const MrSkin import = ImportMrSkin(reading.volume, arguments.mr, context);
    WriteSkin(import.skin, import.dropped, folder);
    PrintNotes(import.notes);
    return;
  }
  WriteImport(ImportCt(reading.volume, arguments.ct, context), folder);
} catch (const InputError& error) {
  throw InputError(fmt::format("{}: {}", arguments.files.at(0), error.what()));
}

int ImportCtCommand(const Arguments& arguments) {
  const std::filesystem::path path = arguments.files.at(0);
  const RunContext context = MakeRunContext(arguments);
  const VolumeReading reading = ReadVolume(path, arguments.reading, context);
  const bool mr = IsMr(arguments, reading);
  if (!mr && arguments.mr.skin_value > 0) {
    throw InputError("--skin-value is for an MR; use --skin-hu for a CT");
  }
  PrintNotes(reading.notes);
  StagedFolder folder = MakeStagedFolder(arguments, "out/" + PlainName(path), {.files = {path}});
  Import(arguments, reading, mr, folder.Files(), context);
  folder.Publish();
  const std::filesystem::path root = std::filesystem::absolute(folder.Root()).lexically_normal();
  Tell("folder: {}\n", root.string());
  if (!mr) {
    const std::string skull = (folder.Root() / "skull.ply").string();
    Tell(
        "next: semblance workbench {0}\n  places the landmarks and makes the face in a browser. "
        "Without one:\n  semblance landmarks propose {0} --out {1}\n",
        skull, (folder.Root() / "landmarks.yaml").string());
  }
  return kDone;
}

int EvaluateCommand(const Arguments& arguments) {
  EvaluateOptions options{.face = arguments.files.at(0),
                          .truth = arguments.files.size() > 1 ? arguments.files[1] : "",
                          .config = arguments.config,
                          .overrides = arguments.overrides,
                          .landmarks = arguments.landmarks,
                          .exclude = {}};
  std::ranges::transform(arguments.exclude, std::back_inserter(options.exclude), ParseZone);
  std::vector<std::string> notes;
  const nlohmann::ordered_json score = Evaluate(options, MakeRunContext(arguments), notes);
  for (const std::string& note : notes) {
    Tell(stderr, "note: {}\n", note);
  }
  Tell("{}\n", score.dump(2));
  return PrintFaults(std::isfinite(score.at("rms_mm").get<double>())
                         ? std::vector<std::string>()
                         : std::vector<std::string>{"the distance of the faces is not a number"});
}

int ReportCommand(const Arguments& arguments) {
  const std::filesystem::path root = arguments.files.at(0);
  std::error_code ignored;
  if (!std::filesystem::is_directory(root, ignored)) {
    throw IoError(
        fmt::format("{}: no such folder; name the folder of a run or a study", root.string()));
  }
  const bool is_study = std::filesystem::exists(root / "plan.json");
  if (!is_study && !std::filesystem::exists(root / "result.json")) {
    throw IoError(
        fmt::format("{}: neither the folder of a run (it has no result.json) nor that of a study "
                    "(no plan.json); name one of these",
                    root.string()));
  }
  OutputFolder folder(root, WhenNotEmpty::kReplaceFiles);
  if (is_study) {
    WriteStudyTables(folder);
  } else {
    WriteReport(folder);
  }
  Tell("report: {}\n", (root / "report.html").string());
  return kDone;
}

using CommandFunction = int (*)(const Arguments&);

// Declares a command that reads a configuration and writes a folder.
Arguments& DeclareJob(CLI::App& command, CommandLine& line, CommandFunction run) {
  Arguments& a = *Bind(command, line, run);
  AddSet(command, a);
  AddOutput(command, a);
  AddWork(command, line, a);
  return a;
}

void DeclareRun(CLI::App& command, CommandLine& line) {
  Arguments& a = DeclareJob(command, line, &RunCommand);
  command.add_option("CONFIG", a.files, "YAML file of the experiment")->required()->expected(1);
}

void DeclareDepth(CLI::App& command, CommandLine& line) {
  Arguments& a = DeclareJob(command, line, &DepthCommand);
  command.add_option("CONFIG", a.files, "YAML file of the experiment")->required()->expected(1);
}

void DeclareImportCt(CLI::App& command, CommandLine& line) {
  Arguments& a = *Bind(command, line, &ImportCtCommand);
  command
      .add_option("VOLUME", a.files,
                  "folder of DICOM files; or .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd, .inv3")
      ->required()
      ->expected(1);
  command.add_option("--series", a.reading.series,
                     "number or UID of the series, if a DICOM folder holds several");
  command.add_flag("--fill-slices", a.reading.fill_slices,
                   "interpolate missing slices (over up to 10 mm), use the first of duplicates");
  command
      .add_option("--modality", a.modality,
                  "ct; mr: only the skin is imported; auto: as DICOM states, else ct")
      ->check(CLI::IsMember({"auto", "ct", "mr"}))
      ->capture_default_str();
  command
      .add_option("--skin-value", a.mr.skin_value,
                  "MR only: grey value of the skin's surface; 0: by Otsu's method")
      ->check(Finite())
      ->check(CLI::Range(0.0, 32767.0))
      ->capture_default_str();
  command.add_option("--bone-hu", a.ct.bone_hu, "Hounsfield value of the skull's surface")
      ->check(Finite())
      ->check(CLI::Range(50.0, 3000.0))
      ->capture_default_str();
  command.add_option("--skin-hu", a.ct.skin_hu, "Hounsfield value of the skin's surface")
      ->check(Finite())
      ->check(CLI::Range(-900.0, 0.0))
      ->capture_default_str();
  AddChoice(command, "--edges", "threshold; half_maximum: keeps more of thin tissue", a.ct.edges);
  AddOutput(command, a);
  AddWork(command, line, a);
}

void DeclareCheck(CLI::App& command, CommandLine& line) {
  Arguments& a = *Bind(command, line, &CheckCommand);
  command.add_option("CONFIG", a.files, "YAML files")->required();
  AddSet(command, a);
  command.add_flag("--without-inputs", a.without_inputs,
                   "check only the options; otherwise every file that they name is opened, and the "
                   "landmarks are placed on the bone");
}

void DeclareOptions(CLI::App& command, CommandLine& line) {
  Arguments& a = *Bind(command, line, &OptionsCommand);
  command
      .add_option(
          "KIND", a.options_of,
          "kind of file: experiment, study, population or fit; or metrics: the numbers that "
          "a study can rank by, with their units")
      ->check(CLI::IsMember({"experiment", "study", "population", "fit", "metrics"}))
      ->capture_default_str();
  command.add_option("--job", a.job, "for metrics: the job of the study")
      ->check(CLI::IsMember({"face", "depth", "identify"}))
      ->capture_default_str();
  command.add_flag("--schema", a.schema, "as a JSON Schema for editors");
}

void DeclareEvaluate(CLI::App& command, CommandLine& line) {
  Arguments& a = *Bind(command, line, &EvaluateCommand);
  command
      .add_option("FACE TRUTH", a.files,
                  "the reconstructed face (a mesh, or a run's face.hspline.json) and the mesh of "
                  "the true skin")
      ->required()
      ->expected(1, 2);
  command.add_option(
      "--config", a.config,
      "experiment with true skin, landmarks and region; without TRUTH, the numbers are "
      "identical to those of its run");
  AddSet(command, a);
  command.add_option(
      "--landmarks", a.landmarks,
      "YAML file of the landmarks on the true skull: only the outer skin of the face "
      "is scored; without it the whole TRUTH");
  command
      .add_option("--exclude", a.exclude,
                  "site=radius_mm, e.g. zy_r=15: zone that is not scored; may be repeated")
      ->allow_extra_args(false);
  AddWork(command, line, a);
}

void DeclareReport(CLI::App& command, CommandLine& line) {
  Arguments& a = *Bind(command, line, &ReportCommand);
  command.add_option("DIR", a.files, "folder of a run or a study")->required()->expected(1);
}

}  // namespace

std::span<const ProgramCommand> RunCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"run", "recover the face of a configuration", &DeclareRun},
      ProgramCommand{
          "depth",
          "interpolate only the depth, and compare it with the true skin and with left-out depth "
          "markers",
          &DeclareDepth},
      ProgramCommand{
          "import-ct",
          "make meshes of skull and skin from a CT volume, or of the skin from an MR, in "
          "mm",
          &DeclareImportCt},
      ProgramCommand{
          "check",
          "check configurations of experiments, studies and fits, and all files that they "
          "name; run nothing",
          &DeclareCheck},
      ProgramCommand{"options", "list every option: default, unit, range, meaning",
                     &DeclareOptions},
      ProgramCommand{"evaluate", "print the distances of a face from the true one as JSON",
                     &DeclareEvaluate},
      ProgramCommand{"report", "build the report of a run or a study again", &DeclareReport},
  };
  return kCommands;
}

}  // namespace semblance::problems
