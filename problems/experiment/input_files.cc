// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/input_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <iterator>
#include <memory>
#include <sstream>

#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/extra_dowels.h"
#include "problems/experiment/input_contents.h"
#include "problems/experiment/make_face.h"
#include "problems/face/bust/bust_model.h"
#include "problems/face/edit_script.h"
#include "problems/face/feature_rules.h"
#include "problems/face/hspline_prior.h"
#include "problems/subject/condition_depths.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/network_plan.h"
#include "problems/subject/sites.h"
#include "surfaces/base/csv.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using TextLines = std::vector<std::string>;

void AddNew(const std::string& line, TextLines& lines) {
  if (std::ranges::find(lines, line) == lines.end()) {
    lines.push_back(line);
  }
}

// Adds the lines of an error's message as faults.
void AddFault(const std::exception& error, CheckFindings& findings) {
  std::istringstream words(error.what());
  for (std::string line; std::getline(words, line);) {
    AddNew(line, findings.faults);
  }
}

// Runs a check; its exceptions, except Cancelled, become faults.
void Try(CheckFindings& findings, const std::function<void()>& check) {
  try {
    check();
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    AddFault(error, findings);
  }
}

bool IsPhantom(const Experiment& experiment) {
  return std::holds_alternative<PhantomOptions>(experiment.subject);
}

bool UsesAllLandmarks(const Experiment& experiment) {
  return std::holds_alternative<KeepAll>(experiment.landmarks.keep);
}

// Checks each file by itself, because a loader stops at the first faulty file.
void CheckParts(const FileSubject& subject, CheckFindings& findings) {
  for (const fs::path& mesh : {subject.skull, subject.skin, subject.mandible.mesh}) {
    Try(findings, [&] { mesh.empty() ? MeshFile() : ReadMeshFile(mesh); });
  }
  Try(findings, [&] { ReadLandmarks(subject.landmarks); });
}
void CheckParts(const CtSubject& subject, CheckFindings& findings) {
  Try(findings, [&] { VolumeFiles(subject.volume); });
  Try(findings, [&] { ReadLandmarks(subject.landmarks); });
}
void CheckParts(const PhantomOptions&, CheckFindings&) {}

// The landmarks of the subject without loading its meshes. A phantom has all standard sites.
LandmarkFile ListLandmarks(const Subject& subject) {
  if (const auto* files = std::get_if<FileSubject>(&subject)) {
    return ReadLandmarks(files->landmarks).file;
  }
  if (const auto* ct = std::get_if<CtSubject>(&subject)) {
    return ReadLandmarks(ct->landmarks).file;
  }
  LandmarkFile all;
  for (const std::string& site : StandardSiteCodes()) {
    Landmark& landmark = all.landmarks.emplace_back();
    landmark.site = site;
    landmark.depth_along_normal_mm = 10;  // any depth; only its presence matters
  }
  return all;
}

// Warns of sites of the subject for which the tables have no depth.
void CheckDepthCoverage(const Experiment& experiment, const LandmarkFile& landmarks,
                        CheckFindings& findings) {
  std::vector<Dowel> dowels;
  for (const Landmark& landmark : landmarks.landmarks) {
    dowels.push_back(Dowel{.site = landmark.site});
  }
  TextLines lost;
  const std::vector<Dowel> all = dowels;
  const TissueOptions tissue = WithSiteDepths(experiment, landmarks);
  FillDepths(tissue, landmarks, dowels);
  ConditionDepths(tissue, landmarks, dowels);
  for (const Dowel& dowel : all) {
    if (std::ranges::find(dowels, dowel.site, &Dowel::site) == dowels.end()) {
      lost.push_back(dowel.site);
    }
  }
  if (!lost.empty()) {
    findings.warnings.push_back(
        fmt::format("tissue: no depth for {} of the {} landmarks, which get no dowel: {}; name "
                    "another table in "
                    "fill_from, or depths in set_mm",
                    lost.size(), all.size(), fmt::join(lost, ", ")));
  }
}

// Checks a depth map as far as possible without the skull that it is laid on.
void CheckMap(const DepthMap& map) {
  if (map.file.extension() == ".csv" && map.mesh.empty()) {
    CsvReader(ReadFileBytes(map.file), map.file.string()).RequireColumn(map.scalar);
    return;
  }
  TriMesh point;
  point.points = {Vec3::Zero()};
  const std::vector<Vec3> up = {Vec3::UnitZ()};
  const std::vector<Dowel> dowels = {
      {.site = "n", .base = Vec3::Zero(), .direction = Vec3::UnitZ(), .depth_mm = 1}};
  InterpolateDepth(map, {point, up, dowels, DowelNetwork{}}, {});
}

// The notes of a run on rules that do not apply.
TextLines ExplainUnusedRules(const Experiment& experiment, const Case& subject, StageCache& loaded,
                             const RunContext& context) {
  std::shared_ptr<const LoadedPrior> prior;
  if (UsesPrior(WayToFace(experiment))) {
    prior =
        LoadExperimentPrior(experiment, LoadTemplate(experiment.face_template), loaded, context);
  }
  return ExplainUnusedRules(experiment.rules, subject.points, subject.basis.sites.has_value(),
                            prior ? &prior->face : nullptr);
}

bool NamesAFile(const Experiment& experiment) {
  return !NamedFiles(experiment.face_template).empty() || !NamedFiles(experiment.prior).empty() ||
         !NamedFiles(experiment.bust).empty() || !NamedFiles(experiment.face).empty();
}

}  // namespace

std::vector<NamedFile> NamedInputs(const Experiment& experiment) {
  std::vector<NamedFile> files = NamedFiles(experiment);
  if (TissueTableFiles(experiment.tissue).empty() && !NeedsExpected(WayToDepth(experiment))) {
    std::erase_if(files,
                  [](const NamedFile& named) { return named.option.starts_with("tissue."); });
  }
  return files;
}

std::vector<std::filesystem::path> InputFiles(const Experiment& experiment) {
  std::vector<std::filesystem::path> files;
  for (const NamedFile& named : NamedInputs(experiment)) {
    files.push_back(named.file);
  }
  return files;
}

GivenFiles GivenTo(const Experiment& experiment, const std::filesystem::path& config,
                   std::span<const std::string_view> outputs) {
  GivenFiles given{.files = {config}, .outputs = outputs};
  for (const NamedFile& input : NamedInputs(experiment)) {
    std::ranges::copy(ListParts(input), std::back_inserter(given.files));
  }
  return given;
}

void CheckFindings::Add(const CheckFindings& more) {
  for (const std::string& fault : more.faults) {
    AddNew(fault, faults);
  }
  for (const std::string& warning : more.warnings) {
    AddNew(warning, warnings);
  }
}

const CheckFindings& InputCheck::Once(const std::string& key,
                                      const std::function<void(CheckFindings&)>& check) {
  const auto [at, is_new] = known_.try_emplace(key);
  if (is_new) {
    CheckFindings findings;
    Try(findings, [&] { check(findings); });
    at->second = std::move(findings);
  }
  return at->second;
}

CheckFindings InputCheck::CheckSubjectFiles(const Experiment& experiment) {
  if (IsPhantom(experiment)) {
    return {};
  }
  const std::string key = StageKey("subject", experiment.subject);
  CheckFindings findings = Once(key, [&](CheckFindings& found) {
    try {
      loaded_.Get<SubjectData>(key, [&] { return LoadSubject(experiment.subject, context_); });
    } catch (const Cancelled&) {
      throw;
    } catch (const std::exception& error) {
      AddFault(error, found);
      CheckFindings parts;
      std::visit([&](const auto& subject) { CheckParts(subject, parts); }, experiment.subject);
      found.Add(parts);
    }
  });
  return findings;
}

CheckFindings InputCheck::CheckTissue(const Experiment& experiment) {
  CheckFindings findings;
  for (const fs::path& table : TissueTableFiles(experiment.tissue)) {
    findings.Add(Once("table " + table.string(), [&](CheckFindings& found) {
      found.warnings = TableWarnings(ReadTissueTable(table));
    }));
  }
  const bool measures = experiment.tissue.depths == DepthSource::kSkin ||
                        (IsPhantom(experiment) && experiment.tissue.AreMeasured());
  if (findings.sound() && !measures) {
    const std::string key = StageKey("cover", experiment.tissue, experiment.sites) +
                            (IsPhantom(experiment) ? "" : StageKey("of", experiment.subject));
    findings.Add(Once(key, [&](CheckFindings& found) {
      CheckDepthCoverage(experiment, ListLandmarks(experiment.subject), found);
    }));
  }
  return findings;
}

CheckFindings InputCheck::CheckFace(const Experiment& experiment) {
  CheckFindings findings;
  findings.warnings = UnusedOptions(experiment);
  if (NamesAFile(experiment)) {
    const std::string key = StageKey("face", experiment.face_template, experiment.prior,
                                     experiment.bust, experiment.face);
    findings.Add(Once(key, [&](CheckFindings& found) {
      Try(found, [&] { LoadBust(experiment.bust, experiment.face_template, context_); });
      const TemplateFace generic = LoadTemplate(experiment.face_template);
      LoadExperimentPrior(experiment, generic, loaded_, context_);
      if (const auto* const reference = std::get_if<ReferenceFace>(&experiment.face);
          reference != nullptr && !reference->landmarks.empty()) {
        ReadLandmarks(reference->landmarks);
      }
    }));
  }
  if (const auto* map = std::get_if<DepthMap>(&experiment.interp)) {
    findings.Add(Once(StageKey("map", *map), [&](CheckFindings&) { CheckMap(*map); }));
  }
  if (!experiment.edits.empty()) {
    findings.Add(Once("edits " + experiment.edits.string(),
                      [&](CheckFindings&) { ReadEditScript(experiment.edits); }));
  }
  return findings;
}

CheckFindings InputCheck::CheckCase(const Experiment& experiment) {
  if (IsPhantom(experiment) && UsesAllLandmarks(experiment) && experiment.sites.empty() &&
      experiment.rules.points.empty() && !RequestsRule(experiment.rules)) {
    return {};  // the landmarks of a phantom lie on its bone
  }
  const std::string key =
      StageKey("case", experiment.subject, experiment.landmarks, experiment.tissue,
               experiment.depth_truth, experiment.sites, experiment.network, experiment.rules,
               WayToFace(experiment), experiment.face_template, experiment.prior);
  return Once(key, [&](CheckFindings& found) {
    const auto subject = loaded_.Get<SubjectData>(StageKey("subject", experiment.subject), [&] {
      return LoadSubject(experiment.subject, context_);
    });
    const auto bone = own_.Get<MeshQuery>(StageKey("bone", experiment.subject),
                                          [&] { return MeshQuery(subject->skull); });
    const Case made = MakeCase(*subject, experiment, *bone, {});
    CheckFaceOptions(experiment, made);
    for (const TextLines& notes :
         {made.notes, ExplainUnusedRules(experiment, made, loaded_, context_)}) {
      for (const std::string& note : notes) {
        AddNew(note, found.warnings);
      }
    }
  });
}

CheckFindings InputCheck::Look(const Experiment& experiment) {
  CheckFindings findings;
  findings.Add(Once("network " + experiment.network.string(), [&](CheckFindings&) {
    CheckNetworkNamed(experiment);
    ReadNetworkPlan(experiment.network);
  }));
  findings.Add(CheckSubjectFiles(experiment));
  findings.Add(CheckTissue(experiment));
  findings.Add(CheckFace(experiment));
  if (findings.sound()) {
    findings.Add(CheckCase(experiment));
  }
  return findings;
}

}  // namespace semblance::problems
