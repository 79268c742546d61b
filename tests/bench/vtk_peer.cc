// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/vtk_peer.h"

#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImplicitFunction.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSampleFunction.h>
#include <vtkStaticCellLocator.h>

#include <cmath>

namespace semblance::bench {
using namespace problems;
namespace {

class FieldFunction : public vtkImplicitFunction {
 public:
  static FieldFunction* New();
  vtkTypeMacro(FieldFunction, vtkImplicitFunction);

  const ScalarField* field = nullptr;

  double EvaluateFunction(double x[3]) override { return (*field)(Vec3(x[0], x[1], x[2])); }
  void EvaluateGradient(double*, double*) override {}  // no normals are asked for
};
vtkStandardNewMacro(FieldFunction);

}  // namespace

std::size_t TrianglesByVtk(const ScalarField& field, const SampleGrid& grid) {
  vtkNew<FieldFunction> function;
  function->field = &field;
  const Vec3 last = grid.Corner(grid.counts[0] - 1, grid.counts[1] - 1, grid.counts[2] - 1);
  vtkNew<vtkSampleFunction> samples;
  samples->SetImplicitFunction(function);
  samples->SetSampleDimensions(grid.counts[0], grid.counts[1], grid.counts[2]);
  samples->SetModelBounds(grid.origin.x(), last.x(), grid.origin.y(), last.y(), grid.origin.z(),
                          last.z());
  samples->ComputeNormalsOff();
  vtkNew<vtkFlyingEdges3D> edges;
  edges->SetInputConnection(samples->GetOutputPort());
  edges->SetValue(0, 0);
  edges->ComputeNormalsOff();
  edges->ComputeGradientsOff();
  edges->ComputeScalarsOff();
  edges->Update();
  return static_cast<std::size_t>(edges->GetOutput()->GetPolys()->GetNumberOfCells());
}

double ClosestByVtk(const TriMesh& mesh, std::span<const Vec3> points) {
  vtkNew<vtkPoints> corners;
  corners->SetDataTypeToDouble();
  for (const Vec3& p : mesh.points) {
    corners->InsertNextPoint(p.data());
  }
  vtkNew<vtkCellArray> cells;
  for (const Triangle& t : mesh.triangles) {
    cells->InsertNextCell({t[0], t[1], t[2]});
  }
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(corners);
  surface->SetPolys(cells);
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(surface);
  locator->BuildLocator();
  double sum_mm = 0;
  for (const Vec3& p : points) {
    double closest[3], squared = 0;
    vtkIdType cell = 0;
    int part = 0;
    locator->FindClosestPoint(p.data(), closest, cell, part, squared);
    sum_mm += std::sqrt(squared);
  }
  return sum_mm;
}

std::size_t SurfacesByVtk(const std::string& volume, const std::vector<double>& values) {
  vtkNew<vtkNIFTIImageReader> reader;
  reader->SetFileName(volume.c_str());
  std::size_t triangles = 0;
  for (const double value : values) {
    vtkNew<vtkFlyingEdges3D> edges;
    edges->SetInputConnection(reader->GetOutputPort());
    edges->SetValue(0, value);
    edges->ComputeNormalsOff();
    edges->ComputeGradientsOff();
    edges->ComputeScalarsOff();
    edges->Update();
    triangles += static_cast<std::size_t>(edges->GetOutput()->GetPolys()->GetNumberOfCells());
  }
  return triangles;
}

}  // namespace semblance::bench
