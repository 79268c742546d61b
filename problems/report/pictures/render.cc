// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/raster.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh_files/srgb.h"

namespace semblance::problems {
namespace {

constexpr int kBandRows = 16;  // pixel rows per task of a thread
constexpr std::int64_t kHalfSample = kSubsamples / 2;

Rgb LinearColour(const Colour& c) {
  return {static_cast<float>(LinearFromSrgb(c.r)), static_cast<float>(LinearFromSrgb(c.g)),
          static_cast<float>(LinearFromSrgb(c.b))};
}

void CheckColours(const SceneObject& object, std::size_t colours, std::size_t index) {
  const std::size_t points = object.mesh.points.size();
  if (colours != 0 && colours != points) {
    throw InputError(
        fmt::format("scene object {}: {} vertex colours for {} points; give one per point or none",
                    index, colours, points));
  }
}

void CheckObject(const SceneObject& object, std::size_t index) {
  const std::size_t points = object.mesh.points.size();
  if (!(object.opacity >= 0 && object.opacity <= 1)) {
    throw InputError(
        fmt::format("scene object {}: opacity {} must be between 0 and 1", index, object.opacity));
  }
  CheckColours(object, object.vertex_colours.size(), index);
  for (std::size_t i = 0; i < points; ++i) {
    if (!object.mesh.points[i].allFinite()) {
      throw InputError(fmt::format("scene object {}: point {} is not finite", index, i));
    }
  }
  for (std::size_t t = 0; t < object.mesh.triangles.size(); ++t) {
    for (const std::int32_t corner : object.mesh.triangles[t]) {
      if (corner < 0 || static_cast<std::size_t>(corner) >= points) {
        throw InputError(
            fmt::format("scene object {}: triangle {} has the index {}, but there are {} points",
                        index, t, corner, points));
      }
    }
  }
}

void CheckOptions(const Camera& camera, const RenderOptions& o) {
  if (o.width < 1 || o.height < 1 || o.width > 8192 || o.height > 8192 || o.supersampling < 1 ||
      o.supersampling > 8) {
    throw InputError(
        fmt::format("picture of {} x {} pixels with supersampling {}: sides must be 1 to 8192 and "
                    "supersampling 1 to 8",
                    o.width, o.height, o.supersampling));
  }
  if (!(camera.height_mm > 0) || !std::isfinite(camera.height_mm) || !camera.centre.allFinite()) {
    throw InputError(fmt::format(
        "camera with a height of {} mm: it must be positive and finite, and its centre finite",
        camera.height_mm));
  }
}

// Per vertex of the object. colours: one per vertex, or none for the material's.
std::vector<Rgb> LinearColours(const SceneObject& object, std::span<const Colour> colours) {
  std::vector<Rgb> linear(object.mesh.points.size(), LinearColour(object.material.colour));
  std::ranges::transform(colours, linear.begin(), LinearColour);
  return linear;
}

FlatScene Flatten(const Scene& scene) {
  FlatScene flat;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    CheckObject(object, i);
    const auto base = static_cast<std::int32_t>(flat.vertices.size());
    const std::vector<Vec3> normals = VertexNormals(object.mesh);
    const std::vector<Rgb> albedo = LinearColours(object, object.vertex_colours);
    for (std::size_t v = 0; v < normals.size(); ++v) {
      flat.vertices.push_back(
          {.position = object.mesh.points[v], .normal = normals[v], .albedo = albedo[v]});
    }
    for (const Triangle& t : object.mesh.triangles) {
      flat.triangles.push_back({{base + t[0], base + t[1], base + t[2]}, static_cast<int>(i)});
    }
    flat.object_of_vertex.resize(flat.vertices.size(), static_cast<int>(i));
  }
  return flat;
}

// Compresses bright light, so that highlights approach white smoothly.
Rgb Shoulder(const Rgb& colour) {
  constexpr float kBegin = 0.62F;  // linear light below this stays as it is
  const Rgb over = (colour - kBegin).max(0.0F) / (1 - kBegin);
  return colour.min(kBegin) + (1 - kBegin) * over / (1 + over);
}

void SetPixel(Image& image, int x, int y, const Rgb& linear) {
  std::uint8_t* pixel = &image.rgb[3 * (static_cast<std::size_t>(y) * image.width + x)];
  for (int channel = 0; channel < 3; ++channel) {
    pixel[channel] = SrgbByte(linear[channel]);
  }
}

struct Layer {
  std::vector<float> depth;
  std::vector<std::int32_t> triangle;  // index, or -1 for none

  explicit Layer(std::size_t samples = 0)
      : depth(samples, std::numeric_limits<float>::infinity()), triangle(samples, -1) {}
  void Offer(std::size_t sample, float sample_depth, std::int32_t index) {
    if (sample_depth < depth[sample]) {
      depth[sample] = sample_depth;
      triangle[sample] = index;
    }
  }
};

struct Layers {
  Layer opaque, sheer;
};

// The data that all bands share, prepared once per picture. Bands are painted independently.
class Painter {
 public:
  // flat: the scene's. The painter sets its light and must be its only user.
  Painter(const Scene& scene, const Camera& camera, const RenderOptions& options,
          ShadowMaps& shadows, int threads, FlatScene& flat)
      : scene_(scene),
        options_(options),
        to_viewer_(camera.view_from_world.row(2)),
        rig_(MakeLightRig(options.lighting, camera.view_from_world)),
        flat_(flat),
        has_sheer_(std::ranges::any_of(scene.objects,
                                       [](const SceneObject& o) { return o.opacity < 1; })) {
    CheckOptions(camera, options);
    const int s = options.supersampling;
    projection_ = {.view_from_world = camera.view_from_world,
                   .centre = camera.centre,
                   .samples_per_mm = s * options.height / camera.height_mm,
                   .width = static_cast<double>(s) * options.width,
                   .height = static_cast<double>(s) * options.height};
    SetHighlight();
    points_.resize(flat_.vertices.size());
    ParallelFor(points_.size(), threads, 4096,
                [&](std::size_t v) { points_[v] = projection_ * flat_.vertices[v].position; });
    FillBands();
    layers_.resize(triangles_of_band_.size());
    ParallelFor(layers_.size(), threads, 1,
                [&](std::size_t band) { layers_[band] = FindNearest(band); });
    MarkSeen();
    LightVertices(scene, rig_, threads, shadows, flat_);
  }

  // Uses the present colours of the vertices.
  Image Paint(int threads) const {
    Image image = MakeImage(options_.width, options_.height, Colour{});
    ParallelFor(layers_.size(), threads, 1, [&](std::size_t band) { PaintBand(band, image); });
    return image;
  }

 private:
  void PaintBand(std::size_t band, Image& image) const {
    const int s = options_.supersampling, first = FirstRow(band), end = EndRow(band);
    for (int row = first / s; row < end / s; ++row) {
      const Rgb background = Background(row);
      for (int column = 0; column < options_.width; ++column) {
        SetPixel(image, column, row, PixelLight(layers_[band], first, column, row, background));
      }
    }
  }

  // The rows of samples in a band.
  int FirstRow(std::size_t band) const {
    return static_cast<int>(band) * kBandRows * options_.supersampling;
  }
  int EndRow(std::size_t band) const {
    const int s = options_.supersampling;
    return std::min(FirstRow(band) + kBandRows * s, s * options_.height);
  }

  // The nearest triangles at each sample of a band.
  Layers FindNearest(std::size_t band) const {
    const int columns = options_.supersampling * options_.width;
    const int first = FirstRow(band), end = EndRow(band);
    const auto samples = static_cast<std::size_t>(columns) * (end - first);
    Layers seen{Layer(samples), Layer(has_sheer_ ? samples : 0)};
    for (const std::int32_t t : triangles_of_band_[band]) {
      const auto& c = flat_.triangles[t].corners;
      const bool is_opaque = scene_.objects[flat_.triangles[t].object].opacity >= 1;
      VisitSamples(points_[c[0]], points_[c[1]], points_[c[2]], {0, columns, first, end},
                   [&](const Coverage& sample) {
                     (is_opaque ? seen.opaque : seen.sheer)
                         .Offer(static_cast<std::size_t>(sample.y - first) * columns + sample.x,
                                sample.depth, t);
                   });
    }
    return seen;
  }

  void MarkCorners(std::int32_t triangle) {
    for (const std::int32_t corner : flat_.triangles[triangle].corners) {
      flat_.is_seen[corner] = true;
    }
  }

  // Marks the corners of visible triangles. Most of a head is hidden and needs no light.
  void MarkSeen() {
    flat_.is_seen.assign(flat_.vertices.size(), false);
    for (const Layers& layers : layers_) {
      for (const Layer* layer : {&layers.opaque, &layers.sheer}) {
        for (const std::int32_t t : layer->triangle) {
          if (t >= 0) {
            MarkCorners(t);
          }
        }
      }
    }
  }

  // Lists a triangle in each band of rows that its bounding box meets.
  void FillBands() {
    const int rows = kBandRows * options_.supersampling;
    triangles_of_band_.resize((options_.height + kBandRows - 1) / kBandRows);
    const auto last_band = static_cast<std::int64_t>(triangles_of_band_.size()) - 1;
    for (std::size_t t = 0; t < flat_.triangles.size(); ++t) {
      const auto& c = flat_.triangles[t].corners;
      const auto [low, high] = std::minmax({points_[c[0]].y, points_[c[1]].y, points_[c[2]].y});
      const std::int64_t begin = std::max<std::int64_t>(0, (low >> 8) / rows);
      const std::int64_t end = std::min<std::int64_t>(last_band, (high >> 8) / rows);
      for (std::int64_t band = high < 0 ? last_band + 1 : begin; band <= end; ++band) {
        triangles_of_band_[band].push_back(static_cast<std::int32_t>(t));
      }
    }
  }

  // The direction half-way between viewer and key light (Blinn 1977). It is constant, because both
  // are far away.
  void SetHighlight() {
    for (const Light& light : rig_.lights) {
      if (light.is_key) {
        key_light_ += light.irradiance;
        half_way_ += light.to_light;
      }
    }
    half_way_ = (half_way_.normalized() + to_viewer_).normalized();
  }

  // The triangles that a sample shows; -1: none.
  struct Shown {
    std::int32_t opaque = -1, sheer = -1;
    bool operator==(const Shown&) const = default;
  };

  Shown ShownAt(const Layers& seen, std::size_t sample) const {
    const auto& [opaque, sheer] = seen;
    const bool in_front = has_sheer_ && sheer.depth[sample] < opaque.depth[sample];
    return {opaque.triangle[sample], in_front ? sheer.triangle[sample] : -1};
  }

  // The mean over the samples of a pixel. Samples that show the same triangles are shaded once, at
  // their middle: in a fine mesh the four samples of a pixel seldom show four triangles.
  Rgb PixelLight(const Layers& seen, int first_row, int column, int row,
                 const Rgb& background) const {
    const int s = options_.supersampling, columns = s * options_.width;
    const std::size_t first = static_cast<std::size_t>(s * row - first_row) * columns + s * column;
    const auto shown_at = [&](int k) {
      return ShownAt(seen, first + static_cast<std::size_t>(k / s) * columns + k % s);
    };
    Rgb sum = Rgb::Zero();
    std::uint64_t done = 0;  // one bit per sample
    for (int k = 0; k < s * s; ++k) {
      const Shown shown = shown_at(k);
      std::int64_t count = 0, x = 0, y = 0;
      for (int other = k; other < s * s; ++other) {
        if ((done >> other & 1) == 0 && (other == k || shown_at(other) == shown)) {
          done |= std::uint64_t{1} << other;
          ++count;
          x += (2 * (s * column + other % s) + 1) * kHalfSample;
          y += (2 * (s * row + other / s) + 1) * kHalfSample;
        }
      }
      if (count > 0) {
        sum += static_cast<float>(count) * Mix(shown, x / count, y / count, background);
      }
    }
    return sum / static_cast<float>(s * s);
  }

  // The colour at the place (x, y), in steps.
  Rgb Mix(const Shown& shown, std::int64_t x, std::int64_t y, const Rgb& background) const {
    const Rgb behind = shown.opaque < 0 ? background : Shade(shown.opaque, x, y).colour;
    if (shown.sheer < 0) {
      return behind;
    }
    const Shaded sheet = Shade(shown.sheer, x, y);
    return sheet.alpha * sheet.colour + (1 - sheet.alpha) * behind;
  }

  Rgb Background(int row) const {
    const float t = (static_cast<float>(row) + 0.5F) / static_cast<float>(options_.height);
    return (1 - t) * LinearColour(options_.background_top) +
           t * LinearColour(options_.background_bottom);
  }

  struct Shaded {
    Rgb colour = Rgb::Zero();
    float alpha = 1;
  };

  // Shades a triangle at the place (x, y), in steps.
  Shaded Shade(std::int32_t triangle, std::int64_t x, std::int64_t y) const {
    const SceneTriangle& t = flat_.triangles[triangle];
    const Coverage at =
        CoverageAt(points_[t.corners[0]], points_[t.corners[1]], points_[t.corners[2]], x, y);
    const SceneVertex surface = Interpolate(t, at);
    const SceneObject& object = scene_.objects[t.object];
    const Rgb light =
        at.is_front ? Rgb(surface.albedo * surface.light +
                          Highlight(object.material, surface.normal) * surface.key * key_light_)
                    : Rgb(surface.albedo * LightInside(surface.normal));
    Shaded shaded;
    shaded.colour = options_.lighting == Lighting::kEven ? Rgb(light.min(1.0F)) : Shoulder(light);
    if (object.opacity < 1) {
      const double cosine = std::clamp(std::abs(surface.normal.dot(to_viewer_)), 0.05, 1.0);
      shaded.alpha = static_cast<float>(1 - std::pow(1 - object.opacity, 1 / cosine));
    }
    return shaded;
  }

  SceneVertex Interpolate(const SceneTriangle& t, const Coverage& at) const {
    const SceneVertex& a = flat_.vertices[t.corners[0]];
    const SceneVertex& b = flat_.vertices[t.corners[1]];
    const SceneVertex& c = flat_.vertices[t.corners[2]];
    const auto wa = static_cast<float>(at.a), wb = static_cast<float>(at.b);
    const auto wc = static_cast<float>(at.c);
    return {.position = at.a * a.position + at.b * b.position + at.c * c.position,
            .normal = (at.a * a.normal + at.b * b.normal + at.c * c.normal).normalized(),
            .albedo = wa * a.albedo + wb * b.albedo + wc * c.albedo,
            .light = wa * a.light + wb * b.light + wc * c.light,
            .key = wa * a.key + wb * b.key + wc * c.key};
  }

  float Highlight(const Material& material, const Vec3& normal) const {
    double value = options_.lighting == Lighting::kEven ? 0 : std::max(0.0, normal.dot(half_way_));
    for (int i = 0; i < material.gloss_log2; ++i) {
      value *= value;
    }
    return static_cast<float>(material.gloss * value);
  }

  // The light on the back of a surface, seen through a hole: dimmed, without shadows.
  Rgb LightInside(const Vec3& normal) const {
    constexpr float kDimmed = 0.45F;  // dark enough to look like an inside
    Rgb sum = Rgb::Zero();
    const auto add = [&](const Vec3& to_light, const Rgb& irradiance) {
      sum += static_cast<float>(std::max(0.0, -normal.dot(to_light))) * irradiance;
    };
    for (const Light& light : rig_.lights) {
      add(light.to_light, light.irradiance);
    }
    for (const Vec3& direction : sky_) {
      add(direction, rig_.FromSky(direction));
    }
    return kDimmed * sum;
  }

  const Scene& scene_;
  const RenderOptions& options_;
  Vec3 to_viewer_;
  LightRig rig_;
  std::array<Vec3, kSkyLights> sky_ = SkyDirections();
  FlatScene& flat_;
  bool has_sheer_;
  Projection projection_;
  Vec3 half_way_ = Vec3::Zero();
  Rgb key_light_ = Rgb::Zero();
  std::vector<RasterPoint> points_;
  std::vector<std::vector<std::int32_t>> triangles_of_band_;
  std::vector<Layers> layers_;  // one per band
};

Vec3 DirectionToViewer(View view) {
  constexpr double kThreeQuarterDeg = 40;
  const double turn = kThreeQuarterDeg * std::numbers::pi / 180;
  switch (view) {
    case View::kFront:
      return {0, -1, 0};
    case View::kThreeQuarter:
      return {std::sin(turn), -std::cos(turn), 0};
    case View::kSide:
      return {1, 0, 0};
  }
  return {0, -1, 0};
}

}  // namespace

Material SkinMaterial() {
  return {.colour = HexColour(0xd6aa90),
          .wrap = 0.18,
          .scatter_mm = {2.2, 1.0, 0.8},
          .gloss = 0.10,
          .gloss_log2 = 4};
}

Material BoneMaterial() {
  return {.colour = HexColour(0xe0d3b6),
          .wrap = 0.06,
          .scatter_mm = {1.0, 0.75, 0.6},
          .gloss = 0.09,
          .gloss_log2 = 4};
}

Material PlasticMaterial(const Colour& colour) {
  return {.colour = colour, .wrap = 0.1, .gloss = 0.35, .gloss_log2 = 6};
}

Material MatteMaterial() { return {.scatter_mm = {0.8, 0.8, 0.8}}; }

Camera CameraFor(View view, const Box3& region, double aspect) {
  if (region.isEmpty() || !region.min().allFinite() || !region.max().allFinite()) {
    throw InputError("camera: the region to be framed is empty or not finite");
  }
  constexpr double kMargin = 1.08;
  Camera camera;
  const Vec3 up(0, 0, 1), to_viewer = DirectionToViewer(view);
  camera.view_from_world.row(0) = up.cross(to_viewer).transpose();
  camera.view_from_world.row(1) = up.transpose();
  camera.view_from_world.row(2) = to_viewer.transpose();
  camera.centre = region.center();
  const Vec3 extent = (camera.view_from_world * region.sizes().asDiagonal())
                          .rowwise()
                          .norm();  // extents of the ellipsoid
  camera.height_mm = std::max(kMargin * std::max(extent.y(), extent.x() / aspect), 1e-6);
  return camera;
}

std::vector<Image> RenderAll(const Scene& scene, std::span<const Camera> cameras,
                             const RenderOptions& options, ShadowMaps& shadows, int threads) {
  std::vector<Image> images;
  FlatScene flat = Flatten(scene);
  for (const Camera& camera : cameras) {
    images.push_back(Painter(scene, camera, options, shadows, threads, flat).Paint(threads));
  }
  return images;
}

std::vector<std::vector<Image>> RenderColourings(const Scene& scene,
                                                 std::span<const std::vector<Colour>> colourings,
                                                 std::span<const Camera> cameras,
                                                 const RenderOptions& options, ShadowMaps& shadows,
                                                 int threads) {
  FlatScene flat = Flatten(scene);
  std::vector<std::vector<Rgb>> albedos;
  for (const std::vector<Colour>& colours : colourings) {
    CheckColours(scene.objects.at(0), colours.size(), 0);
    albedos.push_back(LinearColours(scene.objects[0], colours));
  }
  std::vector<std::vector<Image>> images(colourings.size());
  for (const Camera& camera : cameras) {
    const Painter painter(scene, camera, options, shadows, threads, flat);
    for (std::size_t k = 0; k < albedos.size(); ++k) {
      for (std::size_t v = 0; v < albedos[k].size(); ++v) {
        flat.vertices[v].albedo = albedos[k][v];
      }
      images[k].push_back(painter.Paint(threads));
    }
  }
  return images;
}

Image Render(const Scene& scene, const Camera& camera, const RenderOptions& options, int threads) {
  ShadowMaps shadows;
  return std::move(RenderAll(scene, {&camera, 1}, options, shadows, threads).front());
}

}  // namespace semblance::problems
