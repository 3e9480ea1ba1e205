#include "principal.h"

#include <cmath>

namespace consac::twin {

PrincipalInertia PrincipalOf(const std::array<double, 6>& inertia) {
  const auto [xx, xy, xz, yy, yz, zz] = inertia;
  double a[3][3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // columns
  constexpr int kSweeps = 30;                             // a few are enough: each squares what is left
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0.0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        const double t = (theta < 0.0 ? -1.0 : 1.0) / (std::abs(theta) + std::hypot(theta, 1.0));
        const double c = 1.0 / std::hypot(t, 1.0), s = t * c;
        for (auto& row : a) {
          const double ap = row[p], aq = row[q];
          row[p] = c * ap - s * aq, row[q] = s * ap + c * aq;
        }
        for (int k = 0; k < 3; ++k) {
          const double ap = a[p][k], aq = a[q][k];
          a[p][k] = c * ap - s * aq, a[q][k] = s * ap + c * aq;
        }
        a[p][q] = a[q][p] = 0.0;
        for (auto& row : axes) {
          const double vp = row[p], vq = row[q];
          row[p] = c * vp - s * vq, row[q] = s * vp + c * vq;
        }
      }
    }
  }
  // Jacobi's rotations are rotations, so their product is no mirror.
  const std::array<double, 9> matrix = {axes[0][0], axes[0][1], axes[0][2], axes[1][0], axes[1][1],
                                        axes[1][2], axes[2][0], axes[2][1], axes[2][2]};
  return {{a[0][0], a[1][1], a[2][2]}, Normalised(robot::FromMatrix(matrix))};
}

}  // namespace consac::twin
