// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/invesalius.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <map>

#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::WordsOf;

std::string Plist(const std::string& dtype, const std::string& shape) {
  return fmt::format(
      "<?xml version=\"1.0\"?><plist version=\"1.0\"><dict>"
      "<key>matrix</key><dict><key>dtype</key><string>{}</string>"
      "<key>filename</key><string>matrix.dat</string><key>shape</key><array>{}</array></dict>"
      "<key>orientation</key><integer>1</integer>"
      "<key>spacing</key><array><real>0.5</real><real>0.75</real><real>2</real></array>"
      "</dict></plist>",
      dtype, shape);
}

constexpr const char* kShape =
    "<integer>4</integer><integer>3</integer><integer>2</integer>";  // slices, rows, columns

std::string Values() {
  std::string bytes;
  for (std::int16_t n = 0; n < 24; ++n) {
    bytes.append(reinterpret_cast<const char*>(&n), sizeof n);
  }
  return bytes;
}

void WriteTar(const std::filesystem::path& path, const std::map<std::string, std::string>& files) {
  archive* a = archive_write_new();
  archive_write_add_filter_gzip(a);
  archive_write_set_format_pax_restricted(a);
  ASSERT_EQ(archive_write_open_filename(a, path.c_str()), ARCHIVE_OK);
  for (const auto& [name, bytes] : files) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, ("tmp/" + name).c_str());
    archive_entry_set_size(entry, static_cast<la_int64_t>(bytes.size()));
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_write_header(a, entry);
    archive_write_data(a, bytes.data(), bytes.size());
    archive_entry_free(entry);
  }
  archive_write_free(a);
}

TEST(Invesalius, RowsOfAProjectAreReadFromFrontToBack) {
  const ScratchFolder folder;
  WriteTar(folder / "x.inv3", {{"main.plist", Plist("int16", kShape)}, {"matrix.dat", Values()}});
  const CtVolume volume = ReadInvesalius(folder / "x.inv3");
  EXPECT_EQ(volume.columns, 2);
  EXPECT_EQ(volume.rows, 3);
  EXPECT_EQ(volume.slices, 4);
  EXPECT_EQ(volume.spacing_mm, Vec3(0.5, 0.75, 2));
  EXPECT_EQ(volume.values[volume.Index(1, 0, 3)], 23);   // the file's last row is the front
  EXPECT_EQ(volume.World(1, 0, 3), Vec3(0.5, -1.5, 6));  // LPS
  EXPECT_EQ(volume.World(1, 2, 3), Vec3(0.5, 0, 6));
}

TEST(Invesalius, EachFaultIsNamed) {
  const ScratchFolder folder;
  const auto words = [&](const std::map<std::string, std::string>& files) {
    WriteTar(folder / "x.inv3", files);
    return WordsOf<Error>([&] { ReadInvesalius(folder / "x.inv3"); });
  };
  const std::string plist = Plist("int16", kShape);
  EXPECT_THAT(WordsOf<IoError>([&] { ReadInvesalius(folder / "none.inv3"); }),
              HasSubstr("none.inv3: no such file"));
  EXPECT_THAT(words({{"matrix.dat", Values()}}), HasSubstr("no entry 'main.plist'"));
  EXPECT_THAT(words({{"main.plist", plist}}), HasSubstr("no entry 'matrix.dat'"));
  EXPECT_THAT(words({{"main.plist", plist}, {"matrix.dat", Values().substr(2)}}),
              AllOf(HasSubstr("46 bytes"), HasSubstr("need 48")));
  EXPECT_THAT(words({{"main.plist", plist}, {"matrix.dat", Values() + Values()}}),
              HasSubstr("more than 48 bytes"));
  EXPECT_THAT(words({{"main.plist", plist + std::string(2'000'000, ' ')}}),
              HasSubstr("main.plist is larger than"));
  const std::string longest_side = "<integer>4096</integer>";
  EXPECT_THAT(words({{"main.plist", Plist("int16", longest_side + longest_side + longest_side)},
                     {"matrix.dat", Values()}}),
              HasSubstr("at most 8 GB are read"));
  const std::string large = "<integer>500</integer>";
  EXPECT_THAT(
      words({{"main.plist", Plist("int16", large + large + large)}, {"matrix.dat", Values()}}),
      HasSubstr("cannot hold 500 x 500 x 500 voxels"));
  EXPECT_THAT(words({{"main.plist", Plist("uint8", kShape)}, {"matrix.dat", Values()}}),
              HasSubstr("only int16 is read"));
  EXPECT_THAT(words({{"main.plist", Plist("int16", "<integer>4</integer>")}}),
              HasSubstr("'shape' has 1 numbers"));
  EXPECT_THAT(words({{"main.plist", "<plist"}}), HasSubstr("not a property list"));
  std::ofstream(folder / "y.inv3") << "not an archive";
  EXPECT_THAT(WordsOf<IoError>([&] { ReadInvesalius(folder / "y.inv3"); }),
              HasSubstr("not an InVesalius project"));
}

}  // namespace
}  // namespace semblance::problems
