// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/timing_json.h"

#include <nlohmann/json.hpp>

namespace semblance {

std::string TimingJson(const std::vector<StepTime>& times, std::optional<double> cpu_s) {
  using Json = nlohmann::ordered_json;
  Json json = {
      {"total_wall_s", 0}, {"cpu_s", cpu_s ? Json(*cpu_s) : Json()}, {"steps", Json::array()}};
  double total_s = 0;
  for (const StepTime& time : times) {
    json["steps"].push_back({{"step", time.step}, {"wall_s", time.wall_s}});
    total_s += time.wall_s;
  }
  json["total_wall_s"] = total_s;
  return json.dump(2) + "\n";
}

}  // namespace semblance
