// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance turntable`: the skull and the face of a run, turning side by side about vertical axes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct TurntableOptions {
  int frames = 36;      // pictures of one turn, 1 to 720
  double seconds = 8;   // of one turn in the .glb, > 0
  int height_px = 640;  // of a picture, 64 to 2160
};

struct TurntableFrame {
  std::string name;  // frame_000.png
  std::string png;
};

struct Turntable {
  // A .glb in metres, +y up, with the nodes `skull` (bone and depth markers) and `face` (the head,
  // if the run has one, otherwise the recovered face) beside each other, and one animation that
  // turns both by one turn, the subject's left side first.
  std::string glb;
  // The same as pictures, at even angles from the front view on.
  std::vector<TurntableFrame> frames;
};

// Reads scene.json and dowels.csv of the run's folder. Throws IoError if they are missing or not
// those of a run, InputError for options out of range, and Cancelled on request.
Turntable MakeTurntable(const std::filesystem::path& run, const TurntableOptions& options,
                        const RunContext& context);

}  // namespace semblance::problems
