// SPDX-License-Identifier: GPL-3.0-or-later
// The input files of experiments: lists them, and checks before anything runs that they can be
// used.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/config/config_binder.h"
#include "problems/experiment/experiment.h"
#include "problems/experiment/stage_cache.h"
#include "problems/io/given_files.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

// The files that an experiment reads, each with the option that names it, in the order of the
// options. A table that no depth is taken from (`depths: measured`, and a scheme that needs no mean
// depths) is left out.
std::vector<NamedFile> NamedInputs(const Experiment& experiment);

// The same files without the options.
std::vector<std::filesystem::path> InputFiles(const Experiment& experiment);

// Input files that a job of the experiment must not overwrite: its configuration and the files
// above. `outputs` names the files that the job may write; it is kept by reference.
GivenFiles GivenTo(const Experiment& experiment, const std::filesystem::path& config,
                   std::span<const std::string_view> outputs);

struct CheckFindings {
  std::vector<std::string> faults;    // a line each; a run with a fault would be refused
  std::vector<std::string> warnings;  // findings that may be intended, a line each

  bool sound() const { return faults.empty(); }
  void Add(const CheckFindings& more);  // skips lines that are already there
};

// Reads the inputs that experiments name and checks them as a run would: meshes, volumes, landmarks
// and whether they lie on the bone, tables and whether they have the sites' depths, networks,
// templates, priors, busts, depth maps and edit scripts. Each input is read once, for any number of
// experiments. A phantom is made only if a check needs it.
class InputCheck {
 public:
  // `loaded` keeps the inputs for a run that follows; null if there is none.
  explicit InputCheck(const RunContext& context, StageCache* loaded = nullptr)
      : context_(context), loaded_(loaded == nullptr ? own_ : *loaded) {}

  // Finds all faults of the experiment's inputs. Skips checks that need a faulty input (landmarks
  // on a skull that cannot be read). Throws Cancelled.
  CheckFindings Look(const Experiment& experiment);

 private:
  // The findings of a check, which runs once per key. Its exceptions become faults.
  const CheckFindings& Once(const std::string& key,
                            const std::function<void(CheckFindings&)>& check);

  CheckFindings CheckSubjectFiles(const Experiment& experiment);
  CheckFindings CheckTissue(const Experiment& experiment);
  CheckFindings CheckFace(const Experiment& experiment);
  CheckFindings CheckCase(const Experiment& experiment);

  RunContext context_;
  StageCache own_{6};
  StageCache& loaded_;
  std::map<std::string, CheckFindings> known_;
};

}  // namespace semblance::problems
