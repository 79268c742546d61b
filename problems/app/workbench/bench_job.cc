// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_job.h"

#include <exception>
#include <new>
#include <utility>

namespace semblance::problems {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

void BenchJob::Start(const std::string& name, int threads,
                     std::function<std::string(const RunContext&)> work) {
  Stop();
  {
    const std::lock_guard lock(mutex_);
    status_ = {.name = name, .state = JobState::kRunning, .step = "starting"};
    began_ = std::chrono::steady_clock::now();
  }
  thread_ = std::jthread([this, threads, work = std::move(work)](const std::stop_token& stop) {
    RunContext context;
    context.stop_token = stop;
    context.threads = threads;
    context.on_event = [this](const Event& event) {
      const std::lock_guard lock(mutex_);
      status_.step = event.message.empty() ? event.step : event.step + ": " + event.message;
      status_.fraction = event.fraction;
    };
    Run(work, context);
  });
}

void BenchJob::Run(const std::function<std::string(const RunContext&)>& work,
                   const RunContext& context) {
  JobState state = JobState::kFinished;
  std::string words;
  try {
    words = work(context);
  } catch (const Cancelled&) {
    state = JobState::kStopped;
    words = "stopped";
  } catch (const std::bad_alloc&) {
    state = JobState::kFailed;
    words = "not enough memory; lower implicit.resolution, or use smaller meshes";
  } catch (const std::exception& error) {
    state = JobState::kFailed;
    words = error.what();
  }
  const std::lock_guard lock(mutex_);
  status_.state = state;
  status_.words = std::move(words);
  status_.seconds = SecondsSince(began_);
}

void BenchJob::Cancel() { thread_.request_stop(); }

void BenchJob::Stop() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
}

JobStatus BenchJob::Status() const {
  const std::lock_guard lock(mutex_);
  JobStatus status = status_;
  if (status.state == JobState::kRunning) {
    status.seconds = SecondsSince(began_);
  }
  return status;
}

}  // namespace semblance::problems
