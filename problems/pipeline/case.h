// SPDX-License-Identifier: GPL-3.0-or-later
// A subject made ready for reconstruction: DESIGN's Case{skull, dowels, network, truth?}.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "problems/metrics/face_details.h"
#include "problems/pipeline/experiment.h"
#include "problems/preparation/mirror.h"

namespace semblance {

// What was read or made of a subject, before any choice of depth or network.
struct SubjectData {
  TriMesh skull;                   // mm, outward
  std::vector<BoneOrigin> origin;  // one per triangle of the skull; none: all observed
  std::optional<TriMesh> skin;     // the true skin, in the skull's frame, where it is known
  LandmarkFile landmarks;
  std::vector<std::string> notes;
  std::vector<std::filesystem::path> inputs;  // files that were read
};

struct Case {
  std::string name;
  TriMesh skull;
  std::vector<BoneOrigin> origin;  // one per triangle of the skull; none: all observed
  std::optional<TriMesh> skin;
  std::vector<Dowel> dowels_on_bone;    // with depths
  std::vector<Dowel> open_dowels;       // `depth: auto`: NaN until depth is interpolated
  std::vector<Dowel> expected_on_bone;  // a table's mean depths, where the scheme asks for them
  DowelNetwork network;                 // of those dowels
  std::vector<Dowel> scored_on_bone;    // at all sites, whichever the experiment uses
  DowelNetwork scored_network;          // of those: depths are compared in front of it
  std::map<std::string, Vec3> points;   // all landmarks as given, with depth or without, mm
  ScoreBasis basis;                     // the landmarks as given, for what is scored
  std::vector<std::string> notes;       // what a reader of the result should know, a line each
  std::vector<std::filesystem::path> inputs;  // for the manifest
};

// Whether a subject of files may come without landmarks, which are then none.
enum class Landmarking { kNeeded, kOpen };

// Reads or makes the subject and checks its meshes. Throws InputError, IoError or ConfigError with
// one clear line for what cannot be used.
SubjectData LoadSubject(const Subject& subject, const RunContext& context,
                        Landmarking landmarking = Landmarking::kNeeded);

// Whether skull and landmarks belong together and are a head's (landmark_mistakes.h). Returns what
// may be meant so, a line each; throws InputError, a line for each mistake.
std::vector<std::string> CheckSubject(const SubjectData& subject, const PlaceOptions& options);

// Throws InputError where the experiment names no network; `config` is the file that should.
void CheckNetworkNamed(const Experiment& experiment, const std::filesystem::path& config = {});

// Places the dowels on the bone and gives them their depths and network. Throws as LoadSubject and
// CheckSubject.
Case MakeCase(const SubjectData& subject, const Experiment& experiment);
// The same where the query of the subject's skull is at hand.
Case MakeCase(const SubjectData& subject, const Experiment& experiment, const MeshQuery& skull);

// Whether what `rules` and `sites` say of the face can hold for this subject. Throws InputError, a
// line each, for a point of a rule that is off the bone or on the other side, and for the (u,v) of
// a landmark where the way to the face does not look at it.
void CheckFaceOptions(const Experiment& experiment, const Case& subject);

// Of the subject's skin, which must be there.
ScoredSkin FindScoredSkin(const Case& subject, const FaceRegionOptions& options);
ScoredSkin FindScoredSkin(const Case& subject, const OuterSkin& felt,
                          const FaceRegionOptions& options);

}  // namespace semblance
