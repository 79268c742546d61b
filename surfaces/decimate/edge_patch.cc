// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/edge_patch.h"

namespace semblance {
namespace {

HalfEdgeIndex FirstOfFan(const HalfEdges& mesh, HalfEdgeIndex h) {
  while (mesh.Twin(h) >= 0) {
    h = mesh.TurnRight(h);
  }
  return h;
}

}  // namespace

void EdgePatch::AppendFan(const HalfEdges& mesh, HalfEdgeIndex from, HalfEdgeIndex before) {
  for (HalfEdgeIndex h = from; h >= 0 && h != before; h = mesh.TurnLeft(h)) {
    spokes.push_back(h);
    ring.push_back(mesh.To(h));
    if (mesh.From(h) == gone) {
      of_gone.push_back(h);
    }
  }
}

void EdgePatch::Gather(const HalfEdges& mesh, HalfEdgeIndex h) {
  const bool turn = mesh.IsOnBorder(mesh.To(h)) && !mesh.IsOnBorder(mesh.From(h));
  edge = turn ? mesh.Twin(h) : h;
  keep = mesh.From(edge);
  gone = mesh.To(edge);
  spokes.clear();
  ring.clear();
  of_gone.clear();
  const HalfEdgeIndex back = mesh.Twin(edge), end = HalfEdges::Next(edge);
  on_border = back < 0;
  closed = !mesh.IsOnBorder(keep);
  if (on_border) {
    AppendFan(mesh, FirstOfFan(mesh, end), end);
  } else {
    const HalfEdgeIndex first = closed ? mesh.TurnLeft(edge) : FirstOfFan(mesh, edge);
    AppendFan(mesh, first, HalfEdges::Next(back));
    AppendFan(mesh, mesh.TurnLeft(back), end);
  }
  if (!closed) {
    AppendFan(mesh, mesh.TurnLeft(edge), -1);
    ring.push_back(spokes.empty() ? -1 : mesh.From(HalfEdges::Previous(spokes.back())));
  }
}

}  // namespace semblance
