// Distance fields: on a grid of nodes, how far what stands about is at least.
//
//     o----o----o      A distance changes no faster than the place does. So at a place x each node with value
//     |   x|    |      v proves a distance of v - |x - node|, and the best of the eight about x is taken: at
//     a o----o----o      node its own value, between them at most 0.87 spacings less than the truth.
//
// What the field tells of lies within the grid, so that a place outside is at least as far away as the grid's
// border is; the way back to the border and on to an obstacle bends by a right angle or more.
#pragma once

#include "approach.hpp"
#include "least_between.hpp"

namespace armangle {

/// Values (m) at nodes, the last axis running fastest, and their spacing (m); the first node is the origin.
struct Field {
    const float* value;
    int size[3];  // of nodes along each axis, >= 2
    double spacing;

    float at(int i, int j, int k) const noexcept {
        return value[(static_cast<std::size_t>(i) * static_cast<std::size_t>(size[1]) +
                      static_cast<std::size_t>(j)) *
                         static_cast<std::size_t>(size[2]) +
                     static_cast<std::size_t>(k)];
    }
};

namespace field_rule {
/// Stretches that a segment is cut into at most; places that are kept of a box that is cut into eighths.
inline constexpr int most_pieces = 64;
/// Both stop where they are so near to what any place tells (shares of the spacing).
inline constexpr double enough = 0.0625, enough_in_box = 0.5;
}  // namespace field_rule

namespace detail {

/// Where in a grid a place is: the nearest place of the grid, its cell, and how far outside.
struct GridPlace {
    Vec3<double> inside;
    int cell[3];
    double outside;
};

inline GridPlace grid_place(const Field& field, const Vec3<double>& p) noexcept {
    GridPlace out{};
    const double x[3] = {p.x, p.y, p.z};
    double held[3];
    for (int k = 0; k < 3; ++k) {
        const int last = field.size[k] - 1;
        held[k] = min(max(x[k], 0.0), field.spacing * last);
        out.cell[k] = static_cast<int>(held[k] / field.spacing);
        if (out.cell[k] >= last) out.cell[k] = last - 1;
    }
    out.inside = {held[0], held[1], held[2]};
    out.outside = norm(p - out.inside);
    return out;
}

/// What a field proves at a place of its own frame: at least so far from all that it tells of, m; negative
/// where it may be as deep in it.
inline double at_least(const Field& field, const Vec3<double>& p) noexcept {
    const GridPlace place = grid_place(field, p);
    double most = -infinity;
    for (int bits = 0; bits < 8; ++bits) {
        const int i = place.cell[0] + (bits & 1), j = place.cell[1] + (bits >> 1 & 1),
                  k = place.cell[2] + (bits >> 2);
        const Vec3<double> node{i * field.spacing, j * field.spacing, k * field.spacing};
        most = max(most, double(field.at(i, j, k)) - norm(place.inside - node));
    }
    if (place.outside > 0) return hypot(place.outside, max(most, 0.0));
    return most;
}

/// Where the nearest obstacle is about: down the slope of what the nodes around a place say.
inline Vec3<double> towards_obstacle(const Field& field, const Vec3<double>& p) noexcept {
    const GridPlace place = grid_place(field, p);
    Vec3<double> slope = p - place.inside;
    if (place.outside == 0) {
        const auto share = [&](double x, int cell) { return x / field.spacing - cell; };
        const double x = share(place.inside.x, place.cell[0]), y = share(place.inside.y, place.cell[1]),
                     z = share(place.inside.z, place.cell[2]);
        for (int bits = 0; bits < 8; ++bits) {
            const bool a = bits & 1, b = bits & 2, c = bits & 4;
            const double value = field.at(place.cell[0] + a, place.cell[1] + b, place.cell[2] + c);
            const double in_x = a ? x : 1 - x, in_y = b ? y : 1 - y, in_z = c ? z : 1 - z;
            slope = slope + Vec3<double>{(a ? 1 : -1) * in_y * in_z, (b ? 1 : -1) * in_x * in_z,
                                         (c ? 1 : -1) * in_x * in_y} *
                                value;
        }
    }
    const double steep = norm(slope);
    return steep > 0 ? slope * (-1.0 / steep) : Vec3<double>{0, 0, 0};
}

/// A place of the field's own frame, and what is nearest to it there.
inline Approach beside_place(const Field& field, const Vec3<double>& p, double distance) noexcept {
    return {p, p + towards_obstacle(field, p) * max(at_least(field, p), 0.0), distance};
}

/// A segment in the field's own frame: its distance at least. Along a segment the square of the distance to
/// any point bends by twice the square of its length.
inline Approach segment_field(const Vec3<double>& a, const Vec3<double>& b, const Field& field) noexcept {
    struct Stretch {
        double from, F_from, to, F_to;
    };
    const Vec3<double> d = b - a;
    const double bend = 2.0 * dot(d, d), enough = field_rule::enough * field.spacing;
    double best = infinity, best_t = 0;
    const auto look = [&](double t) {
        const double here = max(at_least(field, mul_add(d, t, a)), 0.0);
        if (here < best) {
            best = here;
            best_t = t;
        }
        return here * here;
    };
    const double F_a = look(0.0);
    if (bend == 0) return beside_place(field, a, best);
    const auto lowest = [bend](const Stretch& s) {
        return least_between(s.F_from, s.F_to, bend, s.to - s.from);
    };
    Stretch stretch[field_rule::most_pieces]{{0.0, F_a, 1.0, look(1.0)}};
    double least = 0;
    for (int count = 1;; ++count) {
        int low = 0;
        for (int k = 1; k < count; ++k)
            if (lowest(stretch[k]) < lowest(stretch[low])) low = k;
        least = sqrt(max(lowest(stretch[low]), 0.0));
        if (count == field_rule::most_pieces || best - least <= enough) break;
        const Stretch old = stretch[low];
        const double middle = 0.5 * (old.from + old.to), F_middle = look(middle);
        stretch[low] = {old.from, old.F_from, middle, F_middle};
        stretch[count] = {middle, F_middle, old.to, old.F_to};
    }
    return beside_place(field, mul_add(d, best_t, a), least);
}

/// A box of half edges about `frame`, which is seen in the field's own frame: its distance at least.
inline Approach box_field(const Pose<double>& frame, const Vec3<double>& half, const Field& field) noexcept {
    struct Piece {
        Vec3<double> centre, half;
    };
    Piece stack[field_rule::most_pieces]{{{0, 0, 0}, half}};
    Vec3<double> lowest = frame.position;
    double least = infinity;
    for (int count = 1; count > 0;) {
        const Piece piece = stack[--count];
        const Vec3<double> place = frame.rotation * piece.centre + frame.position;
        const double size = norm(piece.half), bound = max(at_least(field, place) - size, 0.0);
        if (bound >= least) continue;
        if (size <= field_rule::enough_in_box * field.spacing || count + 2 > field_rule::most_pieces) {
            least = bound;
            lowest = place;
            continue;
        }
        Vec3<double> along{0, 0, 0};
        if (piece.half.x >= piece.half.y && piece.half.x >= piece.half.z)
            along.x = 0.5 * piece.half.x;
        else if (piece.half.y >= piece.half.z)
            along.y = 0.5 * piece.half.y;
        else
            along.z = 0.5 * piece.half.z;
        stack[count++] = {piece.centre - along, piece.half - along};
        stack[count++] = {piece.centre + along, piece.half - along};
    }
    return beside_place(field, lowest, least);
}

}  // namespace detail

}  // namespace armangle
