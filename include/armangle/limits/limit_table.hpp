// The limits of an arm, converted once to the form that boundary functions use.
//
//          upper \     / lower           a pivot's limits are a cone of directions (V, U): narrow up to half
//                 \   /                  a turn, wide beyond it, free from a whole turn on;
//                  \ /  theta inside     a hinge's are one or two pieces of |theta| in [0, pi], each with a
//     --------------o--------------      near and a far end
#pragma once

#include "arcs.hpp"
#include "cone.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The cause of an arc's end.
enum class Side : std::uint8_t {
    none,
    lower,
    upper,
    user,
    near_margin,
    far_margin,
    near_singular,
    far_singular,
    obstacle,
    unproven  // for a nearly S-R-S arm: nothing is proven beyond this end
};

/// The tag of a limit of joint 1..7.
constexpr Tag make_tag(int joint, Side side) noexcept {
    return static_cast<Tag>(joint * 16 + static_cast<int>(side));
}
/// The joint (1..7) of a tag, or 0 for none.
constexpr int tag_joint(Tag tag) noexcept { return tag >> 4 & 15; }
/// The side of a tag.
constexpr Side tag_side(Tag tag) noexcept { return static_cast<Side>(tag & 15); }

inline constexpr int pivots = 4, hinges = 2, pieces = 2;
inline constexpr int pivot_joint[pivots] = {0, 2, 4, 6};
inline constexpr int hinge_joint[hinges] = {1, 5};

/// One end of an allowed range of |theta|. `tag` names the limit (0: none, the range ends at 0 or pi). 1 -
/// cos and 1 + cos are stored separately to lose no digits near 0 and pi.
struct HingeEnd {
    double angle;
    Tag tag;
    double below_one, above_minus_one;  // 1 - cos, 1 + cos
};

/// Largest margin around a singularity (rad); a margin of half pi would leave nothing.
inline constexpr double most_margin = 1.5;

/// A range [near, far] of |theta| within [0, pi].
struct HingePiece {
    HingeEnd near, far;
};

/// The limits of an arm in the form that boundary functions use; made once for an arm and a margin.
struct LimitTable {
    double margin, sin_margin;
    // B = u U + v V for the lower limits of the four pivots, then the upper ones.
    double u[2 * pivots], v[2 * pivots];
    // added to the overlap: 0 keeps it (wide pivot), infinity disables the cut (narrow pivot)
    double room[2 * pivots];
    unsigned limited;  // one bit each: less than a full turn
    Tag tag[2 * pivots];
    int piece_count[hinges][2];  // [hinge][theta < 0]
    HingePiece piece[hinges][2][pieces];
    double least_cosine[hinges], most_cosine[hinges];  // of a hinge within its limits, for either sign
    ThetaRange range[pivots];
    bool locked;        // some joint other than the fourth has a range below tolerance::locked
    bool hinges_alike;  // for both hinges, theta and -theta have the same limits
    Cone elbow, cone[pivots];
    double elbow_slack;  // rad: times n / sin(eta), the uncertainty of theta_4 for a solved pose
    double psi_margin,
        discriminant;  // the paper's psi_sing +- epsilon, eq. (31), and its condition; 0: not used
};

namespace detail {

/// Which limit of the value q of a joint (0..6) is the lower (lower_theta) or upper limit of theta.
inline Side limit_side(const Arm& arm, int joint, bool lower_theta) noexcept {
    return (arm.sign[joint] > 0) == lower_theta ? Side::lower : Side::upper;
}

/// The end of a range of |theta| at an angle (rad), with its cosine.
inline HingeEnd hinge_end(double angle, Tag tag) noexcept {
    const SinCos<double> half = sin_cos(0.5 * min(max(angle, 0.0), pi));
    return {angle, tag, 2.0 * half.sin * half.sin, 2.0 * half.cos * half.cos};
}

/// Adds a permitted range of |theta| of joint 2 or 6 (`hinge`: 0, 1), of theta < 0 if `negative` is 1, to t,
/// reduced by the margin, unless it becomes empty.
inline void add_piece(LimitTable& t, int hinge, int negative, HingePiece piece) noexcept {
    const int joint = hinge_joint[hinge] + 1;
    if (piece.near.angle < t.margin) piece.near = hinge_end(t.margin, make_tag(joint, Side::near_margin));
    if (piece.far.angle > pi - t.margin)
        piece.far = hinge_end(pi - t.margin, make_tag(joint, Side::far_margin));
    int& count = t.piece_count[hinge][negative];
    if (min(piece.near.angle, pi) > max(piece.far.angle, 0.0) || count == pieces) return;
    t.piece[hinge][negative][count++] = piece;
}

/// Adds to t the parts of the limits of joint 2 or 6 (`hinge`: 0, 1), over all multiples of 2 pi, that lie in
/// the half circle of |theta|, for one sign of theta (negative: 1). A limit within the angular tolerance of 0
/// or pi forbids nothing, or all but one point.
inline void fill_hinge(LimitTable& t, const Arm& arm, const Limits& limits, int hinge,
                       int negative) noexcept {
    const int j = hinge_joint[hinge];
    const ThetaRange range = theta_range(arm, limits, j);
    t.locked |= range.upper - range.lower <= tolerance::locked;
    const double l = negative ? -range.upper : range.lower;
    const double u = negative ? -range.lower : range.upper;
    const Tag lower_tag = make_tag(j + 1, limit_side(arm, j, !negative));
    const Tag upper_tag = make_tag(j + 1, limit_side(arm, j, negative));
    if (!(u - l < two_pi)) return add_piece(t, hinge, negative, {hinge_end(0.0, 0), hinge_end(pi, 0)});
    const double first =
        two_pi * std::ceil((-tolerance::angle - u) / two_pi);  // smallest turn that moves u above 0
    for (int k = 0; k <= pieces; ++k) {
        const double turn = first + two_pi * k;
        if (l + turn > pi + tolerance::angle) break;
        const double near = l + turn, far = u + turn;
        HingePiece piece{hinge_end(near, lower_tag), hinge_end(far, upper_tag)};
        if (near <= tolerance::angle) piece.near = hinge_end(0.0, 0);
        if (far >= pi - tolerance::angle) piece.far = hinge_end(pi, 0);
        add_piece(t, hinge, negative, piece);
    }
}

/// Stores the limits of joint 1, 3, 5 or 7 (`pivot`: 0 to 3) in t.
inline void fill_pivot(LimitTable& t, const Arm& arm, const Limits& limits, int pivot) noexcept {
    const int j = pivot_joint[pivot];
    t.range[pivot] = theta_range(arm, limits, j);
    t.locked |= t.range[pivot].upper - t.range[pivot].lower <= tolerance::locked;
    t.cone[pivot] = cone(t.range[pivot]);
    const Cone& c = t.cone[pivot];
    t.room[pivot] = t.room[pivots + pivot] = c.wide ? 0.0 : infinity;
    if (!c.free) t.limited |= 1u << pivot | 1u << (pivots + pivot);
    t.tag[pivot] = make_tag(j + 1, limit_side(arm, j, true));
    t.tag[pivots + pivot] = make_tag(j + 1, limit_side(arm, j, false));
    t.u[pivot] = c.lower.cos;
    t.v[pivot] = -c.lower.sin;
    t.u[pivots + pivot] = -c.upper.cos;
    t.v[pivots + pivot] = c.upper.sin;
}

/// Stores in t the cosines between which joint 2 or 6 (`hinge`: 0, 1) is within its limits; infinity and
/// -infinity if no |theta| is permitted.
inline void fill_cosines(LimitTable& t, int hinge) noexcept {
    t.least_cosine[hinge] = infinity;
    t.most_cosine[hinge] = -infinity;
    for (int negative = 0; negative < 2; ++negative)
        for (int k = 0; k < t.piece_count[hinge][negative]; ++k) {
            const HingePiece& p = t.piece[hinge][negative][k];
            t.least_cosine[hinge] = min(t.least_cosine[hinge], p.far.above_minus_one - 1.0);
            t.most_cosine[hinge] = max(t.most_cosine[hinge], 1.0 - p.near.below_one);
        }
}

/// Whether |theta| of joint 2 or 6 (`hinge`: 0, 1) has the same ranges for both signs of theta.
inline bool is_alike(const LimitTable& t, int hinge) noexcept {
    bool alike = t.piece_count[hinge][0] == t.piece_count[hinge][1];
    for (int k = 0; k < t.piece_count[hinge][0]; ++k) {
        const HingePiece &p = t.piece[hinge][0][k], &q = t.piece[hinge][1][k];
        alike &= p.near.angle == q.near.angle && p.far.angle == q.far.angle;
    }
    return alike;
}

}  // namespace detail

/// Converts limits of an arm's joints, with a margin (rad, >= 0) that keeps |sin theta_2|, |sin theta_6|,
/// |sin(theta_4 - delta)| >= sin(margin). psi_margin (rad) and discriminant are those of the paper's eq.
/// (31), or 0.
inline LimitTable limit_table(const Arm& arm, const Limits& limits, double margin = 0.0,
                              double psi_margin = 0.0, double discriminant = 0.0) noexcept {
    LimitTable t{};
    t.margin = margin;
    t.sin_margin = std::sin(margin);
    t.psi_margin = psi_margin;
    t.discriminant = discriminant;
    t.elbow = cone(theta_range(arm, limits, 3));
    t.elbow_slack = tolerance::elbow * arm.size / (arm.upper_arm * arm.forearm);
    for (int p = 0; p < pivots; ++p) detail::fill_pivot(t, arm, limits, p);
    for (int h = 0; h < hinges; ++h)
        for (int negative = 0; negative < 2; ++negative) detail::fill_hinge(t, arm, limits, h, negative);
    for (int h = 0; h < hinges; ++h) detail::fill_cosines(t, h);
    t.hinges_alike = detail::is_alike(t, 0) && detail::is_alike(t, 1);
    return t;
}

/// The table of the arm's own limits.
inline LimitTable limit_table(const Arm& arm, double margin = 0.0, double psi_margin = 0.0,
                              double discriminant = 0.0) noexcept {
    return limit_table(arm, arm.limits, margin, psi_margin, discriminant);
}

}  // namespace armangle

#include "../names/end.hpp"
