// SPDX-License-Identifier: GPL-3.0-or-later
// One workbench at work: the folder's states, the head, the faces made of it. Knows no HTTP.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/edits/pull.h"
#include "problems/propose/reference_head.h"
#include "problems/workbench/bench_checks.h"
#include "problems/workbench/bench_faces.h"
#include "problems/workbench/bench_folder.h"
#include "problems/workbench/bench_job.h"
#include "problems/workbench/bench_open.h"
#include "problems/workbench/bench_subject.h"
#include "problems/workbench/bench_variants.h"

namespace semblance {

struct BenchOptions {
  std::filesystem::path source;  // skull, volume or configuration to begin with; may be empty
  std::filesystem::path folder;  // of the workbench; with work in it, that goes on
  std::vector<std::pair<std::string, std::string>> references;  // skull, landmarks: for proposals
  int threads = 1;
};

// A face of a finished run.
struct RunFace {
  HSplineSurface before_edits;
  std::vector<Dowel> dowels;
  std::vector<std::string> notes;
  std::string key;    // what it was made from, edits apart
  std::string edits;  // the script that run/ was made with
};

// Safe from several threads. What it throws leaves all as it was.
class Bench {
 public:
  // Reads the references, then opens the folder: goes on with the work in it, or begins with the
  // source. Throws IoError, InputError or ConfigError.
  explicit Bench(const BenchOptions& options);
  ~Bench();

  // All that the page shows, at one moment.
  struct Snapshot {
    int revision = 0;  // grows with each change
    int subject_revision = 0;
    BenchHistory history;
    Experiment experiment;
    LandmarkChecks checks;
    std::shared_ptr<const BenchSubject> subject;
    JobStatus job;
    bool has_face = false;    // of a run
    bool face_fresh = false;  // and it is of the present state
    bool run_saved = false;   // and run/ holds it, edits and all
    int face_revision = 0;
    std::vector<BenchVariant> variants = {};  // whose full faces are of the present state
  };
  Snapshot Look() const;

  const std::filesystem::path& Folder() const { return folder_.Root(); }

  // A new step of the history, from the present state. Throws what `action` throws, or ConfigError
  // for a state that no run would take.
  void Do(const std::string& what, const std::function<BenchState(BenchState)>& action);
  void Undo();
  void Redo();

  // Places a site where the ray first meets the bone; a ray that misses, at the bone's nearest
  // point to `near`.
  void PlaceByRay(const std::string& site, const Vec3& origin, const Vec3& direction,
                  const Vec3& near);
  void TakePredicted();

  // Pulls the face of the last run at the point of it that is nearest to `at`.
  void PullAt(const Vec3& at, Pull pull);
  // What such a pull does to each vertex that is shown (bench_pull.h).
  std::array<std::vector<Vec3>, 3> PullMovesAt(const Vec3& at, Pull pull) const;

  // Detail of a part of the face, kept in features/ under a name, or blended in: weight 0 is the
  // run's own, 1 the library's.
  void KeepFeature(const std::string& part, const std::string& name);
  void BlendFeature(const std::string& name, double weight);
  std::vector<std::string> PartsOfFace() const;
  std::vector<std::string> KeptFeatures() const;

  BenchFace Coarse(BenchVariant variant = BenchVariant::kAsIs) const;
  // As if one option were set, which is tried out and not kept.
  BenchFace CoarseWith(const BenchSetting& setting) const;
  // Of the last run, with the present edits. Throws InputError where there is none.
  BenchFace Full() const;
  // As a run of the variant makes it. Throws InputError where it is not made.
  BenchFace FullVariant(BenchVariant variant) const;

  // Axes or unit of the subject's files, as ChangeSetting takes them. Landmarks that lay on the
  // bone go along with it; others, which a file may have in the right frame, stay.
  void CorrectFrame(const std::string& path, const std::string& value);

  // In the background.
  void StartOpening(const OpenRequest& request);
  void StartRun();
  void StartProposal();
  // Full faces of those variants that are not made yet.
  void StartVariants(const std::vector<BenchVariant>& variants);
  void CancelJob();

 private:
  using Work = std::function<std::string(const RunContext&)>;

  void StartJob(const std::string& name, const std::function<Work()>& prepare);
  void CheckSkull() const;
  void Take(BenchHistory history, bool keeps_run = false);
  void LoadSubjectOf(const Experiment& experiment, const RunContext& context);
  void FindFormerRun();
  RunFace FinishRun(const Experiment& experiment, const RunContext& context, int revision);
  std::string KeyOfVariants() const;
  Experiment ExperimentOfVariant(BenchVariant variant) const;
  void FindFormerVariants();
  bool HasVariant(BenchVariant variant) const;
  std::optional<BenchFace> FaceAsIs(BenchVariant variant) const;
  void MakeVariant(BenchVariant variant, int revision, const RunContext& context);
  std::string MakeVariants(const std::vector<BenchVariant>& variants, int revision,
                           const RunContext& context);
  std::string Propose(const RunContext& context);
  std::string Open(const OpenRequest& request, const RunContext& context);
  BenchFace CoarseOf(const BenchSubject& subject, const Experiment& experiment,
                     const BenchState& state) const;
  const RunFace& FreshFace() const;
  HSplineSurface Edited(const RunFace& face) const;
  RunContext Context() const;

  std::mutex starting_;       // held by who starts a job, before mutex_
  mutable std::mutex mutex_;  // of all below
  BenchOptions options_;
  std::vector<ReferenceHead> references_;  // of the options
  BenchFolder folder_;
  BenchHistory history_;
  Experiment experiment_;
  LandmarkChecks checks_;
  std::shared_ptr<const BenchSubject> subject_;
  std::string subject_key_, present_key_;
  int revision_ = 1, subject_revision_ = 1, face_revision_ = 0;
  std::optional<RunFace> face_;
  VariantFaces variants_;
  mutable StageCache models_{6};  // templates and priors: they come from no file of the folder
  mutable StageCache coarse_{8};  // coarse faces: those that were tried out last, those compared
  std::shared_ptr<StageCache> run_stages_;  // of one set of landmarks
  BenchJob job_;                            // last: it is stopped first
};

}  // namespace semblance
