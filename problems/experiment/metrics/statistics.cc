// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstdint>

#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

double Rounded(double x) { return std::round(x * 1e9) / 1e9; }

constexpr std::size_t kResamples = 4000;

// Draws resample by resample. The first indices of all resamples come first, then the second ones
// and so on, so that BootstrapMean can add to all sums at once.
std::vector<std::uint32_t> DrawResamples(std::size_t size, std::uint64_t random_seed) {
  Random random(random_seed);
  std::vector<std::uint32_t> indices(kResamples * size);
  for (std::size_t k = 0; k < kResamples; ++k) {
    for (std::size_t n = 0; n < size; ++n) {
      indices[n * kResamples + k] = static_cast<std::uint32_t>(random.Index(size));
    }
  }
  return indices;
}

// The indices of all resamples of a sample of this size. Drawing them takes most of the time of a
// bootstrap, and a study has many thousand samples of one size, so that each thread keeps the last
// ones.
const std::vector<std::uint32_t>& ResampleIndices(std::size_t size, std::uint64_t random_seed) {
  struct Drawn {
    std::size_t size = 0;
    std::uint64_t random_seed = 0;
    std::vector<std::uint32_t> indices;
  };
  static thread_local Drawn last;
  if (last.size != size || last.random_seed != random_seed) {
    last = {size, random_seed, DrawResamples(size, random_seed)};
  }
  return last.indices;
}

Interval BootstrapMean(std::span<const double> values, std::uint64_t random_seed) {
  const std::vector<std::uint32_t>& indices = ResampleIndices(values.size(), random_seed);
  std::vector<double> means(kResamples, 0.0);
  for (std::size_t n = 0; n < values.size(); ++n) {
    const std::uint32_t* const drawn = indices.data() + n * kResamples;
    for (std::size_t k = 0; k < kResamples; ++k) {
      means[k] += values[drawn[k]];
    }
  }
  for (double& mean : means) {
    mean /= static_cast<double>(values.size());
  }
  const double low = Quantile(means, 0.025);
  return {low, Quantile(means, 0.975)};
}

// Mean ranks from 1, smallest first.
struct Ranks {
  std::vector<double> rank;
  double tie_term = 0;  // sum of t^3 - t over groups of t equal values
};
Ranks RankAll(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  Ranks ranks{std::vector<double>(values.size()), 0};
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last < order.size() && values[order[last]] == values[order[first]]) {
      ++last;
    }
    for (std::size_t n = first; n < last; ++n) {
      ranks.rank[order[n]] = 0.5 * static_cast<double>(first + 1 + last);
    }
    const auto t = static_cast<double>(last - first);
    ranks.tie_term += t * t * t - t;
    first = last;
  }
  return ranks;
}

// P(W <= w) for n ranks without ties, by counting subsets of 1..n with each sum.
double ExactWilcoxonTail(int n, double w) {
  std::vector<double> ways(n * (n + 1) / 2 + 1, 0);
  ways[0] = 1;
  for (int rank = 1; rank <= n; ++rank) {
    for (int sum = static_cast<int>(ways.size()) - 1; sum >= rank; --sum) {
      ways[sum] += ways[sum - rank];
    }
  }
  double below = 0;
  for (int sum = 0; sum <= static_cast<int>(w); ++sum) {
    below += ways[sum];
  }
  return below / std::pow(2.0, n);
}

double NormalWilcoxonP(int n, double w, double tie_term) {
  const double mean = n * (n + 1) / 4.0;
  const double variance = n * (n + 1.0) * (2 * n + 1.0) / 24 - tie_term / 48;
  const double z = std::max(0.0, std::abs(w - mean) - 0.5) / std::sqrt(variance);
  return std::min(1.0, 2 * boost::math::cdf(boost::math::complement(boost::math::normal(), z)));
}

// The upper 5 % quantile of the studentized range for 2 to 20 treatments and infinite degrees of
// freedom, divided by sqrt 2.
double NemenyiQ(int treatments) {
  constexpr std::array<double, 19> kQ = {1.960, 2.343, 2.569, 2.728, 2.850, 2.949, 3.031,
                                         3.102, 3.164, 3.219, 3.268, 3.313, 3.354, 3.391,
                                         3.426, 3.458, 3.489, 3.517, 3.544};
  return treatments <= 20 ? kQ[treatments - 2] : kNaN;
}

void CheckTable(const std::vector<std::vector<double>>& values) {
  const bool even = !values.empty() &&
                    std::all_of(values.begin(), values.end(),
                                [&](const auto& row) { return row.size() == values[0].size(); });
  if (!even || values.size() < 2 || values[0].size() < 2) {
    throw InputError(
        fmt::format("Friedman test: {} subjects with {} treatments; it needs 2 of each, and a "
                    "value for all",
                    values.size(), values.empty() ? 0 : values[0].size()));
  }
}

}  // namespace

SampleSummary Summarize(std::span<const double> values, std::uint64_t random_seed) {
  SampleSummary s;
  s.n = static_cast<int>(values.size());
  if (values.empty()) {
    return s;
  }
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  s.mean = ArithmeticMean(sorted);
  const std::vector<WeightedValue> alike = SortedValues(sorted);
  s.median = Quantile(alike, 0.5);
  s.quartile_1 = Quantile(alike, 0.25);
  s.quartile_3 = Quantile(alike, 0.75);
  s.min = sorted.front();
  s.max = sorted.back();
  if (s.n >= 2) {
    double squares = 0;
    for (const double v : sorted) {
      squares += (v - s.mean) * (v - s.mean);
    }
    s.sd = std::sqrt(squares / (s.n - 1));
  }
  if (s.n >= 3) {
    s.mean_95 = BootstrapMean(sorted, random_seed);
  }
  return s;
}

WilcoxonResult Wilcoxon(std::span<const double> differences) {
  std::vector<double> size;
  std::vector<bool> positive;
  for (const double difference : differences) {
    if (const double d = Rounded(difference); d != 0) {
      size.push_back(std::abs(d));
      positive.push_back(d > 0);
    }
  }
  WilcoxonResult result;
  result.n = static_cast<int>(size.size());
  if (result.n == 0) {
    return result;
  }
  const Ranks ranks = RankAll(size);
  result.w_plus = 0;
  for (std::size_t k = 0; k < size.size(); ++k) {
    result.w_plus += positive[k] ? ranks.rank[k] : 0;
  }
  const double other = result.n * (result.n + 1) / 2.0 - result.w_plus;
  result.exact = result.n <= 25 && ranks.tie_term == 0;
  result.p = result.exact
                 ? std::min(1.0, 2 * ExactWilcoxonTail(result.n, std::min(result.w_plus, other)))
                 : NormalWilcoxonP(result.n, result.w_plus, ranks.tie_term);
  return result;
}

std::vector<double> Holm(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double most = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    most = std::max(most, std::min(1.0, p[order[k]] * static_cast<double>(p.size() - k)));
    adjusted[order[k]] = most;
  }
  return adjusted;
}

std::vector<double> MeanRanks(const std::vector<double>& values) { return RankAll(values).rank; }

double Spearman(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) {
    throw InputError(
        fmt::format("rank correlation of {} values with {}; give as many of one as of the other",
                    a.size(), b.size()));
  }
  if (a.size() < 3) {
    return kNaN;
  }
  const std::vector<double> x = MeanRanks(a), y = MeanRanks(b);
  const double middle = 0.5 * static_cast<double>(a.size() + 1);
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (x[k] - middle) * (x[k] - middle);
    yy += (y[k] - middle) * (y[k] - middle);
    xy += (x[k] - middle) * (y[k] - middle);
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : kNaN;
}

FriedmanResult Friedman(const std::vector<std::vector<double>>& values) {
  CheckTable(values);
  FriedmanResult r;
  r.subjects = static_cast<int>(values.size());
  r.treatments = static_cast<int>(values[0].size());
  const double n = r.subjects, k = r.treatments;
  r.mean_ranks.assign(values[0].size(), 0);
  double tie_term = 0;
  for (const std::vector<double>& row : values) {
    std::vector<double> rounded;
    std::transform(row.begin(), row.end(), std::back_inserter(rounded), Rounded);
    const Ranks ranks = RankAll(rounded);
    tie_term += ranks.tie_term;
    for (std::size_t t = 0; t < row.size(); ++t) {
      r.mean_ranks[t] += ranks.rank[t] / n;
    }
  }
  double spread = 0;
  for (const double rank : r.mean_ranks) {
    spread += (rank - (k + 1) / 2) * (rank - (k + 1) / 2);
  }
  const double untied = 1 - tie_term / (n * (k * k * k - k));
  r.chi2 = untied > 0 ? 12 * n / (k * (k + 1)) * spread / untied : 0;
  const double rest = n * (k - 1) - r.chi2;
  if (rest > 1e-12) {
    r.f = (n - 1) * r.chi2 / rest;
    const boost::math::fisher_f distribution(k - 1, (k - 1) * (n - 1));
    r.p = boost::math::cdf(boost::math::complement(distribution, r.f));
  } else {  // all subjects rank alike
    r.f = std::numeric_limits<double>::infinity();
    r.p = 0;
  }
  r.critical_difference = NemenyiQ(r.treatments) * std::sqrt(k * (k + 1) / (6 * n));
  return r;
}

}  // namespace semblance::problems
