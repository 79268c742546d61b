// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/case.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "problems/experiment/extra_dowels.h"
#include "problems/experiment/limit_depths.h"
#include "problems/experiment/skin_depths.h"
#include "problems/subject/condition_depths.h"
#include "problems/subject/head_planes.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/network_plan.h"
#include "problems/subject/phantom.h"
#include "problems/subject/sites.h"
#include "surfaces/mesh/join_copies.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

template <class Item>
void Append(std::vector<Item>& items, const std::vector<Item>& more) {
  items.insert(items.end(), more.begin(), more.end());
}

TriMesh ReadHeadMesh(const FileSubject& options, const std::filesystem::path& path,
                     const char* option, SubjectData& subject) {
  if (path.empty()) {
    throw InputError(fmt::format(
        "subject.{}: no file is named; give the path of a mesh (PLY, OBJ, STL or OFF)", option));
  }
  TriMesh mesh = ReadSubjectMesh(options, path, subject.notes);
  Append(subject.notes, JoinCopies(mesh, path.filename().string()));
  Append(subject.notes, CheckHeadMesh(mesh, path.filename().string()));
  subject.inputs.push_back(path);
  return mesh;
}

LandmarkFile ReadSubjectLandmarks(const std::filesystem::path& path, Landmarking landmarking,
                                  SubjectData& subject) {
  if (path.empty() && landmarking == Landmarking::kOpen) {
    return {};
  }
  if (path.empty()) {
    throw InputError(
        "subject.landmarks: no file is named; a skull needs landmarks (configs/landmarks/ shows "
        "the form)");
  }
  subject.inputs.push_back(path);
  LandmarkReading reading = ReadLandmarks(path);
  Append(subject.notes, reading.notes);
  return std::move(reading.file);
}

// Each Load fills subject.skull, skin, inputs and notes, and returns the landmarks.
LandmarkFile Load(const PhantomOptions& options, Landmarking, SubjectData& subject,
                  const RunContext&) {
  Phantom phantom = MakePhantom(options);
  subject.skull = std::move(phantom.skull);
  subject.skin = std::move(phantom.face);
  return PhantomLandmarks(phantom.sites, options.random_seed);
}

void Mirror(const MirrorOptions& options, LandmarkFile& landmarks, SubjectData& subject,
            const RunContext& context) {
  Append(subject.notes,
         PrepareMirrored(options, subject.skull, subject.origin, landmarks, context.threads));
}

LandmarkFile Load(const FileSubject& options, Landmarking landmarking, SubjectData& subject,
                  const RunContext& context) {
  LandmarkFile landmarks = ReadSubjectLandmarks(options.landmarks, landmarking, subject);
  subject.skull = ReadHeadMesh(options, options.skull, "skull", subject);
  if (!options.skin.empty()) {
    subject.skin = ReadHeadMesh(options, options.skin, "skin", subject);
  }
  if (!options.mandible.mesh.empty()) {
    TriMesh mandible = ReadHeadMesh(options, options.mandible.mesh, "mandible.mesh", subject);
    Append(subject.notes,
           AddMandible(options.mandible, std::move(mandible), subject.skull, landmarks));
  }
  Mirror(options.mirror, landmarks, subject, context);
  return landmarks;
}

LandmarkFile Load(const CtSubject& options, Landmarking landmarking, SubjectData& subject,
                  const RunContext& context) {
  if (options.volume.empty()) {
    throw InputError(
        "subject.volume: no file is named; give a folder of DICOM files, or a volume as .nii, "
        ".nrrd, .mha or .inv3");
  }
  LandmarkFile landmarks = ReadSubjectLandmarks(options.landmarks, landmarking, subject);
  const VolumeReading reading = ReadVolume(options.volume, options.read, context);
  if (reading.modality == Modality::kMr) {
    throw InputError(fmt::format(
        "{}: an MR shows no bone (it is as dark as air), and a run needs a skull: take it from a "
        "CT of the same head; `semblance import-ct` makes the skin of an MR, which may stand under "
        "subject: {{type: files, skin: ...}}",
        options.volume.string()));
  }
  Append(subject.notes, reading.notes);
  Append(subject.inputs, VolumeFiles(options.volume));
  CtImport import = ImportCt(reading.volume, options.import, context);
  subject.skull = std::move(import.skull);
  subject.skin = std::move(import.skin);
  Append(subject.notes, import.notes);
  subject.voxel_mm = std::max({reading.volume.spacing_mm.maxCoeff(),
                               options.import.coarsen.pixel_mm, options.import.coarsen.slice_mm});
  Mirror(options.mirror, landmarks, subject, context);
  for (const HeadPlane& plane : HeadPlanes(landmarks.Points())) {
    constexpr double kPixel_mm = 0.75;
    subject.slices.push_back(SampleSlice(reading.volume, plane.plane, plane.name, kPixel_mm));
  }
  return landmarks;
}

// Adds one note for all dropped areas, with the sites that they lack.
void NoteDroppedAreas(Case& subject) {
  const DowelNetwork& network = subject.network;
  if (!network.dropped.empty()) {
    subject.notes.push_back(fmt::format(
        "dowel network: {} of {} areas dropped, as there is no dowel at {}", network.dropped.size(),
        network.dropped.size() + network.areas.size(), fmt::join(network.missing_sites, ", ")));
  }
}

// The dowels at their landmarks as given, before these were laid onto bone. So a skin is scored in
// the same way with and without its skull.
std::vector<Dowel> DowelsAsGiven(const Case& subject, std::vector<Dowel> dowels) {
  for (Dowel& dowel : dowels) {
    dowel.base = subject.points.at(dowel.site);
  }
  return dowels;
}

// Compares skull, landmarks and skin with each other.
std::vector<std::string> CheckLandmarks(const SubjectData& data, const MeshQuery& skull,
                                        const PlaceOptions& options) {
  InputMistakes found = FindLandmarkMistakes(data.landmarks, data.skull, skull, options);
  if (data.skin) {
    InputMistakes of_skin = FindSkinMistakes({.skin = *data.skin,
                                              .skull = &skull,
                                              .extent = Bounds(data.skull),
                                              .landmarks = data.landmarks,
                                              .landmarks_fit = found.errors.empty()});
    Append(found.errors, of_skin.errors);
    Append(found.notes, of_skin.notes);
  }
  if (!found.errors.empty()) {
    throw InputError(fmt::format("{}", fmt::join(found.errors, "\n")));
  }
  return found.notes;
}

// The source of the expected depths, if the scheme needs them.
std::optional<TissueOptions> ExpectedTissue(const Experiment& experiment) {
  if (!NeedsExpected(WayToDepth(experiment))) {
    return std::nullopt;
  }
  TissueOptions table = experiment.tissue;
  table.depths = DepthSource::kTable;
  table.set_mm.clear();
  table.given = {};
  return table;
}

// The table's mean depths at all dowels for which it has one, measured or not.
std::vector<Dowel> ExpectedDowels(const Experiment& experiment, const LandmarkFile& landmarks,
                                  std::vector<Dowel> dowels) {
  const std::optional<TissueOptions> table = ExpectedTissue(experiment);
  if (!table) {
    return {};
  }
  FillDepths(*table, landmarks, dowels);
  return dowels;
}

bool UsesAllAsGiven(const PlaceOptions& options) {
  return std::holds_alternative<KeepAll>(options.keep) && options.noise_mm == 0;
}

// The network's plan without the landmarks that the experiment does not use. The gaps are closed.
NetworkPlan PlanFor(const Experiment& experiment, const LandmarkFile& landmarks, NetworkPlan plan) {
  if (std::holds_alternative<KeepAll>(experiment.landmarks.keep)) {
    return plan;
  }
  std::map<std::string, Vec3> points;
  std::vector<std::string> sites;
  std::vector<Vec3> at;
  for (const Landmark& landmark : landmarks.landmarks) {
    sites.push_back(landmark.site);
    at.push_back(landmark.Position());
    points[landmark.site] = at.back();
  }
  const std::vector<bool> kept = KeptSites(experiment.landmarks.keep, sites, at);
  std::set<std::string> gone;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    if (!kept[k]) {
      gone.insert(sites[k]);
    }
  }
  return WithoutSites(std::move(plan), gone, points);
}

// The subject with dowels on bone that have no depth yet.
Case StartCase(const SubjectData& data, const Experiment& experiment, const MeshQuery& query) {
  const bool measured = !std::holds_alternative<PhantomOptions>(experiment.subject);
  Case subject{.name = data.landmarks.subject,
               .skull = data.skull,
               .origin = data.origin,
               .skin = data.skin,
               .dowels_on_bone = {},
               .open_dowels = {},
               .expected_on_bone = {},
               .network = {},
               .scored_on_bone = {},
               .scored_network = {},
               .turns_deg = {},
               .points = {},
               .basis = {},
               .bounds = StartEffects(experiment.tissue.bounds),
               .slices = data.slices,
               .notes = data.notes,
               .inputs = data.inputs};
  if (measured) {
    Append(subject.notes, CheckLandmarks(data, query, experiment.landmarks));
  }
  subject.dowels_on_bone = PlaceDowels(data.landmarks, data.skull, query, experiment.landmarks);
  subject.turns_deg = TurnsOfDowels(data.landmarks, data.skull, query, experiment.landmarks);
  for (const auto& [site, turn_deg] : subject.turns_deg) {
    if (turn_deg > kMaxTurn_deg) {
      subject.notes.push_back(
          fmt::format("site {}: its proposed direction is {:.0f} degrees off the bone nearest to "
                      "it, which may be an inner wall; look at this landmark",
                      DescribeSite(site), turn_deg));
    }
  }
  for (const Landmark& landmark : data.landmarks.landmarks) {
    subject.points[landmark.site] = landmark.Position();
  }
  return subject;
}

// Keeps the dowels of the landmarks that the experiment uses, with noise if it wants some, and
// gives them their depths. All dowels, before some are left out, decide what is scored.
void GiveDepths(const SubjectData& data, const Experiment& experiment, const MeshQuery& query,
                Case& subject) {
  const TissueOptions tissue = WithSiteDepths(experiment, data.landmarks);
  std::vector<Dowel> all = subject.dowels_on_bone;
  if (!UsesAllAsGiven(experiment.landmarks)) {
    const UsedLandmarks used = LandmarksInUse(data.landmarks, query, experiment.landmarks);
    subject.dowels_on_bone = PlaceDowels(used.file, data.skull, query, experiment.landmarks);
    Append(subject.notes, used.notes);
  }
  Append(subject.notes, FillDepths(tissue, data.landmarks, all, subject.dowels_on_bone));
  const TriMesh* const skin = data.skin ? &*data.skin : nullptr;
  Append(subject.notes, TurnToSkin({.landmarks = data.landmarks,
                                    .skin = skin,
                                    .bone = data.skull,
                                    .skull = query,
                                    .noise_mm = experiment.landmarks.noise_mm},
                                   all, subject.dowels_on_bone));
  subject.basis = MakeScoreBasis(DowelsAsGiven(subject, all));
  subject.scored_on_bone = std::move(all);
  Append(subject.notes, ConditionDepths(tissue, data.landmarks, subject.dowels_on_bone));
}

void LayNetwork(const NetworkPlan& plan, Case& subject) {
  subject.network = BuildNetwork(plan, subject.dowels_on_bone);
  if (subject.network.areas.empty()) {
    throw InputError(fmt::format(
        "{}: no area of the dowel network has all its three dowels; more landmarks are needed",
        subject.name));
  }
  NoteDroppedAreas(subject);
  Append(subject.notes, JoinNetwork(plan, subject.dowels_on_bone, subject.network));
}

// The scored network uses all landmarks as given, and the standard sites that the experiment
// inserts in place of a landmark. So the same bone is compared if dowels are left out, moved or
// added.
void LayScoredNetwork(const NetworkPlan& plan, Case& subject) {
  for (const Dowel& dowel : subject.dowels_on_bone) {
    auto& scored = subject.scored_on_bone;
    const bool there = std::ranges::find(scored, dowel.site, &Dowel::site) != scored.end();
    if (!there && IsStandardSite(dowel.site)) {
      scored.push_back(dowel);
    }
  }
  subject.scored_network = BuildNetwork(plan, subject.scored_on_bone);
}

// A prior's most likely face has its own places for the sites. No fit moves them.
void AddUnusedUv(const Experiment& experiment, const Case& subject,
                 std::vector<std::string>& mistakes) {
  if (!std::holds_alternative<PriorFace>(WayToFace(experiment))) {
    return;
  }
  for (const auto& [name, site] : experiment.sites) {
    if (site.uv && subject.points.contains(name)) {
      mistakes.push_back(
          fmt::format("sites.{0}.uv: `face: prior` has its own place for the landmark {0} and does "
                      "not use this "
                      "one; leave it out, or write `face: prior_then_fit` and `hold: true`",
                      name));
    }
  }
}

void AppendInputs(const Experiment& experiment, Case& subject) {
  subject.inputs.push_back(experiment.network);
  Append(subject.inputs, TissueTableFiles(ExpectedTissue(experiment).value_or(experiment.tissue)));
  if (IsConditioned(experiment.tissue) && !experiment.tissue.given.spread.empty()) {
    subject.inputs.push_back(experiment.tissue.given.spread);
  }
  if (const auto* map = std::get_if<DepthMap>(&experiment.interp)) {
    subject.inputs.push_back(map->file);
    subject.inputs.push_back(map->mesh);
    std::erase(subject.inputs, std::filesystem::path());
  }
}

}  // namespace

void CheckNetworkNamed(const Experiment& experiment, const std::filesystem::path& config) {
  if (experiment.network.empty()) {
    throw InputError(fmt::format(
        "{}network: no file is named; give the path of a dowel network (configs/networks/ has the "
        "standard one)",
        config.empty() ? "" : config.string() + ": "));
  }
}

TriMesh ReadSubjectMesh(const FileSubject& subject, const std::filesystem::path& path,
                        std::vector<std::string>& notes) {
  MeshFile file = ReadMeshFile(path);
  const bool states_ras = file.axes == MeshAxes::kRas;
  const Axes axes = subject.axes.value_or(states_ras ? Axes::kRas : Axes::kLps);
  if (file.axes != MeshAxes::kUnstated && states_ras != (axes == Axes::kRas)) {
    throw InputError(fmt::format(
        "{}: the file states SPACE={}, and subject.axes is {}; leave subject.axes out, or correct "
        "the one that is wrong",
        path.string(), states_ras ? "RAS" : "LPS", states_ras ? "LPS" : "RAS"));
  }
  if (states_ras && !subject.axes) {
    notes.push_back(fmt::format("{}: the file states SPACE=RAS; turned to LPS (x and y negated)",
                                path.filename().string()));
  }
  for (Vec3& p : file.mesh.points) {
    p = ToLpsMm(p, axes, subject.units);
  }
  return std::move(file.mesh);
}

SubjectData LoadSubject(const Subject& subject, const RunContext& context,
                        Landmarking landmarking) {
  SubjectData data;
  data.landmarks = std::visit(
      [&](const auto& options) { return Load(options, landmarking, data, context); }, subject);
  return data;
}

std::vector<std::string> CheckSubject(const SubjectData& subject, const PlaceOptions& options) {
  return CheckLandmarks(subject, MeshQuery(subject.skull), options);
}

Case MakeCase(const SubjectData& data, const Experiment& experiment, const RunContext& context) {
  return MakeCase(data, experiment, MeshQuery(data.skull), context);
}

namespace {

// The case of a subject whose landmarks hold the depths that the experiment needs.
Case CaseOf(const SubjectData& data, const Experiment& experiment, const MeshQuery& query,
            const RunContext& context) {
  Case subject = StartCase(data, experiment, query);
  subject.expected_on_bone = ExpectedDowels(experiment, data.landmarks, subject.dowels_on_bone);
  GiveDepths(data, experiment, query, subject);
  InsertDowels(experiment, data, query, subject);
  InsertCarriedDowels(experiment, data, query, context, subject);
  LimitDowels(experiment, data.landmarks, subject);
  const NetworkPlan plan = ReadNetworkPlan(experiment.network);
  Append(subject.notes,
         CheckNetworkSites(plan, experiment.network, data.landmarks.landmarks, experiment.sites));
  LayNetwork(PlanFor(experiment, data.landmarks, plan), subject);
  LayScoredNetwork(plan, subject);
  AppendInputs(experiment, subject);
  return subject;
}

}  // namespace

Case MakeCase(const SubjectData& data, const Experiment& experiment, const MeshQuery& query,
              const RunContext& context) {
  CheckNetworkNamed(experiment);
  if (experiment.tissue.depths != DepthSource::kSkin) {
    return CaseOf(data, experiment, query, context);
  }
  SubjectData measured = data;
  Append(measured.notes, MeasureOnSkin(experiment, query, context, measured));
  return CaseOf(measured, experiment, query, context);
}

void CheckFaceOptions(const Experiment& experiment, const Case& subject) {
  std::vector<std::string> mistakes;
  AddUnusedUv(experiment, subject, mistakes);
  if (!experiment.rules.points.empty()) {
    const auto& pose = subject.basis.sites;
    Append(mistakes,
           CheckRulePoints(experiment.rules, MeshQuery(subject.skull),
                           pose ? &pose->skull_from_average : nullptr, experiment.landmarks));
  }
  if (!mistakes.empty()) {
    throw InputError(fmt::format("{}", fmt::join(mistakes, "\n")));
  }
}

ScoredSkin FindScoredSkin(const Case& subject, const FaceRegionOptions& options) {
  return FindScoredSkin(subject, FindOuterSkin(*subject.skin, options.probe_mm), options);
}

ScoredSkin FindScoredSkin(const Case& subject, const OuterSkin& outer,
                          const FaceRegionOptions& options) {
  return FindScoredSkin(*subject.skin, outer, *subject.basis.sites, subject.scored_on_bone,
                        subject.scored_network, options);
}

}  // namespace semblance::problems
