// SPDX-License-Identifier: GPL-3.0-or-later
// Peers that are programs of their own.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "tests/bench/fit_parts.h"
#include "tests/testing/scattered_data.h"

namespace semblance::bench {
namespace {

// The head's points, and the clean surface on the grid of ErrorAgainst, as the peers read them.
class HeadFiles {
 public:
  explicit HeadFiles(int count) {
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
    Write("points", points);
    Write("grid", grid);
  }
  ~HeadFiles() { std::filesystem::remove_all(folder_); }
  HeadFiles(const HeadFiles&) = delete;
  HeadFiles& operator=(const HeadFiles&) = delete;

  std::string Names() const { return fmt::format("'{0}/points' '{0}/grid'", folder_.string()); }

 private:
  void Write(const char* name, const std::vector<double>& values) const {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof(double)));
  }

  std::filesystem::path folder_ = [] {
    std::string name = (std::filesystem::temp_directory_path() / "fit_bench_XXXXXX").string();
    return std::filesystem::path(mkdtemp(name.data()) == nullptr ? "" : name);
  }();
};

// What a peer's program says: seconds, RMS, largest distance; NaN if it cannot be run.
Measured AskPeer(const std::string& command) {
  Measured measured;
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) {
    return measured;
  }
  const int read =
      std::fscanf(pipe, "%lf %lf %lf", &measured.seconds, &measured.rms_mm, &measured.largest_mm);
  return pclose(pipe) == 0 && read == 3 ? measured : Measured{};
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
  const HeadFiles files(100000);
  // The system's Python: another one that comes first does not see Debian's packages.
  const bool scipy = std::system("/usr/bin/python3 -c 'import scipy.interpolate' 2>/dev/null") == 0;
  PrintAgainst("fitpack", ours,
               scipy ? AskPeer(fmt::format("/usr/bin/python3 '{}' {} 64", SEMBLANCE_FITPACK_PEER,
                                           files.Names()))
                     : Measured{},
               50, "python3-scipy");
#ifdef SEMBLANCE_ITK_PEER
  PrintAgainst("itk", ours, AskPeer(fmt::format("'{}' {} 8", SEMBLANCE_ITK_PEER, files.Names())),
               kNaN, "libinsighttoolkit5-dev");
#else
  PrintAgainst("itk", ours, {}, kNaN, "libinsighttoolkit5-dev");
#endif
}

}  // namespace semblance::bench
