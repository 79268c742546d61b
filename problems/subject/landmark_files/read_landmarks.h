// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes landmarks in the formats of all supported programs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"
#include "problems/subject/sites.h"

namespace semblance::problems {

struct ReadLandmarksOptions {
  std::optional<Axes> axes;  // axes of a file that does not state them; none: LPS, with a note
  bool leave_out_unknown = false;  // skips points whose name is not a site, with a note each
  PointsLieOn place = PointsLieOn::kBone;  // kSkin: "n'" names a point, rather than a fault
};

// Landmarks in LPS and mm, and notes for people on how they were read.
struct LandmarkReading {
  LandmarkFile file;
  std::vector<std::string> notes;
};

// Reads a landmark file. The extension decides the format: .yaml or .yml (ours), .mrk.json and
// .fcsv (3D Slicer), .pp (MeshLab), .txt and .asc (CloudCompare), or .csv. A site may have any name
// that FindSiteByName accepts. RAS is turned to LPS, with a note. Throws IoError if the file cannot
// be read or does not have its format. Throws InputError with a line per fault if a name is no site
// (unless it may be left out), a site appears twice, there is no landmark, a coordinate is above
// 1e9 mm, or options.axes contradicts the file. Throws ConfigError as ReadLandmarkFileAsWritten,
// for every format.
LandmarkReading ReadLandmarks(const std::filesystem::path& path,
                              const ReadLandmarksOptions& options = {});

// The bytes of a landmark file in the format of the path's extension. All formats but YAML are
// written in mm and LPS. Throws InputError for an unknown extension.
std::string EncodeLandmarks(const LandmarkFile& file, const std::filesystem::path& path);

// The axes in which EncodeLandmarks writes: "LPS" or "RAS".
std::string WrittenAxes(const LandmarkFile& file, const std::filesystem::path& path);

// Lists, a line each, the contents of `file` that are lost in the format; empty if nothing is lost.
std::vector<std::string> LostContents(const LandmarkFile& file, const std::filesystem::path& path);

}  // namespace semblance::problems
