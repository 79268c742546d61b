// SPDX-License-Identifier: GPL-3.0-or-later
// Plain words for the keys that files use.
#pragma once

#include <string>
#include <string_view>

namespace semblance::problems {

// Words for a key of result.json, with its unit in brackets: "dowel_rms_mm" is "RMS distance of the
// depth markers (mm)". An unknown key is spelled with blanks instead of underscores, its unit last.
std::string WordsOfKey(std::string_view key);

// Words for a metric by its dotted path: "RMS distance (mm) of the recovered face (face.rms_mm)".
// The path is kept, because studies use it as the name of the metric.
std::string WordsOfMetric(std::string_view path);

// Words for the last key of a path: "RMS distance (mm)" for rms_mm. An unknown key is returned as
// it is.
std::string WordsOfMeasure(std::string_view key);

// "Gonion, left (go_l)" for go_l. An unknown site is returned as it is.
std::string WordsOfSite(std::string_view site);

// "1 subject", "2 subjects". `plural` is needed if the noun does not form its plural with an s.
std::string Counted(long long count, std::string_view noun, std::string_view plural = "");

}  // namespace semblance::problems
