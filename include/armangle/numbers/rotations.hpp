// Common descriptions of a rotation: quaternion, turns about fixed axes, axis times angle.
#pragma once

#include "angles.hpp"
#include "linalg.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Rodrigues' formula from its three vectors: v cos + (axis x v) sin + axis (axis . v) (1 - cos).
template <class T>
Vec3<T> rodrigues(const Vec3<T>& v, const Vec3<T>& across, const Vec3<T>& along,
                  const SinCos<T>& sc) noexcept {
    return v * sc.cos + across * sc.sin + along * (T(1.0) - sc.cos);
}

}  // namespace detail

/// The trace of the rotation from one frame to another: above 1 within a right angle.
template <class T>
T trace_between(const Mat3<T>& a, const Mat3<T>& b) noexcept {
    return dot(a.x, b.x) + dot(a.y, b.y) + dot(a.z, b.z);
}

/// Rotates a constant vector v around a unit axis by an angle (sine and cosine).
template <class T>
Vec3<T> rotated(const Vec3<double>& v, const Vec3<double>& axis, const SinCos<T>& sc) noexcept {
    const Vec3<T> across = spread<T>(cross(axis, v)), along = spread<T>(axis * dot(axis, v));
    return detail::rodrigues(spread<T>(v), across, along, sc);
}

/// Rotates a vector v of any scalar type around a unit axis by an angle (sine and cosine).
template <class T>
Vec3<T> turned(const Vec3<T>& v, const Vec3<double>& axis, const SinCos<T>& sc) noexcept {
    const Vec3<T> about = spread<T>(axis);
    return detail::rodrigues(v, cross(about, v), about * dot(about, v), sc);
}

/// The rotation about a unit axis by an angle (rad).
inline Mat3<double> rotation(const Vec3<double>& axis, double angle) noexcept {
    const SinCos<double> sc = sin_cos(angle);
    return {rotated(Vec3<double>{1, 0, 0}, axis, sc), rotated(Vec3<double>{0, 1, 0}, axis, sc),
            rotated(Vec3<double>{0, 0, 1}, axis, sc)};
}

/// The rotation of the quaternion w + x i + y j + z k, which is normalized first; it must not be 0.
inline Mat3<double> from_quaternion(double w, double x, double y, double z) noexcept {
    const double length = sqrt(w * w + x * x + y * y + z * z);
    w /= length;
    x /= length;
    y /= length;
    z /= length;
    return {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
            {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
            {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
}

/// The rotation of roll, pitch and yaw (rad) around the fixed axes x, then y, then z, as in URDF: Rz(yaw)
/// Ry(pitch) Rx(roll).
inline Mat3<double> from_rpy(double roll, double pitch, double yaw) noexcept {
    return rotation({0, 0, 1}, yaw) * rotation({0, 1, 0}, pitch) * rotation({1, 0, 0}, roll);
}

/// The rotation around the direction of v by the length of v (rad).
inline Mat3<double> from_rotation_vector(const Vec3<double>& v) noexcept {
    const double largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if (largest == 0) return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const Vec3<double> scaled{v.x / largest, v.y / largest, v.z / largest};  // no square that underflows
    const double length = norm(scaled);
    return rotation(scaled * (1.0 / length), largest * length);
}

/// The rotation nearest to a matrix that is a rotation within 1e-6: two Newton steps R (3 - R^T R) / 2.
template <class T>
Mat3<T> orthonormal(Mat3<T> r) noexcept {
    for (int pass = 0; pass < 2; ++pass) {
        const T xx = dot(r.x, r.x), yy = dot(r.y, r.y), zz = dot(r.z, r.z);
        const T xy = dot(r.x, r.y), yz = dot(r.y, r.z), zx = dot(r.z, r.x), three(3.0);
        const Mat3<T> step{{0.5 * (three - xx), -0.5 * xy, -0.5 * zx},
                           {-0.5 * xy, 0.5 * (three - yy), -0.5 * yz},
                           {-0.5 * zx, -0.5 * yz, 0.5 * (three - zz)}};
        r = r * step;
    }
    return r;
}

namespace detail {

/// Rotates a pose around its own z axis by an angle (sine and cosine).
template <class T>
ARMANGLE_INLINE Pose<T> turned_about_z(const Pose<T>& from, const SinCos<T>& angle) noexcept {
    const auto& [x, y, z] = from.rotation;
    return {{combine(x, angle.cos, y, angle.sin), combine(y, angle.cos, x, -angle.sin), z}, from.position};
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
