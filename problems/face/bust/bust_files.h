// SPDX-License-Identifier: GPL-3.0-or-later
// A posed bust as files for other programs.
#pragma once

#include <string>
#include <vector>

#include "problems/face/bust/pose_bust.h"

namespace semblance::problems {

struct NamedBytes {
  std::string name;
  std::string bytes;
};

// bust.glb (binary glTF 2.0: in metres, +y up, the face towards +z), bust.obj with bust.mtl (mm,
// LPS), and the textures of the bust, in bust_textures/ under different names. An OBJ keeps its
// lines except for the points. Without materials of its own its skin is called `skin`. bust.glb has
// the colours of the points, except where a material has a picture. Single precision. Throws
// IoError if a texture can no longer be read, and InputError if it is no PNG or JPEG any more.
std::vector<NamedBytes> BustToFiles(const Bust& bust, const BustModel& model);

}  // namespace semblance::problems
