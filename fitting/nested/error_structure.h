// SPDX-License-Identifier: GPL-3.0-or-later
// Errors that points share: values that were rounded to a lattice, and runs of points in the order
// of the file, as a scanner's lines, that drift together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fitting/nested/leaf_sums.h"

namespace semblance::fitting {

// The step of which all z are whole multiples apart, if many points share a z, as whole numbers do;
// else 0.
double FindLatticeStep(std::span<const Vec3> positions);

// Returns whether most points lie along lines, as those of contours do. Their z are exact although
// they are few values.
bool LieAlongLines(const NestedPoints& points);

// Runs of consecutive points of the file.
struct FileRuns {
  std::vector<std::uint32_t> run;  // per point of the curve; kNone: in no run
  std::uint32_t count = 0;
  static constexpr std::uint32_t kNone = 0xffffffff;
};
// Finds the runs of a file in which consecutive points are neighbours; a run ends where the next
// point is far away, or where the way turns back. No runs if the file has another order, or fewer
// than twenty runs, or more than two million points.
FileRuns FindFileRuns(const NestedPoints& points);

// The design effect of correlated residuals: the variance of sums of residuals over that of
// independent ones. It takes the largest over blocks of 16, 64 and 256 points of the curve and over
// the runs of the file, as far as it differs from 1 by more than three standard errors.
class DesignEffect {
 public:
  explicit DesignEffect(const FileRuns& runs) : runs_(runs), of_runs_(runs.count) {}

  // Adds the residuals of the points along the curve, outliers apart, in their order.
  void Add(std::size_t k, const NestedResidual& residual);
  double Value() const;  // >= 1

 private:
  static constexpr std::array<std::size_t, 3> kBlocks = {16, 64, 256};
  struct Sums {
    double squares_of_sums = 0;
    std::size_t blocks = 0;
    NestedResidual sum;
  };
  struct RunSum {
    NestedResidual sum;
    std::size_t count = 0;
  };
  const FileRuns& runs_;
  std::vector<RunSum> of_runs_;
  std::array<Sums, kBlocks.size()> sums_;
  double squares_ = 0;
  std::size_t count_ = 0;
};

// Returns whether far more outliers have another one among the eight points next to them on the
// curve than by chance, as on a ridge that is narrower than the points' spacing.
bool StandTogether(const std::vector<char>& outlier);
// The outliers that have another one there, ascending.
std::vector<std::uint32_t> FindOutliersTogether(const std::vector<char>& outlier);

}  // namespace semblance::fitting
