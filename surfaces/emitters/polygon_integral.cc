// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/polygon_integral.h"

#include <cmath>

namespace semblance::surfaces {
namespace {

// With R^2 = height^2 + rho^2 the integrand is the divergence of the radial field g(rho) with n rho
// g = height^-n - R^-n. Along an edge at distance d the flux of g is (J_0 / height^n - J_n) / n,
// where J_m is the integral of d / (rho^2 R^m). From 1 / (rho^2 R^2) = (1 / rho^2 - 1 / R^2) /
// height^2 follows J_m = (J_{m-2} - d I_m) / height^2, where I_m is the integral of R^-m. Hence n
// times the flux is height^-n (J_0 - height^m J_m), with m the parity of n, plus the sum of d I_j /
// height^(n-j+2).
struct Edge {
  double d, t0, t1;
  double r0, r1;  // R at the ends
};

// J_0 - height J_1: two arctangents per end, combined into one.
double AngleLeft(const Edge& e, double height) {
  const double x0 = e.t0 * e.d * (e.r0 - height), y0 = e.d * e.d * e.r0 + height * e.t0 * e.t0;
  const double x1 = e.t1 * e.d * (e.r1 - height), y1 = e.d * e.d * e.r1 + height * e.t1 * e.t1;
  return std::atan2(x1 * y0 - x0 * y1, y0 * y1 + x0 * x1);
}

// I_2 or I_3, in closed form.
double FirstLength(const Edge& e, double a2, bool odd) {
  if (odd) {
    return (e.t1 / e.r1 - e.t0 / e.r0) / a2;
  }
  const double a = std::sqrt(a2);
  return std::atan2(a * (e.t1 - e.t0), a2 + e.t0 * e.t1) / a;
}

// height^n times n times the flux.
double Flux(const Edge& e, double height, int n) {
  const bool odd = (n & 1) != 0;
  const double h2 = height * height, a2 = h2 + e.d * e.d;
  const double inverse0 = 1 / (e.r0 * e.r0), inverse1 = 1 / (e.r1 * e.r1);
  double length = FirstLength(e, a2, odd);  // I_j from I_{j-2}, by parts
  double end0 = e.t0 * inverse0 / (odd ? e.r0 : 1), end1 = e.t1 * inverse1 / (odd ? e.r1 : 1);
  double sum = 0, power = odd ? height : 1;
  for (int j = odd ? 3 : 2; j <= n; j += 2) {
    sum += power * length;
    length = ((end1 - end0) + (j - 1) * length) / (j * a2);
    end0 *= inverse0;
    end1 *= inverse1;
    power *= h2;
  }
  return e.d * sum + (odd ? AngleLeft(e, height) : 0);
}

Edge Seen(const EdgeFromFoot& edge, double height) {
  const double a2 = height * height + edge.distance * edge.distance;
  return {edge.distance, edge.begin, edge.end, std::sqrt(a2 + edge.begin * edge.begin),
          std::sqrt(a2 + edge.end * edge.end)};
}

}  // namespace

double IntegrateAlong(const EdgeFromFoot& edge, double height, int n) {
  const Edge e = Seen(edge, height);
  const bool odd = (n & 1) != 0;
  const double a2 = height * height + e.d * e.d;
  const double inverse0 = 1 / (e.r0 * e.r0), inverse1 = 1 / (e.r1 * e.r1);
  double length = FirstLength(e, a2, odd);
  double end0 = e.t0 * inverse0 / (odd ? e.r0 : 1), end1 = e.t1 * inverse1 / (odd ? e.r1 : 1);
  for (int j = odd ? 3 : 2; j < n; j += 2) {
    length = ((end1 - end0) + (j - 1) * length) / (j * a2);
    end0 *= inverse0;
    end1 *= inverse1;
  }
  return length;
}

double IntegrateInversePower(std::span<const EdgeFromFoot> edges, double height, int n) {
  double flux = 0;
  for (const EdgeFromFoot& edge : edges) {
    flux += Flux(Seen(edge, height), height, n);
  }
  const double inverse2 = 1 / (height * height);
  double scale = (n & 1) != 0 ? 1 / height : 1;
  for (int m = n >> 1; m > 0; --m) {
    scale *= inverse2;
  }
  return flux * scale / n;
}

}  // namespace semblance::surfaces
