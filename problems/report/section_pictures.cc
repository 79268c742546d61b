// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/section_pictures.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/report/pictures/image.h"
#include "problems/report/plots/svg_parts.h"
#include "surfaces/base/encoding.h"

namespace semblance::problems {
namespace {

constexpr double kPixelsPerMm = 2.6, kMargin_mm = 8, kSectionLegendRow = 26, kEdge = 12;

// Converts the picture of a plane to pixels of an SVG, whose y grows downwards.
struct Sheet {
  Eigen::AlignedBox2d frame_mm;

  double Width() const { return kPixelsPerMm * frame_mm.sizes().x(); }
  double Height() const { return kPixelsPerMm * frame_mm.sizes().y(); }
  Vec2 ToPixels(const Vec2& p) const {
    return kPixelsPerMm * Vec2(p.x() - frame_mm.min().x(), frame_mm.max().y() - p.y());
  }
};

Sheet SheetFor(const PicturePlane& plane, const Box3& region) {
  Sheet sheet;
  for (int corner = 0; corner < 8; ++corner) {
    sheet.frame_mm.extend(plane.InPicture(region.corner(static_cast<Box3::CornerType>(corner))));
  }
  const Vec2 margin = Vec2::Constant(kMargin_mm);
  return {{sheet.frame_mm.min() - margin, sheet.frame_mm.max() + margin}};
}

// Points closer than the thickness of a line would only make the file larger.
std::string PathOf(const SectionLine& line, const Sheet& sheet) {
  constexpr double kStep_mm = 0.3;
  std::string path;
  Vec2 last = Vec2::Constant(kNaN);
  for (const Vec2& p : line.points) {
    if ((p - last).norm() < kStep_mm) {
      continue;
    }
    const Vec2 at = sheet.ToPixels(p);
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", at.x(), at.y());
    last = p;
  }
  return path + (line.closed ? "Z" : "");
}

std::string OutlineSvg(const std::vector<SectionLine>& lines, const SectionLayer& layer,
                       const Sheet& sheet) {
  std::string paths;
  for (const SectionLine& line : lines) {
    paths += PathOf(line, sheet);
  }
  return fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.7\" "
      "stroke-linejoin=\"round\">{}</path>\n",
      paths, layer.colour, svg::Title(layer.label));
}

std::string PngOf(const GreySlice& slice) {
  Image image = MakeImage(slice.width, slice.height, {});
  for (std::size_t k = 0; k < slice.grey.size(); ++k) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      image.rgb[3 * k + channel] = slice.grey[k];
    }
  }
  return EncodePng(image);
}

// Paler than the CT's own blacks, so that outlines stand out.
std::string SliceSvg(const GreySlice& slice, const Sheet& sheet) {
  const Vec2 size_mm = slice.pixel_mm * Vec2(slice.width, slice.height);
  const Vec2 top_left = sheet.ToPixels(slice.low_mm + Vec2(0, size_mm.y()));
  return fmt::format(
      "<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" opacity=\"0.42\" "
      "preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>\n",
      top_left.x(), top_left.y(), kPixelsPerMm * size_mm.x(), kPixelsPerMm * size_mm.y(),
      Base64(PngOf(slice)));
}

std::string ScaleSvg(const Sheet& sheet) {
  constexpr double kScale_mm = 20;
  const double y = sheet.Height() - kEdge, x = kEdge, end = x + kPixelsPerMm * kScale_mm;
  return svg::Line(x, y, end, y, "#1d2126", 2) + svg::Line(x, y - 4, x, y + 4, "#1d2126", 2) +
         svg::Line(end, y - 4, end, y + 4, "#1d2126", 2) +
         svg::Text((x + end) / 2, y - 8, fmt::format("{:.0f} mm", kScale_mm), "middle");
}

std::string SidesSvg(const HeadPlane& plane, const Sheet& sheet) {
  return svg::Text(kEdge, kEdge + 10, std::string(plane.left), "start") +
         svg::Text(sheet.Width() - kEdge, kEdge + 10, std::string(plane.right), "end");
}

std::string LegendSvg(const std::vector<SectionLayer>& layers, double top) {
  std::string legend;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const double y = top + kSectionLegendRow * (static_cast<double>(k) + 0.6);
    legend += svg::Line(kEdge, y, kEdge + 34, y, layers[k].colour, 3) +
              svg::Text(kEdge + 44, y + 5, layers[k].label, "start");
  }
  return legend;
}

const GreySlice* FindSlice(const std::vector<GreySlice>& slices, const std::string& name) {
  const auto found = std::ranges::find(slices, name, &GreySlice::name);
  return found == slices.end() ? nullptr : &*found;
}

std::vector<SectionLayer> LayersOf(const RunResult& result) {
  std::vector<SectionLayer> layers = {{"skull", "#8a5a00", &result.subject.skull},
                                      {"first face (implicit)", "#0072b2", &result.implicit.mesh},
                                      {"recovered face", "#d55e00", &result.face.mesh}};
  if (result.subject.skin) {
    layers.push_back({"true skin", "#009e73", &*result.subject.skin});
  }
  return layers;
}

std::vector<SitePoint> PointsOf(const Case& subject) {
  std::vector<SitePoint> points;
  for (const auto& [site, point] : subject.points) {
    points.push_back({site, point});
  }
  return points;
}

std::string FileOf(const HeadPlane& plane) {
  return fmt::format("pictures/section_{}.svg", plane.name);
}

}  // namespace

std::string SectionSvg(const HeadPlane& plane, const std::vector<SectionLayer>& layers,
                       const Box3& region, const GreySlice* slice) {
  const Sheet sheet = SheetFor(plane.plane, region);
  std::string outlines = slice == nullptr ? "" : SliceSvg(*slice, sheet);
  std::vector<SectionLayer> shown;
  for (const SectionLayer& layer : layers) {
    const std::vector<SectionLine> lines = CutByPlane(*layer.mesh, plane.plane);
    if (!lines.empty()) {
      outlines += OutlineSvg(lines, layer, sheet);
      shown.push_back(layer);
    }
  }
  const double height = sheet.Height() + kSectionLegendRow * static_cast<double>(shown.size());
  return svg::Open(height, sheet.Width()) +
         fmt::format(
             "<clipPath id=\"{0}\"><rect width=\"{1:.1f}\" height=\"{2:.1f}\"/></clipPath>"
             "\n<g clip-path=\"url(#{0})\">\n{3}</g>\n",
             plane.name, sheet.Width(), sheet.Height(), outlines) +
         SidesSvg(plane, sheet) + ScaleSvg(sheet) + LegendSvg(shown, sheet.Height()) + "</svg>\n";
}

void WriteSections(const RunResult& result, OutputFolder& folder) {
  Box3 region = Bounds(result.face.mesh);
  region.extend(Bounds(result.subject.skull));
  const std::vector<SectionLayer> layers = LayersOf(result);
  for (const HeadPlane& plane : HeadPlanes(PointsOf(result.subject))) {
    folder.Write(FileOf(plane),
                 SectionSvg(plane, layers, region, FindSlice(result.subject.slices, plane.name)));
  }
}

std::vector<ReportImage> SectionImages(const OutputFolder& folder) {
  std::vector<ReportImage> images;
  for (const auto& [name, title] : kHeadPlaneTitles) {
    const std::filesystem::path file = folder.Root() / fmt::format("pictures/section_{}.svg", name);
    if (std::filesystem::exists(file)) {
      images.push_back(ReportImageFromFile(file, fmt::format("{}.", title),
                                           fmt::format("section of the head: {}", title)));
    }
  }
  return images;
}

}  // namespace semblance::problems
