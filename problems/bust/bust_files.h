// SPDX-License-Identifier: GPL-3.0-or-later
// A posed bust as files for other programs.
#pragma once

#include <string>
#include <vector>

#include "problems/bust/pose_bust.h"

namespace semblance {

struct NamedBytes {
  std::string name;
  std::string bytes;
};

// bust.glb (binary glTF 2.0: in metres, +y up, the face towards +z), bust.obj with bust.mtl (mm,
// LPS), and the textures of a bust that has some, in bust_textures/ under names that differ. An OBJ
// keeps its lines but for the points; without materials of its own the skin is called `skin`.
// bust.glb has the colours of its points, but where a material has a picture. Single precision.
// Throws IoError for a texture that can no longer be read, InputError for one that is no PNG or
// JPEG any more.
std::vector<NamedBytes> BustToFiles(const Bust& bust, const BustModel& model);

}  // namespace semblance
