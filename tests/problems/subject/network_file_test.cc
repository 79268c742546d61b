// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/network_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;
using testing::ScratchFile;
using testing::WordsOf;
using Edge = std::pair<std::string, std::string>;

NetworkPlan Standard() {
  return ReadNetworkPlan(SEMBLANCE_SOURCE_DIR "/configs/networks/standard32.yaml");
}

// How many areas run along each edge in its direction.
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

TEST(NetworkFile, RefusesWhatIsNotANetwork) {
  const auto words = [](const std::string& text) {
    return WordsOf<InputError>([&] { ReadNetworkPlan(ScratchFile(text)); });
  };
  EXPECT_THAT(words("title: none\n"), HasSubstr("areas: the network has none"));
  EXPECT_THAT(words("areas: [[g, sg, g]]\n"),
              HasSubstr("area [g, sg, g] names a site twice; an area needs three different sites"));
  EXPECT_THAT(words("areas: [[g, sg, pg], [pg, g, sg]]\n"),
              HasSubstr("area [pg, g, sg] appears twice"));
  EXPECT_THROW(ReadNetworkPlan(ScratchFile("areas: [[g, sg]]\n")), ConfigError);
  EXPECT_THROW(ReadNetworkPlan(ScratchFile("area: [[g, sg, pg]]\n")), ConfigError);
  EXPECT_THROW(ReadNetworkPlan("/no/such/network.yaml"), IoError);
}

}  // namespace
}  // namespace semblance
