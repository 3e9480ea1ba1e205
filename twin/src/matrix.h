#pragma once
// Places of meshes in their files, which may stretch and shear. Private to twin.

#include <array>
#include <cmath>
#include <cstddef>

namespace consac::twin {

using Matrix = std::array<double, 12>;  ///< three rows of four

inline constexpr Matrix kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// First b, then a.
inline Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      c[4 * i + j] =
          a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j] + (j == 3 ? a[4 * i + 3] : 0.0);
    }
  }
  return c;
}

/// Whether it turns what is seen from outside into what is seen from inside.
inline bool IsMirror(const Matrix& m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
             m[2] * (m[4] * m[9] - m[5] * m[8]) <
         0.0;
}

/// Where it brings a point; false where that is further than 1e9 m away, or no number.
template <class Number>
bool PlaceCorner(const Matrix& at, const Number* point, float* out) {
  const double p[3] = {static_cast<double>(point[0]), static_cast<double>(point[1]), static_cast<double>(point[2])};
  for (std::size_t row = 0; row < 3; ++row) {
    const double value = at[4 * row] * p[0] + at[4 * row + 1] * p[1] + at[4 * row + 2] * p[2] + at[4 * row + 3];
    if (!(std::abs(value) < 1e9)) return false;
    out[row] = static_cast<float>(value);
  }
  return true;
}

}  // namespace consac::twin
