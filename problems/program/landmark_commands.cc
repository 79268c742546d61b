// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/landmark_commands.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "problems/landmark_files/read_landmarks.h"
#include "problems/landmark_files/site_page.h"
#include "problems/program/exit_code.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

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

void Tell(const std::vector<std::string>& lines, const char* what) {
  for (const std::string& line : lines) {
    fmt::print(stderr, "{}: {}\n", what, line);
  }
}

int Convert(const LandmarkArguments& a) {
  if (!a.force && fs::exists(a.out)) {
    throw IoError(
        fmt::format("{}: it exists; name another file, or add --force to replace it", a.out));
  }
  const LandmarkReading reading = ReadLandmarks(a.in, a.reading);
  const std::string bytes = EncodeLandmarks(reading.file, a.out);
  Tell(reading.notes, "note");
  Tell(LostIn(reading.file, a.out), "not kept in this kind of file");
  WriteFileAtomically(a.out, bytes);
  fmt::print("{}: {} landmarks, mm, LPS\n", a.out, reading.file.landmarks.size());
  return kDone;
}

int Page(const LandmarkArguments& a) {
  std::vector<TissueTable> tables;
  for (const std::string& table : a.tables) {
    tables.push_back(ReadTissueTable(table));
  }
  const fs::path page = fs::path(a.out) / "sites.md", picture = fs::path(a.out) / "sites.png";
  if (!a.force && (fs::exists(page) || fs::exists(picture))) {
    throw IoError(
        fmt::format("{}: sites.md or sites.png exists; add --force to replace it", a.out));
  }
  fs::create_directories(a.out);
  WriteFileAtomically(page, SitePage(tables, picture.filename().string()));
  WriteFileAtomically(picture, EncodePng(SitePicture(/*threads=*/1)));
  fmt::print("{}\n", page.string());
  return kDone;
}

void DeclarePage(CLI::App& page, CommandLine& line) {
  LandmarkArguments& a = *Bind(page, line, &Page);
  page.add_option("TABLES", a.tables, "tissue tables to say which sites they have")->required();
  page.add_option("--out", a.out, "folder for sites.md and sites.png")->required();
  page.add_flag("--force", a.force, "replace them where they are");
}

void DeclareConvert(CLI::App& convert, CommandLine& line) {
  LandmarkArguments& a = *Bind(convert, line, &Convert);
  convert.add_option("IN", a.in, ".yaml, .mrk.json, .fcsv, .pp, .csv, .txt or .asc")->required();
  convert.add_option("OUT", a.out, "file of one of these kinds")->required();
  const std::map<std::string, Axes> words = {{"LPS", Axes::kLps}, {"RAS", Axes::kRas}};
  convert
      .add_option("--axes", a.reading.axes,
                  "LPS or RAS: of a file that does not say (.pp, .csv, .txt, .asc) [LPS]")
      ->transform(CLI::CheckedTransformer(words));
  convert.add_flag("--leave-out-unknown", a.reading.leave_out_unknown,
                   "leave out points whose name is no site, and say which");
  convert.add_flag("--force", a.force, "replace a file of the same name");
}

constexpr std::array kLandmarkCommands = {
    ProgramCommand{"convert", "read landmarks of one program, write them for another",
                   &DeclareConvert},
    ProgramCommand{"page", "a page with each of the sites: names, place, tables, picture",
                   &DeclarePage},
};

void DeclareLandmarks(CLI::App& landmarks, CommandLine& line) {
  landmarks.require_subcommand(1);
  Declare(kLandmarkCommands, landmarks, line);
}

constexpr std::array kCommands = {
    ProgramCommand{"landmarks", "landmarks on a skull, from and for other programs",
                   &DeclareLandmarks},
};

}  // namespace

std::span<const ProgramCommand> LandmarkCommands() { return kCommands; }

}  // namespace semblance
