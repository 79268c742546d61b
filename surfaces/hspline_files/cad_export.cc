// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/face_export.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRep_Builder.hxx>
#include <Geom_BSplineSurface.hxx>
#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Writer.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <XSControl_WorkSession.hxx>
#include <sstream>

#include "surfaces/base/error.h"
#include "surfaces/hspline/patch_tree.h"

namespace semblance::surfaces {
namespace {

// Suppresses OpenCASCADE's messages, because a library does not print.
class Silence {
 public:
  Silence() : printers_(Message::DefaultMessenger()->Printers()) {
    Message::DefaultMessenger()->ChangePrinters().Clear();
  }
  ~Silence() { Message::DefaultMessenger()->ChangePrinters() = printers_; }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  Message_SequenceOfPrinters printers_;
};

// The simple knots (first - 3 .. first + count + 3) / patches.
TColStd_Array1OfReal UniformKnots(int first, int count, int patches) {
  TColStd_Array1OfReal knots(1, count + 7);
  for (int k = 0; k < count + 7; ++k) {
    knots.SetValue(k + 1, double(first + k - 3) / patches);
  }
  return knots;
}

Handle(Geom_BSplineSurface)
    RegionSurface(const HSplineSurface& surface, const PatchRegion& region) {
  const ControlNet net = RegionNet(surface, region);
  TColgp_Array2OfPnt poles(1, net.columns, 1, net.rows);
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const Vec3& p = net.At(i, j);
      poles.SetValue(i + 1, j + 1, gp_Pnt(p.x(), p.y(), p.z()));
    }
  }
  const int m = surface.shape().PatchesU(region.level), n = surface.shape().PatchesV(region.level);
  TColStd_Array1OfInteger once_u(1, region.columns + 7), once_v(1, region.rows + 7);
  once_u.Init(1);
  once_v.Init(1);
  const Handle(Geom_BSplineSurface) spline =
      new Geom_BSplineSurface(poles, UniformKnots(region.i, region.columns, m),
                              UniformKnots(region.j, region.rows, n), once_u, once_v, 3, 3);
  // Inserts knots until the surface is clamped at its ends, which every CAD program can read.
  spline->Segment(double(region.i) / m, double(region.i + region.columns) / m, double(region.j) / n,
                  double(region.j + region.rows) / n);
  return spline;
}

// Puts all faces into one shell, so that CAD programs show one part and not an assembly.
TopoDS_Shell Faces(const HSplineSurface& surface) {
  constexpr double kTolerance_mm = 1e-7;
  const BRep_Builder builder;
  TopoDS_Shell shell;
  builder.MakeShell(shell);
  for (const PatchRegion& region : FewRegions(surface.shape(), PatchTree(surface))) {
    BRepBuilderAPI_MakeFace face(RegionSurface(surface, region), kTolerance_mm);
    if (!face.IsDone()) {
      throw InputError("CAD export: a part of the surface has no area; move its vertices apart");
    }
    builder.Add(shell, face.Face());
  }
  return shell;
}

Handle(TCollection_HAsciiString) Text(const char* text) {
  return new TCollection_HAsciiString(text);
}

// Sets the fields that OpenCASCADE would fill with the time and a counter.
void SetNames(const Handle(StepData_StepModel) & model) {
  APIHeaderSection_MakeHeader header(model);
  header.SetName(Text("face"));
  header.SetTimeStamp(Text("1970-01-01T00:00:00"));
  header.SetOriginatingSystem(Text("semblance"));
  for (int k = 1; k <= model->NbEntities(); ++k) {
    if (const auto product = Handle(StepBasic_Product)::DownCast(model->Value(k))) {
      product->SetId(Text("face"));
      product->SetName(Text("face"));
    }
  }
}

}  // namespace

bool HasCad() { return true; }

std::string SurfaceToStep(const HSplineSurface& surface) {
  const Silence silence;
  STEPControl_Writer writer;
  Interface_Static::SetCVal("write.step.unit", "MM");
  if (writer.Transfer(Faces(surface), STEPControl_ShellBasedSurfaceModel) != IFSelect_RetDone) {
    throw InputError("STEP: OpenCASCADE could not convert the surface");
  }
  const Handle(StepData_StepModel) model = writer.Model();
  SetNames(model);
  StepData_StepWriter text(model);
  text.SendModel(Handle(StepData_Protocol)::DownCast(writer.WS()->Protocol()));
  std::ostringstream stream;
  if (!text.Print(stream)) {
    throw InputError("STEP: OpenCASCADE could not write the surface");
  }
  return stream.str();
}

std::string SurfaceToIges(const HSplineSurface& surface) {
  const Silence silence;
  IGESControl_Writer writer("MM", 0);  // 0: trimmed surfaces, entity 144
  writer.AddShape(Faces(surface));
  writer.ComputeModel();
  IGESData_GlobalSection header = writer.Model()->GlobalSection();
  header.SetDate(Text("19700101.000000"));
  header.SetLastChangeDate(Text("19700101.000000"));
  header.SetFileName(Text("face.igs"));
  header.SetAuthorName(Text("semblance"));
  writer.Model()->SetGlobalSection(header);
  std::ostringstream stream;
  if (!writer.Write(stream)) {
    throw InputError("IGES: OpenCASCADE could not write the surface");
  }
  return stream.str();
}

}  // namespace semblance::surfaces
