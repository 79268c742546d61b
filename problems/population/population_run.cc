// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "problems/config/terminal_text.h"
#include "problems/io/output_folder.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/base/parallel.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

fs::path ResultFile(const fs::path& folder, const std::string& id) {
  return folder / "subjects" / (id + ".json");
}

bool HasGrid(const DenseDepths& depths, const DenseOptions& grid) {
  return depths.columns == grid.columns && depths.rows == grid.rows;
}

// True if the text is what MeasurePopulation writes for that subject.
bool IsResult(const Json& json, const std::string& id, const DenseOptions& grid) try {
  if (json.at("status") == "done" && !HasGrid(ParseSubjectDepths(json.at("depths")).dense, grid)) {
    return false;
  }
  return json.at("id") == id && json.at("status").is_string() &&
         json.value("reason", Json("")).is_string();
} catch (const Json::exception&) {
  return false;
} catch (const IoError&) {
  return false;
}

// Reads a result; nothing if the file is missing, truncated, damaged or another subject's.
std::optional<Json> ReadSubject(const fs::path& folder, const std::string& id,
                                const PopulationPlan& plan) {
  const fs::path file = ResultFile(folder, id);
  if (!fs::is_regular_file(file)) {  // reading a pipe would block
    return std::nullopt;
  }
  try {
    Json json = ParseJson(ReadFileBytes(file), file.string());
    return IsResult(json, id, plan.file.measure.dense) ? std::optional(std::move(json))
                                                       : std::nullopt;
  } catch (const IoError&) {
    return std::nullopt;
  }
}

void WriteSubject(const fs::path& folder, const Json& json, Durability durability) {
  WriteFileAtomically(ResultFile(folder, json.at("id").get<std::string>()),
                      WithPlainTexts(json).dump() + "\n", durability);
}

std::vector<fs::path> ListEntries(const fs::path& folder) {
  std::error_code error;  // an unreadable folder is reported when something is written there
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    entries.push_back(at->path());
  }
  return entries;
}

// The ids of the subjects with a result in the folder, valid or not.
std::vector<std::string> IdsIn(const fs::path& folder) {
  std::vector<std::string> ids;
  for (const fs::path& file : ListEntries(folder / "subjects")) {
    if (file.extension() == ".json") {
      ids.push_back(file.stem().string());
    }
  }
  return ids;
}

// True if the folder contains anything that counts. Temporary files of a running or killed process
// do not count. An empty folder subjects/ does not count either, because another shard may just
// have created it.
bool HasContent(const fs::path& folder) {
  const auto counts = [](const fs::path& entry) {
    const std::string name = entry.filename().string();
    return !(name.starts_with('.') && name.ends_with(".tmp"));
  };
  for (const fs::path& entry : ListEntries(folder)) {
    const bool only_begun =
        entry.filename() == "subjects" && std::ranges::none_of(ListEntries(entry), counts);
    if (counts(entry) && !only_begun) {
      return true;
    }
  }
  return false;
}

// Title and id of another population whose results are in the folder; empty if there are no results
// or only those of this population. Results of an older version have no id.
std::string FindOtherResults(const fs::path& folder, const PopulationFile& file) try {
  const fs::path summary = folder / "population.json";
  if (!fs::exists(summary)) {
    return "";
  }
  const Json json = ParseJson(ReadFileBytes(summary), summary.string());
  const auto title = json.at("title").get<std::string>();
  const auto id = json.value("id", file.id);
  return title == file.title && id == file.id ? "" : fmt::format("'{}' (id {})", title, id);
} catch (const Json::exception&) {
  return "";
} catch (const IoError&) {
  return "";
}

void RequireSubjectsIn(const fs::path& folder) {
  if (!fs::is_directory(folder / "subjects")) {
    throw IoError(fmt::format(
        "{}: {}; --from needs folders into which semblance population has measured subjects",
        folder.string(),
        fs::is_directory(folder) ? "it contains no subjects/" : "the folder does not exist"));
  }
}

class PopulationRunner {
 public:
  PopulationRunner(const PopulationPlan& plan, fs::path folder, const PopulationRunOptions& options,
                   const RunContext& context)
      : plan_(plan), folder_(std::move(folder)), options_(options), context_(context) {}

  PopulationRunSummary Run() {
    MakeFolderBelow(folder_, "subjects");
    for (std::size_t n = 0; n < plan_.entries.size(); ++n) {
      if (static_cast<int>(n % options_.shards) == options_.shard) {
        ++summary_.subjects;
        HasResult(plan_.entries[n].id) ? void(++summary_.skipped) : queue_.push_back(n);
      }
    }
    ParallelFor(queue_.size(), options_.jobs, 1, [this](std::size_t k) {
      context_.ThrowIfStopped();
      Measure(plan_.entries[queue_[k]]);
    });
    return summary_;
  }

 private:
  bool HasResult(const std::string& id) const {
    const auto json = ReadSubject(folder_, id, plan_);
    return json && !(options_.rerun_failed && (*json)["status"] != "done");
  }

  // The references, read once when the first subject needs them.
  const LandmarkReferences& References() {
    const std::lock_guard lock(references_mutex_);
    if (!references_) {
      LandmarkReferences read;
      for (const ReferenceFiles& files : plan_.file.measure.references) {
        read.heads.push_back(ReadReference(files.skull, files.landmarks, context_.threads));
      }
      if (read.heads.empty()) {
        read.mean = ReadMeanSkull();
      }
      references_ = std::move(read);
    }
    return *references_;
  }

  bool NeedsReferences(const PopulationSubject& subject) const {
    const auto* files = std::get_if<FileSubject>(&subject.subject);
    const auto* ct = std::get_if<CtSubject>(&subject.subject);
    return (files != nullptr && files->landmarks.empty()) ||
           (ct != nullptr && ct->landmarks.empty());
  }

  Json TryToMeasure(const PopulationEntry& entry) {
    Json json = {{"id", entry.id}, {"status", "done"}};
    try {
      const RunContext quiet{
          .on_event = {}, .stop_token = context_.stop_token, .threads = context_.threads};
      const LandmarkReferences& references =
          NeedsReferences(entry.subject) ? References() : no_references_;
      json["depths"] = ToJson(MeasureSubject(entry.subject, plan_.file.measure, references, quiet));
    } catch (const Error& error) {
      json["status"] = "failed";
      json["reason"] = error.what();
    } catch (const std::bad_alloc&) {
      json["status"] = "failed";
      json["reason"] = "not enough memory; use fewer --jobs";
    }
    return json;
  }

  void Measure(const PopulationEntry& entry) {
    const Json json = TryToMeasure(entry);
    WriteSubject(folder_, json, Durability::kUnsynced);
    const std::lock_guard lock(mutex_);
    const auto status = json["status"].get<std::string>();
    ++(status == "done" ? summary_.done : summary_.failed);
    if (options_.on_progress) {
      options_.on_progress(summary_.done + summary_.failed, static_cast<int>(queue_.size()),
                           entry.subject.name, status);
    }
  }

  const PopulationPlan& plan_;
  fs::path folder_;
  const PopulationRunOptions& options_;
  const RunContext& context_;
  std::vector<std::size_t> queue_;
  std::mutex mutex_, references_mutex_;
  PopulationRunSummary summary_;
  std::optional<LandmarkReferences> references_;
  const LandmarkReferences no_references_ = {};
};

}  // namespace

PopulationRunSummary MeasurePopulation(const PopulationPlan& plan, const fs::path& folder,
                                       const PopulationRunOptions& options,
                                       const RunContext& context) {
  return PopulationRunner(plan, folder, options, context).Run();
}

std::vector<MeasuredSubject> ReadMeasured(const PopulationPlan& plan, const fs::path& folder) {
  std::vector<MeasuredSubject> measured;
  for (const PopulationEntry& entry : plan.entries) {
    MeasuredSubject& subject =
        measured.emplace_back(MeasuredSubject{.person = entry.subject, .id = entry.id});
    const auto json = ReadSubject(folder, entry.id, plan);
    if (!json) {
      continue;
    }
    subject.status = (*json)["status"].get<std::string>();
    subject.reason = json->value("reason", "");
    if (subject.status == "done") {
      subject.depths = ParseSubjectDepths(json->at("depths"));
    }
  }
  return measured;
}

std::vector<GatheredFrom> GatherSubjects(const PopulationPlan& plan, const fs::path& folder,
                                         const std::vector<fs::path>& others) {
  std::vector<GatheredFrom> gathered;
  for (const fs::path& other : others) {
    RequireSubjectsIn(other);
    gathered.push_back({.folder = other});
  }
  MakeFolderBelow(folder, "subjects");
  for (GatheredFrom& from : gathered) {
    for (const PopulationEntry& entry : plan.entries) {
      const auto json = ReadSubject(from.folder, entry.id, plan);
      from.held += json ? 1 : 0;
      if (json && !ReadSubject(folder, entry.id, plan)) {
        WriteSubject(folder, *json, Durability::kSynced);
        ++from.taken;
      }
    }
  }
  return gathered;
}

void RefuseOtherFolder(const PopulationPlan& plan, const fs::path& folder) {
  const auto refuse = [&](const std::string& what) {
    throw IoError(
        fmt::format("{}: {}; name another --out, or add --force to replace files of the same name",
                    folder.string(), what));
  };
  const std::vector<std::string> there = IdsIn(folder);
  if (there.empty() && HasContent(folder)) {
    refuse("the folder is not empty and contains no population");
  }
  const bool shares = std::ranges::any_of(plan.entries, [&](const PopulationEntry& entry) {
    return std::ranges::find(there, entry.id) != there.end();
  });
  if (!there.empty() && !shares) {
    refuse(
        "the folder contains another population: none of its subjects has the same files and the "
        "same options as one of this population");
  }
  if (const std::string other = FindOtherResults(folder, plan.file); !other.empty()) {
    refuse(fmt::format("the folder contains another population, {}; this is '{}' (id {})", other,
                       plan.file.title, plan.file.id));
  }
}

}  // namespace semblance::problems
