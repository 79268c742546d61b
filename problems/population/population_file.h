// SPDX-License-Identifier: GPL-3.0-or-later
// What `semblance population` reads: many subjects, and how their depths are measured and made into
// a table.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "interp/evaluation/depth_truth.h"
#include "problems/config/config_binder.h"
#include "problems/pipeline/experiment.h"

namespace semblance {

// A phantom as a CT scanner shows it, whose skull and skin are then taken from the volume.
struct PhantomScan {
  double pixel_mm = 1, slice_mm = 1;  // between columns, rows; slices
  CtImportOptions import;             // thresholds of skull and skin
};
template <class Visitor>
void Fields(Visitor& visit, PhantomScan& o) {
  visit(FieldInfo{.name = "pixel_mm",
                  .unit = "mm",
                  .min = 0.3,
                  .max = 5,
                  .doc = "between columns and rows"},
        o.pixel_mm);
  visit(FieldInfo{.name = "slice_mm", .unit = "mm", .min = 0.3, .max = 10, .doc = "between slices"},
        o.slice_mm);
  visit(FieldInfo{.name = "import", .doc = "how skull and skin are taken from the volume"},
        o.import);
}

// Empty where each code is a site's (sites.h), or a pair's without side; else what is wrong with
// the first that is none.
std::string ComplaintAboutCodes(const std::vector<std::string>& codes);

struct PopulationSubject {
  std::string name;                           // each once
  Subject subject;                            // without landmarks: they are proposed
  bool optional = false;                      // left out where its files are not there
  std::vector<std::string> exclude = {};      // sites
  std::optional<Sex> sex = std::nullopt;      // null: not known
  std::optional<Build> build = std::nullopt;  // null: not known
  std::optional<double> age_years = std::nullopt, bmi = std::nullopt;  // null: not known
  std::optional<PhantomScan> scan = std::nullopt;                      // of a phantom alone
};
template <class Visitor>
void Fields(Visitor& visit, PopulationSubject& o) {
  visit(FieldInfo{.name = "name", .doc = "in all tables; each once"}, o.name);
  visit(FieldInfo{.name = "subject",
                  .doc = "skull and skin, or a CT, as in an experiment; without `landmarks` they "
                         "are proposed"},
        o.subject);
  visit(
      FieldInfo{.name = "optional", .doc = "left out, and said so, where its files are not there"},
      o.optional);
  visit(FieldInfo{.name = "exclude",
                  .doc = "sites without a usable depth, e.g. where a scan ends; a pair's code "
                         "without side means both sides"},
        o.exclude);
  visit(FieldInfo{.name = "sex", .doc = "null: not known"}, o.sex);
  visit(FieldInfo{.name = "build", .doc = "null: not known"}, o.build);
  visit(FieldInfo{.name = "age_years", .min = 0, .max = 130, .doc = "null: not known"},
        o.age_years);
  visit(FieldInfo{.name = "bmi", .min = 8, .max = 100, .doc = "body mass index; null: not known"},
        o.bmi);
  visit(FieldInfo{.name = "scan", .doc = "of a phantom: the CT that it is seen in; null: none"},
        o.scan);
}
template <class Report>
void CheckValue(Report& report, const PopulationSubject& o) {
  if (o.scan && !std::holds_alternative<PhantomOptions>(o.subject)) {
    report("scan", "is for phantoms; a subject of files or of a CT is as it is");
  }
  if (const std::string complaint = ComplaintAboutCodes(o.exclude); !complaint.empty()) {
    report("exclude", complaint);
  }
}

// Made-up heads, whose random seeds count up from that of `like`.
struct PhantomCrowd {
  int count = 0;                    // made-up heads
  PhantomOptions like;              // of the first; the others differ in their random seed
  std::optional<PhantomScan> scan;  // none: skull and skin are exact
};
template <class Visitor>
void Fields(Visitor& visit, PhantomCrowd& o) {
  visit(FieldInfo{.name = "count", .min = 0, .max = 100000, .doc = "how many"}, o.count);
  visit(
      FieldInfo{.name = "like",
                .doc =
                    "the first phantom; the others have the random seeds after its own. Their body "
                    "mass index is made up, from how thick their tissue is"},
      o.like);
  visit(FieldInfo{.name = "scan",
                  .doc = "how coarse a CT they are seen in, to learn what coarse voxels do; null: "
                         "skull and skin as they are"},
        o.scan);
}

struct ReferenceFiles {
  std::filesystem::path skull, landmarks;  // marked by a person
};
template <class Visitor>
void Fields(Visitor& visit, ReferenceFiles& o) {
  visit(FieldInfo{.name = "skull", .doc = "a skull that a person has marked"}, o.skull);
  visit(FieldInfo{.name = "landmarks", .doc = "its landmarks"}, o.landmarks);
}

// Depth all over the skull, on a grid of the generic face's (u,v).
struct DenseOptions {
  int columns = 48, rows = 48;  // of the grid
  double reach_mm = 25;         // bone farther from the generic face is left out
  double normal_radius_mm = 5;  // of the mean normal
  double least_share = 0.6;     // of subjects; points that fewer have are in no mode
  int modes = 5;                // at most
};
template <class Visitor>
void Fields(Visitor& visit, DenseOptions& o) {
  visit(FieldInfo{.name = "columns",
                  .min = 8,
                  .max = 512,
                  .doc = "of the grid, from ear to ear; more sees finer detail"},
        o.columns);
  visit(FieldInfo{.name = "rows", .min = 8, .max = 512, .doc = "of the grid, from chin to crown"},
        o.rows);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 100,
                  .doc = "bone further than this from the generic face, which is bent onto the "
                         "skull's landmarks, does not belong to its point"},
        o.reach_mm);
  visit(FieldInfo{.name = "normal_radius_mm",
                  .unit = "mm",
                  .min = 0.5,
                  .max = 30,
                  .doc = "of the bone whose mean normal a depth is taken along"},
        o.normal_radius_mm);
  visit(FieldInfo{.name = "least_share",
                  .min = 0,
                  .max = 1,
                  .doc = "points that a smaller part of the subjects has are in no mode"},
        o.least_share);
  visit(FieldInfo{.name = "modes", .min = 0, .max = 50, .doc = "of variation, at most"}, o.modes);
}

// How one subject is measured: what its file rests on.
struct MeasureOptions {
  DepthConvention convention = DepthConvention::kAlongBoneNormal;  // where a depth ends
  PlaceOptions landmarks;                                          // how they are laid on bone
  DepthTruthOptions depth_truth;                                   // what counts as a depth
  DenseOptions dense;                                              // depth all over the skull
  std::vector<ReferenceFiles> references;                          // to propose landmarks by
};
template <class Visitor>
void Fields(Visitor& visit, MeasureOptions& o) {
  visit(FieldInfo{.name = "convention",
                  .doc = "along_bone_normal: to the first skin along the bone's normal; "
                         "closest_point: to the closest skin. Tables of the two differ"},
        o.convention);
  visit(FieldInfo{.name = "landmarks", .doc = "how landmarks are laid onto bone"}, o.landmarks);
  visit(FieldInfo{.name = "depth_truth", .doc = "what counts as a depth"}, o.depth_truth);
  visit(FieldInfo{.name = "dense", .doc = "depth all over the skull"}, o.dense);
  visit(FieldInfo{.name = "references",
                  .doc = "skulls with landmarks, by which those of subjects without are proposed; "
                         "none: the first three subjects that have some"},
        o.references);
}
template <class Report>
void CheckValue(Report& report, const MeasureOptions& o) {
  if (o.convention == DepthConvention::kUnspecified) {
    report("convention", "a depth is measured along_bone_normal or to the closest_point");
  }
}

struct OutlierOptions {
  double site_z = 4;       // robust deviations of a depth
  double subject_z = 3.5;  // of a subject's depths together
  bool leave_out = false;  // of table, modes and scores
};
template <class Visitor>
void Fields(Visitor& visit, OutlierOptions& o) {
  visit(FieldInfo{.name = "site_z",
                  .min = 1,
                  .max = 100,
                  .doc = "a depth so many robust deviations from the median of its site, by what "
                         "the subject's other depths let expect, is an outlier"},
        o.site_z);
  visit(FieldInfo{.name = "subject_z",
                  .min = 1,
                  .max = 100,
                  .doc = "likewise a subject, by the root mean square of its depths' deviations"},
        o.subject_z);
  visit(FieldInfo{.name = "leave_out",
                  .doc = "leave the outliers out of the table, the modes and the scores; else they "
                         "are listed alone"},
        o.leave_out);
}

struct PopulationFile {
  std::string title = "untitled";           // of report and table
  std::string id = "population";            // of the table
  std::string label;                        // who was measured
  std::vector<PopulationSubject> subjects;  // who is measured
  PhantomCrowd phantoms;                    // made-up heads beside them
  MeasureOptions measure;                   // how each is measured
  double least_confidence = 0.2;            // of a landmark that was proposed
  OutlierOptions outliers;                  // what is one, and what becomes of it
  SiteCorrelation correlation;              // the model that a sample is shrunk to
  std::optional<double> shrinkage;          // the model's part; null: from the sample
  std::vector<std::string> known = {"g", "pg", "zy", "go"};  // the others follow from these
  std::vector<std::filesystem::path> tables;                 // compared with this one
};
template <class Visitor>
void Fields(Visitor& visit, PopulationFile& o) {
  visit(FieldInfo{.name = "title", .doc = "of the report and the table"}, o.title);
  visit(FieldInfo{.name = "id", .doc = "short name of the table, for messages"}, o.id);
  visit(FieldInfo{.name = "label", .doc = "who was measured, for the table"}, o.label);
  visit(FieldInfo{.name = "subjects", .doc = "who is measured"}, o.subjects);
  visit(FieldInfo{.name = "phantoms", .doc = "made-up heads, beside the subjects"}, o.phantoms);
  visit(FieldInfo{.name = "measure", .doc = "how each is measured"}, o.measure);
  visit(FieldInfo{.name = "least_confidence",
                  .min = 0,
                  .max = 1,
                  .doc = "proposed landmarks that are less likely than this to be within 3 mm are "
                         "not counted, and said; 0 counts all"},
        o.least_confidence);
  visit(FieldInfo{.name = "outliers", .doc = "what is listed, or left out"}, o.outliers);
  visit(FieldInfo{.name = "correlation",
                  .doc = "the model that few subjects' correlations are shrunk to"},
        o.correlation);
  visit(FieldInfo{.name = "shrinkage",
                  .min = 0.001,
                  .max = 1,
                  .doc = "part of the correlations that is the model's; null: what errs least "
                         "(Schaefer & Strimmer 2005)"},
        o.shrinkage);
  visit(FieldInfo{.name = "known",
                  .doc = "sites that are taken as measured where the scores ask what a few "
                         "measured depths tell of the others; a pair's code without side means "
                         "both sides; none: that is not asked"},
        o.known);
  visit(FieldInfo{.name = "tables", .doc = "published tables to score beside the population's own"},
        o.tables);
}
template <class Report>
void CheckValue(Report& report, const PopulationFile& o) {
  if (const std::string complaint = ComplaintAboutCodes(o.known); !complaint.empty()) {
    report("known", complaint);
  }
}

// One subject of a population as it is measured.
struct PopulationEntry {
  PopulationSubject subject;
  std::string id;  // 12 hexadecimal digits: of the subject, the content of its files and how it is
                   // measured
};

struct PopulationPlan {
  PopulationFile file;
  std::vector<PopulationEntry> entries;  // the subjects that are there, then the phantoms
  std::vector<std::string> notes;        // subjects that were left out, folders passed over
};

// `path`: a YAML file, or a folder with a folder for each subject:
//   skull.* and skin.* (PLY, OBJ, STL or OFF), or a volume (volume.nii.gz, a folder ct/ or dicom/
//   of DICOM, whatever ReadVolume takes); landmarks.* (whatever ReadLandmarks takes) if there are
//   any;
// in capitals or not. Other folders are passed over, with a note each. Beside them subjects.csv
// with the columns name, sex, build, age_years and bmi, as far as they are known, and
// population.yaml with options, if they are there. Throws IoError or ConfigError for what cannot be
// read, and for a row of subjects.csv that is nobody's, a second one of a person, or out of range;
// InputError for a name that appears twice or is not plain, and where there is no subject.
PopulationPlan ReadPopulation(const std::filesystem::path& path);

// The files that must be there: those of subjects that are not optional, tables and references.
std::vector<NamedFile> NamedInputsOf(const PopulationFile& file);

}  // namespace semblance
