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

/// How fast X moves with psi: its wrist (m/rad) and its turn (rad/rad), at most.
template <class T>
struct Pace {
    T wrist, turn;
};

/// Where each joint is: within `reach` of theta; infinite where that is not known. `upper_arm` is how far
/// frame 3 may turn away from that of the middle.
struct Coarse {
    double theta[joints], reach[joints], upper_arm;
};

/// What is known of a stretch: that it keeps what is asked, that it breaks it, or neither.
enum class Known : std::uint8_t { inside, outside, open };

/// The joint functions of a ball of poses 0T7, in one branch. usable() says whether there are any.
class CorrectedMotion {
public:
    /// `on` is the circle of the centre.
    CorrectedMotion(const Arm& arm, const Pose<double>& centre, const Triad<double>& on,
                    const Configuration<double>& gc) noexcept
        : arm_(arm), distance_(on.distance), elbow_side_(gc.elbow) {
        if (!(distance_ > arm.inner_reach && distance_ < arm.reach)) return;
        const SelfMotion<double> m = self_motion(arm, circle_on(arm, on, centre), gc);
        f_ = joint_functions(m);
        elbow_ = m.elbow;
        known_ = true;
    }

    /// Takes a ball about the centre; `psi_shift` is how much an angle on its circle may differ from the true
    /// psi. Not where it goes beyond the reach: there need be no posture.
    void widen(const PoseBall& ball, double psi_shift) noexcept {
        const double least = distance_ - ball.wrist, most = distance_ + ball.wrist;
        if (least > arm_.inner_reach && most < arm_.reach) {
            widen(ball, psi_shift, least, most);
            if (usable_) lean_or_reach(ball, least, most);
        } else {
            usable_ = false;
        }
    }
    /// The same of what a ball has within the reach, where all its postures are, if there are any.
    void widen_within_reach(const PoseBall& ball, double psi_shift) noexcept {
        widen(ball, psi_shift, max(distance_ - ball.wrist, arm_.inner_reach),
              min(distance_ + ball.wrist, arm_.reach));
    }
    bool usable() const noexcept { return usable_; }

    /// A limit as functions of psi: kept where both are >= 0, or one of them where `either`; each is known
    /// within its slack. What is no limit is never broken: where it is not kept there may be no posture.
    struct Condition {
        Harmonic<double> low, high;
        double low_slack, high_slack;
        bool either, limit;

        /// Which of some psi, a bit each, keep it, and which break it; and where each function is open.
        struct Told {
            unsigned inside, outside, low_open, high_open;
        };
        template <int N>
        ARMANGLE_INLINE Told at(const SinCos<Lane<N>>& psi) const noexcept {
            using T = Lane<N>;
            const T a = Harmonic<T>{low.s, low.c, low.k}.at(psi),
                    b = Harmonic<T>{high.s, high.c, high.k}.at(psi);
            const unsigned a_in = bits(a > T(low_slack)), b_in = bits(b > T(high_slack));
            const unsigned a_out = bits(a < T(-low_slack)), b_out = bits(b < T(-high_slack));
            Told out{either ? a_in | b_in : a_in & b_in, either ? a_out & b_out : a_out | b_out,
                     ~(a_in | a_out), ~(b_in | b_out)};
            if (!limit) out.outside = 0;
            return out;
        }
    };

    /// Theta of a joint in [lower, upper], less than a turn, psi on the circle of the centre.
    Condition condition(int joint, double lower, double upper) const noexcept {
        const double radius = joint < 3 ? shoulder_ : wrist_;
        Condition out{{0, 0, 0}, {0, 0, 0}, 1.0, 1.0, upper - lower > pi, true};
        if (joint % 4 == 1) {
            // |theta| within [near, far] of [0, pi]; a range that comes in again from behind stays open
            const Hinge<double>& h = f_.hinge[joint / 4];
            const double from = h.g > 0 ? lower : -upper, to = h.g > 0 ? upper : -lower;
            if (from + two_pi < pi || to - two_pi > 0) return out;
            const double near = min(max(from, 0.0), pi), far = min(max(to, 0.0), pi);
            out.either = false;
            out.low = {-h.H.s, -h.H.c, (near > 0 ? sin_cos(near).cos : 3.0) - h.H.k};
            out.high = {h.H.s, h.H.c, h.H.k - (far < pi ? sin_cos(far).cos : -3.0)};
            if (from > pi || to < 0) out.low.k = -3.0;
        } else {
            const SinCos<double> l = sin_cos(lower), u = sin_cos(upper);
            if (joint == 3) {
                const SinCos<double>& t = elbow_.theta_4;
                out.low.k = t.sin * l.cos - t.cos * l.sin;
                out.high.k = t.cos * u.sin - t.sin * u.cos;
                out.low_slack = out.high_slack = bend_radius_;
                return out;
            }
            const Pivot<double>& p = f_.pivot[joint / 2];
            const auto across = [&p](double sine, double cosine) {
                return Harmonic<double>{p.g * (p.U.s * cosine - p.V.s * sine),
                                        p.g * (p.U.c * cosine - p.V.c * sine),
                                        p.g * (p.U.k * cosine - p.V.k * sine)};
            };
            out.low = across(l.sin, l.cos);
            out.high = across(-u.sin, -u.cos);
        }
        out.low_slack = radius + psi_shift_ * hypot(out.low.s, out.low.c);
        out.high_slack = radius + psi_shift_ * hypot(out.high.s, out.high.c);
        return out;
    }

    /// That the directions of the joints beside a hinge (0, 1) do not vanish: there a posture is.
    Condition regular(int hinge) const noexcept {
        const double radius = hinge == 0 ? shoulder_ : wrist_;
        const Harmonic<double>& H = f_.hinge[hinge].H;
        const double wide = radius + psi_shift_ * (hypot(H.s, H.c) + 1.0);
        const double most = sqrt(max(1.0 - wide * wide, 0.0));
        return {{-H.s, -H.c, most - H.k}, {H.s, H.c, most + H.k}, 0.0, 0.0, false, false};
    }

    /// How fast X moves with psi over |psi - middle| <= half < 1, on the circle of the centre, stretches side
    /// by side; and in which of them that is known.
    template <int N>
    ARMANGLE_INLINE LaneMask<N> pace(const NearArm& near, const Lane<N>& middle, const Lane<N>& half,
                                     Pace<Lane<N>>& out) const noexcept {
        using T = Lane<N>;
        const T one(1.0), zero(0.0);
        const SinCos<T> at = sin_cos(middle), by = sin_cos(half);
        struct Sweep {
            T value, off, speed;  // at the middle; how far from it, and how fast, it may be
        };
        const auto sweep = [&](const Harmonic<double>& h) {
            const T moving = mul_add(T(h.s), at.sin, T(h.c) * at.cos), a = abs(moving),
                    b = abs(T(h.s) * at.cos - T(h.c) * at.sin);
            return Sweep{moving + T(h.k), b * by.sin + a * (one - by.cos), b + a * by.sin};
        };
        T speed[joints], per_length[4];
        auto known = zero < one;
        for (int p = 0; p < 4; ++p) {
            const Sweep u = sweep(f_.pivot[p].U), v = sweep(f_.pivot[p].V);
            const T wide((p < 2 ? shoulder_ : wrist_) + psi_shift_);
            const Sweep across = sweep(f_.hinge[p / 2].H);
            const T straight = abs(across.value) + across.off;
            const T length = sqrt(max(one - straight * straight, zero)) - wide;
            known = known & (length > zero);
            per_length[p] = one / length;
            speed[2 * p] = hypot(u.speed, v.speed) + T(2.0 * slack) * wide;
        }
        for (int h = 0; h < 2; ++h)
            speed[1 + 4 * h] =
                hypot(speed[4 * h], sweep(f_.hinge[h].H).speed +
                                        T(2.0 * slack * ((h == 0 ? shoulder_ : wrist_) + psi_shift_)));
        const auto kept = [&](const Pace<T>& x) {
            const T shoulder = T(shoulder_rate_) * x.wrist, wrist = T(wrist_rate_) * x.wrist + x.turn;
            const auto pivot = [&](int p) {
                return (speed[2 * p] + (p < 2 ? shoulder : wrist)) * per_length[p];
            };
            T turn[joints + 1];
            turn[1] = pivot(0);
            turn[3] = one + shoulder;
            turn[2] = min(turn[1] + speed[1] + T(1.5) * shoulder, turn[3] + pivot(1));
            turn[4] = turn[3] + T(bend_rate_) * x.wrist;
            turn[7] = x.turn;
            turn[6] = turn[7] + pivot(3);
            turn[5] = min(turn[4] + pivot(2), turn[6] + speed[5] + T(1.5) * wrist);
            Pace<T> sum{zero, zero};
            for (int k = 1; k <= joints; ++k) {
                sum.wrist = mul_add(turn[k], T(near.swing[k]), sum.wrist);
                sum.turn = mul_add(turn[k], T(near.deviation[k].rotation), sum.turn);
            }
            return Pace<T>{sum.wrist * T(slack / (1.0 - min(near.turn, 0.5))), sum.turn * T(slack)};
        };
        // kept() is affine and rises: what it does not raise it bounds
        const Pace<T> still = kept({zero, zero}),
                      supposed{still.wrist + still.wrist, still.turn + still.turn};
        out = kept(supposed);
        return known & (out.wrist <= supposed.wrist) & (out.turn <= supposed.turn);
    }

    /// How fast the function of a limit of a joint may change with psi beside that of the centre, X at a
    /// pace.
    template <int N>
    ARMANGLE_INLINE Lane<N> drift(const bool (&of_shoulder)[N], const Pace<Lane<N>>& x) const noexcept {
        using T = Lane<N>;
        double rate[N], wide[N], turns[N];
        for (int k = 0; k < N; ++k) {
            rate[k] = of_shoulder[k] ? shoulder_rate_ : wrist_rate_;
            wide[k] = 2.0 * slack * ((of_shoulder[k] ? shoulder_ : wrist_) + psi_shift_);
            turns[k] = of_shoulder[k] ? 0.0 : 1.0;
        }
        return T::load(wide) + T::load(rate) * x.wrist + T::load(turns) * x.turn;
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
        y[3] = elbow_.theta_4.sin;
        x[3] = elbow_.theta_4.cos;
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
    void widen(const PoseBall& ball, double psi_shift, double least, double most) noexcept {
        psi_shift_ = psi_shift;
        usable_ = known_ && least > 0 && ball.turn < 1.0;
        if (!usable_) return;
        double beta = 0, gamma = 0, tilt = 0;
        bend_radius_ = bend_rate_ = shoulder_rate_ = wrist_rate_ = 0;
        const double La = arm_.upper_arm, Lb = arm_.forearm;
        const auto seen = [&](double distance) {
            const Triangle<double> t = triangle(arm_, distance);
            const Elbow<double> e = elbow(arm_, t, elbow_side_);
            beta = max(beta, chord(e.beta, elbow_.beta));
            gamma = max(gamma, chord(e.gamma, elbow_.gamma));
            tilt = max(tilt, chord(e.tilt, elbow_.tilt));
            bend_radius_ = max(bend_radius_, chord(e.theta_4, elbow_.theta_4));
            bend_rate_ = max(bend_rate_, distance / (La * Lb * t.eta.sin));
            // cotangents of the triangle's angles at the wrist and at the shoulder
            shoulder_rate_ = max(shoulder_rate_, abs(Lb + La * t.eta.cos) / (La * t.eta.sin));
            wrist_rate_ = max(wrist_rate_, abs(La + Lb * t.eta.cos) / (Lb * t.eta.sin));
        };
        seen(least);
        seen(most);
        // the angle at the end of the longer link is greatest where the shorter one stands across S-W
        const double across = sqrt(abs(La * La - Lb * Lb) + arm_.d_4 * arm_.d_4);
        if (across > least && across < most) seen(across);
        const double leaning = abs(elbow_.tilt.sin / elbow_.tilt.cos);
        const double lean_rate = slack * (1.0 + 2.0 * leaning) / least;
        lean_ = lean_rate * ball.wrist;
        beta_ = beta;
        gamma_ = gamma;
        tilt_ = tilt;
        shoulder_ = lean_ + beta + tilt;
        wrist_ = lean_ + gamma + tilt + ball.turn;
        // an angle of the triangle changes by the other's cotangent; all are fastest at one of the two ends.
        // What moves S-W along itself does not lean it
        const double square = least * least - arm_.d_4 * arm_.d_4;  // of S-W across axis 4
        const double tilting_rate = abs(arm_.d_4) / (least * sqrt(square));
        beta_rate_ = shoulder_rate_ * least / square;
        gamma_rate_ = wrist_rate_ * least / square;
        shoulder_rate_ = hypot(beta_rate_ + tilting_rate, lean_rate);
        wrist_rate_ = hypot(gamma_rate_ + tilting_rate, lean_rate);
    }

    /// The same of a ball that is all within the reach: a wrist that leans most keeps its distance, and one
    /// that comes nearest or farthest does not lean. A share t of the way to either end changes an angle by
    /// at most t of what the ends do where it bends one way: where both angles of the triangle are within
    /// 60 degrees. Else it changes by t of the greatest rate.
    void lean_or_reach(const PoseBall& ball, double least, double most) noexcept {
        const Triangle<double> t = triangle(arm_, least);
        const double lower_cos = mul_add(t.eta.cos, t.kappa.cos, t.eta.sin * t.kappa.sin);
        if (min(t.kappa.cos, lower_cos) >= 0.5) {
            double uneven = 1.0;  // of what is across axis 4
            if (arm_.d_4 != 0) {
                const auto across = [&](double distance) {
                    return sqrt(distance * distance - arm_.d_4 * arm_.d_4);
                };
                uneven = (across(distance_) - across(least)) / (across(most) - across(distance_));
            }
            beta_ = uneven * arc(beta_);
            gamma_ = uneven * arc(gamma_);
        } else {
            beta_ = beta_rate_ * ball.wrist;
            gamma_ = gamma_rate_ * ball.wrist;
        }
        shoulder_ = hypot(lean_, beta_ + tilt_);
        wrist_ = hypot(lean_, gamma_ + tilt_) + ball.turn;
    }

    /// No less than the angle of a chord below 1.
    static double arc(double chord) noexcept { return chord * (1.0 + 0.05 * chord * chord); }

    static constexpr double slack = 1.1;  // of a small angle over its sine, and of turns about two axes

    static double chord(const SinCos<double>& a, const SinCos<double>& b) noexcept {
        return hypot(a.sin - b.sin, a.cos - b.cos);
    }

    /// How far a harmonic is from its value at `middle` over |psi - middle| <= half.
    static double spread(const Harmonic<double>& h, const SinCos<double>& middle, double half) noexcept {
        return half * (abs(h.slope(middle)) + 0.5 * half * hypot(h.s, h.c));
    }

    const Arm& arm_;
    double distance_, elbow_side_;
    bool known_ = false, usable_ = false;
    JointFunctions<double> f_;
    Elbow<double> elbow_;
    double psi_shift_ = 0, bend_radius_ = 0, shoulder_ = 0, wrist_ = 0;
    double bend_rate_ = 0, shoulder_rate_ = 0, wrist_rate_ = 0;  // how fast they grow, rad/m of the wrist
    double lean_ = 0, beta_ = 0, gamma_ = 0, tilt_ = 0, beta_rate_ = 0, gamma_rate_ = 0;
};

namespace near_rule {
inline constexpr int balls = 6;  // tried over a cell
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

/// The motion over |psi - middle| <= half, by a posture at the middle: `angle`, on the plane of the pose's
/// circle `on`. Its psi counts from the middle. `joints_over` takes where the joints are then.
inline CorrectedMotion motion_about(const NearArm& arm, const Triad<double>& on,
                                    const detail::PsiPlane<double>& plane,
                                    const SinCos<double> (&angle)[joints], const Configuration<double>& gc,
                                    double half, Coarse& joints_over) noexcept {
    const Arm& nominal = arm.nominal;
    double q[joints], turn[joints + 1];
    const JointLanes theta = detail::theta_of(angle);
    for (int j = 0; j < joints; ++j) q[j] = to_q(nominal, j, theta[j]);
    const Pose<double> centre = chain(nominal, q).flange;
    const Triad<double> there = triad(
        nominal, centre,
        [&](const Vec3<double>& p, const Vec3<double>& w) noexcept { return plane.normal(nominal, p, w); });
    const double lean = norm(there.w - on.w);
    const double psi_shift = 2.0 * lean * (lean + abs(nominal.d_4) / there.distance) * half;
    for (int k = 0; k <= joints; ++k) turn[k] = near_rule::first_turn * half;
    PoseBall ball = detail::turned_ball(arm, turn);
    CorrectedMotion out(nominal, centre, there, gc);
    for (int pass = 0; pass < near_rule::balls; ++pass) {
        out.widen(ball, psi_shift);
        joints_over = out.over(0.0, half);
        detail::frames_turn(joints_over, ball.turn, turn);
        const PoseBall kept = detail::turned_ball(arm, turn);
        if (kept.wrist <= ball.wrist && kept.turn <= ball.turn) {
            if (2.0 * kept.wrist < ball.wrist) {  // what is kept keeps itself
                out.widen(kept, psi_shift);
                joints_over = out.over(0.0, half);
            }
            return out;
        }
        ball = {max(ball.wrist, 1.2 * kept.wrist), max(ball.turn, 1.2 * kept.turn)};
    }
    out.widen({infinity, infinity}, psi_shift);
    joints_over = out.over(0.0, half);
    return out;
}

/// The motion over the whole circle: the links between the joints move X by what they can, for any theta.
inline CorrectedMotion motion_around(const NearArm& arm, const Pose<double>& pose, const Triad<double>& on,
                                     const Configuration<double>& gc) noexcept {
    const Arm& nominal = arm.nominal;
    const Pose<double> centre = flange_pose(nominal, arm.first * pose * arm.last);
    const detail::PsiPlane<double> plane(on, {0.0, 1.0});
    const Triad<double> there = triad(
        nominal, centre,
        [&](const Vec3<double>& p, const Vec3<double>& w) noexcept { return plane.normal(nominal, p, w); });
    const double lean = norm(there.w - on.w);
    CorrectedMotion out(nominal, centre, there, gc);
    out.widen({arm.joint_shift, arm.joint_turn},
              2.0 * lean * (lean + abs(nominal.d_4) / there.distance) * pi);
    return out;
}

/// Where the joints are over |psi - middle| <= half.
inline Coarse coarse_about(const NearArm& arm, const Triad<double>& on, const detail::PsiPlane<double>& plane,
                           const SinCos<double> (&angle)[joints], const Configuration<double>& gc,
                           double half) noexcept {
    Coarse out;
    motion_about(arm, on, plane, angle, gc, half, out);
    return out;
}

}  // namespace armangle
