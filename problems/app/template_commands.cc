// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_files.h"
#include "problems/face/bust/whole_head.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/recentre.h"
#include "problems/face/template_source.h"
#include "problems/io/staged_folder.h"
#include "problems/report/pictures/template_summary.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/join_copies.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The arguments of `template`.
struct TemplateArguments : WorkOptions {
  fs::path input;
  std::vector<fs::path> landmarks;
  TemplateFitOptions fit;
  bool bust = false;
};

// All files that may be written.
constexpr std::array<std::string_view, 6> kOutputs = {"head.hspline.json", "sites.csv",
                                                      "features.json",     "template.json",
                                                      "template.png",      "bust.json"};

StagedFolder MakeFolder(const TemplateArguments& a, GivenFiles given) {
  return MakeStagedFolder(a, fmt::format("out/{}_template", a.input.stem().string()),
                          std::move(given));
}

void Write(const TemplateFace& face, StagedFolder& folder) {
  const FileTemplate files = WriteTemplate(folder.Files().Root(), face);
  folder.Publish();
  const auto name = [&](const fs::path& file) {
    return (folder.Root() / file.filename()).string();
  };
  Tell("template: {{type: file, surface: {}, sites: {}, features: {}}}\n", name(files.surface),
       name(files.sites), name(files.features));
}

// Writes the template of a configuration.
int WriteFromConfig(const TemplateArguments& a) {
  if (a.bust) {
    throw InputError("--bust needs a head with landmarks; leave it out for a configuration");
  }
  const auto experiment = ReadConfig<Experiment>(a.input, a.overrides);
  StagedFolder folder = MakeFolder(a, GivenTo(experiment, a.input, kOutputs));
  Write(LoadTemplate(experiment.face_template), folder);
  return kDone;
}

// Makes a template from a head. All faults of the input are found before the folder is made.
int MakeFromHead(const TemplateArguments& a) {
  if (!a.overrides.empty()) {
    throw InputError(
        "--set is for a configuration; the options of a head are --finest and --tolerance_mm");
  }
  GivenFiles given{.files = a.landmarks, .outputs = kOutputs};
  given.files.push_back(a.input);
  const RunContext context = MakeRunContext(a);
  std::vector<std::string> notes;
  TriMesh mesh = ReadMeshInLps(a.input, notes);
  std::ranges::move(JoinCopies(mesh, a.input.string()), std::back_inserter(notes));
  OuterHead head = PrepareHead(mesh, ReadSkinLandmarks(a.landmarks), a.input.string(), context);
  head.notes.insert(head.notes.begin(), notes.begin(), notes.end());
  std::optional<WholeHeadFit> whole;
  if (a.bust) {
    whole = FitWholeHead(mesh, a.input.string(), context);
  }
  StagedFolder folder = MakeFolder(a, std::move(given));
  const TemplateFit fit = FitTemplate(head, a.fit, context);
  folder.Files().Write("template.json", TemplateJson(fit, head, a.fit));
  folder.Files().Write("template.png", EncodePng(TemplatePicture(fit, head, a.threads)));
  for (const std::string& note : head.notes) {
    Tell("note: {}\n", note);
  }
  Tell("{}", TemplateText(fit, a.fit));
  if (whole) {
    folder.Files().Write("bust.json", WholeHeadToJson(whole->head));
    Tell("bust.json: {} eyes; {:.3f} mm RMS, at most {:.2f} mm, from the mesh\n",
         whole->head.eyeballs.size(), whole->rms_mm, whole->max_mm);
  }
  Write(fit.face, folder);
  const bool bust_usable = !whole || whole->usable;
  return fit.usable && fit.met && fit.folds == 0 && bust_usable ? kDone : kNotUsable;
}

int Template(const TemplateArguments& a) {
  return a.landmarks.empty() ? WriteFromConfig(a) : MakeFromHead(a);
}

void DeclareTemplate(CLI::App& command, CommandLine& line) {
  TemplateArguments& a = *Bind(command, line, &Template);
  command
      .add_option("MESH", a.input,
                  "head (.ply .obj .stl .off), LPS in mm; or, without LANDMARKS, YAML file of an "
                  "experiment, whose template is written")
      ->required();
  command.add_option(
      "LANDMARKS", a.landmarks,
      "points on its skin (.csv: site,x,y,z or i_multipie,x,y,z), or on its skull with "
      "depths (.yaml); one file or more");
  command
      .add_option("--tolerance_mm", a.fit.tolerance_mm,
                  "the fit ends at this root mean square distance from the skin, over the face")
      ->check(Finite())
      ->check(CLI::Range(1e-3, 10.0))
      ->capture_default_str();
  command.add_option("--finest", a.fit.finest, "finest level of the H-spline")
      ->check(CLI::Range(3, 6))
      ->capture_default_str();
  AddSet(command, a);
  command.add_flag("--bust", a.bust,
                   "write bust.json too: the whole head with ears and neck, for `bust: {type: "
                   "hspline, file: bust.json}`; the mesh must be one piece, open only at neck, "
                   "eyes and mouth");
  AddOutput(command, a);
  AddWork(command, line, a);
}

// ---------------------------------------------------------------------------------------------
// recentre
// ---------------------------------------------------------------------------------------------

struct RecentreArguments : WorkOptions {
  std::vector<fs::path> heads;
  RecentreOptions options;
};

Experiment ReadKnown(const fs::path& config, const RecentreArguments& a) {
  auto experiment = ReadConfig<Experiment>(config, a.overrides);
  if (!experiment.tissue.AreMeasured()) {
    throw InputError(
        fmt::format("{}: its depths come from a table; recentring needs measured depths (tissue: "
                    "{{depths: measured}}, or skin)",
                    config.string()));
  }
  return experiment;
}

// The dowels of a head and the scored part of its skin.
KnownHead ReadHead(const fs::path& config, const RecentreArguments& a, const RunContext& context) {
  const Experiment experiment = ReadKnown(config, a);
  const Case subject = MakeCase(LoadSubject(experiment.subject, context), experiment, context);
  if (!subject.skin) {
    throw InputError(
        fmt::format("{}: the head has no skin, which recentring needs", config.string()));
  }
  const ScoredSkin scored = FindScoredSkin(subject, experiment.region);
  std::vector<bool> keep;
  for (const Triangle& t : subject.skin->triangles) {
    keep.push_back(std::ranges::all_of(t, [&](std::int32_t v) { return scored.region.scored[v]; }));
  }
  return {.dowels = subject.dowels_on_bone, .skin = Submesh(*subject.skin, keep)};
}

GivenFiles ListInputs(const RecentreArguments& a) {
  GivenFiles given{.files = a.heads, .outputs = kOutputs};
  for (const fs::path& config : a.heads) {
    std::ranges::copy(InputFiles(ReadKnown(config, a)), std::back_inserter(given.files));
  }
  return given;
}

int RecentreCommand(const RecentreArguments& a) {
  const RunContext context{.on_event = {}, .stop_token = a.stop, .threads = a.threads};
  const Experiment first = ReadKnown(a.heads.front(), a);
  const TemplateFace face = LoadTemplate(first.face_template);
  const FacePrior prior = LoadPrior(first.prior, face);
  const PriorOnTemplate on_template = LayOnTemplate(prior, face, context);
  std::vector<KnownHead> heads;
  for (const fs::path& config : a.heads) {
    heads.push_back(ReadHead(config, a, context));
  }
  StagedFolder folder(a.out, a.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse,
                      ListInputs(a));
  const Recentred result = Recentre(prior, on_template, face, heads, a.options, context);
  Tell(
      "{} heads: sites moved by {:.1f} mm in the median, the mean by {:.2f} mm RMS, at most "
      "{:.2f} mm\n",
      heads.size(), result.sites_moved_mm, result.mean_moved_mm, result.mean_moved_most_mm);
  Write(result.face, folder);
  return kDone;
}

void DeclareRecentre(CLI::App& command, CommandLine& line) {
  RecentreArguments& a = *Bind(command, line, &RecentreCommand);
  a.stop = line.stop;
  command
      .add_option("CONFIG", a.heads,
                  "experiments (.yaml) of heads with skin and measured depths; the first one gives "
                  "template and prior")
      ->required();
  command.add_option("--out", a.out, "folder for the new template")->required();
  command
      .add_option("--site_prior", a.options.site_prior,
                  "weight of the present position of a site, in points")
      ->check(Finite())
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command.add_flag(
      "--mean", a.options.move_mean,
      "move the mean too; the template then contains part of the shape of these skins");
  command.add_option("--mean_prior", a.options.mean_prior, "weight of the present mean, in points")
      ->check(Finite())
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  AddSet(command, a);
  command.add_flag("--force", a.force,
                   "replace files of the same name in a folder that is not empty");
  AddThreads(command, a.threads);
}

}  // namespace

std::span<const ProgramCommand> TemplateCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"template",
                     "make a template, an H-spline face, from a head mesh with landmarks",
                     &DeclareTemplate},
      ProgramCommand{"recentre",
                     "correct the sites of a template, and its mean, by heads with known skin",
                     &DeclareRecentre},
  };
  return kCommands;
}

}  // namespace semblance::problems
