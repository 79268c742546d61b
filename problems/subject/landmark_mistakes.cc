// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_mistakes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>

#include "interp/schemes/people.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/mandible.h"
#include "problems/subject/sites.h"
#include "problems/subject/tissue_table.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

// Median residual up to which sites can be those of a skull. The three measured skulls differ by up
// to 8 mm; a lower limit would take odd skulls for mistakes, a higher one would miss mistakes.
constexpr double kMaxMedianResidual_mm = 12;
constexpr double kMinSkullScale = 0.7,
                 kMaxSkullScale = 1.4;  // size of a skull relative to the average one

// The landmarks' points, standard sites first.
std::vector<SitePoint> StandardFirst(const LandmarkFile& file) {
  std::vector<SitePoint> sites = file.Points();
  std::stable_partition(sites.begin(), sites.end(),
                        [](const SitePoint& point) { return IsStandardSite(point.site); });
  return sites;
}

// Standard deviations of x and y, and their correlation (Pearson); NaN for fewer than two pairs, or
// if one does not vary.
struct PairStatistics {
  double sd_x = kNaN, sd_y = kNaN, correlation = kNaN;
};
PairStatistics Describe(std::span<const std::array<double, 2>> pairs) {
  if (pairs.size() < 2) {
    return {};
  }
  Eigen::ArrayX2d values(std::ssize(pairs), 2);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    values.row(static_cast<Eigen::Index>(k)) << pairs[k][0], pairs[k][1];
  }
  values.rowwise() -= values.colwise().mean().eval();
  const Eigen::Array2d sd = values.square().colwise().mean().sqrt().transpose();
  return {sd[0], sd[1], values.rowwise().prod().mean() / sd.prod()};
}

// Erases pairs whose x - y is far from that of half of the pairs: x and y are logarithms, and a
// depth that is ten times too large or small has another unit, which another note states. Depths of
// 72 heads are at most 6.7 times as far from people's mean as half of the head's depths are.
void EraseOtherUnits(std::vector<std::array<double, 2>>& pairs) {
  constexpr double kFar = 2.3;  // factor 10
  std::vector<double> ratios;
  for (const auto& [x, y] : pairs) {
    ratios.push_back(x - y);
  }
  if (!ratios.empty()) {
    const double middle = UpperMedian(ratios);
    std::erase_if(pairs,
                  [&](const auto& pair) { return std::abs(pair[0] - pair[1] - middle) > kFar; });
  }
}

class MistakeSearch {
 public:
  MistakeSearch(const LandmarkFile& file, const TriMesh& skull, const MeshQuery& query,
                const PlaceOptions& options)
      : file_(file),
        skull_(skull),
        query_(query),
        options_(options),
        sites_(StandardFirst(file)),
        standard_(std::span(sites_).first(static_cast<std::size_t>(
            std::ranges::count_if(sites_, IsStandardSite, &SitePoint::site)))),
        label_(file.subject.empty() ? "landmarks" : fmt::format("landmarks of {}", file.subject)) {
    for (const SitePoint& s : sites_) {
      air_mm_.push_back(query.Closest(s.point).distance_mm);
    }
  }

  InputMistakes Run() {
    if (FindSamePoints()) {
      return std::move(found_);
    }
    if (standard_.size() >= 6) {
      fit_ = FitAverageSkull(standard_);
    }
    if (!(fit_ && (HasAnotherFrame() || IsNoSkull() || HasOpenMandible()))) {
      if (fit_) {
        FindSitesFarOff();
        NoteReversedSites();
        NoteAsymmetry();
        if (!NoteDepthOrder()) {  // which may explain the others
          if (!NoteUnevenDepths()) {
            NoteUnevenPairs();
          }
          NoteDepthLevel();
        }
        NoteProportions();
      }
      NoteOffset();
      if (!MandibleIsMissing()) {
        FindSitesInTheAir();
      }
      NoteMissingMandible();
    }
    return std::move(found_);
  }

 private:
  // Adds an error and returns true, so that a check can return it.
  template <class... Args>
  bool Error(fmt::format_string<Args...> format, Args&&... args) {
    found_.errors.push_back(
        fmt::format("{}: {}", label_, fmt::format(format, std::forward<Args>(args)...)));
    return true;
  }

  bool FindSamePoints() {
    Box3 box;
    for (const SitePoint& s : sites_) {
      box.extend(s.point);
    }
    const double same_mm = SamePoint_mm(box);
    std::vector<bool> listed(sites_.size(), false);
    for (std::size_t i = 0; i < sites_.size(); ++i) {
      std::vector<std::string> same = {DescribeSite(sites_[i].site)};
      for (std::size_t j = i + 1; j < sites_.size(); ++j) {
        if (!listed[j] && (sites_[i].point - sites_[j].point).norm() <= same_mm) {
          same.push_back(DescribeSite(sites_[j].site));
          listed[j] = true;
        }
      }
      if (same.size() > 1) {
        Error("sites {} have the same point; place all but one of them again",
              fmt::join(same, ", "));
      }
    }
    return !found_.errors.empty();
  }

  std::optional<FoundChange> BestChange() const {
    std::vector<Vec3> points;
    for (const SitePoint& s : sites_) {
      points.push_back(s.point);
    }
    return FindForgottenChange(
        points, query_, Bounds(skull_).center(), options_.max_distance_mm,
        [this](const FrameChange& change) { return HasSkullSize(change.factor); });
  }

  // Says which of the two files is in another frame or unit. skull = change(landmarks).
  std::string Remedy(const FrameChange& change) const {
    if (change.mirrored) {
      return "either the landmarks or the skull is a mirror image; take both from the same volume";
    }
    std::string remedy;
    if (change.factor != 1) {
      const char* const unit = change.factor == Millimetres(LengthUnit::kCentimetre) ? "cm"
                               : change.factor == Millimetres(LengthUnit::kInch)     ? "in"
                                                                                     : "m";
      remedy = fmt::format(
          "the landmark file is not in mm; write `units: {}` in it (in YAML, which `semblance "
          "landmarks convert` writes)",
          unit);
    }
    if (change.turned) {
      remedy += (remedy.empty() ? "" : "; ") + FrameRemedy(change.linear / change.factor);
    }
    return remedy;
  }

  std::string FrameRemedy(const Mat3& skull_from_landmarks) const {
    if (skull_from_landmarks == Mat3(Vec3(-1, -1, 1).asDiagonal())) {
      return "one of the files is RAS and the other LPS; write `axes: RAS` for the one that is "
             "RAS, in the landmark file or under `subject`";
    }
    const bool landmarks_are_lps =
        FindPoseAxes(fit_->skull_from_average.rotation) == PoseAxes::kLps;
    return landmarks_are_lps
               ? "the landmarks are LPS, and the skull " + DescribeFrame(skull_from_landmarks)
               : "the landmark file " + DescribeFrame(skull_from_landmarks.inverse());
  }

  bool HasSkullSize(double factor = 1) const {
    const double scale = factor * fit_->skull_from_average.scale;
    return scale >= kMinSkullScale && scale <= kMaxSkullScale;
  }

  bool HasAnotherFrame() {
    const auto far = std::ranges::count_if(
        air_mm_, [&](double mm) { return !(mm <= options_.max_distance_mm); });
    const bool in_air = 2 * far > std::ssize(air_mm_);
    if (!in_air && HasSkullSize()) {
      return false;
    }
    std::vector<double> air_mm = air_mm_;
    const std::string where =
        in_air
            ? fmt::format("{} of {} sites are farther than {} mm from the skull (median {:.1f} mm)",
                          far, sites_.size(), options_.max_distance_mm, UpperMedian(air_mm))
            : fmt::format("the sites are those of a skull of {:.3f} times the usual size",
                          fit_->skull_from_average.scale);
    if (const std::optional<FoundChange> found = BestChange()) {
      return Error("{}; {} they fit within {:.1f} mm (median): {}", where, found->change.what,
                   found->median_mm, Remedy(found->change));
    }
    return in_air &&
           Error("{}; check that landmarks and skull share one frame and one unit", where);
  }

  // True if the sites as a whole are not those of a skull in its proper pose.
  bool IsNoSkull() {
    const SkullFit mirrored = FitAverageSkull(standard_, Handedness::kMirrored);
    if (mirrored.median_mm <= kMaxMedianResidual_mm &&
        mirrored.median_mm <= 0.6 * fit_->median_mm) {
      return Error(
          "left and right are swapped: mirrored, the sites fit an average skull within {:.1f} mm "
          "(median), and as they are within {:.1f} mm; exchange _l and _r in the landmark file, "
          "or, "
          "if the volume is a mirror image, negate x of skull, skin and landmarks",
          mirrored.median_mm, fit_->median_mm);
    }
    return HasWrongSize() || HasWrongPose();
  }

  bool HasWrongSize() {
    return !HasSkullSize() &&
           Error(
               "the skull is {:.2f} times as large as an average one ({} to {} are allowed); check "
               "the unit of skull and landmarks, and the voxels' size",
               fit_->skull_from_average.scale, kMinSkullScale, kMaxSkullScale);
  }

  bool HasWrongPose() {
    const Mat3& turned = fit_->skull_from_average.rotation;
    const PoseAxes axes = FindPoseAxes(turned);
    if (axes == PoseAxes::kLps) {
      return false;
    }
    if (axes == PoseAxes::kRas) {
      return Error(
          "the face looks to +y: with x and y negated the sites fit an average skull within {:.1f} "
          "mm (median): skull and landmarks are RAS; write `axes: RAS` under `subject` and in the "
          "landmark file",
          fit_->median_mm);
    }
    const Vec3 front = turned * Vec3(0, -1, 0), up = turned * Vec3(0, 0, 1);
    const bool y_up = up.y() > 0.8 && front.z() > 0.8;
    return Error(
        "the face looks to ({:.1f}, {:.1f}, {:.1f}) and its top to ({:.1f}, {:.1f}, {:.1f}); turn "
        "skull, skin and landmarks so that it looks to -y and its top to +z (LPS){}",
        front.x(), front.y(), front.z(), up.x(), up.y(), up.z(),
        y_up ? "; this is y up, as Blender writes OBJ by default: export with `Forward: Y` and "
               "`Up: Z`"
             : "");
  }

  bool HasOpenMandible() {
    const std::optional<JawPose> jaw = FindJawPose(standard_);
    return jaw && jaw->opening_deg > options_.max_opening_deg &&
           Error(
               "the mandible is open by {0:.0f} degrees, and at most {1} are allowed "
               "(max_opening_deg): its sites are {2:.0f} mm (median) from where the upper jaw "
               "predicts them; give the mandible as a mesh of its own and close it (`subject: "
               "{{mandible: {{mesh: ..., opening_deg: -{0:.0f}}}}}`)",
               jaw->opening_deg, options_.max_opening_deg, jaw->off_mm);
  }

  // Names another site that is predicted at this point and has no landmark near there.
  std::string SuggestExchange(const SitePoint& off) const {
    constexpr double kNear_mm = 12;  // a site this near to a predicted point may be meant for it
    for (const std::string& site : StandardSiteCodes()) {
      const auto own = std::ranges::find(sites_, site, &SitePoint::site);
      const Vec3 predicted = fit_->Predicted(site);
      const bool free = own == sites_.end() || (own->point - predicted).norm() > 2 * kNear_mm;
      if (site != off.site && free && (off.point - predicted).norm() <= kNear_mm) {
        return fmt::format("; it lies where {} is predicted, so the names may be exchanged",
                           DescribeSite(site));
      }
    }
    return "";
  }

  void FindSitesFarOff() {
    for (std::size_t k = 0; k < standard_.size(); ++k) {
      const double off_mm = fit_->residual_mm[k];
      if (off_mm > options_.max_misfit_mm) {
        Error(
            "site {} is {:.0f} mm from where the other sites predict it, and at most {} mm are "
            "allowed (max_misfit_mm); correct its point or its name{}",
            DescribeSite(sites_[k].site), off_mm, options_.max_misfit_mm,
            SuggestExchange(sites_[k]));
      }
    }
  }

  // Two sites that lie the other way round than on the average skull, by more than half of their
  // distance there. The names of sites nearer than max_misfit_mm may be exchanged without one of
  // them being far off. In 400 heads of the modes of the mean skull, with errors of 3 mm per
  // coordinate, two pairs were as far turned; without errors none was, and the three heads of
  // configs/landmarks are far from it.
  void NoteReversedSites() {
    constexpr double kNearest_mm = 10, kReversed = -0.6;
    for (std::size_t i = 0; i < standard_.size(); ++i) {
      for (std::size_t j = i + 1; j < standard_.size(); ++j) {
        const Vec3 average = AverageSite(standard_[i].site) - AverageSite(standard_[j].site),
                   own = InAverage(standard_[i].point) - InAverage(standard_[j].point);
        if (average.norm() >= kNearest_mm && own.dot(average) < kReversed * average.squaredNorm()) {
          found_.notes.push_back(fmt::format(
              "{}: sites {} and {} lie the other way round than on other skulls; look whether "
              "their "
              "names, or their points, are exchanged",
              label_, DescribeSite(standard_[i].site), DescribeSite(standard_[j].site)));
        }
      }
    }
  }

  // Sites beside the middle plane, and pairs whose mirror images lie apart. The three heads of
  // configs/landmarks have at most 6.2 mm between mirror images (a broken cheek bone) and 1.5 mm
  // beside the middle; the limits leave room for faces that grew askew.
  void NoteAsymmetry() {
    constexpr double kMostOfPair_mm = 12, kMostBeside_mm = 8;
    for (const SitePoint& s : standard_) {
      const Vec3 own = InAverage(s.point);
      const std::string other = MirroredSite(s.site);
      const auto twin = std::ranges::find(standard_, other, &SitePoint::site);
      if (other == s.site && std::abs(own.x()) > kMostBeside_mm) {
        found_.notes.push_back(
            fmt::format("{}: site {} lies {:.0f} mm beside the middle of the head; check its point",
                        label_, DescribeSite(s.site), std::abs(own.x())));
      } else if (other > s.site && twin != standard_.end()) {
        const double apart_mm = (own - InAverage(twin->point).cwiseProduct(Vec3(-1, 1, 1))).norm();
        if (apart_mm > kMostOfPair_mm) {
          found_.notes.push_back(
              fmt::format("{}: sites {} and {} are {:.0f} mm from being mirror images, and heads "
                          "have at most about 6; check both points",
                          label_, DescribeSite(s.site), DescribeSite(other), apart_mm));
        }
      }
    }
  }

  // Finds depths in rows that were shifted or sorted apart from the names: they do not grow and
  // fall from site to site as those of people. On 72 heads with measured depths the correlation of
  // log depth with people's mean is at least 0.69; with all rows of 69 of them moved by one, or of
  // each side, it is at most 0.74, and below the limit for 95 in 100. Few sites, or sites whose
  // depths hardly differ in people, as those of a forehead, correlate by chance: with at least
  // these many and this spread, one of 235 selections of sites of these heads is below the limit.
  bool NoteDepthOrder() {
    constexpr double kLeastCorrelation = 0.65, kLeastSpread = 0.4;
    constexpr std::size_t kFewest = 16;
    const auto& people = interp::CarriedPeople().sites;
    std::vector<std::array<double, 2>> depths;  // logarithms: this head's and people's mean
    for (const Landmark& landmark : file_.landmarks) {
      const auto known = people.find(landmark.site);
      if (known != people.end() && landmark.depth_along_normal_mm > 0.0) {
        depths.push_back({std::log(*landmark.depth_along_normal_mm), known->second.depth.mean});
      }
    }
    EraseOtherUnits(depths);
    const PairStatistics found = Describe(depths);
    const bool is_disordered = depths.size() >= kFewest && found.sd_y > kLeastSpread &&
                               found.correlation < kLeastCorrelation;
    if (is_disordered) {
      found_.notes.push_back(
          fmt::format("{}: the depths are not thick and thin where those of people are "
                      "(correlation {:.2f} over {} sites, and at least 0.69 for people); look "
                      "whether each depth stands at its own site: rows may be shifted or sorted",
                      label_, found.correlation, depths.size()));
    }
    return is_disordered;
  }

  // Finds shifted rows on one side alone. The median factor between left
  // and right is at most 1.34 in 56 heads on which both sides were measured; in these heads, with
  // all depths moved by one row, it exceeds the limit in about half.
  bool NoteUnevenDepths() {
    constexpr double kMostFactor = 1.45;
    constexpr std::size_t kFewest = 6;  // pairs
    std::vector<double> factors;
    for (const Landmark& left : file_.landmarks) {
      const auto right =
          std::ranges::find(file_.landmarks, MirroredSite(left.site), &Landmark::site);
      if (right != file_.landmarks.end() && left.site < right->site &&
          left.depth_along_normal_mm > 0.0 && right->depth_along_normal_mm > 0.0) {
        const double factor = *left.depth_along_normal_mm / *right->depth_along_normal_mm;
        factors.push_back(std::max(factor, 1 / factor));
      }
    }
    const bool is_uneven = factors.size() >= kFewest && UpperMedian(factors) > kMostFactor;
    if (is_uneven) {
      found_.notes.push_back(
          fmt::format("{}: the depths of left and right differ by a factor of {:.2f} (median of {} "
                      "pairs), and those of people by at most 1.35; look whether each depth stands "
                      "at its own site: rows may be shifted",
                      label_, UpperMedian(factors), factors.size()));
    }
    return is_uneven;
  }

  // Finds one depth in another unit. No pair among 376 of 54 heads (open-kbp CTs) differs by more
  // than 4.2 times, nor by more than 2.5 times and 10 mm.
  void NoteUnevenPairs() {
    constexpr double kMostFactor = 5, kLargeFactor = 2.5, kLarge_mm = 10;
    for (const Landmark& left : file_.landmarks) {
      const auto right =
          std::ranges::find(file_.landmarks, MirroredSite(left.site), &Landmark::site);
      if (right == file_.landmarks.end() || left.site >= right->site ||
          !(left.depth_along_normal_mm > 0.0) || !(right->depth_along_normal_mm > 0.0)) {
        continue;
      }
      const auto [less, more] =
          std::minmax({*left.depth_along_normal_mm, *right->depth_along_normal_mm});
      if (more > kMostFactor * less || (more > kLargeFactor * less && more - less > kLarge_mm)) {
        found_.notes.push_back(fmt::format(
            "{}: sites {} and {} have depths of {:.3g} and {:.3g} mm, which is more than two "
            "sides of one head differ; check both depths and their unit",
            label_, DescribeSite(left.site), DescribeSite(right->site), *left.depth_along_normal_mm,
            *right->depth_along_normal_mm));
      }
    }
  }

  // Finds depths that are all halved or doubled, which the limit of depth_factor (plausibility.h)
  // does not exclude. 69 heads on which depths were measured have median factors of 0.66 to 1.75
  // (docs/explanation/plausibility.md).
  void NoteDepthLevel() {
    constexpr double kLeastFactor = 0.6, kMostFactor = 1.9;
    constexpr std::size_t kFewest = 10;  // depths; fewer differ this much by chance
    std::vector<double> factors;
    for (const Landmark& landmark : file_.landmarks) {
      const auto published = FindPublishedDepth(landmark.site);
      if (published && landmark.depth_along_normal_mm > 0.0) {
        factors.push_back(*landmark.depth_along_normal_mm / published->mean_mm);
      }
    }
    if (factors.size() < kFewest) {
      return;
    }
    const double factor = UpperMedian(factors);
    if (factor < kLeastFactor || factor > kMostFactor) {
      found_.notes.push_back(fmt::format(
          "{}: the depths are {:.2f} times the published means (median of {}), and those "
          "of people 0.66 to 1.75 times; look whether all depths are scaled or in "
          "another unit",
          label_, factor, factors.size()));
    }
  }

  bool InAir(std::size_t k) const { return !(air_mm_[k] <= options_.max_distance_mm); }

  bool MandibleIsMissing() {
    int of_mandible = 0, in_air = 0, others_in_air = 0;
    for (std::size_t k = 0; k < sites_.size(); ++k) {
      const bool mandible = IsOfMandible(sites_[k].site);
      of_mandible += mandible;
      in_air += mandible && InAir(k);
      others_in_air += !mandible && InAir(k);
    }
    return in_air >= 3 && in_air == of_mandible && others_in_air == 0 &&
           Error(
               "all {} sites of the mandible are in the air, and no other is: the mandible is "
               "missing from the skull's mesh; add it, or list its sites under `absent`",
               in_air);
  }

  void FindSitesInTheAir() {
    for (std::size_t k = 0; k < sites_.size(); ++k) {
      if (InAir(k)) {
        Error(
            "site {} is {:.1f} mm from the skull, and at most {} mm are allowed "
            "(max_distance_mm); correct its point",
            DescribeSite(sites_[k].site), air_mm_[k], options_.max_distance_mm);
      }
    }
  }

  // The extents of the sites along the axes of the average skull, in parts of the average ones.
  // Each is the slope of the sites' coordinates over the average ones.
  Vec3 Proportions() const {
    const SiteBox mean = MeanSites();
    Vec3 product = Vec3::Zero(), square = Vec3::Zero();
    for (const SitePoint& s : standard_) {
      const Vec3 own = InAverage(s.point) - mean.own, average = AverageSite(s.site) - mean.average;
      product += own.cwiseProduct(average);
      square += average.cwiseAbs2();
    }
    return product.cwiseQuotient(square.cwiseMax(1e-9));
  }

  struct SiteBox {
    Vec3 own = Vec3::Zero(), average = Vec3::Zero();
  };
  SiteBox MeanSites() const {
    SiteBox mean;
    for (const SitePoint& s : standard_) {
      mean.own += InAverage(s.point) / static_cast<double>(standard_.size());
      mean.average += AverageSite(s.site) / static_cast<double>(standard_.size());
    }
    return mean;
  }

  Vec3 InAverage(const Vec3& point) const {
    const Similarity& pose = fit_->skull_from_average;
    return pose.rotation.transpose() * (point - pose.translation) / pose.scale;
  }

  // A wrong spacing of voxels stretches a head along one axis. The ratio of two axes is below 1.17
  // for 99 % of the heads that the modes of the mean skull (configs/mean_skull) describe, and above
  // 1.2 for nine in ten of these stretched by a quarter.
  void NoteProportions() {
    constexpr double kMostRatio = 1.2;
    constexpr std::size_t kFewest = 12;  // sites on all sides
    if (standard_.size() < kFewest) {
      return;
    }
    const Vec3 extents = Proportions();
    int least = 0, most = 0;
    const double ratio = extents.maxCoeff(&most) / extents.minCoeff(&least);
    if (ratio > kMostRatio) {
      static constexpr std::array kNames = {"wide", "long from front to back", "high"};
      found_.notes.push_back(fmt::format(
          "{}: compared with an average skull it is {:.2f} times as {} as it is {}, and people "
          "differ by at most about {}: check the spacing of the voxels along both directions",
          label_, ratio, kNames[most], kNames[least], kMostRatio));
    }
  }

  // Points that a person or a program lays on the bone lie on it. A common offset is a shift.
  void NoteOffset() {
    // The sites of three heads and of phantoms lie 0.003 to 0.05 mm off their own skulls (median),
    // and those of 40 other phantoms of much the same shape 0.4 mm or more.
    constexpr double kMost_mm = 0.3;
    const double most_mm = kMost_mm + SagittaOfTriangles_mm(skull_);
    std::vector<double> air_mm = air_mm_;
    if (const double median_mm = air_mm.empty() ? 0 : UpperMedian(air_mm); median_mm > most_mm) {
      found_.notes.push_back(fmt::format(
          "{}: half of the sites lie {:.1f} mm or more off the bone; check that the landmarks were "
          "placed on this surface, in its frame",
          label_, median_mm));
    }
  }

  void NoteMissingMandible() {
    constexpr double kNoBone_mm = 20;  // above the error of a predicted site
    const auto of_mandible = [](const auto& entry) { return IsOfMandible(entry.site); };
    if (!fit_ || std::ranges::any_of(sites_, of_mandible) ||
        std::ranges::any_of(file_.absent, of_mandible)) {
      return;
    }
    for (const char* site : {"pg", "go_l", "go_r"}) {
      if (query_.Closest(fit_->Predicted(site)).distance_mm <= kNoBone_mm) {
        return;
      }
    }
    found_.notes.push_back(fmt::format(
        "{}: there is no bone where chin and angles of the mandible are predicted: add the "
        "mandible to the skull's mesh, or list its sites under `absent`; the lower face is that of "
        "the generic face",
        label_));
  }

  const LandmarkFile& file_;
  const TriMesh& skull_;
  const MeshQuery& query_;
  const PlaceOptions& options_;
  std::vector<SitePoint> sites_;
  std::span<const SitePoint> standard_;  // the first of sites_; the average skull has no others
  std::string label_;
  std::vector<double> air_mm_;  // distance of each site from the bone
  std::optional<SkullFit> fit_;
  InputMistakes found_;
};

}  // namespace

double SamePoint_mm(const Box3& extent) { return std::min(0.5, 0.002 * extent.diagonal().norm()); }

InputMistakes FindLandmarkMistakes(const LandmarkFile& file, const TriMesh& skull,
                                   const MeshQuery& query, const PlaceOptions& options) {
  return MistakeSearch(file, skull, query, options).Run();
}

}  // namespace semblance::problems
