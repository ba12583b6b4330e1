// Paths of the end effector: poses at any parameter s in [0, 1], with every derivative, in one form.
//
//     s = 0 |--- segment ---|------ segment ------|--- segment ---| s = 1        corners
//     s = 0 |--- segment -|blend|--- segment ---|blend|- segment -| s = 1        rounded: C2
//
// A segment moves the point by p(t) = origin + t along + a cos(beta t) + b sin(beta t) and the frame by R(t)
// = Rot(axis, alpha t) R_0, t in [0, 1]. A line, an arc and a screw are choices of the constants. The
// formulas are templates of the scalar.
//
// A blend adds the end of one motion and the beginning of the next. With u in [0, 1] the first is at t =
// e(u), the second at t = h(u), both of degree 4,
//     e = 2 u - 2 u^3 + u^4   e(1) = 1, e'(1) = e''(1) = 0; e'(0) = 2, e''(0) = 0
//     h = 2 u^3 - u^4         h(0) = h'(0) = h''(0) = 0; h'(1) = 2, h''(1) = 0
// so that pose, velocity and acceleration are continuous with both neighbours. Each of its poses is within
// min(1 - e, h) <= 3/16 of the part cut off from a pose of the path, in m and in rad.
//
// If the roll is free, a path may be rolled: its frame then also turns about its own z axis by roll + rate s.
// A constant roll goes into R_0, because Rot(axis, alpha t) multiplies from the left.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "../numbers/rotations.hpp"
#include "../numbers/tolerances.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Motion of a point and a frame over t in [0, 1], relative to its start.
struct Motion {
    Vec3<double> along, a, b;
    double beta;
    Vec3<double> axis;  // in the frame of the poses; a unit vector
    double alpha;
};

/// One piece of a path: a motion from an origin, or a blend of the motions on its two sides.
struct Segment {
    double start, end;  // the range of s
    Vec3<double> origin;
    Mat3<double> rotation;  // at t = 0
    Motion motion;
    Motion next;     // of a blend: begins while `motion` ends
    double blended;  // 1: a blend of both; 0: `motion` alone
    double rolled;   // turn of the frame about its own z axis over the range of s
};

/// The number of doubles of a segment, for storing it in an array.
inline constexpr std::size_t segment_width = sizeof(Segment) / sizeof(double);

/// Parameters of paths of the end effector.
struct PathTuning {
    static constexpr double radian = 0.2;      // m that count as one radian in the size of a motion
    static constexpr double off = 3.0 / 16.0;  // greatest min(1 - e, h): deviation of a blend per cut
    static constexpr double apart = 1e-9;      // m and rad: segments with a larger gap do not join
};

/// The progress e(u) of the motion that ends in a blend.
template <class T>
T ending(const T& u) noexcept {
    return u * (T(2.0) + u * u * (u - T(2.0)));
}

/// The progress h(u) of the motion that begins in a blend.
template <class T>
T beginning(const T& u) noexcept {
    return u * u * u * (T(2.0) - u);
}

namespace detail {

/// The position of s within a segment, in [0, 1].
template <class T>
T share(const Segment& g, const T& s) noexcept {
    return (s - T(g.start)) / (T(g.end) - T(g.start));
}

/// A frame rotated around its own z axis by an angle (sine and cosine).
template <class T>
Mat3<T> about_own_z(const Mat3<T>& frame, const SinCos<T>& sc) noexcept {
    return {frame.x * sc.cos + frame.y * sc.sin, frame.y * sc.cos - frame.x * sc.sin, frame.z};
}

/// A frame rotated around the axis of a motion by t times its angle.
template <class T>
Mat3<T> turned(const Mat3<T>& frame, const Motion& w, const T& t) noexcept {
    if (w.alpha == 0) return frame;
    const SinCos<T> sc = sin_cos(T(w.alpha) * t);
    return {turned(frame.x, w.axis, sc), turned(frame.y, w.axis, sc), turned(frame.z, w.axis, sc)};
}

}  // namespace detail

/// The pose of a segment at s, for any scalar.
template <class T>
Pose<T> pose_at(const Segment& g, const T& s) noexcept {
    const T u = detail::share(g, s);
    const T t = g.blended != 0 ? ending(u) : u;
    const Motion& w = g.motion;
    Pose<T> out;
    out.position = spread<T>(g.origin) + spread<T>(w.along) * t;
    if (w.beta != 0) {
        const SinCos<T> sc = sin_cos(T(w.beta) * t);
        out.position = out.position + spread<T>(w.a) * sc.cos + spread<T>(w.b) * sc.sin;
    }
    const auto& [x, y, z] = g.rotation;
    if (w.alpha == 0) {
        out.rotation = {spread<T>(x), spread<T>(y), spread<T>(z)};
    } else {
        const SinCos<T> sc = sin_cos(T(w.alpha) * t);
        out.rotation = {rotated(x, w.axis, sc), rotated(y, w.axis, sc), rotated(z, w.axis, sc)};
    }
    if (g.blended != 0) {
        const Motion& n = g.next;
        const T h = beginning(u);
        out.position = out.position + spread<T>(n.along) * h;
        if (n.beta != 0) {
            const SinCos<T> sc = sin_cos(T(n.beta) * h);
            out.position = out.position + spread<T>(n.a) * (sc.cos - T(1.0)) + spread<T>(n.b) * sc.sin;
        }
        out.rotation = detail::turned(out.rotation, n, h);
    }
    if (g.rolled != 0) out.rotation = detail::about_own_z(out.rotation, sin_cos(T(g.rolled) * u));
    return out;
}

/// The angular velocity (rad per unit of s) of a segment, in the frame of the poses.
template <class T>
Vec3<T> angular_velocity(const Segment& g, const T& s) noexcept {
    const T rate = T(1.0) / (T(g.end) - T(g.start));
    Vec3<T> out = spread<T>(g.motion.axis * g.motion.alpha) * rate;
    if (g.blended != 0) {
        const T u = detail::share(g, s);
        const T starts = u * u * (T(6.0) - T(4.0) * u);  // h'; e' = 2 - h'
        const SinCos<T> sc = sin_cos(T(g.next.alpha) * beginning(u));
        out = spread<T>(g.next.axis * g.next.alpha) * (rate * starts) +
              turned(out * (T(2.0) - starts), g.next.axis, sc);
    }
    if (g.rolled != 0) out = out + pose_at(g, s).rotation.z * (T(g.rolled) * rate);
    return out;
}

/// The index of the segment that contains s; between two, the later one.
inline std::size_t segment_index(const Segment* segments, std::size_t n, double s) noexcept {
    std::size_t low = 0, high = n;
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        (s >= segments[middle].start ? low : high) = middle;
    }
    return low;
}

/// A rotation as unit axis and angle in [0, pi] (rad).
struct AxisAngle {
    Vec3<double> axis;
    double angle;
};

/// The shortest rotation from one frame to another; around any suitable axis if its angle is 180 degrees.
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
    // near half a turn: the symmetric part holds the axis, its largest column most accurately
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

/// A constant segment at a pose, from s = `start` to `end`.
inline Segment still(double start, double end, const Pose<double>& from) noexcept {
    const Vec3<double> nought{0, 0, 0};
    const Motion none{nought, nought, nought, 0.0, {0, 0, 1}, 0.0};
    return {start, end, from.position, orthonormal(from.rotation), none, none, 0.0, 0.0};
}

/// Sets the rotation of segment g such that it ends in the orientation `to`, by the shortest rotation.
inline void turn_to(Segment& g, const Mat3<double>& to) noexcept {
    const AxisAngle turn = shortest_rotation(g.rotation, orthonormal(to));
    g.motion.axis = turn.axis;
    g.motion.alpha = turn.angle;
}

}  // namespace detail

/// A straight line at constant speed from s = `start` to `end`. The frame takes the shortest rotation, or
/// keeps its first orientation if `fixed`.
inline Segment line(double start, double end, const Pose<double>& from, const Pose<double>& to,
                    bool fixed) noexcept {
    Segment g = detail::still(start, end, from);
    g.motion.along = to.position - from.position;
    if (!fixed) detail::turn_to(g, to.rotation);
    return g;
}

/// A rotation from s = `start` to `end` around a line (point, unit direction) by an angle (rad), with an
/// advance (m) along it; `carried`: the frame rotates too.
inline Segment screw(double start, double end, const Pose<double>& from, const Vec3<double>& point,
                     const Vec3<double>& direction, double angle, double advance, bool carried) noexcept {
    Segment g = detail::still(start, end, from);
    const Vec3<double> arm = from.position - point, axial = direction * dot(direction, arm);
    g.origin = point + axial;
    g.motion.along = direction * advance;
    g.motion.a = arm - axial;
    g.motion.b = cross(direction, g.motion.a);
    g.motion.beta = angle;
    if (angle == 0) g.origin = from.position;
    if (carried) {
        g.motion.axis = direction;
        g.motion.alpha = angle;
    }
    return g;
}

/// Centre, axis and angle in (0, 2 pi) of the arc from one point through a second to a third. The angle is 0
/// if they lie on a line.
struct ArcThrough {
    Vec3<double> centre, axis;
    double angle;
};

/// The circular arc from one point through another to a third (m); its angle is 0 if they lie on a line.
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

/// The segment g with the same positions, but the shortest rotation from its first orientation to that of a
/// pose.
inline Segment arc_to(Segment g, const Pose<double>& to) noexcept {
    detail::turn_to(g, to.rotation);
    return g;
}

/// The length (m) of the path of the tool's origin in a motion.
inline double length(const Motion& w) noexcept {
    return norm(Vec3<double>{norm(w.along), w.beta * norm(w.a), 0});
}
/// The angle (rad) by which a motion rotates.
inline double turn(const Motion& w) noexcept { return abs(w.alpha); }

/// A bound of the angle (rad) by which frame or point turn in a segment, as if at their largest rate
/// throughout: a blend begins or ends at twice its mean rate.
inline double largest_angle(const Segment& g) noexcept {
    const double first = max(abs(g.motion.alpha), abs(g.motion.beta));
    return max(abs(g.rolled),
               g.blended != 0 ? 2 * (first + max(abs(g.next.alpha), abs(g.next.beta))) : first);
}

/// The size (m) of a segment, where a radian counts as 0.2 m: sqrt(length^2 + turn^2) of its motions, plus
/// its roll.
inline double size(const Segment& g) noexcept {
    const auto of = [](const Motion& w) {
        return norm(Vec3<double>{length(w), PathTuning::radian * turn(w), 0});
    };
    return of(g.motion) + (g.blended != 0 ? of(g.next) : 0.0) + PathTuning::radian * abs(g.rolled);
}

namespace detail {

/// The part of a segment (no blend, not rolled) between two of its t.
inline Segment part(const Segment& g, double from, double to) noexcept {
    Segment out = g;
    const Motion& w = g.motion;
    const double share = to - from;
    const SinCos<double> moved = sin_cos(w.beta * from);
    out.start = g.start + (g.end - g.start) * from;
    out.end = g.start + (g.end - g.start) * to;
    out.origin = g.origin + w.along * from;
    out.rotation = turned(g.rotation, w, from);
    out.motion.along = w.along * share;
    out.motion.a = w.a * moved.cos + w.b * moved.sin;
    out.motion.b = w.b * moved.cos - w.a * moved.sin;
    out.motion.beta = w.beta * share;
    out.motion.alpha = w.alpha * share;
    return out;
}

}  // namespace detail

/// The segment with its frame also rotated around its own z axis, by roll + rate s (rad).
inline Segment rolled(Segment g, double roll, double rate) noexcept {
    g.rotation = detail::about_own_z(g.rotation, sin_cos(roll + rate * g.start));
    g.rolled += rate * (g.end - g.start);
    return g;
}

/// A path of consecutive segments, with the largest deviation of its poses from the given segments, and of
/// given corners from it: m and rad.
struct Joined {
    std::vector<Segment> segments;
    double off_position = 0, off_rotation = 0;
};

/// Joins segments to one path. Each gets a range of s in proportion to its size; constant ones are left out.
/// Corners are rounded: the blend after segment i begins and ends `radius[i]` (m, by size) from its corner,
/// at most at the middle of a segment. Radius 0: no blend. Blends or rolled segments need all radii 0.
inline Joined joined(std::span<const Segment> given, std::span<const double> radius) {
    Joined out;
    std::vector<Segment> whole;
    std::vector<double> reach;  // of the blend after each; ignored after a constant segment
    double total = 0;
    for (std::size_t i = 0; i < given.size(); ++i) {
        const Segment& g = given[i];
        if (!(size(g) > 0)) {
            if (!reach.empty()) reach.back() = min(reach.back(), radius[i]);
            continue;
        }
        whole.push_back(g);
        reach.push_back(radius[i]);
        whole.back().start = total;
        total += size(g);
        whole.back().end = total;
    }
    if (whole.empty()) {
        out.segments.push_back(given.front());
        out.segments.back().start = 0;
        out.segments.back().end = 1;
        return out;
    }
    double before = 0;  // share of the segment used by the blend before it
    for (std::size_t i = 0; i < whole.size(); ++i) {
        const Segment& g = whole[i];
        if (i + 1 == whole.size() || reach[i] == 0) {
            out.segments.push_back(before > 0 ? detail::part(g, before, 1) : g);
            before = 0;
            continue;
        }
        const Segment& after = whole[i + 1];
        const double cut = min(reach[i], 0.5 * min(size(g), size(after)));
        const double left = cut / size(g), taken = cut / size(after);
        if (1 - left > before) out.segments.push_back(detail::part(g, before, 1 - left));
        Segment blend = detail::part(g, 1 - left, 1);
        blend.next = detail::part(after, 0, taken).motion;
        blend.end += cut;
        blend.blended = 1;
        const Pose<double> corner = pose_at(after, after.start),
                           middle = pose_at(blend, 0.5 * (blend.start + blend.end));
        out.off_position = max(max(out.off_position, norm(middle.position - corner.position)),
                               PathTuning::off * max(length(blend.motion), length(blend.next)));
        out.off_rotation =
            max(max(out.off_rotation, shortest_rotation(middle.rotation, corner.rotation).angle),
                PathTuning::off * max(turn(blend.motion), turn(blend.next)));
        out.segments.push_back(blend);
        before = taken;
    }
    for (Segment& g : out.segments) {
        g.start /= total;
        g.end /= total;
    }
    for (std::size_t i = 0; i + 1 < out.segments.size(); ++i) out.segments[i].end = out.segments[i + 1].start;
    out.segments.back().end = 1;
    return out;
}

/// The gap between the end of a segment and the start of the next: the larger of the distance (m) and the
/// rotation (rad).
inline double gap(const Segment& before, const Segment& after) noexcept {
    const Pose<double> from = pose_at(before, before.end), to = pose_at(after, after.start);
    return max(norm(to.position - from.position), shortest_rotation(from.rotation, to.rotation).angle);
}

}  // namespace armangle

#include "../names/end.hpp"
