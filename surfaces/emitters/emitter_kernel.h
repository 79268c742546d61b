// SPDX-License-Identifier: GPL-3.0-or-later
// What each emitter of emitter.h gives a point, one overload set a kind. For implicit_surface.cc
// alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <variant>

#include "surfaces/emitters/distance_batch.h"
#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/flat_kernel.h"

namespace semblance {

// Each kernel: its emitters are summed in runs of kRun; Gain(t) sets EmitterTriangle::gain; what a
// triangle emits at a height > 0 is at most most_gain * Most(distance^2, height), distances taken
// to the triangle and where it is moved to, by Advance(t) along its normal, and 0 where it would be
// less than Cut(). FlatKernel emits by itself; the others, from distances of at least Floor(t), as
// Fall() says (distance_batch.h).

// gain / distance^k of the thesis's emitters; 0 where that is less than the cut.
class DistanceFalloff {
 public:
  DistanceFalloff(double decay, double cut_below) : k_(decay), cut_(cut_below), power_(decay) {}
  double Decay() const { return k_; }
  double Cut() const { return cut_; }
  double Power(double squared) const { return power_(squared); }
  DistanceFall Fall() const {
    return {k_, k_ == std::floor(k_) ? static_cast<int>(k_) : -1, cut_, kMostEmission};
  }
  ReachFall Reach() const {
    const DistanceFall fall = Fall();
    return {fall.decay, fall.whole, false, cut_};
  }
  double At(const EmitterTriangle& t, double squared, double depth_share) const {
    const double emission = t.gain * power_(std::max(squared, t.Floor2(depth_share)));
    return emission < cut_ ? 0 : std::min(emission, kMostEmission);
  }

 private:
  double k_, cut_;
  InversePower power_;
};

class ThesisKernel {
 public:
  static constexpr int kRun = DistanceBatch::kLanes;
  explicit ThesisKernel(const ThesisEmitter& o) : falloff_(o.decay, o.cut_below) {}
  double Gain(const EmitterTriangle& t) const { return std::pow(t.depth_mm, falloff_.Decay()); }
  double AtDistance(const EmitterTriangle& t, double d) const { return falloff_.At(t, d * d, 1); }
  double Decay() const { return falloff_.Decay(); }
  double Most(double squared, double) const { return falloff_.Power(squared); }
  double Cut() const { return falloff_.Cut(); }
  DistanceFall Fall() const { return falloff_.Fall(); }
  ReachFall Reach() const { return falloff_.Reach(); }
  double Advance(const EmitterTriangle&) const { return 0; }
  double Floor(const EmitterTriangle& t) const { return std::sqrt(t.Floor2(1)); }
  double EmittingDepth(const EmitterTriangle& t) const { return t.depth_mm; }

 private:
  DistanceFalloff falloff_;
};

class SplitKernel {
 public:
  static constexpr int kRun = DistanceBatch::kLanes;
  explicit SplitKernel(const SplitEmitter& o) : t_(o.split), falloff_(o.decay, o.cut_below) {}
  double Gain(const EmitterTriangle& t) const {
    return std::pow(EmittingDepth(t), falloff_.Decay());
  }
  // From the moved triangle.
  double AtDistance(const EmitterTriangle& t, double d) const {
    return falloff_.At(t, d * d, 1 - t_);
  }
  double Decay() const { return falloff_.Decay(); }
  double Most(double squared, double) const { return falloff_.Power(squared); }
  double Cut() const { return falloff_.Cut(); }
  DistanceFall Fall() const { return falloff_.Fall(); }
  ReachFall Reach() const { return falloff_.Reach(); }
  double Advance(const EmitterTriangle& t) const { return t_ * t.depth_mm; }
  double Floor(const EmitterTriangle& t) const { return std::sqrt(t.Floor2(1 - t_)); }
  double EmittingDepth(const EmitterTriangle& t) const { return (1 - t_) * t.depth_mm; }

 private:
  double t_;
  DistanceFalloff falloff_;
};

using Kernel = std::variant<FlatKernel, SplitKernel, ThesisKernel>;

inline Kernel MakeKernel(const FlatEmitter& o) { return FlatKernel(o); }
inline Kernel MakeKernel(const SplitEmitter& o) { return SplitKernel(o); }
inline Kernel MakeKernel(const ThesisEmitter& o) { return ThesisKernel(o); }

}  // namespace semblance
