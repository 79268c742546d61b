// SPDX-License-Identifier: GPL-3.0-or-later
// What readers of a report call the things that files name by keys.
#pragma once

#include <string>
#include <string_view>

namespace semblance {

// A key of result.json, with its unit in brackets: "dowel_rms_mm" is "RMS distance of the depth
// markers (mm)". A key without words of its own has its underscores as blanks and its unit behind.
std::string WordsOfKey(std::string_view key);

// "RMS distance (mm) of the recovered face (face.rms_mm)": a metric by its dotted path, which stays
// beside its words, for it is what a study names.
std::string WordsOfMetric(std::string_view path);

// "RMS distance (mm)" of its last key, rms_mm; the key itself where it has no words.
std::string WordsOfMeasure(std::string_view key);

// "Gonion, left (go_l)"; the code alone where it is no site that is known.
std::string WordsOfSite(std::string_view site);

// "1 subject", "2 subjects"; plural: of the noun, where an s alone does not make it.
std::string Counted(long long count, std::string_view noun, std::string_view plural = "");

}  // namespace semblance
