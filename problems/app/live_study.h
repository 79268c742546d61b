// SPDX-License-Identifier: GPL-3.0-or-later
// A page in the browser that shows a study while it runs: its progress, and the report of the
// trials that are finished so far.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "problems/app/workbench/page_request.h"
#include "problems/study/study_progress.h"

namespace semblance::problems {

// The state of the page. All functions may be called from several threads.
class LiveStudy {
 public:
  // The folder of the study, which need not exist yet.
  LiveStudy(std::string title, std::filesystem::path folder);

  // Takes the arguments of StudyRunOptions::on_progress.
  void Update(const StudyEta& eta, const std::string& trial);

  // States that the study has ended.
  void End();

  // Waits until an open page knows the end and has the last report, or for this time. Returns at
  // once if no page has asked for anything in the last ten seconds.
  void WaitForPage(std::chrono::milliseconds longest);

  // Answers "" (the page), its files, "api/state" (JSON) and "run/report.html" (the report of the
  // trials so far, made again after a trial has ended). Never throws.
  PageReply Answer(const PageRequest& request);

 private:
  using Clock = std::chrono::steady_clock;
  std::string StateJson();
  std::string ReportPage();

  std::string title_;
  std::filesystem::path folder_;
  std::mutex report_mutex_;  // one report is made at a time
  std::string report_;       // guarded by report_mutex_
  int reported_ = -1;        // finished trials of report_
  std::mutex mutex_;         // guards all below
  std::condition_variable changed_;
  StudyEta eta_;
  std::vector<std::string> failed_;  // the first failed trials of this run
  bool is_over_ = false;
  // The last state that the page took has the end. A page that does not know it yet asks again.
  bool knows_end_ = false;
  bool has_last_ = false;  // the page has taken a report since it knows the end
  Clock::time_point asked_ = Clock::time_point::min();
};

}  // namespace semblance::problems
