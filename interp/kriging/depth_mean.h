// SPDX-License-Identifier: GPL-3.0-or-later
// What a Gaussian process of depths varies around.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance {

enum class DepthMean { kConstant, kTable, kCovariates, kGeometry };
constexpr auto EnumNames(DepthMean) {
  return std::to_array<std::string_view>({"constant", "table", "covariates", "geometry"});
}

template <class Visitor>
void MeanField(Visitor& visit, DepthMean& mean) {
  visit(FieldInfo{.name = "mean",
                  .doc = "what the depths vary around: constant, one depth, found with them; "
                         "table, the mean depths of tissue.table on this skull, times one factor "
                         "that is found with them (a fat face is fat everywhere), for depths that "
                         "are not the table's own; covariates, a constant and how hollow the bone "
                         "is over 10 mm and over 40 mm, each times a factor; geometry, "
                         "these, how far the bone lies below its convex hull, which way it faces "
                         "(front, up) and how far the nearer orbit is"},
        mean);
}

// Whether the mean looks at the bone, and so needs a surface.
inline bool LooksAtBone(DepthMean mean) {
  return mean == DepthMean::kCovariates || mean == DepthMean::kGeometry;
}

// The factors that the mean has, and so the fewest dowels, at places of their own, that tell them.
std::size_t FewestDowels(DepthMean mean);

// The regressors of the mean at any point; the process finds their coefficients.
//   constant    1
//   table       t(x): ordinary kriging of the expected depths, by straight distances. Its
//               coefficient is the subject's factor. One regressor, as with a constant: few dowels
//               do.
//   covariates  1 and the bone's relief (BoneRelief) over two scales, from vertices 3 mm apart
//   geometry    these and where the place lies in the head (BoneGeometry): seven in all
class MeanRegressors {
 public:
  // Throws InputError, naming the scheme, if there is nothing expected but the mean asks for it,
  // if the skull has no triangle but the mean looks at the bone, if there are fewer dowels than
  // regressors, or, for geometry, as FrameOfHead.
  MeanRegressors(DepthMean mean, std::string_view scheme, const DepthInput& input,
                 const RunContext& run);
  ~MeanRegressors();
  MeanRegressors(const MeanRegressors&) = delete;
  MeanRegressors& operator=(const MeanRegressors&) = delete;

  // q x m: of m points, on the skull where they are nearest to it.
  Eigen::MatrixXd At(std::span<const Vec3> points, const RunContext& run) const;
  // q x vertices of the skull: the same there, faster.
  Eigen::MatrixXd AtVertices(const RunContext& run) const;

 private:
  struct Bone;
  DepthMean mean_;
  const DepthInput& input_;
  std::unique_ptr<Bone> bone_;  // where the mean looks at it
};

}  // namespace semblance
