// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/mesh_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

namespace semblance::interp {
namespace {

constexpr std::size_t kLeaf = 64;  // parts of so many unknowns are not divided further

// Nested dissection by coordinates: each part is ordered as two halves, followed by their
// separator.
class Dissection {
 public:
  Dissection(const std::vector<Vec3>& points, const Eigen::SparseMatrix<double>& pattern)
      : points_(points), pattern_(pattern), side_(points.size(), 0) {
    order.resize(points.size());
    std::iota(order.begin(), order.end(), 0);
    Cut(order);
  }

  struct Node {
    int begin = 0, end = 0;  // its own unknowns, as positions in the order
    bool is_leaf = false;    // otherwise its children are the two subtrees before it
  };
  std::vector<int> order;   // order of elimination
  std::vector<Node> nodes;  // children precede their parents

 private:
  // Orders `part` as its first half, its second half, and the separator.
  void Cut(std::span<int> part) {
    const auto begin = static_cast<int>(part.data() - order.data());
    const auto end = begin + static_cast<int>(part.size());
    if (part.size() <= kLeaf) {
      nodes.push_back({begin, end, true});
      return;
    }
    const std::size_t half = part.size() / 2;
    const int axis = LongestAxis(part);
    std::ranges::nth_element(part, part.begin() + static_cast<std::ptrdiff_t>(half), {},
                             [&](int i) { return std::pair(points_[i][axis], i); });
    const int left = ++mark_, right = ++mark_;
    for (std::size_t k = 0; k < part.size(); ++k) {
      side_[part[k]] = k < half ? left : right;
    }
    const auto separator =
        std::stable_partition(part.begin() + static_cast<std::ptrdiff_t>(half), part.end(),
                              [&](int i) { return !Touches(i, left); });
    const auto rest = static_cast<std::size_t>(separator - part.begin());
    Cut(part.first(half));
    Cut(part.subspan(half, rest - half));
    nodes.push_back({begin + static_cast<int>(rest), end, false});
  }

  int LongestAxis(std::span<const int> part) const {
    Box3 box;
    for (const int i : part) {
      box.extend(points_[i]);
    }
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    return axis;
  }

  bool Touches(int i, int side) const {
    for (Eigen::SparseMatrix<double>::InnerIterator it(pattern_, i); it; ++it) {
      if (side_[it.row()] == side) {
        return true;
      }
    }
    return false;
  }

  const std::vector<Vec3>& points_;
  const Eigen::SparseMatrix<double>& pattern_;
  std::vector<int> side_;  // mark of the half that last contained each unknown
  int mark_ = 0;
};

// The update of a frontal matrix to its ancestors: the lower triangle of a matrix on its border.
struct Update {
  std::vector<int> border;
  Eigen::MatrixXd matrix;
};

class Elimination {
 public:
  Elimination(const Dissection& dissection, const Eigen::SparseMatrix<double>& matrix)
      : order_(dissection.order), matrix_(matrix), rank_(order_.size()), local_(order_.size()) {
    for (std::size_t k = 0; k < order_.size(); ++k) {
      rank_[order_[k]] = static_cast<int>(k);
    }
    for (const Dissection::Node& node : dissection.nodes) {
      Eliminate(node);
    }
  }
  std::vector<MeshSolver::FrontalMatrix> Take() { return std::move(frontals_); }

 private:
  void Eliminate(const Dissection::Node& node) {
    std::vector<Update> children;
    for (int child = 0; child < (node.is_leaf ? 0 : 2); ++child) {
      children.push_back(std::move(updates_.back()));
      updates_.pop_back();
    }
    MeshSolver::FrontalMatrix frontal{node.begin, node.end, FindBorder(node, children), {}, {}};
    Eigen::MatrixXd full = Assembled(frontal, children);
    const Eigen::Index own = node.end - node.begin;
    const auto border = static_cast<Eigen::Index>(frontal.border.size());
    frontal.own = full.topLeftCorner(own, own);
    frontal.below = full.bottomLeftCorner(border, own);
    Update update{frontal.border, full.bottomRightCorner(border, border)};
    if (own > 0) {
      Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> in_place(frontal.own);
    }
    if (own > 0 && border > 0) {  // Eigen's products reject empty matrices
      frontal.own.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
          frontal.below);
      update.matrix.selfadjointView<Eigen::Lower>().rankUpdate(frontal.below, -1);
    }
    updates_.push_back(std::move(update));
    frontals_.push_back(std::move(frontal));
  }

  // The later unknowns that are coupled with a node's own unknowns by the matrix or by fill-in.
  std::vector<int> FindBorder(const Dissection::Node& node, const std::vector<Update>& children) {
    std::vector<int> border;
    for (int k = node.begin; k < node.end; ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(matrix_, order_[k]); it; ++it) {
        if (rank_[it.row()] >= node.end) {
          border.push_back(rank_[it.row()]);
        }
      }
    }
    for (const Update& child : children) {
      std::ranges::copy_if(child.border, std::back_inserter(border),
                           [&](int k) { return k >= node.end; });
    }
    std::ranges::sort(border);
    border.erase(std::unique(border.begin(), border.end()), border.end());
    return border;
  }

  // Assembles the lower triangle over own and border unknowns.
  Eigen::MatrixXd Assembled(const MeshSolver::FrontalMatrix& frontal,
                            const std::vector<Update>& children) {
    const int own = frontal.end - frontal.begin;
    for (int k = 0; k < own; ++k) {
      local_[frontal.begin + k] = k;
    }
    for (std::size_t k = 0; k < frontal.border.size(); ++k) {
      local_[frontal.border[k]] = own + static_cast<int>(k);
    }
    const auto size = own + static_cast<Eigen::Index>(frontal.border.size());
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(size, size);
    for (int k = frontal.begin; k < frontal.end; ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(matrix_, order_[k]); it; ++it) {
        if (rank_[it.row()] >= k) {
          full(local_[rank_[it.row()]], k - frontal.begin) = it.value();
        }
      }
    }
    for (const Update& child : children) {
      AddTo(full, child);
    }
    return full;
  }

  void AddTo(Eigen::MatrixXd& full, const Update& child) const {
    const auto size = static_cast<Eigen::Index>(child.border.size());
    for (Eigen::Index c = 0; c < size; ++c) {
      for (Eigen::Index r = c; r < size; ++r) {
        full(local_[child.border[r]], local_[child.border[c]]) += child.matrix(r, c);
      }
    }
  }

  const std::vector<int>& order_;
  const Eigen::SparseMatrix<double>& matrix_;
  std::vector<int> rank_;   // position of each unknown in the order
  std::vector<int> local_;  // index of each rank in the current frontal matrix
  std::vector<Update> updates_;
  std::vector<MeshSolver::FrontalMatrix> frontals_;
};

// Computes blocks of the inverse over each frontal matrix's own and border unknowns, from the last
// frontal matrix to the first. Let L be the diagonal block of the factor, B the block below it, and
// Z the inverse on the border, which is known from the frontal matrix that owns the first border
// unknown. With Y = B L^-1 the inverse between border and own unknowns is -Z Y, and between own
// unknowns (L L')^-1 + Y' Z Y.
class BlockInverse {
 public:
  BlockInverse(const std::vector<MeshSolver::FrontalMatrix>& frontals,
               const std::vector<int>& order, Eigen::SparseMatrix<double>& entries)
      : frontals_(frontals),
        order_(order),
        entries_(entries),
        rank_(order.size()),
        owner_(order.size(), -1),
        open_children_(frontals.size(), 0),
        blocks_(frontals.size()) {
    for (std::size_t f = 0; f < frontals.size(); ++f) {
      for (int k = frontals[f].begin; k < frontals[f].end; ++k) {
        rank_[order[k]] = k;
        owner_[k] = static_cast<int>(f);
      }
    }
    for (const MeshSolver::FrontalMatrix& frontal : frontals) {
      if (frontal.end > frontal.begin && !frontal.border.empty()) {
        ++open_children_[owner_[frontal.border.front()]];
      }
    }
    for (std::size_t f = frontals.size(); f-- > 0;) {
      if (frontals[f].end > frontals[f].begin) {
        Invert(f);
      }
    }
  }

 private:
  void Invert(std::size_t f) {
    const MeshSolver::FrontalMatrix& frontal = frontals_[f];
    const Eigen::Index own = frontal.end - frontal.begin;
    const auto border = static_cast<Eigen::Index>(frontal.border.size());
    Eigen::MatrixXd& block = blocks_[f];
    block.resize(own + border, own + border);
    const Eigen::MatrixXd root =
        frontal.own.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(own, own));
    block.topLeftCorner(own, own).noalias() = root.transpose() * root;
    if (border > 0) {
      const Eigen::MatrixXd known = OnBorder(frontal), y = frontal.below * root;
      const Eigen::MatrixXd across = known * y;
      block.bottomLeftCorner(border, own) = -across;
      block.topRightCorner(own, border) = -across.transpose();
      block.topLeftCorner(own, own).noalias() += y.transpose() * across;
      block.bottomRightCorner(border, border) = known;
    }
    Write(frontal, block);
    if (open_children_[f] == 0) {
      block.resize(0, 0);
    }
  }

  // The inverse on the border, from the owner's block. The block is freed after its last child.
  Eigen::MatrixXd OnBorder(const MeshSolver::FrontalMatrix& frontal) {
    const int owner = owner_[frontal.border.front()];
    std::vector<int> local;
    for (const int rank : frontal.border) {
      local.push_back(LocalIndex(frontals_[owner], rank));
    }
    Eigen::MatrixXd known = blocks_[owner](local, local);
    if (--open_children_[owner] == 0) {
      blocks_[owner].resize(0, 0);
    }
    return known;
  }

  static int LocalIndex(const MeshSolver::FrontalMatrix& frontal, int rank) {
    return rank < frontal.end
               ? rank - frontal.begin
               : frontal.end - frontal.begin +
                     static_cast<int>(std::ranges::lower_bound(frontal.border, rank) -
                                      frontal.border.begin());
  }

  void Write(const MeshSolver::FrontalMatrix& frontal, const Eigen::MatrixXd& block) {
    for (int k = frontal.begin; k < frontal.end; ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(entries_, order_[k]); it; ++it) {
        const int rank = rank_[it.row()];
        if (rank >= frontal.begin) {
          it.valueRef() = block(LocalIndex(frontal, rank), k - frontal.begin);
        }
        if (rank >= frontal.end) {
          entries_.coeffRef(order_[k], it.row()) = it.value();
        }
      }
    }
  }

  const std::vector<MeshSolver::FrontalMatrix>& frontals_;
  const std::vector<int>& order_;
  Eigen::SparseMatrix<double>& entries_;
  std::vector<int> rank_;           // position of each unknown in the order
  std::vector<int> owner_;          // frontal matrix of each rank
  std::vector<int> open_children_;  // per frontal matrix, children that still need its block
  std::vector<Eigen::MatrixXd> blocks_;
};

}  // namespace

MeshSolver::MeshSolver(const std::vector<Vec3>& points, const Eigen::SparseMatrix<double>& matrix) {
  Dissection dissection(points, matrix);
  frontals_ = Elimination(dissection, matrix).Take();
  order_ = std::move(dissection.order);
}

Eigen::MatrixXd MeshSolver::Solve(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd x = right(order_, Eigen::all);
  for (const FrontalMatrix& frontal : frontals_) {
    auto own = x.middleRows(frontal.begin, frontal.end - frontal.begin);
    if ((own.array() == 0).all()) {
      continue;  // sparse right sides involve few frontal matrices
    }
    frontal.own.triangularView<Eigen::Lower>().solveInPlace(own);
    if (!frontal.border.empty()) {
      const Eigen::MatrixXd down = frontal.below * own;
      x(frontal.border, Eigen::all) -= down;
    }
  }
  for (auto it = frontals_.rbegin(); it != frontals_.rend(); ++it) {
    auto own = x.middleRows(it->begin, it->end - it->begin);
    if (own.rows() == 0) {
      continue;
    }
    if (!it->border.empty()) {
      const Eigen::MatrixXd border = x(it->border, Eigen::all);
      own.noalias() -= it->below.transpose() * border;
    }
    it->own.triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  Eigen::MatrixXd solution(right.rows(), right.cols());
  solution(order_, Eigen::all) = x;
  return solution;
}

Eigen::SparseMatrix<double> MeshSolver::SelectedInverse(Eigen::SparseMatrix<double> entries) const {
  entries.makeCompressed();
  const BlockInverse fill(frontals_, order_, entries);
  return entries;
}

}  // namespace semblance::interp
