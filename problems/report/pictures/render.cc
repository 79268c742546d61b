// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
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
constexpr int kMostSupersampling = 8;

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
      o.supersampling > kMostSupersampling) {
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
std::vector<Rgb> LinearColours(const SceneObject& object, const Material& material,
                               std::span<const Colour> colours) {
  std::vector<Rgb> linear(object.mesh.points.size(), LinearColour(material.colour));
  std::ranges::transform(colours, linear.begin(), LinearColour);
  return linear;
}

FlatScene Flatten(const Scene& scene) {
  FlatScene flat;
  std::size_t vertices = 0, triangles = 0;
  for (const SceneObject& object : scene.objects) {
    vertices += object.mesh.points.size();
    triangles += object.mesh.triangles.size();
  }
  flat.vertices.reserve(vertices);
  flat.triangles.reserve(triangles);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    CheckObject(object, i);
    const auto base = static_cast<std::int32_t>(flat.vertices.size());
    const std::vector<Vec3> normals = VertexNormals(object.mesh);
    const std::vector<Rgb> albedo = LinearColours(object, object.material, object.vertex_colours);
    for (std::size_t v = 0; v < normals.size(); ++v) {
      flat.vertices.push_back({.position = object.mesh.points[v],
                               .normal = normals[v].cast<float>(),
                               .albedo = albedo[v]});
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
  DepthGrid nearest;
  std::vector<std::int32_t> triangle;  // at each sample: index, or -1 for none

  Layer() = default;
  Layer(int columns, int rows) : nearest(columns, rows), triangle(nearest.depth.size(), -1) {}

  void Offer(int x, int y, const FourFloats& depth, const FourInts& inside, std::int32_t index) {
    const std::size_t sample = nearest.Index(x, y);
    const FourInts nearer = TakeNearer(depth, inside, &nearest.depth[sample]);
    FourInts present;
    std::memcpy(&present, &triangle[sample], sizeof(present));
    present = nearer ? index : present;
    std::memcpy(&triangle[sample], &present, sizeof(present));
  }
};

struct Layers {
  Layer opaque, sheer;
};

// One per object.
std::vector<Material> MaterialsOf(const Scene& scene, const Look& look) {
  std::vector<Material> materials;
  for (const SceneObject& object : scene.objects) {
    materials.push_back(object.material);
  }
  if (look.material && !materials.empty()) {
    materials.front() = *look.material;
  }
  return materials;
}

// The data that all bands and looks of a camera share. Bands are painted independently.
class Painter {
 public:
  // flat: the scene's. The painter sets its light and must be its only user. Finds the visible
  // triangles.
  Painter(const Scene& scene, const Camera& camera, const RenderOptions& options, int threads,
          FlatScene& flat)
      : scene_(scene),
        options_(options),
        view_from_world_(camera.view_from_world),
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
    ListSamples();
    points_.resize(flat_.vertices.size());
    ParallelFor(points_.size(), threads, 4096,
                [&](std::size_t v) { points_[v] = projection_ * flat_.vertices[v].position; });
    FillBands();
    layers_.resize(triangles_of_band_.size());
    ParallelFor(layers_.size(), threads, 1,
                [&](std::size_t band) { layers_[band] = FindNearest(band); });
    MarkSeen();
  }

  // Uses the present colours of the vertices.
  Image Paint(const Look& look, ShadowMaps& shadows, int threads) {
    shows_sheer_ = has_sheer_ && look.shows_sheer;
    const Lighting lighting = look.lighting.value_or(options_.lighting);
    const bool is_lit = !materials_.empty() && lighting == lighting_ && !look.material &&
                        !has_other_material_;  // by the look before
    if (!is_lit) {
      lighting_ = lighting;
      has_other_material_ = look.material.has_value();
      materials_ = MaterialsOf(scene_, look);
      rig_ = MakeLightRig(lighting_, view_from_world_);
      SetHighlight();
      LightVertices(scene_, materials_, rig_, threads, shadows, flat_);
    }
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
    Layers seen{Layer(columns, end - first), has_sheer_ ? Layer(columns, end - first) : Layer()};
    for (const std::int32_t t : triangles_of_band_[band]) {
      const auto& c = flat_.triangles[t].corners;
      const bool is_opaque = scene_.objects[flat_.triangles[t].object].opacity >= 1;
      Layer& layer = is_opaque ? seen.opaque : seen.sheer;
      VisitFours(points_[c[0]], points_[c[1]], points_[c[2]], {0, columns, first, end},
                 [&](int x, int y, const FourFloats& depth, const FourInts& inside) {
                   layer.Offer(x, y - first, depth, inside, t);
                 });
    }
    return seen;
  }

  void MarkCorners(std::int32_t triangle) {
    for (const std::int32_t corner : flat_.triangles[triangle].corners) {
      flat_.is_seen[corner] = 1;
    }
  }

  // Marks the corners of visible triangles. Most of a head is hidden and needs no light.
  void MarkSeen() {
    flat_.is_seen.assign(flat_.vertices.size(), 0);
    for (const Layers& layers : layers_) {
      for (const Layer* layer : {&layers.opaque, &layers.sheer}) {
        std::int32_t last = -1;
        for (const std::int32_t t : layer->triangle) {
          if (t != last && t >= 0) {
            MarkCorners(t);
          }
          last = t;
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
    key_light_ = Rgb::Zero();
    Vec3 half_way = Vec3::Zero();
    for (const Light& light : rig_.lights) {
      if (light.is_key) {
        key_light_ += light.irradiance;
        half_way += light.to_light;
      }
    }
    half_way_ =
        (half_way.normalized() + view_from_world_.row(2).transpose()).normalized().cast<float>();
  }

  // The triangles that a sample shows; -1: none.
  struct Shown {
    std::int32_t opaque = -1, sheer = -1;
    bool operator==(const Shown&) const = default;
  };

  Shown ShownAt(const Layers& seen, std::size_t sample) const {
    const auto& [opaque, sheer] = seen;
    const bool in_front =
        shows_sheer_ && sheer.nearest.depth[sample] < opaque.nearest.depth[sample];
    return {opaque.triangle[sample], in_front ? sheer.triangle[sample] : -1};
  }

  // Lists the samples of a pixel, row by row.
  void ListSamples() {
    const int s = options_.supersampling;
    for (int k = 0; k < s * s; ++k) {
      samples_.push_back(
          {.offset = static_cast<std::size_t>(k / s) * DepthGrid(s * options_.width, 0).stride +
                     static_cast<std::size_t>(k % s),
           .x = (2 * (k % s) + 1) * kHalfSample,
           .y = (2 * (k / s) + 1) * kHalfSample});
    }
  }

  // The mean over the samples of a pixel. Samples that show the same triangles are shaded once, at
  // their middle: in a fine mesh the four samples of a pixel seldom show four triangles.
  Rgb PixelLight(const Layers& seen, int first_row, int column, int row,
                 const Rgb& background) const {
    const int s = options_.supersampling;
    const std::size_t first = seen.opaque.nearest.Index(s * column, s * row - first_row);
    const std::int64_t left = std::int64_t{kSubsamples} * s * column;
    const std::int64_t top = std::int64_t{kSubsamples} * s * row;
    std::array<Shown, std::size_t{kMostSupersampling} * kMostSupersampling> shown;
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      shown[k] = ShownAt(seen, first + samples_[k].offset);
    }
    if (std::all_of(shown.begin() + 1, shown.begin() + samples_.size(),
                    [&](const Shown& other) { return other == shown[0]; })) {
      return Mix(shown[0], left + s * kHalfSample, top + s * kHalfSample, background);
    }
    Rgb sum = Rgb::Zero();
    std::uint64_t done = 0;  // one bit per sample
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      std::int64_t count = 0, x = 0, y = 0;
      for (std::size_t other = k; other < samples_.size(); ++other) {
        if ((done >> other & 1) == 0 && shown[other] == shown[k]) {
          done |= std::uint64_t{1} << other;
          ++count;
          x += samples_[other].x;
          y += samples_[other].y;
        } else if (other == k) {
          break;  // counted with an earlier sample
        }
      }
      if (count > 0) {
        sum += static_cast<float>(count) *
               Mix(shown[k], left + x / count, top + y / count, background);
      }
    }
    return sum / static_cast<float>(samples_.size());
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
    const Surface surface = Interpolate(t, at);
    const SceneObject& object = scene_.objects[t.object];
    const Rgb light =
        at.is_front
            ? Rgb(surface.albedo * surface.light +
                  Highlight(materials_[t.object], surface.normal) * surface.key * key_light_)
            : Rgb(surface.albedo * LightInside(surface.normal));
    Shaded shaded;
    shaded.colour = lighting_ == Lighting::kEven ? Rgb(light.min(1.0F)) : Shoulder(light);
    if (object.opacity < 1) {
      const float cosine = std::clamp(std::abs(surface.normal.dot(to_viewer_)), 0.05F, 1.0F);
      shaded.alpha = 1 - std::pow(static_cast<float>(1 - object.opacity), 1 / cosine);
    }
    return shaded;
  }

  struct Surface {
    Eigen::Vector3f normal;
    Rgb albedo, light;
    float key = 0;
  };

  // The normal of a surface whose corners have none stays zero.
  Surface Interpolate(const SceneTriangle& t, const Coverage& at) const {
    const SceneVertex& a = flat_.vertices[t.corners[0]];
    const SceneVertex& b = flat_.vertices[t.corners[1]];
    const SceneVertex& c = flat_.vertices[t.corners[2]];
    constexpr float kLeastNorm2 = 1e-12F;
    const Eigen::Vector3f normal = at.a * a.normal + at.b * b.normal + at.c * c.normal;
    return {.normal = normal / std::sqrt(std::max(normal.squaredNorm(), kLeastNorm2)),
            .albedo = at.a * a.albedo + at.b * b.albedo + at.c * c.albedo,
            .light = at.a * a.light + at.b * b.light + at.c * c.light,
            .key = at.a * a.key + at.b * b.key + at.c * c.key};
  }

  float Highlight(const Material& material, const Eigen::Vector3f& normal) const {
    float value = lighting_ == Lighting::kEven ? 0 : std::max(0.0F, normal.dot(half_way_));
    for (int i = 0; i < material.gloss_log2; ++i) {
      value *= value;
    }
    return static_cast<float>(material.gloss) * value;
  }

  // The light on the back of a surface, seen through a hole: dimmed, without shadows.
  Rgb LightInside(const Eigen::Vector3f& normal) const {
    constexpr float kDimmed = 0.45F;  // dark enough to look like an inside
    Rgb sum = Rgb::Zero();
    const auto add = [&](const Vec3& to_light, const Rgb& irradiance) {
      sum += static_cast<float>(std::max(0.0F, -normal.dot(to_light.cast<float>()))) * irradiance;
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
  Mat3 view_from_world_;
  Eigen::Vector3f to_viewer_ = view_from_world_.row(2).transpose().cast<float>();
  std::array<Vec3, kSkyLights> sky_ = SkyDirections();
  FlatScene& flat_;
  bool has_sheer_;
  Projection projection_;
  Eigen::Vector3f half_way_ = Eigen::Vector3f::Zero();
  Rgb key_light_ = Rgb::Zero();
  struct Sample {
    std::size_t offset = 0;     // in a layer, from the first sample of its pixel
    std::int64_t x = 0, y = 0;  // from the upper left corner of its pixel, steps
  };
  std::vector<Sample> samples_;  // of a pixel
  std::vector<RasterPoint> points_;
  std::vector<std::vector<std::int32_t>> triangles_of_band_;
  std::vector<Layers> layers_;  // one per band
  // The present look sets these.
  Lighting lighting_ = Lighting::kStudio;
  bool shows_sheer_ = false, has_other_material_ = false;
  std::vector<Material> materials_;  // one per object
  LightRig rig_;
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
  return std::move(RenderLooks(scene, {{Look{}}}, cameras, options, shadows, threads).front());
}

namespace {

// The colours of the first object's vertices.
std::vector<Rgb> FirstAlbedo(const Scene& scene, const Look& look) {
  if (scene.objects.empty()) {
    return {};
  }
  const SceneObject& first = scene.objects.front();
  const std::vector<Colour>& colours =
      look.vertex_colours ? *look.vertex_colours : first.vertex_colours;
  CheckColours(first, colours.size(), 0);
  return LinearColours(first, look.material.value_or(first.material), colours);
}

}  // namespace

std::vector<std::vector<Image>> RenderLooks(const Scene& scene, std::span<const Look> looks,
                                            std::span<const Camera> cameras,
                                            const RenderOptions& options, ShadowMaps& shadows,
                                            int threads) {
  FlatScene flat = Flatten(scene);
  std::vector<std::vector<Rgb>> albedos;
  for (const Look& look : looks) {
    albedos.push_back(FirstAlbedo(scene, look));
  }
  // The light of the sky depends on materials: entry 0 is for looks that change none.
  std::vector<std::vector<SkyShare>> skies(looks.size() + 1);
  std::vector<std::vector<Image>> images(looks.size());
  for (const Camera& camera : cameras) {
    Painter painter(scene, camera, options, threads, flat);
    for (std::size_t k = 0; k < looks.size(); ++k) {
      for (std::size_t v = 0; v < albedos[k].size(); ++v) {
        flat.vertices[v].albedo = albedos[k][v];
      }
      std::vector<SkyShare>& sky = skies[looks[k].material ? k + 1 : 0];
      flat.sky.swap(sky);
      images[k].push_back(painter.Paint(looks[k], shadows, threads));
      flat.sky.swap(sky);
    }
  }
  return images;
}

Image Render(const Scene& scene, const Camera& camera, const RenderOptions& options, int threads) {
  ShadowMaps shadows;
  return std::move(RenderAll(scene, {&camera, 1}, options, shadows, threads).front());
}

}  // namespace semblance::problems
