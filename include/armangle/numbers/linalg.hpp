// Vectors, rotations and poses for any scalar type; only the operations that the formulas use.
#pragma once

#include "scalar.hpp"
#include "tolerances.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A vector of three scalars.
template <class T>
struct Vec3 {
    T x, y, z;

    ARMANGLE_INLINE friend Vec3 operator+(const Vec3& a, const Vec3& b) noexcept {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    ARMANGLE_INLINE friend Vec3 operator-(const Vec3& a, const Vec3& b) noexcept {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    ARMANGLE_INLINE friend Vec3 operator*(const Vec3& a, const T& k) noexcept {
        return {a.x * k, a.y * k, a.z * k};
    }
    ARMANGLE_INLINE friend Vec3 operator-(const Vec3& a) noexcept { return {-a.x, -a.y, -a.z}; }
};

/// The scalar product.
template <class T>
ARMANGLE_INLINE T dot(const Vec3<T>& a, const Vec3<T>& b) noexcept {
    return mul_add(a.x, b.x, mul_add(a.y, b.y, a.z * b.z));
}

/// The vector product.
template <class T>
ARMANGLE_INLINE Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The length.
template <class T>
ARMANGLE_INLINE T norm(const Vec3<T>& a) noexcept {
    return sqrt(dot(a, a));
}

/// a k + b
template <class T>
ARMANGLE_INLINE Vec3<T> mul_add(const Vec3<T>& a, const T& k, const Vec3<T>& b) noexcept {
    return {mul_add(a.x, k, b.x), mul_add(a.y, k, b.y), mul_add(a.z, k, b.z)};
}

/// a x + b y
template <class T>
ARMANGLE_INLINE Vec3<T> combine(const Vec3<T>& a, const T& x, const Vec3<T>& b, const T& y) noexcept {
    return mul_add(a, x, b * y);
}

/// For each component, the value that the mask selects.
template <class M, class T>
ARMANGLE_INLINE Vec3<T> select(const M& mask, const Vec3<T>& yes, const Vec3<T>& no) noexcept {
    return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}

/// A rotation by its columns: the axes x, y, z of one frame seen in another.
template <class T>
struct Mat3 {
    Vec3<T> x, y, z;
};

template <class T>
ARMANGLE_INLINE Vec3<T> operator*(const Mat3<T>& r, const Vec3<T>& v) noexcept {
    return mul_add(r.x, v.x, mul_add(r.y, v.y, r.z * v.z));
}

template <class T>
ARMANGLE_INLINE Mat3<T> operator*(const Mat3<T>& a, const Mat3<T>& b) noexcept {
    return {a * b.x, a * b.y, a * b.z};
}

/// r^T v; if r is a rotation, the inverse rotation of v.
template <class T>
ARMANGLE_INLINE Vec3<T> transposed_times(const Mat3<T>& r, const Vec3<T>& v) noexcept {
    return {dot(r.x, v), dot(r.y, v), dot(r.z, v)};
}

/// A rigid transform: rotation and position (m).
template <class T>
struct Pose {
    Mat3<T> rotation;
    Vec3<T> position;
};

template <class T>
ARMANGLE_INLINE Pose<T> operator*(const Pose<T>& a, const Pose<T>& b) noexcept {
    return {a.rotation * b.rotation, a.rotation * b.position + a.position};
}

/// A constant vector as a vector of the scalar type T, the same in every lane.
template <class T>
ARMANGLE_INLINE Vec3<T> spread(const Vec3<double>& v) noexcept {
    return {T(v.x), T(v.y), T(v.z)};
}

/// A constant pose as a pose of the scalar type T, equal in every lane.
template <class T>
ARMANGLE_INLINE Pose<T> spread(const Pose<double>& p) noexcept {
    return {{spread<T>(p.rotation.x), spread<T>(p.rotation.y), spread<T>(p.rotation.z)},
            spread<T>(p.position)};
}

/// The identity.
ARMANGLE_INLINE Pose<double> identity_pose() noexcept {
    return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
}

/// The inverse of a transform whose rotation is orthonormal.
template <class T>
ARMANGLE_INLINE Pose<T> inverted(const Pose<T>& p) noexcept {
    const auto& [x, y, z] = p.rotation;
    return {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}},
            {-dot(x, p.position), -dot(y, p.position), -dot(z, p.position)}};
}

/// Largest entry of |R^T R - I|. A NaN entry may go unnoticed here; is_rigid detects it.
template <class T>
ARMANGLE_INLINE T orthonormality_error(const Mat3<T>& r) noexcept {
    const T one(1.0);
    const T lengths = max(max(abs(dot(r.x, r.x) - one), abs(dot(r.y, r.y) - one)), abs(dot(r.z, r.z) - one));
    return max(lengths, max(max(abs(dot(r.x, r.y)), abs(dot(r.y, r.z))), abs(dot(r.z, r.x))));
}

/// Whether a pose is finite and within tolerance::farthest, and its rotation is proper and orthonormal within
/// the tolerance.
ARMANGLE_INLINE bool is_rigid(const Pose<double>& p) noexcept {
    const auto& [x, y, z] = p.rotation;
    const bool near = abs(p.position.x) + abs(p.position.y) + abs(p.position.z) <= tolerance::farthest;
    return near && orthonormality_error(p.rotation) <= tolerance::rotation &&
           dot(cross(x, y), z) > 0;  // false for NaN
}

}  // namespace armangle

#include "../names/end.hpp"
