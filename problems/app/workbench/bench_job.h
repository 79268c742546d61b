// SPDX-License-Identifier: GPL-3.0-or-later
// Runs one long job at a time in a background thread.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "surfaces/base/geometry.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

enum class JobState { kIdle, kRunning, kFinished, kFailed, kStopped };

struct JobStatus {
  std::string name;  // "run", "propose", "open", "variants"
  JobState state = JobState::kIdle;
  std::string step;        // of the work, from RunContext
  double fraction = kNaN;  // of the step
  double seconds = kNaN;   // since the start, or the whole duration of an ended job
  std::string words = {};  // summary of the result, or reason of the failure
};

class BenchJob {
 public:
  ~BenchJob() { Stop(); }

  // Starts the work in its own thread, after stopping a job that still runs. work returns a summary
  // for people. An exception of work becomes the status.
  void Start(const std::string& name, int threads,
             std::function<std::string(const RunContext&)> work);

  // Requests a stop and returns at once.
  void Cancel();

  // Requests a stop and waits until the job has ended.
  void Stop();

  JobStatus Status() const;

 private:
  void Run(const std::function<std::string(const RunContext&)>& work, const RunContext& context);

  mutable std::mutex mutex_;
  JobStatus status_;
  std::chrono::steady_clock::time_point began_;
  std::jthread thread_;
};

}  // namespace semblance::problems
