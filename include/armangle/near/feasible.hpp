// Feasible arcs of a nearly S-R-S arm: stretches of psi proven to keep the limits, or to break one.
//
//     |--inside--|--?--|--outside--|--?--|--inside--|
//                   ^ root            ^ root
//
// Limits are functions of psi that the corrected motion knows within a slack: where they are farther from 0
// all is said, and what is open are stretches about the ends. Those are looked at again about their own
// middle, where the slack is less, or in a hull, in which a joint comes to its limit once. What stays open is
// halved, in rounds over all of the circle, and at last left out.
//
// An end is the psi at which the true joint is at its limit, to near_rule::residual. What is proven neither
// way (beside a singularity, where branches merge) is left out, and its measure is counted.
#pragma once

#include "../limits/feasible.hpp"
#include "corrected_motion.hpp"
#include "hull.hpp"

namespace armangle {

namespace near_rule {
inline constexpr int cells = 16;            // of a circle of which nothing is known to begin with
inline constexpr double widest_ball = 0.2;  // rad: half width of a stretch that is looked at about its middle
inline constexpr double widest_hull = 0.05;                      // rad: wider ones are hardly ever proven
inline constexpr int rounds = 3;                                 // over what is left of the circle
inline constexpr double narrowest[rounds] = {5e-3, 1e-3, 1e-4};  // rad: half width that is left to the next
inline constexpr double shrunk = 0.7;  // of a stretch: what is open then is worth another look as it is
inline constexpr int looks[rounds] = {400, 500, 600};  // of one pose and branch, all rounds together
inline constexpr int hard = 2;                         // long searches for a first posture
inline constexpr int lost = 30;                        // short ones from the last that led nowhere
inline constexpr int depth = 24;                       // looks within looks; narrowest is reached before
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
        one[count++] = {joint, wrap(0.5 * (lower + upper)), 0.5 * (upper - lower), low, high};
    }
    void keep_off(int joint, double zero, double side, double margin) noexcept {
        const Tag near = make_tag(joint + 1, Side::near_margin), far = make_tag(joint + 1, Side::far_margin);
        const double a = zero + side * margin, b = zero + side * (pi - margin);
        if (side > 0) add(joint, a, b, near, far);
        if (side < 0) add(joint, b, a, far, near);
    }
};

namespace detail {

/// A stretch [lower, upper] of psi within the limits, and what made its ends.
struct Piece {
    double lower, upper;
    Tag lower_tag, upper_tag;
};

/// Collects pieces of the circle [-pi, pi], in any order.
class Pieces {
public:
    /// A piece of no width is kept where limits make both ends: a locked joint is there alone. What is beyond
    /// the capacity is lost.
    void add(Piece piece) noexcept {
        const bool ended = piece.lower_tag != 0 && piece.upper_tag != 0;
        if (ended && abs(piece.upper - piece.lower) < tolerance::angle) piece.upper = piece.lower;
        if (!(piece.upper > piece.lower || (ended && piece.upper == piece.lower))) return;
        if (count_ == capacity) {
            lost_ += piece.upper - piece.lower;
            return;
        }
        int k = count_++;
        for (; k > 0 && piece_[k - 1].lower > piece.lower; --k) piece_[k] = piece_[k - 1];
        piece_[k] = piece;
    }

    /// The set, neighbours joined, also over the seam. What is lost is counted as not proven.
    void finish(ArcSet& out, double& lost) noexcept {
        make_empty(out);
        lost += lost_;
        for (int i = 0; i < count_;) {
            Piece one = piece_[i];
            for (++i; i < count_ && piece_[i].lower - one.upper < tolerance::angle; ++i) {
                if (piece_[i].upper < one.upper) continue;
                one.upper = piece_[i].upper;
                one.upper_tag = piece_[i].upper_tag;
            }
            if (out.count == ArcSet::capacity)
                lost += one.upper - one.lower;
            else
                put(out, {one.lower, one.upper, one.lower_tag, one.upper_tag});
        }
        if (out.count == 1 && out.arc[0].upper - out.arc[0].lower >= two_pi - tolerance::angle)
            return make_full(out);
        merge(out);
        for (int i = 0; i < out.count && !out.full; ++i) {
            Arc& arc = out.arc[i];
            if (arc.lower_tag == 0) arc.lower_tag = make_tag(0, Side::unproven);
            if (arc.upper_tag == 0) arc.upper_tag = make_tag(0, Side::unproven);
        }
    }

private:
    static constexpr int capacity = 512;
    int count_ = 0;
    Piece piece_[capacity];
    double lost_ = 0;
};

/// What a stretch is cut into where a motion tells more: pieces by rising psi, each inside, outside, or open
/// with what is open there.
struct Sections {
    using Open = unsigned;  // a bit each range; then one each hinge, beside which a posture may not be
    static constexpr int conditions = ThetaRanges::capacity + hinges;
    static constexpr int capacity = 8 * conditions + 1;
    struct Section {
        double lower, upper;
        Known known;
        Open open;
    };
    int count = 0;
    Section section[capacity];
};
inline constexpr Sections::Open hinge_bit = 1u << ThetaRanges::capacity;

/// Whether a hull stays on the branch's side of theta_2, theta_4 - delta and theta_6 = 0.
inline bool keeps_branch(const Arm& nominal, const Configuration<double>& gc, const Hull& hull) noexcept {
    const double zero[] = {0.0, nominal.delta_angle, 0.0}, side[] = {gc.shoulder, gc.elbow, gc.wrist};
    for (int i = 0; i < 3; ++i) {
        const int j = 2 * i + 1;
        const double off = side[i] * wrap(hull.theta[j] - zero[i]), reach = hull.reach(j);
        if (!(off > reach && off + reach < pi)) return false;
    }
    return true;
}

/// The work on one pose and branch.
class ArcProof {
public:
    ArcProof(const NearArm& arm, const Pose<double>& pose, const Triad<double>& on,
             const Configuration<double>& gc, const ThetaRanges& ranges, int only_joint) noexcept
        : arm_(arm), pose_(pose), on_(on), gc_(gc), ranges_(ranges), only_(only_joint) {}

    void run(ProvenArcs& out) noexcept {
        out.unproven = 0;
        CorrectedMotion all(arm_.nominal, flange_pose(arm_.nominal, pose_), on_, gc_);
        all.widen({arm_.wrist_shift, arm_.turn}, 0.0);
        Sections::Open every = hinge_bit | hinge_bit << 1;
        for (int i = 0; i < ranges_.count; ++i)
            if (only_ < 0 || ranges_.one[i].joint == only_) every |= 1u << i;
        if (all.usable()) {
            Sections sections;
            part(all, every, -pi, pi, sections);
            prepare(sections);
            take(sections, 0.0, 0);
        } else {
            for (int k = 0; k < near_rule::cells; ++k)
                settle(-pi + two_pi * k / near_rule::cells, -pi + two_pi * (k + 1) / near_rule::cells, every,
                       0);
        }
        // the whole circle is looked at before any place of it takes all looks
        while (left_.count > 0 && ++round_ < near_rule::rounds) {
            const Left now = left_;
            left_.count = 0;
            for (int i = 0; i < now.count; ++i)
                settle(now.stretch[i].lower, now.stretch[i].upper, now.stretch[i].open, 0);
        }
        pieces_.finish(out.arcs, out.unproven);
        double beyond_capacity = 0;
        open_.finish(out.open, beyond_capacity);
        out.unproven += unproven_;
        out.status = Status::OK;
        if (!out.arcs.empty()) return;
        out.status = out.unproven > 0 ? Status::NEAR_SINGULAR : Status::LIMITS;
        if (out.unproven == 0 && only_elbow_ && elbow_blocks_ != 0)
            out.status =
                tag_side(elbow_blocks_) >= Side::near_margin ? Status::ELBOW_MARGIN : Status::ELBOW_LIMIT;
    }

private:
    using Open = Sections::Open;
    using Several = Lane<register_width>;
    using Condition = CorrectedMotion::Condition;

    /// Parts [lower, upper] where a motion's conditions change; of those asked alone.
    void part(const CorrectedMotion& motion, Open asked, double lower, double upper, Sections& out) noexcept {
        Condition condition[Sections::conditions];
        int bit[Sections::conditions], n = 0, ends = 0;
        double at[Sections::capacity + 1];
        for (int i = 0; i < ranges_.count; ++i) {
            if (!(asked >> i & 1)) continue;
            const ThetaRanges::One& r = ranges_.one[i];
            bit[n] = i;
            condition[n++] = motion.condition(r.joint, r.middle - r.half, r.middle + r.half);
        }
        for (int h = 0; h < hinges; ++h) {
            if (!(asked & hinge_bit << h)) continue;
            bit[n] = ThetaRanges::capacity + h;
            condition[n++] = motion.regular(h);
        }
        const auto add = [&](double psi) {
            int k = ends++;
            for (; k > 0 && at[k - 1] > psi; --k) at[k] = at[k - 1];
            at[k] = psi;
        };
        const auto cross = [&](Harmonic<double> f, double value) {
            f.k -= value;
            const Roots found = roots(f);
            for (int i = 0; i < found.count; ++i) {
                const double psi = lift(found.psi[i], 0.5 * (lower + upper));
                if (psi > lower && psi < upper) add(psi);
            }
        };
        add(lower);
        add(upper);
        for (int i = 0; i < n; ++i) {
            const Condition& c = condition[i];
            cross(c.low, c.low_slack);
            cross(c.high, c.high_slack);
            if (!c.limit) continue;
            cross(c.low, -c.low_slack);
            cross(c.high, -c.high_slack);
        }
        out.count = 0;
        for (int k = 0; k + 1 < ends; ++k) {
            if (!(at[k] < at[k + 1])) continue;
            const Sections::Section now = section(condition, bit, n, at[k], at[k + 1]);
            Sections::Section* last = out.count > 0 ? &out.section[out.count - 1] : nullptr;
            if (last && last->known == now.known) {  // what is open together is looked at together
                last->upper = now.upper;
                last->open |= now.open;
            } else {
                out.section[out.count++] = now;
            }
        }
    }

    /// What conditions say of [lower, upper], on which none of them changes.
    Sections::Section section(const Condition* condition, const int* bit, int n, double lower,
                              double upper) noexcept {
        const SinCos<double> psi = sin_cos(0.5 * (lower + upper));
        Sections::Section out{lower, upper, Known::inside, 0};
        Open broken = 0;
        for (int i = 0; i < n; ++i) {
            const Known one = condition[i].at(psi);
            if (one == Known::open) out.open |= 1u << bit[i];
            if (one == Known::outside) broken |= 1u << bit[i];
        }
        if (out.open != 0) out.known = Known::open;
        if (broken != 0) out = {lower, upper, Known::outside, 0};
        block(broken);
        return out;
    }

    /// Remembers what breaks a stretch: whether it is the elbow, and it alone.
    void block(Open broken) noexcept {
        if (broken == 0) return;
        Tag by_elbow = 0;
        for (int i = 0; i < ranges_.count; ++i)
            if ((broken >> i & 1) && ranges_.one[i].joint == 3) by_elbow = ranges_.one[i].low;
        if (by_elbow == 0) only_elbow_ = false;
        elbow_blocks_ = by_elbow;
    }

    /// Keeps what is inside, and looks again at what is open; psi counts from `origin`.
    void take(const Sections& parts, double origin, int depth) noexcept {
        for (int i = 0; i < parts.count; ++i) {
            const Sections::Section& one = parts.section[i];
            if (one.known == Known::inside) pieces_.add({origin + one.lower, origin + one.upper, 0, 0});
            if (one.known == Known::open) settle(origin + one.lower, origin + one.upper, one.open, depth + 1);
        }
    }

    /// Settles both halves of a stretch; leaves a narrow one to the next round, or gives it up.
    void halve(double lower, double upper, Open open, int depth) noexcept {
        const double middle = 0.5 * (lower + upper);
        const bool narrow = upper - middle < near_rule::narrowest[round_] || depth > near_rule::depth;
        if (narrow || looks_ >= near_rule::looks[round_]) {
            const bool last = round_ + 1 == near_rule::rounds || left_.count == Left::capacity;
            if (!last) {
                left_.stretch[left_.count++] = {lower, upper, open};
                return;
            }
            unproven_ += upper - lower;
            return open_.add({lower, upper, 0, 0});
        }
        settle(lower, middle, open, depth + 1);
        settle(middle, upper, open, depth + 1);
    }

    /// Settles a stretch on which this is open.
    void settle(double lower, double upper, Open open, int depth) noexcept {
        const double middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
        const bool spent = depth > near_rule::depth || looks_ >= near_rule::looks[round_];
        if (spent || half > near_rule::widest_ball) return halve(lower, upper, open, depth);
        ++looks_;
        SinCos<double> angle[joints];
        const PsiPlane<double> plane(on_, sin_cos(middle));
        if (!posture(middle, plane, angle)) return halve(lower, upper, open, depth);
        if (half <= near_rule::widest_hull && by_hull(plane, angle, lower, upper, open)) return;
        Coarse over;
        const CorrectedMotion motion = motion_about(arm_, on_, plane, angle, gc_, half, over);
        if (!motion.usable()) return halve(lower, upper, open, depth);
        Sections parts;
        part(motion, open, -half, half, parts);
        for (int i = 0; i < parts.count; ++i) {
            const Sections::Section& one = parts.section[i];
            const bool wide = one.upper - one.lower > 2.0 * near_rule::shrunk * half;
            if (wide && one.known == Known::open) return halve(lower, upper, open, depth);
        }
        take(parts, middle, depth);
    }

    /// The postures at the middles of what is open, the quick way, as lanes.
    void prepare(const Sections& parts) noexcept {
        double psi[register_width] = {};
        for (int i = 0; i < parts.count && ready_ < register_width; ++i) {
            const Sections::Section& one = parts.section[i];
            const bool narrow = 0.5 * (one.upper - one.lower) <= near_rule::widest_ball;
            if (one.known == Known::open && narrow) psi[ready_++] = 0.5 * (one.lower + one.upper);
        }
        if (ready_ == 0) return;
        const SinCos<Several> at = sin_cos(Several::load(psi));
        const Vec3<Several> e = spread<Several>(on_.e), z = spread<Several>(on_.z);
        found_ =
            find_posture(arm_, spread<Several>(pose_),
                         PsiPlane<Several>(combine(e, at.cos, z, -at.sin), combine(e, at.sin, z, at.cos)),
                         spread<Several>(gc_));
        for (int i = 0; i < ready_; ++i) prepared_[i] = psi[i];
    }

    /// The posture at a psi, the quick way.
    bool quickly(double psi, const PsiPlane<double>& plane, SinCos<double> (&angle)[joints]) const noexcept {
        for (int i = 0; i < ready_; ++i) {
            if (prepared_[i] != psi) continue;
            for (int j = 0; j < joints; ++j) angle[j] = {found_.angle[j].sin[i], found_.angle[j].cos[i]};
            return found_.left[i] <= near_rule::settled;
        }
        return solve_quickly(arm_, pose_, plane, gc_, angle);
    }

    /// The posture at a psi: the quick way, or from that of the last psi.
    bool posture(double psi, const PsiPlane<double>& plane, SinCos<double> (&angle)[joints]) noexcept {
        if (!quickly(psi, plane, angle)) {
            if (!begun_) {
                if (hard_++ >= near_rule::hard) return false;
                if (solve_angles(arm_, pose_, plane, gc_, angle) != Status::OK) return false;
            } else {
                for (int j = 0; j < joints; ++j) angle[j] = last_[j];
                if (lost_ >= near_rule::lost) return false;
                if (newton(arm_, pose_, plane, gc_, angle) != Status::OK) {
                    ++lost_;
                    return false;
                }
            }
        }
        for (int j = 0; j < joints; ++j) last_[j] = angle[j];
        begun_ = true;
        return true;
    }

    /// Settles a stretch by a hull about a posture at its middle; false where the hull does not say.
    bool by_hull(const PsiPlane<double>& plane, const SinCos<double> (&angle)[joints], double lower,
                 double upper, Open open) noexcept {
        Hull hull;
        const double middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
        if (!prove_hull(arm_, pose_, plane, angle, middle, half, hull) ||
            !keeps_branch(arm_.nominal, gc_, hull))
            return false;
        Open undecided = 0, broken = 0;
        for (int i = 0; i < ranges_.count; ++i) {
            if (!(open >> i & 1)) continue;
            const ThetaRanges::One& r = ranges_.one[i];
            const double off = abs(wrap(hull.theta[r.joint] - r.middle)), reach = hull.reach(r.joint);
            if (off - reach > r.half)
                broken |= 1u << i;
            else if (!(off + reach <= r.half))
                undecided |= 1u << i;
        }
        block(broken);
        if (broken != 0) return true;
        Piece piece{lower, upper, 0, 0};
        for (int i = 0; i < ranges_.count; ++i)
            if ((undecided >> i & 1) && !cut(ranges_.one[i], hull, angle, piece)) return false;
        if (undecided != 0) only_elbow_ = false;
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
    /// What is left to the next round.
    struct Left {
        static constexpr int capacity = 256;
        int count = 0;
        struct {
            double lower, upper;
            Open open;
        } stretch[capacity];
    };

    Pieces pieces_, open_;
    Left left_;
    int round_ = 0;
    double unproven_ = 0;
    int looks_ = 0, hard_ = 0, lost_ = 0;
    bool begun_ = false;
    double prepared_[register_width];  // psi of the postures that are known, and these
    int ready_ = 0;
    Found<Several> found_;
    SinCos<double> last_[joints];  // of the posture found last
    Tag elbow_blocks_ = 0;         // the elbow's limit or margin that broke a cell
    bool only_elbow_ = true;       // and every other
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
