// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/hand_edits.h"

#include <fmt/format.h>

#include "problems/edits/edit_script.h"

namespace semblance {

std::optional<HSplineSurface> EditByHand(const Experiment& experiment, MadeFace& made,
                                         Case& subject) {
  if (experiment.edits.empty()) {
    return std::nullopt;
  }
  const EditScript script = ReadEditScript(experiment.edits);
  HSplineSurface before = made.fitted.fit.surface;
  ApplyEdits(script, made.fitted.fit.surface);
  for (HSplineSurface& sample : made.samples) {
    ApplyEdits(script, sample);
  }
  MeasureResiduals(made.fitted);
  subject.inputs.push_back(experiment.edits);
  subject.notes.push_back(
      fmt::format("the face was changed by hand: {} vertices and {} parts of it, by {}; what is "
                  "measured is the changed face",
                  script.edits.size(), script.resets.size(), experiment.edits.filename().string()));
  return before;
}

}  // namespace semblance
