// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/skin_landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>

#include "problems/face/head_formula.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The points of Multi-PIE that are named facial landmarks. The subject's right comes first.
const std::map<int, std::string> kMultiPie = {
    {31, "prn"},  {34, "sn"},   {32, "sbal_r"}, {36, "sbal_l"}, {37, "ex_r"},
    {40, "en_r"}, {43, "en_l"}, {46, "ex_l"},   {49, "ch_r"},   {55, "ch_l"},
    {52, "ls"},   {58, "li"},   {63, "sto"}};

Vec3 ReadPoint(const CsvReader& csv, const std::array<std::size_t, 3>& columns) {
  return {csv.Number(columns[0]), csv.Number(columns[1]), csv.Number(columns[2])};
}

std::array<std::size_t, 3> PointColumns(const CsvReader& csv) {
  const std::string_view unit = csv.Find("x_mm") ? "_mm" : "";
  return {csv.RequireColumn(fmt::format("x{}", unit)), csv.RequireColumn(fmt::format("y{}", unit)),
          csv.RequireColumn(fmt::format("z{}", unit))};
}

void CheckCode(const CsvReader& csv, const std::string& code) {
  const std::vector<std::string> facial = FacialLandmarkCodes();
  if (!StandardSiteFault(code).empty() && std::ranges::find(facial, code) == facial.end()) {
    csv.Fail(
        fmt::format("landmark '{}' is neither one of the 32 sites (configs/networks/"
                    "standard32.yaml) nor one of {}; correct the name or drop the row",
                    code, fmt::join(facial, ", ")));
  }
}

std::optional<std::string> MultiPieCode(const CsvReader& csv, double number) {
  if (!(number >= 1 && number <= 68 && number == static_cast<int>(number))) {
    csv.Fail(fmt::format("i_multipie is {}; it must be a whole number from 1 to 68", number));
  }
  const auto found = kMultiPie.find(static_cast<int>(number));
  return found == kMultiPie.end() ? std::nullopt : std::optional(found->second);
}

void ReadCsv(const fs::path& file, SkinLandmarks& landmarks) {
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const auto multipie = csv.Find("i_multipie");
  const std::size_t name = multipie ? *multipie : csv.RequireColumn("site");
  const std::array<std::size_t, 3> columns = PointColumns(csv);
  while (csv.NextRow()) {
    const std::optional<std::string> code =
        multipie ? MultiPieCode(csv, csv.Number(name)) : std::string(csv.Cell(name));
    if (code) {
      CheckCode(csv, *code);
      landmarks.points.push_back({*code, ReadPoint(csv, columns)});
    }
  }
}

bool HasDepth(const Landmark& landmark) {
  return landmark.depth_along_normal_mm || landmark.depth_closest_mm;
}

void ReadSkullLandmarks(const fs::path& file, SkinLandmarks& landmarks) {
  ReadLandmarksOptions options;
  options.place = PointsLieOn::kSkin;
  LandmarkReading reading = ReadLandmarks(file, options);
  std::ranges::move(reading.notes, std::back_inserter(landmarks.notes));
  const LandmarkFile& skull = reading.file;
  const bool on_skin = std::ranges::none_of(skull.landmarks, HasDepth);
  for (const Landmark& landmark : skull.landmarks) {
    const std::optional<double>& depth_mm = landmark.depth_along_normal_mm;
    if (on_skin) {
      landmarks.points.push_back({landmark.site, landmark.Position()});
    } else if (depth_mm && landmark.normal) {
      landmarks.points.push_back(
          {landmark.site, landmark.Position() + *depth_mm * Vec3(landmark.normal->data())});
    } else {
      landmarks.notes.push_back(
          fmt::format("{}: site {} has no depth along a normal, so its skin point is not known; "
                      "it was left out",
                      file.string(), DescribeSite(landmark.site)));
    }
  }
}

void CheckOnce(const SkinLandmarks& landmarks) {
  std::map<std::string, int> count;
  for (const SkinLandmark& landmark : landmarks.points) {
    if (++count[landmark.code] > 1) {
      throw InputError(
          fmt::format("landmark '{}' appears twice; keep one of the two", landmark.code));
    }
  }
}

}  // namespace

SkinLandmarks ReadSkinLandmarks(std::span<const fs::path> files) {
  SkinLandmarks landmarks;
  for (const fs::path& file : files) {
    if (LowerCase(file.extension().string()) == ".csv") {
      ReadCsv(file, landmarks);
    } else {
      ReadSkullLandmarks(file, landmarks);
    }
  }
  if (landmarks.points.empty()) {
    throw InputError("no landmark was given; name at least one file of landmarks");
  }
  CheckOnce(landmarks);
  return landmarks;
}

}  // namespace semblance::problems
