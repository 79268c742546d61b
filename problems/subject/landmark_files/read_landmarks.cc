// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_files/read_landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "problems/config/config.h"
#include "problems/config/utf8_check.h"
#include "problems/subject/landmark_files/landmark_table.h"
#include "problems/subject/landmark_files/markups_json.h"
#include "problems/subject/landmark_files/point_files.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ReadNotes = std::vector<std::string>;

// A file format, with its parser and its writer.
struct Format {
  std::string_view extension;
  LandmarkFile (*parse)(std::string_view text, std::string_view file, ReadNotes& notes);
  std::string (*encode)(const LandmarkFile& file);
  bool holds_measurements;  // normals, depths and certainties
  bool holds_notes;
  bool states_encoding = false;  // XML, whose parser converts any encoding to UTF-8
  bool needs_axes = false;       // its points are LPS or RAS alike, so axes are never assumed
};

std::string CloudComparePoints(const LandmarkFile& file) {
  std::string text;
  for (const Landmark& l : file.landmarks) {
    text += fmt::format("{},{},{},{}\n", l.site, l.point[0], l.point[1], l.point[2]);
  }
  return text;
}

template <LandmarkFile (*parse)(std::string_view, std::string_view)>
LandmarkFile WithoutNotes(std::string_view text, std::string_view file, ReadNotes&) {
  return parse(text, file);
}

constexpr std::array kFormats = {
    Format{".yaml", nullptr, &WriteConfig<LandmarkFile>, true, true},
    Format{".yml", nullptr, &WriteConfig<LandmarkFile>, true, true},
    Format{".mrk.json", &ParseMarkupsJson, &MarkupsJson, false, true},
    Format{.extension = ".fcsv",
           .parse = &ParseFcsv,
           .encode = &Fcsv,
           .holds_measurements = false,
           .holds_notes = true,
           .needs_axes = true},
    Format{".pp", &WithoutNotes<&ParseMeshLabPoints>, &MeshLabPoints, false, false, true},
    Format{".csv", &ParseLandmarkTable, &LandmarkTable, true, true},
    Format{".txt", &WithoutNotes<&ParsePointList>, &CloudComparePoints, false, false},
    Format{".asc", &WithoutNotes<&ParsePointList>, &CloudComparePoints, false, false},
};

const Format& FindFormat(const fs::path& path) {
  const std::string name = LowerCase(path.filename().string());
  for (const Format& format : kFormats) {
    if (name.ends_with(format.extension)) {
      return format;
    }
  }
  throw InputError(fmt::format(
      "{}: unknown kind of landmark file; known are .yaml, .mrk.json and .fcsv (3D Slicer), .pp "
      "(MeshLab), .txt and .asc (CloudCompare), .csv",
      path.string()));
}

void ThrowFaults(const fs::path& path, const std::vector<std::string>& faults) {
  if (!faults.empty()) {
    throw InputError(fmt::format("{}: {}", path.string(),
                                 fmt::join(faults, fmt::format("\n{}: ", path.string()))));
  }
}

// Replaces names by codes of sites. Points without a known name are left out if that is allowed.
template <class Entry>
void NameSites(const ReadLandmarksOptions& options, std::vector<Entry>& entries, ReadNotes& notes,
               std::vector<std::string>& faults) {
  std::vector<Entry> known;
  for (Entry& entry : entries) {
    const NamedSite site = FindSiteByName(entry.site, options.place);
    if (!site.code.empty()) {
      if (!site.note.empty()) {
        notes.push_back(site.note);
      }
      entry.site = site.code;
      known.push_back(entry);
    } else if (options.leave_out_unknown) {
      notes.push_back(fmt::format("left out: {}", site.fault));
    } else {
      faults.push_back(site.fault);
    }
  }
  entries = std::move(known);
}

// Finds points that nobody placed: a program leaves them at the origin.
void FindUnplaced(const fs::path& path, const LandmarkFile& file, ReadNotes& notes,
                  std::vector<std::string>& faults) {
  std::vector<std::string> sites;
  for (const Landmark& landmark : file.landmarks) {
    if (landmark.point == std::array{0.0, 0.0, 0.0}) {
      sites.push_back(landmark.site);
    }
  }
  if (sites.size() > 1) {
    faults.push_back(
        fmt::format("sites {} are at the same point 0, 0, 0, so they were never placed; "
                    "place them or take them out",
                    fmt::join(sites, ", ")));
  } else if (!sites.empty()) {
    notes.push_back(fmt::format("{}: site {} is at 0, 0, 0; check that it was placed",
                                path.filename().string(), sites.front()));
  }
}

void FindRepeats(const LandmarkFile& file, std::vector<std::string>& faults) {
  std::set<std::string> sites;
  const auto see = [&](const std::string& site) {
    if (!sites.insert(site).second) {
      faults.push_back(fmt::format("site {} appears twice; keep one", DescribeSite(site)));
    }
  };
  std::ranges::for_each(file.landmarks, see, &Landmark::site);
  std::ranges::for_each(file.absent, see, &AbsentLandmark::site);
}

std::string_view AxesName(Axes axes) { return EnumNames(axes)[static_cast<std::size_t>(axes)]; }

// The remedy for contradicting axes, which depends on whether the file can state others.
std::string_view RemedyForAxes(const Format& format) {
  return format.parse != nullptr
             ? "leave the axes out"
             : "leave the axes out, or correct `axes` in the file (LPS if it has none)";
}

void ChooseAxes(const fs::path& path, const ReadLandmarksOptions& options, LandmarkFile& file,
                ReadNotes& notes) {
  if (file.axes.empty() && !options.axes && FindFormat(path).needs_axes) {
    throw IoError(
        fmt::format("{}: the line '# CoordinateSystem = ...' with LPS or RAS is missing; save the "
                    "list again in "
                    "Slicer, or convert it with --axes (lists of Slicer 3 are RAS)",
                    path.string()));
  }
  if (file.axes.empty() && !options.axes) {
    notes.push_back(fmt::format("{}: the file does not state its axes; taken as LPS",
                                path.filename().string()));
  }
  const std::string wanted(options.axes ? AxesName(*options.axes) : "");
  if (!file.axes.empty() && !wanted.empty() && file.axes != wanted) {
    throw InputError(fmt::format("{}: the file has {} axes, and {} was requested; {}",
                                 path.string(), file.axes, wanted,
                                 RemedyForAxes(FindFormat(path))));
  }
  if (file.axes.empty()) {
    file.axes = wanted.empty() ? "LPS" : wanted;
  }
}

void TurnToLps(const fs::path& path, LandmarkFile& file, ReadNotes& notes) {
  if (file.axes == "LPS") {
    return;
  }
  file = InLpsMm(std::move(file));
  notes.push_back(
      fmt::format("{}: turned from RAS to LPS (x and y negated)", path.filename().string()));
}

// Refuses coordinates so large that the weights of the placement would no longer be numbers.
void CheckReach(const fs::path& path, const LandmarkFile& file) {
  constexpr double kMaxCoordinate_mm = 1e9;
  std::vector<std::string> faults;
  for (const Landmark& landmark : file.landmarks) {
    const auto& [x, y, z] = landmark.point;
    const double farthest_mm = std::max({std::abs(x), std::abs(y), std::abs(z)});
    if (farthest_mm > kMaxCoordinate_mm) {
      faults.push_back(fmt::format("site {}: a coordinate of {:.3g} mm; at most 1e9 are allowed",
                                   landmark.site, farthest_mm));
    }
  }
  ThrowFaults(path, faults);
}

// Reads a file that must be UTF-8, because its notes may be written to YAML, which is always UTF-8.
std::string ReadText(const fs::path& path, const Format& format) {
  std::string text = ReadFileBytes(path);
  const std::optional<int> line = format.states_encoding ? std::nullopt : LineThatIsNotUtf8(text);
  if (line) {
    throw IoError(fmt::format("{}:{}: a byte that is not UTF-8; save the file as UTF-8",
                              path.string(), *line));
  }
  return text;
}

LandmarkReading ReadForeign(const fs::path& path, const Format& format,
                            const ReadLandmarksOptions& options) {
  LandmarkReading reading;
  LandmarkFile& file = reading.file;
  file = format.parse(ReadText(path, format), path.string(), reading.notes);
  file.subject = path.filename().string();
  file.subject.resize(file.subject.size() - format.extension.size());
  std::vector<std::string> faults;
  NameSites(options, file.landmarks, reading.notes, faults);
  NameSites(options, file.absent, reading.notes, faults);
  FindRepeats(file, faults);
  FindUnplaced(path, file, reading.notes, faults);
  if (file.landmarks.empty() && faults.empty()) {
    faults.push_back(fmt::format("there is no landmark; place at least one{}{}",
                                 reading.notes.empty() ? "" : "; ",
                                 fmt::join(reading.notes, "; ")));
  }
  ThrowFaults(path, faults);
  CheckLandmarks(file.landmarks, path.string());
  CheckReach(path, file);
  ChooseAxes(path, options, file, reading.notes);
  TurnToLps(path, file, reading.notes);
  return reading;
}

}  // namespace

LandmarkReading ReadLandmarks(const fs::path& path, const ReadLandmarksOptions& options) {
  const Format& format = FindFormat(path);
  if (format.parse != nullptr) {
    return ReadForeign(path, format, options);
  }
  LandmarkReading reading{.file = ReadLandmarkFileAsWritten(path), .notes = {}};
  std::vector<std::string> faults;
  FindUnplaced(path, reading.file, reading.notes, faults);
  ThrowFaults(path, faults);
  ChooseAxes(path, options, reading.file, reading.notes);
  reading.file = InLpsMm(std::move(reading.file));
  CheckReach(path, reading.file);
  if (reading.file.proposed) {
    reading.notes.push_back(fmt::format(
        "{}: these landmarks are a proposal that no person has confirmed; check each on the skull, "
        "correct it, then set `proposed: false`",
        path.filename().string()));
  }
  return reading;
}

std::string EncodeLandmarks(const LandmarkFile& file, const fs::path& path) {
  const Format& format = FindFormat(path);
  return format.encode(format.parse == nullptr ? file : InLpsMm(file));
}

std::string WrittenAxes(const LandmarkFile& file, const fs::path& path) {
  return FindFormat(path).parse == nullptr ? file.axes : "LPS";
}

std::vector<std::string> LostContents(const LandmarkFile& file, const fs::path& path) {
  const Format& format = FindFormat(path);
  const auto count = [&](auto&& has) { return std::ranges::count_if(file.landmarks, has); };
  const auto measured = count([](const Landmark& l) {
    return l.normal || l.depth_along_normal_mm || l.depth_closest_mm ||
           l.certainty != Certainty::kMedium;
  });
  const auto noted = count([](const Landmark& l) { return !l.note.empty(); });
  std::vector<std::string> lost;
  const auto lose = [&](bool held, auto number, std::string_view what) {
    if (!held && number > 0) {
      lost.push_back(fmt::format("{} of {} landmarks", what, number));
    }
  };
  lose(format.holds_measurements, measured, "normals, depths and certainties");
  lose(format.holds_notes, noted, "notes");
  if (format.parse != nullptr && !file.absent.empty()) {
    lost.push_back(fmt::format("{} sites that are listed as absent", file.absent.size()));
  }
  if (format.parse != nullptr && file.proposed) {
    lost.emplace_back("the mark that they are a proposal, with their expected errors");
  }
  if (WrittenAxes(file, path) != file.axes) {
    lost.push_back(fmt::format(
        "the axes {}; points and normals are turned to LPS (x and y negated)", file.axes));
  }
  return lost;
}

}  // namespace semblance::problems
