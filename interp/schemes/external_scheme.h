// SPDX-License-Identifier: GPL-3.0-or-later
// A scheme of the caller, such as a function of Python, in place of a built-in one.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

// One depth per vertex in mm, above 0, or NaN for none. sd_mm is empty or has one entry per vertex.
struct ExternalDepths {
  std::vector<double> depth_mm, sd_mm;
};

// The function of an external scheme. Threads may call it at the same time. A failure of the
// function itself is an ExternalFailure.
struct ExternalFunction {
  std::function<ExternalDepths(const DepthInput&,
                               const std::map<std::string, std::string>& options)>
      interpolate;
  bool needs_surface = false;  // needs the triangles of the skull, also in cross-validation
  bool needs_network = false;  // needs a dowel network with at least one area
};

// The caller's function failed. `what` has one line; `traceback` shows a programmer the place.
class ExternalFailure : public std::runtime_error {
 public:
  ExternalFailure(const std::string& what, std::string traceback)
      : std::runtime_error(what), traceback_(std::move(traceback)) {}
  const std::string& traceback() const { return traceback_; }

 private:
  std::string traceback_;
};

struct ExternalScheme {
  static constexpr std::string_view kName = "external";
  std::string name = {};
  std::string source_hash = {};
  std::map<std::string, std::string> options = {};
  // Null: the scheme is not loaded. A configuration cannot set it.
  std::shared_ptr<const ExternalFunction> function = {};
};
template <class Visitor>
void Fields(Visitor& visit, ExternalScheme& o) {
  visit(FieldInfo{.name = "name",
                  .doc = "name of a scheme in Python; a configuration writes {type: NAME} instead, "
                         "and `python3 -m semblance` loads it"},
        o.name);
  visit(FieldInfo{.name = "source_hash",
                  .doc = "hash of the scheme's source, so that another source makes another trial"},
        o.source_hash);
  visit(FieldInfo{.name = "options", .doc = "the scheme's own options, as texts"}, o.options);
}
template <class Report>
void CheckValue(Report& report, const ExternalScheme& o) {
  if (!o.function) {
    report("name", "the scheme '" + o.name +
                       "' is written in Python and is not loaded; run the study with `python3 -m "
                       "semblance study`, or give the scheme to semblance.run or semblance.study");
  }
}

// Calls the scheme's function and checks its result. A vertex with NaN is kOutside. Throws
// InputError as CheckDepthInput does; if the scheme is not loaded or lacks the triangles or areas
// that it needs; and if it does not return one number per vertex, each finite and above 0 or NaN
// (with the vertex). Throws ExternalFailure if the function fails.
DepthField InterpolateDepth(const ExternalScheme& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
