// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/conditional/site_correlation.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "problems/subject/sites.h"

namespace semblance {
namespace {

std::vector<std::string> AllSites() {
  std::vector<std::string> sites = StandardSiteCodes();
  for (const Site& site : FurtherSites()) {
    sites.push_back(site.code);
  }
  sites.emplace_back("bmi");
  return sites;
}

double Least(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues().minCoeff();
}

// Each part is a kernel, so their sum is no smaller than what sites have of their own.
TEST(ModelledCorrelation, IsPositiveDefiniteForAllSites) {
  for (const SiteCorrelation& o :
       {SiteCorrelation{}, SiteCorrelation{.common = 0, .twins = 0.99, .own = 0.01},
        SiteCorrelation{.common = 0.9, .twins = 0, .own = 0.01, .length_mm = 500}}) {
    EXPECT_GE(Least(ModelledCorrelation(o, AllSites())), o.own - 1e-9);
  }
}

TEST(ModelledCorrelation, IsHighestForTwinsAndNeighbours) {
  const std::vector<std::string> sites = {"zy_l", "zy_r", "lo_l", "me", "bmi"};
  const Eigen::MatrixXd r = ModelledCorrelation({}, sites);
  EXPECT_GT(r(0, 1), r(0, 3));
  EXPECT_GT(r(0, 2), r(0, 3));
  EXPECT_GT(r(0, 2), r(1, 2));
  EXPECT_EQ(r(0, 4), 0);
  EXPECT_TRUE(r.diagonal().isOnes());
}

}  // namespace
}  // namespace semblance
