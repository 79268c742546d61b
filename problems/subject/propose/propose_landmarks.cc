// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/propose_landmarks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "problems/subject/propose/site_rules.h"
#include "problems/subject/propose/skull_warp.h"
#include "problems/subject/propose/suggestion_check.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_check.h"

namespace semblance::problems {
namespace {

// The predictions of the references and their mirror images for one site.
struct PredictionsPerReference {
  std::vector<Vec3> points;
  std::vector<double> piece_misfits_mm;
  int references = 0;
  double site_error_mm = kNaN;  // the least of the references
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

// The probability that a normal error of the rms length `rms_mm` is within 3 mm (Maxwell's
// distribution).
double ChanceWithin3mm(double rms_mm) {
  const double x = 3 / (rms_mm / std::sqrt(3.0));
  return std::erf(x / std::sqrt(2.0)) - std::sqrt(2 / std::numbers::pi) * x * std::exp(-x * x / 2);
}

class Proposer {
 public:
  Proposer(const TriMesh& skull, const std::string& name, std::span<const SitePoint> known,
           SkullLies lies, const RunContext& context)
      : name_(name),
        known_(known),
        lies_(lies),
        context_(context),
        bone_(skull),
        skull_(skull),
        ends_(skull),
        shell_(MakeShell(skull, name, context.threads)) {}

  Proposal RunWith(std::span<const ReferenceHead> references) {
    references_ = references;
    ChoosePose();
    context_.Report("warp");
    CarryAll();
    return PlaceAll();
  }

  Proposal RunWith(const MeanSkull& mean) {
    references_ = {&mean.head, 1};
    ChoosePose();
    context_.Report("warp");
    const AdaptedSkull adapted =
        AdaptMeanSkull(mean, shell_, proposal_.pose.skull_from_reference, known_);
    references_ = {&adapted.head, 1};
    proposal_.pose.skull_from_reference = adapted.skull_from_head;
    const ThinPlate plate = WarpOnto(adapted.head, shell_, adapted.skull_from_head, known_);
    AddPredictions(adapted.head, CarrySites(adapted.head, shell_, adapted.skull_from_head, plate));
    return PlaceAll();
  }

 private:
  Proposal PlaceAll() {
    const Mat3 rotation = FitSites(MedianSites()).skull_from_average.rotation;
    for (const Site& site : StandardSites()) {
      const auto found = predictions_.find(site.code);
      if (found != predictions_.end() && !IsKnown(site.code)) {
        PlaceSite(site.code, found->second, rotation);
      }
    }
    CheckSides();
    FindAxes();
    return std::move(proposal_);
  }

  bool IsKnown(const std::string& site) const {
    return std::ranges::find(known_, site, &SitePoint::site) != known_.end();
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}", name_, what));
  }

  void ChoosePose() {
    context_.Report("pose");
    if (known_.size() >= 3) {
      proposal_.pose.skull_from_reference = PoseFromKnown();
      return;
    }
    for (const ReferenceHead& head : references_) {
      const SkullPose pose = FindPose(head.shell, shell_, context_.threads, lies_);
      context_.ThrowIfStopped();
      if (PoseFault(pose).empty()) {
        proposal_.pose = pose;
        return;
      }
      proposal_.pose = pose;
    }
    Fail(PoseFault(proposal_.pose));
  }

  // The average skull's frame is also that of the references, except for their size.
  Similarity PoseFromKnown() const {
    constexpr double kMaxMisfit_mm = 8;  // of two different skulls, 4; of two that are apart, 15
    const ReferenceHead& head = references_.front();
    const Similarity pose = FacePose(head, shell_, FitAverageSkull(known_).skull_from_average);
    const double misfit_mm = PoseMisfit_mm(head.shell, shell_, pose);
    if (!(misfit_mm < kMaxMisfit_mm)) {
      Fail(
          fmt::format("a skull that lies as the {} given landmarks say is off by {:.0f} mm (mean "
                      "distance); check these landmarks and their sides, then propose again",
                      known_.size(), misfit_mm));
    }
    return pose;
  }

  // Carries the sites of each reference twice: as it is, and mirrored.
  void CarryAll() {
    std::vector<std::vector<WarpedSite>> carried(2 * references_.size());
    ParallelFor(carried.size(), context_.threads, 1, [&](std::size_t k) {
      const ReferenceHead& head = references_[k / 2];
      carried[k] = k % 2 == 0 ? Carry(head) : Carry(Mirrored(head));
    });
    for (std::size_t k = 0; k < carried.size(); ++k) {
      AddPredictions(references_[k / 2], carried[k]);
      for (const WarpedSite& s : carried[k]) {
        predictions_[s.site].references -= k % 2 == 1;  // the mirror image is no second reference
      }
    }
  }

  void AddPredictions(const ReferenceHead& head, const std::vector<WarpedSite>& carried) {
    for (const WarpedSite& s : carried) {
      PredictionsPerReference& predictions = predictions_[s.site];
      predictions.points.push_back(s.point);
      predictions.piece_misfits_mm.push_back(s.piece_misfit_mm);
      ++predictions.references;
      predictions.site_error_mm = std::fmin(predictions.site_error_mm, head.SiteError_mm(s.site));
    }
  }

  std::vector<WarpedSite> Carry(const ReferenceHead& head) const {
    const Similarity pose = FacePose(head, shell_, proposal_.pose.skull_from_reference);
    return CarrySites(head, shell_, pose, WarpOnto(head, shell_, pose, known_));
  }

  std::vector<SitePoint> MedianSites() const {
    std::vector<SitePoint> sites;
    for (const auto& [site, predictions] : predictions_) {
      sites.push_back({site, Median(predictions.points)});
    }
    return sites;
  }

  SkullFit FitSites(std::vector<SitePoint> sites, Handedness hand = Handedness::kAsIs) const {
    constexpr std::size_t kMinSites = 6;  // as FindLandmarkMistakes
    std::erase_if(sites, [&](const SitePoint& s) { return IsKnown(s.site); });
    sites.insert(sites.end(), known_.begin(), known_.end());
    if (sites.size() < kMinSites) {
      Fail(
          fmt::format("only {} sites are found, and {} are needed to tell left from right; add a "
                      "--reference that has more of this skull's sites",
                      sites.size(), kMinSites));
    }
    return FitAverageSkull(sites, hand);
  }

  void PlaceSite(const std::string& site, const PredictionsPerReference& predictions,
                 const Mat3& rotation) {
    constexpr double kNoBone_mm = 8;  // a prediction so far from bone has no site on this skull
    const Vec3 predicted = Median(predictions.points);
    const SnappedSite snapped = SnapToBone(site, predicted, shell_, rotation);
    if (snapped.from_bone_mm > kNoBone_mm) {
      proposal_.absent.push_back(
          {site,
           fmt::format("no bone within {} mm of the predicted point: the nearest is {:.0f} mm "
                       "away",
                       kNoBone_mm, snapped.from_bone_mm)});
      return;
    }
    const Vec3 outward = rotation * AverageDirection(site);
    Vec3 point = bone_.Closest(snapped.point).position;
    if (const std::string fault = SuggestionFault(point, outward, {skull_, bone_, ends_});
        !fault.empty()) {
      const auto outer = FindOuterPoint(predicted, outward, {skull_, bone_, ends_});
      if (!outer || (*outer - predicted).norm() > kNoBone_mm) {
        proposal_.absent.push_back({site, fault});
        return;
      }
      point = *outer;
    }
    ProposedSite found{.site = site,
                       .point = point,
                       .direction = SuggestedDirection(point, outward, {skull_, bone_, ends_}),
                       .predicted = predicted,
                       .references = predictions.references,
                       .predictions = static_cast<int>(predictions.points.size()),
                       .agreement_mm = Spread_mm(predictions.points, predicted),
                       .piece_misfit_mm = Median(predictions.piece_misfits_mm),
                       .from_bone_mm = snapped.from_bone_mm,
                       .sharpness_mm = snapped.sharpness_mm};
    EstimateError(predictions, found);
    proposal_.sites.push_back(found);
  }

  static void EstimateError(const PredictionsPerReference& predictions, ProposedSite& site) {
    constexpr double kNoMatch_mm = 5;  // replaces the misfit if too little bone has a match
    const auto square = [](double x) { return x * x; };
    const double misfit_mm =
        std::isfinite(site.piece_misfit_mm) ? site.piece_misfit_mm : kNoMatch_mm;
    site.expected_error_mm =
        std::sqrt(square(predictions.site_error_mm) / predictions.references +
                  square(site.agreement_mm) / static_cast<double>(predictions.points.size()) +
                  square(misfit_mm) + square(site.from_bone_mm) + square(site.sharpness_mm / 2));
    site.confidence = ChanceWithin3mm(site.expected_error_mm);
  }

  // All rotations are proper, so the sides can be exchanged only if a shape was mistaken.
  void CheckSides() {
    std::vector<SitePoint> sites;
    for (const ProposedSite& s : proposal_.sites) {
      sites.push_back({s.site, s.point});
    }
    const SkullFit fit = FitSites(sites);
    proposal_.skull_from_average = fit.skull_from_average;
    const Vec3 left = fit.skull_from_average.rotation.col(0);
    const bool exchanged = std::ranges::any_of(proposal_.sites, [&](const ProposedSite& s) {
      const auto other =
          std::ranges::find(proposal_.sites, MirroredSite(s.site), &ProposedSite::site);
      return SideOfSite(s.site) == Side::kLeft && other != proposal_.sites.end() &&
             left.dot(s.point - other->point) <= 0;
    });
    if (exchanged || FitSites(sites, Handedness::kMirrored).median_mm < fit.median_mm) {
      Fail(
          "left and right came out exchanged, so the skull was not recognised; add one like it as "
          "--reference, or place the landmarks by hand");
    }
  }

  // Concludes the axes of the skull's file from its pose; a note asks to turn a skull that is
  // oblique.
  void FindAxes() {
    const Mat3& turned = proposal_.skull_from_average.rotation;
    const PoseAxes axes = FindPoseAxes(turned);
    if (axes == PoseAxes::kLps) {
      return;
    }
    if (axes == PoseAxes::kRas) {
      proposal_.axes = "RAS";
      proposal_.notes.push_back(fmt::format(
          "{}: the face looks to +y: the skull is RAS, and so are the proposed points (`axes: "
          "RAS`); write `axes: RAS` under `subject` too",
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
  std::span<const SitePoint> known_;
  SkullLies lies_;
  std::span<const ReferenceHead> references_;
  const RunContext& context_;
  MeshQuery bone_;
  const TriMesh& skull_;
  SurfaceEnds ends_;
  SkullShell shell_;
  std::map<std::string, PredictionsPerReference> predictions_;  // by site
  Proposal proposal_;
};

Certainty GradeCertainty(const ProposedSite& site) {
  constexpr double kHigh = 0.6, kMedium = 0.3;  // probabilities to be within 3 mm
  return site.confidence >= kHigh     ? Certainty::kHigh
         : site.confidence >= kMedium ? Certainty::kMedium
                                      : Certainty::kLow;
}

std::string DescribeSources(const ProposedSite& site) {
  const std::string agree = fmt::format("agree within {:.1f} mm", site.agreement_mm);
  return site.predictions == 1  ? "by the mean skull"
         : site.references == 1 ? "1 reference and its mirror image " + agree
                                : fmt::format("{} references {}", site.references, agree);
}

std::string ExplainConfidence(const ProposedSite& site) {
  return fmt::format(
      "proposed, {:.0f} % likely within 3 mm: {}, bone around it fits within {}; rule ({}) moved "
      "it by {:.1f} mm and is sharp to {:.1f} mm",
      100 * site.confidence, DescribeSources(site),
      std::isfinite(site.piece_misfit_mm) ? fmt::format("{:.1f} mm", site.piece_misfit_mm)
                                          : "an unknown distance (too little bone is there)",
      FindSiteRule(site.site).what, (site.point - site.predicted).norm(), site.sharpness_mm);
}

SiteDifference CompareSite(const std::string& site, const Landmark* proposed,
                           const Landmark* placed) {
  SiteDifference difference;
  difference.site = site;
  if (proposed != nullptr && placed != nullptr) {
    difference.error_mm = (proposed->Position() - placed->Position()).norm();
    difference.proposed = proposed->certainty;
  } else {
    difference.remark = proposed != nullptr ? "proposed, and not placed by hand"
                                            : "placed by hand, and not proposed";
  }
  return difference;
}

}  // namespace

Proposal ProposeLandmarks(const TriMesh& skull, const std::string& name,
                          std::span<const ReferenceHead> references, const RunContext& context,
                          std::span<const SitePoint> known, SkullLies lies) {
  if (references.empty()) {
    throw InputError("landmarks cannot be proposed without a reference; give at least one");
  }
  std::vector<std::string> notes = CheckHeadMesh(skull, name);
  Proposal proposal = Proposer(skull, name, known, lies, context).RunWith(references);
  proposal.notes.insert(proposal.notes.begin(), notes.begin(), notes.end());
  return proposal;
}

Proposal ProposeLandmarks(const TriMesh& skull, const std::string& name, const MeanSkull& mean,
                          const RunContext& context, std::span<const SitePoint> known,
                          SkullLies lies) {
  std::vector<std::string> notes = CheckHeadMesh(skull, name);
  Proposal proposal = Proposer(skull, name, known, lies, context).RunWith(mean);
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
    landmark.MoveTo(site.point);
    landmark.normal = {site.direction.x(), site.direction.y(), site.direction.z()};
    landmark.certainty = GradeCertainty(site);
    landmark.doubt_mm = site.expected_error_mm;
    landmark.note = ExplainConfidence(site);
    file.landmarks.push_back(landmark);
  }
  return file;
}

ProposalComparison CompareProposal(const LandmarkFile& proposal, const LandmarkFile& placed) {
  ProposalComparison comparison;
  std::vector<double> errors_mm;
  for (const std::string& site : StandardSiteCodes()) {
    const Landmark* const a = proposal.Find(site);
    const Landmark* const b = placed.Find(site);
    if (a != nullptr || b != nullptr) {
      comparison.sites.push_back(CompareSite(site, a, b));
      errors_mm.push_back(comparison.sites.back().error_mm);
    }
  }
  const std::vector<WeightedValue> sorted = SortedValues(errors_mm);
  if (sorted.empty()) {
    throw InputError("the landmarks to compare with and the proposal have no site in common");
  }
  comparison.compared = static_cast<int>(sorted.size());
  comparison.median_mm = Quantile(sorted, 0.5);
  comparison.nine_tenths_mm = Quantile(sorted, 0.9);
  comparison.most_mm = Quantile(sorted, 1);
  return comparison;
}

std::string FormatComparison(const ProposalComparison& comparison) {
  std::string text = fmt::format("{:<7} {:>8}  {}\n", "site", "error mm", "proposed as");
  for (const SiteDifference& s : comparison.sites) {
    text += s.remark.empty()
                ? fmt::format("{:<7} {:>8.1f}  {}\n", s.site, s.error_mm,
                              EnumNames(s.proposed)[static_cast<std::size_t>(s.proposed)])
                : fmt::format("{:<7} {:>8}  {}\n", s.site, "", s.remark);
  }
  return text + fmt::format("{} sites: median {:.1f} mm, 90 % within {:.1f} mm, most {:.1f} mm\n",
                            comparison.compared, comparison.median_mm, comparison.nine_tenths_mm,
                            comparison.most_mm);
}

}  // namespace semblance::problems
