// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/network_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::ScratchFile;
using testing::WordsOf;
using Edge = std::pair<std::string, std::string>;

NetworkPlan Standard() {
  return ReadNetworkPlan(SEMBLANCE_SOURCE_DIR "/configs/networks/standard32.yaml");
}

// The number of areas that run along each edge in its direction.
std::map<Edge, int> DirectedEdges(const NetworkPlan& plan) {
  std::map<Edge, int> edges;
  for (const auto& area : plan.areas) {
    for (int c = 0; c < 3; ++c) {
      ++edges[{area[c], area[(c + 1) % 3]}];
    }
  }
  return edges;
}

Edge Undirected(const Edge& e) {
  return {std::min(e.first, e.second), std::max(e.first, e.second)};
}

std::map<Edge, int> AreasByEdge(const NetworkPlan& plan) {
  std::map<Edge, int> areas;
  for (const auto& [edge, count] : DirectedEdges(plan)) {
    areas[Undirected(edge)] += count;
  }
  return areas;
}

std::string Mirrored(std::string site) {
  if (site.ends_with("_l")) {
    site.back() = 'r';
  } else if (site.ends_with("_r")) {
    site.back() = 'l';
  }
  return site;
}

TEST(StandardNetwork, UsesThe32SitesAndIsADisc) {
  const NetworkPlan plan = Standard();
  std::set<std::string> sites;
  for (const auto& area : plan.areas) {
    sites.insert(area.begin(), area.end());
  }
  const std::vector<std::string> standard = StandardSiteCodes();
  EXPECT_EQ(sites, std::set<std::string>(standard.begin(), standard.end()));
  const int v = static_cast<int>(sites.size());
  const int e = static_cast<int>(AreasByEdge(plan).size());
  const int t = static_cast<int>(plan.areas.size());
  EXPECT_EQ(v, 32);
  EXPECT_EQ(e, 85);
  EXPECT_EQ(t, 54);
  EXPECT_EQ(v - e + t, 1);
}

TEST(StandardNetwork, HasOneBorderOfEightEdges) {
  std::map<std::string, int> border_edges_at;
  int border = 0;
  for (const auto& [edge, areas] : AreasByEdge(Standard())) {
    EXPECT_LE(areas, 2) << edge.first << " " << edge.second;
    if (areas == 1) {
      ++border;
      ++border_edges_at[edge.first];
      ++border_edges_at[edge.second];
    }
  }
  EXPECT_EQ(border, 8);
  const std::map<std::string, int> ring = {{"sg", 2},    {"fe_l", 2}, {"fe_r", 2}, {"sgl_l", 2},
                                           {"sgl_r", 2}, {"go_l", 2}, {"go_r", 2}, {"me", 2}};
  EXPECT_EQ(border_edges_at, ring);
}

TEST(StandardNetwork, AreasTurnAlike) {
  for (const auto& [edge, count] : DirectedEdges(Standard())) {
    EXPECT_EQ(count, 1) << edge.first << " " << edge.second;
  }
}

TEST(StandardNetwork, IsItsMirrorImage) {
  const NetworkPlan plan = Standard();
  const auto sorted = [](std::array<std::string, 3> area) {
    std::sort(area.begin(), area.end());
    return area;
  };
  std::set<std::array<std::string, 3>> areas, mirrored;
  for (const auto& area : plan.areas) {
    areas.insert(sorted(area));
    mirrored.insert(sorted({Mirrored(area[0]), Mirrored(area[1]), Mirrored(area[2])}));
  }
  EXPECT_EQ(areas, mirrored);
}

TEST(StandardNetwork, KeepsAllAreasWithAllDowels) {
  std::vector<Dowel> dowels;
  for (const std::string& site : StandardSiteCodes()) {
    dowels.emplace_back().site = site;
  }
  EXPECT_EQ(BuildNetwork(Standard(), dowels).areas.size(), 54u);
  dowels.erase(dowels.begin());  // sg: four areas
  const DowelNetwork network = BuildNetwork(Standard(), dowels);
  EXPECT_EQ(network.areas.size(), 50u);
  EXPECT_EQ(network.dropped.size(), 4u);
}

TEST(NetworkPlan, RefusesWhatIsNotANetwork) {
  const auto words = [](const std::string& text) {
    return WordsOf<InputError>([&] { ReadNetworkPlan(ScratchFile(text)); });
  };
  EXPECT_THAT(words("title: none\n"), HasSubstr("areas: the list is empty"));
  EXPECT_THAT(words("areas: [[g, sg, g]]\n"),
              HasSubstr("area [g, sg, g] names a site twice; an area needs three different sites"));
  EXPECT_THAT(words("areas: [[g, sg, pg], [pg, g, sg]]\n"),
              HasSubstr("area [pg, g, sg] appears twice"));
  EXPECT_THROW(ReadNetworkPlan(ScratchFile("areas: [[g, sg]]\n")), ConfigError);
  EXPECT_THROW(ReadNetworkPlan(ScratchFile("area: [[g, sg, pg]]\n")), ConfigError);
  EXPECT_THROW(ReadNetworkPlan("/no/such/network.yaml"), IoError);
  EXPECT_THAT(words("areas: [[g, sg, pg], [sg, g, id], [g, sg, me]]\n"),
              HasSubstr("more than two areas have the edge g sg"));
  EXPECT_THAT(words("areas: [[g, sg, pg], [g, sg, id]]\n"),
              HasSubstr("the areas [g, sg, pg] and [g, sg, id] lie on the same side of the edge g "
                        "sg"));
  EXPECT_THAT(words("area_count: 2\nareas: [[g, sg, pg]]\n"),
              HasSubstr("area_count is 2, and the file has 1 areas: it was cut short"));
}

std::vector<Landmark> LandmarksAt(const std::vector<std::string>& sites) {
  std::vector<Landmark> landmarks;
  for (const std::string& site : sites) {
    landmarks.emplace_back().site = site;
  }
  return landmarks;
}

// The standard network after the first `bytes` bytes of its file, and whether it may be used.
bool IsAcceptedAfterCut(const std::string& text, std::size_t bytes) {
  try {
    const NetworkPlan plan = ReadNetworkPlan(ScratchFile(text.substr(0, bytes)));
    return CheckNetworkSites(plan, "n.yaml", LandmarksAt(StandardSiteCodes()), {}).empty();
  } catch (const Error&) {
    return false;
  }
}

TEST(NetworkPlan, TheStandardNetworkIsRefusedWhereverItIsCut) {
  const std::string text = ReadFileBytes(SEMBLANCE_SOURCE_DIR "/configs/networks/standard32.yaml");
  EXPECT_TRUE(IsAcceptedAfterCut(text, text.size()));
  const std::size_t end = text.rfind(']');
  for (std::size_t bytes = 0; bytes <= end; bytes += 7) {
    EXPECT_FALSE(IsAcceptedAfterCut(text, bytes)) << bytes;
  }
  for (std::size_t line = text.find('\n'); line < end; line = text.find('\n', line + 1)) {
    EXPECT_FALSE(IsAcceptedAfterCut(text, line + 1)) << line;
  }
}

// The same without the number of areas, as in a file of a user: only by its sites and symmetry.
TEST(NetworkPlan, ANetworkThatIsCutAtALineIsRefusedOrNotedWithoutItsNumberOfAreas) {
  NetworkPlan plan = Standard();
  plan.area_count.reset();
  const std::vector<Landmark> landmarks = LandmarksAt(StandardSiteCodes());
  EXPECT_THAT(CheckNetworkSites(plan, "n.yaml", landmarks, {}), ::testing::IsEmpty());
  plan.areas.pop_back();
  EXPECT_THAT(CheckNetworkSites(plan, "n.yaml", landmarks, {}),
              ::testing::ElementsAre(HasSubstr("[fe_r, sgl_r, zy_r] have no mirror image")));
  for (std::size_t left = plan.areas.size() - 1; left > 0; --left) {
    plan.areas.resize(left);
    try {
      EXPECT_EQ(CheckNetworkSites(plan, "n.yaml", landmarks, {}).size(), 1u) << left;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("n.yaml: no area names the landmarks")) << left;
    }
  }
  plan.area_count = 1;  // left out on purpose
  EXPECT_THAT(CheckNetworkSites(plan, "n.yaml", landmarks, {}), ::testing::IsEmpty());
}

TEST(NetworkPlan, AnUnknownSiteIsRefusedUnlessTheExperimentNamesIt) {
  NetworkPlan plan = Standard();
  std::ranges::replace(plan.areas.front(), std::string("sg"), std::string("sgg"));
  EXPECT_THAT(WordsOf<InputError>([&] { CheckNetworkSites(plan, "n.yaml", {}, {}); }),
              ::testing::AllOf(HasSubstr("n.yaml: areas: unknown site 'sgg'"),
                               HasSubstr("did you mean 'sg'")));
  EXPECT_THAT(CheckNetworkSites(plan, "n.yaml", {}, {{"sgg", {}}}), ::testing::IsEmpty());
  std::ranges::replace(plan.areas.front(), std::string("sgg"), std::string("mmb_l"));
  EXPECT_THAT(CheckNetworkSites(plan, "n.yaml", {}, {}), ::testing::IsEmpty());
}

struct Net {
  NetworkPlan plan;
  std::map<std::string, Vec3> points;
};

std::string Name(int i, int j) { return "p" + std::to_string(i) + "_" + std::to_string(j); }

// A flat grid of n x n squares of two areas each, whose inner points are moved a little.
Net Grid(int n) {
  Net net;
  Random random(2);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const bool inner = i > 0 && j > 0 && i < n && j < n;
      const Vec3 shake = inner ? Vec3(0.2 * random.Uniform(-1, 1), 0.2 * random.Uniform(-1, 1), 0)
                               : Vec3(Vec3::Zero());
      net.points[Name(i, j)] = Vec3(i, j, 0) + shake;
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      net.plan.areas.push_back({Name(i, j), Name(i + 1, j), Name(i + 1, j + 1)});
      net.plan.areas.push_back({Name(i, j), Name(i + 1, j + 1), Name(i, j + 1)});
    }
  }
  return net;
}

// Above 0 for an area that faces up; never NaN.
double SignedArea(const Net& net, const std::array<std::string, 3>& area) {
  const Vec3 &a = net.points.at(area[0]), &b = net.points.at(area[1]), &c = net.points.at(area[2]);
  return (b - a).cross(c - a).z() / 2;
}

// Checks that no area is turned over or flat, that no edge has three areas, and that the same
// region is covered.
void ExpectSound(const Net& net, const NetworkPlan& plan, double covered) {
  double sum = 0;
  std::map<std::set<std::string>, int> edges;
  for (const auto& area : plan.areas) {
    EXPECT_GT(SignedArea(net, area), 0);
    sum += SignedArea(net, area);
    for (int c = 0; c < 3; ++c) {
      const std::set<std::string> edge = {area[c], area[(c + 1) % 3]};
      EXPECT_LE(++edges[edge], 2);
    }
  }
  EXPECT_NEAR(sum, covered, 1e-9);
}

TEST(WithoutSites, InnerSitesGoAndTheSameRegionIsCovered) {
  const Net net = Grid(5);
  Random random(9);
  for (int trial = 0; trial < 20; ++trial) {
    std::set<std::string> gone;
    for (int k = 0; k < 1 + trial / 2; ++k) {
      gone.insert(
          Name(1 + static_cast<int>(random.Index(4)), 1 + static_cast<int>(random.Index(4))));
    }
    const NetworkPlan thin = WithoutSites(net.plan, gone, net.points);
    ExpectSound(net, thin, 25);
    EXPECT_EQ(thin.areas.size(), 50 - 2 * gone.size());
    for (const auto& area : thin.areas) {
      for (const std::string& site : area) {
        EXPECT_FALSE(gone.contains(site)) << site;
      }
    }
  }
}

TEST(WithoutSites, ABorderSiteMovesAlongTheBorder) {
  const Net net = Grid(4);
  const NetworkPlan thin = WithoutSites(net.plan, {Name(2, 0)}, net.points);
  ExpectSound(net, thin, 16);  // the border there is straight
  EXPECT_EQ(thin.areas.size(), 31u);
}

TEST(WithoutSites, NothingGoneKeepsThePlanAndUnknownSitesStay) {
  const Net net = Grid(3);
  EXPECT_EQ(WithoutSites(net.plan, {}, net.points).areas, net.plan.areas);
  EXPECT_EQ(WithoutSites(net.plan, {"elsewhere"}, net.points).areas, net.plan.areas);
}

}  // namespace

}  // namespace semblance::problems
