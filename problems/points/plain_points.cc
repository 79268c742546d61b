// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/plain_points.h"

#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

namespace semblance {
namespace {

// Past a line's end; false if there is something else.
bool TakeLineEnd(const char*& at, const char* end) {
  at += at + 1 < end && at[0] == '\r' && at[1] == '\n' ? 1 : 0;
  const bool ends = at == end || *at == '\n';
  at += at != end && ends ? 1 : 0;
  return ends;
}

}  // namespace

PlainPoints::PlainPoints(PointColumns columns)
    : columns_(std::move(columns)),
      has_uv_(columns_.Has(PointColumn::kU)),
      has_weight_(columns_.Has(PointColumn::kWeight)),
      has_sigma_(columns_.Has(PointColumn::kSigma)),
      has_exact_(columns_.Has(PointColumn::kExact)),
      values_(columns_.Kinds(), 0.0) {
  table_.weights_of_sigma = has_sigma_;
  for (const std::string& attribute : columns_.attributes) {
    table_.attributes.push_back({attribute, {}});
  }
}

void PlainPoints::Reserve(std::size_t count) {
  table_.positions.reserve(count);
  table_.uv.reserve(has_uv_ ? count : 0);
  table_.weights.reserve(has_weight_ || has_sigma_ ? count : 0);
  for (PointAttribute& attribute : table_.attributes) {
    attribute.values.reserve(count);
  }
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
  for (std::size_t k = 0; k < columns_.kinds.size(); ++k) {
    if (k > 0 && (at == end || *at++ != ',')) {
      return false;
    }
    double& value = values_[columns_.kinds[k]];
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || !std::isfinite(value)) {
      return false;
    }
    at = next;
  }
  return AddPoint() && TakeLineEnd(at, end);
}

bool PlainPoints::AddExactness() {
  const auto value = [&](PointColumn column) { return values_[static_cast<std::size_t>(column)]; };
  const double exact = value(PointColumn::kExact);
  if (exact == 1) {
    AddExact(table_, table_.positions.size() - 1,
             {value(PointColumn::kNx), value(PointColumn::kNy), value(PointColumn::kNz)});
  }
  return exact == 0 || exact == 1;
}

bool PlainPoints::AddPoint() {
  const auto value = [&](PointColumn column) { return values_[static_cast<std::size_t>(column)]; };
  table_.positions.emplace_back(value(PointColumn::kX), value(PointColumn::kY),
                                value(PointColumn::kZ));
  if (has_uv_) {
    table_.uv.emplace_back(value(PointColumn::kU), value(PointColumn::kV));
  }
  if (has_exact_ && !AddExactness()) {
    return false;
  }
  for (std::size_t k = 0; k < table_.attributes.size(); ++k) {
    table_.attributes[k].values.push_back(values_[kPointColumns + k]);
  }
  if (has_weight_ || has_sigma_) {
    const double sigma = value(PointColumn::kSigma),
                 weight = has_weight_ ? value(PointColumn::kWeight) : 1 / (sigma * sigma);
    table_.weights.push_back(weight);
    return weight > 0 && std::isfinite(weight) && (has_weight_ || sigma > 0);
  }
  return true;
}

}  // namespace semblance
