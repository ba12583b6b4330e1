// Where the joints are over a stretch of psi, for all corrected poses at once: coarse, and without
// derivatives.
//
// A true posture is the nominal one of its corrected pose X = N(theta) T(theta)^-1 pose. If X is known to lie
// in a ball -- its wrist within `wrist` of a centre, its turn within `turn` -- then the frames 0R3 and 4R7
// differ from those of the centre, at the same psi, by a rotation that is bounded by the ball: the direction
// S-W leans by wrist / |S-W|, and the triangle S-E-W changes with the distance. So each joint's direction is
// that of the exact arm's joint function, up to a radius.
//
// Two balls hold X. For any theta: the deviations of all links, about the pose itself. Over a cell of psi:
// the same, about X at the middle, times the angles by which the nominal frames turn there. As the map X -> N
// T^-1 pose takes such a ball into itself, a posture is in it at every psi (Brouwer).
#pragma once

#include "../circle/joint_function.hpp"
#include "inverse.hpp"

namespace armangle {

/// A ball of poses: how far the wrist (m) and the turn (rad) may be from the centre.
struct PoseBall {
    double wrist, turn;
};

/// Where each joint is: within `reach` of theta; infinite where that is not known. `upper_arm` is how far
/// frame 3 may turn away from that of the middle.
struct Coarse {
    double theta[joints], reach[joints], upper_arm;
};

/// The joint functions of a ball of poses 0T7, in one branch.
class CorrectedMotion {
public:
    /// `on` is the circle of the centre; `psi_shift` how much an angle on it may differ from the true psi.
    CorrectedMotion(const Arm& arm, const Pose<double>& centre, const Triad<double>& on,
                    const Configuration<double>& gc, const PoseBall& ball, double psi_shift) noexcept
        : psi_shift_(psi_shift) {
        const double least = on.distance - ball.wrist, most = on.distance + ball.wrist;
        usable_ = least > arm.inner_reach && most < arm.reach && least > 0 && ball.turn < 1.0;
        if (!usable_) return;
        const SelfMotion<double> m = self_motion(arm, circle_on(arm, on, centre), gc);
        f_ = joint_functions(m);
        bend_ = m.elbow.theta_4;
        double beta = 0, gamma = 0, tilt = 0;
        const auto seen = [&](double distance) {
            const Elbow<double> e = elbow(arm, triangle(arm, distance), gc.elbow);
            beta = max(beta, chord(e.beta, m.elbow.beta));
            gamma = max(gamma, chord(e.gamma, m.elbow.gamma));
            tilt = max(tilt, chord(e.tilt, m.elbow.tilt));
            bend_radius_ = max(bend_radius_, chord(e.theta_4, bend_));
        };
        seen(least);
        seen(most);
        // the angle at the end of the longer link is greatest where the shorter one stands across S-W
        const double La = arm.upper_arm, Lb = arm.forearm,
                     across = sqrt(abs(La * La - Lb * Lb) + arm.d_4 * arm.d_4);
        if (across > least && across < most) seen(across);
        const double leaning = abs(m.elbow.tilt.sin / m.elbow.tilt.cos);
        const double lean = slack * (1.0 + 2.0 * leaning) * ball.wrist / least;
        shoulder_ = lean + beta + tilt;
        wrist_ = lean + gamma + tilt + ball.turn;
    }

    /// The joints over |psi - middle| <= half, psi on the circle of the centre.
    Coarse over(double middle, double half) const noexcept {
        Coarse out;
        for (double& reach : out.reach) reach = infinity;
        out.upper_arm = infinity;
        if (!usable_) return out;
        const SinCos<double> at = sin_cos(middle);
        const double wide = half + psi_shift_;
        double y[joint_slots] = {}, x[joint_slots] = {1, 1, 1, 1, 1, 1, 1, 1}, off[joints];
        for (int p = 0; p < 4; ++p) {
            const Pivot<double>& pivot = f_.pivot[p];
            const int joint = 2 * p;
            y[joint] = pivot.g * pivot.U.at(at);
            x[joint] = pivot.g * pivot.V.at(at);
            off[joint] =
                hypot(spread(pivot.U, at, wide), spread(pivot.V, at, wide)) + (p < 2 ? shoulder_ : wrist_);
        }
        for (int h = 0; h < 2; ++h) {
            const int joint = 1 + 4 * h, pivot = 4 * h;
            y[joint] = f_.hinge[h].g * hypot(y[pivot], x[pivot]);
            x[joint] = f_.hinge[h].H.at(at);
            off[joint] = hypot(off[pivot], spread(f_.hinge[h].H, at, wide) + (h == 0 ? shoulder_ : wrist_));
        }
        y[3] = bend_.sin;
        x[3] = bend_.cos;
        off[3] = bend_radius_;
        const JointLanes theta = atan2(JointLanes::of(y), JointLanes::of(x));
        for (int j = 0; j < joints; ++j) {
            const double rest = y[j] * y[j] + x[j] * x[j] - off[j] * off[j];
            out.theta[j] = theta[j];
            // an angle is at most its tangent; a hinge must keep its side of 0 and pi
            if (rest > 0 && !(j % 4 == 1 && abs(y[j]) <= off[j - 1])) out.reach[j] = off[j] / sqrt(rest);
        }
        out.upper_arm = wide + shoulder_;
        return out;
    }

private:
    static constexpr double slack = 1.1;  // of a small angle over its sine, and of turns about two axes

    static double chord(const SinCos<double>& a, const SinCos<double>& b) noexcept {
        return hypot(a.sin - b.sin, a.cos - b.cos);
    }

    /// How far a harmonic is from its value at `middle` over |psi - middle| <= half.
    static double spread(const Harmonic<double>& h, const SinCos<double>& middle, double half) noexcept {
        return half * (abs(h.slope(middle)) + 0.5 * half * hypot(h.s, h.c));
    }

    double psi_shift_;
    bool usable_ = false;
    JointFunctions<double> f_;
    SinCos<double> bend_{0.0, 1.0};
    double bend_radius_ = 0, shoulder_ = 0, wrist_ = 0;
};

namespace near_rule {
inline constexpr int balls = 3;  // tried over a cell
inline constexpr double first_turn =
    4.0;  // of a nominal frame over the half width of a cell, supposed at first
}  // namespace near_rule

namespace detail {

/// The ball that frames turning by up to `turn[k]` keep X in; F_0 does not turn.
inline PoseBall turned_ball(const NearArm& arm, const double (&turn)[joints + 1]) noexcept {
    constexpr double slack = 1.1;  // products of deviations
    PoseBall out{0.0, 0.0};
    for (int k = 1; k <= joints; ++k) {
        out.wrist += slack * min(turn[k], 2.0) * arm.swing[k];
        out.turn += slack * min(turn[k], 2.0) * arm.deviation[k].rotation;
    }
    out.wrist /= 1.0 - min(arm.turn, 0.5);
    return out;
}

/// How far the nominal frames F_k = H_0 Rz(theta_1) ... Rz(theta_k) turn over a stretch.
inline void frames_turn(const Coarse& c, double turn_of_pose, double (&turn)[joints + 1]) noexcept {
    turn[0] = 0.0;
    turn[3] = c.upper_arm;
    turn[1] = c.reach[0];
    turn[2] = min(turn[1] + c.reach[1], turn[3] + c.reach[2]);
    turn[4] = turn[3] + c.reach[3];
    turn[7] = turn_of_pose;
    turn[6] = turn[7] + c.reach[6];
    turn[5] = min(turn[4] + c.reach[4], turn[6] + c.reach[5]);
}

}  // namespace detail

/// Where the joints are over |psi - middle| <= half, by a posture at the middle: `angle`, on the plane of the
/// pose's circle `on`.
inline Coarse coarse_about(const NearArm& arm, const Pose<double>& pose, const Triad<double>& on,
                           const detail::PsiPlane<double>& plane, const SinCos<double> (&angle)[joints],
                           const Configuration<double>& gc, double half) noexcept {
    const Arm& nominal = arm.nominal;
    double q[joints], turn[joints + 1];
    const JointLanes theta = detail::theta_of(angle);
    for (int j = 0; j < joints; ++j) q[j] = to_q(nominal, j, theta[j]);
    const Pose<double> corrected =
        user_pose(nominal, chain(nominal, q).flange) * (inverted(detail::tip(arm, angle)) * pose);
    const Pose<double> centre = flange_pose(nominal, corrected);
    const Triad<double> there = triad(
        nominal, centre,
        [&](const Vec3<double>& p, const Vec3<double>& w) noexcept { return plane.normal(nominal, p, w); });
    const double lean = norm(there.w - on.w);
    const double psi_shift = 2.0 * lean * (lean + abs(nominal.d_4) / there.distance) * half;
    for (int k = 0; k <= joints; ++k) turn[k] = near_rule::first_turn * half;
    PoseBall ball = detail::turned_ball(arm, turn);
    Coarse out{};
    for (int pass = 0; pass < near_rule::balls; ++pass) {
        out = CorrectedMotion(nominal, centre, there, gc, ball, psi_shift).over(0.0, half);
        detail::frames_turn(out, ball.turn, turn);
        const PoseBall kept = detail::turned_ball(arm, turn);
        if (kept.wrist <= ball.wrist && kept.turn <= ball.turn) return out;
        ball = {max(ball.wrist, 1.2 * kept.wrist), max(ball.turn, 1.2 * kept.turn)};
    }
    for (double& reach : out.reach) reach = infinity;
    return out;
}

}  // namespace armangle
