// SPDX-License-Identifier: GPL-3.0-or-later
// Peers that are programs of their own.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "tests/bench/fit_parts.h"
#include "tests/bench/peer_program.h"
#include "tests/testing/scattered_data.h"

namespace semblance::bench {
using namespace problems;
namespace {

// The head's points, and the clean surface on the grid of ErrorAgainst, as the peers read them.
PeerFiles HeadFiles(int count) {
  std::vector<double> points, grid;
  for (const FitPoint& p : testing::Scattered(testing::HeadPoint, count, 1e-4, 206).points) {
    points.insert(points.end(),
                  {p.uv.x(), p.uv.y(), p.position.x(), p.position.y(), p.position.z()});
  }
  constexpr int kSide = 400;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec3 p = testing::HeadPoint({(k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide});
    grid.insert(grid.end(), {p.x(), p.y(), p.z()});
  }
  return PeerFiles({{"points", points}, {"grid", grid}});
}

// Their seconds over ours; met if that is the goal or more with an RMS of ours that is no worse.
void PrintAgainst(const char* peer, const Measured& ours, const Measured& theirs, double goal,
                  const char* package) {
  if (std::isnan(theirs.seconds)) {
    fmt::print(stderr, "fit_bench: {} is not measured: the Debian package {} is not there\n", peer,
               package);
    return;
  }
  const bool as_good = ours.rms_mm <= theirs.rms_mm;
  Print(fmt::format("fit.head_1e5_vs_{}", peer), ours.seconds, theirs.seconds,
        as_good ? goal : std::numeric_limits<double>::infinity(), "s");
  Print(fmt::format("fit.head_1e5_rms_vs_{}", peer), ours.rms_mm, theirs.rms_mm, 1, "mm");
}

}  // namespace

// FITPACK with 64 x 64 patches, which it needs for the RMS; ITK with 128 x 128, and even so it is
// coarser, for it approximates level by level. No goal was set against ITK.
void RunPeers() {
  const Measured ours = MeasureApart([] { return MeasureHead(100000, 9e-4); });
  const PeerFiles files = HeadFiles(100000);
  PrintAgainst("fitpack", ours,
               AskScipy(fmt::format("'{}' {} 64", SEMBLANCE_FITPACK_PEER, files.Names())), 50,
               "python3-scipy");
#ifdef SEMBLANCE_ITK_PEER
  PrintAgainst("itk", ours, AskPeer(fmt::format("'{}' {} 8", SEMBLANCE_ITK_PEER, files.Names())),
               kNaN, "libinsighttoolkit5-dev");
#else
  PrintAgainst("itk", ours, {}, kNaN, "libinsighttoolkit5-dev");
#endif
}

}  // namespace semblance::bench
