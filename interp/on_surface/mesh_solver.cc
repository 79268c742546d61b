// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/mesh_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

namespace semblance {
namespace {

constexpr std::size_t kLeaf = 64;  // unknowns not worth a further cut

// Nested dissection by the points' coordinates: two halves, and last what separates them.
class Dissection {
 public:
  Dissection(const std::vector<Vec3>& points, const Eigen::SparseMatrix<double>& pattern)
      : points_(points), pattern_(pattern), side_(points.size(), 0) {
    order.resize(points.size());
    std::iota(order.begin(), order.end(), 0);
    Cut(order);
  }

  struct Node {
    int begin = 0, end = 0;  // its own unknowns, in the order
    bool is_leaf = false;    // else its two children are the last two subtrees before it
  };
  std::vector<int> order;   // of elimination
  std::vector<Node> nodes;  // children before parents

 private:
  // Orders `part`: one half, the other half, and last what separates them.
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
  std::vector<int> side_;  // the last half that each unknown was in
  int mark_ = 0;
};

// What a front leaves to those above it: the lower triangle of a matrix on its border.
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
  std::vector<MeshSolver::Front> Take() { return std::move(fronts_); }

 private:
  void Eliminate(const Dissection::Node& node) {
    std::vector<Update> children;
    for (int child = 0; child < (node.is_leaf ? 0 : 2); ++child) {
      children.push_back(std::move(updates_.back()));
      updates_.pop_back();
    }
    MeshSolver::Front front{node.begin, node.end, BorderOf(node, children), {}, {}};
    Eigen::MatrixXd full = Assembled(front, children);
    const Eigen::Index own = node.end - node.begin;
    const auto border = static_cast<Eigen::Index>(front.border.size());
    front.own = full.topLeftCorner(own, own);
    front.below = full.bottomLeftCorner(border, own);
    Update update{front.border, full.bottomRightCorner(border, border)};
    if (own > 0) {
      Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> in_place(front.own);
    }
    if (own > 0 && border > 0) {  // Eigen's products do not take empty matrices
      front.own.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
          front.below);
      update.matrix.selfadjointView<Eigen::Lower>().rankUpdate(front.below, -1);
    }
    updates_.push_back(std::move(update));
    fronts_.push_back(std::move(front));
  }

  // The later unknowns that the front's own ones are coupled with, by the matrix or by fill.
  std::vector<int> BorderOf(const Dissection::Node& node, const std::vector<Update>& children) {
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

  // The lower triangle over own and border unknowns, in their order.
  Eigen::MatrixXd Assembled(const MeshSolver::Front& front, const std::vector<Update>& children) {
    const int own = front.end - front.begin;
    for (int k = 0; k < own; ++k) {
      local_[front.begin + k] = k;
    }
    for (std::size_t k = 0; k < front.border.size(); ++k) {
      local_[front.border[k]] = own + static_cast<int>(k);
    }
    const auto size = own + static_cast<Eigen::Index>(front.border.size());
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(size, size);
    for (int k = front.begin; k < front.end; ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(matrix_, order_[k]); it; ++it) {
        if (rank_[it.row()] >= k) {
          full(local_[rank_[it.row()]], k - front.begin) = it.value();
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
  std::vector<int> rank_;   // of each unknown in the order
  std::vector<int> local_;  // of each rank in the current front
  std::vector<Update> updates_;
  std::vector<MeshSolver::Front> fronts_;
};

// Blocks of the inverse over each front's own unknowns and its border, from the last front to the
// first. Let L be the factor's own part, B that below it, Z the inverse; on the border Z is known
// from the front that owns the first of the border. With Y = B L^-1, Z between border and own is
// -Z Y, and that of the own is (L L')^-1 + Y' Z Y.
class BlockInverse {
 public:
  BlockInverse(const std::vector<MeshSolver::Front>& fronts, const std::vector<int>& order,
               Eigen::SparseMatrix<double>& entries)
      : fronts_(fronts),
        order_(order),
        entries_(entries),
        rank_(order.size()),
        owner_(order.size(), -1),
        open_children_(fronts.size(), 0),
        blocks_(fronts.size()) {
    for (std::size_t f = 0; f < fronts.size(); ++f) {
      for (int k = fronts[f].begin; k < fronts[f].end; ++k) {
        rank_[order[k]] = k;
        owner_[k] = static_cast<int>(f);
      }
    }
    for (const MeshSolver::Front& front : fronts) {
      if (front.end > front.begin && !front.border.empty()) {
        ++open_children_[owner_[front.border.front()]];
      }
    }
    for (std::size_t f = fronts.size(); f-- > 0;) {
      if (fronts[f].end > fronts[f].begin) {
        Invert(f);
      }
    }
  }

 private:
  void Invert(std::size_t f) {
    const MeshSolver::Front& front = fronts_[f];
    const Eigen::Index own = front.end - front.begin;
    const auto border = static_cast<Eigen::Index>(front.border.size());
    Eigen::MatrixXd& block = blocks_[f];
    block.resize(own + border, own + border);
    const Eigen::MatrixXd root =
        front.own.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(own, own));
    block.topLeftCorner(own, own).noalias() = root.transpose() * root;
    if (border > 0) {
      const Eigen::MatrixXd known = OnBorder(front), y = front.below * root;
      const Eigen::MatrixXd across = known * y;
      block.bottomLeftCorner(border, own) = -across;
      block.topRightCorner(own, border) = -across.transpose();
      block.topLeftCorner(own, own).noalias() += y.transpose() * across;
      block.bottomRightCorner(border, border) = known;
    }
    Write(front, block);
    if (open_children_[f] == 0) {
      block.resize(0, 0);
    }
  }

  // Of the owner's block, which is given up with its last child.
  Eigen::MatrixXd OnBorder(const MeshSolver::Front& front) {
    const int owner = owner_[front.border.front()];
    std::vector<int> local;
    for (const int rank : front.border) {
      local.push_back(LocalIndex(fronts_[owner], rank));
    }
    Eigen::MatrixXd known = blocks_[owner](local, local);
    if (--open_children_[owner] == 0) {
      blocks_[owner].resize(0, 0);
    }
    return known;
  }

  static int LocalIndex(const MeshSolver::Front& front, int rank) {
    return rank < front.end ? rank - front.begin
                            : front.end - front.begin +
                                  static_cast<int>(std::ranges::lower_bound(front.border, rank) -
                                                   front.border.begin());
  }

  void Write(const MeshSolver::Front& front, const Eigen::MatrixXd& block) {
    for (int k = front.begin; k < front.end; ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(entries_, order_[k]); it; ++it) {
        const int rank = rank_[it.row()];
        if (rank >= front.begin) {
          it.valueRef() = block(LocalIndex(front, rank), k - front.begin);
        }
        if (rank >= front.end) {
          entries_.coeffRef(order_[k], it.row()) = it.value();
        }
      }
    }
  }

  const std::vector<MeshSolver::Front>& fronts_;
  const std::vector<int>& order_;
  Eigen::SparseMatrix<double>& entries_;
  std::vector<int> rank_;           // of each unknown in the order
  std::vector<int> owner_;          // the front of each rank
  std::vector<int> open_children_;  // of each front: those that still need its block
  std::vector<Eigen::MatrixXd> blocks_;
};

}  // namespace

MeshSolver::MeshSolver(const std::vector<Vec3>& points, const Eigen::SparseMatrix<double>& matrix) {
  Dissection dissection(points, matrix);
  fronts_ = Elimination(dissection, matrix).Take();
  order_ = std::move(dissection.order);
}

Eigen::MatrixXd MeshSolver::Solve(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd x = right(order_, Eigen::all);
  for (const Front& front : fronts_) {
    auto own = x.middleRows(front.begin, front.end - front.begin);
    if ((own.array() == 0).all()) {
      continue;  // right sides of few entries touch few fronts
    }
    front.own.triangularView<Eigen::Lower>().solveInPlace(own);
    if (!front.border.empty()) {
      const Eigen::MatrixXd down = front.below * own;
      x(front.border, Eigen::all) -= down;
    }
  }
  for (auto it = fronts_.rbegin(); it != fronts_.rend(); ++it) {
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
  const BlockInverse fill(fronts_, order_, entries);
  return entries;
}

}  // namespace semblance
