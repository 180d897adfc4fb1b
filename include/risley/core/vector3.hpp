// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

namespace risley {

/// Three components of any scalar of the model. Eigen is not used here because its vectorisation
/// assumes that a scalar is one number, while a batch is several.
template <class T>
struct Vector3 {
  T x{}, y{}, z{};

  Vector3() = default;
  Vector3(const T& x_value, const T& y_value, const T& z_value)
      : x(x_value), y(y_value), z(z_value) {}
  // Member by member: gcc 12 copies three batches as one block of memory, which slows the kernels
  // down by a tenth.
  Vector3(const Vector3& other) : x(other.x), y(other.y), z(other.z) {}
  Vector3& operator=(const Vector3& other) {
    x = other.x;
    y = other.y;
    z = other.z;
    return *this;
  }
  ~Vector3() = default;

  friend Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend Vector3 operator-(const Vector3& a) { return {-a.x, -a.y, -a.z}; }
  friend Vector3 operator*(const T& s, const Vector3& a) { return {s * a.x, s * a.y, s * a.z}; }
  Vector3& operator+=(const Vector3& b) { return *this = *this + b; }
};

/// Scalar product.
template <class T>
T dot(const Vector3<T>& a, const Vector3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Vector product a x b: right-handed, perpendicular to both.
template <class T>
Vector3<T> cross(const Vector3<T>& a, const Vector3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Length, in the unit of the components.
template <class T>
T norm(const Vector3<T>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

/// The unit vector along a; not finite for a vector of length 0.
template <class T>
Vector3<T> normalized(const Vector3<T>& a) {
  return (T(1.0) / norm(a)) * a;
}

}  // namespace risley
