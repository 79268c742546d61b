// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks from whatever program placed them, and for it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"

namespace semblance {

struct ReadLandmarksOptions {
  std::optional<Axes> axes;        // of a file that does not say; none: LPS, and a note
  bool leave_out_unknown = false;  // points whose name is not a site, with a note each
};

// Landmarks in LPS and mm, and what people should know of how they were read.
struct LandmarkReading {
  LandmarkFile file;
  std::vector<std::string> notes;
};

// The format follows the extension: .yaml or .yml (ours), .mrk.json and .fcsv (3D Slicer), .pp
// (MeshLab), .txt and .asc (CloudCompare), .csv. Sites may go by any name that SiteCalled knows.
// RAS is turned to LPS, and a note says so. Throws IoError if the file cannot be read or is not of
// its format; InputError with a line per fault if a name is no site (and may not be left out), a
// site appears twice, there is no landmark, a coordinate is beyond all reach, or options.axes
// contradicts the file; ConfigError as ReadLandmarkFileAsWritten does, for whatever kind of file.
LandmarkReading ReadLandmarks(const std::filesystem::path& path,
                              const ReadLandmarksOptions& options = {});

// The bytes of a file of that kind; all but YAML are in mm and LPS, whatever `file` is in. Throws
// InputError for an extension that is none of those above.
std::string EncodeLandmarks(const LandmarkFile& file, const std::filesystem::path& path);

// The axes of those bytes: "LPS" or "RAS".
std::string AxesIn(const LandmarkFile& file, const std::filesystem::path& path);

// What `file` holds that a file of that kind has no place for, a line each; empty if all goes in.
std::vector<std::string> LostIn(const LandmarkFile& file, const std::filesystem::path& path);

}  // namespace semblance
