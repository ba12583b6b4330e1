// An arm with an offset wrist or shoulder as a family of closed-form self-motions: its free number is the
// value of joint 7 (1).
#pragma once

#include "../self_motion/explicit_family.hpp"
#include "feasible.hpp"
#include "offset_posture.hpp"
#include "straight_cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Adapts an arm with an offset to the functions that need an explicit family
/// (self_motion/explicit_family.hpp, which explains the members).
class OffsetFamily {
public:
    /// Keeps a pointer to the arm.
    explicit OffsetFamily(const OffsetArm& arm) noexcept : arm_(&arm) {}

    /// The arm.
    const OffsetArm& arm() const noexcept { return *arm_; }
    /// The DH rows: the arm without the offset, whose signs, offsets and limits are the robot's.
    const Arm& rows() const noexcept { return arm_->own; }

    /// The value of the free joint (rad) and the branch at joints q.
    OnSelfMotion on(const double* q) const noexcept {
        return {q[robot_joint(*arm_, 6)], forward(*arm_, q).gc};
    }

    /// Writes the directions of the joints at a value of the free joint (rad) to `out`. Returns by how much a
    /// solution exists: the lesser of g^2 - t^2 and the rest of the reach, as shares of the reach; negative
    /// without.
    template <class T>
    T place(const Pose<T>& pose, int gc, const T& free, const double*, Directions<T>& out) const noexcept {
        const Arm& rest = arm_->rest;
        const SinCos<T> theta_7 = sin_cos(T(rest.sign[6]) * free + T(rest.offset[6]));
        const OffsetMotion<T> m = offset_motion(*arm_, pose, gc);
        const OffsetWrist<T> wrist = offset_wrist(*arm_, m, theta_7);
        const double per_reach = 1.0 / rest.reach;
        const Directions<T> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, T(0.0))));
        for (int j = 0; j < joints; ++j) {
            out.y[robot_joint(*arm_, j)] = d.y[j];
            out.x[robot_joint(*arm_, j)] = d.x[j];
        }
        return min(wrist.inside * T(per_reach * per_reach), -wrist.excess * T(per_reach));
    }

    /// Computes the proven arcs of the branches in `asked` (bits) within limits in the robot's order, or why
    /// a branch has none, in `out`.
    void arcs(const Pose<double>& pose, const Limits& limits, unsigned asked,
              ProvenArcs (&out)[configurations]) const noexcept {
        const OffsetArcsTuning tuning;
        detail::OffsetArcs all(*arm_, pose, limits, tuning);
        for (int gc = 0; gc < configurations; ++gc)
            if (asked >> gc & 1u) all.find(gc, configurations - gc, out[gc]);
    }

    /// Draws limits in to the joints that keep the arm's singularity margin in the branch of joints q.
    void keep_margin(const double* q, Limits& limits) const noexcept {
        if (arm_->margin > 0) keep_off_singular(arm_->own, branch_meetings(*arm_), q, arm_->margin, limits);
    }

    /// By how much (m) at least a pose is out of reach, whatever the free joint; <= 0 if it is in reach.
    double excess(const Pose<double>& pose) const noexcept {
        const OffsetMotion<> m = offset_motion(*arm_, pose, 0);
        const Vec3<double>& s = m.from_shoulder;
        const double fixed = dot(s, s) + arm_->a_6 * arm_->a_6;
        const double along = 2.0 * abs(arm_->a_6) * hypot(dot(m.flange.x, s), dot(m.flange.y, s));
        const double nearest = sqrt(max(fixed - along, 0.0)), farthest = sqrt(fixed + along);
        return max(nearest - arm_->rest.reach, arm_->rest.inner_reach - farthest);
    }

    /// Calls take(distance) with the distances (rad) of theta_2 and theta_4 - delta from 0 and pi, and of
    /// theta_5 from +-pi/2, where the self-motion is singular; `theta` holds the angles of the robot's
    /// joints.
    template <class T, class Take>
    void singular_distances(const T* theta, const Take& take) const noexcept {
        const double zero[] = {0.0, arm_->rest.delta_angle};
        for (int k = 0; k < 2; ++k) {
            const T size = abs(wrap(theta[robot_joint(*arm_, 2 * k + 1)] - T(zero[k])));
            take(size);
            take(T(pi) - size);
        }
        take(abs(T(half_pi) - abs(wrap(theta[robot_joint(*arm_, 4)]))));
    }

private:
    const OffsetArm* arm_;
};

static_assert(explicit_family<OffsetFamily>);

}  // namespace armangle

#include "../names/end.hpp"
