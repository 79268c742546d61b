// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_state.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "problems/config/config.h"
#include "problems/subject/sites.h"

namespace semblance::problems {
namespace {

struct EditedVertex {
  int level = 0, i = 0, j = 0;
};

// Difference of the edits to those of the step before. Storing all edits in each of a hundred steps
// would exceed the size limit of a configuration file.
struct EditChanges {
  std::vector<RegionReset> resets;
  std::vector<EditedVertex> gone;
  std::vector<VertexEdit> edits;  // new and changed ones; they follow the unchanged ones
};

struct WrittenStep {
  std::string what;
  BenchState state;                   // without its edits if `edited` is set
  std::optional<EditChanges> edited;  // changes since the step before
};

struct WrittenHistory {
  std::vector<WrittenStep> steps;
  int now = 0;
};

template <class Visitor>
void Fields(Visitor& visit, EditedVertex& o) {
  visit(FieldInfo{.name = "level", .min = 0, .max = 8}, o.level);
  visit(FieldInfo{.name = "i", .min = 0, .max = 10000}, o.i);
  visit(FieldInfo{.name = "j", .min = 0, .max = 10000}, o.j);
}

template <class Visitor>
void Fields(Visitor& visit, EditChanges& o) {
  visit(FieldInfo{.name = "resets"}, o.resets);
  visit(FieldInfo{.name = "gone"}, o.gone);
  visit(FieldInfo{.name = "edits"}, o.edits);
}

template <class Visitor>
void Fields(Visitor& visit, WrittenStep& o) {
  visit(FieldInfo{.name = "what"}, o.what);
  visit(FieldInfo{.name = "state"}, o.state);
  visit(FieldInfo{.name = "edited"}, o.edited);
}

template <class Visitor>
void Fields(Visitor& visit, WrittenHistory& o) {
  visit(FieldInfo{.name = "now", .min = 0, .max = 100000}, o.now);
  visit(FieldInfo{.name = "steps", .min = 1}, o.steps);
}

template <class Report>
void CheckValue(Report& report, const WrittenHistory& history) {
  if (history.now >= static_cast<int>(history.steps.size())) {
    report("now", "is beyond the last step");
  }
}

using VertexKey = std::array<int, 3>;

VertexKey ToKey(const auto& vertex) { return {vertex.level, vertex.i, vertex.j}; }

EditChanges ChangesBetween(const EditScript& before, const EditScript& after) {
  std::map<VertexKey, std::optional<std::array<double, 3>>> was;
  for (const VertexEdit& edit : before.edits) {
    was[ToKey(edit)] = edit.offset;
  }
  EditChanges changes{.resets = after.resets, .gone = {}, .edits = {}};
  for (const VertexEdit& edit : after.edits) {
    const auto found = was.find(ToKey(edit));
    if (found == was.end() || found->second != edit.offset) {
      changes.edits.push_back(edit);
    }
    if (found != was.end()) {
      was.erase(found);
    }
  }
  for (const auto& [vertex, offset] : was) {
    changes.gone.push_back({vertex[0], vertex[1], vertex[2]});
  }
  return changes;
}

EditScript ApplyChanges(const EditScript& before, const EditChanges& changes) {
  std::set<VertexKey> other;
  for (const EditedVertex& vertex : changes.gone) {
    other.insert(ToKey(vertex));
  }
  for (const VertexEdit& edit : changes.edits) {
    other.insert(ToKey(edit));
  }
  EditScript after{.resets = changes.resets, .edits = before.edits};
  std::erase_if(after.edits, [&](const VertexEdit& edit) { return other.contains(ToKey(edit)); });
  after.edits.insert(after.edits.end(), changes.edits.begin(), changes.edits.end());
  return after;
}

bool SameEdits(const EditScript& a, const EditScript& b) {
  return std::ranges::equal(a.edits, b.edits, [](const VertexEdit& x, const VertexEdit& y) {
    return ToKey(x) == ToKey(y) && x.offset == y.offset;
  });
}

// before: the edits of the step before; null for the first step. Edits whose order EditChanges
// cannot reproduce are stored as a whole.
WrittenStep ToWrittenStep(const BenchStep& step, const EditScript* before) {
  WrittenStep written{.what = step.what, .state = step.state, .edited = std::nullopt};
  if (before != nullptr) {
    EditChanges changes = ChangesBetween(*before, step.state.edits);
    if (SameEdits(ApplyChanges(*before, changes), step.state.edits)) {
      written.state.edits = {};
      written.edited = std::move(changes);
    }
  }
  return written;
}

}  // namespace

std::vector<SitePoint> ConfirmedSites(const BenchState& state) {
  std::vector<SitePoint> sites;
  for (const BenchLandmark& l : state.landmarks) {
    if (!l.proposed && IsStandardSite(l.site)) {
      sites.push_back({l.site, Vec3(l.point[0], l.point[1], l.point[2])});
    }
  }
  return sites;
}

LandmarkFile ToLandmarkFile(const BenchState& state) {
  LandmarkFile file;
  file.subject = state.subject.empty() ? "subject" : state.subject;
  for (const BenchLandmark& l : state.landmarks) {
    file.landmarks.push_back({.site = l.site,
                              .point = l.point,
                              .normal = l.normal,
                              .depth_along_normal_mm = l.depth_along_normal_mm,
                              .depth_closest_mm = l.depth_closest_mm,
                              .certainty = l.certainty,
                              .doubt_mm = l.doubt_mm,
                              .note = l.note});
    file.proposed = file.proposed || l.proposed;
  }
  for (const BenchAbsent& absent : state.absent) {
    file.absent.push_back({absent.site, absent.reason});
  }
  return file;
}

BenchHistory BeginHistory(BenchState state) {
  return {.steps = {{"began", std::move(state)}}, .now = 0};
}

BenchHistory AddStep(BenchHistory history, std::string what, BenchState state) {
  history.steps.resize(static_cast<std::size_t>(history.now) + 1);
  history.steps.push_back({std::move(what), std::move(state)});
  if (history.steps.size() > kMaxHistorySteps) {
    history.steps.erase(history.steps.begin());
  }
  history.now = static_cast<int>(history.steps.size()) - 1;
  return history;
}

bool CanUndo(const BenchHistory& history) { return history.now > 0; }

bool CanRedo(const BenchHistory& history) {
  return history.now + 1 < static_cast<int>(history.steps.size());
}

BenchHistory Undone(BenchHistory history) {
  history.now -= CanUndo(history) ? 1 : 0;
  return history;
}

BenchHistory Redone(BenchHistory history) {
  history.now += CanRedo(history) ? 1 : 0;
  return history;
}

std::string HistoryText(const BenchHistory& history) {
  WrittenHistory written{.steps = {}, .now = history.now};
  const EditScript* before = nullptr;
  for (const BenchStep& step : history.steps) {
    written.steps.push_back(ToWrittenStep(step, before));
    before = &step.state.edits;
  }
  return WriteConfig(written);
}

BenchHistory HistoryFromText(std::string_view text, const std::string& name) {
  const auto written = ReadConfigText<WrittenHistory>(text, name);
  BenchHistory history{.steps = {}, .now = written.now};
  for (const WrittenStep& step : written.steps) {
    history.steps.push_back({step.what, step.state});
    if (step.edited && history.steps.size() > 1) {
      history.steps.back().state.edits =
          ApplyChanges(history.steps[history.steps.size() - 2].state.edits, *step.edited);
    }
  }
  return history;
}

}  // namespace semblance::problems
