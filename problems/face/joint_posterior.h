// SPDX-License-Identifier: GPL-3.0-or-later
// The posterior of one step of a joint fit: it states how far the face may be off.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "problems/face/joint_fit.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// The posterior of the unknowns of a step (pose, coefficients, field, vertices of its level) is a
// normal distribution with the covariance H^-1 M H^-1 (sandwich estimator; White 1980). H = J'J is
// the Gauss-Newton matrix of the step's problem, losses included. M is the covariance of the errors
// that pull at the solution. If these were as the problem weighs them, M would be H. But
//   - coefficients have weights.prior.population_sd among people, and mode_sd in the problem;
//   - a shared error shifts all observations by `shared_mm` at once;
//   - observations with `smooth_sd_mm` err like their neighbours: those at p and q have the
//     covariance s_p s_q exp(-|p - q|^2 / (2 length^2)).
class JointPosterior {
 public:
  // At `state`, with the unknowns of a step of `level`. smooth_length_mm > 0. `model` must outlive
  // the posterior. Throws InputError for a level that the model does not have.
  JointPosterior(const VertexModel& model, const JointData& data, const JointWeights& weights,
                 double smooth_length_mm, int level, const JointState& state);
  ~JointPosterior();

  // The standard deviations of the surface's points along unit directions, one per point, mm; NaN
  // if H is not positive definite. One thread; the same input gives the same bytes.
  std::vector<double> DeviationsAlong(std::span<const Vec2> uv,
                                      std::span<const Vec3> directions) const;

  // A face drawn from the posterior; the state itself if H is not positive definite. The same seed
  // gives the same bytes.
  JointState Draw(std::uint64_t random_seed) const;

 private:
  struct Parts;
  const VertexModel& model_;
  int level_;
  JointState state_;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace semblance::problems
