// SPDX-License-Identifier: GPL-3.0-or-later
// Folders that look like those of runs: a scene with simple surfaces, and depth markers.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "problems/report/view/view_mesh.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "tests/testing/shapes.h"

namespace semblance::testing {

// A ball of the radius around the average skull's face as skull, face and true skin, and dowels of
// 10 mm along -y at the standard sites.
inline void WriteSmallRun(const std::filesystem::path& folder, double radius_mm) {
  std::filesystem::create_directories(folder);
  nlohmann::ordered_json scene = {{"layers", nlohmann::ordered_json::array()},
                                  {"blobs", nlohmann::ordered_json::object()}};
  double size = radius_mm;
  for (const char* id : {"skull", "face", "skin"}) {
    scene["layers"].push_back({{"id", id}, {"mesh", id}});
    scene["blobs"][id] = EncodeMeshBlob(SphereMesh({0, 60, -40}, size, 16));
    size += 2;
  }
  CsvWriter dowels(
      {"site", "base_x_mm", "base_y_mm", "base_z_mm", "tip_x_mm", "tip_y_mm", "tip_z_mm"});
  for (const std::string& site : StandardSiteCodes()) {
    const Vec3 base = AverageSite(site);
    dowels.Row(site, base.x(), base.y(), base.z(), base.x(), base.y() - 10, base.z());
  }
  WriteFileAtomically(folder / "scene.json", scene.dump());
  WriteFileAtomically(folder / "dowels.csv", dowels.Text());
  WriteFileAtomically(folder / "result.json", "{}");
}

}  // namespace semblance::testing
