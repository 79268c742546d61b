// SPDX-License-Identifier: GPL-3.0-or-later
// The landmarks that a person placed on a skull, as a file, and the units and axes of such files.
// Inside the program every length is in mm and every point in LPS.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

enum class LengthUnit { kMillimetre, kCentimetre, kInch, kMetre };
constexpr auto EnumNames(LengthUnit) {
  return std::to_array<std::string_view>({"mm", "cm", "in", "m"});
}

// LPS: +x subject left, +y posterior, +z up. RAS is LPS with x and y negated.
enum class Axes { kLps, kRas };
constexpr auto EnumNames(Axes) { return std::to_array<std::string_view>({"LPS", "RAS"}); }

constexpr double Millimetres(LengthUnit unit) {
  constexpr std::array kFactors = {1.0, 10.0, 25.4, 1000.0};
  return kFactors[static_cast<int>(unit)];
}

// Turns a direction, or a point in mm, to LPS.
inline Vec3 ToLps(const Vec3& v, Axes axes) {
  return axes == Axes::kLps ? v : Vec3(-v.x(), -v.y(), v.z());
}

// Converts a point to mm and LPS. A point that is in mm and LPS keeps its exact bits.
inline Vec3 ToLpsMm(const Vec3& p, Axes axes, LengthUnit unit) {
  return unit == LengthUnit::kMillimetre ? ToLps(p, axes) : ToLps(Millimetres(unit) * p, axes);
}

// The observer's certainty of a landmark's position.
enum class Certainty { kHigh, kMedium, kLow };

constexpr auto EnumNames(Certainty) {
  return std::to_array<std::string_view>({"high", "medium", "low"});
}

struct Landmark {
  std::string site;  // "g", "go_l"
  std::array<double, 3> point = {kNaN, kNaN, kNaN};
  std::optional<std::array<double, 3>> normal;
  std::optional<double> depth_along_normal_mm;
  std::optional<double> depth_closest_mm;
  Certainty certainty = Certainty::kMedium;
  std::optional<double> doubt_mm;  // expected error of a proposed point; a person's has none
  std::string note;

  Vec3 Position() const { return {point[0], point[1], point[2]}; }
  void MoveTo(const Vec3& p) { point = {p.x(), p.y(), p.z()}; }
};

// A site and a point, the form in which calculations take landmarks.
struct SitePoint {
  std::string site;
  Vec3 point = Vec3::Constant(kNaN);  // mm
};

// A site that the observer looked for and could not place, because the bone is gone for example.
struct AbsentLandmark {
  std::string site;
  std::string reason;
};

struct LandmarkFile {
  std::string subject;
  std::string units = "mm";            // a name of LengthUnit
  std::string axes = "LPS";            // a name of Axes; empty if the file does not state them
  std::vector<Landmark> landmarks;     // each site once
  std::vector<AbsentLandmark> absent;  // none of the sites above
  bool proposed = false;

  const Landmark* Find(std::string_view site) const;  // null if no landmark has the site
  std::vector<SitePoint> Points() const;              // in the order of the landmarks
};

template <class Visitor>
void Fields(Visitor& visit, Landmark& o) {
  visit(FieldInfo{.name = "site", .doc = "code of the site, with _l or _r if it is one of a pair"},
        o.site);
  visit(FieldInfo{.name = "point", .unit = "mm", .doc = "point on the bone"}, o.point);
  visit(FieldInfo{.name = "normal",
                  .doc = "unit normal, out of the bone; without one the skull's is used"},
        o.normal);
  visit(FieldInfo{.name = "depth_along_normal_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "measured tissue depth along the normal"},
        o.depth_along_normal_mm);
  visit(FieldInfo{.name = "depth_closest_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "measured distance to the closest skin"},
        o.depth_closest_mm);
  visit(FieldInfo{.name = "certainty", .doc = "how certain the position is"}, o.certainty);
  visit(FieldInfo{.name = "doubt_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "expected error of a point that the program proposed; review the largest "
                         "first"},
        o.doubt_mm);
  visit(FieldInfo{.name = "note", .doc = "the observer's remarks"}, o.note);
}

template <class Visitor>
void Fields(Visitor& visit, AbsentLandmark& o) {
  visit(FieldInfo{.name = "site", .doc = "code of the site"}, o.site);
  visit(FieldInfo{.name = "reason", .doc = "why it cannot be placed"}, o.reason);
}

template <class Visitor>
void Fields(Visitor& visit, LandmarkFile& o) {
  visit(FieldInfo{.name = "subject", .doc = "name of the subject, for messages"}, o.subject);
  visit(FieldInfo{.name = "units", .doc = "unit of the points; depths are always in mm"}, o.units);
  visit(FieldInfo{.name = "axes",
                  .doc = "axes of points and normals; LPS: +x subject left, +y posterior, +z up; "
                         "RAS: x and y negated"},
        o.axes);
  visit(FieldInfo{.name = "landmarks", .doc = "the landmarks that were placed"}, o.landmarks);
  visit(FieldInfo{.name = "absent", .doc = "the sites that cannot be placed, with the reason"},
        o.absent);
  visit(FieldInfo{.name = "proposed",
                  .doc = "true: the program proposed the points and no person has confirmed them; "
                         "set it to false after you have checked each of them"},
        o.proposed);
}

// Reads a YAML file in its own units and axes; ReadLandmarks (read_landmarks.h) reads every kind of
// file. Throws IoError if the file cannot be read. Throws ConfigError, with a line for each fault,
// if the file has no landmark, a site is neither standard nor further (sites.h), a site appears
// twice (also if once as absent), a point is missing, or the length of a normal differs from 1 by
// more than 1 %.
LandmarkFile ReadLandmarkFileAsWritten(const std::filesystem::path& path);

// Checks landmarks from other kinds of files as ReadLandmarkFileAsWritten checks YAML: the ranges
// of depths and the length of normals. `file` is the name for messages. Throws ConfigError with a
// line for each fault, which names the site.
void CheckLandmarks(std::span<const Landmark> landmarks, const std::string& file);

// Converts points and normals to mm and LPS. `file.units` and `file.axes` must be names of their
// enums.
LandmarkFile InLpsMm(LandmarkFile file);

}  // namespace semblance::problems
