// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/landmark_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "problems/command_line/exit_code.h"
#include "problems/command_line/progress.h"
#include "problems/config/terminal_text.h"
#include "problems/landmark_files/read_landmarks.h"
#include "problems/landmark_files/site_page.h"
#include "problems/landmark_files/site_picture.h"
#include "problems/output/given_files.h"
#include "problems/program/work_options.h"
#include "problems/propose/propose_landmarks.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// What the user typed.
struct LandmarkArguments {
  std::string in, out;
  std::vector<std::string> tables;
  ReadLandmarksOptions reading;
  bool force = false;
};

void TellEach(const std::vector<std::string>& lines, const char* what) {
  for (const std::string& line : lines) {
    fmt::print(stderr, "{}", ForTerminal(fmt::format("{}: {}\n", what, line)));
  }
}

int Convert(const LandmarkArguments& a) {
  RefuseToReplace(a.out, std::array<fs::path, 1>{a.in});
  RefuseExisting(a.out, a.force);
  const LandmarkReading reading = ReadLandmarks(a.in, a.reading);
  const std::string bytes = EncodeLandmarks(reading.file, a.out);
  TellEach(reading.notes, "note");
  TellEach(LostIn(reading.file, a.out), "not kept in this kind of file");
  WriteFileAtomically(a.out, bytes);
  fmt::print("{}: {} landmarks, mm, LPS\n", a.out, reading.file.landmarks.size());
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
  fs::create_directories(a.out);
  WriteFileAtomically(page, SitePage(tables, picture.filename().string()));
  WriteFileAtomically(picture, SitePictureSvg(/*threads=*/1));
  fmt::print("{}\n", page.string());
  return kDone;
}

void DeclarePage(CLI::App& page, CommandLine& line) {
  LandmarkArguments& a = *Bind(page, line, &Page);
  page.add_option("TABLES", a.tables, "tissue tables to say which sites they have")->required();
  page.add_option("--out", a.out, "folder for sites.md and sites.svg")->required();
  page.add_flag("--force", a.force, "replace them where they are");
}

void DeclareConvert(CLI::App& convert, CommandLine& line) {
  LandmarkArguments& a = *Bind(convert, line, &Convert);
  convert.add_option("IN", a.in, ".yaml, .mrk.json, .fcsv, .pp, .csv, .txt or .asc")->required();
  convert.add_option("OUT", a.out, "file of one of these kinds")->required();
  AddChoice(convert, "--axes",
            "LPS or RAS: of a file that does not say (.pp, .csv, .txt, .asc) [LPS]",
            a.reading.axes);
  convert.add_flag("--leave-out-unknown", a.reading.leave_out_unknown,
                   "leave out points whose name is not a site, and say which");
  convert.add_flag("--force", a.force, "replace a file of the same name");
}

// What the user typed.
struct ProposeArguments {
  std::string skull, out, compare;
  std::vector<std::pair<std::string, std::string>> references;  // skull, landmarks
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool force = false, quiet = false;
  std::stop_token stop;
};

// Without a reference two made-up heads stand in.
std::vector<ReferenceHead> ReferencesOf(const ProposeArguments& a) {
  std::vector<ReferenceHead> heads;
  for (const auto& [skull, landmarks] : a.references) {
    heads.push_back(ReadReference(skull, landmarks, a.threads));
  }
  if (heads.empty()) {
    heads.push_back(PhantomReference(1));
    heads.push_back(PhantomReference(2));
    fmt::print(stderr,
               "note: without --reference made-up heads stand in, which have no orbits, arches or "
               "teeth; a marked skull as --reference is much better\n");
  }
  return heads;
}

void TellDifferences(const ProposeArguments& a, const LandmarkFile& file) {
  fmt::print("{}", FormatComparison(CompareProposal(InLpsMm(file), ReadLandmarks(a.compare).file)));
}

void WriteProposal(const ProposeArguments& a, const std::string& out, const LandmarkFile& file) {
  const std::string bytes = EncodeLandmarks(file, out);
  TellEach(LostIn(file, out), "not kept in this kind of file");
  if (const fs::path folder = fs::path(out).parent_path(); !folder.empty()) {
    fs::create_directories(folder);
  }
  RefuseExisting(out, a.force);
  WriteFileAtomically(out, bytes);
  fmt::print(
      "{}: {} sites proposed, {} absent, mm, {}. Look at each on the skull and correct it; then "
      "set `proposed: false`\n",
      out, file.landmarks.size(), file.absent.size(), AxesIn(file, out));
}

std::vector<fs::path> GivenTo(const ProposeArguments& a) {
  std::vector<fs::path> given = {a.skull, a.compare};
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
    RefuseToReplace(out, GivenTo(a));
    RefuseExisting(out, a.force);
  }
  RunContext context{.on_event = {}, .stop_token = a.stop, .threads = a.threads};
  if (!a.quiet) {
    context.on_event = ProgressPrinter(stderr);
  }
  const Proposal proposal = ProposeLandmarks(ReadMesh(a.skull), a.skull, ReferencesOf(a), context);
  TellEach(proposal.notes, "note");
  const LandmarkFile file = ProposalFile(proposal, fs::path(a.skull).stem().string());
  if (!a.compare.empty()) {
    TellDifferences(a, file);
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
  propose.add_option("--reference", a.references,
                     "SKULL LANDMARKS: a skull whose landmarks are known, mm; may be repeated: the "
                     "median counts [two made-up heads]");
  propose.add_option("--out", a.out, "file for the proposal [out/SKULL_proposed.yaml]");
  propose.add_option("--compare", a.compare,
                     "landmarks placed by hand: tells how far each site is off; without --out no "
                     "file is written then");
  propose.add_flag("--force", a.force, "replace a file of the same name");
  propose.add_option("--threads", a.threads, "threads to use; the result does not depend on it")
      ->check(CLI::Range(1, 1024));
  propose.add_flag("--quiet", a.quiet, "no progress");
}

constexpr std::array kLandmarkCommands = {
    ProgramCommand{"convert", "read landmarks of one program, write them for another",
                   &DeclareConvert},
    ProgramCommand{"page", "a page with each of the sites: names, place, tables, picture",
                   &DeclarePage},
    ProgramCommand{"propose", "propose the landmarks of a skull, as a file to correct",
                   &DeclarePropose},
};

void DeclareLandmarks(CLI::App& landmarks, CommandLine& line) {
  landmarks.require_subcommand(1);
  Declare(kLandmarkCommands, landmarks, line);
}

}  // namespace

std::span<const ProgramCommand> LandmarkCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"landmarks", "landmarks on a skull, from and for other programs",
                     &DeclareLandmarks},
  };
  return kCommands;
}

}  // namespace semblance
