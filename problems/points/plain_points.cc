// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/plain_points.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

namespace semblance {
namespace {

bool Has(const std::vector<PointColumn>& columns, PointColumn wanted) {
  return std::find(columns.begin(), columns.end(), wanted) != columns.end();
}

// Past a line's end; false if there is something else.
bool TakeLineEnd(const char*& at, const char* end) {
  at += at + 1 < end && at[0] == '\r' && at[1] == '\n' ? 1 : 0;
  const bool ends = at == end || *at == '\n';
  at += at != end && ends ? 1 : 0;
  return ends;
}

}  // namespace

PlainPoints::PlainPoints(std::vector<PointColumn> columns)
    : columns_(std::move(columns)),
      has_uv_(Has(columns_, PointColumn::kU)),
      has_weight_(Has(columns_, PointColumn::kWeight)) {}

void PlainPoints::Reserve(std::size_t count) {
  table_.positions.reserve(count);
  table_.uv.reserve(has_uv_ ? count : 0);
  table_.weights.reserve(has_weight_ ? count : 0);
}

bool PlainPoints::Add(std::string_view lines) {
  const char* at = lines.data();
  const char* const end = at + lines.size();
  while (at != end) {
    if (!AddLine(at, end)) {
      return false;
    }
  }
  return true;
}

bool PlainPoints::AddLine(const char*& at, const char* end) {
  std::array<double, kPointColumns> values{};
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    if (k > 0 && (at == end || *at++ != ',')) {
      return false;
    }
    double& value = values[static_cast<std::size_t>(columns_[k])];
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || !std::isfinite(value)) {
      return false;
    }
    at = next;
  }
  const auto& [x, y, z, u, v, weight] = values;
  table_.positions.emplace_back(x, y, z);
  if (has_uv_) {
    table_.uv.emplace_back(u, v);
  }
  if (has_weight_) {
    table_.weights.push_back(weight);
  }
  return TakeLineEnd(at, end) && (!has_weight_ || weight > 0);
}

}  // namespace semblance
