// SPDX-License-Identifier: GPL-3.0-or-later
// STEP and IGES are read back by OpenCASCADE and compared at random (u,v).
#include "surfaces/hspline_files/face_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <BRepCheck_Analyzer.hxx>
#include <BRep_Tool.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <IGESControl_Reader.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <numeric>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/patch_tree.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;

struct CadFormat {
  const char* ending;
  std::string (*write)(const HSplineSurface&);
};

std::vector<Handle(Geom_Surface)> SurfacesOf(const TopoDS_Shape& shape) {
  std::vector<Handle(Geom_Surface)> surfaces;
  for (TopExp_Explorer at(shape, TopAbs_FACE); at.More(); at.Next()) {
    Handle(Geom_Surface) surface = BRep_Tool::Surface(TopoDS::Face(at.Current()));
    const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface);
    surfaces.push_back(trimmed.IsNull() ? surface : trimmed->BasisSurface());
  }
  return surfaces;
}

TopoDS_Shape ShapeIn(const CadFormat& format, const std::string& bytes) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  const testing::ScratchFolder folder;
  const std::filesystem::path path = folder.Path() / (std::string("face") + format.ending);
  WriteFileAtomically(path, bytes);
  STEPControl_Reader step;
  IGESControl_Reader iges;
  XSControl_Reader& reader =
      format.ending == std::string(".step") ? static_cast<XSControl_Reader&>(step) : iges;
  EXPECT_EQ(reader.ReadFile(path.c_str()), IFSelect_RetDone);
  reader.TransferRoots();
  return reader.OneShape();
}

std::vector<Handle(Geom_Surface)> ReadBack(const CadFormat& format, const std::string& bytes) {
  return SurfacesOf(ShapeIn(format, bytes));
}

class CadExport : public ::testing::TestWithParam<std::tuple<HSplineShape, CadFormat>> {
 protected:
  const HSplineShape& shape() const { return std::get<0>(GetParam()); }
  const CadFormat& format() const { return std::get<1>(GetParam()); }
};

TEST_P(CadExport, ReadsBackAsTheSameSurface) {
  HSplineSurface surface = testing::SmoothSurface(shape(), 1);
  surface.SetOffsets({{{5, 70, 80}, Vec3(1, 2, 3)}, {{1, 3, 3}, Vec3(-1, 2, 1)}});
  const std::vector<Handle(Geom_Surface)> faces = ReadBack(format(), format().write(surface));
  ASSERT_EQ(faces.size(), FewRegions(shape(), PatchTree(surface)).size());
  EXPECT_GT(faces.size(), 1u);
  Random random(2);
  double area = 0;
  for (const Handle(Geom_Surface) & face : faces) {
    const auto spline = Handle(Geom_BSplineSurface)::DownCast(face);
    ASSERT_FALSE(spline.IsNull());
    EXPECT_EQ(spline->UDegree(), 3);
    double u0, u1, v0, v1;
    spline->Bounds(u0, u1, v0, v1);
    area += (u1 - u0) * (v1 - v0);
    for (int k = 0; k < 50; ++k) {
      const Vec2 uv(random.Uniform(u0, u1), random.Uniform(v0, v1));
      const gp_Pnt p = spline->Value(uv.x(), uv.y());
      EXPECT_LT((Vec3(p.X(), p.Y(), p.Z()) - surface.Point(uv)).norm(), 1e-9) << uv.transpose();
    }
  }
  EXPECT_NEAR(area, 1, 1e-9);  // the faces cover the domain once
}

TEST_P(CadExport, AFaceWithMuchDetailIsOneSurface) {
  HSplineSurface surface = testing::SmoothSurface(shape(), 2);
  for (int i = 1; i < 9; ++i) {
    surface.SetOffsets({{{2, i, 8}, Vec3(1, 2, 3)}});
  }
  ASSERT_GT(UniformRegions(PatchTree(surface)).size(), 1u);
  const std::vector<Handle(Geom_Surface)> faces = ReadBack(format(), format().write(surface));
  ASSERT_EQ(faces.size(), 1u);
  const gp_Pnt p = faces[0]->Value(0.3, 0.4);
  EXPECT_LT((Vec3(p.X(), p.Y(), p.Z()) - surface.Point({0.3, 0.4})).norm(), 1e-9);
}

TEST_P(CadExport, ASurfaceThatClosesDoesSoInTheFile) {
  const TopoDS_Shape read = ShapeIn(format(), format().write(testing::SmoothSurface(shape(), 4)));
  const std::vector<Handle(Geom_Surface)> faces = SurfacesOf(read);
  ASSERT_EQ(faces.size(), 1u);
  EXPECT_EQ(faces[0]->IsUClosed(), shape().ClosedU());
  EXPECT_FALSE(faces[0]->IsVClosed());
  EXPECT_TRUE(BRepCheck_Analyzer(read).IsValid());
}

TEST_P(CadExport, BytesDoNotDependOnTheTime) {
  const HSplineSurface surface = RandomSurface(shape(), 3);
  const std::string first = format().write(surface);
  EXPECT_TRUE(first == format().write(surface));  // thousands of lines, not to be printed
  EXPECT_THAT(first, ::testing::HasSubstr("1970"));
}

INSTANTIATE_TEST_SUITE_P(
    Formats, CadExport,
    ::testing::Combine(
        ::testing::Values(
            HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 5},
            HSplineShape{
                .patches_u = 5, .patches_v = 4, .max_level = 5, .closure = Closure::kPeriodicU}),
        ::testing::Values(CadFormat{".step", &SurfaceToStep}, CadFormat{".igs", &SurfaceToIges})));

}  // namespace
}  // namespace semblance::surfaces
