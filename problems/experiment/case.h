// SPDX-License-Identifier: GPL-3.0-or-later
// A subject that is ready for reconstruction: skull, dowels, network and, if known, the true skin.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "problems/experiment/experiment.h"
#include "problems/experiment/metrics/face_details.h"
#include "problems/io/volumes/grey_slice.h"
#include "problems/subject/mirror.h"

namespace semblance::problems {

// A subject as it was read or made, before any choice of depth or network.
struct SubjectData {
  TriMesh skull;                   // mm, outward
  std::vector<BoneOrigin> origin;  // one per triangle of the skull; empty: all observed
  std::optional<TriMesh> skin;     // the true skin, in the skull's frame, if known
  LandmarkFile landmarks;
  std::vector<std::string> notes;
  std::vector<std::filesystem::path> inputs;  // files that were read
  double voxel_mm = kNaN;  // of a CT: the largest distance of neighbouring voxels, as imported
  std::vector<GreySlice> slices = {};  // of a CT, in HeadPlanes (head_planes.h)
};

struct Case {
  std::string name;
  TriMesh skull;
  std::vector<BoneOrigin> origin;  // one per triangle of the skull; empty: all observed
  std::optional<TriMesh> skin;
  std::vector<Dowel> dowels_on_bone;    // with depths
  std::vector<Dowel> open_dowels;       // `depth: auto`: NaN until depth is interpolated
  std::vector<Dowel> expected_on_bone;  // a table's mean depths, if the scheme needs them
  DowelNetwork network;                 // of dowels_on_bone
  std::vector<Dowel> scored_on_bone;    // at all sites, whatever sites the experiment uses
  DowelNetwork scored_network;          // of scored_on_bone; depths are compared in front of it
  std::map<std::string, double> turns_deg = {};  // of dowels with a given direction (TurnsOfDowels)
  std::map<std::string, Vec3> points;         // all landmarks as given, with or without depth, mm
  ScoreBasis basis;                           // the landmarks as given; they decide what is scored
  std::vector<BoundEffect> bounds;            // one per entry of tissue.bounds
  std::vector<GreySlice> slices = {};         // of a CT, in HeadPlanes (head_planes.h)
  std::vector<std::string> notes;             // for readers of the result, one line each
  std::vector<std::filesystem::path> inputs;  // for the manifest
};

// kOpen: a subject may come without a file of landmarks, and then has none.
enum class Landmarking { kNeeded, kOpen };

// Reads one mesh of a subject and turns it to mm and LPS: from `subject.axes` if it is set,
// otherwise from the axes that the file states (mesh_io.h), with a note if they are RAS. Throws as
// ReadMeshFile, and InputError if the two axes contradict each other.
TriMesh ReadSubjectMesh(const FileSubject& subject, const std::filesystem::path& path,
                        std::vector<std::string>& notes);

// Reads or makes the subject and checks its meshes. Throws InputError, IoError or ConfigError with
// one clear line for what cannot be used.
SubjectData LoadSubject(const Subject& subject, const RunContext& context,
                        Landmarking landmarking = Landmarking::kNeeded);

// Checks that skull, landmarks and skin belong together and are those of a head
// (landmark_mistakes.h, input_mistakes.h).
// Returns notes on what may be intended, one line each. Throws InputError with one line per
// mistake.
std::vector<std::string> CheckSubject(const SubjectData& subject, const PlaceOptions& options);

// Throws InputError if the experiment names no network. config: the file that should name it.
void CheckNetworkNamed(const Experiment& experiment, const std::filesystem::path& config = {});

// Places the dowels on the bone and gives them their depths and network. Throws as LoadSubject and
// CheckSubject do; throws Cancelled.
Case MakeCase(const SubjectData& subject, const Experiment& experiment, const RunContext& context);
// The same with a given query of the subject's skull.
Case MakeCase(const SubjectData& subject, const Experiment& experiment, const MeshQuery& skull,
              const RunContext& context);

// Checks `rules` and `sites` against the subject. Throws InputError, one line each, for a rule's
// point that lies off the bone or on the other side, and for the (u,v) of a landmark that the way
// to the face does not use.
void CheckFaceOptions(const Experiment& experiment, const Case& subject);

// The scored part of the subject's skin, which must exist. outer: FindOuterSkin of that skin.
ScoredSkin FindScoredSkin(const Case& subject, const FaceRegionOptions& options);
ScoredSkin FindScoredSkin(const Case& subject, const OuterSkin& outer,
                          const FaceRegionOptions& options);

}  // namespace semblance::problems
