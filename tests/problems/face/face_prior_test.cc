// SPDX-License-Identifier: GPL-3.0-or-later
// The mean of these priors is the built-in template, with which everything can be compared.
#include "problems/face/face_prior.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <string>

#include "problems/face/hspline_prior.h"
#include "problems/face/prior_observations.h"
#include "problems/face/template_source.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchFolder;

const TemplateFace& Face() {
  static const TemplateFace face = MakeTemplateFace({});
  return face;
}

std::string ModesFile(const TriMesh& mean, int modes) {
  std::vector<float> values;
  for (int k = 0; k < modes; ++k) {
    for (const Vec3& p : mean.points) {
      const auto s = static_cast<float>(std::sin(0.02 * (k + 1) * p.z()));
      values.insert(values.end(), {300 * s, 0, 200 * s});
    }
  }
  const std::string header =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, 3), }}\n", modes,
                  mean.points.size());
  std::string bytes = "\x93NUMPY";
  bytes += {'\1', '\0', static_cast<char>(header.size()), '\0'};
  return bytes + header +
         std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

// The place of a landmark of Multi-PIE. All places differ.
Vec3 LandmarkPoint(int n) { return Face().surface.Point({0.4 + 0.005 * (n - 28), 0.5}); }

// The files of a prior with two modes; its landmarks are in reverse order.
ModesPrior WritePrior(const fs::path& folder) {
  const TriMesh mean = Tessellate(Face().surface, 2).mesh;
  CsvWriter sites({"site", "x_mm", "y_mm", "z_mm"}), features({"i_multipie", "x", "y", "z"});
  for (const auto& [site, uv] : Face().site_uv) {
    const Vec3 p = Face().surface.Point(uv);
    sites.Row(site, p.x(), p.y(), p.z());
  }
  features.Row(5, 0, 0, 0);  // of the outline: not used
  for (int n = 68; n >= 28; --n) {
    const Vec3 p = LandmarkPoint(n);
    features.Row(n, p.x(), p.y(), p.z());
  }
  const ModesPrior prior{.mean = folder / "mean.ply",
                         .modes = folder / "modes.npy",
                         .sites = folder / "sites.csv",
                         .features = folder / "features.csv",
                         .scale = 0.01};
  WriteFileAtomically(prior.mean, EncodeMesh(mean, ".ply"));
  WriteFileAtomically(prior.modes, ModesFile(mean, 2));
  WriteFileAtomically(prior.sites, sites.Text());
  WriteFileAtomically(prior.features, features.Text());
  return prior;
}

TEST(FacePrior, ItsFilesAreRead) {
  const ScratchFolder folder;
  const FacePrior prior = LoadPrior(WritePrior(folder.Path()));
  EXPECT_EQ(prior.model.Modes(), 2);
  const Vec3& p = prior.model.mean.points[700];
  EXPECT_NEAR(prior.model.modes(2100, 1), 3 * std::sin(0.04 * p.z()), 1e-3);
  EXPECT_EQ(prior.sites.size(), 32u);
  EXPECT_EQ(prior.features.size(), 41u);  // a landmark of the outline is none
  ModesPrior first = WritePrior(folder.Path());
  first.count = 1;
  EXPECT_EQ(LoadPrior(first).model.Modes(), 1);
}

// The message of LoadPrior for a spoilt prior; "none" if it accepts the prior.
std::string FaultOf(const fs::path& folder, const std::function<void(ModesPrior&)>& spoil) {
  ModesPrior prior = WritePrior(folder);
  spoil(prior);
  try {
    LoadPrior(prior);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(FacePrior, WhatCannotBeUsedIsNamed) {
  const ScratchFolder folder;
  const auto fault = [&](const std::function<void(ModesPrior&)>& spoil) {
    return FaultOf(folder.Path(), spoil);
  };
  EXPECT_EQ(fault([](ModesPrior&) {}), "none");
  EXPECT_THAT(fault([](ModesPrior& p) { p.sites.clear(); }), HasSubstr("prior.sites"));
  EXPECT_THAT(fault([&](ModesPrior& p) {
                const TriMesh other = Tessellate(Face().surface, 1).mesh;
                WriteFileAtomically(p.mean, EncodeMesh(other, ".ply"));
              }),
              HasSubstr("both must be of one mesh"));
  EXPECT_THAT(fault([](ModesPrior& p) {
                WriteFileAtomically(p.sites, "site,x_mm,y_mm,z_mm\ng,0,0,900\n");
              }),
              HasSubstr("sites.csv:2: site 'g' lies"));
  EXPECT_THAT(fault([](ModesPrior& p) {
                WriteFileAtomically(p.sites, "site,x_mm,y_mm,z_mm\nglab,0,0,0\n");
              }),
              HasSubstr("glab"));
}

TEST(FacePrior, LandmarksAreThoseOfTheirNumbersWhateverTheirOrder) {
  const ScratchFolder folder;
  const std::vector<ShapeFeature> features = LoadPrior(WritePrior(folder.Path())).features;
  ASSERT_EQ(features.size(), 41u);
  for (int n = 28; n <= 68; ++n) {
    EXPECT_LT((features[n - 28].position - LandmarkPoint(n)).norm(), 1e-9) << n;
  }
  EXPECT_EQ(features[8].clearance_mm, 14);  // 36, of the nose
  EXPECT_EQ(features[9].clearance_mm, 15);
  EXPECT_EQ(features[21].clearance_mm, 16);
}

TEST(FacePrior, LandmarksThatAreMissingTwiceThereOrElsewhereAreNamed) {
  const ScratchFolder folder;
  const auto fault = [&](const std::function<void(std::string&)>& spoil) {
    return FaultOf(folder.Path(), [&](ModesPrior& p) {
      std::string text = ReadFileBytes(p.features);
      spoil(text);
      WriteFileAtomically(p.features, text);
    });
  };
  const auto line_of = [](const std::string& text, const std::string& number) {
    const std::size_t at = text.find("\n" + number + ",") + 1;
    return text.substr(at, text.find('\n', at) + 1 - at);
  };
  const auto erase = [&](std::string& text, const std::string& number) {
    const std::string line = line_of(text, number);
    text.erase(text.find(line), line.size());
  };
  EXPECT_EQ(fault([&](std::string& text) { erase(text, "5"); }), "none");
  EXPECT_THAT(
      fault([&](std::string& text) { erase(text, "41"); }),
      HasSubstr("features.csv: a prior needs the landmarks 28 to 68 of Multi-PIE (nose, eyes, "
                "mouth), and 41 is missing"));
  EXPECT_THAT(fault([&](std::string& text) {
                erase(text, "61");
                erase(text, "68");
              }),
              HasSubstr("and 61, 68 are missing"));
  EXPECT_THAT(fault([](std::string& text) { text.resize(text.find('\n') + 1); }),
              HasSubstr("and all are missing"));
  EXPECT_THAT(fault([&](std::string& text) { text += line_of(text, "31"); }),
              HasSubstr("features.csv:44: landmark 31 appears twice"));
  EXPECT_THAT(fault([&](std::string& text) { text += line_of(text, "5"); }),
              HasSubstr("landmark 5 appears twice"));
  for (const char* wrong : {"70", "0", "-3", "30.5"}) {
    EXPECT_THAT(fault([&](std::string& text) { text += std::string(wrong) + ",0,0,0\n"; }),
                HasSubstr(std::string("landmark ") + wrong + " is none of the 68"));
  }
  EXPECT_THAT(fault([&](std::string& text) {
                erase(text, "31");
                text += "31,1000,2000,3000\n";
              }),
              AllOf(HasSubstr("features.csv:43: landmark 31 lies"), HasSubstr("at most 5 mm")));
}

TEST(FacePrior, ModesOfAnotherUnitAreRefusedWithTheScaleThatMendsThem) {
  const ScratchFolder folder;
  const auto fault = [&](double factor) {
    return FaultOf(folder.Path(), [&](ModesPrior& p) { p.scale *= factor; });
  };
  EXPECT_EQ(fault(0.1), "none");
  EXPECT_EQ(fault(10), "none");
  EXPECT_THAT(fault(1000), AllOf(HasSubstr("modes.npy: the largest mode, number "),
                                 HasSubstr("0.05 to 50 mm are allowed; a scale of 0.01 would")));
  EXPECT_THAT(fault(0.001), HasSubstr("a scale of 0.01 would make it"));
  EXPECT_THAT(fault(1e-9), HasSubstr("correct the scale, which is 1e-11"));
  EXPECT_THAT(fault(1e200), HasSubstr("e+200 mm (RMS)"));  // the square of which is none
  EXPECT_THAT(
      fault(0),
      HasSubstr("moves the points by 0 mm (RMS), and 0.05 to 50 mm are allowed; give modes"));
}

TEST(FacePrior, AnArrayWithoutAModeAndAMeanWithoutAnOrderAreNamed) {
  const ScratchFolder folder;
  EXPECT_THAT(
      FaultOf(folder.Path(),
              [](ModesPrior& p) { WriteFileAtomically(p.modes, ModesFile(ReadMesh(p.mean), 0)); }),
      HasSubstr("modes.npy: there is no mode in an array of shape (0, "));
  for (const char* name : {"mean.stl", "mean.STL"}) {
    EXPECT_THAT(FaultOf(folder.Path(),
                        [&](ModesPrior& p) {
                          const TriMesh mean = ReadMesh(p.mean);
                          p.mean = folder / name;
                          WriteFileAtomically(p.mean, EncodeMesh(mean, ".stl"));
                        }),
                HasSubstr(std::string(name) + ": an STL has no order of points"));
  }
}

// The modes of WritePrior as meshes of every format, next to files that are no meshes.
ModesPrior WithFolder(ModesPrior prior) {
  const FacePrior array = LoadPrior(prior);
  prior.modes.replace_filename("faces");
  prior.scale = 1;
  fs::remove_all(prior.modes);
  fs::create_directories(prior.modes / "others");
  const auto write = [&](const char* name, Eigen::Index mode) {
    TriMesh mesh = array.model.mean;
    mesh.points = ShapeAt(array.model, Eigen::Vector2d::Unit(mode));
    WriteFileAtomically(prior.modes / name,
                        EncodeMesh(mesh, LowerCase(fs::path(name).extension().string())));
  };
  write("2.OBJ", 1);
  write("1.ply", 0);
  WriteFileAtomically(prior.modes / "0.mtl", "newmtl none\n");
  WriteFileAtomically(prior.modes / ".0.ply", "hidden");
  return prior;
}

TEST(FacePrior, AFolderOfMeshesIsAsGoodAsAnArray) {
  const ScratchFolder folder;
  const ModesPrior array = WritePrior(folder.Path());
  ModesPrior faces = WithFolder(array);
  const Eigen::MatrixXd modes = LoadPrior(faces).model.modes;
  ASSERT_EQ(modes.cols(), 2);
  EXPECT_LT((modes - LoadPrior(array).model.modes).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_THAT(ModesPriorFiles(faces),
              ElementsAre(faces.mean, faces.modes / "1.ply", faces.modes / "2.OBJ", faces.sites,
                          faces.features));
  EXPECT_THAT(PriorFiles(array), ElementsAre(array.mean, array.modes, array.sites, array.features));
  faces.count = 1;
  EXPECT_EQ(LoadPrior(faces).model.Modes(), 1);
  EXPECT_EQ(ModesPriorFiles(faces).size(), 4u);
}

TEST(FacePrior, AFolderThatHoldsNoModesIsNamed) {
  const ScratchFolder folder;
  const auto fault = [&](const std::function<void(const TriMesh&, ModesPrior&)>& spoil) {
    return FaultOf(folder.Path(), [&](ModesPrior& p) {
      p = WithFolder(p);
      spoil(ReadMesh(p.mean), p);
    });
  };
  const auto with = [&](const char* name, const std::function<void(TriMesh&)>& change) {
    return fault([&](TriMesh mesh, const ModesPrior& p) {
      change(mesh);
      WriteFileAtomically(p.modes / name, EncodeMesh(mesh, fs::path(name).extension().string()));
    });
  };
  EXPECT_EQ(fault([](const TriMesh&, ModesPrior&) {}), "none");
  EXPECT_THAT(with("mean.ply", [](TriMesh&) {}), HasSubstr("mean.ply: it is the mean"));
  EXPECT_THAT(with("3.ply", [](TriMesh& mesh) { mesh.points.emplace_back(0, 0, 0); }),
              HasSubstr("3.ply: a mesh of"));
  EXPECT_THAT(with("3.off", [](TriMesh& mesh) { std::swap(mesh.triangles[0], mesh.triangles[1]); }),
              HasSubstr("3.off: its triangles are not those of"));
  EXPECT_THAT(with("3.stl", [](TriMesh&) {}), HasSubstr("3.stl: an STL has no order of points"));
  EXPECT_THAT(with("3.ply",
                   [](TriMesh& mesh) {
                     for (Vec3& p : mesh.points) {
                       p.z() += 60;
                     }
                   }),
              AllOf(HasSubstr("faces: the largest mode, number 3, moves the points by 60 mm"),
                    HasSubstr("in mm and in the frame of the mean")));
  EXPECT_THAT(fault([](const TriMesh&, ModesPrior& p) { p.scale = 0.001; }),
              HasSubstr("in mm, and the scale is 0.001; leave it out"));
  EXPECT_THAT(fault([](const TriMesh&, ModesPrior& p) {
                fs::remove(p.modes / "1.ply");
                fs::remove(p.modes / "2.OBJ");
              }),
              HasSubstr("faces: there is no mesh (.ply, .obj, .off)"));
}

TEST(DomainGrid, SurfaceThroughItsOwnSamplesIsTheSurface) {
  const HSplineSurface& surface = Face().surface;
  const DomainGrid grid = MakeDomainGrid(surface.shape());
  std::vector<Vec3> samples;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    samples.push_back(surface.Point(grid.UvAt(k)));
  }
  const HSplineSurface again = SurfaceThrough(surface.shape(), grid, samples);
  for (std::size_t k = 0; k < grid.size(); k += 97) {
    EXPECT_LT((again.Point(grid.UvAt(k)) - samples[k]).norm(), 0.05);
    EXPECT_EQ(grid.NearestTo(grid.UvAt(k)), k);
  }
  EXPECT_THAT(
      testing::WordsOf<InputError>([] { MakeDomainGrid({.closure = Closure::kPeriodicU}); }),
      HasSubstr("needs one that is open"));
}

TEST(PriorSurface, AShapeOfTheModelIsFollowedInTheTemplatesOwnParameters) {
  const ScratchFolder folder;
  const FacePrior prior = LoadPrior(WritePrior(folder.Path()));
  const PriorOnTemplate on_template = LayOnTemplate(prior, Face(), {});
  EXPECT_LT(on_template.rms_mm, 0.5);
  EXPECT_NEAR(on_template.mean_from_template.scale, 1, 1e-3);
  ShapeEstimate estimate;
  estimate.subject_from_model.rotation = Eigen::AngleAxisd(0.4, Vec3::UnitX()).toRotationMatrix();
  for (const Vec3& p : ShapeAt(prior.model, Eigen::Vector2d(1, -1))) {
    estimate.points.push_back(estimate.subject_from_model * p);
  }
  estimate.sigma_mm.assign(estimate.points.size(), 1.5);
  const HSplineSurface surface =
      MakeFaceSurface(estimate, prior, on_template, Face().surface.shape());
  for (const Vec2& uv : {Vec2(0.3, 0.4), Vec2(0.5, 0.5), Vec2(0.62, 0.7)}) {
    const Vec3 p = Face().surface.Point(uv);
    const double s = std::sin(0.02 * p.z()) - std::sin(0.04 * p.z());
    const Vec3 expected = estimate.subject_from_model * Vec3(p + Vec3(3 * s, 0, 2 * s));
    EXPECT_LT((surface.Point(uv) - expected).norm(), 0.3);
  }
  // A draw that lies beside the most likely shape moves every face by that, also one fitted since.
  estimate.drawn = {estimate.points, estimate.points};
  for (Vec3& p : estimate.drawn[1]) {
    p += Vec3(1, 2, 3);
  }
  const HSplineSurface stays = MovedAsDrawn(Face().surface, estimate, 0, prior, on_template),
                       moves = MovedAsDrawn(Face().surface, estimate, 1, prior, on_template);
  for (const Vec2& uv : {Vec2(0.3, 0.4), Vec2(0.5, 0.5), Vec2(0.62, 0.7)}) {
    EXPECT_LT((stays.Point(uv) - Face().surface.Point(uv)).norm(), 0.05);
    EXPECT_LT((moves.Point(uv) - stays.Point(uv) - Vec3(1, 2, 3)).norm(), 0.05);
  }
  const std::vector<Vec2> middle = {Vec2(0.5, 0.5)};
  EXPECT_NEAR(SigmaAt(middle, estimate, prior, on_template)[0], 1.5, 1e-12);
  // The points to which a fit is held, and the features at which it does not follow the implicit
  // face.
  const std::vector<ShapePoint> points = SampleShape(surface, estimate, prior, on_template);
  ASSERT_EQ(points.size(), 64u * 64);
  double area = 0;
  for (const ShapePoint& point : points) {
    EXPECT_EQ(point.position, surface.Point(point.uv));
    EXPECT_NEAR(point.sd_mm, 1.5, 1e-12);
    area += point.share / (64 * 64);
  }
  EXPECT_NEAR(area, Area(Tessellate(surface, 2).mesh), 0.01 * area);
  const std::vector<Sphere> features = FeaturesOn(estimate, prior);
  ASSERT_EQ(features.size(), 41u);
  EXPECT_EQ(features[0].radius_mm, prior.features[0].clearance_mm);
  const Vec3 nose = LandmarkPoint(28);
  const double s = std::sin(0.02 * nose.z()) - std::sin(0.04 * nose.z());
  const Vec3 moved = estimate.subject_from_model * Vec3(nose + Vec3(3 * s, 0, 2 * s));
  EXPECT_LT((features[0].center - moved).norm(), 1);
}

fs::path IctFolder() { return SEMBLANCE_SOURCE_DIR "/configs/faces/ict"; }

void ExpectFromFile(const TemplateFace& carried, const fs::path& surface) {
  const TemplateFace read = LoadTemplate(FileTemplate{.surface = surface,
                                                      .sites = IctFolder() / "sites.csv",
                                                      .features = IctFolder() / "features.json"});
  EXPECT_EQ(carried.surface.Net(0).vertices, read.surface.Net(0).vertices);
  EXPECT_EQ(carried.surface.Offsets(), read.surface.Offsets());
  EXPECT_EQ(carried.site_uv, read.site_uv);
  EXPECT_EQ(FeatureVertices(carried), FeatureVertices(read));
}

// The program contains the files of configs/faces/ict and configs/faces/people.
TEST(IctFace, IsThatOfTheFiles) {
  const TemplateFace model = LoadTemplate(IctTemplate{.mean = IctMean::kModel});
  ExpectFromFile(model, IctFolder() / "head.hspline.json");
  ExpectFromFile(LoadTemplate(IctTemplate{}), IctFolder() / "../people/head.hspline.json");
  const FacePrior prior = LoadPrior(IctPrior{.count = 3}, model),
                  from_file = LoadPrior(HSplinePrior{IctFolder() / "modes.json", 3}, model);
  EXPECT_EQ(prior.model.Modes(), 3);
  EXPECT_EQ(prior.model.modes, from_file.model.modes);
  EXPECT_EQ(prior.model.mean.points, from_file.model.mean.points);
}

// The correction is small, and does not move the sites by more than a few mm.
TEST(IctFace, PeoplesMeanIsCloseToTheModels) {
  const TemplateFace model = LoadTemplate(IctTemplate{.mean = IctMean::kModel}),
                     people = LoadTemplate(IctTemplate{});
  double largest_mm = 0;
  for (const auto& [site, uv] : model.site_uv) {
    const double moved_mm = (people.surface.Point(uv) - model.surface.Point(uv)).norm();
    EXPECT_LT(moved_mm, 4) << site;
    largest_mm = std::max(largest_mm, moved_mm);
  }
  EXPECT_GT(largest_mm, 0.3);
}

TEST(HSplinePrior, ModesOnTheTemplateMoveItAsTheMeshsModesDo) {
  const ScratchFolder folder;
  const ModesPrior source = WritePrior(folder.Path());
  const FacePrior on_mesh = LoadPrior(source);
  ModesMisfit misfit;
  const HSplineModes modes =
      ModesOnTemplate(on_mesh, LayOnTemplate(on_mesh, Face(), {}), Face(), 2, 2, &misfit);
  EXPECT_LT(misfit.rms_mm, 0.05);
  const HSplineModes again = HSplineModesFromJson(HSplineModesToJson(modes), "modes.json");
  EXPECT_EQ(again.features.size(), 41u);
  const FacePrior prior = MakePrior(again, Face(), 100);
  EXPECT_EQ(prior.model.Modes(), 2);
  EXPECT_EQ(prior.sites.size(), 32u);
  for (int n = 28; n <= 68; ++n) {
    EXPECT_LT((prior.features[n - 28].position - LandmarkPoint(n)).norm(), 2) << n;
  }
  for (std::size_t v = 0; v < prior.model.mean.points.size(); v += 313) {
    const double s = std::sin(0.04 * prior.model.mean.points[v].z());
    const Vec3 move = prior.model.modes.block<3, 1>(3 * static_cast<Eigen::Index>(v), 1);
    EXPECT_LT((move - Vec3(3 * s, 0, 2 * s)).norm(), 0.2);
  }
}

TEST(HSplinePrior, WhatCannotBeUsedIsNamed) {
  const auto fault = [](const std::string& text) -> std::string {
    try {
      HSplineModesFromJson(text, "modes.json");
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  const std::string head =
      R"({"format": "semblance face prior", "version": 1, "patches_u": 4, "patches_v": 4, "level": 0,)";
  EXPECT_THAT(fault("{"), HasSubstr("modes.json: this is not JSON"));
  EXPECT_THAT(fault(R"({"format": "x", "version": 1})"), HasSubstr("format and version"));
  EXPECT_THAT(fault(head + R"("features": [], "modes": [[1, 2]]})"), HasSubstr("has 2 numbers"));
  EXPECT_THAT(fault(head + R"("features": [], "modes": []})"), HasSubstr("no mode"));
  EXPECT_THAT(fault(head + R"("features": [], "modes": [[1.5, 1e300, 0]]})"),
              HasSubstr("an entry that is not a whole number"));
  for (const std::string wrong : {"4294967300", "4.5", "true", "-4"}) {  // 4 where they are cut
    EXPECT_THAT(fault(R"({"format": "semblance face prior", "version": 1, "patches_u": )" + wrong +
                      R"(, "patches_v": 4, "level": 0, "features": [], "modes": []})"),
                HasSubstr("patches_u is " + wrong + "; it must be a whole number"));
  }
  EXPECT_THAT(fault(head + R"("features": [{"uv": [2, 0], "clearance_mm": 1}], "modes": []})"),
              HasSubstr("outside [0,1]"));
  HSplineModes modes;
  modes.shape = {.patches_u = 4, .patches_v = 4, .max_level = 0};
  modes.level = 0;
  EXPECT_THROW(MakePrior(modes, Face(), 1), InputError);
  EXPECT_THROW(LoadPrior(NoPrior{}, Face()), InputError);
}

TEST(PriorSurface, ATemplateOfAnotherFaceIsRefused) {
  const ScratchFolder folder;
  const FacePrior prior = LoadPrior(WritePrior(folder.Path()));
  TemplateFace other = Face();
  ControlNet net = other.surface.Net(0);
  for (Vec3& p : net.vertices) {
    p.y() += 0.004 * p.z() * p.z();
  }
  other.surface.SetNet(0, net);
  EXPECT_THROW(LayOnTemplate(prior, other, {}), InputError);
}

TEST(PriorTarget, TableDepthsAreLessSureAlongTheDowel) {
  const ScratchFolder folder;
  const FacePrior prior = LoadPrior(WritePrior(folder.Path()));
  std::vector<Dowel> dowels;
  const auto add = [&](const std::string& site, const Vec3& tip, const Vec3& direction) {
    Dowel dowel;
    dowel.site = site;
    dowel.base = tip - 5 * direction;
    dowel.direction = direction;
    dowel.depth_mm = 5;
    dowels.push_back(dowel);
  };
  for (const auto& [site, uv] : Face().site_uv) {
    add(site, Face().surface.Point(uv), Face().surface.Normal(uv));
  }
  add("of_none", Vec3::Zero(), Vec3::UnitX());
  const ShapeTarget measured = PriorTarget(prior, dowels, nullptr, nullptr);
  EXPECT_EQ(measured.tips.size(), 32u);
  EXPECT_EQ(measured.tips[0].along_sd_mm, 0);
  EXPECT_NEAR(measured.start.scale, 1, 0.01);
  const TableDepthOptions table;
  dowels[3].sd_mm = 3;
  const ShapeTarget rough = PriorTarget(prior, dowels, &table, nullptr);
  EXPECT_NEAR(rough.tips[3].along_sd_mm, table.own * 3, 1e-12);  // of what the table states
  EXPECT_NEAR(rough.tips[3].shared_sd_mm, table.shared * 3, 1e-12);
  EXPECT_NEAR(rough.tips[4].shared_sd_mm, table.shared * PublishedSd_mm(dowels[4]), 1e-12);
  EXPECT_EQ(measured.tips[3].shared_sd_mm, 0);
  dowels.resize(2);
  EXPECT_THROW(PriorTarget(prior, dowels, nullptr, nullptr), InputError);
}

}  // namespace
}  // namespace semblance::problems
