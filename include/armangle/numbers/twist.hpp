// Rigid motions as six numbers: the difference of two poses, and the pose after a motion.
#pragma once

#include "rotations.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Rotation vector of a rotation: along its axis, its length the angle in [0, pi] (rad).
inline Vec3<double> rotation_vector(const Mat3<double>& r) noexcept {
    const Vec3<double> twice_sine{r.y.z - r.z.y, r.z.x - r.x.z, r.x.y - r.y.x};
    const double sine = 0.5 * norm(twice_sine), cosine = 0.5 * (r.x.x + r.y.y + r.z.z - 1.0);
    const double angle = atan2(sine, cosine);
    if (cosine > -0.9) return twice_sine * (sine > 0 ? 0.5 * angle / sine : 0.5);
    // Near half a turn the sine loses the axis. R + R^T + (1 - tr R) I = 2 (1 - cos) axis axis^T keeps it.
    const double rest = -2.0 * cosine;
    const Vec3<double> columns[] = {{2 * r.x.x + rest, r.x.y + r.y.x, r.x.z + r.z.x},
                                    {r.x.y + r.y.x, 2 * r.y.y + rest, r.y.z + r.z.y},
                                    {r.x.z + r.z.x, r.y.z + r.z.y, 2 * r.z.z + rest}};
    int longest = 0;
    for (int i = 1; i < 3; ++i)
        if (dot(columns[i], columns[i]) > dot(columns[longest], columns[longest])) longest = i;
    const Vec3<double>& axis = columns[longest];
    const double size = norm(axis), side = dot(axis, twice_sine) < 0 ? -1.0 : 1.0;
    return axis * (side * angle / size);
}

/// The transpose, which is the inverse rotation.
inline Mat3<double> transposed(const Mat3<double>& r) noexcept {
    return {{r.x.x, r.y.x, r.z.x}, {r.x.y, r.y.y, r.z.y}, {r.x.z, r.y.z, r.z.z}};
}

/// A rigid motion (m, rad) around the body's own origin, in the frame in which poses are given.
struct Twist {
    Vec3<double> linear{0, 0, 0}, angular{0, 0, 0};

    friend Twist operator*(const Twist& t, double k) noexcept { return {t.linear * k, t.angular * k}; }
    friend Twist operator+(const Twist& a, const Twist& b) noexcept {
        return {a.linear + b.linear, a.angular + b.angular};
    }
    friend Twist operator-(const Twist& a, const Twist& b) noexcept {
        return {a.linear - b.linear, a.angular - b.angular};
    }
};

/// The motion that leads from one pose to another.
inline Twist difference(const Pose<double>& from, const Pose<double>& to) noexcept {
    return {to.position - from.position, rotation_vector(to.rotation * transposed(from.rotation))};
}

/// The pose after the motion `move`, with an orthonormal rotation.
inline Pose<double> moved_by(const Pose<double>& pose, const Twist& move) noexcept {
    return {orthonormal(from_rotation_vector(move.angular) * pose.rotation), pose.position + move.linear};
}

/// The size sqrt(|dp|^2 + (length |angle|)^2) of a motion in m; `length` converts one radian to metres.
inline double size(const Twist& t, double length) noexcept {
    return sqrt(dot(t.linear, t.linear) + length * length * dot(t.angular, t.angular));
}

}  // namespace armangle

#include "../names/end.hpp"
