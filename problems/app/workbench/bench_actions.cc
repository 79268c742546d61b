// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_actions.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

void CheckSite(const std::string& site) {
  if (const std::string complaint = SiteFault(site); !complaint.empty()) {
    throw InputError("landmarks: " + complaint);
  }
}

auto Find(std::vector<BenchLandmark>& landmarks, const std::string& site) {
  return std::ranges::find(landmarks, site, &BenchLandmark::site);
}

BenchLandmark& RequirePlaced(BenchState& state, const std::string& site) {
  const auto at = Find(state.landmarks, site);
  if (at == state.landmarks.end()) {
    throw InputError(fmt::format("landmarks: {} is not placed", DescribeSite(site)));
  }
  return *at;
}

void DropAbsence(BenchState& state, const std::string& site) {
  std::erase_if(state.absent, [&site](const BenchAbsent& absent) { return absent.site == site; });
}

// "a.b" lies below "a", and so does "a[0]".
bool LiesBelow(const std::string& path, const std::string& top) {
  return path.size() > top.size() && path.starts_with(top) &&
         (path[top.size()] == '.' || path[top.size()] == '[');
}

BenchLandmark ToBench(const Landmark& l, bool proposed) {
  return {.site = l.site,
          .point = l.point,
          .normal = l.normal,
          .depth_along_normal_mm = l.depth_along_normal_mm,
          .depth_closest_mm = l.depth_closest_mm,
          .certainty = l.certainty,
          .doubt_mm = l.doubt_mm,
          .note = l.note,
          .proposed = proposed};
}

// From here on the point is a person's.
void TakeOver(BenchLandmark& landmark) {
  landmark.proposed = false;
  landmark.doubt_mm.reset();
}

// A file may hold a person's points beside proposed ones, which alone have a doubt then.
bool IsProposed(const Landmark& landmark, const LandmarkFile& file) {
  return file.proposed &&
         (landmark.doubt_mm || std::ranges::none_of(file.landmarks, [](const Landmark& l) {
            return l.doubt_mm.has_value();
          }));
}

}  // namespace

BenchState NameCase(BenchState state, const std::string& name) {
  if (name.empty() || name.size() > kMaxName_bytes) {
    throw InputError(fmt::format("name: a case has a name of 1 to {} bytes", kMaxName_bytes));
  }
  state.subject = name;
  return state;
}

BenchState PlaceLandmark(BenchState state, const std::string& site, const Vec3& point) {
  CheckSite(site);
  if (!point.allFinite()) {
    throw InputError("landmarks: the point is not finite");
  }
  const auto at = Find(state.landmarks, site);
  BenchLandmark& landmark =
      at == state.landmarks.end() ? state.landmarks.emplace_back(BenchLandmark{.site = site}) : *at;
  landmark.point = {point.x(), point.y(), point.z()};
  landmark.normal.reset();
  if (landmark.proposed) {
    TakeOver(landmark);
    if (landmark.note.starts_with("proposed")) {  // it explained the proposed point
      landmark.note.clear();
    }
  }
  DropAbsence(state, site);
  return state;
}

BenchState TurnLandmark(BenchState state, const std::string& site,
                        const std::optional<Vec3>& direction) {
  BenchLandmark& landmark = RequirePlaced(state, site);
  landmark.normal.reset();
  if (direction) {
    if (!direction->allFinite() || !(direction->norm() > 0)) {
      throw InputError("landmarks: the direction has no length");
    }
    const Vec3 unit = direction->normalized();
    landmark.normal = {unit.x(), unit.y(), unit.z()};
  }
  return state;
}

BenchState RemoveLandmark(BenchState state, const std::string& site) {
  const BenchLandmark& placed = RequirePlaced(state, site);
  state.landmarks.erase(state.landmarks.begin() + (&placed - state.landmarks.data()));
  return state;
}

BenchState RenameLandmark(BenchState state, const std::string& site, const std::string& name) {
  CheckSite(name);
  BenchLandmark& landmark = RequirePlaced(state, site);
  if (const auto other = Find(state.landmarks, name); other != state.landmarks.end()) {
    other->site = site;
  }
  landmark.site = name;
  DropAbsence(state, name);
  return state;
}

BenchState MarkAbsent(BenchState state, const std::string& site, const std::string& reason) {
  CheckSite(site);
  std::erase_if(state.landmarks, [&site](const BenchLandmark& l) { return l.site == site; });
  DropAbsence(state, site);
  state.absent.push_back({site, reason.empty() ? "not stated" : reason});
  return state;
}

BenchState RemarkLandmark(BenchState state, const std::string& site,
                          const LandmarkRemarks& remarks) {
  const auto& depth = remarks.depth_along_normal_mm;
  if (depth && !(*depth >= 0.01 && *depth <= 100)) {
    throw InputError(fmt::format("landmarks: the depth is {} mm; give 0.01 to 100", *depth));
  }
  if (remarks.note.size() > kMaxNote_bytes) {
    throw InputError(fmt::format("landmarks: the note has {} bytes; shorten it to {}",
                                 remarks.note.size(), kMaxNote_bytes));
  }
  BenchLandmark& landmark = RequirePlaced(state, site);
  landmark.certainty = remarks.certainty;
  landmark.note = remarks.note;
  landmark.depth_along_normal_mm = depth;
  return state;
}

BenchState ConfirmLandmark(BenchState state, const std::string& site) {
  TakeOver(RequirePlaced(state, site));
  return state;
}

BenchState ConfirmAllLandmarks(BenchState state) {
  std::string doubtful;
  for (const BenchLandmark& landmark : state.landmarks) {
    if (landmark.IsDoubtful()) {
      doubtful += (doubtful.empty() ? "" : ", ") + landmark.site;
    }
  }
  if (!doubtful.empty()) {
    throw InputError(fmt::format(
        "landmarks: look at the doubtful ones first and confirm or move each: {}", doubtful));
  }
  std::ranges::for_each(state.landmarks, &TakeOver);
  return state;
}

BenchState LeaveOutDoubtfulLandmarks(BenchState state) {
  const std::vector<BenchLandmark> landmarks = state.landmarks;
  for (const BenchLandmark& landmark : landmarks) {
    if (landmark.IsDoubtful()) {
      state = MarkAbsent(std::move(state), landmark.site, "the proposed point was doubtful");
    }
  }
  return ConfirmAllLandmarks(std::move(state));
}

BenchState ReplaceLandmarks(BenchState state, const LandmarkFile& file) {
  state.landmarks.clear();
  state.absent.clear();
  for (const Landmark& landmark : file.landmarks) {
    state.landmarks.push_back(ToBench(landmark, IsProposed(landmark, file)));
  }
  for (const AbsentLandmark& absent : file.absent) {
    state.absent.push_back({absent.site, absent.reason});
  }
  if (!file.subject.empty()) {
    state.subject = file.subject;
  }
  return state;
}

BenchState AddProposals(BenchState state, const LandmarkFile& file) {
  for (const Landmark& landmark : file.landmarks) {
    const auto at = Find(state.landmarks, landmark.site);
    const bool is_absent =
        std::ranges::find(state.absent, landmark.site, &BenchAbsent::site) != state.absent.end();
    if (at == state.landmarks.end() && !is_absent) {
      state.landmarks.push_back(ToBench(landmark, /*proposed=*/true));
    } else if (at != state.landmarks.end() && at->proposed) {
      *at = ToBench(landmark, /*proposed=*/true);
    }
  }
  return state;
}

BenchState ChangeSetting(BenchState state, const std::string& path, const std::string& value) {
  if (path.empty() || value.find('\n') != std::string::npos) {
    throw InputError("settings: an option needs a path, and a value on one line");
  }
  const bool is_type = path.ends_with(".type");
  const std::string whole = is_type ? path.substr(0, path.size() - 5) : path;
  std::erase_if(state.settings, [&](const BenchSetting& setting) {
    return setting.path == path || setting.path == whole || LiesBelow(setting.path, whole);
  });
  state.settings.push_back({path, value});
  return state;
}

BenchState DropSetting(BenchState state, const std::string& path) {
  std::erase_if(state.settings, [&path](const BenchSetting& setting) {
    return setting.path == path || LiesBelow(setting.path, path);
  });
  return state;
}

BenchState ChangeFrame(BenchState state, const std::vector<std::string>& sites,
                       const FileSubject& before, const FileSubject& after) {
  const auto turn = [&](const std::array<double, 3>& v) {
    const Vec3 now = ToLps(ToLps({v[0], v[1], v[2]}, before.axes.value_or(Axes::kLps)),
                           after.axes.value_or(Axes::kLps));
    return std::array{now.x(), now.y(), now.z()};
  };
  const double scale = Millimetres(after.units) / Millimetres(before.units);
  for (BenchLandmark& landmark : state.landmarks) {
    if (std::ranges::find(sites, landmark.site) == sites.end()) {
      continue;
    }
    landmark.point = turn(landmark.point);
    for (double& x : landmark.point) {
      x *= scale;
    }
    if (landmark.normal) {
      landmark.normal = turn(*landmark.normal);
    }
  }
  return state;
}

BenchState ReplaceEdits(BenchState state, EditScript edits) {
  state.edits = std::move(edits);
  return state;
}

}  // namespace semblance::problems
