// SPDX-License-Identifier: GPL-3.0-or-later
// One experiment: every choice that leads from a skull to a face, as one struct. What its YAML file
// says, and nothing else, decides the result.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/placement.h"
#include "fitting/problem/seeding.h"
#include "interp/evaluation/depth_direction.h"
#include "interp/evaluation/depth_truth.h"
#include "interp/interpolate_depth.h"
#include "interp/schemes/outside_rule.h"
#include "problems/bust/bust_source.h"
#include "problems/config/config_errors.h"
#include "problems/ct/import_ct.h"
#include "problems/face_template/template_source.h"
#include "problems/metrics/face_region.h"
#include "problems/pipeline/uncertainty_options.h"
#include "problems/preparation/mirror.h"
#include "problems/prior/face_source.h"
#include "problems/prior/feature_rules.h"
#include "problems/subject/dowel_depths.h"
#include "problems/subject/dowel_placement.h"
#include "problems/subject/extra_sites.h"
#include "problems/subject/landmarks.h"
#include "problems/subject/mandible.h"
#include "problems/subject/phantom.h"
#include "problems/volumes/read_volume.h"
#include "surfaces/implicit_face.h"
#include "surfaces/mesh/skull_fill.h"

namespace semblance {

// A subject in files of meshes.
struct FileSubject {
  static constexpr std::string_view kName = "files";
  std::filesystem::path skull;                 // mesh
  std::filesystem::path skin;                  // the true one; empty where not known
  std::filesystem::path landmarks;             // on the skull
  Axes axes = Axes::kLps;                      // of skull and skin
  LengthUnit units = LengthUnit::kMillimetre;  // of skull and skin
  MandibleOptions mandible;                    // where it is a mesh of its own
  MirrorOptions mirror;                        // what one side lacks
};
template <class Visitor>
void Fields(Visitor& visit, FileSubject& o) {
  visit(FieldInfo{.name = "skull", .doc = "mesh of the skull: PLY, OBJ, STL or OFF"}, o.skull);
  visit(FieldInfo{.name = "skin",
                  .doc = "mesh of the true skin in the skull's frame; empty where it is not known"},
        o.skin);
  visit(FieldInfo{.name = "landmarks",
                  .doc = "landmarks on the skull: .yaml, or a file of Slicer, MeshLab or "
                         "CloudCompare, or .csv"},
        o.landmarks);
  visit(
      FieldInfo{.name = "axes",
                .doc = "of skull and skin (the landmarks' file has its own); LPS: +x subject left, "
                       "+y posterior, +z up; RAS: x and y the other way. All results are LPS"},
      o.axes);
  visit(FieldInfo{.name = "units",
                  .doc =
                      "of skull and skin (the landmarks' file has its own). All results are in mm"},
        o.units);
  visit(FieldInfo{.name = "mandible",
                  .doc = "where the mandible is a mesh of its own: it turns about the condyles"},
        o.mandible);
  visit(FieldInfo{.name = "mirror", .doc = "bone that one side lacks, from the other"}, o.mirror);
}

// A subject in a CT volume: skull and true skin are taken from it.
struct CtSubject {
  static constexpr std::string_view kName = "ct";
  std::filesystem::path volume;     // folder of DICOM files, or a file
  ReadVolumeOptions read;           // which series, missing slices
  std::filesystem::path landmarks;  // on the skull
  CtImportOptions import;           // thresholds of skull and skin
  MirrorOptions mirror;             // what one side lacks
};
template <class Visitor>
void Fields(Visitor& visit, CtSubject& o) {
  visit(FieldInfo{.name = "volume",
                  .doc = "head CT: a folder of DICOM files, or NIfTI (.nii, .nii.gz), NRRD (.nrrd, "
                         ".nhdr), MetaImage (.mha, .mhd), InVesalius (.inv3)"},
        o.volume);
  visit(FieldInfo{.name = "series",
                  .doc = "of a DICOM folder: number or UID of the series; needed where several "
                         "could be meant"},
        o.read.series);
  visit(FieldInfo{.name = "fill_slices",
                  .doc = "of a DICOM folder: true interpolates missing slices over up to 10 mm and "
                         "takes the first of doubled ones; false refuses them"},
        o.read.fill_slices);
  visit(FieldInfo{.name = "landmarks",
                  .doc = "landmarks on the skull: .yaml, or a file of Slicer, MeshLab or "
                         "CloudCompare, or .csv"},
        o.landmarks);
  visit(FieldInfo{.name = "import", .doc = "how skull and skin are taken from the volume"},
        o.import);
  visit(FieldInfo{.name = "mirror", .doc = "bone that one side lacks, from the other"}, o.mirror);
}

// How dowels are left out to see how well the others predict them (`semblance depth`, and studies
// with `job: depth`): a landmark of both sides, a side, and one of `folds` random parts at a time.
struct CrossValidationOptions {
  int folds = 5;                  // random parts
  std::uint64_t random_seed = 1;  // which dowels are left out together
};
template <class Visitor>
void Fields(Visitor& visit, CrossValidationOptions& o) {
  visit(
      FieldInfo{.name = "folds",
                .min = 2,
                .max = 1000,
                .doc = "random parts of the dowels, each left out in turn; at most one per dowel"},
      o.folds);
  visit(FieldInfo{.name = "random_seed", .doc = "which dowels are left out together"},
        o.random_seed);
}

// The same experiment with some options otherwise.
struct Alternative {
  std::string name;              // of its folder below the run's
  std::vector<std::string> set;  // what is otherwise, as --set takes it
};
template <class Visitor>
void Fields(Visitor& visit, Alternative& o) {
  visit(FieldInfo{.name = "name",
                  .doc = "letters, digits, '_', '-' and '+': its folder below the run's, and its "
                         "heading"},
        o.name);
  visit(FieldInfo{.name = "set",
                  .doc = "what is otherwise, as --set takes it: [\"tissue.build=obese\"], or "
                         "[\"tissue.sds=1\"]; files from the configuration's folder"},
        o.set);
}

using Subject = std::variant<PhantomOptions, FileSubject, CtSubject>;

struct Experiment {
  std::string title = "untitled";                // of the report
  Subject subject;                               // whose skull
  PlaceOptions landmarks;                        // how they are laid onto bone
  TissueOptions tissue;                          // where the dowels' depths come from
  ExtraSites sites;                              // dowels beside the landmarks', (u,v) set by hand
  std::filesystem::path network;                 // which dowels share an area
  DepthScheme interp;                            // depth between the dowels
  OutsideRule outside;                           // depth outside the network
  SkullFill fill;                                // how temples, orbits and gaps are bridged
  ImplicitFaceOptions implicit;                  // the implicit surface and its polygons
  TemplateSource face_template = IctTemplate{};  // `template`: the generic face
  PlacementOptions placement;                    // how it is brought to the dowels
  PriorSource prior = IctPrior{};                // a statistical model of faces
  FaceSource face;                               // the way to the face
  BustSource bust;                               // the head that it is put into
  std::vector<Alternative> alternatives;         // other answers, beside this one
  FeatureRules rules;                            // for what bone does not carry
  // Levels fitted to the dowels alone before seeds are taken.
  std::vector<ScheduleStep> first_fit = {{.level = 0, .fraction = 1}};
  SeedOptions seeds = {.weight = 0.1};  // many as they are, they must not outvote the dowels
  double cut_margin_mm = 5;             // no seeds nearer to where the scan ends
  int rounds = 1;                       // of seeding and fitting
  FitOptions fit = {.relaxation = FootpointRelaxation{}};  // to dowels and seeds
  std::filesystem::path edits;              // made by hand, on the face that comes out
  UncertaintyOptions uncertainty;           // how far the face may be off
  FaceRegionOptions region;                 // which skin is scored
  DepthDirection direction;                 // along which depths are compared
  DepthTruthOptions depth_truth;            // what counts as a true depth
  CrossValidationOptions cross_validation;  // for depth alone
};
template <class Visitor>
void Fields(Visitor& visit, Experiment& o) {
  visit(FieldInfo{.name = "title", .doc = "what the report is headed with"}, o.title);
  visit(FieldInfo{.name = "subject", .doc = "whose skull, and the true face where it is known"},
        o.subject);
  visit(FieldInfo{.name = "landmarks", .doc = "how landmarks are laid onto bone"}, o.landmarks);
  visit(FieldInfo{.name = "tissue", .doc = "where the dowels' depths come from"}, o.tissue);
  visit(FieldInfo{.name = "sites",
                  .doc = "by name: dowels beside the landmarks', and where a site lies on the "
                         "generic face, e.g. {my_site: {near: [n, rhi], depth: 4.5}, n: {uv: [0.5, "
                         "0.6], hold: true}}"},
        o.sites);
  visit(FieldInfo{.name = "network", .doc = "YAML file of the dowel network"}, o.network);
  visit(FieldInfo{.name = "interp", .doc = "how depth is interpolated between the dowels"},
        o.interp);
  visit(FieldInfo{.name = "outside",
                  .doc = "what bone outside the network, or turned away from it, gets"},
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
  visit(FieldInfo{.name = "prior",
                  .doc = "a statistical model of faces: mean and modes on one mesh; `template` is "
                         "then the H-spline of its mean; ict is the one of `template: ict`"},
        o.prior);
  visit(FieldInfo{.name = "face",
                  .doc = "the way to the face; auto: prior_then_fit where there is a prior of the "
                         "template, else fit; placed: the template, brought to the dowels; "
                         "thin_plate: bent to their tips; fit: fitted to tips and implicit face "
                         "level by level; prior: the most likely face of the prior, given tips and "
                         "implicit face; prior_then_fit: that face as the template of the fit"},
        o.face);
  visit(FieldInfo{.name = "bust",
                  .doc = "the head that the face is put into for people to look at, with ears, "
                         "neck and eyes; auto: ict where the template is ict, else none; ict: the "
                         "head of the ICT-FaceKit model; hspline: the template's own; mesh: any "
                         "head. No figure is measured on it"},
        o.bust);
  visit(FieldInfo{.name = "alternatives",
                  .doc = "the same skull with other options, each in a folder of its own below the "
                         "run's, and side by side in the report, e.g. [{name: obese, set: "
                         "[\"tissue.build=obese\"]}]"},
        o.alternatives);
  visit(FieldInfo{.name = "rules",
                  .doc = "rules of the literature for eyes, mouth and nose, as observations of a "
                         "face that asks the prior; each is on when its points are there"},
        o.rules);
  visit(FieldInfo{.name = "first_fit",
                  .doc = "levels fitted to the dowels alone before seeds are taken; may be empty"},
        o.first_fit);
  visit(FieldInfo{.name = "seeds", .doc = "extra dowels on the implicit face"}, o.seeds);
  visit(FieldInfo{.name = "cut_margin_mm",
                  .unit = "mm",
                  .min = -50,
                  .max = 100,
                  .doc = "no seeds nearer than this to a plane where the scan ends; beyond it the "
                         "face follows the template"},
        o.cut_margin_mm);
  visit(FieldInfo{.name = "rounds",
                  .min = 1,
                  .max = 20,
                  .doc = "how often seeds are taken anew and the schedule is run"},
        o.rounds);
  visit(FieldInfo{.name = "fit", .doc = "the level-by-level fit"}, o.fit);
  visit(FieldInfo{.name = "edits",
                  .doc = "edit script (.yaml, as `semblance edit` takes it) that is replayed on "
                         "the face that comes out; empty: the face stays as it is"},
        o.edits);
  visit(FieldInfo{.name = "uncertainty", .doc = "how far the face may be off, and by what"},
        o.uncertainty);
  visit(FieldInfo{.name = "region", .doc = "which part of the true skin is scored"}, o.region);
  visit(FieldInfo{.name = "direction",
                  .doc = "along which a depth is taken where it is compared with the true one, and "
                         "where its end is: p + depth * direction"},
        o.direction);
  visit(FieldInfo{.name = "depth_truth", .doc = "what counts as a true depth"}, o.depth_truth);
  visit(FieldInfo{.name = "cross_validation",
                  .doc = "how dowels are left out, in `semblance depth` and studies of depth"},
        o.cross_validation);
}

// experiment.face, or what `auto` comes to: never AutoFace.
FaceSource WayToFace(const Experiment& experiment);

// Options that are right each by itself but not together, e.g. a step of the schedule at a level
// that the generic face does not have. Told with the other faults when a configuration is read.
std::vector<OptionFault> FaultsBetween(const Experiment& experiment);

// What is set of first_fit, seeds, rounds and fit though the way to the face does not look at it,
// or though the fit does not, a line each. No fault: a study may compare ways that share these
// options.
std::vector<std::string> UnusedOptions(const Experiment& experiment);

}  // namespace semblance
