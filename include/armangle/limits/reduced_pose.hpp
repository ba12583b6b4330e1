// The four numbers of a pose that determine joints 2 to 6; a reach map is a grid over them. Any arm has them:
// they are what a turn about its own axes 1 and 7 leaves, counted from the points of its DH rows.
//
//        axis 1                     z_7 = cos(tilt) w + sin(tilt) (cos(turn) e + sin(turn) z)
//          |      W . -> w
//          |     .       p = W - S = (r cos(azimuth), r sin(azimuth), height)
//          |  .          w = p / |p|, and the triad (w, e, z) of the circle whose psi counts from axis 1
//          S ---- r
//
// Azimuth and roll affect joints 1 and 7 alone (turn_arcs.hpp). The shoulder's limits depend on (|p|, angle
// of p to axis 1), the wrist's on (|p|, tilt). The turn shifts one set of psi against the other: Psi_2..6 =
// S(r, height) and (W(|p|, tilt) - turn). So each cell costs a shift and an intersection.
#pragma once

#include "turn_arcs.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A pose in coordinates suited to an S-R-S arm; azimuth and roll rotate it around axes 1 and 7.
template <class T>
struct ReducedNumbers {
    T r, height;      // m: the wrist from axis 1, and above the shoulder along axis 1
    T tilt, turn;     // rad: angle of axis 7 to the line shoulder-wrist, and turn about that line
    T azimuth, roll;  // rad
};
using ReducedPose = ReducedNumbers<double>;

/// The values of one cell of the map at its centre; for an arm with an offset, psi is its free joint.
struct ReducedCell {
    std::uint8_t gc;  // bit k: branch k solves it at some azimuth and roll
    // share of the azimuths (rolls) at which some roll (azimuth) reaches it, in 255ths, rounded down: 255 is
    // all
    std::uint8_t yaw, roll;
    std::uint8_t unproven;  // bit k: branch k neither is found to solve it nor is excluded
    float freedom;          // rad: length of the psi that joints 2 to 6 permit, summed over the branches
};

/// The arms that a map uses: without base and tool, psi from axis 1; joints 1 and 7 without limits, or one of
/// them limited.
template <class AnyArm>
struct ReducedArm {
    using Table = decltype(limit_table(std::declval<const AnyArm&>(), 0.0));
    AnyArm free, yawed, rolled;
    Table free_table, yawed_table, rolled_table;
    bool mirrored;  // turn and -turn have the same cell: joints 3 and 5 have symmetric ranges
};

/// The distances (m) of the wrist from the shoulder between which poses can be reachable.
struct ReducedReach {
    double inner, outer;
};
/// The least and greatest distance (m) of the wrist from the shoulder.
inline ReducedReach reduced_reach(const Arm& arm) noexcept { return {arm.inner_reach, arm.reach}; }

/// What is before axis 1 and behind axis 7 in a user's pose: pose = before (flange pose in the frame of the
/// DH rows) after, where a turn about the arm's own axis 1 or 7 is one about the z axis of the flange pose.
struct EndFrames {
    Pose<double> before, after;
};
/// The base and the tool.
template <class AnyArm>
EndFrames end_frames(const AnyArm& arm) noexcept {
    return {nominal(arm).base, nominal(arm).tool};
}

/// Makes the arm again with the identity as its end frames; the base and tool of the parameters are none.
template <class AnyArm>
AnyArm between_ends(const AnyArm& arm, const ArmParameters& parameters) noexcept {
    return remade(arm, parameters);
}

namespace detail {

/// The arm without base and tool, and without the limits of joints 1 and 7 unless they are kept.
template <class AnyArm>
AnyArm bare(const AnyArm& arm, bool keep_first, bool keep_last) noexcept {
    ArmParameters p = nominal(arm);
    p.base = p.tool = identity_pose();
    p.reference = Reference::base;
    for (const int joint : {keep_first ? joints : 0, keep_last ? joints : joints - 1}) {
        p.limits.lower[joint] = -infinity;
        p.limits.upper[joint] = infinity;
    }
    return between_ends(arm, p);
}

/// Whether theta of a joint (0..6) may be negated: it is unlimited, or its range is symmetric.
inline bool is_symmetric(const Arm& arm, int joint) noexcept {
    const ThetaRange range = theta_range(arm, arm.limits, joint);
    return !(range.upper - range.lower < two_pi) || range.lower == -range.upper;
}

/// The flange pose of a reduced pose, in the frame of the DH rows.
template <class T>
Pose<T> reduced_flange(const Arm& arm, const ReducedNumbers<T>& at) noexcept {
    const SinCos<T> azimuth = sin_cos(at.azimuth), tilt = sin_cos(at.tilt), turn = sin_cos(at.turn),
                    roll = sin_cos(at.roll);
    const T zero(0.0);
    const Vec3<T> p{at.r * azimuth.cos, at.r * azimuth.sin, at.height};
    const Vec3<T> w = p * (T(1.0) / norm(p)), z{azimuth.sin, -azimuth.cos, zero}, e = cross(w, z);
    const Vec3<T> across = e * turn.cos + z * turn.sin, y = cross(w, across);
    const Vec3<T> x = across * tilt.cos - w * tilt.sin, axis = w * tilt.cos + across * tilt.sin;
    const Mat3<T> rotation{x * roll.cos + y * roll.sin, y * roll.cos - x * roll.sin, axis};
    return {rotation, Vec3<T>{zero, zero, T(arm.d_bs)} + p + axis * T(arm.d_wf)};
}

/// The psi that one half of the arm permits, and its joint functions.
struct HalfOfMap {
    JointFunctions<double> f;
    ArcSet arcs;
};

/// The share of the circle that a set covers, in 255ths, rounded down.
inline std::uint8_t share_of_circle(const ArcSet& set) noexcept {
    if (set.full) return 255;
    return static_cast<std::uint8_t>(std::floor(min(254.0, 255.0 / two_pi * measure(set))));
}

}  // namespace detail

/// Whether turn and -turn have the same cell: joints 3 and 5 have symmetric ranges.
template <class AnyArm>
bool is_mirrored(const AnyArm& arm) noexcept {
    const Arm& rows = nominal(arm);
    return rows.d_4 == 0 && detail::is_symmetric(rows, 2) && detail::is_symmetric(rows, 4);
}

/// Makes the three arms of a map (joints 1 and 7 without limits, or one of them limited) and their limit
/// tables; the margin (rad, to singularities) is that of limit_table().
template <class AnyArm>
ReducedArm<AnyArm> reduced_arm(const AnyArm& arm, double margin) noexcept {
    const AnyArm free = detail::bare(arm, false, false), yawed = detail::bare(arm, true, false),
                 rolled = detail::bare(arm, false, true);
    return {free,
            yawed,
            rolled,
            limit_table(free, margin),
            limit_table(yawed, margin),
            limit_table(rolled, margin),
            is_mirrored(arm)};
}

/// The user's pose of reduced coordinates; r and the height must not both be 0.
template <class AnyArm>
Pose<double> pose_of(const AnyArm& arm, const ReducedPose& at) noexcept {
    const EndFrames ends = end_frames(arm);
    return ends.before * detail::reduced_flange(nominal(arm), at) * ends.after;
}

/// The reduced coordinates of a user's pose. The azimuth is 0 if the wrist lies on axis 1; the turn is 0 if
/// axis 7 is along shoulder-wrist.
template <class AnyArm>
ReducedPose reduced_pose(const AnyArm& arm, const Pose<double>& pose) noexcept {
    const Arm& rows = nominal(arm);
    const EndFrames ends = end_frames(arm);
    const Pose<double> flange = inverted(ends.before) * pose * inverted(ends.after);
    const auto& [x7, y7, z7] = flange.rotation;
    const Vec3<double> p = flange.position - Vec3<double>{0.0, 0.0, rows.d_bs} - z7 * rows.d_wf;
    ReducedPose out{hypot(p.x, p.y), p.z, 0, 0, 0, 0};
    if (out.r > 0) out.azimuth = atan2(p.y, p.x);
    const double n = norm(p);
    const SinCos<double> azimuth = sin_cos(out.azimuth);
    const Vec3<double> w = n > 0 ? p * (1.0 / n) : Vec3<double>{0.0, 0.0, 1.0},
                       z{azimuth.sin, -azimuth.cos, 0.0}, e = cross(w, z);
    const double along = dot(w, z7), across = hypot(dot(e, z7), dot(z, z7));
    out.tilt = atan2(across, along);
    if (across > 0) out.turn = atan2(dot(z, z7), dot(e, z7));
    const SinCos<double> turn = sin_cos(out.turn);
    const Vec3<double> y = e * turn.sin - z * turn.cos;
    out.roll = atan2(dot(y, x7), dot(y, y7));
    return out;
}

/// A ball around all positions that the end effector can have.
struct ReachBall {
    Vec3<double> centre;  // m
    double radius;        // m
};
/// The ball around the shoulder that holds every position of the end effector.
template <class AnyArm>
ReachBall reach_ball(const AnyArm& arm) noexcept {
    const EndFrames ends = end_frames(arm);
    const Vec3<double> shoulder{0.0, 0.0, nominal(arm).d_bs}, wrist{0.0, 0.0, -nominal(arm).d_wf};
    return {ends.before.rotation * shoulder + ends.before.position,
            reduced_reach(arm).outer + norm(ends.after.position - wrist)};
}

/// Computes the cells of one wrist position, for one kind of arm.
template <class AnyArm>
class ReducedPlace;

/// For an S-R-S arm: the psi of the shoulder are computed once, those of the wrist once a tilt.
template <>
class ReducedPlace<Arm> {
public:
    /// Computes for a wrist at radius r and height (m) in the arm's base which elbow signs joint 4 permits,
    /// and the feasible psi of the shoulder's joints.
    ReducedPlace(const ReducedArm<Arm>& arm, double r, double height) noexcept
        : arm_(arm), at_{r, height, 0, 0, 0, 0} {
        const Vec3<double> p{r, 0.0, height};
        const Pose<double> flange{identity_pose().rotation,
                                  Vec3<double>{0.0, 0.0, arm.free.d_bs + arm.free.d_wf} + p};
        circle_ = circle(arm.free, flange);
        for (int side = 0; side < 2; ++side) {
            const SelfMotion<double> m = self_motion(arm.free, circle_, configuration(2 * side));
            holds_[side] = elbow_status(m, arm.free_table) == Status::OK;
            any_ |= holds_[side];
            plain_ &= !shoulder_singular(m);
            for (int negative = 0; holds_[side] && negative < 2; ++negative)
                find(m, negative, 0, shoulder_[side][negative]);
        }
    }

    /// Whether the elbow reaches this wrist position; if not, all cells are empty.
    bool any() const noexcept { return any_; }

    /// Sets the tilt (rad) of the following cells.
    void tilt(double angle) noexcept {
        at_.tilt = angle;
        const SinCos<double> t = sin_cos(angle);
        circle_.tool_w = {-t.sin, 0.0, t.cos};
        circle_.tool_e = {t.cos, 0.0, t.sin};
        circle_.tool_z = {0.0, -1.0, 0.0};  // (w, e, z) is left-handed: w x e = -z
        tilted_plain_ = plain_;
        for (int side = 0; side < 2; ++side) {
            if (!holds_[side]) continue;
            const SelfMotion<double> m = self_motion(arm_.free, circle_, configuration(2 * side));
            tilted_plain_ &= !wrist_singular(m);
            for (int negative = 0; negative < 2; ++negative) find(m, negative, 1, wrist_[side][negative]);
        }
    }

    /// The cell at a turn in [-pi, pi] (rad); yaw and roll are 0 unless requested.
    ReducedCell cell(double turn, bool with_yaw, bool with_roll) noexcept {
        if (!tilted_plain_) [[unlikely]]
            return exact_cell(turn, with_yaw, with_roll);
        ReducedCell out{};
        double total = 0;
        Share yaw(with_yaw, arm_.yawed_table.range[0]), roll(with_roll, arm_.rolled_table.range[pivots - 1]);
        for (int side = 0; side < 2; ++side) {
            if (!holds_[side]) continue;
            for (int gc_2 = 0; gc_2 < 2; ++gc_2)
                for (int gc_6 = 0; gc_6 < 2; ++gc_6) {
                    const detail::HalfOfMap &s = shoulder_[side][gc_2], &w = wrist_[side][gc_6];
                    double branch = 0;
                    each_overlap(s.arcs, w.arcs, turn, [&](double lower, double upper) {
                        branch += upper - lower;
                        if (!yaw.done) yaw.add(s.f.pivot[0], s.f.hinge[0], lower, upper);
                        if (!roll.done)
                            roll.add(w.f.pivot[pivots - 1], w.f.hinge[1], lower + turn, upper + turn);
                    });
                    out.gc = static_cast<std::uint8_t>(out.gc | (branch > 0) << (gc_2 + 2 * side + 4 * gc_6));
                    total += branch;
                }
        }
        out.freedom = static_cast<float>(total);
        out.yaw = with_yaw ? yaw.of_circle(out.gc != 0) : std::uint8_t(0);
        out.roll = with_roll ? roll.of_circle(out.gc != 0) : std::uint8_t(0);
        return out;
    }

    /// Finds the middle psi of the widest arc at a turn, and its branch; gc is -1 if there is none.
    void widest(double turn, double& psi, int& gc) const noexcept {
        double most = 0;
        gc = -1;
        for (int side = 0; side < 2; ++side)
            for (int branch = 0; holds_[side] && branch < 4; ++branch) {
                const int gc_2 = branch & 1, gc_6 = branch >> 1;
                each_overlap(shoulder_[side][gc_2].arcs, wrist_[side][gc_6].arcs, turn,
                             [&](double lower, double upper) {
                                 if (!(upper - lower > most)) return;
                                 most = upper - lower;
                                 psi = wrap(0.5 * (lower + upper));
                                 gc = gc_2 + 2 * side + 4 * gc_6;
                             });
            }
    }

private:
    const ReducedArm<Arm>& arm_;
    ReducedPose at_;
    Circle<double> circle_;
    bool holds_[2] = {}, any_ = false;
    bool plain_ = true, tilted_plain_ = true;  // no hinge reaches 0 or pi, no joint is locked
    detail::HalfOfMap shoulder_[2][2], wrist_[2][2];

    /// Collects the share of the circle at which one joint is within its limits.
    struct Share {
        bool done;  // the whole circle, or not requested
        ThetaRange range;
        UnionOfArcs turns;

        /// Begins without rotations; done at once if they are not wanted, or if the joint turns all around
        /// anyway.
        Share(bool wanted, const ThetaRange& of) noexcept
            : done(!wanted || !(of.upper - of.lower < two_pi)), range(of) {}

        /// Adds the rotations at which the joint keeps its range while psi is in [lower, upper].
        void add(const Pivot<double>& pivot, const Hinge<double>& hinge, double lower,
                 double upper) noexcept {
            const detail::Swings s = detail::swings(pivot, hinge, lower, upper);
            for (int k = 0; k < s.count; ++k)
                turns.add({range.lower - s.most[k], range.upper - s.least[k], 0, 0});
            done = turns.full();
        }

        /// The share of the circle (0 to 255) that the added rotations cover; 0 if no branch solves the pose
        /// (`held` is false).
        std::uint8_t of_circle(bool held) noexcept {
            if (!held) return 0;
            if (done) return 255;
            ArcSet set;
            turns.finish(set);
            return detail::share_of_circle(set);
        }
    };

    /// Computes the psi that joints 2 and 3 (half 0, shoulder) or 5 and 6 (half 1, wrist) permit, for one
    /// sign (negative: 1) of theta_2 or theta_6, and their joint functions. Clears plain_ (half 0) or
    /// tilted_plain_ (half 1) if the hinge (joint 2 or 6) may reach 0 or pi or a joint is locked.
    void find(SelfMotion<double> m, int negative, int half, detail::HalfOfMap& out) noexcept {
        m.gc.shoulder = m.gc.wrist = negative ? -1.0 : 1.0;
        detail::Sides sides;
        detail::block_sides(arm_.free_table, m, all_pivots, sides);
        free_arcs(half == 0 ? sides.shoulder : sides.wrist, out.arcs);
        out.f = sides.f;
        (half == 0 ? plain_ : tilted_plain_) &=
            !arm_.free_table.locked && !detail::may_jump(sides.f.hinge[half]);
    }

    /// The cell at a turn (rad) by the general functions; used if two joints may rotate around one axis or a
    /// joint is locked.
    [[gnu::noinline, gnu::cold]] ReducedCell exact_cell(double turn, bool with_yaw,
                                                        bool with_roll) const noexcept {
        ReducedPose at = at_;
        at.turn = turn;
        const Pose<double> flange = detail::reduced_flange(arm_.free, at);
        const Freedom f = freedom(arm_.free, flange, arm_.free_table);
        ReducedCell out{f.gc, 0, 0, 0, static_cast<float>(f.total)};
        ArcSet set;
        if (with_yaw) {
            turn_arcs(arm_.yawed, flange, arm_.yawed_table, Turned::base, set);
            out.yaw = detail::share_of_circle(set);
        }
        if (with_roll) {
            turn_arcs(arm_.rolled, flange, arm_.rolled_table, Turned::tool, set);
            out.roll = detail::share_of_circle(set);
        }
        return out;
    }
};

}  // namespace armangle

#include "../names/end.hpp"
