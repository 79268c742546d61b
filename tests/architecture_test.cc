// SPDX-License-Identifier: GPL-3.0-or-later
// Enforces the layers and modules of the design from the include lines: problems includes interp
// and fitting, both include surfaces; the modules of a layer are ordered without cycles; each
// third-party library is included only where it is allowed. The order is data (kLayersBelow,
// kModules); planted violations test the test.
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

const std::map<std::string, std::set<std::string>> kLayersBelow = {
    {"surfaces", {"surfaces"}},
    {"interp", {"interp", "surfaces"}},
    {"fitting", {"fitting", "surfaces"}},
    {"problems", {"problems", "interp", "fitting", "surfaces"}},
};

// The files that lie directly in a layer's folder: its front door.
constexpr char kFrontDoor[] = "";

using Ranks = std::vector<std::set<std::string>>;

// The modules of each layer, the lowest rank first. A file includes files of its own module and of
// lower ranks. Subfolders belong to their module. docs/explanation/architecture.md draws the same
// order.
const std::map<std::string, Ranks> kModules = {
    {"surfaces",
     {{"base"},
      {"hspline", "mesh"},
      {"decimate", "emitters", "hspline_query", "marching", "mesh_files"},
      {"hspline_files", "implicit"},
      {kFrontDoor}}},
    {"interp",
     {{"dowels"},
      {"on_surface"},
      {"kriging"},
      {"schemes"},
      {"stacking"},
      {kFrontDoor},
      {"evaluation"}}},
    {"fitting",
     {{"folds", "least_squares", "problem"},
      {"parameters", "space"},
      {"terms"},
      {"nested", "solve"},
      {"relaxation", "springs", "uncertainty"},
      {"plan"},
      {kFrontDoor}}},
    {"problems",
     {{"config"},
      {"io"},
      {"subject"},
      {"face"},
      {"experiment"},
      {kFrontDoor},
      {"report"},
      {"points", "population", "study"},
      {"app"}}},
};

// The front doors, by path without extension. Nothing else lies directly in a layer's folder,
// except its CMakeLists.txt.
const std::set<std::string> kFrontDoors = {"surfaces/implicit_face", "interp/interpolate_depth",
                                           "fitting/fit", "problems/run"};

// A module with fewer files belongs into another one. A folder with more is split into subfolders.
constexpr int kMinFiles = 2, kMaxFiles = 45;

// Where a library may be included: a regular expression over the path of the including file.
const std::map<std::string, std::string> kLibraryPlaces = {
    {"ceres/",
     R"(fitting/(\w+/)?\w+(\.cc|_cost\.h)|interp/kriging/bounded_minimum\.cc|problems/face/(shape_model/\w+|joint_fit)(\.cc|_cost\.h))"},
    {"yaml-cpp/", R"(problems/config/config\.cc)"},
    {"CGAL/", R"([\w/]+\.cc)"},
    {"OpenMesh/", R"(surfaces/\w+/\w+\.cc|surfaces/mesh/half_edge_mesh\.h)"},
    {"itk", R"(problems/io/volumes/itk_files\.cc)"},
    {"gdcm", R"(problems/io/volumes/itk_files\.cc)"},
    {"httplib", R"(problems/app/workbench/http_(connections|server)\.cc)"},
    {"pybind11", R"(problems/app/python/\w+\.(h|cc))"},
};

std::string LayerOf(const std::string& path) { return path.substr(0, path.find('/')); }

// The first folder below the layer, or kFrontDoor.
std::string ModuleOf(const std::string& path) {
  const std::size_t first = path.find('/'), second = path.find('/', first + 1);
  return second == std::string::npos ? kFrontDoor : path.substr(first + 1, second - first - 1);
}

std::string WithoutExtension(const std::string& path) { return path.substr(0, path.rfind('.')); }

std::string DisplayName(const std::string& layer, const std::string& module) {
  return module == kFrontDoor ? "the front door of " + layer : layer + "/" + module;
}

// The rank of a module in its layer; -1 if the layer has no such module.
int FindRank(const std::string& layer, const std::string& module) {
  const Ranks& ranks = kModules.at(layer);
  for (std::size_t k = 0; k < ranks.size(); ++k) {
    if (ranks[k].contains(module)) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

// Both files belong to the same layer.
std::vector<std::string> CheckModules(const std::string& file, const std::string& included) {
  const std::string layer = LayerOf(file), from = ModuleOf(file), to = ModuleOf(included);
  if (from == to || FindRank(layer, to) < FindRank(layer, from)) {
    return {};
  }
  return {fmt::format("{} includes {}: {} is not above {} in the order of modules", file, included,
                      DisplayName(layer, from), DisplayName(layer, to))};
}

std::vector<std::string> CheckInclude(const std::string& file, const std::string& included) {
  std::vector<std::string> faults;
  const auto below = kLayersBelow.find(LayerOf(file));
  const std::string target = LayerOf(included);
  if (below != kLayersBelow.end() && target == "tests") {
    faults.push_back(
        fmt::format("{} includes {}: the project never includes its tests", file, included));
  }
  if (below != kLayersBelow.end() && kLayersBelow.contains(target) &&
      !below->second.contains(target)) {
    faults.push_back(fmt::format("{} includes {}: {} may not include {}", file, included,
                                 LayerOf(file), target));
  }
  if (kModules.contains(target) && LayerOf(file) == target) {
    for (std::string& fault : CheckModules(file, included)) {
      faults.push_back(std::move(fault));
    }
  }
  for (const auto& [library, places] : kLibraryPlaces) {
    if (below != kLayersBelow.end() && included.starts_with(library) &&
        !std::regex_match(file, std::regex(places))) {
      faults.push_back(fmt::format("{} includes {}: allowed only in {}", file, included, places));
    }
  }
  return faults;
}

// text: the content of `file`, a path relative to the top level.
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

// The path relative to the top level.
std::string RelativeName(const fs::path& path) {
  return fs::relative(path, SEMBLANCE_SOURCE_DIR).generic_string();
}

TEST(Architecture, EveryIncludeRespectsTheLayersAndModules) {
  std::vector<std::string> faults;
  const std::vector<fs::path> sources = Sources();
  ASSERT_GT(sources.size(), 10u);
  for (const fs::path& source : sources) {
    for (std::string& fault : CheckSource(RelativeName(source), ReadText(source))) {
      faults.push_back(std::move(fault));
    }
  }
  EXPECT_THAT(faults, IsEmpty());
}

// Every file of the four layers, by layer and folder (a module, or a subfolder of one).
std::map<std::string, std::map<std::string, std::vector<std::string>>> FilesByFolder() {
  std::map<std::string, std::map<std::string, std::vector<std::string>>> files;
  for (const auto& [layer, ranks] : kModules) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(SEMBLANCE_SOURCE_DIR) / layer)) {
      if (entry.is_regular_file()) {
        const std::string name = RelativeName(entry.path());
        files[layer][fs::path(name).parent_path().generic_string()].push_back(name);
      }
    }
  }
  return files;
}

TEST(Architecture, EveryFileBelongsToAModule) {
  for (const auto& [layer, folders] : FilesByFolder()) {
    for (const auto& [folder, files] : folders) {
      EXPECT_GE(FindRank(layer, ModuleOf(files[0])), 0) << folder << " is not in kModules";
      if (folder != layer) {
        EXPECT_GE(files.size(), kMinFiles) << folder;
        EXPECT_LE(files.size(), kMaxFiles) << folder;
      }
    }
  }
}

TEST(Architecture, OnlyFrontDoorsLieDirectlyInALayer) {
  auto files = FilesByFolder();
  for (const auto& [layer, ranks] : kModules) {
    for (const std::string& file : files[layer][layer]) {
      EXPECT_TRUE(file == layer + "/CMakeLists.txt" || kFrontDoors.contains(WithoutExtension(file)))
          << file;
    }
  }
}

// tests/LAYER/MODULE/foo_test.cc tests LAYER/MODULE/foo.
TEST(Architecture, TestsMirrorTheModules) {
  std::map<std::string, std::string> module_of_stem;  // LAYER/foo
  for (const fs::path& source : Sources()) {
    const std::string name = RelativeName(source);
    module_of_stem[LayerOf(name) + "/" + source.stem().string()] = ModuleOf(name);
  }
  for (const auto& [layer, ranks] : kModules) {
    const fs::path tests = fs::path(SEMBLANCE_SOURCE_DIR) / "tests" / layer;
    for (const auto& entry : fs::recursive_directory_iterator(tests)) {
      const std::string stem = entry.path().stem().string();
      const std::string module = ModuleOf(fs::relative(entry.path(), tests.parent_path()).string());
      if (!entry.is_regular_file() || !stem.ends_with("_test")) {
        continue;
      }
      const auto tested = module_of_stem.find(layer + "/" + stem.substr(0, stem.size() - 5));
      EXPECT_GE(FindRank(layer, module), 0) << entry.path();
      EXPECT_TRUE(tested == module_of_stem.end() || tested->second == module)
          << entry.path() << " tests a file of " << DisplayName(layer, tested->second);
    }
  }
}

constexpr char kMap[] = "docs/explanation/architecture.md";

// The order as kMap draws it: a line is a rank, the highest first. Two layers may be drawn side by
// side, in columns that begin where their names do.
std::map<std::string, Ranks> DrawnOrder(const std::string& page) {
  const std::size_t begin = page.find("```\n") + 4, end = page.find("```", begin);
  std::istringstream drawing(page.substr(begin, end - begin));
  std::map<std::size_t, std::string> layer_at;  // column
  std::map<std::string, Ranks> drawn;
  for (std::string line; std::getline(drawing, line);) {
    const bool names_layers = !line.empty() && line[0] != ' ';
    if (names_layers) {
      layer_at.clear();
    }
    std::map<std::string, std::set<std::string>> rank_of;
    static const std::regex kWord(R"(\S+)");
    for (std::sregex_iterator it(line.begin(), line.end(), kWord), last; it != last; ++it) {
      const auto column = static_cast<std::size_t>(it->position());
      if (names_layers) {
        layer_at[column] = it->str();
      } else {
        const std::string& layer = std::prev(layer_at.upper_bound(column))->second;
        rank_of[layer].insert(it->str()[0] == '[' ? kFrontDoor : it->str());
      }
    }
    for (auto& [layer, rank] : rank_of) {
      drawn[layer].insert(drawn[layer].begin(), std::move(rank));
    }
  }
  return drawn;
}

TEST(Architecture, TheMapDrawsTheModulesInTheirOrder) {
  EXPECT_EQ(DrawnOrder(ReadText(fs::path(SEMBLANCE_SOURCE_DIR) / kMap)), kModules);
}

TEST(Architecture, TheMapNamesExistingFiles) {
  const std::string page = ReadText(fs::path(SEMBLANCE_SOURCE_DIR) / kMap);
  static const std::regex kPath(R"(`((surfaces|interp|fitting|problems|configs)/[\w/]+\.\w+)`)");
  static const std::regex kRow(R"(\| `((surfaces|interp|fitting|problems)/\w+)` \| `(\S+)` \|)");
  std::set<std::string> modules;
  for (std::sregex_iterator it(page.begin(), page.end(), kPath), end; it != end; ++it) {
    EXPECT_TRUE(fs::exists(fs::path(SEMBLANCE_SOURCE_DIR) / (*it)[1].str())) << (*it)[1];
  }
  static const std::regex kStep(
      R"(`([\w/]+\.cc)`, `(\w+)`)");  // a step of the journey: a file and a function in it
  int steps = 0;
  for (std::sregex_iterator it(page.begin(), page.end(), kStep), end; it != end; ++it, ++steps) {
    const std::string code = ReadText(fs::path(SEMBLANCE_SOURCE_DIR) / (*it)[1].str());
    EXPECT_NE(code.find((*it)[2].str() + "("), std::string::npos) << (*it)[0];
  }
  EXPECT_GE(steps, 7);
  for (std::sregex_iterator it(page.begin(), page.end(), kRow), end; it != end; ++it) {
    modules.insert((*it)[1]);
    EXPECT_TRUE(fs::exists(fs::path(SEMBLANCE_SOURCE_DIR) / (*it)[1].str() / (*it)[3].str()))
        << (*it)[1] << "/" << (*it)[3];
  }
  for (const auto& [layer, ranks] : kModules) {
    for (const std::set<std::string>& rank : ranks) {
      for (const std::string& module : rank) {
        EXPECT_TRUE(module == kFrontDoor || modules.contains(layer + "/" + module))
            << layer << "/" << module;
      }
    }
  }
}

TEST(Architecture, TheLibraryPageShowsTheConsumersProgram) {
  const fs::path root(SEMBLANCE_SOURCE_DIR);
  const std::string program = ReadText(root / "tests/consumer/main.cc");
  const std::string page = ReadText(root / "docs/how-to/use-as-a-library.md");
  std::istringstream lines(program.substr(program.find("#include")));
  std::string shown;
  for (std::string line; std::getline(lines, line);) {
    shown += line.empty() ? "\n" : "    " + line + "\n";
  }
  EXPECT_NE(page.find(shown), std::string::npos) << "the page lacks\n" << shown;
}

TEST(Architecture, TheTopLevelHoldsOnlyTheAgreedEntries) {
  const std::set<std::string> allowed = {
      "CMakeLists.txt", "fitting", "surfaces", "interp", "problems", "tests", "configs",
      "README.md", "LICENSE", "NOTICE", "Makefile", "CMakePresets.json", ".clang-format",
      ".clang-tidy", ".gitignore", ".ci", "docs", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md",
      "Containerfile", "pyproject.toml",
      // ignored by git
      ".git", "build", "out", ".cache"};
  for (const auto& entry : fs::directory_iterator(SEMBLANCE_SOURCE_DIR)) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(allowed.contains(name) || name.starts_with("build-")) << name;
  }
}

constexpr char kSpdx[] = "// SPDX-License-Identifier: GPL-3.0-or-later\n";

TEST(Architecture, PlantedViolationsAreFound) {
  const auto check = [](const std::string& file, const std::string& line) {
    return CheckSource(file, kSpdx + line + "\n");
  };
  EXPECT_THAT(check("interp/dowels/a.cc", "#include \"fitting/fit.h\""),
              ElementsAre(HasSubstr("interp may not include fitting")));
  EXPECT_THAT(check("fitting/fit.cc", "#include \"interp/dowels/dowel.h\""),
              ElementsAre(HasSubstr("fitting may not include interp")));
  EXPECT_THAT(check("surfaces/mesh/a.h", "#include \"problems/run.h\""),
              ElementsAre(HasSubstr("surfaces may not include problems")));
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

TEST(Architecture, PlantedIncludesAgainstTheOrderAreFound) {
  const auto check = [](const std::string& file, const std::string& included) {
    return CheckSource(file, fmt::format("{}#include \"{}\"\n", kSpdx, included));
  };
  EXPECT_THAT(check("surfaces/mesh/a.cc", "surfaces/decimate/decimate.h"),
              ElementsAre(HasSubstr("surfaces/mesh is not above surfaces/decimate")));
  EXPECT_THAT(check("surfaces/mesh/a.cc", "surfaces/hspline/sparse_net.h"),
              ElementsAre(HasSubstr("is not above")));
  EXPECT_THAT(check("problems/experiment/case.cc", "problems/run.h"),
              ElementsAre(HasSubstr("is not above the front door of problems")));
  EXPECT_EQ(FindRank("fitting", "nowhere"), -1);
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
