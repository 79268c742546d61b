// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/live_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>
#include <utility>

#include "problems/app/workbench/bench_assets.h"
#include "problems/config/terminal_text.h"
#include "problems/report/report_assets.h"
#include "problems/study/report/study_report.h"

namespace semblance::problems {
namespace {

constexpr const char* kHtml = "text/html; charset=utf-8";

PageReply AssetReply(const std::string& name, const char* type) {
  for (const BenchAsset& file : PageFiles()) {
    if (file.name == name) {
      return {200, type, std::string(file.text), {}};
    }
  }
  return {404, "text/plain; charset=utf-8", "the program has no such file", {}};
}

}  // namespace

LiveStudy::LiveStudy(std::string title, std::filesystem::path folder)
    : title_(std::move(title)), folder_(std::move(folder)) {}

void LiveStudy::Update(const StudyEta& eta, const std::string& trial) {
  constexpr std::size_t kMostFailed = 20;
  const std::lock_guard lock(mutex_);
  if (eta.failed > eta_.failed && failed_.size() < kMostFailed) {
    failed_.push_back(PlainText(trial));
  }
  eta_ = eta;
}

void LiveStudy::End() {
  const std::lock_guard lock(mutex_);
  is_over_ = true;
}

void LiveStudy::WaitForPage(std::chrono::milliseconds longest) {
  constexpr std::chrono::seconds kPatience{10};
  std::unique_lock lock(mutex_);
  if (asked_ != Clock::time_point::min() && Clock::now() - asked_ < kPatience) {
    changed_.wait_for(lock, longest, [this] { return has_last_; });
  }
}

std::string LiveStudy::StateJson() {
  const std::lock_guard lock(mutex_);
  knows_end_ = is_over_;
  return nlohmann::ordered_json{{"title", PlainText(title_)},
                                {"words", EtaText(eta_)},
                                {"finished", eta_.finished},
                                {"trials", eta_.trials},
                                {"failed", failed_},
                                {"over", is_over_},
                                {"report", (folder_ / "report.html").string()}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string LiveStudy::ReportPage() {
  const std::lock_guard one_at_a_time(report_mutex_);
  bool is_over = false, is_last = false;
  int finished = 0;
  {
    const std::lock_guard lock(mutex_);
    is_over = is_over_;
    is_last = knows_end_;
    finished = eta_.finished;
  }
  if (finished != reported_ || is_over) {
    report_ = StudyReportHtml(ReadStudyResults(folder_, TrialCheck::kShown), folder_);
    reported_ = finished;
  }
  if (is_last) {
    const std::lock_guard lock(mutex_);
    has_last_ = true;
    changed_.notify_all();
  }
  return report_;
}

PageReply LiveStudy::Answer(const PageRequest& request) {
  try {
    {
      const std::lock_guard lock(mutex_);
      asked_ = Clock::now();
    }
    if (request.method != "GET") {
      return {405, "text/plain; charset=utf-8", "only GET is answered", {}};
    }
    if (request.path == "api/state") {
      return {200, "application/json", StateJson(), {}};
    }
    if (request.path == "run/report.html") {
      return {200, kHtml, ReportPage(), {}};
    }
    if (request.path == "report.css") {
      return {200, "text/css; charset=utf-8", std::string(ReportStyle()), {}};
    }
    if (request.path == "study.js") {
      return AssetReply("study.js", "text/javascript; charset=utf-8");
    }
    return request.path.empty() ? AssetReply("study.html", kHtml)
                                : PageReply{404, "text/plain; charset=utf-8", "no such page", {}};
  } catch (const std::exception& error) {
    return {500, "text/plain; charset=utf-8", PlainText(error.what()), {}};
  }
}

}  // namespace semblance::problems
