// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the readers of texts and arrays. Numbers that are read are finite, and an H-spline can be
// written and read back; any other input is an Error of this program. The first byte selects the
// reader: c CSV of points, n NPY, h H-spline, f .fcsv, m .mrk.json, p .pp, t point list, l landmark
// table, any other a condition on values.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "problems/config/value_filter.h"
#include "problems/points/point_table.h"
#include "problems/subject/landmark_files/landmark_table.h"
#include "problems/subject/landmark_files/markups_json.h"
#include "problems/subject/landmark_files/point_files.h"
#include "surfaces/base/error.h"
#include "surfaces/base/npy.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace {

using semblance::problems::LandmarkFile;

void Require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

void ReadPoints(std::string_view bytes) {
  const semblance::problems::PointTable table = semblance::problems::ParsePointTable(bytes, "fuzz");
  Require(!table.positions.empty());
  for (const semblance::problems::Vec3& p : table.positions) {
    Require(p.allFinite());
  }
}

void ReadArray(std::string_view bytes) {
  const semblance::problems::NpyArray array = semblance::problems::ParseNpy(bytes, "fuzz");
  std::size_t count = 1;
  for (const std::size_t n : array.shape) {
    count *= n;
  }
  Require(array.values.size() == count);
}

void ReadSurface(std::string_view bytes) {
  const semblance::problems::HSplineSurface surface =
      semblance::problems::HSplineFromJson(bytes, "fuzz");
  const std::string text = semblance::problems::HSplineToJson(surface);
  Require(semblance::problems::HSplineToJson(semblance::problems::HSplineFromJson(text, "fuzz")) ==
          text);
}

void CheckFinite(const LandmarkFile& file) {
  for (const semblance::problems::Landmark& landmark : file.landmarks) {
    for (const double x : landmark.point) {
      Require(std::isfinite(x));
    }
  }
}

void ReadCondition(std::string_view bytes) {
  const std::vector<std::string> names = {"subject", "interp", "implicit.resolution"};
  const semblance::problems::ValueFilter filter(bytes, names);
  filter.Holds({{"subject", "a"}, {"interp", "kriging"}, {"implicit.resolution", "40"}});
}

void Read(char kind, std::string_view bytes) {
  std::vector<std::string> notes;
  switch (kind) {
    case 'c':
      return ReadPoints(bytes);
    case 'n':
      return ReadArray(bytes);
    case 'h':
      return ReadSurface(bytes);
    case 'f':
      return CheckFinite(semblance::problems::ParseFcsv(bytes, "fuzz", notes));
    case 'm':
      return CheckFinite(semblance::problems::ParseMarkupsJson(bytes, "fuzz", notes));
    case 'p':
      return CheckFinite(semblance::problems::ParseMeshLabPoints(bytes, "fuzz"));
    case 't':
      return CheckFinite(semblance::problems::ParsePointList(bytes, "fuzz"));
    case 'l':
      return CheckFinite(semblance::problems::ParseLandmarkTable(bytes, "fuzz", notes));
    default:
      return ReadCondition(bytes);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  try {
    Read(static_cast<char>(data[0]), {reinterpret_cast<const char*>(data) + 1, size - 1});
  } catch (const semblance::problems::Error&) {
  }
  return 0;
}
