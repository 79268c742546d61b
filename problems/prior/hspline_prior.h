// SPDX-License-Identifier: GPL-3.0-or-later
// The modes of a face prior as B-splines over the (u,v) of a template: small enough to travel with
// the program, and no mesh.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/prior/prior_surface.h"

namespace semblance {

// A point of the face and its clearance (ShapeFeature).
struct FeatureParameter {
  Vec2 uv = Vec2::Constant(kNaN);
  double clearance_mm = kNaN;
};

struct HSplineModes {
  HSplineShape shape;  // of the template; the modes are plain B-splines of `level`
  int level = -1;
  std::vector<ControlNet> modes;  // displacements at coefficient 1, in the template's frame, mm
  std::vector<FeatureParameter> features;
};

// What a level of B-splines keeps of the modes, mm.
struct ModesMisfit {
  double rms_mm = kNaN;  // over all modes and samples
  double max_mm = kNaN;
};

// Each of the first `count` modes is the least-squares fit of its displacements at the samples of
// the template. misfit: may be null. Throws InputError for a level that the template does not have.
HSplineModes ModesOnTemplate(const FacePrior& prior, const PriorOnTemplate& on_template,
                             const TemplateFace& face, int level, int count, ModesMisfit* misfit);

// JSON; the vertices in whole micrometres.
std::string HSplineModesToJson(const HSplineModes& modes);
// Throws InputError in one line that starts with `name`.
HSplineModes HSplineModesFromJson(std::string_view text, std::string_view name);

// The prior on a mesh of the template, with the first `count` modes. Throws InputError if the
// template is of another shape.
FacePrior PriorOf(const HSplineModes& modes, const TemplateFace& face, int count);

// Of any source. face: the template. Throws as LoadPrior, ReadFileBytes and the functions above.
FacePrior LoadPrior(const PriorSource& source, const TemplateFace& face);

// The files that LoadPrior reads, for the manifest. Throws as ModesPriorFiles.
std::vector<std::filesystem::path> PriorFiles(const PriorSource& source);

}  // namespace semblance
