// SPDX-License-Identifier: GPL-3.0-or-later
// Face metrics as JSON, for result.json and `semblance evaluate`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "problems/metrics/face_metrics.h"

namespace semblance {

// {mean_abs_mm, rms_mm, median_mm, p95_mm, hausdorff_mm, within_2_5mm, volume_between_cm3,
// enclosed_volume_cm3, ..., normals{}, reverse{}, symmetric{}, regions{}}; null for NaN.
nlohmann::ordered_json SummaryToJson(const DistanceSummary& summary);
nlohmann::ordered_json MetricsToJson(const FaceMetrics& metrics);

}  // namespace semblance
