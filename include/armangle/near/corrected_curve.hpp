// What the joints of a nearly S-R-S arm do along a curve of arm angles.
//
// A curve says the pose and phi for every s. The nominal arm's posture there is a closed form; the true one
// solves the seven equations of inverse.hpp, with phi's plane in place of psi's, and is next to it. Its
// derivatives follow from the same equations on Taylor coefficients: at a posture that solves them, each step
// of Newton makes twice as many coefficients right.
#pragma once

#include "../plan/curve.hpp"
#include "inverse.hpp"

namespace armangle {

/// A view: a curve of the nominal arm, and the arm whose joints are asked.
struct CorrectedCurve {
    const NearArm& arm;
    const Curve& curve;

    /// The plane of phi at s, on any scalar.
    template <class T>
    detail::PsiPlane<T> plane_at(const Stretch& x, const T& s) const noexcept {
        const T value = phi_at(x, s);
        if (x.lead == 0)
            return {triad(curve.arm, flange_pose(curve.arm, pose_at(curve.segment(x), s)), curve.plane),
                    sin_cos(value)};
        const PlacedDirections<T> here = curve.place(x, s, value);
        return {here.motion.circle, here.phi};
    }

    /// Directions of the true posture at s; not OK where there is none, or another branch.
    Status angles_at(const Stretch& x, double s, SinCos<double> (&angle)[joints]) const noexcept {
        return detail::solve_angles(arm, pose_at(curve.segment(x), s), plane_at(x, s),
                                    configuration(curve.branch(x)), angle);
    }

    /// The true posture at s, on the windings of the nominal one; NaN where there is none.
    PlacedPosture at(double s) const noexcept { return lifted(curve.stretch(s), s, curve.at(s)); }

    /// The same, next to a nominal posture at s.
    PlacedPosture lifted(const Stretch& x, double s, PlacedPosture out) const noexcept {
        SinCos<double> angle[joints];
        const Status status = angles_at(x, s, angle);
        const JointLanes theta = detail::theta_of(angle);
        for (int j = 0; j < joints; ++j)
            out.q[j] = status == Status::OK ? lift(to_q(curve.arm, j, theta[j]), out.q[j]) : not_a_number;
        return out;
    }

    /// theta(s) as Taylor coefficients at s, theirs of order 0 being `theta`: that of a posture on the plane.
    template <int K>
    void expand(const Stretch& x, double s, const double* theta,
                Jet<double, K> (&out)[joints]) const noexcept {
        using J = Jet<double, K>;
        const J at = J::variable(s);
        const Pose<J> pose = pose_at(curve.segment(x), at);
        const detail::PsiPlane<J> plane = plane_at(x, at);
        SinCos<J> angle[joints];
        for (int j = 0; j < joints; ++j) {
            out[j] = J(theta[j]);
            angle[j] = sin_cos(out[j]);
        }
        for (int right = 1; right <= K; right *= 2) {
            J step[joints];
            detail::newton_step(detail::seven_equations(arm, pose, plane, angle), step);
            for (int j = 0; j < joints; ++j) out[j] = out[j] + step[j];
            detail::turn_by(step, angle);
        }
    }

    /// q', q'', q''' with respect to s, as Curve::derivatives; NaN where there is no posture.
    void derivatives(double s, double* out) const noexcept {
        const Stretch& x = curve.stretch(s);
        const PlacedPosture here = at(s);
        double theta[joints];
        Jet<double, 3> series[joints];
        detail::theta_of(curve.arm, here.q, theta);
        expand(x, s, theta, series);
        for (int j = 0; j < joints; ++j)
            for (int k = 1; k <= 3; ++k)
                out[(k - 1) * joints + j] = curve.arm.sign[j] * series[j].coefficient[k] * (k == 3 ? 6.0 : k);
    }
};

}  // namespace armangle
