// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/space/hierarchical_spline_space.h"

#include <algorithm>
#include <map>
#include <optional>

#include "surfaces/base/parallel.h"

namespace semblance::fitting {
namespace {

// Returns whether a leaf has so few points that summing point by point is faster than by moments.
// Both give the same sums, so the limit affects time alone.
bool IsSparse(const QuadtreeNode& leaf) { return leaf.range.size() < 32; }

PatchMatrix StackVertices(const std::array<Vec3, 16>& vertices) {
  PatchMatrix matrix;
  for (int k = 0; k < 16; ++k) {
    matrix.row(k) = vertices[k];
  }
  return matrix;
}

// A vertex as one of the sixteen of a patch.
struct PatchSlot {
  PatchId patch;
  int index;  // [a + 4 b]
};

PatchSlot FindSlot(const HSplineShape& shape, const VertexId& v) {
  const int i = std::min(v.i, shape.PatchesU(v.level) - 1),
            j = std::min(v.j, shape.PatchesV(v.level) - 1);
  return {{v.level, i, j}, v.i - i + 4 * (v.j - j)};
}

// The position of a vertex on the refined net of the coarser level.
Vec3 RefinedPosition(const HSplineSurface& surface, const VertexId& v) {
  const PatchSlot slot = FindSlot(surface.shape(), v);
  const PatchId parent{v.level - 1, slot.patch.i / 2, slot.patch.j / 2};
  return RefinePatch(surface.PatchVertices(parent), slot.patch.i % 2, slot.patch.j % 2)[slot.index];
}

// The value of a vertex as a dof (ControlDof::value).
Vec3 DofValue(const HSplineSurface& surface, const VertexId& v) {
  const PatchSlot slot = FindSlot(surface.shape(), v);
  const Vec3 place = surface.PatchVertices(slot.patch)[slot.index];
  return v.level == 0 ? place : Vec3(place - RefinedPosition(surface, v));
}

}  // namespace

HierarchicalSplineSpace::HierarchicalSplineSpace(const HSplineSurface& start,
                                                 const HSplineSurface& rest,
                                                 const PointCloud& cloud)
    : shape_(start.shape()), rest_(rest), cloud_(cloud) {
  const ControlNet net = start.Net(0);
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      AddDof({0, i, j}, net.At(i, j));
    }
  }
  nodes_.reserve(static_cast<std::size_t>(shape_.patches_u) * shape_.patches_v);
  for (int j = 0; j < shape_.patches_v; ++j) {
    for (int i = 0; i < shape_.patches_u; ++i) {
      AddNode({0, i, j}, -1, cloud.PatchOfLevel0(i, j));
    }
  }
  std::vector<VertexId> edits;
  for (const auto& [vertex, offset] : rest.Offsets()) {
    edits.push_back(vertex);  // every leaf can then represent the template's shape
  }
  for (const auto& [vertex, offset] : start.Offsets()) {
    edits.push_back(vertex);
  }
  Edit(edits);
  for (ControlDof& dof : dofs_) {
    if (dof.vertex.level > 0) {
      dof.value = DofValue(start, dof.vertex);
    }
  }
  Refresh();
}

int HierarchicalSplineSpace::finest() const {
  int level = 0;
  for (const ControlDof& dof : dofs_) {
    level = std::max(level, dof.vertex.level);
  }
  return level;
}

int HierarchicalSplineSpace::AddDof(const VertexId& vertex, const Vec3& value) {
  const int next = static_cast<int>(dofs_.size());
  const auto [at, added] = dof_of_.emplace(MakeKey(vertex.level, vertex.i, vertex.j), next);
  if (added) {
    dofs_.push_back({vertex, value});
  }
  return at->second;
}

bool HierarchicalSplineSpace::IsEdited(const VertexId& vertex) const {
  return dof_of_.contains(MakeKey(vertex.level, vertex.i, vertex.j));
}

int HierarchicalSplineSpace::FindRow(const VertexId& vertex) const {
  const auto found = dof_of_.find(MakeKey(vertex.level, vertex.i, vertex.j));
  return found == dof_of_.end() ? -1 : dofs_[found->second].row;
}

int HierarchicalSplineSpace::AddNode(const PatchId& patch, int parent,
                                     const PointCloud::Range& range) {
  const int index = static_cast<int>(nodes_.size());
  node_of_.emplace(MakeKey(patch.level, patch.i, patch.j), index);
  QuadtreeNode& node = nodes_.emplace_back();
  node.patch = patch;
  node.parent = parent;
  node.range = range;
  node.rest = StackVertices(rest_.PatchVertices(patch));
  return index;
}

void HierarchicalSplineSpace::Split(int index) {
  const PatchId patch = nodes_[index].patch;
  const PointCloud::Range range = nodes_[index].range;
  nodes_[index].children = static_cast<int>(nodes_.size());
  for (int child = 0; child < 4; ++child) {
    const PatchId place{patch.level + 1, 2 * patch.i + child % 2, 2 * patch.j + child / 2};
    AddNode(place, index, cloud_.Child(range, place));
  }
}

int HierarchicalSplineSpace::EnsureNode(const PatchId& patch) {
  const Key key = MakeKey(patch.level, patch.i, patch.j);
  if (const auto found = node_of_.find(key); found != node_of_.end()) {
    return found->second;
  }
  Split(EnsureNode({patch.level - 1, patch.i / 2, patch.j / 2}));
  return node_of_.at(key);
}

void HierarchicalSplineSpace::Edit(std::span<const VertexId> vertices) {
  std::vector<VertexId> sorted(vertices.begin(), vertices.end());
  std::sort(sorted.begin(), sorted.end());
  for (const VertexId& v : sorted) {
    if (IsEdited(v)) {
      continue;
    }
    AddDof(v, Vec3::Zero());
    for (int k = 0; k < 16; ++k) {
      const PatchId patch{v.level,
                          WrapIndex(shape_.PatchesU(v.level), v.i - 3 + k % 4, shape_.ClosedU()),
                          WrapIndex(shape_.PatchesV(v.level), v.j - 3 + k / 4, false)};
      if (patch.i >= 0 && patch.j >= 0) {
        EnsureNode(patch);
      }
    }
  }
  LinkDofs();
  Refresh();
}

// Invariant 5. The B-spline of vertex i is a sum of those of vertices 2 i - 3 .. 2 i + 1 of the
// next level.
bool HierarchicalSplineSpace::IsCovered(const VertexId& v) const {
  const int level = v.level + 1;
  if (level > shape_.max_level) {
    return false;
  }
  for (int b = 2 * v.j - 3; b <= 2 * v.j + 1; ++b) {
    const int j = WrapIndex(shape_.Rows(level), b, false);
    for (int a = 2 * v.i - 3; j >= 0 && a <= 2 * v.i + 1; ++a) {
      const int i = WrapIndex(shape_.Columns(level), a, shape_.ClosedU());
      if (i >= 0 && !IsEdited({level, i, j})) {
        return false;
      }
    }
  }
  return true;
}

void HierarchicalSplineSpace::LinkDofs() {
  rows_ = 0;
  for (ControlDof& dof : dofs_) {
    dof.row = IsCovered(dof.vertex) ? -1 : rows_++;
  }
  for (QuadtreeNode& node : nodes_) {
    const PatchId& p = node.patch;
    for (int k = 0; k < 16; ++k) {
      const int i = shape_.Column(p.level, p.i + k % 4), j = p.j + k / 4;
      const auto found = dof_of_.find(MakeKey(p.level, i, j));
      node.dofs[k] = found == dof_of_.end() ? -1 : found->second;
    }
  }
}

// Restores invariant 4, and marks leaves whose vertices changed as not measured. By invariant 1 a
// parent is up to date before its children.
void HierarchicalSplineSpace::Refresh() {
  for (QuadtreeNode& node : nodes_) {
    const PatchId& p = node.patch;
    PatchMatrix vertices = PatchMatrix::Zero();
    if (node.parent >= 0) {
      vertices.noalias() = RefinementMatrix(p.i % 2, p.j % 2) * nodes_[node.parent].vertices;
    }
    for (int k = 0; k < 16; ++k) {
      if (node.dofs[k] >= 0) {
        vertices.row(k) += dofs_[node.dofs[k]].value.transpose();
      }
    }
    if (vertices != node.vertices) {
      node.vertices = vertices;
      node.measured = false;
    }
  }
}

void HierarchicalSplineSpace::SetValues(const ControlNet& net) {
  for (ControlDof& dof : dofs_) {
    if (dof.row >= 0) {
      dof.value = net.vertices[dof.row];
    }
  }
  Refresh();
}

void HierarchicalSplineSpace::Measure(std::vector<double> factors, int threads,
                                      std::vector<double>* squares) {
  factors_ = std::move(factors);
  std::vector<int> stale;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const QuadtreeNode& node = nodes_[k];
    const bool fresh = node.measured && node.has_moments;  // measured with factors 1
    if (node.children < 0 && (!fresh || !factors_.empty() || squares != nullptr)) {
      stale.push_back(static_cast<int>(k));
    }
  }
  if (squares != nullptr) {
    squares->resize(cloud_.points().size());
  }
  ParallelFor(stale.size(), threads, 1, [&](std::size_t k) {
    QuadtreeNode& node = nodes_[stale[k]];
    MeasureLeaf({.factors = LeafFactors(node),
                 .squares = squares == nullptr ? nullptr : squares->data() + node.range.begin},
                node);
  });
}

void HierarchicalSplineSpace::MeasureLeaf(const PointFactors& each, QuadtreeNode& leaf) const {
  const auto points = cloud_.Of(leaf.range);
  leaf.sums.ForgetResidual();
  if (IsSparse(leaf)) {
    AddPoints(points, leaf.patch, leaf.vertices, each, leaf.sums);
  } else {
    const bool moments = !leaf.has_moments || each.factors != nullptr;
    if (moments) {
      leaf.sums = {};
    }
    AddMoments(points, leaf.patch, leaf.vertices, moments, each, leaf.sums);
  }
  leaf.has_moments = each.factors == nullptr;
  leaf.measured = true;
}

const double* HierarchicalSplineSpace::LeafFactors(const QuadtreeNode& leaf) const {
  return factors_.empty() ? nullptr : factors_.data() + leaf.range.begin;
}

Matrix16 HierarchicalSplineSpace::LeafGram(const QuadtreeNode& leaf) const {
  return IsSparse(leaf) ? GramOfPoints(cloud_.Of(leaf.range), leaf.patch, LeafFactors(leaf))
                        : GramOfMoments(leaf.sums);
}

PatchMatrix HierarchicalSplineSpace::LeafResidual(const QuadtreeNode& leaf) const {
  return IsSparse(leaf) ? ResidualOfPoints(leaf.sums) : ResidualOfMoments(leaf.sums);
}

int HierarchicalSplineSpace::LeafAt(const Vec2& uv) const {
  const PatchPoint at = PatchPointAt(shape_, 0, uv);
  int node = at.patch.i + shape_.patches_u * at.patch.j;
  while (nodes_[node].children >= 0) {
    const PatchId& parent = nodes_[node].patch;
    const PatchId child = PatchPointAt(shape_, parent.level + 1, uv).patch;
    node = nodes_[node].children + (child.i - 2 * parent.i) + 2 * (child.j - 2 * parent.j);
  }
  return node;
}

ControlNet HierarchicalSplineSpace::Values() const {
  ControlNet net{.columns = rows_, .rows = 1, .vertices = {}};
  for (const ControlDof& dof : dofs_) {
    if (dof.row >= 0) {
      net.vertices.push_back(dof.value);
    }
  }
  return net;
}

ControlNet HierarchicalSplineSpace::RestValues() const {
  ControlNet net{.columns = rows_, .rows = 1, .vertices = {}};
  for (const ControlDof& dof : dofs_) {
    if (dof.row >= 0) {
      net.vertices.push_back(DofValue(rest_, dof.vertex));
    }
  }
  return net;
}

void HierarchicalSplineSpace::Rebin() {
  for (QuadtreeNode& node : nodes_) {
    node.range = node.parent < 0 ? cloud_.PatchOfLevel0(node.patch.i, node.patch.j)
                                 : cloud_.Child(nodes_[node.parent].range, node.patch);
    node.has_moments = node.measured = false;
  }
}

double HierarchicalSplineSpace::Squares() const {
  double sum = 0;
  for (const QuadtreeNode& node : nodes_) {
    sum += node.children < 0 ? node.sums.squares : 0;
  }
  return sum;
}

// Proceeds level by level, because an offset is measured from the next coarser surface, in its
// frame.
HSplineSurface HierarchicalSplineSpace::Surface() const {
  ControlNet net{shape_.Columns(0), shape_.Rows(0), {}};
  std::vector<std::vector<const ControlDof*>> levels(shape_.max_level + 1);
  for (const ControlDof& dof : dofs_) {
    if (dof.vertex.level == 0) {
      net.vertices.push_back(dof.value);
    } else {
      levels[dof.vertex.level].push_back(&dof);
    }
  }
  HSplineSurface surface(shape_, net);
  for (const auto& level : levels) {
    std::map<VertexId, std::optional<Vec3>> offsets;
    for (const ControlDof* dof : level) {
      const VertexId& v = dof->vertex;
      const SurfaceFrame frame = surface.LevelFrame(v.level - 1, surface.GrevillePoint(v));
      const Vec3 way = RefinedPosition(surface, v) + dof->value - frame.point;
      const bool world = shape_.reference == OffsetReference::kWorld;
      offsets[v] = world ? way : Vec3(frame.axes.transpose() * way);
    }
    surface.SetOffsets(offsets);
  }
  return surface;
}

namespace {

SplineElement MakeElement(const HierarchicalSplineSpace& space, int leaf) {
  const std::vector<QuadtreeNode>& nodes = space.nodes();
  SplineElement element;
  element.patch = nodes[leaf].patch;
  element.patches_u = space.shape().PatchesU(element.patch.level);
  element.patches_v = space.shape().PatchesV(element.patch.level);
  element.rest = nodes[leaf].rest;
  std::vector<Eigen::Matrix<double, 16, 1>> columns;
  Matrix16 refinement = Matrix16::Identity();  // leaf's vertices from those of `node`
  for (int node = leaf; node >= 0; node = nodes[node].parent) {
    for (int k = 0; k < 16; ++k) {
      const int dof = nodes[node].dofs[k];
      if (dof < 0) {
        continue;
      }
      const ControlDof& unknown = space.dofs()[dof];
      if (unknown.row < 0) {
        element.fixed += refinement.col(k) * unknown.value.transpose();
      } else {
        element.dofs.push_back(unknown.row);
        columns.emplace_back(refinement.col(k));
      }
    }
    const PatchId& patch = nodes[node].patch;
    refinement = refinement * RefinementMatrix(patch.i % 2, patch.j % 2);
  }
  element.extraction.resize(16, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    element.extraction.col(static_cast<Eigen::Index>(k)) = columns[k];
  }
  return element;
}

}  // namespace

PatchMatrix SplineElement::Vertices(const ControlNet& net) const {
  Eigen::MatrixX3d values(dofs.size(), 3);
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    values.row(static_cast<Eigen::Index>(k)) = net.vertices[dofs[k]];
  }
  return IsIdentity() ? PatchMatrix(values) : PatchMatrix(extraction * values + fixed);
}

SplineElements::SplineElements(const HierarchicalSplineSpace& space)
    : space_(space), element_of_(space.nodes().size(), -1) {
  for (const ControlDof& dof : space.dofs()) {
    if (dof.row >= 0) {
      vertices_.push_back(dof.vertex);
    }
  }
  for (std::size_t k = 0; k < space.nodes().size(); ++k) {
    if (space.nodes()[k].children < 0) {
      element_of_[k] = size();
      elements_.push_back(MakeElement(space, static_cast<int>(k)));
    }
  }
}

}  // namespace semblance::fitting
