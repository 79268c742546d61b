// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/evaluate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/run.h"
#include "problems/subject/input_mistakes.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/join_copies.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh/refine_mesh.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

using Notes = std::vector<std::string>;

// Throws the errors, and keeps the notes.
void Accept(const InputMistakes& found, Notes& notes) {
  if (!found.errors.empty()) {
    throw InputError(fmt::format("evaluate: {}", fmt::join(found.errors, "\n")));
  }
  notes.insert(notes.end(), found.notes.begin(), found.notes.end());
}

// Checks that the landmarks, which lie on bone, are covered by the skin.
void CheckSkin(const SkinInputs& inputs, Notes& notes) { Accept(FindSkinMistakes(inputs), notes); }

LandmarkFile AsLandmarks(const std::map<std::string, Vec3>& points) {
  LandmarkFile file;
  for (const auto& [site, point] : points) {
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = site;
    landmark.MoveTo(point);
  }
  return file;
}

TriMesh ReadChecked(const std::filesystem::path& path, Notes& notes) {
  TriMesh mesh = ReadMeshInLps(path, notes);
  std::ranges::move(JoinCopies(mesh, path.filename().string()), std::back_inserter(notes));
  CheckHeadMesh(mesh, path.string());
  return mesh;
}

TriMesh ReadFace(const std::filesystem::path& path, Notes& notes) {
  return path.extension() == ".json" ? Tessellate(ReadHSpline(path), kFaceQuadsPerPatch).mesh
                                     : ReadChecked(path, notes);
}

// A true skin, with its scored region and the basis of the scores.
struct Truth {
  TriMesh skin;
  ScoredSkin scored;
  ScoreBasis basis;
};

Truth ReadTruthOfExperiment(const EvaluateOptions& options, const RunContext& context,
                            Notes& notes) {
  const auto experiment = ReadConfig<Experiment>(options.config, options.overrides);
  CheckNetworkNamed(experiment, options.config);
  Case subject = MakeCase(LoadSubject(experiment.subject, context), experiment, context);
  notes.insert(notes.end(), subject.notes.begin(), subject.notes.end());
  if (!options.truth.empty()) {
    subject.skin = ReadChecked(options.truth, notes);
    CheckSkin({.skin = *subject.skin, .landmarks = AsLandmarks(subject.points)}, notes);
  }
  if (!subject.skin) {
    throw InputError(
        fmt::format("{}: its subject has no skin to compare with; name the mesh of "
                    "the true skin after the face",
                    options.config.string()));
  }
  ScoredSkin scored = FindScoredSkin(subject, experiment.region);
  return {std::move(*subject.skin), std::move(scored), std::move(subject.basis)};
}

std::vector<Dowel> MakeDowels(const LandmarkFile& file) {
  std::vector<Dowel> dowels;
  for (const Landmark& landmark : file.landmarks) {
    const auto& n = landmark.normal;
    dowels.push_back({.site = landmark.site,
                      .base = landmark.Position(),
                      .direction = n ? Vec3(Vec3(n->data()).normalized()) : Vec3::Constant(kNaN)});
  }
  return dowels;
}

Truth ReadTruthFiles(const EvaluateOptions& options, Notes& notes) {
  if (options.truth.empty()) {
    throw InputError(
        "evaluate: there is nothing to compare the face with; name the mesh of the true skin after "
        "the face, or an experiment with --config");
  }
  if (!options.overrides.empty()) {
    throw InputError("evaluate: --set changes a configuration; name it with --config");
  }
  Truth truth{.skin = ReadChecked(options.truth, notes), .scored = {}, .basis = {}};
  if (options.landmarks.empty()) {
    if (!options.exclude.empty()) {
      throw InputError("evaluate: --exclude names sites; give the landmarks with --landmarks");
    }
    truth.scored = AllScored(truth.skin);
    return truth;
  }
  const LandmarkReading reading = ReadLandmarks(options.landmarks);
  notes.insert(notes.end(), reading.notes.begin(), reading.notes.end());
  truth.basis = MakeScoreBasis(MakeDowels(reading.file));
  if (!truth.basis.sites) {
    throw InputError(fmt::format("{}: fewer than three landmarks do not locate the face; add some",
                                 options.landmarks.string()));
  }
  CheckSkin({.skin = truth.skin, .landmarks = reading.file}, notes);
  truth.scored =
      FindScoredSkin(truth.skin, *truth.basis.sites, {}, {}, {.exclude = options.exclude});
  return truth;
}

}  // namespace

nlohmann::ordered_json Evaluate(const EvaluateOptions& options, const RunContext& context,
                                std::vector<std::string>& notes) {
  if (!options.config.empty() && !(options.landmarks.empty() && options.exclude.empty())) {
    throw InputError(
        "evaluate: the configuration names landmarks and zones; leave --landmarks and --exclude "
        "out, or change it with --set");
  }
  const TriMesh face = RefineTo(ReadFace(options.face, notes), kEdgeForSums_mm);  // as in a run
  const Truth truth = options.config.empty() ? ReadTruthFiles(options, notes)
                                             : ReadTruthOfExperiment(options, context, notes);
  Accept(FindFaceMistakes(face, truth.skin), notes);
  return ScoreToJson(CompareFaces(truth.skin, truth.scored.region, face, context),
                     MeasureDetails(truth.skin, truth.scored, truth.basis, face, context),
                     truth.scored);
}

ExcludedZone ParseZone(const std::string& text) {
  const std::size_t equals = std::min(text.find('='), text.size());
  const std::string radius = text.substr(std::min(equals + 1, text.size()));
  ExcludedZone zone{.site = text.substr(0, equals)};
  const char* const end = radius.data() + radius.size();
  const auto [rest, fault] = std::from_chars(radius.data(), end, zone.radius_mm);
  if (fault != std::errc() || rest != end || !(zone.radius_mm > 0 && zone.radius_mm <= 200)) {
    throw InputError(
        fmt::format("--exclude {}: write a site and a radius of 0 to 200 mm, e.g. zy_r=15", text));
  }
  if (const std::string complaint = StandardSiteFault(zone.site); !complaint.empty()) {
    throw InputError(fmt::format("--exclude {}: {}", text, complaint));
  }
  return zone;
}

}  // namespace semblance::problems
