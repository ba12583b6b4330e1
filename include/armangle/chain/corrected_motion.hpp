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
#include "../limits/limit_table.hpp"
#include "../self_motion/pieces.hpp"
#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A ball of poses: bounds of the distance of the wrist (m) and of the rotation (rad) from a centre.
template <class T>
struct PoseBall {
    T wrist, turn;
};

/// Bounds of how fast the corrected pose X changes with psi: its wrist (m/rad) and rotation (rad/rad).
template <class T>
struct PoseRate {
    T wrist, turn;
};

/// Bounds of the joints over a stretch: each is within `reach` (rad) of theta; infinite if unknown.
/// `upper_arm` bounds the rotation (rad) of frame 3 from the middle.
template <class T>
struct Coarse {
    T theta[joints], reach[joints], upper_arm;
};

/// The joint functions of all poses 0T7 in a ball, in one branch. usable() tells whether they are valid. T
/// may be several lanes, for several balls.
template <class T>
class CorrectedMotion {
public:
    using Mask = decltype(T() < T());

    /// Computes the joint functions of `arm` for a ball around pose `centre` in branch gc; `on` has its axis
    /// shoulder-wrist and the zero of psi. Not usable unless the wrist is strictly within reach.
    CorrectedMotion(const Arm& arm, const Pose<T>& centre, const Triad<T>& on,
                    const Configuration<T>& gc) noexcept
        : arm_(&arm),
          distance_(on.distance),
          elbow_side_(gc.elbow),
          known_((T(arm.inner_reach) < on.distance) & (on.distance < T(arm.reach))),
          usable_(known_) {
        if (!any(known_)) return;
        const SelfMotion<T> m = self_motion(arm, circle_on(arm, on, centre), gc);
        f_ = joint_functions(m);
        elbow_ = m.elbow;
    }

    /// Number k of several motions.
    template <int N>
    CorrectedMotion(const CorrectedMotion<Lane<N>>& all, int k) noexcept
        : arm_(all.arm_),
          distance_(all.distance_[k]),
          elbow_side_(all.elbow_side_[k]),
          known_(all.known_[k]),
          usable_(all.usable_[k]) {
        const auto pick = [k](const Harmonic<Lane<N>>& h) { return Harmonic<T>{h.s[k], h.c[k], h.k[k]}; };
        for (int p = 0; p < 4; ++p) {
            const auto& from = all.f_.pivot[p];
            f_.pivot[p] = {pick(from.U), pick(from.V), from.g[k]};
        }
        for (int h = 0; h < hinges; ++h) {
            f_.hinge[h].H = pick(all.f_.hinge[h].H);
            f_.hinge[h].g = all.f_.hinge[h].g[k];
        }
        elbow_.theta_4 = {all.elbow_.theta_4.sin[k], all.elbow_.theta_4.cos[k]};
        psi_shift_ = all.psi_shift_[k];
        bend_radius_ = all.bend_radius_[k];
        shoulder_ = all.shoulder_[k];
        wrist_ = all.wrist_[k];
    }

    /// Widens the functions to a ball around the centre, and psi by `psi_shift` (rad). Not usable if the ball
    /// is partly out of reach.
    void widen(const PoseBall<T>& ball, const T& psi_shift) noexcept {
        const T least = distance_ - ball.wrist, most = distance_ + ball.wrist;
        usable_ = known_ & (T(arm_->inner_reach) < least) & (most < T(arm_->reach));
        widen(ball, psi_shift, least, most, true);
    }
    /// Widens the functions to the part of a ball around the centre that is in reach, and psi by `psi_shift`
    /// (rad).
    void widen_within_reach(const PoseBall<T>& ball, const T& psi_shift) noexcept {
        usable_ = known_;
        widen(ball, psi_shift, max(distance_ - ball.wrist, T(arm_->inner_reach)),
              min(distance_ + ball.wrist, T(arm_->reach)), false);
    }
    /// Whether (or for which lanes) the bounds are valid.
    const Mask& usable() const noexcept { return usable_; }
    /// Keeps only the lanes in `some`.
    void keep(const Mask& some) noexcept { usable_ = usable_ & some; }

    /// A condition as two functions of psi: it holds if both are >= 0, or, if `either`, one of them; each is
    /// known up to its slack. If `limit` is false, a violation does not exclude a posture but means that none
    /// is certain.
    struct Condition {
        Harmonic<double> low, high;
        double low_slack, high_slack;
        bool either, limit;

        /// For several psi, as bits: where the condition certainly holds, where it is certainly violated, and
        /// where each function is undecided.
        struct Decided {
            unsigned inside, outside, low_open, high_open;
        };
        /// Evaluates the condition at several psi.
        template <int N>
        ARMANGLE_INLINE Decided at(const SinCos<Lane<N>>& psi) const noexcept {
            using Several = Lane<N>;
            const Several a = Harmonic<Several>{low.s, low.c, low.k}.at(psi),
                          b = Harmonic<Several>{high.s, high.c, high.k}.at(psi);
            const unsigned a_in = bits(a > Several(low_slack)), b_in = bits(b > Several(high_slack));
            const unsigned a_out = bits(a < Several(-low_slack)), b_out = bits(b < Several(-high_slack));
            Decided out{either ? a_in | b_in : a_in & b_in, either ? a_out & b_out : a_out | b_out,
                        ~(a_in | a_out), ~(b_in | b_out)};
            if (!limit) out.outside = 0;
            return out;
        }
    };

    /// The condition that the angle of a joint (0..6) is in [lower, upper] (rad, less than 2 pi apart).
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

    /// The condition that a posture exists: the joints next to hinge joint 2 (0) or 6 (1) have well-defined
    /// directions.
    Condition regular(int hinge) const noexcept {
        const double radius = hinge == 0 ? shoulder_ : wrist_;
        const Harmonic<double>& H = f_.hinge[hinge].H;
        const double wide = radius + psi_shift_ * (hypot(H.s, H.c) + 1.0);
        const double most = sqrt(max(1.0 - wide * wide, 0.0));
        return {{-H.s, -H.c, most - H.k}, {H.s, H.c, most + H.k}, 0.0, 0.0, false, false};
    }

    /// Computes how fast X changes with psi over |psi - middle| <= half < 1, for several stretches; returns
    /// for which the result is valid.
    template <int N>
    ARMANGLE_INLINE LaneMask<N> pose_rate(const ChainArm& near, const Lane<N>& middle, const Lane<N>& half,
                                          PoseRate<Lane<N>>& out) const noexcept {
        using Several = Lane<N>;
        const Several one(1.0), zero(0.0);
        const SinCos<Several> at = sin_cos(middle), by = sin_cos(half);
        struct Sweep {
            Several value, off, speed;  // at the middle; how far from it, and how fast, it may be
        };
        const auto sweep = [&](const Harmonic<double>& h) {
            const Several moving = mul_add(Several(h.s), at.sin, Several(h.c) * at.cos), a = abs(moving),
                          b = abs(Several(h.s) * at.cos - Several(h.c) * at.sin);
            return Sweep{moving + Several(h.k), b * by.sin + a * (one - by.cos), b + a * by.sin};
        };
        Several speed[joints], per_length[4];
        auto known = zero < one;
        for (int p = 0; p < 4; ++p) {
            const Sweep u = sweep(f_.pivot[p].U), v = sweep(f_.pivot[p].V);
            const Several wide((p < 2 ? shoulder_ : wrist_) + psi_shift_);
            const Sweep across = sweep(f_.hinge[p / 2].H);
            const Several straight = abs(across.value) + across.off;
            const Several length = sqrt(max(one - straight * straight, zero)) - wide;
            known = known & (length > zero);
            per_length[p] = one / length;
            speed[2 * p] = hypot(u.speed, v.speed) + Several(2.0 * slack) * wide;
        }
        for (int h = 0; h < 2; ++h)
            speed[1 + 4 * h] =
                hypot(speed[4 * h], sweep(f_.hinge[h].H).speed +
                                        Several(2.0 * slack * ((h == 0 ? shoulder_ : wrist_) + psi_shift_)));
        const auto kept = [&](const PoseRate<Several>& x) {
            const Several shoulder = Several(shoulder_rate_) * x.wrist,
                          wrist = Several(wrist_rate_) * x.wrist + x.turn;
            const auto pivot = [&](int p) {
                return (speed[2 * p] + (p < 2 ? shoulder : wrist)) * per_length[p];
            };
            Several turn[joints + 1];
            turn[1] = pivot(0);
            turn[3] = one + shoulder;
            turn[2] = min(turn[1] + speed[1] + Several(1.5) * shoulder, turn[3] + pivot(1));
            turn[4] = turn[3] + Several(bend_rate_) * x.wrist;
            turn[7] = x.turn;
            turn[6] = turn[7] + pivot(3);
            turn[5] = min(turn[4] + pivot(2), turn[6] + speed[5] + Several(1.5) * wrist);
            PoseRate<Several> sum{zero, zero};
            for (int k = 1; k <= joints; ++k) {
                sum.wrist = mul_add(turn[k], Several(near.swing[k]), sum.wrist);
                sum.turn = mul_add(turn[k], Several(near.deviation[k].rotation), sum.turn);
            }
            return PoseRate<Several>{sum.wrist * Several(slack / (1.0 - min(near.turn, 0.5))),
                                     sum.turn * Several(slack)};
        };
        // kept() is affine and rises: what it does not raise it bounds
        const PoseRate<Several> still = kept({zero, zero}),
                                supposed{still.wrist + still.wrist, still.turn + still.turn};
        out = kept(supposed);
        return known & (out.wrist <= supposed.wrist) & (out.turn <= supposed.turn);
    }

    /// For each limit function k, a bound of how fast it changes with psi in addition to that of the centre,
    /// for X changing at this pace; of_shoulder[k]: a function of a joint at the shoulder (otherwise at the
    /// wrist).
    template <int N>
    ARMANGLE_INLINE Lane<N> drift(const bool (&of_shoulder)[N], const PoseRate<Lane<N>>& x) const noexcept {
        using Several = Lane<N>;
        double rate[N], wide[N], turns[N];
        for (int k = 0; k < N; ++k) {
            rate[k] = of_shoulder[k] ? shoulder_rate_ : wrist_rate_;
            wide[k] = 2.0 * slack * ((of_shoulder[k] ? shoulder_ : wrist_) + psi_shift_);
            turns[k] = of_shoulder[k] ? 0.0 : 1.0;
        }
        return Several::load(wide) + Several::load(rate) * x.wrist + Several::load(turns) * x.turn;
    }

    /// The bounds of the joints over |psi - middle| <= half (rad).
    Coarse<T> over(const T& middle, const T& half) const noexcept {
        Coarse<T> out;
        SinCos<T> towards[joints];
        reaches(middle, half, out, towards);
        detail::theta_of(towards, out.theta);
        return out;
    }

    /// Writes the bounds of the joints over |psi - middle| <= half (rad) to `out`, but their directions (of
    /// any length) to `towards` instead of theta.
    ARMANGLE_INLINE void reaches(const T& middle, const T& half, Coarse<T>& out,
                                 SinCos<T> (&towards)[joints]) const noexcept {
        const SinCos<T> at = sin_cos(middle);
        const T wide = half + psi_shift_;
        T off[joints];
        for (int h = 0; h < hinges; ++h) {
            const T radius = h == 0 ? shoulder_ : wrist_;
            T moves[2];
            for (int p = 2 * h; p < 2 * h + 2; ++p) {
                const Pivot<T>& pivot = f_.pivot[p];
                towards[2 * p] = {pivot.g * pivot.U.at(at), pivot.g * pivot.V.at(at)};
                moves[p - 2 * h] = hypot(swept(pivot.U, at, wide), swept(pivot.V, at, wide));
                off[2 * p] = moves[p - 2 * h] + radius;
            }
            const SinCos<T>& beside = towards[4 * h];
            towards[1 + 4 * h] = {f_.hinge[h].g * hypot(beside.sin, beside.cos), f_.hinge[h].H.at(at)};
            off[1 + 4 * h] = hypot(moves[0], swept(f_.hinge[h].H, at, wide)) + radius;
        }
        towards[3] = elbow_.theta_4;
        off[3] = bend_radius_;
        for (int j = 0; j < joints; ++j) {
            const T y = towards[j].sin, x = towards[j].cos, rest = y * y + x * x - off[j] * off[j];
            auto known = usable_ & (T(0.0) < rest);
            if (j % 4 == 1) known = known & (off[j - 1] < abs(y));  // a hinge must keep its side of 0 and pi
            // an angle is at most its tangent
            out.reach[j] = select(known, off[j] / sqrt(select(known, rest, T(1.0))), T(infinity));
        }
        out.upper_arm = select(usable_, wide + shoulder_, T(infinity));
    }

private:
    template <class>
    friend class CorrectedMotion;

    /// How the triangle shoulder-elbow-wrist at another distance differs from that of the centre.
    struct Seen {
        T beta, gamma, tilt, bend;           // chords of what its angles differ
        T bend_rate, beta_rate, gamma_rate;  // how fast they change, rad/m; of the latter two cotangents
        T least_cosine;                      // of both angles beside S-W

        /// Replaces each difference by the larger of both; `least_cosine` stays.
        void also(const Seen& other) noexcept {
            beta = max(beta, other.beta);
            gamma = max(gamma, other.gamma);
            tilt = max(tilt, other.tilt);
            bend = max(bend, other.bend);
            bend_rate = max(bend_rate, other.bend_rate);
            beta_rate = max(beta_rate, other.beta_rate);
            gamma_rate = max(gamma_rate, other.gamma_rate);
        }
    };
    /// The differences between the triangle at another distance (m) of the wrist and that of the centre.
    ARMANGLE_INLINE Seen seen_at(const T& distance) const noexcept {
        const T La(arm_->upper_arm), Lb(arm_->forearm);
        const Triangle<T> t = triangle(*arm_, distance);
        const Elbow<T> e = elbow(*arm_, t, elbow_side_);
        const T per = T(1.0) / t.eta.sin;
        // cotangents of the triangle's angles at the wrist and at the shoulder
        return {chord(e.beta, elbow_.beta),
                chord(e.gamma, elbow_.gamma),
                chord(e.tilt, elbow_.tilt),
                chord(e.theta_4, elbow_.theta_4),
                distance * per * T(1.0 / (arm_->upper_arm * arm_->forearm)),
                abs(Lb + La * t.eta.cos) * per * T(1.0 / arm_->upper_arm),
                abs(La + Lb * t.eta.cos) * per * T(1.0 / arm_->forearm),
                min(t.kappa.cos, mul_add(t.eta.cos, t.kappa.cos, t.eta.sin * t.kappa.sin))};
    }

    /// Widens the functions to a ball whose wrist distances are in [least, most] (m); `whole`: all of the
    /// ball is within reach.
    void widen(const PoseBall<T>& ball, const T& psi_shift, const T& least, const T& most,
               bool whole) noexcept {
        const T zero(0.0), one(1.0);
        psi_shift_ = psi_shift;
        usable_ = usable_ & (zero < least) & (ball.turn < one);
        if (!any(usable_)) return;
        const double La = arm_->upper_arm, Lb = arm_->forearm, d_4 = arm_->d_4;
        Seen seen = seen_at(least);
        seen.also(seen_at(most));
        const T square = least * least - T(d_4 * d_4);  // of S-W across axis 4
        const T lean_rate = T(slack) * (one + T(2.0) * abs(elbow_.tilt.sin / elbow_.tilt.cos)) / least,
                lean = lean_rate * ball.wrist, per = least / square;
        // an angle of the triangle changes by the other's cotangent; all are fastest at one of the two ends.
        // What moves S-W along itself does not lean it
        const T beta_rate = seen.beta_rate * per, gamma_rate = seen.gamma_rate * per,
                tilt_rate = d_4 == 0 ? zero : T(abs(d_4)) / (least * sqrt(square));
        shoulder_rate_ = hypot(beta_rate + tilt_rate, lean_rate);
        wrist_rate_ = hypot(gamma_rate + tilt_rate, lean_rate);
        bend_rate_ = seen.bend_rate;
        // the angle at the end of the longer link is greatest where the shorter one stands across S-W
        const double across = sqrt(abs(La * La - Lb * Lb) + d_4 * d_4);
        const auto stands = (least < T(across)) & (T(across) < most);
        if (any(stands)) {
            const Seen there = seen_at(T(across));
            seen.beta = select(stands, max(seen.beta, there.beta), seen.beta);
            seen.gamma = select(stands, max(seen.gamma, there.gamma), seen.gamma);
            seen.tilt = select(stands, max(seen.tilt, there.tilt), seen.tilt);
            seen.bend = select(stands, max(seen.bend, there.bend), seen.bend);
        }
        bend_radius_ = seen.bend;
        if (!whole) {
            shoulder_ = lean + seen.beta + seen.tilt;
            wrist_ = lean + seen.gamma + seen.tilt + ball.turn;
            return;
        }
        // A wrist that leans most keeps its distance, and one that comes nearest or farthest does not lean. A
        // share t of the way to either end changes an angle by at most t of what the ends do where it bends
        // one way: where both angles of the triangle are within 60 degrees. Else by t of the greatest rate.
        T uneven = one;  // of what is across axis 4
        if (d_4 != 0) {
            const T middle = sqrt(distance_ * distance_ - T(d_4 * d_4));
            uneven = (middle - sqrt(square)) / (sqrt(most * most - T(d_4 * d_4)) - middle);
        }
        const auto bowed = T(0.5) <= seen.least_cosine;
        const T beta = select(bowed, uneven * arc(seen.beta), beta_rate * ball.wrist),
                gamma = select(bowed, uneven * arc(seen.gamma), gamma_rate * ball.wrist);
        shoulder_ = hypot(lean, beta + seen.tilt);
        wrist_ = hypot(lean, gamma + seen.tilt) + ball.turn;
    }

    /// An upper bound of the angle of a chord below 1.
    static T arc(const T& chord) noexcept { return chord * (T(1.0) + T(0.05) * chord * chord); }

    static constexpr double slack = 1.1;  // of a small angle over its sine, and of turns about two axes

    /// The chord between two angles given by sine and cosine.
    static T chord(const SinCos<T>& a, const SinCos<T>& b) noexcept {
        return hypot(a.sin - b.sin, a.cos - b.cos);
    }

    /// A bound of the change of a harmonic function from its value at `middle` over |psi - middle| <= half.
    static T swept(const Harmonic<T>& h, const SinCos<T>& middle, const T& half) noexcept {
        return half * (abs(h.slope(middle)) + T(0.5) * half * hypot(h.s, h.c));
    }

    const Arm* arm_;
    T distance_, elbow_side_;
    Mask known_, usable_;
    JointFunctions<T> f_;
    Elbow<T> elbow_;
    T psi_shift_ = T(0.0), bend_radius_ = T(0.0), shoulder_ = T(0.0), wrist_ = T(0.0);
    T bend_rate_ = T(0.0), shoulder_rate_ = T(0.0), wrist_rate_ = T(0.0);  // rad/m of the wrist
};

/// Parameters of the ranges of the joints of corrected poses.
struct CorrectedMotionTuning {
    static constexpr int balls = 6;  // tried over a cell
    // of a nominal frame over the half width of a cell, supposed at first: a small ball grows to what keeps
    // itself
    static constexpr double first_turn = 1.5;
};

namespace detail {

/// The ball in which X stays if each frame k of the nominal arm rotates by up to turn[k] (rad).
template <class T>
ARMANGLE_INLINE PoseBall<T> turned_ball(const ChainArm& arm, const T (&turn)[joints + 1]) noexcept {
    constexpr double slack = 1.1;  // products of deviations
    PoseBall<T> out{T(0.0), T(0.0)};
    for (int k = 1; k <= joints; ++k) {
        const T by = min(turn[k], T(2.0));
        out.wrist = out.wrist + by * T(slack / (1.0 - min(arm.turn, 0.5)) * arm.swing[k]);
        out.turn = out.turn + by * T(slack * arm.deviation[k].rotation);
    }
    return out;
}

/// Bounds of the rotation (rad) of the nominal frames F_k = H_0 Rz(theta_1) ... Rz(theta_k) over a stretch.
template <class T>
ARMANGLE_INLINE void frames_turn(const Coarse<T>& c, const T& turn_of_pose, T (&turn)[joints + 1]) noexcept {
    turn[0] = T(0.0);
    turn[3] = c.upper_arm;
    turn[1] = c.reach[0];
    turn[2] = min(turn[1] + c.reach[1], turn[3] + c.reach[2]);
    turn[4] = turn[3] + c.reach[3];
    turn[7] = turn_of_pose;
    turn[6] = turn[7] + c.reach[6];
    turn[5] = min(turn[4] + c.reach[4], turn[6] + c.reach[5]);
}

/// The circle of a corrected pose 0T7, with the zero of psi at the given plane.
template <class T>
ARMANGLE_INLINE Triad<T> triad_of(const Arm& arm, const Pose<T>& flange, const PsiPlane<T>& plane) noexcept {
    return triad(arm, flange,
                 [&](const Vec3<T>& p, const Vec3<T>& w) noexcept { return plane.normal(arm, p, w); });
}

}  // namespace detail

/// The motion over |psi - middle| <= half (rad), found from postures at the middle with these angles; not
/// usable where no ball is proven to hold X. Its psi counts from the middle. `joints_over` receives the
/// bounds of the joints.
template <class T>
inline CorrectedMotion<T> motion_about(const ChainArm& arm, const Triad<T>& on,
                                       const detail::PsiPlane<T>& plane, const SinCos<T> (&angle)[joints],
                                       const Configuration<T>& gc, const T& half,
                                       Coarse<T>& joints_over) noexcept {
    const Arm& nominal = arm.nominal;
    const Pose<T> centre = detail::nominal_flange(nominal, angle);
    const Triad<T> there = detail::triad_of(nominal, centre, plane);
    const T lean = norm(there.w - on.w),
            psi_shift = T(2.0) * lean * (lean + T(abs(nominal.d_4)) / there.distance) * half;
    T turn[joints + 1];
    for (T& one : turn) one = T(CorrectedMotionTuning::first_turn) * half;
    PoseBall<T> ball = detail::turned_ball(arm, turn);
    CorrectedMotion<T> out(nominal, centre, there, gc);
    SinCos<T> towards[joints];
    auto holds = T(1.0) < T(0.0);
    for (int pass = 0; pass < CorrectedMotionTuning::balls; ++pass) {
        out.widen(ball, psi_shift);
        out.reaches(T(0.0), half, joints_over, towards);
        detail::frames_turn(joints_over, ball.turn, turn);
        const PoseBall<T> kept = detail::turned_ball(arm, turn);
        holds = holds | (out.usable() & (kept.wrist <= ball.wrist) & (kept.turn <= ball.turn));
        // what is kept keeps itself
        ball = {select(holds, min(ball.wrist, kept.wrist), max(ball.wrist, T(1.2) * kept.wrist)),
                select(holds, min(ball.turn, kept.turn), max(ball.turn, T(1.2) * kept.turn))};
        if (all(holds | !out.usable())) break;
    }
    out.widen(ball, psi_shift);
    out.keep(holds);
    joints_over = out.over(T(0.0), half);
    return out;
}

/// Bounds of the joints of the true chain at a pose over the whole circle of psi, valid for all joint angles.
inline CorrectedMotion<double> motion_around(const ChainArm& arm, const Pose<double>& pose,
                                             const Triad<double>& on,
                                             const Configuration<double>& gc) noexcept {
    const Arm& nominal = arm.nominal;
    const Pose<double> centre = flange_pose(nominal, arm.first * pose * arm.last);
    const Triad<double> there = detail::triad_of(nominal, centre, detail::PsiPlane<double>(on, {0.0, 1.0}));
    const double lean = norm(there.w - on.w);
    CorrectedMotion<double> out(nominal, centre, there, gc);
    out.widen({arm.joint_shift, arm.joint_turn},
              2.0 * lean * (lean + abs(nominal.d_4) / there.distance) * pi);
    return out;
}

/// The bounds of the joints over |psi - middle| <= half (rad).
template <class T>
inline Coarse<T> coarse_about(const ChainArm& arm, const Triad<T>& on, const detail::PsiPlane<T>& plane,
                              const SinCos<T> (&angle)[joints], const Configuration<T>& gc,
                              const T& half) noexcept {
    Coarse<T> out;
    motion_about(arm, on, plane, angle, gc, half, out);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
