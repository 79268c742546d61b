// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue depth at every vertex of a skull: the value that passes from interpolation to the implicit
// surface.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

enum class DepthStatus : std::uint8_t {
  kAssigned,   // the scheme gave a depth
  kOutside,    // in no dowel area; the depth, if finite, is the outside rule's
  kNotFacing,  // in an area, but on bone that faces away from its dowels (inner table, far side)
};

// What one scheme counts in an average of several.
struct SchemeShare {
  std::string scheme;
  double weight = kNaN;  // 0..1
};

// The Gaussian process that a scheme takes depths for: what its likelihood found, or the options
// fixed.
struct DepthProcess {
  double length_mm = kNaN;  // over which depths resemble each other
  double signal_mm = kNaN;  // standard deviation
  double nugget_mm = kNaN;  // that all dowels have beside their own; 0 where none is sought
  double mean_mm = kNaN;    // by generalised least squares: that of the mean over the dowels
  std::vector<std::string> at_end = {};  // in words, what the likelihood's range held back
};

// All vectors but the last have one entry per vertex.
struct DepthField {
  std::vector<double> depth_mm;  // NaN where there is none: such a vertex does not emit
  std::vector<DepthStatus> status;
  std::vector<double> sd_mm;                 // NaN where the scheme knows none
  std::vector<SchemeShare> shares = {};      // of sum 1; empty where one scheme alone was asked for
  std::optional<DepthProcess> process = {};  // where the scheme is one
};

}  // namespace semblance
