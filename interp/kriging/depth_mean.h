// SPDX-License-Identifier: GPL-3.0-or-later
// The mean of a Gaussian process of depths, and the options that all such processes have.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <string_view>

#include "interp/dowels/depth_input.h"
#include "surfaces/base/fields.h"

namespace semblance::interp {

enum class DepthMean { kConstant, kTable, kCovariates, kGeometry };
constexpr auto EnumNames(DepthMean) {
  return std::to_array<std::string_view>({"constant", "table", "covariates", "geometry"});
}

template <class Visitor>
void MeanField(Visitor& visit, DepthMean& mean) {
  visit(FieldInfo{.name = "mean",
                  .doc = "the mean of the depths: constant, one fitted depth; table, the mean "
                         "depths of tissue.table on this skull times one fitted factor (a fat face "
                         "is fat everywhere), for depths that are not the table's own; covariates, "
                         "a constant and the bone's relief over 10 mm and 40 mm, each with a "
                         "fitted factor; geometry, these, the bone's depth below its convex hull, "
                         "its direction (front, up) and the distance to the nearer orbit"},
        mean);
}

// Returns true if the mean depends on the bone's shape and therefore needs a surface.
inline bool UsesBone(DepthMean mean) {
  return mean == DepthMean::kCovariates || mean == DepthMean::kGeometry;
}

// The number of the mean's factors, which is the smallest number of dowels at distinct places that
// determine them.
std::size_t FewestDowels(DepthMean mean);

// Evaluates the regressors of the mean at any point. The process fits their coefficients.
//   constant    1
//   table       t(x): ordinary kriging of the expected depths, by straight distances. Its
//               coefficient is the subject's factor. One regressor, as with a constant: few dowels
//               do.
//   covariates  1 and the bone's relief (BoneRelief) over two scales, from vertices 3 mm apart
//   geometry    these and where the place lies in the head (BoneGeometry): seven in all
class MeanRegressors {
 public:
  // Throws InputError, with the scheme's name, if the mean needs expected depths and there are
  // none, if it needs the bone's shape and the skull has no triangle, if there are fewer dowels
  // than regressors, or, for geometry, as FindHeadFrame does.
  MeanRegressors(DepthMean mean, std::string_view scheme, const DepthInput& input,
                 const RunContext& run);
  ~MeanRegressors();
  MeanRegressors(const MeanRegressors&) = delete;
  MeanRegressors& operator=(const MeanRegressors&) = delete;

  // The regressors at m points (q x m), each at the skull's point closest to it.
  Eigen::MatrixXd At(std::span<const Vec3> points, const RunContext& run) const;
  // The regressors at the skull's vertices (q x vertices); faster than At.
  Eigen::MatrixXd AtVertices(const RunContext& run) const;

 private:
  struct Bone;
  DepthMean mean_;
  const DepthInput& input_;
  std::unique_ptr<Bone> bone_;  // set if the mean depends on the bone
};

template <class Visitor>
void LengthPriorFields(Visitor& visit, double& median_mm, double& spread) {
  visit(FieldInfo{.name = "length_prior_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "median of the length's log-normal prior; a few dozen dowels hardly "
                         "determine a length, so that their likelihood alone drifts to either end"},
        median_mm);
  visit(
      FieldInfo{
          .name = "length_prior_spread",
          .min = 1e-3,
          .max = 10,
          .doc = "standard deviation of the length's logarithm in the prior: with 0.5 the length "
                 "is within a factor of 2.7 of the median with 95 %; large: likelihood alone"},
      spread);
}

template <class Visitor, class Signal>
void SignalField(Visitor& visit, Signal& signal_mm) {
  visit(FieldInfo{.name = "signal_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "standard deviation of the depth around its mean, the same all over the "
                         "skull; none: by maximum likelihood"},
        signal_mm);
}

template <class Visitor>
void NuggetShareField(Visitor& visit, double& share) {
  visit(FieldInfo{.name = "nugget_share",
                  .min = 0,
                  .max = 10,
                  .doc = "uncertainty of a dowel's depth, in units of its sd_mm (without sd_mm: "
                         "certain); 0 interpolates every dowel, more smooths"},
        share);
}

// The variance of a dowel's depth by that option; 0 without an sd.
inline double Nugget_mm2(double nugget_share, double sd_mm) {
  const double nugget_mm = nugget_share * sd_mm;
  return std::isfinite(nugget_mm) ? nugget_mm * nugget_mm : 0;
}

template <class Visitor>
void StateSdField(Visitor& visit, bool& state_sd) {
  visit(
      FieldInfo{
          .name = "state_sd",
          .doc =
              "compute sd_mm at each vertex; costs the square of the number of dowels per vertex"},
      state_sd);
}

}  // namespace semblance::interp
