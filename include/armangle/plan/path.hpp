// Paths of the tool: poses at any parameter s in [0, 1], with every derivative, in one form for all kinds.
//
//     s = 0 |--- segment ---|------ segment ------|--- segment ---| s = 1
//                           t = 0             t = 1
//
// A segment moves the point by p(t) = origin + t along + a cos(beta t) + b sin(beta t) and the frame by
// R(t) = Rot(axis, alpha t) R_0, t in [0, 1]: a line, an arc and a screw are choices of the constants. The
// formulas are templates of the scalar.
#pragma once

#include <cstddef>

#include "../numbers/rotations.hpp"
#include "../numbers/tolerances.hpp"

namespace armangle {

struct Segment {
    double start, end;  // the range of s
    Vec3<double> origin, along, a, b;
    double beta;
    Mat3<double> rotation;  // at t = 0
    Vec3<double> axis;      // in the frame of the poses; a unit vector
    double alpha;
};

/// The doubles of a segment: how one travels through an array.
inline constexpr std::size_t segment_width = sizeof(Segment) / sizeof(double);

/// Pose of a segment at s.
template <class T>
Pose<T> pose_at(const Segment& g, const T& s) noexcept {
    const T t = (s - T(g.start)) / (T(g.end) - T(g.start));
    Pose<T> out;
    out.position = spread<T>(g.origin) + spread<T>(g.along) * t;
    if (g.beta != 0) {
        const SinCos<T> sc = sin_cos(T(g.beta) * t);
        out.position = out.position + spread<T>(g.a) * sc.cos + spread<T>(g.b) * sc.sin;
    }
    const auto& [x, y, z] = g.rotation;
    if (g.alpha == 0) {
        out.rotation = {spread<T>(x), spread<T>(y), spread<T>(z)};
    } else {
        const SinCos<T> sc = sin_cos(T(g.alpha) * t);
        out.rotation = {rotated(x, g.axis, sc), rotated(y, g.axis, sc), rotated(z, g.axis, sc)};
    }
    return out;
}

/// Angular velocity per unit of s, constant on a segment.
inline Vec3<double> angular_velocity(const Segment& g) noexcept {
    return g.axis * (g.alpha / (g.end - g.start));
}

/// The segment that holds s; at a joint of two the later one.
inline std::size_t segment_index(const Segment* segments, std::size_t n, double s) noexcept {
    std::size_t low = 0, high = n;
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        (s >= segments[middle].start ? low : high) = middle;
    }
    return low;
}

/// The shortest rotation that takes one frame to another: unit axis and angle in [0, pi].
struct AxisAngle {
    Vec3<double> axis;
    double angle;
};

inline AxisAngle shortest_rotation(const Mat3<double>& from, const Mat3<double>& to) noexcept {
    // D = to from^T by its entries: its columns are the images of the unit vectors.
    const auto entry = [&](const Vec3<double>& i, const Vec3<double>& j) {  // i . D j
        return dot(i, to.x) * dot(j, from.x) + dot(i, to.y) * dot(j, from.y) + dot(i, to.z) * dot(j, from.z);
    };
    const Vec3<double> ex{1, 0, 0}, ey{0, 1, 0}, ez{0, 0, 1};
    const Vec3<double> skew{entry(ez, ey) - entry(ey, ez), entry(ex, ez) - entry(ez, ex),
                            entry(ey, ex) - entry(ex, ey)};
    const double xx = entry(ex, ex), yy = entry(ey, ey), zz = entry(ez, ez), trace = xx + yy + zz;
    const double sine = norm(skew), angle = atan2(sine, trace - 1.0);
    if (sine == 0 && trace > 0) return {ez, 0.0};
    if (trace > -0.5) return {skew * (1.0 / sine), angle};
    // near half a turn: the symmetric part holds the axis, its largest column best
    const double xy = 0.5 * (entry(ex, ey) + entry(ey, ex)), yz = 0.5 * (entry(ey, ez) + entry(ez, ey)),
                 zx = 0.5 * (entry(ez, ex) + entry(ex, ez));
    const double c = 0.5 * (trace - 1.0);
    Vec3<double> axis{zx, yz, zz - c};
    if (xx >= yy && xx >= zz)
        axis = {xx - c, xy, zx};
    else if (yy >= zz)
        axis = {xy, yy - c, yz};
    axis = axis * (1.0 / norm(axis));
    return {dot(axis, skew) < 0 ? -axis : axis, angle};
}

namespace detail {

/// The segment that stays at a pose.
inline Segment still(double start, double end, const Pose<double>& from) noexcept {
    const Vec3<double> nought{0, 0, 0};
    return {start,     end, from.position, nought, nought, nought, 0.0, orthonormal(from.rotation),
            {0, 0, 1}, 0.0};
}

/// Turns a segment from its first rotation to another, the short way.
inline void turn_to(Segment& g, const Mat3<double>& to) noexcept {
    const AxisAngle turn = shortest_rotation(g.rotation, orthonormal(to));
    g.axis = turn.axis;
    g.alpha = turn.angle;
}

}  // namespace detail

/// Straight line at constant speed; the frame takes the shortest rotation, or keeps its first orientation.
inline Segment line(double start, double end, const Pose<double>& from, const Pose<double>& to,
                    bool fixed) noexcept {
    Segment g = detail::still(start, end, from);
    g.along = to.position - from.position;
    if (!fixed) detail::turn_to(g, to.rotation);
    return g;
}

/// Turn about a line of points (unit direction) by an angle, with an advance (m) along it; `carried`: the
/// frame turns too.
inline Segment screw(double start, double end, const Pose<double>& from, const Vec3<double>& point,
                     const Vec3<double>& direction, double angle, double advance, bool carried) noexcept {
    Segment g = detail::still(start, end, from);
    const Vec3<double> arm = from.position - point, axial = direction * dot(direction, arm);
    g.origin = point + axial;
    g.along = direction * advance;
    g.a = arm - axial;
    g.b = cross(direction, g.a);
    g.beta = angle;
    if (angle == 0) g.origin = from.position;
    if (carried) {
        g.axis = direction;
        g.alpha = angle;
    }
    return g;
}

/// Centre, axis and angle in (0, 2 pi) of the arc from one point over a second to a third; angle 0 where they
/// lie on a line.
struct ArcThrough {
    Vec3<double> centre, axis;
    double angle;
};

inline ArcThrough arc_through(const Vec3<double>& from, const Vec3<double>& via,
                              const Vec3<double>& to) noexcept {
    const Vec3<double> a = via - from, b = to - from, normal = cross(a, b);
    const double size = norm(normal), aa = dot(a, a), bb = dot(b, b);
    if (!(size > tolerance::angle * sqrt(aa * bb)) || size == 0) return {from, {0, 0, 1}, 0.0};
    const Vec3<double> axis = normal * (1.0 / size);
    const Vec3<double> centre =
        from + (cross(normal, a) * bb - cross(normal, b) * aa) * (0.5 / (size * size));
    const Vec3<double> r = from - centre, end = to - centre;
    const double angle = atan2(dot(axis, cross(r, end)), dot(r, end));
    return {centre, axis, angle > 0 ? angle : angle + two_pi};
}

/// The same arc with the frame taking the shortest rotation to another.
inline Segment arc_to(Segment g, const Pose<double>& to) noexcept {
    detail::turn_to(g, to.rotation);
    return g;
}

}  // namespace armangle
