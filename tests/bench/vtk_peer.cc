// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/vtk_peer.h"

#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImplicitFunction.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPolyData.h>
#include <vtkSampleFunction.h>

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

}  // namespace semblance::bench
