// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/conditional/site_correlation.h"

#include <cmath>

#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"

namespace semblance {
namespace {

Vec3 Folded(const Vec3& p) { return {std::abs(p.x()), p.y(), p.z()}; }

bool IsSite(const std::string& name) { return IsStandardSite(name) || IsFurtherSite(name); }

double Between(const SiteCorrelation& o, const std::string& a, const std::string& b) {
  if (!IsSite(a) || !IsSite(b)) {
    return 0;
  }
  if (!IsStandardSite(a) || !IsStandardSite(b)) {
    return o.common + (WithoutSide(a) == WithoutSide(b) ? o.twins : 0);
  }
  const Vec3 p = AverageSite(a), q = AverageSite(b);
  const double rest = 1 - o.common - o.twins - o.own;
  return o.common + o.twins * std::exp(-(Folded(p) - Folded(q)).norm() / o.length_mm) +
         rest * std::exp(-(p - q).norm() / o.length_mm);
}

}  // namespace

Eigen::MatrixXd ModelledCorrelation(const SiteCorrelation& options,
                                    std::span<const std::string> names) {
  const auto size = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      correlation(i, j) = correlation(j, i) = Between(options, names[i], names[j]);
    }
  }
  return correlation;
}

}  // namespace semblance
