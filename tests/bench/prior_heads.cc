// SPDX-License-Identifier: GPL-3.0-or-later
// Where the face of real heads is off, and whether sigma knows: signed figures by part of the face,
// of the face and of the implicit face it rests on, the way from the true tip of the nose to the
// face's, and the 90 % interval by part. Two of the heads are beside the project, not in it.
//   prior_heads HEADS [OPTION=VALUE;...]...: HEADS is a list like heads/vhm_prior,cranium_measured
// of files in configs/; each further argument is a variant, the empty one the defaults.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "problems/io/disk_cache.h"
#include "problems/run.h"

namespace semblance::problems {
namespace {

std::vector<std::string> Split(std::string_view text, char at) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(at), text.size());
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

void PrintMetrics(const char* what, const FaceMetrics& m) {
  const DistanceSummary& s = m.truth_to_face;
  fmt::print("  {:9} {:.3f} mm {:4.1f} %  p95 {:.2f} signed {:+.2f} |", what, s.mean_abs_mm,
             100 * s.within_2_5mm, s.p95_mm, s.mean_signed_mm);
  for (const auto& [name, part] : m.regions) {
    fmt::print(" {} {:.2f} ({:+.2f})", name, part.mean_abs_mm, part.mean_signed_mm);
  }
  fmt::print("\n");
}

void PrintPoints(const RunResult& result) {
  for (const FeatureError& feature : result.truth->details.features) {
    const Mat3 back = result.subject.basis.sites->skull_from_average.rotation.transpose();
    const Vec3 way = back * (feature.on_face - feature.on_truth);
    fmt::print("  {} {:.1f} mm: left {:+.1f} front {:+.1f} up {:+.1f}\n", feature.name,
               feature.Error_mm(), way.x(), -way.y(), way.z());
  }
  for (const AppliedRule& rule : result.rules) {
    fmt::print("  rule {} of {} ({}): {:+.1f} mm\n", rule.rule, rule.point, rule.coordinate,
               rule.residual_mm);
  }
}

void PrintCoverage(const SigmaCoverage& sigma, double median_mm) {
  fmt::print("  90 % interval {:3.0f} % (median sigma {:.2f} mm):", 100 * sigma.at_90, median_mm);
  for (const auto& [part, share] : sigma.of_part) {
    fmt::print(" {} {:.0f}", part, 100 * share);
  }
  fmt::print("\n");
}

void Measure(const std::string& head, const std::string& variant, StageCache& cache) {
  std::vector<std::string> overrides = Split(variant, ';');
  overrides.emplace_back("bust=none");
  const std::filesystem::path file = SEMBLANCE_SOURCE_DIR "/configs/" + head + ".yaml";
  const RunResult result = Run(ReadConfig<Experiment>(file, overrides), {}, &cache);
  fmt::print("{} [{}]\n", head, variant);
  if (result.truth) {
    PrintMetrics("implicit", result.truth->implicit);
    PrintMetrics("face", result.truth->face);
    PrintPoints(result);
    PrintCoverage(result.truth->sigma, result.uncertainty ? result.uncertainty->median_mm : kNaN);
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace semblance::problems

int main(int argc, char** argv) {
  using namespace semblance::problems;
  try {
    StageCache cache(16, std::make_shared<DiskCache>(
                             std::filesystem::temp_directory_path() / "semblance_prior_heads",
                             std::uintmax_t{4} << 30));
    for (const std::string& head : Split(argc > 1 ? argv[1] : "cranium_measured", ',')) {
      for (int k = 2; k < std::max(argc, 3); ++k) {
        Measure(head, k < argc ? argv[k] : "", cache);
      }
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
