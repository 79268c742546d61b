// SPDX-License-Identifier: GPL-3.0-or-later
// The floors of the design, enforced from the include lines: problems on top of interp and fitting,
// both on top of surfaces; each third-party library only where it is allowed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
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

// Where a library may be included: a regular expression over the path of the including file.
const std::map<std::string, std::string> kLibraryPlaces = {
    {"ceres/", R"(fitting/\w+(\.cc|_cost\.h)|interp/kriging_likelihood\.cc)"},
    {"yaml-cpp/", R"(problems/config\.cc)"},
    {"CGAL/", R"(\w+/\w+\.cc)"},
    {"OpenMesh/", R"(surfaces/(tri_mesh\.h|mesh_io\.cc))"},
};

std::string FloorOf(const std::string& path) { return path.substr(0, path.find('/')); }

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

TEST(Architecture, EveryIncludeRespectsTheFloors) {
  std::vector<std::string> faults;
  const std::vector<fs::path> sources = Sources();
  ASSERT_GT(sources.size(), 10u);
  for (const fs::path& source : sources) {
    const std::string name = fs::relative(source, SEMBLANCE_SOURCE_DIR).generic_string();
    for (std::string& fault : CheckSource(name, ReadText(source))) {
      faults.push_back(std::move(fault));
    }
  }
  EXPECT_THAT(faults, IsEmpty());
}

TEST(Architecture, OnlyTheAgreedEntriesStandAtTheTop) {
  const std::set<std::string> allowed = {
      "CMakeLists.txt", "fitting", "surfaces", "interp", "problems", "tests", "configs",
      "README.md", "LICENSE", "Makefile", "CMakePresets.json", ".clang-format", ".clang-tidy",
      ".gitignore", ".ci", "docs",
      // not part of the project, and ignored by git
      ".git", "build", "build-debug", "build-sanitize", "out", ".cache"};
  for (const auto& entry : fs::directory_iterator(SEMBLANCE_SOURCE_DIR)) {
    EXPECT_TRUE(allowed.contains(entry.path().filename().string())) << entry.path();
  }
}

constexpr char kSpdx[] = "// SPDX-License-Identifier: GPL-3.0-or-later\n";

TEST(Architecture, PlantedViolationsAreFound) {
  const auto check = [](const std::string& file, const std::string& line) {
    return CheckSource(file, kSpdx + line + "\n");
  };
  EXPECT_THAT(check("interp/a.cc", "#include \"fitting/fit.h\""),
              ElementsAre(HasSubstr("interp may not know fitting")));
  EXPECT_THAT(check("fitting/a.cc", "#include \"interp/dowel.h\""),
              ElementsAre(HasSubstr("fitting may not know interp")));
  EXPECT_THAT(check("surfaces/a.h", "#include \"problems/run.h\""),
              ElementsAre(HasSubstr("surfaces may not know problems")));
  EXPECT_THAT(check("interp/a.cc", "  #  include <ceres/ceres.h>"),
              ElementsAre(HasSubstr("ceres/")));
  EXPECT_THAT(check("fitting/fit.h", "#include <ceres/ceres.h>"), ElementsAre(HasSubstr("ceres/")));
  EXPECT_THAT(check("problems/run.cc", "#include <yaml-cpp/yaml.h>"),
              ElementsAre(HasSubstr("yaml-cpp/")));
  EXPECT_THAT(check("surfaces/mesh_query.h", "#include <CGAL/AABB_tree.h>"),
              ElementsAre(HasSubstr("CGAL/")));
  EXPECT_THAT(check("problems/run.cc", "#include <OpenMesh/Core/IO/MeshIO.hh>"),
              ElementsAre(HasSubstr("OpenMesh/")));
  EXPECT_THAT(check("problems/run.cc", "#include \"tests/testing/shapes.h\""),
              ElementsAre(HasSubstr("never includes its tests")));
  EXPECT_THAT(CheckSource("problems/run.cc", "#include <vector>\n"),
              ElementsAre(HasSubstr("SPDX")));
}

TEST(Architecture, AllowedIncludesPass) {
  const auto check = [](const std::string& file, const std::string& line) {
    return CheckSource(file, kSpdx + line + "\n");
  };
  EXPECT_THAT(check("problems/run.cc", "#include \"fitting/fit.h\"\n#include \"interp/dowel.h\""),
              IsEmpty());
  EXPECT_THAT(check("fitting/level_fit.cc", "#include <ceres/ceres.h>"), IsEmpty());
  EXPECT_THAT(check("interp/kriging_likelihood.cc", "#include <ceres/gradient_problem.h>"),
              IsEmpty());
  EXPECT_THAT(check("fitting/stencil_cost.h", "#include <ceres/sized_cost_function.h>"), IsEmpty());
  EXPECT_THAT(check("problems/config.cc", "#include <yaml-cpp/yaml.h>"), IsEmpty());
  EXPECT_THAT(check("surfaces/mesh_io.cc", "#include <OpenMesh/Core/IO/MeshIO.hh>"), IsEmpty());
  EXPECT_THAT(check("problems/run.cc", "// text about #include \"x\""), IsEmpty());
}

}  // namespace
}  // namespace semblance
