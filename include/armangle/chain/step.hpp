// What a step and a lookahead ask of an arm on its own chain: its free number is psi.
#pragma once

#include "../motion/follow.hpp"
#include "hull_cells.hpp"
#include "nearest_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What steps need to know about an arm on its own chain (motion/stepping_family.hpp), with a singularity
/// margin (rad). A target for the elbow is one for the nominal arm's elbow.
class ChainSteps {
public:
    /// Keeps a pointer to an arm, and its singularity margin (rad).
    ChainSteps(const ChainArm& arm, double margin) noexcept : arm_(&arm), margin_(margin) {}

    /// The arm itself.
    const ChainArm& arm() const noexcept { return *arm_; }
    /// The nominal arm.
    const Arm& rows() const noexcept { return arm_->nominal; }
    /// The singularity margin (rad).
    double margin() const noexcept { return margin_; }

    /// The psi and branch of joints q. If `carry` asks for the elbow, or psi is undefined at q, psi is that
    /// of the elbow axis on the circle of `pose`.
    OnSelfMotion on(const double* q, const Pose<double>& pose, Carry carry) const noexcept {
        const Posture now = forward(*arm_, q);
        if (carry == Carry::psi && !is_nan(now.psi)) return {now.psi, now.gc};
        double theta[joints];
        SinCos<double> angle[joints];
        detail::theta_of(rows(), q, theta);
        detail::sin_cos_all(theta, angle);
        return {arm_angle(triad(rows(), flange_pose(rows(), pose)), detail::elbow_axis(angle)), now.gc};
    }
    /// Writes the directions of the joints at a pose, branch and psi to d; if the status is not OK, d is no
    /// solution. The last argument, a seed, is not used.
    Status at(const Pose<double>& pose, int gc, double psi, const double*,
              Directions<double>& d) const noexcept {
        const Triad<double> on = triad(rows(), flange_pose(rows(), pose));
        Status status = detail::reach_status(*arm_, on);
        if (status != Status::OK) return status;
        SinCos<double> angle[joints];
        status = detail::solve_angles(*arm_, pose, {on, sin_cos(psi)}, configuration(gc), angle);
        for (int j = 0; j < joints; ++j) {
            d.y[j] = angle[j].sin;
            d.x[j] = angle[j].cos;
        }
        d.y[joints] = 0.0;
        d.x[joints] = 1.0;
        return status;
    }
    /// Writes the proven arcs of a pose in branch gc within limits to `out`.
    void arcs(const Pose<double>& pose, int gc, const Limits& limits, ProvenArcs& out) const noexcept {
        feasible(*arm_, pose, gc, limits, margin_, out);
    }
    /// The joints and angles at which branches meet.
    BranchMeetings meetings() const noexcept { return branch_meetings(rows()); }
    /// The joints, counted from 0, at whose singular position a step may change the branch: 1 and 5.
    std::span<const int> hinges() const noexcept { return hinge_joint; }
    /// The psi (rad) nearest to a target of the elbow; NaN if all are equally good.
    double towards(const Pose<double>& pose, int gc, const Towards& towards) const noexcept {
        return psi_towards(rows(), self_motion(rows(), pose, configuration(gc)), towards).psi;
    }
    /// By how much psi changes if the tool rolls by an angle: always 0, as psi belongs to the elbow.
    double turned_by(double) const noexcept { return 0.0; }
    /// The nearest solution of a pose.
    Nearest nearest(const Pose<double>& pose, const NearestOptions& options,
                    const Scene* scene) const noexcept {
        return nearest_posture(*arm_, margin_, pose, options, scene);
    }

private:
    const ChainArm* arm_;
    double margin_;
};

static_assert(stepping_family<ChainSteps>);

/// The functions for steps of an arm, without a singularity margin.
inline ChainSteps steps_of(const ChainArm& arm) noexcept { return {arm, 0.0}; }

/// The step from joints q_now to `pose` within the arm's limits and a singularity margin (rad); Step::psi is
/// its psi.
inline Step step(const ChainArm& arm, double margin, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    return step(ChainSteps(arm, margin), q_now, pose, options);
}

}  // namespace armangle

#include "../names/end.hpp"
