// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/residual_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace semblance::problems {
namespace {

// The edges of a net along u or v, and the width of the strip that each vertex stands for.
class NetLengths {
 public:
  // along: (1, 0) for u, (0, 1) for v.
  NetLengths(const ControlNet& net, int along_u, int along_v) : du_(along_u), dv_(along_v) {
    double sum = 0;
    int edges = 0;
    edge_mm_.assign(net.vertices.size(), 0);
    for (int j = 0; j + dv_ < net.rows; ++j) {
      for (int i = 0; i + du_ < net.columns; ++i) {
        edge_mm_[net.Index(i, j)] = (net.At(i + du_, j + dv_) - net.At(i, j)).norm();
        sum += edge_mm_[net.Index(i, j)];
        ++edges;
      }
    }
    least_mm_ = 0.01 * sum / edges;
  }

  // From the vertex to the next one, which must exist.
  double Edge_mm(int vertex) const { return std::max(edge_mm_[vertex], least_mm_); }

  // Half of the edges on both sides; at a border there is one.
  double Width_mm(const ControlNet& net, int i, int j) const {
    double width = 0;
    if (i + du_ < net.columns && j + dv_ < net.rows) {
      width += 0.5 * Edge_mm(net.Index(i, j));
    }
    if (i - du_ >= 0 && j - dv_ >= 0) {
      width += 0.5 * Edge_mm(net.Index(i - du_, j - dv_));
    }
    return width;
  }

 private:
  int du_, dv_;
  std::vector<double> edge_mm_;  // per vertex, to the next one
  double least_mm_ = 0;
};

void Add(int vertex, double weight, FieldRow& row) {
  row.index.push_back(vertex);
  row.weight.push_back(weight);
}

}  // namespace

std::vector<FieldRow> MakeFieldRows(const ControlNet& net, const ResidualFieldOptions& options) {
  const NetLengths along_u(net, 1, 0), along_v(net, 0, 1);
  const double kappa = std::sqrt(8) / options.range_mm;
  const double tau = 1 / (std::sqrt(4 * std::numbers::pi) * kappa * options.sd_mm);
  std::vector<double> width_u, width_v;
  std::vector<FieldRow> rows;
  for (int k = 0; k < net.columns * net.rows; ++k) {
    width_u.push_back(along_u.Width_mm(net, k % net.columns, k / net.columns));
    width_v.push_back(along_v.Width_mm(net, k % net.columns, k / net.columns));
    rows.push_back({{k}, {kappa * kappa * width_u[k] * width_v[k]}});
  }
  // An edge conducts in proportion to the strip across it, and inversely to its length.
  const auto couple = [&](int a, int b, double across_mm, double length_mm) {
    const double weight = across_mm / length_mm;
    rows[a].weight[0] += weight;
    rows[b].weight[0] += weight;
    Add(b, -weight, rows[a]);
    Add(a, -weight, rows[b]);
  };
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const int k = net.Index(i, j);
      if (i + 1 < net.columns) {
        couple(k, k + 1, 0.5 * (width_v[k] + width_v[k + 1]), along_u.Edge_mm(k));
      }
      if (j + 1 < net.rows) {
        const int next = k + net.columns;
        couple(k, next, 0.5 * (width_u[k] + width_u[next]), along_v.Edge_mm(k));
      }
    }
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double scale = tau / std::sqrt(width_u[k] * width_v[k]);
    std::ranges::transform(rows[k].weight, rows[k].weight.begin(),
                           [scale](double weight) { return scale * weight; });
  }
  return rows;
}

}  // namespace semblance::problems
