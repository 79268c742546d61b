// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "surfaces/error.h"
#include "surfaces/polygon_integral.h"

namespace semblance {
namespace {

// r^-n from r^2. Whole n, the usual case, needs no pow.
class InversePower {
 public:
  explicit InversePower(double n) : n_(n), whole_(n == std::floor(n) ? static_cast<int>(n) : -1) {}
  double operator()(double r2) const {
    if (whole_ < 0) {
      return std::pow(r2, -0.5 * n_);
    }
    const double inverse2 = 1 / r2;
    double result = whole_ & 1 ? std::sqrt(inverse2) : 1;
    double power = inverse2;
    for (int rest = whole_ >> 1; rest != 0; rest >>= 1, power *= power) {
      result *= rest & 1 ? power : 1;
    }
    return result;
  }

 private:
  double n_;
  int whole_;
};

// One triangle of the skull as its emission needs it.
struct EmitterTriangle {
  Vec3 a, b, c;
  Vec3 centroid, normal;
  double area_mm2 = kNaN, depth_mm = kNaN;
  double longest2_mm2 = kNaN;  // squared length of the longest edge
  double gain = kNaN;          // the factor of its emission that does not depend on the point
  Vec3 edge_normal_a, edge_normal_b,
      edge_normal_c;  // in the plane, out of the triangle, across ab, bc, ca

  // Distances closer than a share of the depth count as that, so that emission stays finite.
  double Floor2(double depth_share) const {
    constexpr double kClosest = 0.05;
    return std::pow(kClosest * depth_share * depth_mm, 2);
  }
};

// Distance from p to the triangle moved by `shift` along its normal, squared, and the height over
// its plane.
double SquaredDistance(const EmitterTriangle& t, const Vec3& p) {
  const Vec3 ap = p - t.a, bp = p - t.b, cp = p - t.c;
  const double out_ab = ap.dot(t.edge_normal_a), out_bc = bp.dot(t.edge_normal_b),
               out_ca = cp.dot(t.edge_normal_c);
  if (out_ab <= 0 && out_bc <= 0 && out_ca <= 0) {
    const double h = ap.dot(t.normal);
    return h * h;
  }
  const auto to_segment = [&p](const Vec3& u, const Vec3& v) {
    const Vec3 uv = v - u;
    const double s = std::clamp((p - u).dot(uv) / uv.squaredNorm(), 0.0, 1.0);
    return (p - u - s * uv).squaredNorm();
  };
  return std::min({to_segment(t.a, t.b), to_segment(t.b, t.c), to_segment(t.c, t.a)});
}

bool ProjectsOnto(const EmitterTriangle& t, const Vec3& p) {
  return (p - t.a).dot(t.edge_normal_a) <= 0 && (p - t.b).dot(t.edge_normal_b) <= 0 &&
         (p - t.c).dot(t.edge_normal_c) <= 0;
}

// Each kernel: Gain(t) sets EmitterTriangle::gain; Emission(t, p, height) at a height > 0 is at
// most gain / distance^Falloff(), distances taken to the triangle less Advance(t).
class ThesisKernel {
 public:
  explicit ThesisKernel(const ThesisEmitter& o) : k_(o.decay), power_(o.decay) {}
  double Gain(const EmitterTriangle& t) const { return std::pow(t.depth_mm, k_); }
  double Emission(const EmitterTriangle& t, const Vec3& p, double) const {
    return t.gain * power_(std::max(SquaredDistance(t, p), t.Floor2(1)));
  }
  double Falloff() const { return k_; }
  double Advance(const EmitterTriangle&) const { return 0; }

 private:
  double k_;
  InversePower power_;
};

class SplitKernel {
 public:
  explicit SplitKernel(const SplitEmitter& o) : k_(o.decay), t_(o.split), power_(o.decay) {}
  double Gain(const EmitterTriangle& t) const { return std::pow((1 - t_) * t.depth_mm, k_); }
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const {
    const double shift = t_ * t.depth_mm;
    if (height < shift) {
      return ProjectsOnto(t, p) ? ImplicitSurface::kMostEmission : 0;
    }
    return t.gain * power_(std::max(SquaredDistance(t, p - shift * t.normal), t.Floor2(1 - t_)));
  }
  double Falloff() const { return k_; }
  double Advance(const EmitterTriangle& t) const { return t_ * t.depth_mm; }

 private:
  double k_, t_;
  InversePower power_;
};

// The integral: by the centroid where the triangle is small against its distance, by the three edge
// midpoints (exact for quadratics) where it is less so. Where it is near, in closed form for a
// whole decay, unless the point lies flat beside it; else by four smaller triangles.
class FlatKernel {
 public:
  explicit FlatKernel(const FlatEmitter& o)
      : k_(o.decay),
        closed_(o.decay == std::floor(o.decay) ? static_cast<int>(o.decay) + 1 : -1),
        power_(o.decay + 3) {}
  double Gain(const EmitterTriangle& t) const {
    return (k_ + 1) / (2 * std::numbers::pi) * std::pow(t.depth_mm, k_) * t.area_mm2;
  }
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const {
    const double r2 = (p - t.centroid).squaredNorm();
    if (t.longest2_mm2 <= kCentroidShare * r2) {
      return t.gain * height * power_(r2);
    }
    const double height2 = height * height, floor2 = t.Floor2(1);
    const bool closed = closed_ > 0 && t.longest2_mm2 > kMidpointShare * r2 &&
                        height2 >= std::max(floor2, kFlatShare * r2);
    return t.gain * height *
           (closed ? ClosedForm(t, p, height) / t.area_mm2
                   : Mean(p, t.a, t.b, t.c, t.longest2_mm2, floor2));
  }
  double Falloff() const { return k_ + 2; }  // height <= distance
  double Advance(const EmitterTriangle&) const { return 0; }

 private:
  // of the squared distance
  static constexpr double kCentroidShare = 0.02, kMidpointShare = 0.06, kFlatShare = 0.001;

  double ClosedForm(const EmitterTriangle& t, const Vec3& p, double height) const {
    const auto edge = [&p](const Vec3& u, const Vec3& v, const Vec3& out) {
      const Vec3 from = u - p, along = v - u;
      const double inverse = 1 / along.norm(), begin = from.dot(along) * inverse;
      return EdgeFromFoot{from.dot(out) * inverse, begin, begin + 1 / inverse};
    };
    const std::array<EdgeFromFoot, 3> edges = {edge(t.a, t.b, t.edge_normal_a),
                                               edge(t.b, t.c, t.edge_normal_b),
                                               edge(t.c, t.a, t.edge_normal_c)};
    return IntegrateInversePower(edges, height, closed_);
  }

  // Mean of |p - q|^-(k+3) over a triangle.
  double Mean(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, double longest2,
              double floor2) const {
    const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    const double r2 = std::max((p - (a + b + c) / 3).squaredNorm(), floor2);
    if (longest2 <= kMidpointShare * r2) {
      const auto at = [&](const Vec3& q) {
        return power_(std::max((p - q).squaredNorm(), floor2));
      };
      return (at(ab) + at(bc) + at(ca)) / 3;
    }
    const double quarter = longest2 / 4;
    return (Mean(p, a, ab, ca, quarter, floor2) + Mean(p, ab, b, bc, quarter, floor2) +
            Mean(p, ca, bc, c, quarter, floor2) + Mean(p, ab, bc, ca, quarter, floor2)) /
           4;
  }

  double k_;
  int closed_;  // n of IntegrateInversePower; -1 where there is no closed form
  InversePower power_;
};

using Kernel = std::variant<FlatKernel, SplitKernel, ThesisKernel>;

Kernel MakeKernel(const FlatEmitter& o) { return FlatKernel(o); }
Kernel MakeKernel(const SplitEmitter& o) { return SplitKernel(o); }
Kernel MakeKernel(const ThesisEmitter& o) { return ThesisKernel(o); }

EmitterTriangle MakeTriangle(const TriMesh& skull, const Triangle& t, double depth_mm,
                             const Kernel& kernel) {
  EmitterTriangle e;
  e.a = skull.points[t[0]];
  e.b = skull.points[t[1]];
  e.c = skull.points[t[2]];
  e.centroid = (e.a + e.b + e.c) / 3;
  const Vec3 area_vector = TriangleAreaVector(skull, t);
  e.area_mm2 = area_vector.norm();
  e.normal = area_vector / e.area_mm2;
  e.depth_mm = depth_mm;
  e.longest2_mm2 =
      std::max({(e.b - e.a).squaredNorm(), (e.c - e.b).squaredNorm(), (e.a - e.c).squaredNorm()});
  e.edge_normal_a = (e.b - e.a).cross(e.normal);
  e.edge_normal_b = (e.c - e.b).cross(e.normal);
  e.edge_normal_c = (e.a - e.c).cross(e.normal);
  e.gain = std::visit([&e](const auto& k) { return k.Gain(e); }, kernel);
  return e;
}

std::vector<EmitterTriangle> MakeEmitters(const TriMesh& skull, std::span<const double> depth_mm,
                                          const Kernel& kernel) {
  if (depth_mm.size() != skull.points.size()) {
    throw InputError(
        fmt::format("implicit surface: {} depths for {} vertices; one a vertex is needed",
                    depth_mm.size(), skull.points.size()));
  }
  for (std::size_t v = 0; v < depth_mm.size(); ++v) {
    if (depth_mm[v] <= 0 || std::isinf(depth_mm[v])) {
      throw InputError(
          fmt::format("implicit surface: the depth of vertex {} is {} mm; it must be positive, or "
                      "NaN where nothing is emitted",
                      v, depth_mm[v]));
    }
  }
  std::vector<EmitterTriangle> emitters;
  for (const Triangle& t : skull.triangles) {
    const double depth = (depth_mm[t[0]] + depth_mm[t[1]] + depth_mm[t[2]]) / 3;
    if (std::isfinite(depth) && TriangleAreaVector(skull, t).norm() > 0) {
      emitters.push_back(MakeTriangle(skull, t, depth, kernel));
    }
  }
  if (emitters.empty()) {
    throw InputError(
        "implicit surface: no triangle has a depth at all three corners; nothing emits");
  }
  return emitters;
}

// Bounding boxes over runs of emitters, for leaving out those whose emission is too small to count.
struct Node {
  Box3 box;
  int begin = 0, end = 0;     // of emitters
  int left = -1, right = -1;  // -1 in a leaf
  double gain = 0;            // sum over its emitters
};

class Tree {
 public:
  explicit Tree(std::vector<EmitterTriangle>& emitters) {
    Split(emitters, 0, static_cast<int>(emitters.size()));
  }

  // Calls visit(begin, end) for each run of emitters that is not left out, in a fixed order. A node
  // is left out where bound(node), the most that it emits at p, is at most `least`; returns the sum
  // of those bounds.
  template <class Bound, class Visit>
  double Near(double least, const Bound& bound, const Visit& visit) const {
    std::array<int, 64> stack;
    int size = 0;
    double left_out = 0;
    stack[size++] = 0;
    while (size > 0) {
      const Node& node = nodes_[stack[--size]];
      const double most = bound(node);
      if (most <= least) {
        left_out += most;
      } else if (node.left < 0) {
        visit(node.begin, node.end);
      } else {
        stack[size++] = node.right;
        stack[size++] = node.left;
      }
    }
    return left_out;
  }

 private:
  static constexpr int kLeaf = 8;

  int Split(std::vector<EmitterTriangle>& emitters, int begin, int end) {
    const int self = static_cast<int>(nodes_.size());
    nodes_.push_back({Box3(), begin, end, -1, -1, 0});
    Box3 box, centers;
    for (int e = begin; e < end; ++e) {
      box.extend(emitters[e].a).extend(emitters[e].b).extend(emitters[e].c);
      centers.extend(emitters[e].centroid);
      nodes_[self].gain += emitters[e].gain;
    }
    nodes_[self].box = box;
    if (end - begin > kLeaf) {
      int axis = 0;
      centers.sizes().maxCoeff(&axis);
      const int middle = (begin + end) / 2;
      std::nth_element(emitters.begin() + begin, emitters.begin() + middle, emitters.begin() + end,
                       [axis](const EmitterTriangle& a, const EmitterTriangle& b) {
                         return a.centroid[axis] < b.centroid[axis];
                       });
      const int left = Split(emitters, begin, middle), right = Split(emitters, middle, end);
      nodes_[self].left = left;
      nodes_[self].right = right;
    }
    return self;
  }

  std::vector<Node> nodes_;
};

}  // namespace

struct ImplicitSurface::Impl {
  Impl(const TriMesh& skull, std::span<const double> depth_mm, const ImplicitOptions& options)
      : kernel(std::visit([](const auto& o) { return MakeKernel(o); }, options.emitter)),
        emitters(MakeEmitters(skull, depth_mm, kernel)),
        tree(emitters),
        tail_error(options.tail_error),
        decay(std::visit([](const auto& o) { return o.decay; }, options.emitter)) {
    std::visit(
        [this](const auto& k) {
          for (const EmitterTriangle& t : emitters) {
            advance_mm = std::max(advance_mm, k.Advance(t));
          }
        },
        kernel);
  }

  // Visits the emitters near p such that the others together emit at most the tail error. The first
  // guess at what a node may emit and be left out nearly always does.
  template <class EmitterKernel, class Begin, class Visit>
  void Near(const EmitterKernel& k, const Vec3& p, const Begin& begin, const Visit& visit) const {
    constexpr double kFirstShare = 1.0 / 128;
    const InversePower falloff(k.Falloff());
    const auto bound = [&](const Node& node) {
      const double distance2 = node.box.squaredExteriorDistance(p);
      if (distance2 <= advance_mm * advance_mm) {
        return std::numeric_limits<double>::infinity();
      }
      return node.gain *
             falloff(advance_mm == 0 ? distance2 : std::pow(std::sqrt(distance2) - advance_mm, 2));
    };
    double least = kFirstShare * tail_error;
    double left_out = 0;
    do {
      begin();
      left_out = tree.Near(least, bound, visit);
      least /= 8;
    } while (left_out > tail_error);
  }

  template <class EmitterKernel>
  double Sum(const EmitterKernel& k, const Vec3& p) const {
    double sum = 0;
    const auto add = [&](int begin, int end) {
      for (int e = begin; e < end; ++e) {
        const double height = (p - emitters[e].a).dot(emitters[e].normal);
        if (height > 0) {
          sum += std::min(k.Emission(emitters[e], p, height), kMostEmission);
        }
      }
    };
    Near(
        k, p, [&sum] { sum = 0; }, add);
    return sum;
  }

  Kernel kernel;
  std::vector<EmitterTriangle> emitters;
  Tree tree;
  double tail_error, decay;
  double advance_mm = 0;  // the most of any emitter
};

ImplicitSurface::ImplicitSurface(const TriMesh& skull, std::span<const double> depth_mm,
                                 const ImplicitOptions& options)
    : impl_(std::make_unique<Impl>(skull, depth_mm, options)) {}
ImplicitSurface::~ImplicitSurface() = default;
ImplicitSurface::ImplicitSurface(ImplicitSurface&&) noexcept = default;

double ImplicitSurface::Value(const Vec3& p) const {
  return std::visit([&](const auto& kernel) { return impl_->Sum(kernel, p); }, impl_->kernel) - 1;
}

double ImplicitSurface::Flattened(const Vec3& p) const {
  constexpr double kLowest = -10;
  const double emission = Value(p) + 1;
  return emission > 0 ? std::max(1 - std::pow(emission, -1 / impl_->decay), kLowest) : kLowest;
}

std::int64_t ImplicitSurface::EmittersNear(const Vec3& p) const {
  std::int64_t count = 0;
  std::visit(
      [&](const auto& kernel) {
        impl_->Near(
            kernel, p, [&count] { count = 0; },
            [&count](int begin, int end) { count += end - begin; });
      },
      impl_->kernel);
  return count;
}

std::int64_t ImplicitSurface::EmitterCount() const {
  return static_cast<std::int64_t>(impl_->emitters.size());
}

double ImplicitSurface::MaxDepth_mm() const {
  double deepest = 0;
  for (const EmitterTriangle& t : impl_->emitters) {
    deepest = std::max(deepest, t.depth_mm);
  }
  return deepest;
}

double ImplicitSurface::EmittersPerSquareDepth() const {
  double squares = 0, area = 0;
  for (const EmitterTriangle& t : impl_->emitters) {
    squares += t.depth_mm * t.depth_mm;  // depth^2 / area, weighted by area
    area += t.area_mm2;
  }
  return squares / area;
}

}  // namespace semblance
