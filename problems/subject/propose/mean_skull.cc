// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/mean_skull.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "problems/subject/propose/mean_skull_files.h"
#include "problems/subject/propose/skull_pose.h"
#include "surfaces/base/csv.h"
#include "surfaces/mesh_files/read_off.h"

namespace semblance::problems {
namespace {

void ReadModes(MeanSkull& mean) {
  constexpr double kUnit_mm = 0.1;
  CsvReader csv(MeanSkullModes(), "modes.csv");
  mean.modes.resize(csv.Columns().size() / 3);
  while (csv.NextRow()) {
    for (std::size_t k = 0; k < mean.modes.size(); ++k) {
      mean.modes[k].emplace_back(
          kUnit_mm * Vec3(csv.Number(3 * k), csv.Number(3 * k + 1), csv.Number(3 * k + 2)));
    }
  }
}

void ReadSites(ReferenceHead& head) {
  CsvReader csv(MeanSkullSites(), "sites.csv");
  const std::array columns = {csv.RequireColumn("x"), csv.RequireColumn("y"),
                              csv.RequireColumn("z")};
  const std::size_t site = csv.RequireColumn("site"), error = csv.RequireColumn("error_mm");
  while (csv.NextRow()) {
    const Vec3 point(csv.Number(columns[0]), csv.Number(columns[1]), csv.Number(columns[2]));
    head.sites.push_back({std::string(csv.Cell(site)), point});
    head.error_of_site_mm[std::string(csv.Cell(site))] = csv.Number(error);
  }
}

// A place on the mean skull that moves with its modes: the corners of its triangle with weights.
struct ModelPoint {
  Vec3 mean = Vec3::Zero(), normal = Vec3::Zero();
  MeshPoint at;
};

class ModelFit {
 public:
  ModelFit(const MeanSkull& mean, const SkullShell& skull, const Similarity& start,
           std::span<const SitePoint> known)
      : mean_(mean),
        skull_(skull),
        pose_(start),
        coefficients_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(mean.modes.size()))) {
    constexpr double kCell_mm = 7;  // 1 to 2 thousand points; fewer miss arches, more cost time
    for (const ShellPoint& p : SpreadPoints(mean.head.shell, kCell_mm)) {
      surface_.push_back(
          {p.position, p.normal, mean.head.shell.surface.query().Closest(p.position)});
    }
    for (const SitePoint& s : known) {
      for (const SitePoint& own : mean.head.sites) {
        if (own.site == s.site) {
          known_.push_back({own.point, {}, mean.head.shell.surface.query().Closest(own.point)});
          targets_.push_back(s.point);
        }
      }
    }
  }

  AdaptedSkull Run() {
    // The first rounds reach farther, because the start may be off by a centimetre.
    constexpr std::array kReaches_mm = {20.0, 20.0, 16.0, 12.0, 12.0, 10.0, 10.0, 8.0, 8.0, 8.0};
    for (const double reach_mm : kReaches_mm) {
      Step(reach_mm);
    }
    return {Adapted(), pose_};
  }

 private:
  Vec3 Displacement(std::size_t mode, const MeshPoint& at) const {
    const Triangle& t = mean_.head.shell.mesh.triangles[at.triangle];
    const std::vector<Vec3>& moves = mean_.modes[mode];
    return at.weights[0] * moves[t[0]] + at.weights[1] * moves[t[1]] + at.weights[2] * moves[t[2]];
  }

  Vec3 InModel(const ModelPoint& p) const {
    Vec3 place = p.mean;
    for (std::size_t k = 0; k < mean_.modes.size(); ++k) {
      place += coefficients_[static_cast<Eigen::Index>(k)] * Displacement(k, p.at);
    }
    return place;
  }

  // Adds the rows directions' * (moved point - target) with one weight. The unknowns are a small
  // turn, a shift, the logarithm of a growth, and the changes of the coefficients.
  template <int kRows>
  void AddRows(const ModelPoint& p, const Vec3& target,
               const Eigen::Matrix<double, 3, kRows>& directions, double weight) {
    const Vec3 moved = pose_ * InModel(p), arm = moved - pose_.translation;
    Eigen::MatrixXd jacobian(3, size_);
    jacobian.leftCols<3>() = -CrossMatrix(arm);
    jacobian.middleCols<3>(3) = Mat3::Identity();
    jacobian.col(6) = arm;
    for (std::size_t k = 0; k < mean_.modes.size(); ++k) {
      jacobian.col(7 + static_cast<Eigen::Index>(k)) =
          pose_.scale * (pose_.rotation * Displacement(k, p.at));
    }
    const Eigen::MatrixXd rows = directions.transpose() * jacobian;
    normal_matrix_.noalias() += weight * rows.transpose() * rows;
    right_.noalias() += weight * rows.transpose() * (directions.transpose() * (target - moved));
  }

  void Step(double reach_mm) {
    // The model has a standard error of about 2 mm beside its modes, and neighbouring points share
    // it: all points together count as about 200 independent ones, so that noise does not drive the
    // coefficients. A click is good to 1.5 mm.
    constexpr double kError_mm = 2, kIndependent = 200, kClick_mm = 1.5;
    constexpr double kFacesAlike = 0.5;
    size_ = 7 + coefficients_.size();
    normal_matrix_ = Eigen::MatrixXd::Zero(size_, size_);
    right_ = Eigen::VectorXd::Zero(size_);
    const double one = std::min(1.0, kIndependent / static_cast<double>(surface_.size())) /
                       (kError_mm * kError_mm);
    for (const ModelPoint& p : surface_) {
      const auto q = skull_.surface.Find(pose_ * InModel(p), pose_.rotation * p.normal,
                                         {.reach_mm = reach_mm, .least_cosine = kFacesAlike});
      if (q) {
        const double share = std::pow(q->point.distance_mm / reach_mm, 2);
        AddRows<1>(p, q->point.position, q->normal, one * (1 - share) * (1 - share));
      }
    }
    for (std::size_t k = 0; k < known_.size(); ++k) {
      AddRows<3>(known_[k], targets_[k], Mat3::Identity(), 1 / (kClick_mm * kClick_mm));
    }
    normal_matrix_.diagonal().tail(coefficients_.size()).array() += 1;
    right_.tail(coefficients_.size()) -= coefficients_;
    normal_matrix_.diagonal().head<7>().array() += 1e-6;  // keeps it regular without any match
    Move(normal_matrix_.ldlt().solve(right_));
  }

  void Move(const Eigen::VectorXd& x) {
    constexpr double kMaxTurn = 0.3, kMaxGrowth = 0.1;  // radians, log scale; they damp the step
    Vec3 turn = x.head<3>();
    turn *= std::min(1.0, kMaxTurn / std::max(turn.norm(), 1e-12));
    if (turn.norm() > 1e-12) {
      pose_.rotation =
          Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * pose_.rotation;
    }
    pose_.scale *= std::exp(std::clamp(x[6], -kMaxGrowth, kMaxGrowth));
    pose_.translation += x.segment<3>(3);
    coefficients_ += x.tail(coefficients_.size());
  }

  ReferenceHead Adapted() const {
    TriMesh mesh = mean_.head.shell.mesh;
    for (std::size_t k = 0; k < mean_.modes.size(); ++k) {
      for (std::size_t v = 0; v < mesh.points.size(); ++v) {
        mesh.points[v] += coefficients_[static_cast<Eigen::Index>(k)] * mean_.modes[k][v];
      }
    }
    std::vector<SitePoint> sites = mean_.head.sites;
    for (SitePoint& s : sites) {
      s.point = InModel({s.point, {}, mean_.head.shell.surface.query().Closest(s.point)});
    }
    return {.name = mean_.head.name,
            .shell = AsShell(std::move(mesh)),
            .sites = std::move(sites),
            .site_error_mm = mean_.head.site_error_mm,
            .error_of_site_mm = mean_.head.error_of_site_mm};
  }

  const MeanSkull& mean_;
  const SkullShell& skull_;
  Similarity pose_;
  Eigen::VectorXd coefficients_;
  std::vector<ModelPoint> surface_, known_;
  std::vector<Vec3> targets_;  // one per known point
  Eigen::Index size_ = 0;      // number of unknowns
  Eigen::MatrixXd normal_matrix_;
  Eigen::VectorXd right_;
};

}  // namespace

MeanSkull ReadMeanSkull() {
  constexpr double kSiteError_mm = 4;  // where sites.csv states no error
  MeanSkull mean{.head = {.name = "mean skull",
                          .shell = AsShell(ReadOff(MeanSkullMesh(), "mean.off")),
                          .sites = {},
                          .site_error_mm = kSiteError_mm,
                          .error_of_site_mm = {}},
                 .modes = {}};
  ReadModes(mean);
  ReadSites(mean.head);
  return mean;
}

AdaptedSkull AdaptMeanSkull(const MeanSkull& mean, const SkullShell& skull, const Similarity& start,
                            std::span<const SitePoint> known) {
  return ModelFit(mean, skull, start, known).Run();
}

}  // namespace semblance::problems
