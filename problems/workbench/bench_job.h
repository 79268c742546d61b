// SPDX-License-Identifier: GPL-3.0-or-later
// One long piece of work in the background at a time.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "surfaces/base/geometry.h"
#include "surfaces/base/run_context.h"

namespace semblance {

enum class JobState { kIdle, kRunning, kFinished, kFailed, kStopped };

struct JobStatus {
  std::string name;  // "run", "propose"
  JobState state = JobState::kIdle;
  std::string step;        // of the work, as RunContext reports it
  double fraction = kNaN;  // of the step
  double seconds = kNaN;   // since it began; of a finished one, in all
  std::string words = {};  // why it failed, or what came of it
};

class BenchJob {
 public:
  ~BenchJob() { Stop(); }

  // Starts the work in a thread of its own; a piece that still runs is stopped first. work returns
  // what came of it, for people. What it throws becomes the status.
  void Start(const std::string& name, int threads,
             std::function<std::string(const RunContext&)> work);

  // Asks the work to stop, and returns at once.
  void Cancel();

  // Waits until nothing runs.
  void Stop();

  JobStatus Status() const;

 private:
  void Run(const std::function<std::string(const RunContext&)>& work, const RunContext& context);

  mutable std::mutex mutex_;
  JobStatus status_;
  std::chrono::steady_clock::time_point began_;
  std::jthread thread_;
};

}  // namespace semblance
