// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/core/vector3.hpp"

namespace risley {

/// Three by three numbers of any scalar of the model, for kernels: see Vector3.
template <class T>
struct Matrix3 {
  Vector3<T> column[3];

  /// @param entry  column by column; anything convertible to T
  template <class Number>
  static Matrix3 from_columns(const Number (&entry)[9]) {
    Matrix3 m;
    for (int k = 0; k < 3; ++k) {
      m.column[k] = {T(entry[3 * k]), T(entry[3 * k + 1]), T(entry[3 * k + 2])};
    }
    return m;
  }

  friend Vector3<T> operator*(const Matrix3& m, const Vector3<T>& v) {
    return v.x * m.column[0] + v.y * m.column[1] + v.z * m.column[2];
  }
};

/// The transpose of m times v.
template <class T>
Vector3<T> transposed_product(const Matrix3<T>& m, const Vector3<T>& v) {
  return {dot(m.column[0], v), dot(m.column[1], v), dot(m.column[2], v)};
}

}  // namespace risley
