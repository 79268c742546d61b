// SPDX-License-Identifier: GPL-3.0-or-later
// The input of `semblance population`: many subjects, and the options by which their depths are
// measured and made into a table.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "interp/evaluation/depth_truth.h"
#include "problems/config/config_binder.h"
#include "problems/experiment/experiment.h"

namespace semblance::problems {

// A CT scan of a phantom, from which skull and skin are imported instead of the exact ones.
struct PhantomScan {
  double pixel_mm = 1, slice_mm = 1;
  CtImportOptions import;
};
template <class Visitor>
void Fields(Visitor& visit, PhantomScan& o) {
  visit(FieldInfo{.name = "pixel_mm",
                  .unit = "mm",
                  .min = 0.3,
                  .max = 5,
                  .doc = "distance of columns and of rows"},
        o.pixel_mm);
  visit(
      FieldInfo{
          .name = "slice_mm", .unit = "mm", .min = 0.3, .max = 10, .doc = "distance of slices"},
      o.slice_mm);
  visit(FieldInfo{.name = "import", .doc = "how skull and skin are imported from the volume"},
        o.import);
}

// The fault of the first code that is neither a site's (sites.h) nor a pair's without side; empty
// if there is none.
std::string SiteCodesFault(const std::vector<std::string>& codes);

struct PopulationSubject {
  std::string name;
  Subject subject;
  bool optional = false;
  std::vector<std::string> exclude = {};
  std::optional<Sex> sex = std::nullopt;
  std::optional<Build> build = std::nullopt;
  std::optional<double> age_years = std::nullopt, bmi = std::nullopt;
  std::optional<PhantomScan> scan = std::nullopt;
  // Not an option. The reason why the subject's folder cannot be measured; empty if it can.
  std::string fault = {};
};
template <class Visitor>
void Fields(Visitor& visit, PopulationSubject& o) {
  visit(FieldInfo{.name = "name", .doc = "name in all tables; must be unique"}, o.name);
  visit(FieldInfo{.name = "subject",
                  .doc = "skull and skin, or a CT, as in an experiment; without `landmarks` the "
                         "program proposes them"},
        o.subject);
  visit(
      FieldInfo{.name = "optional", .doc = "true: left out, with a note, if its files are missing"},
      o.optional);
  visit(FieldInfo{.name = "exclude",
                  .doc = "sites without a usable depth, e.g. where a scan ends; a pair's code "
                         "without side means both sides"},
        o.exclude);
  visit(FieldInfo{.name = "sex", .doc = "sex; null: not known"}, o.sex);
  visit(FieldInfo{.name = "build", .doc = "build; null: not known"}, o.build);
  visit(FieldInfo{.name = "age_years", .min = 0, .max = 130, .doc = "age; null: not known"},
        o.age_years);
  visit(FieldInfo{.name = "bmi", .min = 8, .max = 100, .doc = "body mass index; null: not known"},
        o.bmi);
  visit(
      FieldInfo{.name = "scan", .doc = "for a phantom: the CT scan that is made of it; null: none"},
      o.scan);
}
template <class Report>
void CheckValue(Report& report, const PopulationSubject& o) {
  if (o.scan && !std::holds_alternative<PhantomOptions>(o.subject)) {
    report("scan", "applies to phantoms only; remove it from a subject of files or of a CT");
  }
  if (const std::string complaint = SiteCodesFault(o.exclude); !complaint.empty()) {
    report("exclude", complaint);
  }
}

// Phantoms whose random seeds count up from that of `like`.
struct PhantomCrowd {
  int count = 0;
  PhantomOptions like;
  std::optional<PhantomScan> scan;
};
template <class Visitor>
void Fields(Visitor& visit, PhantomCrowd& o) {
  visit(FieldInfo{.name = "count", .min = 0, .max = 100000, .doc = "number of phantoms"}, o.count);
  visit(
      FieldInfo{
          .name = "like",
          .doc =
              "options of the first phantom; the others have the random seeds that follow. Their "
              "body mass index is made up from the thickness of their tissue"},
      o.like);
  visit(FieldInfo{.name = "scan",
                  .doc = "CT scan that is made of each phantom, to learn the effect of coarse "
                         "voxels; null: skull and skin are exact"},
        o.scan);
}

struct ReferenceFiles {
  std::filesystem::path skull, landmarks;
};
template <class Visitor>
void Fields(Visitor& visit, ReferenceFiles& o) {
  visit(FieldInfo{.name = "skull", .doc = "a skull on which a person placed landmarks"}, o.skull);
  visit(FieldInfo{.name = "landmarks", .doc = "its landmarks"}, o.landmarks);
}

// Depth over the whole skull, on a grid of the generic face's (u,v).
struct DenseOptions {
  int columns = 48, rows = 48;
  double reach_mm = 25;
  double normal_radius_mm = 5;
  double least_share = 0.6;
  int modes = 5;
};
template <class Visitor>
void Fields(Visitor& visit, DenseOptions& o) {
  visit(FieldInfo{.name = "columns",
                  .min = 8,
                  .max = 512,
                  .doc = "columns of the grid, from ear to ear; more resolve finer detail"},
        o.columns);
  visit(
      FieldInfo{
          .name = "rows", .min = 8, .max = 512, .doc = "rows of the grid, from chin to crown"},
      o.rows);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 100,
                  .doc = "the generic face is warped onto the skull's landmarks; bone farther than "
                         "this from a point of it does not belong to the point"},
        o.reach_mm);
  visit(FieldInfo{.name = "normal_radius_mm",
                  .unit = "mm",
                  .min = 0.5,
                  .max = 30,
                  .doc = "radius of the bone along whose mean normal a depth is measured"},
        o.normal_radius_mm);
  visit(
      FieldInfo{.name = "least_share",
                .min = 0,
                .max = 1,
                .doc = "points for which a smaller fraction of the subjects has a depth are in no "
                       "mode"},
      o.least_share);
  visit(
      FieldInfo{
          .name = "modes", .min = 0, .max = 50, .doc = "maximum number of modes of variation"},
      o.modes);
}

// The direction in which a depth is measured along a normal.
enum class DepthDirection { kAuto, kBoneNormal, kAverage };
constexpr auto EnumNames(DepthDirection) {
  return std::to_array<std::string_view>({"auto", "bone_normal", "average"});
}

// The options that determine the measured depths of a subject, and with them its result file.
struct MeasureOptions {
  DepthConvention convention = DepthConvention::kAlongBoneNormal;
  DepthDirection direction = DepthDirection::kAuto;
  PlaceOptions landmarks;
  DepthTruthOptions depth_truth;
  DenseOptions dense;
  std::vector<ReferenceFiles> references;
};
template <class Visitor>
void Fields(Visitor& visit, MeasureOptions& o) {
  visit(FieldInfo{.name = "convention",
                  .doc = "along_bone_normal: to the first skin along the bone's normal; "
                         "closest_point: to the closest skin. Tables of the two differ"},
        o.convention);
  visit(FieldInfo{.name = "direction",
                  .doc = "bone_normal: the bone's mean normal at the landmark; average: the normal "
                         "of 54 people's bone at the site, turned with the skull; auto: average "
                         "for proposed landmarks on voxels of more than 2.5 mm, whose bone has no "
                         "reliable normal, and bone_normal otherwise"},
        o.direction);
  visit(FieldInfo{.name = "landmarks", .doc = "how landmarks are laid onto bone"}, o.landmarks);
  visit(FieldInfo{.name = "depth_truth", .doc = "what counts as a depth"}, o.depth_truth);
  visit(FieldInfo{.name = "dense", .doc = "depth over the whole skull"}, o.dense);
  visit(FieldInfo{.name = "references",
                  .doc = "skulls with landmarks, from which the landmarks of other subjects are "
                         "proposed; none: the first three subjects with meshes and landmarks, or, "
                         "if there are none, the mean skull of the program"},
        o.references);
}
template <class Report>
void CheckValue(Report& report, const MeasureOptions& o) {
  if (o.convention == DepthConvention::kUnspecified) {
    report("convention", "must be along_bone_normal or closest_point");
  }
}

struct OutlierOptions {
  double site_z = 4;
  double subject_z = 3.5;
  bool leave_out = false;
};
template <class Visitor>
void Fields(Visitor& visit, OutlierOptions& o) {
  visit(FieldInfo{.name = "site_z",
                  .min = 1,
                  .max = 100,
                  .doc = "a depth is an outlier if its difference from the depth expected from the "
                         "subject's other depths is more than this many robust deviations from the "
                         "median"},
        o.site_z);
  visit(
      FieldInfo{.name = "subject_z",
                .min = 1,
                .max = 100,
                .doc = "a subject is an outlier if the root mean square of its depths' deviations "
                       "is more than this many robust deviations above the median"},
      o.subject_z);
  visit(FieldInfo{.name = "leave_out",
                  .doc = "true: leaves the outliers out of the table, the modes and the scores; "
                         "false: only lists them"},
        o.leave_out);
}

struct PopulationFile {
  std::string title = "untitled";
  std::string id = "population";
  std::string label;
  std::vector<PopulationSubject> subjects;
  // Midway between air and tissue, where the skin's edge does not move with the size of the voxels.
  CtImportOptions import = {.skin_hu = -500};
  PhantomCrowd phantoms;
  MeasureOptions measure;
  double least_confidence = 0.2;
  OutlierOptions outliers;
  SiteCorrelation correlation;
  std::optional<double> shrinkage;
  std::vector<std::string> known = {"g", "pg", "zy", "go"};
  std::vector<std::filesystem::path> tables;
};
template <class Visitor>
void Fields(Visitor& visit, PopulationFile& o) {
  visit(FieldInfo{.name = "title", .doc = "title of the report and the table"}, o.title);
  visit(FieldInfo{.name = "id", .doc = "short name of the table, for messages"}, o.id);
  visit(FieldInfo{.name = "label", .doc = "who was measured, for the table"}, o.label);
  visit(FieldInfo{.name = "subjects", .doc = "the subjects to measure"}, o.subjects);
  visit(FieldInfo{.name = "import",
                  .doc = "how skull and skin are taken from the volumes of a folder, by default "
                         "with skin_hu -500; `subjects` have options of their own"},
        o.import);
  visit(FieldInfo{.name = "phantoms", .doc = "made-up heads, in addition to the subjects"},
        o.phantoms);
  visit(FieldInfo{.name = "measure", .doc = "how each subject is measured"}, o.measure);
  visit(FieldInfo{.name = "least_confidence",
                  .min = 0,
                  .max = 1,
                  .doc = "proposed landmarks that are less likely than this to be within 3 mm are "
                         "not counted, with a note; 0 counts all"},
        o.least_confidence);
  visit(FieldInfo{.name = "outliers",
                  .doc = "which depths and subjects are outliers, and whether to leave them out"},
        o.outliers);
  visit(FieldInfo{.name = "correlation",
                  .doc = "the model towards which the correlations of few subjects are shrunk"},
        o.correlation);
  visit(FieldInfo{.name = "shrinkage",
                  .min = 0.001,
                  .max = 1,
                  .doc = "part of the correlations that comes from the model; null: the value with "
                         "the least expected error (Schaefer & Strimmer 2005)"},
        o.shrinkage);
  visit(FieldInfo{.name = "known",
                  .doc = "sites that count as measured for the score of predictions from a few "
                         "measured depths; a pair's code without side means both sides; empty: no "
                         "such score"},
        o.known);
  visit(FieldInfo{.name = "tables",
                  .doc = "published tables to score for comparison with the population's own"},
        o.tables);
}
template <class Report>
void CheckValue(Report& report, const PopulationFile& o) {
  if (const std::string complaint = SiteCodesFault(o.known); !complaint.empty()) {
    report("known", complaint);
  }
}

// One subject of a population with the id of its measurement.
struct PopulationEntry {
  PopulationSubject subject;
  std::string id;  // 12 hexadecimal digits, a hash of the subject's options, the contents of its
                   // files and MeasureOptions; or of its name and fault
};

struct PopulationPlan {
  PopulationFile file;
  std::vector<PopulationEntry> entries;  // the subjects whose files exist, then the phantoms
  std::vector<std::string> notes;        // subjects that were left out, folders that were skipped
};

// Reads a population from `path`, which is a YAML file, or a folder. Each volume in the folder
// (.nii, .nii.gz, .hdr, .nrrd, .nhdr, .mha, .mhd or .inv3) is a subject with the name of its file
// without the ending. Each folder in it is a subject, too, and contains, in upper or lower case,
//   skull.* and skin.* (PLY, OBJ, STL or OFF), or a volume (volume.nii.gz, a folder ct/ or dicom/
//   of DICOM, or any format that ReadVolume accepts); landmarks.*, in any format that ReadLandmarks
//   accepts (optional).
// Folders with nothing of this are skipped, with a note each. A folder that contains a part of it,
// or too much, becomes a subject with a fault. The top folder may contain subjects.csv, with the
// columns name, sex, build, age_years and bmi as far as they are known, and population.yaml with
// options; other files are ignored. Throws IoError or ConfigError for these two if they cannot be
// read, and for a row of subjects.csv that belongs to no subject, repeats a subject, or is out of
// range. Throws InputError for a name that is empty or appears twice, and if there is no subject.
PopulationPlan ReadPopulation(const std::filesystem::path& path);

// The files that must exist: those of subjects that are not optional, tables and references.
std::vector<NamedFile> NamedInputs(const PopulationFile& file);

}  // namespace semblance::problems
