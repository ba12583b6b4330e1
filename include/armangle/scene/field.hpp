// Distance fields: on a grid of nodes, how far what stands about is at least.
//
//     o----o----o      A distance changes no faster than the place does. So at a place x a node with value v
//     |   x|    |      proves a distance of v - r, r = |x - node|, and with phi(r) >= r also v - phi(r). The
//     o----o----o      field at x is the best of all nodes:   f(x) = max (v - phi(r)).
//
// phi grows 5/3 as fast beyond one spacing, which makes f a function of its surroundings: where values of
// neighbours (26 of them) differ by no more than they are apart (`settle`), nodes two spacings away or more
// lose. For let n be such a node and m its neighbour in the direction of x: of the 26 one is within 27.6
// degrees of it, so that r_m^2 <= r^2 - 1.77 s r + s^2, s = |n - m|, and phi(r) - phi(r_m) >= s >= v_n - v_m.
// So 64 nodes about x are looked at, f goes without leaps, and by at most 5/3 of the way.
//
// What the field tells of lies within the grid, so that a place outside is at least as far away as the grid's
// border is; the way back to the border and on to an obstacle bends by a right angle or more.
//
// A segment is asked at even places, a spacing apart or less, of which the least counts: the one
// function that arcs, distances and the widest arm angle are of.
#pragma once

#include "../numbers/lane.hpp"
#include "approach.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Values (m) at nodes, the last axis running fastest, and their spacing (m); the first node is the origin.
struct Field {
    const float* value;
    int size[3];  // of nodes along each axis, >= 2
    double spacing;

    /// The index into `value` of node (i, j, k).
    std::size_t place(int i, int j, int k) const noexcept {
        return (static_cast<std::size_t>(i) * static_cast<std::size_t>(size[1]) +
                static_cast<std::size_t>(j)) *
                   static_cast<std::size_t>(size[2]) +
               static_cast<std::size_t>(k);
    }
    /// The distance (m) at a node.
    float at(int i, int j, int k) const noexcept { return value[place(i, j, k)]; }
};

/// Parameters of distance fields.
struct FieldTuning {
    /// Of phi beyond one spacing, and so of a field: at most so much a metre.
    static constexpr double steepest = 5.0 / 3.0;
    /// Places that a segment is asked at, and how far apart they are at most while there are enough
    /// (spacings).
    static constexpr int most_places = 256;
    static constexpr double apart = 1.0;
    /// A length this little longer (share) has no place more: the same segment, turned, has as many.
    static constexpr double same_length = 1e-6;
    /// Arcs of a field are where its distance says that they are: what they leave is no nearer by more than
    /// so much (shares of the spacing), and what they take no farther away.
    static constexpr double agreed_free = 0.01, agreed_blocked = 0.25;
    /// Shorter stretches (rad) that are proven neither way count as blocked: less than a thousandth of a
    /// millimetre is nothing beside a spacing.
    static constexpr double sliver = 1e-6;
    /// Places that are kept of a box that is cut into eighths, and where that ends (share of the spacing).
    static constexpr int most_pieces = 64;
    static constexpr double enough_in_box = 0.5;
};

/// Raises each of `value` (m), at the nodes of the field's grid, to the lower bound that the values of its
/// neighbours prove. One pass in rising order and one in falling order suffice.
inline void raise_to_lower_bounds(const Field& field, float* value) noexcept {
    const double length[4] = {0.0, field.spacing, sqrt(2.0) * field.spacing, sqrt(3.0) * field.spacing};
    const auto raise = [&](int i, int j, int k, int way) {
        double most = value[field.place(i, j, k)];
        for (int code = 0; code < 13; ++code) {  // the 13 neighbours that come before in this order
            const int a = i + way * (code / 9 - 1), b = j + way * (code / 3 % 3 - 1),
                      c = k + way * (code % 3 - 1);
            if (a < 0 || b < 0 || c < 0 || a >= field.size[0] || b >= field.size[1] || c >= field.size[2])
                continue;
            most = max(most, value[field.place(a, b, c)] - length[(a != i) + (b != j) + (c != k)]);
        }
        const float near = static_cast<float>(most);  // rounded down: values stay lower bounds
        value[field.place(i, j, k)] =
            near > most ? std::nextafter(near, -std::numeric_limits<float>::max()) : near;
    };
    for (int i = 0; i < field.size[0]; ++i)
        for (int j = 0; j < field.size[1]; ++j)
            for (int k = 0; k < field.size[2]; ++k) raise(i, j, k, 1);
    for (int i = field.size[0] - 1; i >= 0; --i)
        for (int j = field.size[1] - 1; j >= 0; --j)
            for (int k = field.size[2] - 1; k >= 0; --k) raise(i, j, k, -1);
}

namespace detail {

/// A place relative to a grid: the nearest place within the grid, its cell, and its distance (m) from the
/// grid.
struct GridPlace {
    Vec3<double> inside;
    int cell[3];
    double outside;
};

/// Finds a place, given in the frame of the field, in the grid.
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

/// The 64 nodes around a place of a grid, and their values (m).
struct Surroundings {
    int node[3][4];
    double value[64];

    /// Reads the 64 nodes around a place.
    Surroundings(const Field& field, const GridPlace& place) noexcept {
        for (int axis = 0; axis < 3; ++axis)
            for (int k = 0; k < 4; ++k) {
                const int at = place.cell[axis] - 1 + k, last = field.size[axis] - 1;
                node[axis][k] = at > last ? last : (at > 0) * at;
            }
        for (int row = 0; row < 16; ++row) {
            const float* from = &field.value[field.place(node[0][row / 4], node[1][row % 4], 0)];
            for (int k = 0; k < 4; ++k) value[4 * row + k] = from[node[2][k]];
        }
    }

    /// Writes the squared distances along one axis, in spacings, from coordinate p to the four nodes to
    /// `out`; `per`: 1 / spacing.
    void squares(double p, int axis, double per, double (&out)[4]) const noexcept {
        for (int k = 0; k < 4; ++k) {
            const double way = p * per - node[axis][k];
            out[k] = way * way;
        }
    }
};

/// Squared distances from one place to the 64 nodes, in spacings, eight nodes at a time.
struct Ways {
    double x[4], y[4];
    Lane<8> z;

    /// Computes the squared distances of point p (m) from the 64 nodes along each axis, in spacings (per:
    /// 1/m).
    Ways(const Surroundings& about, const Vec3<double>& p, double per) noexcept {
        double along[4];
        about.squares(p.x, 0, per, x);
        about.squares(p.y, 1, per, y);
        about.squares(p.z, 2, per, along);
        z = twice(along);
    }
    /// The squared distances from eight of the nodes.
    Lane<8> square(int eighth) const noexcept {
        const int i = eighth / 2, j = 2 * (eighth % 2);
        return z + first_halves(Lane<8>(x[i] + y[j]), Lane<8>(x[i] + y[j + 1]));
    }
};

/// The best lower bound (m) that the surrounding nodes prove, from squared distances square(k) in spacings,
/// each distance increased by more_way (spacings).
template <class Square>
inline double best_node(const Field& field, const Surroundings& about, double more_way,
                        const Square& square) noexcept {
    using Eight = Lane<8>;
    const Eight steeper(FieldTuning::steepest - 1.0), off(more_way), one(1.0), zero(0.0),
        size(-field.spacing);
    Eight most(-infinity);
    for (int k = 0; k < 8; ++k) {
        const Eight r = sqrt(square(k)) + off, phi = mul_add(steeper, max(r - one, zero), r);
        most = max(most, mul_add(phi, size, Eight::load(about.value + 8 * k)));
    }
    return -least(-most);
}

/// The lower bound (m) of the distance from a place, given in the field's frame, to all obstacles of the
/// field; negative inside an obstacle.
inline double at_least(const Field& field, const Vec3<double>& p) noexcept {
    const GridPlace place = grid_place(field, p);
    const Surroundings about(field, place);
    const Ways ways(about, place.inside, 1.0 / field.spacing);
    const double here = best_node(field, about, 0.0, [&ways](int k) { return ways.square(k); });
    if (place.outside > 0) return hypot(place.outside, max(here, 0.0));
    return here;
}

/// A lower bound of at_least over all places within `bow` (m) of the segment from p to q. No place of the
/// segment is farther from a node than the farther of both ends.
inline double at_least(const Field& field, const Vec3<double>& p, const Vec3<double>& q,
                       double bow) noexcept {
    const GridPlace place = grid_place(field, p);
    const double per = 1.0 / field.spacing;
    if (place.outside == 0 && grid_place(field, q).outside == 0) {
        const Surroundings about(field, place);
        const Ways one(about, p, per), other(about, q, per);
        return best_node(field, about, bow * per, [&](int k) { return max(one.square(k), other.square(k)); });
    }
    const double half = 0.5 * (at_least(field, p) + at_least(field, q) - FieldTuning::steepest * norm(q - p));
    return half - FieldTuning::steepest * bow;
}

/// The unit direction from a place towards the nearest obstacle, estimated from the gradient of the
/// surrounding nodes; 0 if the gradient vanishes.
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

/// An approach from a place, in the field's frame, to the estimated nearest point of an obstacle, with the
/// given distance.
inline Approach approach_from(const Field& field, const Vec3<double>& p, double distance) noexcept {
    return {p, p + towards_obstacle(field, p) * max(at_least(field, p), 0.0), distance};
}

/// The number of intervals into which a segment of this length (m) is divided; the field is evaluated at
/// their ends.
inline int place_count(const Field& field, double length) noexcept {
    const double most = FieldTuning::most_places,
                 wanted = length * (1.0 - FieldTuning::same_length) / (FieldTuning::apart * field.spacing);
    return static_cast<int>(std::ceil(min(wanted, most)));
}

/// Half the distance (m) of two neighbouring sample places on a segment of this length.
inline double half_gap(const Field& field, double length) noexcept {
    const int count = place_count(field, length);
    return count > 0 ? 0.5 * length / count : 0.0;
}

/// The distance (m) that the field must have at the sample places of a segment of this length, minus `reach`,
/// so that segment_field gives at least `reach`.
inline double reach_of_places(const Field& field, double length, double reach) noexcept {
    return hypot(reach, half_gap(field, length)) - reach;
}

/// The least value found and its index.
struct LeastPlace {
    double value;
    int at;
};

/// The least of f(0) to f(last), which differ by no more than `rise` from one to the next, or a value below
/// `enough`; calls f only where that may be found.
template <class F>
LeastPlace least_place(int last, double rise, double enough, const F& f) noexcept {
    struct Stretch {
        int from, to;
        double f_from, f_to;
    };
    LeastPlace best{f(0), 0};
    const auto look = [&](int k) {
        const double here = f(k);
        if (here < best.value) best = {here, k};
        return here;
    };
    if (last == 0) return best;
    Stretch stack[16]{{0, last, best.value, look(last)}};
    for (int count = 1; count > 0 && best.value >= enough;) {
        const Stretch s = stack[--count];
        const int between = s.to - s.from;
        if (between < 2 || s.f_from + s.f_to - rise * between >= 2.0 * best.value) continue;
        const int middle = s.from + between / 2;
        const double here = look(middle);
        const Stretch lower{s.from, middle, s.f_from, here}, upper{middle, s.to, here, s.f_to};
        const bool down = s.f_from < s.f_to;  // where it is less comes first
        stack[count++] = down ? upper : lower;
        stack[count++] = down ? lower : upper;
    }
    return best;
}

/// A lower bound of the distance (m) of a segment, in the field's frame, from the obstacles. It is sqrt(f^2 -
/// g^2), with f the least value at the sample places and g half their distance.
inline Approach segment_field(const Vec3<double>& a, const Vec3<double>& b, const Field& field) noexcept {
    const Vec3<double> d = b - a;
    const double length = norm(d), gap = half_gap(field, length);
    const int last = place_count(field, length);
    const auto place = [&](int k) { return mul_add(d, last > 0 ? double(k) / last : 0.0, a); };
    const LeastPlace found = least_place(last, 2.0 * FieldTuning::steepest * gap, 0.0,
                                         [&](int k) { return at_least(field, place(k)); });
    const double best = max(found.value, 0.0), least = sqrt(max((best - gap) * (best + gap), 0.0));
    return approach_from(field, place(found.at), least);
}

/// A lower bound of the field over the sample places of a moving segment. Each place stays within `bow` (m)
/// of the line between its first and last position. The search ends early if a value is below `enough`.
inline double least_along(const Vec3<double> (&first)[2], const Vec3<double> (&last)[2], double bow,
                          double enough, const Field& field) noexcept {
    const Vec3<double> d = first[1] - first[0], e = last[1] - last[0];
    const double length = norm(d), gap = half_gap(field, length);
    const int count = place_count(field, length);
    const double rise = FieldTuning::steepest * max(2.0 * gap, count > 0 ? norm(e) / count : 0.0);
    return least_place(count, rise, enough,
                       [&](int k) {
                           const double t = count > 0 ? double(k) / count : 0.0;
                           return at_least(field, mul_add(d, t, first[0]), mul_add(e, t, last[0]), bow);
                       })
        .value;
}

/// A lower bound of the distance (m) of a box from the obstacles of a field; `frame` places the box in the
/// field's frame, `half` are half its edges.
inline Approach box_field(const Pose<double>& frame, const Vec3<double>& half, const Field& field) noexcept {
    struct BoxPart {
        Vec3<double> centre, half;
    };
    BoxPart stack[FieldTuning::most_pieces]{{{0, 0, 0}, half}};
    Vec3<double> lowest = frame.position;
    double least = infinity;
    for (int count = 1; count > 0;) {
        const BoxPart piece = stack[--count];
        const Vec3<double> place = frame.rotation * piece.centre + frame.position;
        const double size = norm(piece.half), bound = max(at_least(field, place) - size, 0.0);
        if (bound >= least) continue;
        if (size <= FieldTuning::enough_in_box * field.spacing || count + 2 > FieldTuning::most_pieces) {
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
    return approach_from(field, lowest, least);
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
