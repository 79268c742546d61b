// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/identify_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "problems/experiment/experiment_config.h"
#include "problems/face/template_source.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;
using KnownFaces = std::vector<KnownFace>;

// The triangles whose three corners are outer skin, to which distances are measured.
TriMesh OuterPart(const TriMesh& skin, const FaceRegion& region) {
  if (region.outer.empty()) {
    return skin;
  }
  std::vector<bool> keep;
  for (const auto& [a, b, c] : skin.triangles) {
    keep.push_back(region.outer[a] && region.outer[b] && region.outer[c]);
  }
  return Submesh(skin, keep);
}

// The points of the skin in front of the landmarks. Landmarks without skin in front are left out.
SkinPoints PointsOn(const std::vector<Dowel>& dowels, const std::vector<SiteError>& sites,
                    double SiteError::*depth_mm) {
  SkinPoints points;
  for (const SiteError& s : sites) {
    const auto dowel = std::ranges::find(dowels, s.site, &Dowel::site);
    if (dowel != dowels.end() && std::isfinite(s.*depth_mm)) {
      points.emplace_back(s.site, dowel->base + s.*depth_mm * dowel->direction);
    }
  }
  return points;
}

// The cache key of a gallery.
std::string GalleryKey(const std::vector<GalleryEntry>& gallery) {
  std::string text;
  for (const GalleryEntry& entry : gallery) {
    text += entry.name + "\n" + WriteConfig(entry.experiment);
  }
  return text;
}

std::shared_ptr<const KnownFaces> MakeGallery(const std::vector<GalleryEntry>& gallery,
                                              const RunContext& context, StageCache& cache) {
  return cache.Get<KnownFaces>("gallery\n" + GalleryKey(gallery), [&] {
    KnownFaces faces;
    for (const GalleryEntry& entry : gallery) {
      faces.push_back(MakeKnownFace(entry, context));
    }
    return faces;
  });
}

Match MakeMatch(const std::vector<double>& distances_mm, std::size_t own) {
  Match match{.rank = FindRank(distances_mm, own), .own_mm = distances_mm[own]};
  for (std::size_t k = 0; k < distances_mm.size(); ++k) {
    if (k != own) {
      match.best_other_mm = std::fmin(match.best_other_mm, distances_mm[k]);
    }
  }
  return match;
}

// Distances of a face from everyone in the gallery.
struct Distances {
  std::vector<double> surface_mm, landmarks_mm;

  ProbeMatch MatchWith(std::size_t own) const {
    return {.surface = MakeMatch(surface_mm, own), .landmarks = MakeMatch(landmarks_mm, own)};
  }
};

Distances Compare(const ProbeFace& probe, const KnownFaces& gallery, const RunContext& context) {
  Distances distances;
  for (const KnownFace& known : gallery) {
    const FaceDistance distance = MeasureFaceDistance(probe, known, context);
    distances.surface_mm.push_back(distance.surface_mm);
    distances.landmarks_mm.push_back(distance.landmarks_mm);
    context.ThrowIfStopped();
  }
  return distances;
}

ProbeFace Approximation(const RunResult& run) {
  const std::vector<Dowel>& dowels = run.subject.dowels_on_bone;
  const TriMesh& face = run.face.mesh;
  return {.mesh = face,
          .points = PointsOn(dowels, MeasureSites(face, face, dowels), &SiteError::face_mm)};
}

ProbeFace GenericFace(const Experiment& experiment) {
  const TemplateFace face = LoadTemplate(experiment.face_template);
  ProbeFace probe{.mesh = Tessellate(face.surface, kFaceQuadsPerPatch).mesh, .points = {}};
  for (const auto& [site, uv] : face.site_uv) {
    probe.points.emplace_back(site, face.surface.Point(uv));
  }
  return probe;
}

std::string TemplateText(const Experiment& experiment) {
  Experiment of_template;
  of_template.face_template = experiment.face_template;
  return WriteConfig(of_template);
}

Json MatchJson(const Match& match) {
  return {{"rank", match.rank}, {"own_mm", match.own_mm}, {"best_other_mm", match.best_other_mm}};
}

Json ProbeJson(const ProbeMatch& probe) {
  return {{"surface", MatchJson(probe.surface)}, {"landmarks", MatchJson(probe.landmarks)}};
}

}  // namespace

KnownFace MakeKnownFace(const GalleryEntry& entry, const RunContext& context) {
  const Case person =
      MakeCase(LoadSubject(entry.experiment.subject, context), entry.experiment, context);
  if (!person.skin) {
    throw InputError(fmt::format(
        "gallery: {} has no true skin for comparison; give subject.skin, or take this person out",
        entry.name));
  }
  KnownFace known{.name = entry.name,
                  .skin = *person.skin,
                  .region = FindScoredSkin(person, entry.experiment.region).region,
                  .points = {}};
  const TriMesh outer = OuterPart(known.skin, known.region);
  const std::vector<Dowel>& dowels = person.dowels_on_bone;
  known.points = PointsOn(dowels, MeasureSites(outer, outer, dowels), &SiteError::true_mm);
  return known;
}

IdentifyResult Identify(const Experiment& experiment, const std::vector<GalleryEntry>& gallery,
                        std::size_t own, const IdentifyOptions& options, const RunContext& context,
                        StageCache& cache) {
  const auto faces = MakeGallery(gallery, context, cache);
  const std::string key = GalleryKey(gallery);
  const auto ceiling = cache.Get<Distances>(fmt::format("ceiling {}\n{}", own, key), [&] {
    return Compare(SimulateRescan((*faces)[own], options.ceiling_cell_mm, options.ceiling_noise_mm,
                                  options.random_seed + own),
                   *faces, context);
  });
  // The distances of the generic face are the same for all persons; only the rank depends on `own`.
  const auto floor =
      cache.Get<Distances>(fmt::format("floor\n{}{}", TemplateText(experiment), key),
                           [&] { return Compare(GenericFace(experiment), *faces, context); });
  IdentifyResult result{.run = Run(experiment, context, &cache)};
  result.gallery = static_cast<int>(gallery.size());
  result.approximation = Compare(Approximation(result.run), *faces, context).MatchWith(own);
  result.ceiling = ceiling->MatchWith(own);
  result.floor = floor->MatchWith(own);
  return result;
}

Json IdentifyResultJson(const Experiment& experiment, const IdentifyResult& result) {
  Json json = ResultJson(experiment, result.run);
  Json identify = {{"gallery", result.gallery}, {"chance_rank", ChanceRank(result.gallery)}};
  identify.update(ProbeJson(result.approximation));
  identify["ceiling"] = ProbeJson(result.ceiling);
  identify["floor"] = ProbeJson(result.floor);
  json["identify"] = identify;
  return json;
}

}  // namespace semblance::problems
