// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/sparse_factor.h"

#include <dlfcn.h>

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace semblance::fitting {
namespace {

// The pattern over vertices of a matrix over coordinates: a column per vertex, an entry per coupled
// vertex.
SparseMatrix VertexPattern(const SparseMatrix& lower) {
  const Eigen::Index vertices = lower.cols() / 3;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(lower.nonZeros() / 9 + vertices));
  for (Eigen::Index v = 0; v < vertices; ++v) {
    for (SparseMatrix::InnerIterator entry(lower, 3 * v); entry; ++entry) {
      if (entry.row() % 3 == 0) {
        entries.emplace_back(static_cast<int>(entry.row() / 3), static_cast<int>(v), 1);
      }
    }
  }
  SparseMatrix pattern(vertices, vertices);
  pattern.setFromTriplets(entries.begin(), entries.end());
  return pattern;
}

}  // namespace

// Gives access to the factor, which is a protected member of Eigen's class.
struct SparseFactor::Cholmod : Eigen::CholmodSupernodalLLT<SparseMatrix, Eigen::Lower> {
  const cholmod_factor& Factor() const { return *m_cholmodFactor; }

  // Orders the vertices instead of the rows: a third of the rows and a ninth of the entries. The
  // coordinates of a vertex stay together, as they would in an order of all rows.
  void AnalyzeByVertex(const SparseMatrix& lower) {
    Cholmod of_vertices;
    of_vertices.cholmod().print = 0;
    of_vertices.analyzePattern(VertexPattern(lower));
    const auto* const vertices = static_cast<const int*>(of_vertices.Factor().Perm);
    std::vector<int> rows;
    rows.reserve(of_vertices.Factor().n * 3);
    for (std::size_t k = 0; k < of_vertices.Factor().n; ++k) {
      for (int c = 0; c < 3; ++c) {
        rows.push_back(3 * vertices[k] + c);
      }
    }
    cholmod_sparse matrix = Eigen::viewAsCholmod(lower.selfadjointView<Eigen::Lower>());
    cholmod().nmethods = 1;
    cholmod().method[0].ordering = CHOLMOD_GIVEN;
    m_cholmodFactor = cholmod_analyze_p(&matrix, rows.data(), nullptr, 0, &cholmod());
    m_isInitialized = true;
    m_info = Eigen::Success;
    m_analysisIsOk = true;
  }
};

SparseFactor::SparseFactor(const SparseMatrix& lower, double shift, RowKind rows)
    : cholmod_(std::make_unique<Cholmod>()) {
  UseOneLibraryThread();
  cholmod_->cholmod().print = 0;  // usable() reports failures
  cholmod_->setShift(shift);
  if (rows == RowKind::kCoordinate) {
    cholmod_->AnalyzeByVertex(lower);
  } else {
    cholmod_->analyzePattern(lower);
  }
  cholmod_->factorize(lower);
}

SparseFactor::~SparseFactor() = default;

bool SparseFactor::usable() const { return cholmod_->info() == Eigen::Success; }

Eigen::MatrixXd SparseFactor::Solve(const Eigen::MatrixXd& right) const {
  return cholmod_->solve(right);
}

// Reads the diagonal of CHOLMOD's supernodal factor. Supernode s holds columns super[s] .. super[s
// + 1] - 1 as one dense block.
Eigen::VectorXd SparseFactor::Pivots() const {
  const cholmod_factor& factor = cholmod_->Factor();
  const auto* const super = static_cast<const int*>(factor.super);
  const auto* const rows = static_cast<const int*>(factor.pi);
  const auto* const start = static_cast<const int*>(factor.px);
  const auto* const values = static_cast<const double*>(factor.x);
  Eigen::VectorXd pivots(static_cast<Eigen::Index>(factor.n));
  for (std::size_t s = 0; s < factor.nsuper; ++s) {
    const int height = rows[s + 1] - rows[s];
    for (int k = 0; k < super[s + 1] - super[s]; ++k) {
      const double diagonal = values[start[s] + k * (height + 1)];
      pivots[super[s] + k] = diagonal * diagonal;
    }
  }
  return pivots;
}

double SparseFactor::LogDeterminant() const { return Pivots().array().log().sum(); }

namespace {

// The normal matrix with its diagonal scaled to 1, which preserves the rank.
SparseMatrix Scaled(const SparseMatrix& lower) {
  const Eigen::VectorXd d = lower.diagonal();
  const Eigen::VectorXd scale =
      (d.array() > 0).select(d.array().max(1e-300).rsqrt(), Eigen::ArrayXd::Zero(d.size()));
  return scale.asDiagonal() * lower * scale.asDiagonal();
}

// Counts eigenvalues below the shifts from log det(A + more) - log det(A + less). An eigenvalue
// well below `less` adds log(more / less), and one well above `more` adds nothing. The order of the
// pivots has no effect.
double CountBelow(double less, double log_less, double more, double log_more) {
  return (log_more - log_less) / std::log(more / less);
}

}  // namespace

// The two shifts lie far above round-off, about 1e-15, and bracket the threshold of the rank. If no
// pivot is below kFullRankPivot, the rank is full and one factor is enough.
int NumericalRank(const SparseMatrix& lower, std::size_t rows) {
  constexpr double kLess = 1e-11, kMore = 1e-10, kFullRankPivot = 1e-6;
  const SparseMatrix scaled = Scaled(lower);
  const SparseFactor less(scaled, kLess);
  if (!less.usable()) {
    return -1;
  }
  int rank = static_cast<int>(scaled.rows());
  if (!(less.Pivots().minCoeff() > kFullRankPivot)) {
    const SparseFactor more(scaled, kMore);
    rank -= static_cast<int>(
        std::lround(CountBelow(kLess, less.LogDeterminant(), kMore, more.LogDeterminant())));
  }
  return static_cast<int>(std::min<std::size_t>(rank, rows));
}

namespace {

// Returns a function of a loaded library, or null.
template <typename Function>
Function LookUp(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
}

// OpenBLAS that is built without threads hands the same buffer to two threads that call it at once.
bool IsOpenBlasWithoutLocks() {
  const auto threading = LookUp<int (*)()>("openblas_get_parallel");
  return threading != nullptr && threading() == 0;
}

}  // namespace

void UseOneLibraryThread() {
  using SetNumber = void (*)(int);
  static const auto set_blas_threads = LookUp<SetNumber>("openblas_set_num_threads");
  static const auto set_parallel_levels = LookUp<SetNumber>("omp_set_max_active_levels");
  static const bool is_without_locks = IsOpenBlasWithoutLocks();
  if (is_without_locks) {
    throw Error(
        "the OpenBLAS of this machine is built without threads, and results of concurrent fits "
        "would be wrong; install one with threads (Debian: libopenblas0-pthread), or remove it");
  }
  if (set_blas_threads != nullptr) {
    set_blas_threads(1);
  }
  if (set_parallel_levels != nullptr) {
    set_parallel_levels(0);
  }
}

namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Factor = Eigen::SimplicialLDLT<Matrix, Eigen::Lower>;

}  // namespace

SelectedInverse::SelectedInverse(const Matrix& lower) {
  const Factor factor(lower);
  usable_ = factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0;
  if (!usable_) {
    return;
  }
  const auto& order = factor.permutationP().indices();
  place_.assign(order.begin(), order.end());
  const std::vector<double> of_factor = StorePattern(factor.matrixL());
  values_.assign(rows_.size(), 0);
  std::vector<double> sums(place_.size(), 0);
  for (int j = static_cast<int>(place_.size()) - 1; j >= 0; --j) {
    FillColumn(j, factor.vectorD()[j], of_factor, sums);
  }
}

// Stores the factor's pattern, and returns its entries including those of its diagonal, which
// are 1.
std::vector<double> SelectedInverse::StorePattern(const Matrix& factor) {
  std::vector<double> entries;
  starts_.push_back(0);
  for (int j = 0; j < factor.cols(); ++j) {
    rows_.push_back(j);
    entries.push_back(1);
    for (Matrix::InnerIterator entry(factor, j); entry; ++entry) {
      if (entry.row() > j) {
        rows_.push_back(static_cast<int>(entry.row()));
        entries.push_back(entry.value());
      }
    }
    starts_.push_back(static_cast<int>(rows_.size()));
  }
  return entries;
}

// With H = L D L^T (L with unit diagonal) the inverse Z satisfies Z = D^-1 L^-1 + (I - L^T) Z.
// Columns are computed from the last: Z_ij = -sum_k L_kj Z_ik for i > j, and Z_jj = 1 / D_j - sum_k
// L_kj Z_kj, summed over the rows k > j of L's column j. By fill-in, L has an entry for any two of
// those rows.
void SelectedInverse::FillColumn(int j, double pivot, const std::vector<double>& of_factor,
                                 std::vector<double>& sums) {
  const int begin = starts_[j] + 1, end = starts_[j + 1];
  for (int a = begin; a < end; ++a) {
    sums[rows_[a]] = 0;
  }
  for (int a = begin; a < end; ++a) {
    AddColumn(a, begin, end, of_factor, sums);
  }
  double diagonal = 1 / pivot;
  for (int a = begin; a < end; ++a) {
    values_[a] = -sums[rows_[a]];
    diagonal -= of_factor[a] * values_[a];
  }
  values_[starts_[j]] = diagonal;
}

// Adds the contributions of the inverse's column k, where k is the row at `a` among begin .. end
// - 1. Each pair of those rows is visited once and contributes to both.
void SelectedInverse::AddColumn(int a, int begin, int end, const std::vector<double>& of_factor,
                                std::vector<double>& sums) const {
  const int k = rows_[a];
  int at = begin;
  for (int b = starts_[k]; b < starts_[k + 1]; ++b) {
    while (at < end && rows_[at] < rows_[b]) {
      ++at;
    }
    if (at == end) {
      return;
    }
    if (rows_[at] == rows_[b]) {
      sums[rows_[b]] += of_factor[a] * values_[b];
      sums[k] += rows_[b] != k ? of_factor[at] * values_[b] : 0;
    }
  }
}

double SelectedInverse::At(int row, int column) const {
  const auto [first, second] = std::minmax(place_[row], place_[column]);
  const auto begin = rows_.begin() + starts_[first], end = rows_.begin() + starts_[first + 1];
  const auto found = std::lower_bound(begin, end, second);
  if (found == end || *found != second) {
    throw std::logic_error("selected inverse: the matrix has no entry there");
  }
  return values_[static_cast<std::size_t>(found - rows_.begin())];
}

}  // namespace semblance::fitting
