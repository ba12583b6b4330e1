// Shapes: rods, of which links are made, and solids, which stand about; what is nearest between them.
//
//      rod:  (=====)      solid:  a ball, a capsule, a box, a half-space, a hull, each a core thickened by a
//            a     b              radius; a distance field
//                         core:   a point, a segment, a box, a half-space, corners
//
// Distances are those of the cores; the radii are taken off by whoever asks. Exact in all cases, parallel
// segments and segments inside a box too; those of hulls (convex_hull.hpp) and fields (field.hpp) are lower
// bounds. Source: the least of a convex function over a segment or a square lies inside or on the border.
//
#pragma once

#include <cstdint>

#include "../numbers/angles.hpp"
#include "field.hpp"
#include "convex_hull.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A segment thickened by a radius (m): a capsule, or a sphere where both ends are one point.
struct Rod {
    Vec3<double> begin, end;
    double radius;

    /// Whether both ends coincide, so that the rod is a ball.
    bool is_sphere() const noexcept { return begin.x == end.x && begin.y == end.y && begin.z == end.z; }
};

/// The shapes that an obstacle may have.
enum class SolidKind : std::uint8_t { ball, capsule, box, half_space, hull, field };

/// The shape of one obstacle.
struct Solid {
    SolidKind kind;
    double radius;      // m, of what the core is thickened by
    Vec3<double> a;     // centre; capsule: one end; half-space: unit normal, normal . x >= offset is free
    Vec3<double> b;     // capsule: other end; box, field: half edges; half-space: {offset, 0, 0}
    Mat3<double> axes;  // of a box, a hull, a field
    const Vec3<double>* corners = nullptr;  // of a hull, from a along the axes
    int corner_count = 0;
    double reach = 0;  // of a hull's corners from a, at most
    const Field* field = nullptr;
};

/// Whether `Solid::axes` is used: boxes, hulls and fields have an orientation.
constexpr bool has_axes(SolidKind kind) noexcept {
    return kind == SolidKind::box || kind == SolidKind::hull || kind == SolidKind::field;
}

/// Transforms a solid by a frame.
inline Solid placed(const Pose<double>& frame, const Solid& solid) noexcept {
    Solid out = solid;
    if (solid.kind == SolidKind::half_space) {
        out.a = frame.rotation * solid.a;
        out.b.x = solid.b.x + dot(out.a, frame.position);
        return out;
    }
    out.a = frame.rotation * solid.a + frame.position;
    if (solid.kind == SolidKind::capsule) out.b = frame.rotation * solid.b + frame.position;
    if (has_axes(solid.kind)) out.axes = frame.rotation * solid.axes;
    return out;
}

/// Transforms a rod by a frame.
inline Rod placed(const Pose<double>& frame, const Rod& rod) noexcept {
    return {frame.rotation * rod.begin + frame.position, frame.rotation * rod.end + frame.position,
            rod.radius};
}

/// The rod as a solid: a ball if both ends are one point, else a capsule.
inline Solid as_solid(const Rod& rod) noexcept {
    const SolidKind kind = rod.is_sphere() ? SolidKind::ball : SolidKind::capsule;
    return {kind, rod.radius, rod.begin, rod.end, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

/// A bounding ball of a solid, its radius included; not for half-spaces.
struct Ball {
    Vec3<double> centre;
    double radius;
};

/// A ball that contains a solid with its radius; not for half-spaces.
inline Ball around(const Solid& solid) noexcept {
    if (solid.kind == SolidKind::capsule)
        return {(solid.a + solid.b) * 0.5, 0.5 * norm(solid.b - solid.a) + solid.radius};
    if (solid.kind == SolidKind::hull) return {solid.a, solid.reach + solid.radius};
    if (has_axes(solid.kind)) return {solid.a, norm(solid.b) + solid.radius};
    return {solid.a, solid.radius};
}

namespace detail {

/// Clamps x to [0, 1].
inline double to_unit(double x) noexcept { return min(max(x, 0.0), 1.0); }

/// The share of d, in [0, 1], at which the segment from a to a + d is nearest to the point q.
inline double foot(const Vec3<double>& a, const Vec3<double>& d, const Vec3<double>& q) noexcept {
    const double square = dot(d, d);
    return square > 0 ? to_unit(dot(q - a, d) / square) : 0.0;
}

/// The nearest points of the segments a-b and c-f, also if they are parallel. The ends and the common
/// perpendicular are compared, by cross products, which keep their digits for nearly parallel segments.
inline Approach segment_segment(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c,
                                const Vec3<double>& f) noexcept {
    const Vec3<double> d = b - a, e = f - c, across = cross(d, e), r = c - a;
    Approach best = between(a, c + e * foot(c, e, a));
    best = nearer(best, between(b, c + e * foot(c, e, b)));
    best = nearer(best, between(a + d * foot(a, d, c), c));
    best = nearer(best, between(a + d * foot(a, d, f), f));
    const double square = dot(across, across);
    if (!(square > 0)) return best;
    const double s = dot(cross(r, e), across) / square, t = dot(cross(r, d), across) / square;
    if (s > 0 && s < 1 && t > 0 && t < 1) best = nearer(best, between(a + d * s, c + e * t));
    return best;
}

/// The signed distance (m) along each axis by which a point lies outside a box around the origin; 0 inside.
inline Vec3<double> beyond(const Vec3<double>& p, const Vec3<double>& half) noexcept {
    const auto part = [](double x, double h) { return copysign(max(abs(x) - h, 0.0), x); };
    return {part(p.x, half.x), part(p.y, half.y), part(p.z, half.z)};
}

/// The share t in [0, 1] of the segment a + t d that is nearest to a box around the origin. Half the
/// derivative of the squared distance rises piecewise linearly in t, so its zero is found between two face
/// crossings. If the segment enters the box, the middle of the inner part.
inline double nearest_to_box(const Vec3<double>& a, const Vec3<double>& d,
                             const Vec3<double>& half) noexcept {
    const auto slope = [&](double t) { return dot(d, beyond(a + d * t, half)); };
    double low = 0, high = 1, first = infinity, last = -infinity;
    double slope_low = slope(0.0), slope_high = slope(1.0);
    const auto look = [&](double t) {
        if (!(t >= 0 && t <= 1)) return;
        const double here = slope(t);
        if (here == 0) {
            first = min(first, t);
            last = max(last, t);
        } else if (here < 0 && t > low) {
            low = t;
            slope_low = here;
        } else if (here > 0 && t < high) {
            high = t;
            slope_high = here;
        }
    };
    if (slope_low > 0) return 0;
    if (slope_high < 0) return 1;
    look(0);
    look(1);
    const double start[3] = {a.x, a.y, a.z}, along[3] = {d.x, d.y, d.z}, reach[3] = {half.x, half.y, half.z};
    for (int k = 0; k < 3; ++k) {
        if (along[k] == 0) continue;
        look((reach[k] - start[k]) / along[k]);
        look((-reach[k] - start[k]) / along[k]);
    }
    if (first <= last) return 0.5 * (first + last);
    const double rise = slope_high - slope_low;
    return rise > 0 ? to_unit(low - slope_low * (high - low) / rise) : low;
}

/// The nearest points of a segment and a box.
inline Approach segment_box(const Vec3<double>& a, const Vec3<double>& b, const Solid& box) noexcept {
    const Vec3<double> begin = transposed_times(box.axes, a - box.a), d = transposed_times(box.axes, b - a);
    const double t = nearest_to_box(begin, d, box.b);
    const Vec3<double> p = begin + d * t, out = beyond(p, box.b), on_rod = a + (b - a) * t;
    return {on_rod, box.a + box.axes * (p - out), norm(out)};
}

/// A corner of a box or of a field's grid; the three bits select the positive side of each axis.
inline Vec3<double> corner(const Solid& box, int bits) noexcept {
    const Vec3<double> inside{bits & 1 ? box.b.x : -box.b.x, bits & 2 ? box.b.y : -box.b.y,
                              bits & 4 ? box.b.z : -box.b.z};
    return box.a + box.axes * inside;
}

/// Transforms a place into the frame of a grid, whose origin is the first node.
inline Vec3<double> in_grid(const Solid& field, const Vec3<double>& p) noexcept {
    return transposed_times(field.axes, p - field.a) + field.b;
}

/// Transforms an approach from the frame of the grid of `field` into that of the scene.
inline Approach out_of_grid(const Solid& field, const Approach& found) noexcept {
    const auto out = [&](const Vec3<double>& p) { return field.a + field.axes * (p - field.b); };
    return {out(found.on_rod), out(found.on_solid), found.distance};
}

/// The core of a box or a hull as a convex hull; the corners of a box are stored in `own`.
inline ConvexHull as_hull(const Solid& solid, Vec3<double> (&own)[8]) noexcept {
    if (solid.kind == SolidKind::hull) return {solid.corners, solid.corner_count, {solid.axes, solid.a}};
    for (int bits = 0; bits < 8; ++bits) own[bits] = corner(solid, bits) - solid.a;
    return {own, 8, {identity_pose().rotation, solid.a}};
}

/// The nearest points of a segment and a convex hull.
inline Approach segment_hull(const Vec3<double>& a, const Vec3<double>& b, const Solid& solid) noexcept {
    const Vec3<double> middle = (a + b) * 0.5, ends[2] = {a - middle, b - middle};
    return nearest(ConvexHull{ends, 2, {identity_pose().rotation, middle}},
                   ConvexHull{solid.corners, solid.corner_count, {solid.axes, solid.a}});
}

/// The approach of a box or a hull and a field. A hull is replaced by its bounding box along its own axes.
inline Approach block_field(const Solid& block, const Solid& field) noexcept {
    Vec3<double> half = block.b, middle{0, 0, 0};
    if (block.kind == SolidKind::hull) {
        Vec3<double> low = block.corners[0], high = low;
        for (int k = 1; k < block.corner_count; ++k) {
            const Vec3<double>& p = block.corners[k];
            low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
            high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
        }
        half = (high - low) * 0.5;
        middle = (high + low) * 0.5;
    }
    const auto turned = [&](const Vec3<double>& axis) { return transposed_times(field.axes, axis); };
    const Pose<double> frame{{turned(block.axes.x), turned(block.axes.y), turned(block.axes.z)},
                             in_grid(field, block.a + block.axes * middle)};
    return out_of_grid(field, box_field(frame, half, *field.field));
}

}  // namespace detail

/// The nearest points of the segment a-b and a solid's core.
inline Approach nearest(const Vec3<double>& a, const Vec3<double>& b, const Solid& solid) noexcept {
    switch (solid.kind) {
        case SolidKind::ball: return detail::between(a + (b - a) * detail::foot(a, b - a, solid.a), solid.a);
        case SolidKind::capsule: return detail::segment_segment(a, b, solid.a, solid.b);
        case SolidKind::box: return detail::segment_box(a, b, solid);
        case SolidKind::hull: return detail::segment_hull(a, b, solid);
        case SolidKind::field:
            return detail::out_of_grid(solid, detail::segment_field(detail::in_grid(solid, a),
                                                                    detail::in_grid(solid, b), *solid.field));
        case SolidKind::half_space: break;
    }
    const double at_a = dot(solid.a, a) - solid.b.x, at_b = dot(solid.a, b) - solid.b.x;
    const Vec3<double>& deeper = at_b < at_a ? b : a;
    const double depth = min(at_a, at_b);
    return {deeper, deeper - solid.a * depth, depth};
}

/// The nearest points of two solids' cores; on_rod lies on the first. Two half-spaces, two fields, and a
/// field with a half-space are not allowed.
inline Approach nearest(const Solid& first, const Solid& second) noexcept {
    const auto is_rod = [](const Solid& s) {
        return s.kind == SolidKind::ball || s.kind == SolidKind::capsule;
    };
    const auto end = [](const Solid& s) { return s.kind == SolidKind::ball ? s.a : s.b; };
    if (is_rod(first)) return nearest(first.a, end(first), second);
    if (is_rod(second) || first.kind == SolidKind::half_space || first.kind == SolidKind::field) {
        const Approach turned = nearest(second, first);
        return {turned.on_solid, turned.on_rod, turned.distance};
    }
    if (second.kind == SolidKind::field) return detail::block_field(first, second);
    Vec3<double> room[8], other_room[8];
    const ConvexHull hull = detail::as_hull(first, room);
    if (second.kind != SolidKind::half_space) return nearest(hull, detail::as_hull(second, other_room));
    const Vec3<double> deepest = hull.farthest(-second.a);
    return nearest(deepest, deepest, second);
}

}  // namespace armangle

#include "../names/end.hpp"
