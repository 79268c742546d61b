// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/propose/propose_landmarks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "problems/propose/site_rules.h"
#include "problems/propose/skull_warp.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_check.h"

namespace semblance {
namespace {

// What the references and their mirror images say of one site.
struct Opinions {
  std::vector<Vec3> points;
  std::vector<double> piece_misfits_mm;
  int references = 0;
  double site_error_mm = kNaN;  // least of them
};

double Median(const std::vector<double>& values) { return Quantile(SortedValues(values), 0.5); }

Vec3 Median(const std::vector<Vec3>& points) {
  Vec3 median;
  for (int i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (const Vec3& p : points) {
      values.push_back(p[i]);
    }
    median[i] = Median(values);
  }
  return median;
}

double Spread_mm(const std::vector<Vec3>& points, const Vec3& middle) {
  double squares = 0;
  for (const Vec3& p : points) {
    squares += (p - middle).squaredNorm() / static_cast<double>(points.size());
  }
  return std::sqrt(squares);
}

// Maxwell's distribution: the length of a normal error with the rms `rms_mm`, at 3 mm.
double ChanceWithin3mm(double rms_mm) {
  const double x = 3 / (rms_mm / std::sqrt(3.0));
  return std::erf(x / std::sqrt(2.0)) - std::sqrt(2 / std::numbers::pi) * x * std::exp(-x * x / 2);
}

class Proposer {
 public:
  Proposer(const TriMesh& skull, const std::string& name, std::span<const ReferenceHead> references,
           const RunContext& context)
      : name_(name),
        references_(references),
        context_(context),
        bone_(skull),
        shell_(MakeShell(skull, name, context.threads)) {}

  Proposal Run() {
    ChoosePose();
    context_.Report("warp");
    CarryAll();
    const Mat3 turned = FitOf(PredictedSites()).skull_from_average.rotation;
    for (const Site& site : StandardSites()) {
      if (const auto found = opinions_.find(site.code); found != opinions_.end()) {
        Settle(site.code, found->second, turned);
      }
    }
    CheckSides();
    return std::move(proposal_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}", name_, what));
  }

  void ChoosePose() {
    context_.Report("pose");
    for (const ReferenceHead& head : references_) {
      const SkullPose pose = FindPose(head.shell, shell_, context_.threads);
      context_.ThrowIfStopped();
      if (ComplaintAbout(pose).empty()) {
        proposal_.pose = pose;
        return;
      }
      proposal_.pose = pose;
    }
    Fail(ComplaintAbout(proposal_.pose));
  }

  // Each reference twice: as it is, and mirrored.
  void CarryAll() {
    std::vector<std::vector<WarpedSite>> carried(2 * references_.size());
    ParallelFor(carried.size(), context_.threads, 1, [&](std::size_t k) {
      const ReferenceHead& head = references_[k / 2];
      carried[k] = k % 2 == 0 ? Carry(head) : Carry(Mirrored(head));
    });
    for (std::size_t k = 0; k < carried.size(); ++k) {
      for (const WarpedSite& s : carried[k]) {
        Opinions& opinions = opinions_[s.site];
        opinions.points.push_back(s.point);
        opinions.piece_misfits_mm.push_back(s.piece_misfit_mm);
        opinions.references += k % 2 == 0;
        opinions.site_error_mm =
            std::fmin(opinions.site_error_mm, references_[k / 2].site_error_mm);
      }
    }
  }

  std::vector<WarpedSite> Carry(const ReferenceHead& head) const {
    const Similarity pose = FacePose(head, shell_, proposal_.pose.skull_from_reference);
    return CarrySites(head, shell_, pose, WarpOnto(head, shell_, pose));
  }

  std::vector<SitePoint> PredictedSites() const {
    std::vector<SitePoint> sites;
    for (const auto& [site, opinions] : opinions_) {
      sites.push_back({site, Median(opinions.points)});
    }
    return sites;
  }

  SkullFit FitOf(const std::vector<SitePoint>& sites, Handedness hand = Handedness::kAsIs) const {
    constexpr std::size_t kFewest = 6;
    if (sites.size() < kFewest) {
      Fail(
          fmt::format("only {} sites are found, and {} are needed to know the sides; add a "
                      "--reference that has more of this skull's sites",
                      sites.size(), kFewest));
    }
    return FitAverageSkull(sites, hand);
  }

  void Settle(const std::string& site, const Opinions& opinions, const Mat3& turned) {
    constexpr double kNoBone_mm = 8;
    const Vec3 predicted = Median(opinions.points);
    const SnappedSite snapped = SnapToBone(site, predicted, shell_, turned);
    if (snapped.from_bone_mm > kNoBone_mm) {
      proposal_.absent.push_back(
          {site, fmt::format("no bone within {} mm of where it is predicted: the nearest is {:.0f} "
                             "mm away",
                             kNoBone_mm, snapped.from_bone_mm)});
      return;
    }
    ProposedSite found{.site = site,
                       .point = bone_.Closest(snapped.point).position,
                       .predicted = predicted,
                       .references = opinions.references,
                       .agreement_mm = Spread_mm(opinions.points, predicted),
                       .piece_misfit_mm = Median(opinions.piece_misfits_mm),
                       .from_bone_mm = snapped.from_bone_mm,
                       .sharpness_mm = snapped.sharpness_mm};
    Judge(opinions, found);
    proposal_.sites.push_back(found);
  }

  static void Judge(const Opinions& opinions, ProposedSite& site) {
    constexpr double kNoMatch_mm = 5;  // in place of a misfit where too little bone is there
    const auto square = [](double x) { return x * x; };
    const double misfit_mm =
        std::isfinite(site.piece_misfit_mm) ? site.piece_misfit_mm : kNoMatch_mm;
    site.expected_error_mm =
        std::sqrt(square(opinions.site_error_mm) / opinions.references +
                  square(site.agreement_mm) / static_cast<double>(opinions.points.size()) +
                  square(misfit_mm) + square(site.from_bone_mm) + square(site.sharpness_mm / 2));
    site.confidence = ChanceWithin3mm(site.expected_error_mm);
  }

  // Rotations are proper all the way, so sides can be exchanged only if a shape was mistaken.
  void CheckSides() {
    std::vector<SitePoint> sites;
    for (const ProposedSite& s : proposal_.sites) {
      sites.push_back({s.site, s.point});
    }
    const SkullFit fit = FitOf(sites);
    proposal_.skull_from_average = fit.skull_from_average;
    const Vec3 left = fit.skull_from_average.rotation.col(0);
    const bool exchanged = std::ranges::any_of(proposal_.sites, [&](const ProposedSite& s) {
      const auto other = std::ranges::find(proposal_.sites, MirrorOf(s.site), &ProposedSite::site);
      return SideOfSite(s.site) == Side::kLeft && other != proposal_.sites.end() &&
             left.dot(s.point - other->point) <= 0;
    });
    if (exchanged || FitOf(sites, Handedness::kMirrored).median_mm < fit.median_mm) {
      Fail(
          "left and right came out exchanged, so the skull was not recognised; add one like it as "
          "--reference, or place the landmarks by hand");
    }
    TellAxes();
  }

  void TellAxes() {
    constexpr double kMost_deg = 60;
    const Mat3& turned = proposal_.skull_from_average.rotation;
    const auto degrees = [](const Mat3& r) {
      return Eigen::AngleAxisd(r).angle() * 180 / std::numbers::pi;
    };
    const Mat3 ras = Vec3(-1, -1, 1).asDiagonal();
    if (degrees(turned) <= kMost_deg) {
      return;
    }
    if (degrees(ras * turned) <= kMost_deg) {
      proposal_.axes = "RAS";
      proposal_.notes.push_back(fmt::format(
          "{}: the face looks to +y: the skull is RAS, and so are the proposed points (`axes: "
          "RAS`); say `axes: RAS` under `subject` too",
          name_));
      return;
    }
    const Vec3 front = turned * Vec3(0, -1, 0), up = turned * Vec3(0, 0, 1);
    proposal_.notes.push_back(fmt::format(
        "{}: the face looks to ({:.1f}, {:.1f}, {:.1f}) and its top to ({:.1f}, {:.1f}, {:.1f}); "
        "turn the skull so that it looks to -y and its top to +z (LPS), then propose again",
        name_, front.x(), front.y(), front.z(), up.x(), up.y(), up.z()));
  }

  const std::string& name_;
  std::span<const ReferenceHead> references_;
  const RunContext& context_;
  MeshQuery bone_;
  SkullShell shell_;
  std::map<std::string, Opinions> opinions_;
  Proposal proposal_;
};

Certainty CertaintyOf(const ProposedSite& site) {
  constexpr double kHigh = 0.6, kMedium = 0.3;
  return site.confidence >= kHigh     ? Certainty::kHigh
         : site.confidence >= kMedium ? Certainty::kMedium
                                      : Certainty::kLow;
}

std::string NoteOf(const ProposedSite& site) {
  return fmt::format(
      "proposed, {:.0f} % sure to 3 mm: {} agree within {:.1f} mm, bone around it fits within {}; "
      "rule ({}) moved it by {:.1f} mm and is sharp to {:.1f} mm",
      100 * site.confidence,
      site.references == 1 ? "1 reference and its mirror image"
                           : fmt::format("{} references", site.references),
      site.agreement_mm,
      std::isfinite(site.piece_misfit_mm) ? fmt::format("{:.1f} mm", site.piece_misfit_mm)
                                          : "no measure (too little is there)",
      RuleOf(site.site).what, (site.point - site.predicted).norm(), site.sharpness_mm);
}

}  // namespace

Proposal ProposeLandmarks(const TriMesh& skull, const std::string& name,
                          std::span<const ReferenceHead> references, const RunContext& context) {
  if (references.empty()) {
    throw InputError("landmarks cannot be proposed without a reference; give at least one");
  }
  std::vector<std::string> notes = CheckHeadMesh(skull, name);
  Proposal proposal = Proposer(skull, name, references, context).Run();
  proposal.notes.insert(proposal.notes.begin(), notes.begin(), notes.end());
  return proposal;
}

LandmarkFile ProposalFile(const Proposal& proposal, const std::string& subject) {
  LandmarkFile file;
  file.subject = subject;
  file.axes = proposal.axes;
  file.proposed = true;
  file.absent = proposal.absent;
  for (const ProposedSite& site : proposal.sites) {
    Landmark landmark;
    landmark.site = site.site;
    landmark.point = {site.point.x(), site.point.y(), site.point.z()};
    landmark.certainty = CertaintyOf(site);
    landmark.note = NoteOf(site);
    file.landmarks.push_back(landmark);
  }
  return file;
}

}  // namespace semblance
