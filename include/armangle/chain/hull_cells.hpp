// Cells of psi of a nearly S-R-S arm: about the posture at the middle a hull says what the true joints do,
// theta = theta_c + u t + rho, |rho_i| <= r_i.
#pragma once

#include "../scene/clear_cells.hpp"
#include "feasible.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Proven bounds of the true joints over cells of psi, for one pose and branch.
class HullCells {
public:
    static constexpr double widest = 0.0123;  // rad: wider ones are hardly ever proven

    /// Computes the axis shoulder-wrist of a pose (tool frame) in branch gc; no posture is known yet.
    HullCells(const ChainArm& arm, const Pose<double>& pose, int gc) noexcept
        : arm_(arm),
          pose_(pose),
          on_(triad(arm.nominal, flange_pose(arm.nominal, pose))),
          gc_(configuration(gc)) {}

    /// Computes the bounds over [psi - half, psi + half] (rad) in `out`; returns whether they are proven.
    bool over(double psi, double half, StraightCell& out) noexcept {
        const PsiPlane<double> plane(on_, sin_cos(psi));
        SinCos<double> angle[joints];
        if (!posture(plane, angle)) return false;
        const JointLanes theta = theta_of(angle);
        Hull<double> hull{};
        if (half > 0 && !(prove_hull(arm_, pose_, plane, angle, psi, half, hull) &&
                          keeps_branch(arm_.nominal, gc_, hull)))
            return false;
        for (int j = 0; j < joints; ++j) {
            const double sign = arm_.nominal.sign[j];
            out.q[j] = sign * (theta[j] - arm_.nominal.offset[j]);
            out.d[j] = sign * half * hull.slope[j];
            out.off[j] = half > 0 ? hull.radius[j] : ChainHullTuning::rounding;
        }
        return true;
    }

private:
    /// Writes the posture at a psi to `angle`, found directly or from the posture found last; false if none
    /// is found.
    bool posture(const PsiPlane<double>& plane, SinCos<double> (&angle)[joints]) noexcept {
        bool found = solve_quickly(arm_, pose_, plane, gc_, angle);
        if (!found && known_) {
            for (int j = 0; j < joints; ++j) angle[j] = last_[j];
            found = newton(arm_, pose_, plane, gc_, angle) == Status::OK;
        }
        found = found || (hard_++ < PostureTrailTuning::hard &&
                          solve_angles(arm_, pose_, plane, gc_, angle) == Status::OK);
        if (!found) return false;
        for (int j = 0; j < joints; ++j) last_[j] = angle[j];
        return known_ = true;
    }

    const ChainArm& arm_;
    const Pose<double>& pose_;
    const Triad<double> on_;
    const Configuration<double> gc_;
    bool known_ = false;
    SinCos<double> last_[joints];
    int hard_ = 0;
};

}  // namespace detail

/// Selects HullCells for an arm on its own chain.
template <>
struct CellsOf<ChainArm> {
    using type = detail::HullCells;
};

/// Writes to `out` the values of psi at which branch gc of the true chain is proven to have a solution within
/// the limits, with the singularity margin (rad), that is free of collisions in a scene; empty, with the
/// reason in its status, if there are none. `blocking` is then a pair that was found to touch; 0 if none is
/// known.
inline void feasible(const ChainArm& arm, const Scene& scene, const Pose<double>& pose, int gc,
                     const Limits& limits, double margin, ProvenArcs& out, Tag& blocking) noexcept {
    feasible(arm, pose, gc, limits, margin, out);
    keep_clear(arm, scene, pose, gc, out, blocking);
}

}  // namespace armangle

#include "../names/end.hpp"
