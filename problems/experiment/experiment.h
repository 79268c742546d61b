// SPDX-License-Identifier: GPL-3.0-or-later
// One experiment: every choice that leads from a skull to a face, as one struct. Its YAML file
// alone decides the result.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/placement.h"
#include "fitting/problem/seeding.h"
#include "interp/evaluation/depth_direction.h"
#include "interp/evaluation/depth_truth.h"
#include "interp/interpolate_depth.h"
#include "interp/schemes/outside_rule.h"
#include "problems/config/config_tree.h"
#include "problems/experiment/metrics/face_region.h"
#include "problems/experiment/plausibility.h"
#include "problems/face/bust/bust_model.h"
#include "problems/face/face_source.h"
#include "problems/face/feature_rules.h"
#include "problems/face/template_source.h"
#include "problems/io/volumes/import_ct.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/subject/dowel_depths.h"
#include "problems/subject/dowel_placement.h"
#include "problems/subject/extra_sites.h"
#include "problems/subject/landmarks.h"
#include "problems/subject/mandible.h"
#include "problems/subject/mirror.h"
#include "problems/subject/phantom.h"
#include "surfaces/implicit_face.h"
#include "surfaces/mesh/skull_fill.h"

namespace semblance::problems {

// A subject in files of meshes.
struct FileSubject {
  static constexpr std::string_view kName = "files";
  std::filesystem::path skull;
  std::filesystem::path skin;
  std::filesystem::path landmarks;
  std::optional<Axes> axes;  // none: those that each file states, otherwise LPS
  LengthUnit units = LengthUnit::kMillimetre;
  MandibleOptions mandible;
  MirrorOptions mirror;
};
template <class Visitor>
void Fields(Visitor& visit, FileSubject& o) {
  visit(FieldInfo{.name = "skull", .doc = "mesh of the skull: PLY, OBJ, STL or OFF"}, o.skull);
  visit(FieldInfo{.name = "skin",
                  .doc = "mesh of the true skin in the skull's frame; empty if it is not known"},
        o.skin);
  visit(FieldInfo{.name = "landmarks",
                  .doc = "landmarks on the skull: .yaml, or a file of Slicer, MeshLab or "
                         "CloudCompare, or .csv"},
        o.landmarks);
  visit(
      FieldInfo{.name = "axes",
                .doc = "axes of skull and skin (the landmarks' file has its own); LPS: +x subject "
                       "left, +y posterior, +z up; RAS: x and y the other way; null: those that "
                       "the file states as SPACE=RAS or SPACE=LPS, otherwise LPS. All results are "
                       "LPS"},
      o.axes);
  visit(FieldInfo{.name = "units",
                  .doc = "unit of skull and skin (the landmarks' file has its own). All results "
                         "are in mm"},
        o.units);
  visit(FieldInfo{.name = "mandible",
                  .doc = "a mandible that is a mesh of its own; it turns about the condyles"},
        o.mandible);
  visit(FieldInfo{.name = "mirror", .doc = "takes bone that one side lacks from the other side"},
        o.mirror);
}

// A subject in a CT volume: skull and true skin are taken from it.
struct CtSubject {
  static constexpr std::string_view kName = "ct";
  std::filesystem::path volume;
  ReadVolumeOptions read;
  std::filesystem::path landmarks;
  CtImportOptions import;
  MirrorOptions mirror;
};
template <class Visitor>
void Fields(Visitor& visit, CtSubject& o) {
  visit(FieldInfo{.name = "volume",
                  .doc = "head CT: a folder of DICOM files, or NIfTI (.nii, .nii.gz), NRRD (.nrrd, "
                         ".nhdr), MetaImage (.mha, .mhd), InVesalius (.inv3)"},
        o.volume);
  visit(FieldInfo{.name = "series",
                  .doc = "for a DICOM folder: number or UID of the series; needed if the folder "
                         "has several"},
        o.read.series);
  visit(FieldInfo{.name = "fill_slices",
                  .doc = "for a DICOM folder: true interpolates missing slices over up to 10 mm "
                         "and takes the first of repeated slices; false refuses both"},
        o.read.fill_slices);
  visit(FieldInfo{.name = "landmarks",
                  .doc = "landmarks on the skull: .yaml, or a file of Slicer, MeshLab or "
                         "CloudCompare, or .csv"},
        o.landmarks);
  visit(FieldInfo{.name = "import", .doc = "how skull and skin are taken from the volume"},
        o.import);
  visit(FieldInfo{.name = "mirror", .doc = "takes bone that one side lacks from the other side"},
        o.mirror);
}

// Cross-validation of the depths (`semblance depth`, and studies with `job: depth`): dowels are
// left out, and the others predict them. Three schemes leave out a landmark of both sides, a whole
// side, or one of `folds` random parts at a time.
struct CrossValidationOptions {
  int folds = 5;
  std::uint64_t random_seed = 1;
};
template <class Visitor>
void Fields(Visitor& visit, CrossValidationOptions& o) {
  visit(FieldInfo{.name = "folds",
                  .min = 2,
                  .max = 1000,
                  .doc = "number of random parts of the dowels, each left out in turn; at most one "
                         "per dowel"},
        o.folds);
  visit(FieldInfo{.name = "random_seed", .doc = "random seed of the division into parts"},
        o.random_seed);
}

// The same experiment with some other options.
struct Alternative {
  std::string name;
  std::vector<std::string> set;
};
template <class Visitor>
void Fields(Visitor& visit, Alternative& o) {
  visit(FieldInfo{.name = "name",
                  .doc = "name of its folder below the run's and its heading; letters, digits, "
                         "'_', '-' and '+'"},
        o.name);
  visit(FieldInfo{.name = "set",
                  .doc = "the other options, in the form of --set: [\"tissue.build=obese\"], or "
                         "[\"tissue.sds=1\"]; paths are relative to the configuration's folder"},
        o.set);
}

struct UncertaintyOptions {
  bool sigma = true;
  int samples = 0;
  std::uint64_t random_seed = 1;
  double dowel_sd_mm = 0;
  double implicit_sd_mm = 0.5;
  double own = 0.9;
  double shared = 0.9;
  double template_sd_mm = 1;
  double unseen_sd_mm = 4;
  double unseen_reach_mm = 25;
};
template <class Visitor>
void Fields(Visitor& visit, UncertaintyOptions& o) {
  visit(FieldInfo{.name = "sigma",
                  .doc = "whether each vertex of face.ply gets sigma_mm, the standard deviation of "
                         "its position along the normal"},
        o.sigma);
  visit(FieldInfo{.name = "samples",
                  .min = 0,
                  .max = 1000,
                  .doc = "number of faces drawn from the same distribution, sample_0.ply and on; "
                         "only for a fit or a prior's face, not for one that is only placed or "
                         "bent"},
        o.samples);
  visit(FieldInfo{.name = "random_seed", .doc = "random seed of these faces"}, o.random_seed);
  visit(
      FieldInfo{.name = "dowel_sd_mm",
                .unit = "mm",
                .min = 0,
                .max = 50,
                .doc = "for a fit without a prior: standard deviation of the depth of dowels whose "
                       "source states none; 0: measured depths are exact, and those of a table "
                       "have the published deviation of their site (Hona & Stephan 2024)"},
      o.dowel_sd_mm);
  visit(
      FieldInfo{.name = "implicit_sd_mm",
                .unit = "mm",
                .min = 0,
                .max = 50,
                .doc = "for a fit without a prior: standard deviation of the implicit face, and so "
                       "of a seed, even if all depths are right; for a prior's face there is "
                       "face.implicit_spread"},
      o.implicit_sd_mm);
  visit(FieldInfo{.name = "own",
                  .min = 0,
                  .max = 5,
                  .doc = "for a fit without a prior: part of the standard deviation of a table's "
                         "depths by which each depth of a person errs alone; for a prior's face "
                         "there is face.table_depths"},
        o.own);
  visit(FieldInfo{.name = "shared",
                  .min = 0,
                  .max = 5,
                  .doc = "for a fit without a prior: part of it by which all depths of a person "
                         "err together, because a fat face is fat everywhere"},
        o.shared);
  visit(FieldInfo{.name = "template_sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "for a fit without a prior: standard deviation of the person's shape from "
                         "the generic face's, between dowels and seeds; 0 for a phantom, whose "
                         "template is its own"},
        o.template_sd_mm);
  visit(FieldInfo{.name = "unseen_sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "for a fit without a prior: added to it far from every dowel and seed, "
                         "where there is no bone or none was scanned"},
        o.unseen_sd_mm);
  visit(FieldInfo{.name = "unseen_reach_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 500,
                  .doc = "at the distance d from the nearest dowel or seed, unseen_sd_mm sqrt(1 - "
                         "exp(-(d / unseen_reach_mm)^2)) is added"},
        o.unseen_reach_mm);
}

// The (u,v) of dowels that are not at a site of the generic face (AllDowels).
enum class InsertedUv { kRay, kNeighbours };
constexpr auto EnumNames(InsertedUv) {
  return std::to_array<std::string_view>({"ray", "neighbours"});
}

using Subject = std::variant<PhantomOptions, FileSubject, CtSubject>;

// Facts about the case that the report repeats. They change no face.
struct CaseRecord {
  std::string number;
  std::string age;
  std::string notes;
};
template <class Visitor>
void Fields(Visitor& visit, CaseRecord& o) {
  visit(FieldInfo{.name = "number", .doc = "number of the case in its register"}, o.number);
  visit(
      FieldInfo{.name = "age",
                .doc = "age of the person in words, e.g. 35 to 50 years; for a table whose depths "
                       "depend on age, set tissue.given.age_years too"},
      o.age);
  visit(FieldInfo{.name = "notes", .doc = "remarks on the case"}, o.notes);
}

// population for a person's skull, barycentric for a phantom, whose tissue is nobody's.
struct DefaultDepth {
  static constexpr std::string_view kName = "default";
};
template <class Visitor>
void Fields(Visitor&, DefaultDepth&) {}

template <class... Scheme>
std::variant<DefaultDepth, Scheme...> WithDefault(const std::variant<Scheme...>&);
using DepthChoice = decltype(WithDefault(std::declval<DepthScheme>()));

struct Experiment {
  std::string title = "untitled";
  CaseRecord record;
  Subject subject;
  PlaceOptions landmarks;
  TissueOptions tissue;
  ExtraSites sites;
  std::filesystem::path network;
  DepthChoice interp;
  OutsideRule outside;
  SkullFill fill;
  ImplicitFaceOptions implicit;
  TemplateSource face_template = IctTemplate{};  // the option `template`
  PlacementOptions placement;
  InsertedUv inserted_uv = InsertedUv::kRay;
  PriorSource prior = IctPrior{};
  FaceSource face;
  BustSource bust;
  std::vector<Alternative> alternatives;
  bool report = true;
  FeatureRules rules;
  std::vector<ScheduleStep> first_fit = {{.level = 0, .fraction = 1}};
  SeedSource seeds =
      SeedOptions{.weight = 0.1};  // seeds are many, and must not outweigh the dowels
  double cut_margin_mm = 5;
  int rounds = 1;
  FitOptions fit = {.relaxation = FootpointRelaxation{}};
  std::filesystem::path edits;
  UncertaintyOptions uncertainty;
  FaceRegionOptions region;
  PlausibilityLimits plausibility;
  DepthDirection direction;
  DepthTruthOptions depth_truth;
  CrossValidationOptions cross_validation;
};
template <class Visitor>
void Fields(Visitor& visit, Experiment& o) {
  visit(FieldInfo{.name = "title", .doc = "title of the report"}, o.title);
  visit(FieldInfo{.name = "record", .doc = "facts about the case; the report repeats them"},
        o.record);
  visit(FieldInfo{.name = "subject", .doc = "whose skull, and the true face where it is known"},
        o.subject);
  visit(FieldInfo{.name = "landmarks", .doc = "how landmarks are laid onto bone"}, o.landmarks);
  visit(FieldInfo{.name = "tissue", .doc = "where the dowels' depths come from"}, o.tissue);
  visit(FieldInfo{.name = "sites",
                  .doc = "by name: dowels in addition to the landmarks', and (u,v) of sites on the "
                         "generic face, e.g. {my_site: {near: [n, rhi], depth: 4.5}, n: {uv: [0.5, "
                         "0.6], hold: true}}"},
        o.sites);
  visit(FieldInfo{.name = "network",
                  .doc = "YAML file of the dowel network: which dowels share an area"},
        o.network);
  visit(FieldInfo{.name = "interp",
                  .doc = "how depth is interpolated between the dowels; default: population for a "
                         "person's skull, barycentric for a phantom"},
        o.interp);
  visit(FieldInfo{.name = "outside",
                  .doc = "depth of bone outside the network or turned away from it"},
        o.outside);
  visit(FieldInfo{.name = "fill", .doc = "how temples, orbits and gaps are bridged"}, o.fill);
  visit(FieldInfo{.name = "implicit", .doc = "the implicit surface and its polygons"}, o.implicit);
  visit(FieldInfo{.name = "template",
                  .doc = "the generic face; ict: the mean of the ICT-FaceKit model, which the "
                         "program carries; formula: a head by formula, the phantoms' own; file: "
                         "from files"},
        o.face_template);
  visit(FieldInfo{.name = "placement", .doc = "how the generic face is brought to the dowels"},
        o.placement);
  visit(FieldInfo{.name = "inserted_uv",
                  .doc = "(u,v) of a dowel at a site that the generic face lacks; ray: where the "
                         "dowel meets the placed face; neighbours: interpolated from the three "
                         "dowels of its area, as its depth would be (thesis 4.2); outside the "
                         "network as ray"},
        o.inserted_uv);
  visit(FieldInfo{.name = "prior",
                  .doc = "a statistical model of faces: mean and modes on one mesh; `template` is "
                         "then the H-spline of its mean; ict is the one of `template: ict`"},
        o.prior);
  visit(FieldInfo{.name = "face",
                  .doc = "the method; auto: joint if there is a prior of the "
                         "template (prior_then_fit for a plan without steps), else fit; placed: "
                         "the template, brought to the dowels; "
                         "thin_plate: the template, bent to their tips; springs: the template as a "
                         "net of springs, held at the depth; fit: the template, fitted "
                         "to tips and implicit face level by level; prior: the most likely face of "
                         "the prior, given tips and implicit face; prior_then_fit: that face as "
                         "the template of the fit; joint: each step of the schedule solves for "
                         "control vertices, coefficients of the prior and pose in one problem"},
        o.face);
  visit(FieldInfo{.name = "bust",
                  .doc = "the head, with ears, neck and eyes, into which the face is put for "
                         "display; auto: ict if the template is ict, else none; ict: the head of "
                         "the ICT-FaceKit model; hspline: the template's own head; mesh: any head. "
                         "Nothing is measured on it"},
        o.bust);
  visit(FieldInfo{.name = "alternatives",
                  .doc = "the same skull with other options, each in a folder of its own below the "
                         "run's, and side by side in the report, e.g. [{name: obese, set: "
                         "[\"tissue.build=obese\"]}]"},
        o.alternatives);
  visit(FieldInfo{.name = "report",
                  .doc = "write report.html, its pictures and its 3-D view; false: half of the "
                         "time of a small head, and the other files are the same"},
        o.report);
  visit(FieldInfo{.name = "rules",
                  .doc = "rules of the literature for eyes, mouth and nose, as observations for a "
                         "face that uses the prior; each is on if its points are given"},
        o.rules);
  visit(FieldInfo{.name = "first_fit",
                  .doc = "steps of a fit to the dowels alone, before seeds are taken; may be "
                         "empty"},
        o.first_fit);
  visit(FieldInfo{.name = "seeds",
                  .doc = "extra dowels on the implicit face; patches: one at the centre of each "
                         "patch of a level; none: the fit has the dowels alone (thesis 4.2, figure "
                         "4.3)"},
        o.seeds);
  visit(FieldInfo{.name = "cut_margin_mm",
                  .unit = "mm",
                  .min = -50,
                  .max = 100,
                  .doc = "no seed lies nearer than this to a plane at which the scan ends; beyond "
                         "the plane the face follows the template"},
        o.cut_margin_mm);
  visit(FieldInfo{.name = "rounds",
                  .min = 1,
                  .max = 20,
                  .doc = "number of rounds; each takes new seeds and runs the schedule"},
        o.rounds);
  visit(FieldInfo{.name = "fit", .doc = "the level-by-level fit"}, o.fit);
  visit(FieldInfo{.name = "edits",
                  .doc = "edit script (.yaml, in the form of `semblance edit`) that is replayed on "
                         "the resulting face; empty: the face is not edited"},
        o.edits);
  visit(FieldInfo{.name = "uncertainty", .doc = "uncertainty of the face and its sources"},
        o.uncertainty);
  visit(FieldInfo{.name = "region", .doc = "which part of the true skin is scored"}, o.region);
  visit(FieldInfo{.name = "plausibility",
                  .doc = "limits beyond which a face is not usable (exit code 1)"},
        o.plausibility);
  visit(FieldInfo{.name = "direction",
                  .doc = "direction of a depth where it is compared with the true one; the depth "
                         "ends at p + depth * direction"},
        o.direction);
  visit(FieldInfo{.name = "depth_truth", .doc = "what counts as a true depth"}, o.depth_truth);
  visit(FieldInfo{.name = "cross_validation",
                  .doc = "how dowels are left out, in `semblance depth` and studies of depth"},
        o.cross_validation);
}

// experiment.face, with `auto` resolved. Never AutoFace.
FaceSource WayToFace(const Experiment& experiment);

// experiment.interp, with `default` resolved.
DepthScheme WayToDepth(const Experiment& experiment);

// Options that are valid each by itself but not together, e.g. a step of the schedule at a level
// that the generic face does not have. Reading a configuration reports them with the other faults.
std::vector<OptionFault> FaultsBetween(const Experiment& experiment);

// The options of first_fit, seeds, rounds and fit that are set but not used by the way to the face
// or by the fit, one line each. They are no faults, because a study may compare ways that share
// them.
std::vector<std::string> UnusedOptions(const Experiment& experiment);

}  // namespace semblance::problems
