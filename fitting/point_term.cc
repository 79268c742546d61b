// SPDX-License-Identifier: GPL-3.0-or-later
#include <ceres/loss_function.h>

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "fitting/linear_cost.h"
#include "fitting/term_cost.h"

namespace semblance {
namespace {

using Indices = std::array<int, 16>;
using Augmented = Eigen::Matrix<double, Eigen::Dynamic, 19>;  // [A | B], a row a point

double WeightSum(const LevelView& view) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    sum += o.weight;
  }
  return sum;
}

// rho(s); the same formulas as ceres::HuberLoss and ceres::CauchyLoss.
double Rho(const PointTerm& term, double s) {
  const double a = term.loss_width_mm;
  switch (term.loss) {
    case RobustLoss::kHuber:
      return s <= a * a ? s : 2 * a * std::sqrt(s) - a * a;
    case RobustLoss::kCauchy:
      return a * a * std::log1p(s / (a * a));
    case RobustLoss::kNone:
      break;
  }
  return s;
}

std::unique_ptr<ceres::LossFunction> MakeLoss(const PointTerm& term, double scale) {
  std::unique_ptr<ceres::LossFunction> loss;
  if (term.loss == RobustLoss::kHuber) {
    loss = std::make_unique<ceres::HuberLoss>(term.loss_width_mm);
  } else {
    loss = std::make_unique<ceres::CauchyLoss>(term.loss_width_mm);
  }
  return std::make_unique<ceres::ScaledLoss>(loss.release(), scale, ceres::TAKE_OWNERSHIP);
}

Eigen::Matrix<double, 1, 19> Row(const Observation& o, double factor) {
  Eigen::Matrix<double, 1, 19> row;
  for (int k = 0; k < 16; ++k) {
    row[k] = o.stencil.weight[k];
  }
  row.tail<3>() = o.position.transpose();
  return factor * row;
}

void AddRows(const Augmented& rows, const Indices& indices,
             std::unique_ptr<ceres::LossFunction> loss, ControlNet& net, ceres::Problem& problem) {
  AddLinearResidual(std::make_shared<const Eigen::MatrixXd>(rows.leftCols<16>()),
                    rows.rightCols<3>(), indices, std::move(loss), net, problem);
}

// At most 19 rows with the same sum of squares for every X: the R of a QR decomposition. More than
// 19 points of a patch cost Ceres no more than 19 (the last three rows hold the constant rest).
Augmented Reduced(const Augmented& rows) {
  if (rows.rows() <= 19) {
    return rows;
  }
  const Eigen::HouseholderQR<Augmented> qr(rows);
  return qr.matrixQR().topRows<19>().triangularView<Eigen::Upper>();
}

void AddByPatch(const PointTerm& term, const LevelView& view, ControlNet& net,
                ceres::Problem& problem) {
  const double scale = term.weight / WeightSum(view);
  std::map<Indices, std::vector<int>> patches;
  for (std::size_t i = 0; i < view.observations.size(); ++i) {
    patches[view.observations[i].stencil.index].push_back(static_cast<int>(i));
  }
  for (const auto& [indices, members] : patches) {
    Augmented rows(members.size(), 19);
    for (std::size_t r = 0; r < members.size(); ++r) {
      const Observation& o = view.observations[members[r]];
      rows.row(r) = Row(o, std::sqrt(scale * o.weight));
    }
    AddRows(Reduced(rows), indices, nullptr, net, problem);
  }
}

// A loss looks at each point by itself, so robust points are not reduced.
void AddByPoint(const PointTerm& term, const LevelView& view, ControlNet& net,
                ceres::Problem& problem) {
  const double scale = term.weight / WeightSum(view);
  for (const Observation& o : view.observations) {
    AddRows(Row(o, 1), o.stencil.index, MakeLoss(term, scale * o.weight), net, problem);
  }
}

}  // namespace

void AddResiduals(const PointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  if (term.loss == RobustLoss::kNone) {
    AddByPatch(term, view, net, problem);
  } else {
    AddByPoint(term, view, net, problem);
  }
}

double TermCost(const PointTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    sum += o.weight * Rho(term, (o.stencil.Apply(net) - o.position).squaredNorm());
  }
  return view.observations.empty() ? 0 : term.weight * sum / WeightSum(view);
}

}  // namespace semblance
