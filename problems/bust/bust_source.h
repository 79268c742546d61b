// SPDX-License-Identifier: GPL-3.0-or-later
// Which head the face is put into at the end: what an experiment says under `bust`.
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>

#include "surfaces/base/fields.h"

namespace semblance {

// `ict` where the template is, else none.
struct AutoBust {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoBust&) {}

struct NoBust {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoBust&) {}

// The head of the ICT-FaceKit model, as configs/faces/ict has it.
struct IctBust {
  static constexpr std::string_view kName = "ict";
};
template <class Visitor>
void Fields(Visitor&, IctBust&) {}

// The head of the template, as `semblance template --bust` writes it.
struct HSplineBust {
  static constexpr std::string_view kName = "hspline";
  std::filesystem::path file;  // of `semblance template --bust`
};
template <class Visitor>
void Fields(Visitor& visit, HSplineBust& o) {
  visit(FieldInfo{.name = "file",
                  .doc = "file (.json) of the head, as `semblance template --bust` writes it "
                         "beside the template"},
        o.file);
}

// Any head.
struct MeshBust {
  static constexpr std::string_view kName = "mesh";
  std::filesystem::path mesh;       // a whole head in one piece, LPS, mm
  std::filesystem::path landmarks;  // points on its skin
};
template <class Visitor>
void Fields(Visitor& visit, MeshBust& o) {
  visit(FieldInfo{.name = "mesh",
                  .doc = "a whole head in one piece, LPS in mm: OBJ (texture coordinates and "
                         "materials are kept), PLY, STL or OFF"},
        o.mesh);
  visit(FieldInfo{.name = "landmarks",
                  .doc = "points on its skin, as `semblance template` takes them: .csv with "
                         "site,x,y,z or i_multipie,x,y,z, or landmarks of a skull with depths"},
        o.landmarks);
}

using BustSource = std::variant<AutoBust, NoBust, IctBust, HSplineBust, MeshBust>;

}  // namespace semblance
