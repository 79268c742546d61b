// SPDX-License-Identifier: GPL-3.0-or-later
// A running workbench: the folder's history of states, the head, and the faces made from them.
// Independent of HTTP.
//
// STATES
//
// Four parts of a Bench change. Their states are:
//
//   1. Decisions (history_): a list of steps with a cursor.
//
//        step 0 --Apply--> step 1 --Apply--> step 2      Apply after Undo drops the later steps.
//               <--Undo---        <--Undo---             A finished Open or Propose job adds a step
//               ---Redo-->        ---Redo-->             in the same way.
//
//   2. Subject (subject_): NO SKULL (subject_->bone is null) or SKULL. Opening a head, and undo or
//      redo across that step, move between them.
//
//   3. Full face of the last run (face_), as TakeSnapshot reports it:
//
//                    run ends, or
//                    a stored run is found    edits or texts change
//        NO FACE ----------------> SAVED <--------------------> UNSAVED
//                                   |  ^                           |  ^
//               landmarks, options, |  |  the same changed back,   |  |
//               subject or a file   |  |  by undo for example      |  |
//               on the disk change  v  |                           v  |
//                                  STALE  <-------------------> STALE
//                                     any change of state; the end of a run leads to SAVED
//
//        SAVED:   has_face, face_fresh, run_saved. run/ holds this face with the present edits.
//        UNSAVED: has_face, face_fresh. run/ holds this face with other edits, or a report with
//                 other texts (name, title, record). Pulls and features work in SAVED and UNSAVED
//                 only.
//        STALE:   has_face. The face belongs to other landmarks, options, contents of files or
//                 another subject. It is kept, because undo may make it fresh again. Full() still
//                 returns it.
//
//      Variants (variants_) are fresh or stale alike, except that a change of edits makes them
//      stale too.
//
//   4. Job (job_): at most one runs.
//
//                   Start...                     the work returns
//        IDLE, or  ---------------> RUNNING ----------------------------> FINISHED
//        any ended                    |  |        the work throws
//        state                        |  +------------------------------> FAILED
//                                     |           Cancelled is thrown
//                                     +---------------------------------> STOPPED
//
//      Start... while RUNNING stops the former job and waits for its end first. CancelJob, and each
//      Commit of an action, only request a stop.
//
// INVARIANTS (mutex_ is held whenever they may be broken)
//
//   (1) experiment_, subject_, checks_ and present_key_ belong to the current step of history_.
//       Commit alone changes these members. It computes all of them before it writes the folder,
//       and assigns them afterwards, so that an exception leaves the Bench unchanged.
//   (2) workbench.yaml is history_; Commit replaces it as a whole before the assignment. Then it
//       writes config.yaml, landmarks.yaml and edits.yaml, which follow from the current step. If
//       one of these writes fails, workbench.yaml is a step ahead until the next Commit. If the
//       process ends between them, the next workbench reads workbench.yaml and writes the others.
//   (3) subject_ holds the meshes that the files of subject_key_ contained when they were loaded.
//       TakeSnapshot and the start of a job notice files that have changed on the disk (by size and
//       times, then by hash), and commit the present state again.
//   (4) Keys are made of options and of the contents of files, never of paths. face_ is fresh if
//       and only if face_->key == present_key_; a variant, if and only if its key is VariantsKey().
//       Faces are never deleted when they become stale. The key of a run is that of the files
//       before the run read them, so a file that changes meanwhile makes the face stale.
//   (5) run_key.txt, with the keys of the face and of the rest, is written after run/ and
//       kBeforeEdits. A later workbench compares both with its own current step.
//   (6) revision_ grows with every Commit, every kept feature and every finished run.
//       subject_revision_ grows with every new subject_. face_revision_ is the revision at which
//       face_ was set.
//   (7) A job copies the state and its revision under mutex_ and works without it. It publishes its
//       result under mutex_ only if revision_ is still the same; otherwise it throws Cancelled. No
//       result is therefore mixed from two states.
//   (8) run_stages_ holds intermediate results for one subject and one set of landmarks, models_
//       templates and priors. Both are keyed by paths, so Commit replaces both when a file has
//       changed, and run_stages_ also when subject or landmarks change. coarse_ is keyed by all
//       that its values depend on. All are safe to use without mutex_.
//   (9) Locks are taken in the order starting_, mutex_. The last step of a job needs mutex_, so
//       nobody waits for a job while holding it. job_ is the last member, so that the destructor
//       stops it before anything it uses is destroyed.
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

#include "problems/app/workbench/bench_checks.h"
#include "problems/app/workbench/bench_faces.h"
#include "problems/app/workbench/bench_folder.h"
#include "problems/app/workbench/bench_job.h"
#include "problems/app/workbench/bench_open.h"
#include "problems/app/workbench/bench_subject.h"
#include "problems/app/workbench/bench_volume.h"
#include "problems/experiment/input_contents.h"
#include "problems/face/pull.h"
#include "problems/subject/propose/reference_head.h"

namespace semblance::problems {

struct BenchOptions {
  std::filesystem::path source;  // skull, volume or configuration to begin with; may be empty
  std::filesystem::path folder;  // of the workbench; existing work in it is continued
  std::vector<std::pair<std::string, std::string>> references;  // skull, landmarks: for proposals
  int threads = 1;
};

// The face of a finished run.
struct RunFace {
  HSplineSurface before_edits;
  std::vector<Dowel> dowels;
  std::vector<std::string> notes;
  std::string faults;  // BenchFace::faults
  std::string key;     // hash of the configuration with its files and landmarks, without edits
  std::string rest;    // hash of the edits and texts that run/ was made with
};

// Safe to use from several threads. A method that throws leaves the state unchanged.
class Bench {
 public:
  // Reads the references, then continues the work in the folder or, in an empty folder, begins with
  // the source. Throws IoError, InputError or ConfigError.
  explicit Bench(const BenchOptions& options);
  ~Bench();

  // A consistent copy of all that the page shows.
  struct Snapshot {
    int revision = 0;  // grows with each change, invariant (6)
    int subject_revision = 0;
    BenchHistory history;
    Experiment experiment;
    LandmarkChecks checks;
    std::shared_ptr<const BenchSubject> subject;
    JobStatus job;
    bool has_face = false;    // there is the face of a run
    bool face_fresh = false;  // and it belongs to the present state
    bool run_saved = false;   // and run/ holds it with the present edits
    int face_revision = 0;
    std::vector<BenchVariant> variants = {};  // those with a fresh full face
  };
  Snapshot TakeSnapshot();

  const std::filesystem::path& Folder() const { return folder_.Root(); }

  // Adds a step to the history: the present state changed by `action`. what: description for
  // people. Throws what `action` throws, and ConfigError for a state that `semblance run` would
  // refuse.
  void Apply(const std::string& what, const std::function<BenchState(BenchState)>& action);
  void Undo();
  void Redo();

  // Places a site at the first intersection of the ray with the bone or, without an intersection,
  // at the point of the bone nearest to `near`.
  void PlaceByRay(const std::string& site, const Vec3& origin, const Vec3& direction,
                  const Vec3& near);

  // The dowel of a placed landmark.
  struct DowelDirection {
    Vec3 base = Vec3::Constant(kNaN);       // the point of the bone nearest to the landmark, mm
    Vec3 own = Vec3::Constant(kNaN);        // the bone's direction there, unit
    Vec3 direction = Vec3::Constant(kNaN);  // the given direction, or else the bone's, unit
  };
  // Throws InputError without a skull and for a site that is not placed.
  DowelDirection FindDirection(const std::string& site) const;
  // Turns the dowel of a landmark; none: to the bone's own direction. Throws InputError, as a run
  // would, for a direction that is more than kMaxTurn_deg from that.
  void TurnDowel(const std::string& site, const std::optional<Vec3>& direction);

  // Pulls the full face at its point nearest to `at`. Throws InputError if the face is not fresh.
  void PullAt(const Vec3& at, Pull pull);
  // Brushes the full face at its point nearest to `at`. Throws InputError if the face is not fresh.
  void BrushAt(const Vec3& at, Brush brush);
  // The displacements of the shown vertices for such a pull, as PullMoves returns them.
  std::array<std::vector<Vec3>, 3> PullMovesAt(const Vec3& at, Pull pull) const;

  // Store the detail of a part of the face in features/ under a name, and blend a stored detail
  // into the face. weight: 0 keeps the detail of the run, 1 takes the stored one. Both throw
  // InputError if the face is not fresh.
  void KeepFeature(const std::string& part, const std::string& name);
  void BlendFeature(const std::string& name, double weight);
  std::vector<std::string> PartsOfFace() const;
  std::vector<std::string> KeptFeatures() const;

  // Coarse faces of the present state, of a variant, or with one option changed that is not kept.
  // They throw InputError without a skull.
  BenchFace Coarse(BenchVariant variant = BenchVariant::kAsIs) const;
  BenchFace CoarseWith(const BenchSetting& setting) const;
  // The face of the last run with the present edits. Throws InputError if there is none.
  BenchFace Full() const;
  // The face that a run of the variant made. Throws InputError if there is no fresh one.
  BenchFace FullVariant(BenchVariant variant) const;

  // Sets axes or unit of the subject's files (arguments of ChangeSetting). Landmarks on the bone
  // move with it. Other landmarks stay, because their file may have the right frame already.
  void CorrectFrame(const std::string& path, const std::string& value);

  // Removes bone from the skull, for example a tube or a part of a head holder: the whole piece
  // that is connected with the point of the bone nearest to `near` or, with within_mm, all bone in
  // a ball around that point. The landmarks stay, and the former mesh stays in the folder. Throws
  // InputError without a skull, if the mandible has a file of its own, and if the piece is more
  // than half of the skull.
  void RemoveBone(const Vec3& near, std::optional<double> within_mm);

  // Reads a volume that is not opened yet, for a look at its slices.
  std::shared_ptr<const VolumeReading> ReadUnopened(const std::filesystem::path& path,
                                                    const ReadVolumeOptions& options);
  // The series of a DICOM folder; one for another volume.
  std::vector<VolumeSeries> FindSeries(const std::filesystem::path& path) const;

  // Start background jobs. Each replaces a running job.
  void StartOpening(const OpenRequest& request);
  void StartRun();
  void StartProposal();
  // Makes the full faces of the variants that have no fresh one.
  void StartVariants(const std::vector<BenchVariant>& variants);
  void CancelJob();

 private:
  using Work = std::function<std::string(const RunContext&)>;

  void StartJob(const std::string& name, const std::function<Work()>& prepare);
  void CheckSkull() const;
  void Commit(BenchHistory history, bool by_job = false);
  void NoticeChangedFiles();
  void LoadStoredRun();
  RunFace MakeRun(Experiment experiment, const RunContext& context, int revision);
  std::string VariantsKey() const;
  Experiment MakeVariantExperiment(BenchVariant variant) const;
  void LoadStoredVariants();
  bool HasVariant(BenchVariant variant) const;
  std::optional<BenchFace> FaceAsIs(BenchVariant variant) const;
  void MakeVariant(BenchVariant variant, int revision, const RunContext& context);
  std::string MakeVariants(const std::vector<BenchVariant>& variants, int revision,
                           const RunContext& context);
  std::string Propose(const RunContext& context);
  std::string Open(const OpenRequest& request, const RunContext& context);
  struct CoarseParts {
    std::shared_ptr<const BenchSubject> subject;
    std::string subject_key;
    std::shared_ptr<StageCache> models;
    Experiment experiment;
    BenchState state;
  };
  CoarseParts CopyParts() const;
  BenchFace MakeCoarse(const CoarseParts& parts) const;
  const RunFace& FreshFace() const;
  HSplineSurface Edited(const RunFace& face) const;
  RunContext Context() const;

  std::mutex starting_;       // held while a job is started; taken before mutex_
  mutable std::mutex mutex_;  // guards all members below
  BenchOptions options_;
  std::vector<ReferenceHead> references_;  // constant
  BenchFolder folder_;
  BenchHistory history_;
  Experiment experiment_;
  LandmarkChecks checks_;
  std::shared_ptr<const BenchSubject> subject_;
  std::string subject_key_, subject_options_, present_key_;
  mutable FileHashes hashes_;
  InputHashes contents_;  // of all files that were named so far
  int revision_ = 1, subject_revision_ = 1, face_revision_ = 0;
  std::optional<RunFace> face_;
  VariantFaces variants_;
  std::shared_ptr<StageCache> models_;  // templates and priors
  mutable StageCache coarse_{8};        // coarse faces: the last ones tried, and the six variants
  std::shared_ptr<StageCache> run_stages_;  // of one subject and one set of landmarks
  BenchVolume volume_;                      // has its own lock
  BenchJob job_;                            // last: destroyed and stopped first
};

}  // namespace semblance::problems
