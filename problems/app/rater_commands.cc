// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/app/all_commands.h"
#include "problems/app/exit_code.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/io/given_files.h"
#include "problems/study/rater_page.h"
#include "surfaces/base/atomic_file.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

struct RaterPageArguments {
  std::vector<std::string> runs, others;
  RaterPageOptions options;
  WorkOptions work;
};

struct RaterScoreArguments {
  std::string key, out;
  std::vector<std::string> answers;
  bool force = false;
};

std::vector<fs::path> Paths(const std::vector<std::string>& names) {
  return {names.begin(), names.end()};
}

int PageCommand(const RaterPageArguments& a) {
  RaterPageOptions options = a.options;
  options.runs = Paths(a.runs);
  options.others = Paths(a.others);
  StagedFolder folder = MakeStagedFolder(a.work, "", {});
  const RaterPage page = MakeRaterPage(options, MakeRunContext(a.work));
  folder.Files().Write("key.csv", page.key);
  folder.Files().Write("page.html", page.html);
  folder.Publish();
  Tell("{}: page.html with {} questions for the raters, and key.csv, which they must not see\n",
       folder.Root().string(), options.runs.size());
  return kDone;
}

std::string PlainNumber(double value) { return fmt::format("{:.3g}", value); }

void PrintStatistics(const RaterStatistics& s) {
  Tell("{} answers to {} questions\n", s.answers, s.questions);
  Tell(
      "right person first: {} of {} ({:.1f} %, 95 % interval {:.1f} to {:.1f} %); by chance {:.1f} "
      "%, p = {}\n",
      s.hits, s.answers, 100 * s.hit_rate, 100 * s.hit_95.low, 100 * s.hit_95.high,
      100 * s.chance_hit_rate, PlainNumber(s.hit_p));
  Tell("mean rank of the right person: {:.2f}; by chance {:.2f}, p = {}\n", s.mean_rank,
       s.chance_rank, PlainNumber(s.rank_p));
  if (std::isfinite(s.agreement)) {
    Tell("agreement of the raters (Kendall's W, mean over questions): {:.2f}\n", s.agreement);
  }
}

int ScoreCommand(const RaterScoreArguments& a) {
  std::vector<fs::path> given = Paths(a.answers);
  const RaterStatistics statistics = SummarizeRaters(ReadRaterAnswers(a.key, given));
  if (!a.out.empty()) {
    given.emplace_back(a.key);
    RefuseToReplace(fs::path(a.out), given);
    RefuseExisting(a.out, a.force);
    WriteFileAtomically(a.out, RaterStatisticsCsv(statistics));
  }
  PrintStatistics(statistics);
  return kDone;
}

void DeclareRaterPage(CLI::App& page, CommandLine& line) {
  RaterPageArguments& a = *Bind(page, line, &PageCommand);
  page.add_option("RUN", a.runs, "folders of runs of persons with a true skin; a question for each")
      ->required();
  page.add_option("--others", a.others,
                  "folders of further runs, whose true skins only fill the pools");
  page.add_option("--pool", a.options.pool, "faces in a pool: the right one and others [6]")
      ->check(CLI::Range(2, 9));
  page.add_option("--random_seed", a.options.random_seed, "draws pools, order and poses [1]")
      ->check(WholeNumber());
  AddOutput(page, a.work);
  page.get_option("--out")->required();
  AddWork(page, line, a.work);
}

void DeclareRaterScore(CLI::App& score, CommandLine& line) {
  RaterScoreArguments& a = *Bind(score, line, &ScoreCommand);
  score.add_option("KEY", a.key, "key.csv of the page")->required();
  score.add_option("ANSWERS", a.answers, "answers that the page saved (.csv)")->required();
  score.add_option("--out", a.out, "file for the statistics (.csv)");
  score.add_flag("--force", a.force, "replace a file of the same name");
}

constexpr std::array kRaterCommands = {
    ProgramCommand{"page", "write the page on which people choose, and its key", &DeclareRaterPage},
    ProgramCommand{"score", "hit rate, mean rank and agreement of the answers", &DeclareRaterScore},
};

void DeclareRaters(CLI::App& raters, CommandLine& line) {
  raters.require_subcommand(1);
  Declare(kRaterCommands, raters, line);
}

}  // namespace

std::span<const ProgramCommand> RaterCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"raters", "test whether people recognise recovered faces", &DeclareRaters},
  };
  return kCommands;
}

}  // namespace semblance::problems
