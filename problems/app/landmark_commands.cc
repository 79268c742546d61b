// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/progress.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/io/given_files.h"
#include "problems/report/pictures/site_picture.h"
#include "problems/report/site_page.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/propose/propose_landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/join_copies.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The arguments of `landmarks convert` and `landmarks page`.
struct LandmarkArguments {
  std::string in, out;
  std::vector<std::string> tables;
  ReadLandmarksOptions reading;
  bool force = false;
};

void PrintEach(const std::vector<std::string>& lines, const char* what) {
  for (const std::string& line : lines) {
    Tell(stderr, "{}: {}\n", what, line);
  }
}

int Convert(const LandmarkArguments& a) {
  RefuseToReplace(a.out, std::array<fs::path, 1>{a.in});
  RefuseExisting(a.out, a.force);
  const LandmarkReading reading = ReadLandmarks(a.in, a.reading);
  const std::string bytes = EncodeLandmarks(reading.file, a.out);
  PrintEach(reading.notes, "note");
  PrintEach(LostContents(reading.file, a.out), "not kept in this kind of file");
  WriteFileAtomically(a.out, bytes);
  Tell("{}: {} landmarks, mm, LPS\n", a.out, reading.file.landmarks.size());
  return kDone;
}

int Page(const LandmarkArguments& a) {
  std::vector<TissueTable> tables;
  for (const std::string& table : a.tables) {
    tables.push_back(ReadTissueTable(table));
  }
  const fs::path page = fs::path(a.out) / "sites.md", picture = fs::path(a.out) / "sites.svg";
  if (!a.force && (fs::exists(page) || fs::exists(picture))) {
    throw IoError(
        fmt::format("{}: sites.md or sites.svg exists; add --force to replace it", a.out));
  }
  const std::array<FileBytes, 2> files = {
      FileBytes{page, SitePage(tables, picture.filename().string())},
      FileBytes{picture, SitePictureSvg(/*threads=*/1)}};
  NewFolders made(a.out);
  WriteFilesTogether(files);
  made.Keep();
  Tell("{}\n", page.string());
  return kDone;
}

void DeclarePage(CLI::App& page, CommandLine& line) {
  LandmarkArguments& a = *Bind(page, line, &Page);
  page.add_option("TABLES", a.tables, "tissue tables whose sites the page marks")->required();
  page.add_option("--out", a.out, "folder for sites.md and sites.svg")->required();
  page.add_flag("--force", a.force, "replace existing files");
}

void DeclareConvert(CLI::App& convert, CommandLine& line) {
  LandmarkArguments& a = *Bind(convert, line, &Convert);
  convert.add_option("IN", a.in, ".yaml, .mrk.json, .fcsv, .pp, .csv, .txt or .asc")->required();
  convert.add_option("OUT", a.out, "file of one of these kinds")->required();
  AddChoice(convert, "--axes",
            "LPS or RAS: axes of a file that does not state them (.pp, .csv, .txt, .asc) [LPS]",
            a.reading.axes);
  convert.add_flag("--leave-out-unknown", a.reading.leave_out_unknown,
                   "leave out points whose name is not a site, and list them");
  convert.add_flag("--force", a.force, "replace a file of the same name");
}

// The arguments of `landmarks propose`.
struct ProposeArguments {
  std::string skull, landmarks, out, compare;
  std::vector<std::pair<std::string, std::string>> references;  // skull, landmarks
  int threads = DefaultThreads();
  bool force = false, quiet = false, upright = false;
  std::stop_token stop;
};

std::vector<ReferenceHead> ReadReferences(const ProposeArguments& a) {
  std::vector<ReferenceHead> heads;
  for (const auto& [skull, landmarks] : a.references) {
    heads.push_back(ReadReference(skull, landmarks, a.threads));
  }
  return heads;
}

Proposal MakeProposal(const ProposeArguments& a, const TriMesh& skull, const LandmarkFile& known,
                      const RunContext& context) {
  std::vector<SitePoint> points = known.Points();
  std::erase_if(points, [](const SitePoint& p) { return !IsStandardSite(p.site); });
  const SkullLies lies = a.upright ? SkullLies::kUpright : SkullLies::kAnyhow;
  return a.references.empty()
             ? ProposeLandmarks(skull, a.skull, ReadMeanSkull(), context, points, lies)
             : ProposeLandmarks(skull, a.skull, ReadReferences(a), context, points, lies);
}

// The given landmarks first, as they are, then the proposed ones. A file that holds both is marked
// as proposed; doubt_mm shows which ones are.
LandmarkFile WithKnown(LandmarkFile known, const Proposal& proposal, const std::string& subject) {
  LandmarkFile file = ProposalFile(proposal, subject);
  for (Landmark& landmark : known.landmarks) {
    if (file.axes == "RAS") {
      landmark.MoveTo(ToLps(landmark.Position(), Axes::kRas));
    }
  }
  std::erase_if(file.absent,
                [&](const AbsentLandmark& a) { return known.Find(a.site) != nullptr; });
  file.landmarks.insert(file.landmarks.begin(), known.landmarks.begin(), known.landmarks.end());
  return file;
}

// Keeps the least doubtful of several proposed landmarks at one point and lists the
// others as absent, because a run refuses two sites at one point. Points of a person stay.
LandmarkFile WithoutSamePoints(LandmarkFile file) {
  std::vector<Landmark> by_doubt = file.landmarks, kept;
  const auto doubt_mm = [](const Landmark& l) { return l.doubt_mm.value_or(0); };
  std::ranges::stable_sort(by_doubt, {}, doubt_mm);
  Box3 extent;
  for (const Landmark& landmark : file.landmarks) {
    extent.extend(landmark.Position());
  }
  const double same_mm = SamePoint_mm(extent);
  for (const Landmark& landmark : by_doubt) {
    const auto surer = std::ranges::find_if(kept, [&](const Landmark& other) {
      return (other.Position() - landmark.Position()).norm() <= same_mm;
    });
    if (surer == kept.end() || !landmark.doubt_mm) {
      kept.push_back(landmark);
      continue;
    }
    file.absent.push_back(
        {landmark.site, fmt::format("proposed at the point of {}; a person has to "
                                    "place it",
                                    surer->site)});
    std::erase_if(file.landmarks, [&](const Landmark& l) { return l.site == landmark.site; });
  }
  return file;
}

void PrintDifferences(const ProposeArguments& a, const LandmarkFile& file) {
  Tell("{}", FormatComparison(CompareProposal(InLpsMm(file), ReadLandmarks(a.compare).file)));
}

void WriteProposal(const ProposeArguments& a, const std::string& out, const LandmarkFile& file) {
  const std::string bytes = EncodeLandmarks(file, out);
  PrintEach(LostContents(file, out), "not kept in this kind of file");
  RefuseExisting(out, a.force);  // it may have appeared during the work
  NewFolders made(fs::absolute(out).parent_path());
  WriteFileAtomically(out, bytes);
  made.Keep();
  Tell(
      "{}: {} sites proposed, {} absent, mm, {}. Check each on the skull and correct it; then "
      "set `proposed: false`\n",
      out, file.landmarks.size(), file.absent.size(), WrittenAxes(file, out));
}

std::vector<fs::path> InputsOfProposal(const ProposeArguments& a) {
  std::vector<fs::path> given = {a.skull, a.landmarks, a.compare};
  for (const auto& [skull, landmarks] : a.references) {
    given.insert(given.end(), {skull, landmarks});
  }
  return given;
}

int Propose(const ProposeArguments& a) {
  const std::string out =
      a.out.empty() ? fmt::format("out/{}_proposed.yaml", fs::path(a.skull).stem().string())
                    : a.out;
  const bool writes = a.compare.empty() || !a.out.empty();
  if (writes) {
    RefuseToReplace(out, InputsOfProposal(a));
    RefuseExisting(out, a.force);
  }
  RunContext context{.on_event = {}, .stop_token = a.stop, .threads = a.threads};
  if (!a.quiet) {
    context.on_event = ProgressPrinter(stderr);
  }
  std::vector<std::string> notes;
  TriMesh skull = ReadMeshInLps(a.skull, notes);
  std::ranges::move(JoinCopies(skull, a.skull), std::back_inserter(notes));
  const LandmarkFile known = a.landmarks.empty() ? LandmarkFile() : ReadLandmarks(a.landmarks).file;
  const Proposal proposal = MakeProposal(a, skull, known, context);
  PrintEach(notes, "note");
  PrintEach(proposal.notes, "note");
  const LandmarkFile file =
      WithoutSamePoints(WithKnown(known, proposal, fs::path(a.skull).stem().string()));
  if (!a.compare.empty()) {
    PrintDifferences(a, file);
  }
  if (writes) {
    WriteProposal(a, out, file);
  }
  return kDone;
}

void DeclarePropose(CLI::App& propose, CommandLine& line) {
  ProposeArguments& a = *Bind(propose, line, &Propose);
  a.stop = line.stop;
  propose.add_option("SKULL", a.skull, "skull (.ply .obj .stl .off), mm, in any pose")->required();
  propose.add_option(
      "--reference", a.references,
      "SKULL LANDMARKS: a skull with known landmarks, mm; may be repeated, and the median "
      "is used [the mean skull of 54 heads]");
  propose.add_option("--landmarks", a.landmarks,
                     "points of this skull that a person has placed; they stay, and the others are "
                     "proposed from them. Three that are apart (n, zy_l, zy_r) replace the search "
                     "for the pose");
  propose.add_flag("--upright", a.upright,
                   "the skull is from a scan that stated its axes: only upright poses are tried, "
                   "which finds the pose of coarse and cut skulls");
  propose.add_option("--out", a.out, "file for the proposal [out/SKULL_proposed.yaml]");
  propose.add_option(
      "--compare", a.compare,
      "landmarks placed by hand: prints the error of each site; writes no file unless "
      "--out is given");
  propose.add_flag("--force", a.force, "replace a file of the same name");
  AddThreads(propose, a.threads);
  propose.add_flag("--quiet", a.quiet, "no progress");
}

constexpr std::array kLandmarkCommands = {
    ProgramCommand{"convert", "convert landmarks from one program to another", &DeclareConvert},
    ProgramCommand{"page", "write a page of all sites: names, definition, tables, picture",
                   &DeclarePage},
    ProgramCommand{"propose", "propose the landmarks of a skull in a file to correct",
                   &DeclarePropose},
};

void DeclareLandmarks(CLI::App& landmarks, CommandLine& line) {
  landmarks.require_subcommand(1);
  Declare(kLandmarkCommands, landmarks, line);
}

}  // namespace

std::span<const ProgramCommand> LandmarkCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"landmarks", "convert, propose and document landmarks on a skull",
                     &DeclareLandmarks},
  };
  return kCommands;
}

}  // namespace semblance::problems
