// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/surface_join.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {
namespace {

// Empty if the surface has it. option: that the edge stands at.
std::string EdgeFault(const HSplineShape& shape, SurfaceEdge edge, std::string_view option) {
  if (HasEdge(shape, edge)) {
    return "";
  }
  return shape.ClosedV() ? "goes round both ways and has no border; leave the join out"
                         : fmt::format("goes round in u and has no border at {}; give {}: v0 or v1",
                                       NameOf(edge), option);
}

void CheckItsEdge(const OpenedJoin& opened, std::string_view option, Closure closure) {
  const SurfaceJoin& join = opened.join;
  const HSplineShape& its = opened.surface.shape();
  const std::string where = fmt::format("{}: {}", option, join.surface.filename().string());
  if (const std::string fault = EdgeFault(its, join.its_edge, "its_edge"); !fault.empty()) {
    throw InputError(where + " " + fault);
  }
  const bool ours_closed = IsClosedAlong({.closure = closure}, join.edge);
  if (IsClosedAlong(its, join.its_edge) != ours_closed) {
    throw InputError(fmt::format(
        "{}: its edge {} is {} and the new edge {} is {}; join closed edges to closed ones", where,
        NameOf(join.its_edge), ours_closed ? "open" : "closed", NameOf(join.edge),
        ours_closed ? "closed" : "open"));
  }
}

}  // namespace

std::vector<OptionFault> JoinFaults(std::span<const SurfaceJoin> joins, Closure closure) {
  std::vector<OptionFault> faults;
  for (std::size_t k = 0; k < joins.size(); ++k) {
    const std::string option = fmt::format("joins[{}]", k);
    if (joins[k].surface.empty()) {
      faults.push_back({option + ".surface", "it names no file; give an H-spline's"});
    }
    if (const std::string fault = EdgeFault({.closure = closure}, joins[k].edge, "edge");
        !fault.empty()) {
      faults.push_back({option + ".edge", "a surface of this closure " + fault});
    }
    const auto earlier = joins.first(k);
    if (std::ranges::find(earlier, joins[k].edge, &SurfaceJoin::edge) != earlier.end()) {
      faults.push_back({option + ".edge", fmt::format("{} is joined already; join each edge once",
                                                      NameOf(joins[k].edge))});
    }
  }
  return faults;
}

std::vector<EdgeSpan> OpenedJoin::ItsSpans() const {
  std::vector<EdgeSpan> spans = SpansAlong(surface, join.its_edge);
  if (join.reversed) {
    std::ranges::reverse(spans);
    for (EdgeSpan& span : spans) {
      span.index = (ItsPatches() << span.level) - 1 - span.index;
    }
  }
  return spans;
}

bool OpenedJoin::FitsInto(int patches) const {
  const auto odd_part = [](int count) {
    return count >> std::countr_zero(static_cast<unsigned>(count));
  };
  return odd_part(ItsPatches()) == odd_part(patches);
}

std::vector<OpenedJoin> OpenJoins(std::span<const SurfaceJoin> joins, Closure closure) {
  std::vector<OpenedJoin> opened;
  for (const SurfaceJoin& join : joins) {
    const std::string text = ReadFileBytes(join.surface);
    opened.push_back({.join = join,
                      .sha256 = Sha256OfText(text),
                      .surface = HSplineFromJson(text, join.surface.string())});
    CheckItsEdge(opened.back(), fmt::format("joins[{}]", opened.size() - 1), closure);
  }
  return opened;
}

}  // namespace semblance
