// Feasible arcs of a nearly S-R-S arm: stretches of psi proven to keep the limits, or to break one.
//
//     |--inside--|--?--|--outside--|--?--|--inside--|
//                   ^ root            ^ root
//
// A cell of psi is judged by the corrected motion, first about the pose, then about the cell's own middle;
// what is open then by a hull, in which a joint comes to its limit once; the rest is halved, and at last left
// out.
//
// An end is the psi at which the true joint is at its limit, to near_rule::residual. What is proven neither
// way (beside a singularity, where branches merge) is left out, and its measure is counted.
#pragma once

#include "../limits/feasible.hpp"
#include "corrected_motion.hpp"
#include "hull.hpp"

namespace armangle {

namespace near_rule {
inline constexpr int cells = 16;              // of the circle, to begin with
inline constexpr double widest_ball = 0.1;    // rad: half width of a cell that is looked at about its middle
inline constexpr double widest_hull = 0.025;  // rad: wider ones are hardly ever proven
inline constexpr double narrowest = 2e-4;     // rad: half width of a cell that is given up
inline constexpr int hulls = 500;             // of one pose and branch, before the rest is given up
inline constexpr int depth = 16;              // halvings of a cell; narrowest is reached before
inline constexpr int root_steps = 8;
}  // namespace near_rule

/// Psi_all of a pose and branch: arcs whose every psi is proven; what is proven neither way and left out, and
/// its measure (rad).
struct ProvenArcs {
    ArcSet arcs, open;
    Status status;
    double unproven;
};

/// The ranges of theta that limits and margin leave, each as a middle and a half width below pi.
struct ThetaRanges {
    struct One {
        int joint;
        double middle, half;
        Tag low, high;
    };
    static constexpr int capacity = joints + 3;
    int count = 0;
    One one[capacity];

    ThetaRanges(const Arm& arm, const Limits& limits, double margin,
                const Configuration<double>& gc) noexcept {
        for (int j = 0; j < joints; ++j) {
            const ThetaRange range = theta_range(arm, limits, j);
            if (!(range.upper - range.lower < two_pi)) continue;
            add(j, range.lower, range.upper, make_tag(j + 1, detail::limit_side(arm, j, true)),
                make_tag(j + 1, detail::limit_side(arm, j, false)));
        }
        if (!(margin > 0)) return;
        keep_off(1, 0.0, gc.shoulder, margin);
        keep_off(3, arm.delta_angle, gc.elbow, margin);
        keep_off(5, 0.0, gc.wrist, margin);
    }

private:
    void add(int joint, double lower, double upper, Tag low, Tag high) noexcept {
        one[count++] = {joint, 0.5 * (lower + upper), 0.5 * (upper - lower), low, high};
    }
    void keep_off(int joint, double zero, double side, double margin) noexcept {
        const Tag near = make_tag(joint + 1, Side::near_margin), far = make_tag(joint + 1, Side::far_margin);
        const double a = zero + side * margin, b = zero + side * (pi - margin);
        if (side > 0) add(joint, a, b, near, far);
        if (side < 0) add(joint, b, a, far, near);
    }
};

namespace detail {

/// What is known of a cell.
enum class Known : std::uint8_t { inside, outside, open };

/// A stretch [lower, upper] of psi within the limits, and what made its ends.
struct Piece {
    double lower, upper;
    Tag lower_tag, upper_tag;
};

/// Collects the proven pieces of the circle, from -pi on.
class Pieces {
public:
    Pieces() noexcept { make_empty(set_); }

    /// A piece of no width is kept where limits make both ends: a locked joint is there alone.
    void add(Piece piece) noexcept {
        const bool ended = piece.lower_tag != 0 && piece.upper_tag != 0;
        if (ended && abs(piece.upper - piece.lower) < tolerance::angle) piece.upper = piece.lower;
        if (!(piece.upper > piece.lower || (ended && piece.upper == piece.lower))) return;
        if (begun_ && piece.lower - last_.upper < tolerance::angle) {
            last_.upper = max(last_.upper, piece.upper);
            last_.upper_tag = piece.upper_tag;
            return;
        }
        flush();
        last_ = piece;
        begun_ = true;
    }
    /// The set, joined over the seam. What is beyond its capacity is counted as not proven.
    void finish(ArcSet& out, double& lost) noexcept {
        flush();
        lost += lost_;
        if (set_.count == 1 && set_.arc[0].upper - set_.arc[0].lower >= two_pi - tolerance::angle)
            return make_full(out);
        merge(set_);
        for (int i = 0; i < set_.count && !set_.full; ++i) {
            Arc& arc = set_.arc[i];
            if (arc.lower_tag == 0) arc.lower_tag = make_tag(0, Side::unproven);
            if (arc.upper_tag == 0) arc.upper_tag = make_tag(0, Side::unproven);
        }
        out = set_;
    }

private:
    void flush() noexcept {
        if (!begun_) return;
        begun_ = false;
        if (set_.count == ArcSet::capacity) {
            lost_ += last_.upper - last_.lower;
            return;
        }
        put(set_, {last_.lower, last_.upper, last_.lower_tag, last_.upper_tag});
    }

    ArcSet set_;
    Piece last_{};
    bool begun_ = false;
    double lost_ = 0;
};

/// The work on one pose and branch.
class ArcProof {
public:
    ArcProof(const NearArm& arm, const Pose<double>& pose, const Triad<double>& on,
             const Configuration<double>& gc, const ThetaRanges& ranges, int only_joint) noexcept
        : arm_(arm),
          pose_(pose),
          on_(on),
          gc_(gc),
          ranges_(ranges),
          only_(only_joint),
          coarse_(arm.nominal, flange_pose(arm.nominal, pose), on, gc, {arm.wrist_shift, arm.turn}, 0.0) {}

    void run(ProvenArcs& out) noexcept {
        struct Cell {
            double lower, upper;
        };
        Cell stack[near_rule::depth + 2];
        out.unproven = 0;
        for (int k = 0; k < near_rule::cells; ++k) {
            int top = 0;
            stack[top++] = {-pi + two_pi * k / near_rule::cells, -pi + two_pi * (k + 1) / near_rule::cells};
            while (top > 0) {
                const Cell cell = stack[--top];
                if (settle(cell.lower, cell.upper)) continue;
                const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
                if (half < near_rule::narrowest || top > near_rule::depth || hulls_ >= near_rule::hulls) {
                    out.unproven += cell.upper - cell.lower;
                    open_.add({cell.lower, cell.upper, 0, 0});
                    continue;
                }
                stack[top++] = {middle, cell.upper};
                stack[top++] = {cell.lower, middle};
            }
        }
        pieces_.finish(out.arcs, out.unproven);
        double beyond_capacity = 0;
        open_.finish(out.open, beyond_capacity);
        out.status = Status::OK;
        if (!out.arcs.empty()) return;
        out.status = out.unproven > 0 ? Status::NEAR_SINGULAR : Status::LIMITS;
        if (out.unproven == 0 && only_elbow_ && elbow_blocks_ != 0)
            out.status =
                tag_side(elbow_blocks_) >= Side::near_margin ? Status::ELBOW_MARGIN : Status::ELBOW_LIMIT;
    }

private:
    /// Whether a joint that is within `reach` of theta keeps the range.
    static Known verdict(const ThetaRanges::One& range, double theta, double reach) noexcept {
        const double off = abs(wrap(theta - range.middle));
        if (off + reach <= range.half) return Known::inside;
        return off - reach > range.half ? Known::outside : Known::open;
    }

    /// The ranges that are open over a cell, a bit each, or that one is broken.
    Known judge(const double* theta, const double* reach, unsigned& open) noexcept {
        open = 0;
        Tag broken = 0, by_elbow = 0;
        for (int i = 0; i < ranges_.count; ++i) {
            const ThetaRanges::One& range = ranges_.one[i];
            if (only_ >= 0 && range.joint != only_) continue;
            const Known one = verdict(range, theta[range.joint], reach[range.joint]);
            if (one == Known::open) open |= 1u << i;
            if (one != Known::outside) continue;
            broken = range.low;
            if (range.joint == 3) by_elbow = range.low;
        }
        if (broken == 0) return open == 0 ? Known::inside : Known::open;
        if (by_elbow == 0) only_elbow_ = false;
        elbow_blocks_ = by_elbow;
        return Known::outside;
    }

    /// Whether a coarse look settles a cell, inside or outside.
    bool decided(const Coarse& coarse, double lower, double upper) noexcept {
        unsigned open = 0;
        Known found = judge(coarse.theta, coarse.reach, open);
        // where nothing is limited a posture must still be there
        for (int j = 0; j < joints && found == Known::inside; ++j)
            if (!(coarse.reach[j] < infinity)) found = Known::open;
        if (found == Known::inside) pieces_.add({lower, upper, 0, 0});
        return found != Known::open;
    }

    /// Settles a cell, or leaves it to be halved.
    bool settle(double lower, double upper) noexcept {
        const double middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
        if (decided(coarse_.over(middle, half), lower, upper)) return true;
        if (half > near_rule::widest_ball || hulls_ >= near_rule::hulls) return false;
        ++hulls_;
        SinCos<double> angle[joints];
        const PsiPlane<double> plane(on_, sin_cos(middle));
        if (!solve_quickly(arm_, pose_, plane, gc_, angle)) return false;
        if (decided(coarse_about(arm_, pose_, on_, plane, angle, gc_, half), lower, upper)) return true;
        if (half > near_rule::widest_hull) return false;
        Hull hull;
        if (!prove_hull(arm_, pose_, plane, angle, middle, half, hull)) return false;
        unsigned open = 0;
        double reach[joints];
        for (int j = 0; j < joints; ++j) reach[j] = hull.reach(j);
        const Known found = judge(hull.theta, reach, open);
        if (found == Known::inside) pieces_.add({lower, upper, 0, 0});
        if (found != Known::open) return true;
        only_elbow_ = false;
        Piece piece{lower, upper, 0, 0};
        for (int i = 0; i < ranges_.count; ++i)
            if (open >> i & 1u && !cut(ranges_.one[i], hull, angle, piece)) return false;
        pieces_.add(piece);
        return true;
    }

    /// Cuts a piece of a hull to where a joint keeps its range; false where the hull does not say.
    bool cut(const ThetaRanges::One& range, const Hull& hull, const SinCos<double> (&angle)[joints],
             Piece& piece) const noexcept {
        const int j = range.joint;
        const double slope = hull.slope[j], reach = hull.reach(j), off = wrap(hull.theta[j] - range.middle);
        if (!(abs(slope) > hull.slope_radius[j])) return false;
        if (!(abs(off) + reach < two_pi - range.half)) return false;  // it may come in again from behind
        const bool rising = slope > 0;
        if (off - reach < -range.half &&
            !end_at(hull, angle, j, range.middle - range.half, rising, range.low, piece))
            return false;
        return !(off + reach > range.half) ||
               end_at(hull, angle, j, range.middle + range.half, !rising, range.high, piece);
    }

    /// Moves an end of the piece to where joint j is at theta: the lower end, or the upper.
    bool end_at(const Hull& hull, const SinCos<double> (&angle)[joints], int j, double theta, bool lower,
                Tag tag, Piece& piece) const noexcept {
        double psi = 0;
        if (!root(hull, angle, j, theta, psi) || !(abs(psi - hull.psi) <= 2.0 * hull.half)) return false;
        if (lower && psi > piece.lower) {
            piece.lower = psi;
            piece.lower_tag = tag;
        }
        if (!lower && psi < piece.upper) {
            piece.upper = psi;
            piece.upper_tag = tag;
        }
        return true;
    }

    /// The psi at which joint j is at theta: Newton on the seven equations and this one. It may lie beyond
    /// the hull, whose joint then does not come to theta.
    bool root(const Hull& hull, const SinCos<double> (&from)[joints], int j, double theta,
              double& psi) const noexcept {
        const SinCos<double> wanted = sin_cos(theta);
        SinCos<double> angle[joints];
        for (int i = 0; i < joints; ++i) angle[i] = from[i];
        psi = hull.psi;
        for (int pass = 0; pass < near_rule::root_steps; ++pass) {
            const PsiPlane<double> plane(on_, sin_cos(psi));
            SevenEquations<double> now = seven_equations(arm_, pose_, plane, angle);
            const double gap = atan2(wanted.sin * angle[j].cos - wanted.cos * angle[j].sin,
                                     wanted.cos * angle[j].cos + wanted.sin * angle[j].sin);
            if (now.size() <= near_rule::residual && abs(gap) <= near_rule::residual) return true;
            double straight[joints], sideways[joints];
            newton_step(now, straight);
            now.left = {{0, 0, 0}, {0, 0, 0}, dot(plane.along, elbow_axis(angle))};
            newton_step(now, sideways);
            const double by = (gap - straight[j]) / sideways[j];
            if (!(abs(by) < near_rule::largest_step)) return false;
            for (int i = 0; i < joints; ++i) straight[i] += by * sideways[i];
            turn_by(straight, angle);
            psi += by;
        }
        return false;
    }

    const NearArm& arm_;
    const Pose<double>& pose_;
    const Triad<double>& on_;
    const Configuration<double>& gc_;
    const ThetaRanges& ranges_;
    int only_;
    CorrectedMotion coarse_;
    Pieces pieces_, open_;
    int hulls_ = 0;
    Tag elbow_blocks_ = 0;    // the elbow's limit or margin that broke a cell
    bool only_elbow_ = true;  // and every other
};

}  // namespace detail

/// Psi_all of a pose in branch gc of the true chain; of one joint (0..6) alone where it is named.
inline void feasible(const NearArm& arm, const Pose<double>& pose, int gc, const Limits& limits,
                     double margin, ProvenArcs& out, int joint = -1) noexcept {
    make_empty(out.arcs);
    make_empty(out.open);
    out.unproven = 0;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, exact));
    out.status = detail::reach_status(arm, on);
    if (out.status != Status::OK) return;
    const Configuration<double> sign = configuration(gc);
    const ThetaRanges ranges(arm.nominal, limits, margin, sign);
    detail::ArcProof(arm, exact, on, sign, ranges, joint).run(out);
}

}  // namespace armangle
