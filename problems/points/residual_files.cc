// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/residual_files.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <vector>

#include "surfaces/base/csv.h"

namespace semblance {
namespace {

// Per point; none of a fit that looks for none.
std::vector<char> OutliersOf(const FitResult& fit) {
  std::vector<char> outlier;
  if (fit.automatic) {
    outlier.assign(fit.uv.size(), 0);
    for (const std::uint32_t k : fit.automatic->outliers) {
      outlier[k] = 1;
    }
  }
  return outlier;
}

void AppendFloat(double value, std::string& bytes) {
  const auto number = static_cast<float>(value);
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  bytes.append(raw, sizeof number);
}

std::vector<std::string> NamesOf(const ResidualColumns& columns, bool outliers) {
  std::vector<std::string> names = {"point", "u", "v", "residual_mm"};
  if (outliers) {
    names.emplace_back("outlier");
  }
  if (!columns.sigma_mm.empty()) {
    names.emplace_back("sigma_mm");
  }
  for (const PointAttribute& attribute : columns.attributes) {
    names.push_back(attribute.name);
    names.push_back(attribute.name + "_residual");
  }
  return names;
}

}  // namespace

std::string ResidualsCsv(const ResidualColumns& columns) {
  const FitResult& fit = columns.fit;
  const std::vector<char> outlier = OutliersOf(fit);
  CsvWriter csv(NamesOf(columns, !outlier.empty()));
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    csv.Add(k, fit.uv[k].x(), fit.uv[k].y(), fit.residual_mm[k]);
    if (!outlier.empty()) {
      csv.Add(int{outlier[k]});
    }
    if (!columns.sigma_mm.empty()) {
      csv.Add(columns.sigma_mm[k]);
    }
    for (std::size_t c = 0; c < columns.attributes.size(); ++c) {
      csv.Add(columns.fitted[c][k], columns.attributes[c].values[k] - columns.fitted[c][k]);
    }
    csv.EndRow();
  }
  return csv.Text();
}

std::string ResidualsPly(const ResidualColumns& columns) {
  const FitResult& fit = columns.fit;
  const std::vector<char> outlier = OutliersOf(fit);
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\nproperty float residual_mm\nproperty float outlier\n",
      fit.uv.size());
  bytes += columns.sigma_mm.empty() ? "" : "property float sigma_mm\n";
  for (const PointAttribute& attribute : columns.attributes) {
    bytes += fmt::format("property float {0}\nproperty float {0}_residual\n", attribute.name);
  }
  bytes += "end_header\n";
  bytes.reserve(bytes.size() + fit.uv.size() * (20 + 8 * columns.attributes.size()));
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    AppendFloat(fit.uv[k].x(), bytes);
    AppendFloat(fit.uv[k].y(), bytes);
    AppendFloat(0, bytes);
    AppendFloat(fit.residual_mm[k], bytes);
    AppendFloat(outlier.empty() ? 0 : outlier[k], bytes);
    if (!columns.sigma_mm.empty()) {
      AppendFloat(columns.sigma_mm[k], bytes);
    }
    for (std::size_t c = 0; c < columns.attributes.size(); ++c) {
      AppendFloat(columns.fitted[c][k], bytes);
      AppendFloat(columns.attributes[c].values[k] - columns.fitted[c][k], bytes);
    }
  }
  return bytes;
}

}  // namespace semblance
