// Feasible arcs: all psi of a pose and branch that keep every joint within its limits. Eq. (25), (32), (35).
//
// Each limit is one boundary function B(psi) = a sin + b cos + c that must not be negative:
//   pivot  g (U cos L - V sin L) >= 0 at the lower limit, <= 0 at the upper: the cone from one to the other;
//   hinge  cos(near) - H >= 0 and H - cos(far) >= 0, near and far being the limits of |theta|.
// {B >= 0} is one arc, [phi - alpha, phi + alpha] with phi = atan2(a, b), alpha = acos(-c / hypot(a, b)), so a joint's
// set is an intersection of arcs (or the complement of one, for a pivot of more than half a turn). No tangent, no
// derivative sign, no sampling; limits of any sign, beyond +-pi or infinite are the same rule.
#pragma once

#include "arcs.hpp"
#include "joint_function.hpp"
#include "status.hpp"

namespace armangle {

/// What made an end of an arc.
enum class Side : std::uint8_t { none, lower, upper, user, near_margin, far_margin, near_singular, far_singular };

constexpr Tag make_tag(int joint, Side side) noexcept { return static_cast<Tag>(joint * 8 + static_cast<int>(side)); }
constexpr int tag_joint(Tag tag) noexcept { return tag >> 3; }  // 1..7, or 0 for none
constexpr Side tag_side(Tag tag) noexcept { return static_cast<Side>(tag & 7); }

inline constexpr int pivots = 4, hinges = 2, pieces = 2;
inline constexpr int pivot_joint[pivots] = {0, 2, 4, 6};
inline constexpr int hinge_joint[hinges] = {1, 5};

/// A range [near, far] of |theta| within [0, pi]; an end at 0 or pi that is no limit has the tag 0.
struct HingePiece {
    double cos_near, cos_far, near, far;
    Tag near_tag, far_tag;
};

/// The limits of an arm in the form that the boundary functions take; made once for an arm and a margin.
struct LimitTable {
    double margin, sin_margin;
    // B = u U + v V for the lower limits of the four pivots, then the upper ones; negated for wide pivots.
    double u[2 * pivots], v[2 * pivots];
    bool free[pivots], wide[pivots];  // range of a full turn or more; of more than half a turn
    Tag tag[2 * pivots];
    int piece_count[hinges][2];  // [hinge][theta < 0]
    HingePiece piece[hinges][2][pieces];
    double psi_margin, discriminant;  // the paper's psi_sing +- epsilon, eq. (31), and when it holds; 0: not used
};

namespace detail {

inline Side limit_side(const Arm& arm, int joint, bool lower_theta) noexcept {
    return (arm.sign[joint] > 0) == lower_theta ? Side::lower : Side::upper;
}

inline void add_piece(LimitTable& t, int hinge, int negative, HingePiece piece) noexcept {
    const int joint = hinge_joint[hinge] + 1;
    if (piece.near < t.margin) piece.near = t.margin, piece.near_tag = make_tag(joint, Side::near_margin);
    if (piece.far > pi - t.margin) piece.far = pi - t.margin, piece.far_tag = make_tag(joint, Side::far_margin);
    int& count = t.piece_count[hinge][negative];
    if (piece.near > piece.far || count == pieces) return;
    piece.cos_near = std::cos(piece.near), piece.cos_far = std::cos(piece.far);
    t.piece[hinge][negative][count++] = piece;
}

/// The windings of [lower, upper] that meet the half circle of |theta|.
inline void fill_hinge(LimitTable& t, const Arm& arm, int hinge, int negative) noexcept {
    const int j = hinge_joint[hinge];
    const double l = negative ? -arm.theta_upper[j] : arm.theta_lower[j];
    const double u = negative ? -arm.theta_lower[j] : arm.theta_upper[j];
    const Tag lower_tag = make_tag(j + 1, limit_side(arm, j, !negative));
    const Tag upper_tag = make_tag(j + 1, limit_side(arm, j, negative));
    if (!(u - l < two_pi)) return add_piece(t, hinge, negative, {0, 0, 0.0, pi, 0, 0});
    const double first = two_pi * std::ceil((-tolerance::angle - u) / two_pi);  // smallest turn that lifts u above 0
    for (double turn = first; l + turn <= pi + tolerance::angle; turn += two_pi) {
        HingePiece piece{0, 0, l + turn, u + turn, lower_tag, upper_tag};
        if (piece.near <= 0) piece.near = 0, piece.near_tag = 0;
        if (piece.far >= pi) piece.far = pi, piece.far_tag = 0;
        if (piece.far < 0) piece.far = 0;
        if (piece.near > pi) piece.near = pi;
        add_piece(t, hinge, negative, piece);
    }
}

inline void fill_pivot(LimitTable& t, const Arm& arm, int pivot) noexcept {
    const int j = pivot_joint[pivot];
    const double l = arm.theta_lower[j], u = arm.theta_upper[j];
    t.free[pivot] = !(u - l < two_pi);
    t.wide[pivot] = !t.free[pivot] && u - l > pi;
    t.tag[pivot] = make_tag(j + 1, limit_side(arm, j, true));
    t.tag[pivots + pivot] = make_tag(j + 1, limit_side(arm, j, false));
    const double sign = t.wide[pivot] ? -1.0 : 1.0;
    t.u[pivot] = t.free[pivot] ? 0.0 : sign * std::cos(l);
    t.v[pivot] = t.free[pivot] ? 0.0 : -sign * std::sin(l);
    t.u[pivots + pivot] = t.free[pivot] ? 0.0 : -sign * std::cos(u);
    t.v[pivots + pivot] = t.free[pivot] ? 0.0 : sign * std::sin(u);
}

}  // namespace detail

/// Limits of an arm, with a margin (rad, >= 0) that keeps |sin theta_2|, |sin theta_6|, |sin(theta_4 - delta)| >= sin(margin).
inline LimitTable limit_table(const Arm& arm, double margin = 0.0, double psi_margin = 0.0, double discriminant = 0.0) noexcept {
    LimitTable t{};
    t.margin = margin, t.sin_margin = std::sin(margin);
    t.psi_margin = psi_margin, t.discriminant = discriminant;
    for (int p = 0; p < pivots; ++p) detail::fill_pivot(t, arm, p);
    for (int h = 0; h < hinges; ++h)
        for (int negative = 0; negative < 2; ++negative) detail::fill_hinge(t, arm, h, negative);
    return t;
}

/// The arcs {B >= 0} of eight boundary functions at once.
struct BoundaryArcs {
    double a[8], b[8], c[8];         // in: B = a sin + b cos + c
    double lower[8], upper[8], size[8];  // out: phi -+ alpha, and hypot(a, b)

    void solve() noexcept {
        using Slots = Lane<8>;
        const Slots A = Slots::load(a), B = Slots::load(b), C = Slots::load(c), h = hypot(A, B);
        const Slots middle = atan2(A, B);
        const Slots half = atan2(sqrt(max((h - C) * (h + C), Slots(0.0))), -C);
        (middle - half).store(lower), (middle + half).store(upper), h.store(size);
    }

    /// The i-th arc as a set; `constant` decides where B does not depend on psi.
    void put(int i, bool constant, Tag lower_tag, Tag upper_tag, ArcSet& out) const noexcept {
        if (size[i] <= tolerance::singular) return constant ? make_full(out) : make_empty(out);
        if (c[i] >= size[i]) return make_full(out);
        if (c[i] <= -size[i]) return make_empty(out);
        make_arc(out, lower[i], upper[i], lower_tag, upper_tag);
    }
};

/// Boundary functions of one circle and branch, solved: lanes 0-3 and 4-7 of `pivot` are lower and upper limits, of
/// `hinge` near and far ends of hinge 2 (pieces 0, 1), then of hinge 6.
struct Boundaries {
    BoundaryArcs pivot, hinge;
};

namespace detail {

inline void fill_boundaries(const LimitTable& t, const JointFunctions<double>& f, Boundaries& out) noexcept {
    for (int i = 0; i < 2 * pivots; ++i) {
        const Pivot<double>& p = f.pivot[i % pivots];
        const double u = p.g * t.u[i], v = p.g * t.v[i];
        out.pivot.a[i] = u * p.U.s + v * p.V.s;
        out.pivot.b[i] = u * p.U.c + v * p.V.c;
        out.pivot.c[i] = u * p.U.k + v * p.V.k;
    }
    for (int h = 0; h < hinges; ++h) {
        const Linear<double>& H = f.hinge[h].H;
        const HingePiece* piece = t.piece[h][f.hinge[h].g < 0];
        for (int k = 0; k < pieces; ++k) {
            const int near = 4 * h + 2 * k, far = near + 1;
            out.hinge.a[near] = -H.s, out.hinge.b[near] = -H.c, out.hinge.c[near] = piece[k].cos_near - H.k;
            out.hinge.a[far] = H.s, out.hinge.b[far] = H.c, out.hinge.c[far] = H.k - piece[k].cos_far;
        }
    }
}

}  // namespace detail

inline void boundaries(const LimitTable& t, const JointFunctions<double>& f, Boundaries& out) noexcept {
    detail::fill_boundaries(t, f, out);
    out.pivot.solve();
    out.hinge.solve();
}

namespace detail {

/// Ends at which the direction (V, U) itself vanishes: the joint jumps there, it does not reach its limit.
inline void mark_jumps(const JointFunctions<double>& f, int pivot, ArcSet& set) noexcept {
    const Pivot<double>& p = f.pivot[pivot];
    const int hinge = pivot / 2;
    const auto mark = [&](double psi, Tag& tag) {
        if (!tag) return;
        const SinCos<double> at = sin_cos(psi);
        if (hypot(p.U.at(at), p.V.at(at)) > tolerance::angle) return;
        tag = make_tag(hinge_joint[hinge] + 1, f.hinge[hinge].H.at(at) > 0 ? Side::near_singular : Side::far_singular);
    };
    for (int i = 0; i < set.count; ++i) mark(set.arc[i].lower, set.arc[i].lower_tag), mark(set.arc[i].upper, set.arc[i].upper_tag);
}

/// Whether (V, U) comes near zero anywhere: only then can an end be a jump.
inline bool may_vanish(const Pivot<double>& p) noexcept {
    const Linear<double> n = slope_numerator(p);
    const double disc = n.s * n.s + n.c * n.c - n.k * n.k;
    return abs(disc) <= tolerance::near_vanishing * (n.s * n.s + n.c * n.c + n.k * n.k) + tolerance::singular;
}

/// Removes psi_sing -+ epsilon of eq. (31) where the discriminant of eq. (30) is small: the paper's own avoidance.
inline void avoid_paper_singularity(const LimitTable& t, const JointFunctions<double>& f, int pivot, ArcSet& set) noexcept {
    const Pivot<double>& p = f.pivot[pivot];
    const Linear<double> n = slope_numerator(p);
    const double disc = n.s * n.s + n.c * n.c - n.k * n.k;
    if (abs(disc) > t.discriminant || hypot(n.s, n.c) <= tolerance::singular) return;
    const double psi = atan2(n.s, n.c) + (n.k > 0 ? pi : 0.0);
    const bool near = f.hinge[pivot / 2].H.at(sin_cos(psi)) > 0;
    const Tag tag = make_tag(hinge_joint[pivot / 2] + 1, near ? Side::near_singular : Side::far_singular);
    ArcSet away, before = set;
    make_arc(away, psi + t.psi_margin, psi - t.psi_margin + two_pi, tag, tag);
    intersect(before, away, set);
}

}  // namespace detail

/// Psi_i of a pivot (0..3 for joints 1, 3, 5, 7).
inline void pivot_arcs(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b, int pivot, ArcSet& out) noexcept {
    const Pivot<double>& p = f.pivot[pivot];
    if (t.free[pivot]) {
        make_full(out);
    } else {
        ArcSet above, below;
        const int l = pivot, u = pivots + pivot;
        const double slack = (t.wide[pivot] ? -1.0 : 1.0) * tolerance::angle * hypot(p.U.k, p.V.k);
        b.pivot.put(l, b.pivot.c[l] >= -slack, t.tag[l], t.tag[l], above);
        b.pivot.put(u, b.pivot.c[u] >= -slack, t.tag[u], t.tag[u], below);
        if (t.wide[pivot]) {
            ArcSet blocked;
            intersect(above, below, blocked);
            complement(blocked, out);
        } else {
            intersect(above, below, out);
        }
        if (detail::may_vanish(p)) detail::mark_jumps(f, pivot, out);
    }
    if (t.psi_margin > 0) detail::avoid_paper_singularity(t, f, pivot, out);
}

/// Psi_i of a hinge (0, 1 for joints 2, 6).
inline void hinge_arcs(const LimitTable& t, const JointFunctions<double>& f, const Boundaries& b, int hinge, ArcSet& out) noexcept {
    const Hinge<double>& h = f.hinge[hinge];
    const int negative = h.g < 0;
    // |theta| where it does not depend on psi
    const SinCos<double> zero{0.0, 1.0};
    const Pivot<double>& p = f.pivot[2 * hinge];
    make_empty(out);
    for (int k = 0; k < t.piece_count[hinge][negative]; ++k) {
        const HingePiece& piece = t.piece[hinge][negative][k];
        const int near = 4 * hinge + 2 * k, far = near + 1;
        bool in_near = true, in_far = true;
        if (b.hinge.size[near] <= tolerance::singular) {
            const bool singular = p.U.k == 0 && p.V.k == 1 && p.U.s == 0;  // whole circle: sin(theta) is 0
            const double sine = singular ? 0.0 : hypot(p.U.at(zero), p.V.at(zero));
            const double angle = atan2(sine, h.H.at(zero));
            in_near = angle >= piece.near - tolerance::angle, in_far = angle <= piece.far + tolerance::angle;
        }
        ArcSet from_near, to_far, both;
        if (piece.near_tag) b.hinge.put(near, in_near, piece.near_tag, piece.near_tag, from_near); else make_full(from_near);
        if (piece.far_tag) b.hinge.put(far, in_far, piece.far_tag, piece.far_tag, to_far); else make_full(to_far);
        intersect(from_near, to_far, both);
        if (k == 0) {
            out = both;
        } else {
            const ArcSet first = out;
            unite(first, both, out);
        }
    }
}

/// Elbow: OK, or why no psi is feasible, theta_4 being the same for all.
inline Status elbow_status(const Arm& arm, const LimitTable& t, const Circle<double>& c, const Fold<double>& fold) noexcept {
    if (is_folded(arm, c)) return Status::FOLDED;
    if (is_unreachable(arm, c)) return Status::UNREACHABLE;
    const double q = joint_value(atan2(fold.theta_4.sin, fold.theta_4.cos), arm.joint_sign[3], arm.joint_offset[3],
                                 arm.joint_lower[3], arm.joint_upper[3], arm.joint_middle[3]);
    if (q < arm.lower[3] - tolerance::angle || q > arm.upper[3] + tolerance::angle) return Status::ELBOW_LIMIT;
    if (c.triangle.eta.sin < t.sin_margin) return Status::ELBOW_MARGIN;
    return Status::OK;
}

/// Psi_all of one circle and branch; empty with the reason in the status.
inline Status feasible(const Arm& arm, const LimitTable& t, const Circle<double>& c, const Fold<double>& fold,
                       const JointFunctions<double>& f, ArcSet& out) noexcept {
    make_empty(out);
    const Status elbow = elbow_status(arm, t, c, fold);
    if (elbow != Status::OK) return elbow;
    Boundaries b;
    boundaries(t, f, b);
    make_full(out);
    ArcSet joint, before;
    const auto keep = [&] {
        if (joint.full) return;
        before = out;
        intersect(before, joint, out);
    };
    for (int p = 0; p < pivots && !out.empty(); ++p) pivot_arcs(t, f, b, p, joint), keep();
    for (int h = 0; h < hinges && !out.empty(); ++h) hinge_arcs(t, f, b, h, joint), keep();
    return out.empty() ? Status::LIMITS : Status::OK;
}

/// Psi_i of one joint (0..6), with the status of that joint alone.
inline Status joint_arcs(const Arm& arm, const LimitTable& t, const Circle<double>& c, const Fold<double>& fold,
                         const JointFunctions<double>& f, int joint, ArcSet& out) noexcept {
    make_empty(out);
    const Status elbow = elbow_status(arm, t, c, fold);
    if (elbow == Status::FOLDED || elbow == Status::UNREACHABLE) return elbow;
    if (joint == 3) {
        if (elbow == Status::OK) make_full(out);
        return elbow;
    }
    Boundaries b;
    boundaries(t, f, b);
    for (int p = 0; p < pivots; ++p)
        if (pivot_joint[p] == joint) pivot_arcs(t, f, b, p, out);
    for (int h = 0; h < hinges; ++h)
        if (hinge_joint[h] == joint) hinge_arcs(t, f, b, h, out);
    return out.empty() ? Status::LIMITS : Status::OK;
}

/// Value in q of the end that a tag marks; NaN for a user's end.
inline double end_value(const Arm& arm, double margin, const Configuration<double>& gc, Tag tag) noexcept {
    const int joint = tag_joint(tag) - 1;
    if (joint < 0) return not_a_number;
    const double g = joint == 1 ? gc.shoulder : gc.wrist;
    double theta = 0;
    switch (tag_side(tag)) {
        case Side::lower: return arm.lower[joint];
        case Side::upper: return arm.upper[joint];
        case Side::near_margin: theta = g * margin; break;
        case Side::far_margin: theta = g * (pi - margin); break;
        case Side::near_singular: theta = 0; break;
        case Side::far_singular: theta = g * pi; break;
        default: return not_a_number;
    }
    return joint_value(theta, arm.sign[joint], arm.offset[joint], arm.lower[joint], arm.upper[joint], arm.joint_middle[joint]);
}

}  // namespace armangle
