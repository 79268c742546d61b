// SPDX-License-Identifier: GPL-3.0-or-later
// ITK's BSplineScatteredDataPointSetToImageFilter as a peer of fit_bench.
//
// itk_peer POINTS GRID LEVELS: files as for fitpack_peer.py. Bicubic, open (closed in u, ITK 5.2
// stops with a fault), from 4 x 4 control points, twice as many patches each level. Prints
// processor seconds of the fit, and the root mean square and the largest distance from the clean
// surface.
#include <itkBSplineControlPointImageFunction.h>
#include <itkBSplineScatteredDataPointSetToImageFilter.h>
#include <itkImage.h>
#include <itkMultiThreaderBase.h>
#include <itkPointSet.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

namespace {

using Vector = itk::Vector<double, 3>;
using PointSet = itk::PointSet<Vector, 2>;
using Image = itk::Image<Vector, 2>;
using Filter = itk::BSplineScatteredDataPointSetToImageFilter<PointSet, Image>;
using Function = itk::BSplineControlPointImageFunction<Image>;

constexpr int kSide = 256;  // of the image that the filter samples; its borders are 0 and 1

std::vector<double> Doubles(const char* file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  std::vector<double> values(static_cast<std::size_t>(in.tellg()) / sizeof(double));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(values.data()),
          static_cast<std::streamsize>(values.size() * sizeof(double)));
  return values;
}

PointSet::Pointer PointsOf(const std::vector<double>& values) {
  auto points = PointSet::New();
  for (std::size_t k = 0; k < values.size() / 5; ++k) {
    PointSet::PointType at;
    at[0] = values[5 * k];
    at[1] = values[5 * k + 1];
    Vector value;
    for (int c = 0; c < 3; ++c) {
      value[c] = values[5 * k + 2 + c];
    }
    points->SetPoint(k, at);
    points->SetPointData(k, value);
  }
  return points;
}

Filter::Pointer FilterOf(const PointSet* points, int levels) {
  auto filter = Filter::New();
  Image::SpacingType spacing;
  spacing.Fill(1.0 / (kSide - 1));
  Image::SizeType size;
  size.Fill(kSide);
  Filter::ArrayType control_points;
  control_points.Fill(4);
  filter->SetInput(points);
  filter->SetOrigin(itk::Point<double, 2>(0.0));
  filter->SetSpacing(spacing);
  filter->SetSize(size);
  filter->SetSplineOrder(3);
  filter->SetNumberOfControlPoints(control_points);
  filter->SetNumberOfLevels(levels);
  filter->SetGenerateOutputImage(false);
  filter->SetNumberOfWorkUnits(1);
  return filter;
}

// Where the filter leaves its control points, the function finds them.
Function::Pointer FunctionOf(Filter& filter) {
  auto function = Function::New();
  function->SetOrigin(filter.GetOrigin());
  function->SetSpacing(filter.GetSpacing());
  function->SetSize(filter.GetSize());
  function->SetSplineOrder(3);
  function->SetInputImage(filter.GetPhiLattice());
  return function;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::fprintf(stderr, "usage: itk_peer POINTS GRID LEVELS\n");
    return 2;
  }
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  const PointSet::Pointer points = PointsOf(Doubles(arguments[1]));
  const std::vector<double> clean = Doubles(arguments[2]);
  const std::clock_t begin = std::clock();
  const Filter::Pointer filter = FilterOf(points, std::atoi(arguments[3]));
  filter->Update();
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const Function::Pointer function = FunctionOf(*filter);
  const auto side = static_cast<std::size_t>(std::lround(std::sqrt(clean.size() / 3.0)));
  double sum = 0, largest = 0;
  for (std::size_t k = 0; k < side * side; ++k) {
    Function::PointType at;
    at[0] = (static_cast<double>(k % side) + 0.5) / static_cast<double>(side);
    at[1] = (static_cast<double>(k / side) + 0.5) / static_cast<double>(side);
    const Vector value = function->Evaluate(at);
    double square = 0;
    for (int c = 0; c < 3; ++c) {
      square += std::pow(value[c] - clean[3 * k + c], 2);
    }
    sum += square;
    largest = std::max(largest, square);
  }
  std::printf("%.6g %.6g %.6g\n", seconds, std::sqrt(sum / static_cast<double>(side * side)),
              std::sqrt(largest));
  return 0;
}
