// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/program_end.h"
#include "problems/app/work_options.h"
#include "problems/app/workbench/bench_api.h"
#include "problems/app/workbench/http_server.h"
#include "problems/config/terminal_text.h"
#include "problems/io/output_folder.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The arguments of the command.
struct WorkbenchArguments {
  std::string source, out;
  std::vector<std::pair<std::string, std::string>> references;
  int port = 0;
  int threads = DefaultThreads();
  bool open = false;
  std::stop_token stop;
};

// If the source is the folder of a workbench, its work is continued.
BenchOptions MakeBenchOptions(const WorkbenchArguments& a) {
  BenchOptions options;
  options.references = a.references;
  options.threads = a.threads;
  if (a.out.empty() && fs::exists(fs::path(a.source) / "workbench.yaml")) {
    options.folder = a.source;
    return options;
  }
  options.source = a.source;
  const std::string name = a.source.empty() ? "workbench" : PlainName(a.source);
  options.folder = a.out.empty() ? "out/" + name + "_workbench" : a.out;
  if (!a.source.empty() && !fs::exists(a.source)) {
    throw IoError(fmt::format("{}: no such file or folder", a.source));
  }
  return options;
}

// Passes the address in a file that only this user can read, because other users of this machine
// can see the arguments of a command.
void OpenBrowser(const fs::path& folder, const std::string& url) {
  const std::string file = (folder / ".semblance-workbench" / "open.html").string();
  WriteSecret(
      file,
      fmt::format("<!DOCTYPE html><meta http-equiv=\"refresh\" content=\"0; url={}\">\n", url));
  if (::fork() == 0) {
    ::execlp("xdg-open", "xdg-open", file.c_str(), nullptr);
    ::_exit(127);
  }
}

// Opens the workbench. If its source is refused, an unused folder stays as it was.
std::unique_ptr<Bench> OpenBench(const BenchOptions& options) {
  NewFolders made(options.folder);
  const bool was_empty = fs::is_empty(options.folder);
  try {
    auto bench = std::make_unique<Bench>(options);
    made.Keep();
    return bench;
  } catch (...) {
    for (fs::directory_iterator at(options.folder), end; was_empty && at != end; ++at) {
      std::error_code ignored;
      fs::remove_all(at->path(), ignored);
    }
    throw;
  }
}

// Listens at the folder's last address, so that a page that is still open goes on. If its port is
// taken meanwhile, another one is used. port: 0 for any.
std::unique_ptr<HttpServer> Listen(Bench& bench, int port) {
  const BenchAddress last = ReadAddress(bench.Folder());
  HttpServerOptions options{.port = port != 0 ? port : last.port,
                            .token = last.token.empty() ? RandomToken() : last.token,
                            .limits = {}};
  const AnswerPage answer = [&bench](const PageRequest& request) { return Answer(bench, request); };
  std::unique_ptr<HttpServer> server;
  try {
    server = std::make_unique<HttpServer>(answer, options);
  } catch (const IoError&) {
    if (port != 0 || last.port == 0) {
      throw;
    }
    options.port = 0;
    server = std::make_unique<HttpServer>(answer, options);
  }
  StoreAddress(bench.Folder(), {server->Port(), options.token});
  return server;
}

int Workbench(const WorkbenchArguments& a) {
  const std::unique_ptr<Bench> opened = OpenBench(MakeBenchOptions(a));
  Bench& bench = *opened;
  const std::unique_ptr<HttpServer> listening = Listen(bench, a.port);
  HttpServer& server = *listening;
  Tell(
      "folder: {}\nopen in a browser on this machine: {}\nCtrl-C ends the program; nothing is "
      "lost\n",
      bench.Folder().string(), server.Url());
  std::fflush(stdout);
  if (a.open) {
    OpenBrowser(bench.Folder(), server.Url());
  }
  {
    const std::jthread serving([&server](const std::stop_token& stop) { server.Serve(stop); });
    while (!a.stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    RemoveStopTimeout();  // closing open connections may take some seconds
  }
  Tell("ended; `semblance workbench {}` continues the work\n", bench.Folder().string());
  return kDone;
}

void DeclareWorkbench(CLI::App& workbench, CommandLine& line) {
  WorkbenchArguments& a = *Bind(workbench, line, &Workbench);
  a.stop = line.stop;
  workbench.add_option(
      "SOURCE", a.source,
      "mesh of a skull, CT (file or DICOM folder), configuration, or the folder of "
      "a workbench to continue; none: choose in the page");
  workbench.add_option("--out", a.out,
                       "folder for the work; work in it is continued [out/NAME_workbench]");
  workbench.add_option("--port", a.port, "port of 127.0.0.1 [any free one]")
      ->check(CLI::Range(0, 65535));
  workbench.add_option(
      "--reference", a.references,
      "SKULL LANDMARKS: a skull with known landmarks, for proposals; may be repeated");
  AddThreads(workbench, a.threads);
  workbench.add_flag("--open", a.open, "open the page in the desktop's browser (xdg-open)");
}

}  // namespace

std::span<const ProgramCommand> WorkbenchCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"workbench",
                     "place landmarks and make a face in a browser, on this machine alone",
                     &DeclareWorkbench},
  };
  return kCommands;
}

}  // namespace semblance::problems
