// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the inputs of experiments can be used, before anything runs.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "problems/pipeline/experiment.h"
#include "problems/pipeline/stage_cache.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct CheckFindings {
  std::vector<std::string> faults;    // a line each; with one, a run would be refused
  std::vector<std::string> warnings;  // what may be meant so, a line each

  bool sound() const { return faults.empty(); }
  void Add(const CheckFindings& more);  // without what is there already
};

// Opens what experiments name, and looks at it as a run would: meshes, volumes, landmarks and
// whether they lie on the bone, tables and whether they have the sites' depths, networks,
// templates, priors, busts, depth maps, edit scripts. Each is read once, however many experiments
// name it. Phantoms are made only for what cannot be known without them.
class InputCheck {
 public:
  // loaded: keeps what was read for who runs the experiments afterwards; null: nobody does.
  explicit InputCheck(const RunContext& context, StageCache* loaded = nullptr)
      : context_(context), loaded_(loaded == nullptr ? own_ : *loaded) {}

  // All faults of the experiment's inputs. What rests on an input that is at fault (the landmarks
  // on a skull that cannot be read) is left out. Throws Cancelled.
  CheckFindings Look(const Experiment& experiment);

 private:
  // The findings of a look, which is taken once for a key; what it throws is a fault.
  const CheckFindings& Once(const std::string& key,
                            const std::function<void(CheckFindings&)>& look);

  CheckFindings LookAtSubject(const Experiment& experiment);
  CheckFindings LookAtTissue(const Experiment& experiment);
  CheckFindings LookAtFace(const Experiment& experiment);
  CheckFindings LookAtCase(const Experiment& experiment);

  RunContext context_;
  StageCache own_{6};
  StageCache& loaded_;
  std::map<std::string, CheckFindings> known_;
};

}  // namespace semblance
