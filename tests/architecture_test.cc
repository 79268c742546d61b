// SPDX-License-Identifier: GPL-3.0-or-later
// The floors and rooms of the design, enforced from the include lines: problems on top of interp
// and fitting, both on top of surfaces; the rooms of a floor in layers without a circle; each
// third-party library only where it is allowed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::map<std::string, std::set<std::string>> kFloorsBelow = {
    {"surfaces", {"surfaces"}},
    {"interp", {"interp", "surfaces"}},
    {"fitting", {"fitting", "surfaces"}},
    {"problems", {"problems", "interp", "fitting", "surfaces"}},
};

// The hall: the files that lie flat in a floor, which are its front door.
constexpr char kHall[] = "";

using Layers = std::vector<std::set<std::string>>;

// The rooms of each floor, lower layers first. A file includes files of its own room and of lower
// layers. docs/architecture.md draws the same order.
const std::map<std::string, Layers> kRooms = {
    {"surfaces",
     {{"base"},
      {"hspline", "mesh"},
      {"decimate", "emitters", "hspline_query", "marching", "mesh_files"},
      {"hspline_files", "implicit"},
      {kHall}}},
    {"interp",
     {{"dowels"}, {"on_surface"}, {"kriging"}, {"schemes"}, {"stacking"}, {kHall}, {"evaluation"}}},
    {"fitting",
     {{"closed_mesh", "folds", "least_squares", "problem", "triangulation"},
      {"parameters", "shape_model", "space"},
      {"terms"},
      {"nested", "solve"},
      {"relaxation", "uncertainty"},
      {"plan"},
      {kHall}}},
    {"problems",
     {{"config", "output", "thinning", "volumes"},
      {"ct", "edits", "page", "pictures", "search", "subject", "view"},
      {"conditional", "landmark_files", "phantom", "preparation"},
      {"face_template"},
      {"bust", "metrics", "prior"},
      {"pipeline", "plots", "propose"},
      {"inputs"},
      {kHall},
      {"report"},
      {"command_line", "exports", "points", "population", "study", "workbench"},
      {"compare", "serving", "study_report"},
      {"program", "python"}}},
};

// The front doors, by stem. Nothing else lies flat in a floor but its CMakeLists.txt.
const std::set<std::string> kFrontDoors = {"surfaces/implicit_face", "interp/interpolate_depth",
                                           "fitting/fit", "problems/run"};

// A room is neither a cupboard nor a warehouse.
constexpr int kFewestFiles = 4, kMostFiles = 30;

// Where a library may be included: a regular expression over the path of the including file.
const std::map<std::string, std::string> kLibraryPlaces = {
    {"ceres/", R"(fitting/(\w+/)?\w+(\.cc|_cost\.h)|interp/kriging/bounded_minimum\.cc)"},
    {"yaml-cpp/", R"(problems/config/config\.cc)"},
    {"CGAL/", R"(\w+/(\w+/)?\w+\.cc)"},
    {"OpenMesh/", R"(surfaces/mesh_files/mesh_io\.cc)"},
    {"itk", R"(problems/volumes/itk_files\.cc)"},
    {"gdcm", R"(problems/volumes/itk_files\.cc)"},
    {"httplib", R"(problems/serving/http_server\.cc)"},
    {"pybind11", R"(problems/python/\w+\.(h|cc))"},
};

std::string FloorOf(const std::string& path) { return path.substr(0, path.find('/')); }

// The folder below the floor, or kHall.
std::string RoomOf(const std::string& path) {
  const std::size_t first = path.find('/'), second = path.find('/', first + 1);
  return second == std::string::npos ? kHall : path.substr(first + 1, second - first - 1);
}

std::string StemOf(const std::string& path) { return path.substr(0, path.rfind('.')); }

std::string RoomName(const std::string& floor, const std::string& room) {
  return room == kHall ? "the front door of " + floor : floor + "/" + room;
}

// The layer of a room in its floor; -1 if the floor has no such room.
int LayerOf(const std::string& floor, const std::string& room) {
  const Layers& layers = kRooms.at(floor);
  for (std::size_t k = 0; k < layers.size(); ++k) {
    if (layers[k].contains(room)) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

// Of two files of one floor.
std::vector<std::string> CheckRooms(const std::string& file, const std::string& included) {
  const std::string floor = FloorOf(file), from = RoomOf(file), to = RoomOf(included);
  if (from == to || LayerOf(floor, to) < LayerOf(floor, from)) {
    return {};
  }
  return {fmt::format("{} includes {}: {} stands no higher than {}, so it may not know it", file,
                      included, RoomName(floor, from), RoomName(floor, to))};
}

std::vector<std::string> CheckInclude(const std::string& file, const std::string& included) {
  std::vector<std::string> faults;
  const auto below = kFloorsBelow.find(FloorOf(file));
  const std::string target = FloorOf(included);
  if (below != kFloorsBelow.end() && target == "tests") {
    faults.push_back(
        fmt::format("{} includes {}: the project never includes its tests", file, included));
  }
  if (below != kFloorsBelow.end() && kFloorsBelow.contains(target) &&
      !below->second.contains(target)) {
    faults.push_back(
        fmt::format("{} includes {}: {} may not know {}", file, included, FloorOf(file), target));
  }
  if (kRooms.contains(target) && FloorOf(file) == target) {
    for (std::string& fault : CheckRooms(file, included)) {
      faults.push_back(std::move(fault));
    }
  }
  for (const auto& [library, places] : kLibraryPlaces) {
    if (below != kFloorsBelow.end() && included.starts_with(library) &&
        !std::regex_match(file, std::regex(places))) {
      faults.push_back(fmt::format("{} includes {}: allowed only in {}", file, included, places));
    }
  }
  return faults;
}

// text: the whole source of `file`, a path relative to the top level.
std::vector<std::string> CheckSource(const std::string& file, const std::string& text) {
  static const std::regex kInclude(R"re(^[ \t]*#[ \t]*include[ \t]*[<"]([^>"]+)[>"])re",
                                   std::regex::multiline);
  std::vector<std::string> faults;
  for (std::sregex_iterator it(text.begin(), text.end(), kInclude), end; it != end; ++it) {
    for (std::string& fault : CheckInclude(file, (*it)[1])) {
      faults.push_back(std::move(fault));
    }
  }
  if (!text.starts_with("// SPDX-License-Identifier: GPL-3.0-or-later\n")) {
    faults.push_back(fmt::format("{}: the first line must be the SPDX licence line", file));
  }
  return faults;
}

std::string ReadText(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<fs::path> Sources() {
  std::vector<fs::path> sources;
  for (const char* folder : {"surfaces", "interp", "fitting", "problems", "tests"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(SEMBLANCE_SOURCE_DIR) / folder)) {
      if (entry.path().extension() == ".h" || entry.path().extension() == ".cc") {
        sources.push_back(entry.path());
      }
    }
  }
  return sources;
}

std::string NameOf(const fs::path& path) {
  return fs::relative(path, SEMBLANCE_SOURCE_DIR).generic_string();
}

TEST(Architecture, EveryIncludeRespectsTheFloorsAndRooms) {
  std::vector<std::string> faults;
  const std::vector<fs::path> sources = Sources();
  ASSERT_GT(sources.size(), 10u);
  for (const fs::path& source : sources) {
    for (std::string& fault : CheckSource(NameOf(source), ReadText(source))) {
      faults.push_back(std::move(fault));
    }
  }
  EXPECT_THAT(faults, IsEmpty());
}

// Every file of the four floors, by floor and room.
std::map<std::string, std::map<std::string, std::vector<std::string>>> FilesByRoom() {
  std::map<std::string, std::map<std::string, std::vector<std::string>>> files;
  for (const auto& [floor, layers] : kRooms) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(SEMBLANCE_SOURCE_DIR) / floor)) {
      if (entry.is_regular_file()) {
        files[floor][RoomOf(NameOf(entry.path()))].push_back(NameOf(entry.path()));
      }
    }
  }
  return files;
}

TEST(Architecture, EveryFileLiesInARoomOfItsFloor) {
  for (const auto& [floor, rooms] : FilesByRoom()) {
    for (const auto& [room, files] : rooms) {
      EXPECT_GE(LayerOf(floor, room), 0) << floor << "/" << room << " is not in kRooms";
      if (room != kHall) {
        EXPECT_GE(files.size(), kFewestFiles) << floor << "/" << room;
        EXPECT_LE(files.size(), kMostFiles) << floor << "/" << room;
      }
    }
  }
}

TEST(Architecture, OnlyFrontDoorsLieFlatInAFloor) {
  auto files = FilesByRoom();
  for (const auto& [floor, layers] : kRooms) {
    for (const std::string& file : files[floor][kHall]) {
      EXPECT_TRUE(file == floor + "/CMakeLists.txt" || kFrontDoors.contains(StemOf(file))) << file;
    }
  }
}

// tests/FLOOR/ROOM/foo_test.cc tests FLOOR/ROOM/foo.
TEST(Architecture, TestsMirrorTheRooms) {
  std::map<std::string, std::string> room_of_stem;  // FLOOR/foo
  for (const fs::path& source : Sources()) {
    const std::string name = NameOf(source);
    room_of_stem[FloorOf(name) + "/" + source.stem().string()] = RoomOf(name);
  }
  for (const auto& [floor, layers] : kRooms) {
    const fs::path tests = fs::path(SEMBLANCE_SOURCE_DIR) / "tests" / floor;
    for (const auto& entry : fs::recursive_directory_iterator(tests)) {
      const std::string stem = entry.path().stem().string();
      const std::string room = RoomOf(fs::relative(entry.path(), tests.parent_path()).string());
      if (!entry.is_regular_file() || !stem.ends_with("_test")) {
        continue;
      }
      const auto tested = room_of_stem.find(floor + "/" + stem.substr(0, stem.size() - 5));
      EXPECT_GE(LayerOf(floor, room), 0) << entry.path();
      EXPECT_TRUE(tested == room_of_stem.end() || tested->second == room)
          << entry.path() << " tests a file of " << RoomName(floor, tested->second);
    }
  }
}

// The house as docs/architecture.md draws it: a line is a layer, the top one first; two floors may
// stand side by side, in columns that begin where their names do.
std::map<std::string, Layers> DrawnHouse(const std::string& page) {
  const std::size_t begin = page.find("```\n") + 4, end = page.find("```", begin);
  std::istringstream drawing(page.substr(begin, end - begin));
  std::map<std::size_t, std::string> floor_at;  // column
  std::map<std::string, Layers> drawn;
  for (std::string line; std::getline(drawing, line);) {
    const bool names_floors = !line.empty() && line[0] != ' ';
    if (names_floors) {
      floor_at.clear();
    }
    std::map<std::string, std::set<std::string>> layer_of;
    static const std::regex kWord(R"(\S+)");
    for (std::sregex_iterator it(line.begin(), line.end(), kWord), last; it != last; ++it) {
      const auto column = static_cast<std::size_t>(it->position());
      if (names_floors) {
        floor_at[column] = it->str();
      } else {
        const std::string& floor = std::prev(floor_at.upper_bound(column))->second;
        layer_of[floor].insert(it->str()[0] == '[' ? kHall : it->str());
      }
    }
    for (auto& [floor, layer] : layer_of) {
      drawn[floor].insert(drawn[floor].begin(), std::move(layer));
    }
  }
  return drawn;
}

TEST(Architecture, TheMapDrawsTheHouseAsItIs) {
  EXPECT_EQ(DrawnHouse(ReadText(fs::path(SEMBLANCE_SOURCE_DIR) / "docs/architecture.md")), kRooms);
}

TEST(Architecture, TheMapNamesFilesThatAreThere) {
  const std::string page = ReadText(fs::path(SEMBLANCE_SOURCE_DIR) / "docs/architecture.md");
  static const std::regex kPath(R"(`((surfaces|interp|fitting|problems|configs)/[\w/]+\.\w+)`)");
  static const std::regex kRow(R"(\| `((surfaces|interp|fitting|problems)/\w+)` \| `(\S+)` \|)");
  std::set<std::string> rooms;
  for (std::sregex_iterator it(page.begin(), page.end(), kPath), end; it != end; ++it) {
    EXPECT_TRUE(fs::exists(fs::path(SEMBLANCE_SOURCE_DIR) / (*it)[1].str())) << (*it)[1];
  }
  static const std::regex kStep(
      R"(`([\w/]+\.cc)`, `(\w+)`)");  // of the journey: a file and what is in it
  int steps = 0;
  for (std::sregex_iterator it(page.begin(), page.end(), kStep), end; it != end; ++it, ++steps) {
    const std::string code = ReadText(fs::path(SEMBLANCE_SOURCE_DIR) / (*it)[1].str());
    EXPECT_NE(code.find((*it)[2].str() + "("), std::string::npos) << (*it)[0];
  }
  EXPECT_GE(steps, 7);
  for (std::sregex_iterator it(page.begin(), page.end(), kRow), end; it != end; ++it) {
    rooms.insert((*it)[1]);
    EXPECT_TRUE(fs::exists(fs::path(SEMBLANCE_SOURCE_DIR) / (*it)[1].str() / (*it)[3].str()))
        << (*it)[1] << "/" << (*it)[3];
  }
  for (const auto& [floor, layers] : kRooms) {
    for (const std::set<std::string>& layer : layers) {
      for (const std::string& room : layer) {
        EXPECT_TRUE(room == kHall || rooms.contains(floor + "/" + room)) << floor << "/" << room;
      }
    }
  }
}

TEST(Architecture, TheReadmeShowsTheConsumersProgram) {
  const fs::path root(SEMBLANCE_SOURCE_DIR);
  const std::string program = ReadText(root / "tests/consumer/main.cc");
  const std::string readme = ReadText(root / "README.md");
  std::istringstream lines(program.substr(program.find("#include")));
  std::string shown;
  for (std::string line; std::getline(lines, line);) {
    shown += line.empty() ? "\n" : "    " + line + "\n";
  }
  EXPECT_NE(readme.find(shown), std::string::npos) << "README.md lacks\n" << shown;
}

TEST(Architecture, OnlyTheAgreedEntriesStandAtTheTop) {
  const std::set<std::string> allowed = {
      "CMakeLists.txt", "fitting", "surfaces", "interp", "problems", "tests", "configs",
      "README.md", "LICENSE", "NOTICE", "Makefile", "CMakePresets.json", ".clang-format",
      ".clang-tidy", ".gitignore", ".ci", "docs", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md",
      // not part of the project, and ignored by git
      ".git", "build", "build-debug", "build-sanitize", "build-quick", "build-tidy", "build-fuzz",
      "build-threads", "build-coverage", "build-clang", "build-units", "build-256", "build-128",
      "out", ".cache"};
  for (const auto& entry : fs::directory_iterator(SEMBLANCE_SOURCE_DIR)) {
    EXPECT_TRUE(allowed.contains(entry.path().filename().string())) << entry.path();
  }
}

constexpr char kSpdx[] = "// SPDX-License-Identifier: GPL-3.0-or-later\n";

TEST(Architecture, PlantedViolationsAreFound) {
  const auto check = [](const std::string& file, const std::string& line) {
    return CheckSource(file, kSpdx + line + "\n");
  };
  EXPECT_THAT(check("interp/dowels/a.cc", "#include \"fitting/fit.h\""),
              ElementsAre(HasSubstr("interp may not know fitting")));
  EXPECT_THAT(check("fitting/fit.cc", "#include \"interp/dowels/dowel.h\""),
              ElementsAre(HasSubstr("fitting may not know interp")));
  EXPECT_THAT(check("surfaces/mesh/a.h", "#include \"problems/run.h\""),
              ElementsAre(HasSubstr("surfaces may not know problems")));
  EXPECT_THAT(check("interp/dowels/a.cc", "  #  include <ceres/ceres.h>"),
              ElementsAre(HasSubstr("ceres/")));
  EXPECT_THAT(check("fitting/fit.h", "#include <ceres/ceres.h>"), ElementsAre(HasSubstr("ceres/")));
  EXPECT_THAT(check("problems/run.cc", "#include <yaml-cpp/yaml.h>"),
              ElementsAre(HasSubstr("yaml-cpp/")));
  EXPECT_THAT(check("surfaces/mesh/mesh_query.h", "#include <CGAL/AABB_tree.h>"),
              ElementsAre(HasSubstr("CGAL/")));
  EXPECT_THAT(check("problems/run.cc", "#include <OpenMesh/Core/IO/MeshIO.hh>"),
              ElementsAre(HasSubstr("OpenMesh/")));
  EXPECT_THAT(check("problems/run.cc", "#include \"tests/testing/shapes.h\""),
              ElementsAre(HasSubstr("never includes its tests")));
  EXPECT_THAT(CheckSource("problems/run.cc", "#include <vector>\n"),
              ElementsAre(HasSubstr("SPDX")));
}

TEST(Architecture, PlantedBackArrowsBetweenRoomsAreFound) {
  const auto check = [](const std::string& file, const std::string& included) {
    return CheckSource(file, fmt::format("{}#include \"{}\"\n", kSpdx, included));
  };
  EXPECT_THAT(check("surfaces/mesh/a.cc", "surfaces/decimate/decimate.h"),
              ElementsAre(HasSubstr("surfaces/mesh stands no higher than surfaces/decimate")));
  EXPECT_THAT(check("surfaces/mesh/a.cc", "surfaces/hspline/sparse_net.h"),
              ElementsAre(HasSubstr("no higher")));
  EXPECT_THAT(check("problems/pipeline/case.cc", "problems/run.h"),
              ElementsAre(HasSubstr("no higher than the front door of problems")));
  EXPECT_EQ(LayerOf("fitting", "nowhere"), -1);
}

TEST(Architecture, AllowedIncludesPass) {
  const auto check = [](const std::string& file, const std::string& line) {
    return CheckSource(file, kSpdx + line + "\n");
  };
  EXPECT_THAT(
      check("problems/run.cc", "#include \"fitting/fit.h\"\n#include \"interp/dowels/dowel.h\""),
      IsEmpty());
  EXPECT_THAT(check("problems/report/run_folder.h", "#include \"problems/run.h\""), IsEmpty());
  EXPECT_THAT(check("surfaces/mesh/a.cc", "#include \"surfaces/mesh/b.h\""), IsEmpty());
  EXPECT_THAT(check("fitting/solve/ceres_solver.cc", "#include <ceres/ceres.h>"), IsEmpty());
  EXPECT_THAT(check("interp/kriging/bounded_minimum.cc", "#include <ceres/gradient_problem.h>"),
              IsEmpty());
  EXPECT_THAT(check("fitting/terms/stencil_cost.h", "#include <ceres/sized_cost_function.h>"),
              IsEmpty());
  EXPECT_THAT(check("problems/config/config.cc", "#include <yaml-cpp/yaml.h>"), IsEmpty());
  EXPECT_THAT(check("surfaces/mesh_files/mesh_io.cc", "#include <OpenMesh/Core/IO/MeshIO.hh>"),
              IsEmpty());
  EXPECT_THAT(check("problems/run.cc", "// text about #include \"x\""), IsEmpty());
}

}  // namespace
}  // namespace semblance
