// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_submit.h"

#include <fmt/format.h>

#include <cstdlib>

#include "problems/config/terminal_text.h"
#include "problems/io/output_folder.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

std::string QuotedPath(const fs::path& path) { return QuotedForShell(fs::absolute(path).string()); }

}  // namespace

std::string SubmitScript(const SubmitOptions& o) {
  const std::string name = QuotedForShell("semblance-" + o.study.stem().string());
  std::string extra;
  for (const std::string& option : o.sbatch) {
    extra += fmt::format(" {}", QuotedForShell(option));
  }
  // Fixes the number of shards, because Slurm's own count is smaller if only some elements of the
  // array run again.
  const std::string shard = fmt::format(
      "{} study {} --out {} --jobs {} --quiet --shard \"$SLURM_ARRAY_TASK_ID/{}\"",
      QuotedPath(o.program), QuotedPath(o.study), QuotedPath(o.folder), o.jobs, o.shards);
  const std::string merge = fmt::format("{} merge {}", QuotedPath(o.program), QuotedPath(o.folder));
  const std::string log = fs::absolute(o.folder).string();
  return fmt::format(
      "#!/bin/sh\n"
      "# Submits the study and its merge to Slurm. It may run again: finished trials are skipped.\n"
      "set -eu\n"
      "array=$(sbatch --parsable --requeue --job-name={} --array=0-{} --cpus-per-task={} "
      "--output={}{} \\\n  --wrap={})\n"
      "merge=$(sbatch --parsable --requeue --job-name={} --dependency=afterany:\"${{array%%;*}}\" "
      "--output={}{} \\\n  --wrap={})\n"
      "echo \"shards: job $array; merge: job $merge\"\n",
      name, o.shards - 1, o.jobs, QuotedForShell(log + "/slurm-shard-%a.log"), extra,
      QuotedForShell(shard), name, QuotedForShell(log + "/slurm-merge.log"), extra,
      QuotedForShell(merge));
}

fs::path SubmitStudy(const SubmitOptions& options) {
  OutputFolder folder(options.folder, WhenNotEmpty::kReplaceFiles);
  for (int shard = 0; shard < options.shards; ++shard) {  // Slurm would follow a link
    RefuseLinksBelow(folder.Root(), fmt::format("slurm-shard-{}.log", shard));
  }
  RefuseLinksBelow(folder.Root(), "slurm-merge.log");
  folder.Write("submit.sh", SubmitScript(options));
  const fs::path script = folder.Root() / "submit.sh";
  if (std::system("command -v sbatch > /dev/null 2>&1") != 0) {
    throw InputError(fmt::format(
        "--slurm: this machine has no sbatch; run {} with sh on a machine that has Slurm",
        script.string()));
  }
  if (std::system(("sh " + QuotedPath(script)).c_str()) != 0) {
    throw InputError(fmt::format(
        "{}: sbatch failed, see above; correct the options after --sbatch and submit again",
        script.string()));
  }
  return script;
}

}  // namespace semblance::problems
