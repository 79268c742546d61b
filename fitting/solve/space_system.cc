// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/space_system.h"

#include <algorithm>
#include <utility>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/terms/term_cost.h"

namespace semblance::fitting {
namespace {

// The contributions of a patch and all of its descendants, in the basis of the patch's sixteen
// vertices.
struct PatchPart {
  ElementStiffness matrix = ElementStiffness::Zero();
  PatchMatrix right = PatchMatrix::Zero();
  std::vector<int> finer;  // unknowns of finer levels that reach into the patch
  Eigen::Matrix<double, 16, Eigen::Dynamic> cross{16, 0};  // against those
};

class Assembler {
 public:
  Assembler(const HierarchicalSplineSpace& space, double point_scale,
            std::span<const LevelStiffness> forms, SystemPart part)
      : space_(space),
        point_scale_(point_scale),
        forms_(forms),
        both_(part == SystemPart::kBoth),
        column_of_(space.rows(), -1),
        lower_(space.rows()) {
    system_.right = Eigen::MatrixX3d::Zero(space.rows(), 3);
  }

  NormalSystem Run() {
    for (std::size_t k = 0; k < space_.nodes().size() && space_.nodes()[k].parent < 0; ++k) {
      Collect(static_cast<int>(k));
    }
    if (both_) {
      system_.lower = lower_.Take();
    }
    return std::move(system_);
  }

 private:
  PatchPart Collect(int index) {
    const QuadtreeNode& node = space_.nodes()[index];
    PatchPart part = node.children < 0 ? Leaf(node) : Inner(node);
    Scatter(node, part);
    return part;
  }

  PatchPart Leaf(const QuadtreeNode& node) const {
    PatchPart part;
    if (point_scale_ > 0 && node.range.size() > 0) {
      part.right = point_scale_ * space_.LeafResidual(node);
      if (both_) {
        part.matrix = point_scale_ * space_.LeafGram(node);
      }
    }
    if (!forms_.empty()) {
      const LevelStiffness& forms = forms_[node.patch.level];
      part.matrix += forms.displacement + forms.surface;
      part.right -=
          forms.displacement * (node.vertices - node.rest) + forms.surface * node.vertices;
    }
    return part;
  }

  PatchPart Inner(const QuadtreeNode& node) {
    std::array<PatchPart, 4> children;
    for (int c = 0; c < 4; ++c) {
      children[c] = Collect(node.children + c);
    }
    PatchPart part;
    for (int c = 0; c < 4; ++c) {
      const ElementStiffness& refine = RefinementMatrix(c % 2, c / 2);
      part.right += refine.transpose() * children[c].right;
      if (both_) {
        part.matrix += refine.transpose() * children[c].matrix * refine;
        for (const int dof : space_.nodes()[node.children + c].dofs) {
          AddFinerRow(RowOfDof(dof), part);
        }
        for (const int row : children[c].finer) {
          AddFinerRow(row, part);
        }
      }
    }
    if (both_) {
      Cross(node, children, part);
    }
    return part;
  }

  void Cross(const QuadtreeNode& node, const std::array<PatchPart, 4>& children, PatchPart& part) {
    part.cross = Eigen::MatrixXd::Zero(16, static_cast<Eigen::Index>(part.finer.size()));
    for (int c = 0; c < 4; ++c) {
      AddCross(space_.nodes()[node.children + c], children[c], RefinementMatrix(c % 2, c / 2),
               part);
    }
    for (const int row : part.finer) {
      column_of_[row] = -1;
    }
  }

  int RowOfDof(int dof) const { return dof >= 0 ? space_.dofs()[dof].row : -1; }

  void AddFinerRow(int row, PatchPart& part) {
    if (row >= 0 && column_of_[row] < 0) {
      column_of_[row] = static_cast<int>(part.finer.size());
      part.finer.push_back(row);
    }
  }

  void AddCross(const QuadtreeNode& child, const PatchPart& of_child,
                const ElementStiffness& refine, PatchPart& part) const {
    const ElementStiffness own = refine.transpose() * of_child.matrix;
    for (int k = 0; k < 16; ++k) {
      if (const int row = RowOfDof(child.dofs[k]); row >= 0) {
        part.cross.col(column_of_[row]) += own.col(k);
      }
    }
    if (of_child.finer.empty()) {
      return;
    }
    const Eigen::Matrix<double, 16, Eigen::Dynamic> finer = refine.transpose() * of_child.cross;
    for (std::size_t k = 0; k < of_child.finer.size(); ++k) {
      part.cross.col(column_of_[of_child.finer[k]]) += finer.col(static_cast<Eigen::Index>(k));
    }
  }

  void Scatter(const QuadtreeNode& node, const PatchPart& part) {
    std::array<int, 16> rows;
    std::transform(node.dofs.begin(), node.dofs.end(), rows.begin(),
                   [&](int dof) { return RowOfDof(dof); });
    for (int k = 0; k < 16; ++k) {
      if (rows[k] < 0) {
        continue;
      }
      system_.right.row(rows[k]) += part.right.row(k);
      for (int l = 0; both_ && l < 16; ++l) {
        if (rows[l] >= 0 && rows[k] >= rows[l]) {
          lower_.Add(rows[k], rows[l], part.matrix(k, l));
        }
      }
      for (std::size_t f = 0; f < part.finer.size(); ++f) {
        const auto [low, high] = std::minmax(rows[k], part.finer[f]);
        lower_.Add(high, low, part.cross(k, static_cast<Eigen::Index>(f)));
      }
    }
  }

  const HierarchicalSplineSpace& space_;
  double point_scale_;
  std::span<const LevelStiffness> forms_;
  bool both_;
  std::vector<int> column_of_;  // column of each unknown in the present part; -1: none
  TriangleSum lower_;
  NormalSystem system_;
};

// Adds rows to normal equations. The misfit is computed row by row, which is more precise than the
// difference A^T B - A^T A X.
class RowSystem final : public RowSink {
 public:
  RowSystem(const ControlNet& net, NormalSystem& system)
      : net_(net), system_(system), more_(system.right.rows()) {}

  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
           std::span<const int> vertices) override {
    Eigen::MatrixX3d x(vertices.size(), 3);
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      x.row(k) = net_.vertices[vertices[k]];
    }
    b -= *a * x;
    const Eigen::MatrixX3d right = a->transpose() * b;
    const Eigen::MatrixXd gram = a->transpose() * *a;
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      system_.right.row(vertices[k]) += right.row(k);
      for (std::size_t l = 0; l < vertices.size(); ++l) {
        if (vertices[k] >= vertices[l]) {
          more_.Add(vertices[k], vertices[l], gram(k, l));
        }
      }
    }
  }

  void AddMatrix() { system_.lower += more_.Take(); }

 private:
  const ControlNet& net_;
  NormalSystem& system_;
  TriangleSum more_;
};

}  // namespace

std::vector<LevelStiffness> StiffnessByLevel(const HSplineShape& shape, std::span<const Term> terms,
                                             const Vec2& lengths_mm) {
  std::vector<LevelStiffness> forms(shape.max_level + 1);
  for (int level = 0; level <= shape.max_level; ++level) {
    for (const Term& term : terms) {
      std::visit(
          [&]<class T>(const T& t) {
            if constexpr (std::is_same_v<T, SmoothnessTerm> || std::is_same_v<T, MembraneTerm>) {
              const ElementStiffness form =
                  PatchStiffness(t, lengths_mm, shape.PatchesU(level), shape.PatchesV(level));
              (t.of == SmoothnessOf::kSurface ? forms[level].surface : forms[level].displacement) +=
                  form;
            }
          },
          term);
    }
  }
  return forms;
}

double TotalEnergy(const HierarchicalSplineSpace& space, std::span<const LevelStiffness> forms) {
  double energy = 0;
  for (const QuadtreeNode& node : space.nodes()) {
    if (node.children < 0) {
      const LevelStiffness& form = forms[node.patch.level];
      const PatchMatrix moved = node.vertices - node.rest;
      energy += (form.displacement * moved).cwiseProduct(moved).sum() +
                (form.surface * node.vertices).cwiseProduct(node.vertices).sum();
    }
  }
  return energy;
}

NormalSystem Assemble(const HierarchicalSplineSpace& space, double point_scale,
                      std::span<const LevelStiffness> forms, SystemPart part) {
  return Assembler(space, point_scale, forms, part).Run();
}

void AddTermRows(std::span<const Term> terms, const LevelView& view, const ControlNet& net,
                 SystemPart part, NormalSystem& system) {
  RowSystem rows(net, system);
  AddRows(terms, view, rows);
  if (part == SystemPart::kBoth) {
    rows.AddMatrix();
  }
}

}  // namespace semblance::fitting
