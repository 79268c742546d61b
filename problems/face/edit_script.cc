// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/edit_script.h"

#include <fmt/format.h>

#include <map>

#include "problems/config/config.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using Changes = std::map<VertexId, std::optional<Vec3>>;

std::optional<Vec3> ToVec3(const std::optional<std::array<double, 3>>& v) {
  return v ? std::optional(Vec3((*v)[0], (*v)[1], (*v)[2])) : std::nullopt;
}

bool Holds(const std::array<double, 2>& range, double x) {
  return range[0] <= range[1] ? x >= range[0] && x <= range[1] : x >= range[0] || x <= range[1];
}

void AddResets(const std::vector<RegionReset>& resets, const HSplineSurface& surface,
               Changes& changes) {
  for (const RegionReset& reset : resets) {
    for (const auto& [vertex, offset] : surface.Offsets()) {
      const Vec2 uv = surface.GrevillePoint(vertex);
      if (vertex.level >= reset.first_level && Holds(reset.u, uv.x()) && Holds(reset.v, uv.y())) {
        changes[vertex] = std::nullopt;
      }
    }
  }
}

// The edits by vertex, including those of level 0.
Changes EditsByVertex(const std::vector<VertexEdit>& edits) {
  Changes changes;
  for (const VertexEdit& edit : edits) {
    const VertexId vertex{edit.level, edit.i, edit.j};
    if (!changes.emplace(vertex, ToVec3(edit.offset)).second) {
      throw InputError(fmt::format("vertex ({}, {}) of level {} appears twice; keep one", edit.i,
                                   edit.j, edit.level));
    }
  }
  return changes;
}

// Moves a vertex of level 0 in `net`, and adds the opposite move to `inverse`.
void MoveVertex(const VertexId& vertex, const std::optional<Vec3>& offset, ControlNet& net,
                EditScript& inverse) {
  if (vertex.i < 0 || vertex.i >= net.columns || vertex.j < 0 || vertex.j >= net.rows) {
    throw InputError(
        fmt::format("edit script: there is no vertex ({}, {}) on level 0; i is 0..{}, j is 0..{}",
                    vertex.i, vertex.j, net.columns - 1, net.rows - 1));
  }
  if (!offset) {
    throw InputError(fmt::format(
        "edit script: vertex ({}, {}) of level 0 has no coarser surface to follow; give "
        "an offset",
        vertex.i, vertex.j));
  }
  net.At(vertex.i, vertex.j) += *offset;
  inverse.edits.push_back(MakeEdit(vertex, Vec3(-*offset)));
}

}  // namespace

VertexEdit MakeEdit(const VertexId& vertex, const std::optional<Vec3>& offset) {
  return {vertex.level, vertex.i, vertex.j,
          offset ? std::optional(std::array{offset->x(), offset->y(), offset->z()}) : std::nullopt};
}

EditScript ReadEditScript(const std::filesystem::path& path) {
  EditScript script = ReadConfig<EditScript>(path);
  try {
    EditsByVertex(script.edits);
  } catch (const InputError& e) {
    throw InputError(fmt::format("{}: {}", path.string(), e.what()));
  }
  return script;
}

EditScript ApplyEdits(const EditScript& script, HSplineSurface& surface) {
  HSplineSurface next = surface;
  EditScript inverse;
  ControlNet net = surface.Net(0);
  Changes changes;
  AddResets(script.resets, surface, changes);
  for (const auto& [vertex, offset] : EditsByVertex(script.edits)) {
    if (vertex.level == 0) {
      MoveVertex(vertex, offset, net, inverse);
    } else {
      changes[vertex] = offset;
    }
  }
  if (!inverse.edits.empty()) {
    next.SetNet(0, net);
  }
  next.SetOffsets(changes);
  for (const auto& [vertex, offset] : changes) {
    inverse.edits.push_back(MakeEdit(vertex, surface.Offset(vertex)));
  }
  surface = std::move(next);
  return inverse;
}

}  // namespace semblance::problems
