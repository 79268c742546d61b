// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes H-splines and features as JSON. Numbers round-trip to the bit.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "surfaces/hspline/feature.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::surfaces {

// Throws InputError if a vertex is not finite, which JSON cannot express.
void CheckFinite(const HSplineSurface& surface);

// The text is {"format": "semblance-hspline", "version": 1, "patches": [u, v], "max_level": L,
// "closure": ..., "offset_reference": ..., "units": "mm", "level0": [[x, y, z], ...],
// "offsets": [[level, i, j, x, y, z], ...]}, with level0 row by row and offsets in order of
// VertexId. Throws as CheckFinite does.
std::string HSplineToJson(const HSplineSurface& surface);

// Reads the output of HSplineToJson. Throws IoError, beginning with `name`, for anything else:
// invalid JSON, another format or version, unknown or missing entries, wrong sizes, numbers that
// are not finite.
HSplineSurface HSplineFromJson(std::string_view text, const std::string& name);

// Writes the file atomically (atomic_file.h). On failure throws IoError with the path, and `path`
// is unchanged.
void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface);

// Reads a file of WriteHSpline. Throws IoError, with the path, if the file cannot be read or holds
// anything else.
HSplineSurface ReadHSpline(const std::filesystem::path& path);

// The text is {"format": "semblance-feature", "version": 1, "name": ..., "units": "mm",
// "patches": [u, v], "max_level": L, "closure": ..., "offset_reference": ...,
// "offsets": [[level, i, j, x, y, z], ...]}.
std::string FeatureToJson(const Feature& feature);

// Reads the output of FeatureToJson. Throws IoError, beginning with `source`, for anything else.
Feature FeatureFromJson(std::string_view text, const std::string& source);

// Reads the file of one feature. Throws IoError.
Feature ReadFeature(const std::filesystem::path& path);

// Writes folder / (name + ".json"), creates the folder if necessary, and returns the path. Throws
// IoError.
std::filesystem::path StoreFeature(const std::filesystem::path& folder, const Feature& feature);

// Reads all features (.json files) of a library folder, by name. Throws IoError if the folder is
// missing, a file cannot be read, or a file is not named after its feature.
std::map<std::string, Feature> ReadFeatureLibrary(const std::filesystem::path& folder);

}  // namespace semblance::surfaces
