// All postures of a stretch of psi, proven: where each joint is, and how fast it moves.
//
// Around a posture theta_c of the seven equations F(theta, t) = 0, psi = psi_c + t, the self-motion is looked
// for as theta_c + u t + rho with u = dtheta/dpsi at t = 0. With C the inverse Jacobian there, one Newton
// step takes the box |rho_i| <= r_i into itself where
//     e + G r < r,   e_i >= |C F(theta_c + u t, t)|_i,   G_ik >= |1 - C J|_ik over |t| <= h and the box,
// so that for every t one posture lies in it, and no other (Krawczyk). G follows from two
// derivatives of J at the centre, e from four of F, all cross products of the axes; and both from bounds of
// the next: those of turns are 1, those of the wrist the length of links that turn. What C lacks of an
// inverse is in G as well. Hulls side by side are lanes of T. Source: R.
// E. Moore, Interval Analysis (1966); A. Neumaier, Interval Methods (1990), chapter 5. Rounding is not in the
// bounds: ChainHullTuning::rounding stands for it.
#pragma once

#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the hull of the postures of a stretch of psi.
struct ChainHullTuning {
    static constexpr double rounding = 1e-12;  // rad, added to every radius
    static constexpr double grown = 2.0;       // a radius over the defect it has to hold, at first
    static constexpr int growths = 3;
};

/// Bounds of the joints for psi + t, |t| <= half (rad): theta(t) is within `radius` of theta + slope t, and
/// dtheta/dpsi within `slope_radius` of `slope`.
template <class T>
struct Hull {
    T psi, half;
    T theta[joints], slope[joints], radius[joints], slope_radius[joints];

    /// By how much (rad) a joint (0..6) can differ from its value at the middle.
    T reach(int joint) const noexcept { return half * abs(slope[joint]) + radius[joint]; }
};

/// Number k of N hulls that are computed at once.
template <int N>
inline Hull<double> lane(const Hull<Lane<N>>& hulls, int k) noexcept {
    Hull<double> out;
    out.psi = hulls.psi[k];
    out.half = hulls.half[k];
    for (int j = 0; j < joints; ++j) {
        out.theta[j] = hulls.theta[j][k];
        out.slope[j] = hulls.slope[j][k];
        out.radius[j] = hulls.radius[j][k];
        out.slope_radius[j] = hulls.slope_radius[j][k];
    }
    return out;
}

namespace detail {

/// The derivatives at the centre of a hull that its proof needs; u is dtheta/dpsi.
template <class T>
struct HullCentre {
    using Row = typename SevenEquations<T>::Row;
    struct Sizes {
        T wrist, turn, psi;
    };
    SevenEquations<T> f;
    InverseSlope<T> back;
    T u[joints];
    T turning;                  // along . z_3: minus dF/dpsi
    T along_rate;               // its rate
    T curved[joints];           // |C F_2|, the second derivative of F
    T jerked[joints];           // |C F_3|, the third derivative
    T snapped[joints];          // |C F_4|
    T curvature, jerk, snap;    // of F_2, F_3, F_4: wrist and turn
    T sheared[joints][joints];  // |C J_1|
    T twisted[joints][joints];  // |C J_2|
    T lacking[joints][joints];  // |1 - C J|
    Sizes row[joints];          // sizes of the rows of C
};

/// Angular velocity of a frame and its three derivatives while the joints before it rotate at constant rates.
template <class T>
struct Spin {
    Vec3<T> velocity, acceleration, jerk, snap;

    /// The first three derivatives of a vector.
    struct Moving {
        Vec3<T> first, second, third;
    };
    /// The derivatives of a vector fixed in the frame.
    ARMANGLE_INLINE Moving of(const Vec3<T>& v) const noexcept {
        const Vec3<T> a = cross(velocity, v), b = cross(acceleration, v) + cross(velocity, a);
        return {a, b, cross(jerk, v) + cross(acceleration, a) * T(2.0) + cross(velocity, b)};
    }
    /// The fourth derivative of a vector fixed in the frame, whose first three are `m`.
    ARMANGLE_INLINE Vec3<T> fourth(const Vec3<T>& v, const Moving& m) const noexcept {
        return cross(snap, v) + (cross(jerk, m.first) + cross(acceleration, m.second)) * T(3.0) +
               cross(velocity, m.third);
    }

    /// Adds a joint with this axis, whose derivatives are `m`, rotating at this rate.
    ARMANGLE_INLINE void add(const Vec3<T>& axis, const Moving& m, const T& rate) noexcept {
        velocity = velocity + axis * rate;
        acceleration = acceleration + m.first * rate;
        jerk = jerk + m.second * rate;
        snap = snap + m.third * rate;
    }
};

/// The zero vector.
template <class T>
ARMANGLE_INLINE Vec3<T> no_vector() noexcept {
    return {T(0.0), T(0.0), T(0.0)};
}

/// Computes the derivatives at a posture, with all joints rotating at dtheta/dpsi. NaN at a singular posture.
template <class T>
ARMANGLE_INLINE void hull_centre(const ChainArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                                 const SinCos<T>* angle, HullCentre<T>& out) noexcept {
    using Row = typename SevenEquations<T>::Row;
    using Moving = typename Spin<T>::Moving;
    const T zero(0.0), two(2.0), per_reach(1.0 / arm.nominal.reach);
    out.f = seven_equations(arm, pose, plane, angle);
    out.back = inverse_slope(out.f, Reduced<T>(out.f));
    const Vec3<T> none = no_vector<T>(), z = elbow_axis(angle), &along = plane.along, &across = plane.across;
    out.turning = dot(along, z);
    for (int i = 0; i < joints; ++i) {
        out.u[i] = out.back.row[i].psi * out.turning;
        out.row[i] = {norm(out.back.row[i].wrist), norm(out.back.row[i].turn), abs(out.back.row[i].psi)};
    }
    Vec3<T> axis[joints], origin[joints + 1];
    const Vec3<T> in_tip = spread<T>(arm.wrist);
    walk_links(arm, angle, [&](int k, const Pose<T>& at) noexcept {
        if (k < joints) axis[k] = at.rotation.z;
        origin[k] = k < joints ? at.position : at.rotation * in_tip + at.position;
    });
    Spin<T> spin{none, none, none, none}, elbow = spin;
    Moving of_axis[joints], of_link[joints];
    Row third{none, none, zero}, fourth = third;
    for (int k = 0; k < joints; ++k) {
        of_axis[k] = spin.of(axis[k]);
        spin.add(axis[k], of_axis[k], out.u[k]);
        const Vec3<T> link = (origin[k + 1] - origin[k]) * per_reach;
        of_link[k] = spin.of(link);
        third.wrist = third.wrist + of_link[k].third;
        fourth.wrist = fourth.wrist + spin.fourth(link, of_link[k]);
    }
    // the plane: across turns to -along, along to across
    const Vec3<T> nominal_axis[3] = {
        {zero, zero, T(1.0)},
        {-angle[0].sin, angle[0].cos, zero},
        {angle[0].cos * angle[1].sin, angle[0].sin * angle[1].sin, angle[1].cos}};
    Moving of_nominal[3];
    for (int k = 0; k < 3; ++k) {
        of_nominal[k] = elbow.of(nominal_axis[k]);
        elbow.add(nominal_axis[k], of_nominal[k], out.u[k]);
    }
    const Moving of_z = elbow.of(z);
    out.along_rate = dot(across, z) + dot(along, of_z.first);
    Vec3<T> ahead = none, ahead_1 = none, ahead_2 = none;  // from a joint to the wrist, and its derivatives
    for (int k = joints - 1; k >= 0; --k) {
        ahead = ahead + (origin[k + 1] - origin[k]) * per_reach;
        ahead_1 = ahead_1 + of_link[k].first;
        ahead_2 = ahead_2 + of_link[k].second;
        const Vec3<T>&a = axis[k], &a_1 = of_axis[k].first, &a_2 = of_axis[k].second;
        Row once{cross(a_1, ahead) + cross(a, ahead_1), a_1, zero},  // of column k
            twice{cross(a_2, ahead) + cross(a_1, ahead_1) * two + cross(a, ahead_2), a_2, zero};
        if (k < 3) {
            const Vec3<T>&n = nominal_axis[k], &n_1 = of_nominal[k].first, &n_2 = of_nominal[k].second;
            const Vec3<T> v = cross(n, z), v_1 = cross(n_1, z) + cross(n, of_z.first),
                          v_2 = cross(n_2, z) + cross(n_1, of_z.first) * two + cross(n, of_z.second);
            once.psi = dot(across, v_1) - dot(along, v);
            twice.psi = dot(across, v_2 - v) - two * dot(along, v_1);
        }
        for (int i = 0; i < joints; ++i) {
            out.sheared[i][k] = abs(out.back.times(i, once));
            out.twisted[i][k] = abs(out.back.times(i, twice));
            out.lacking[i][k] = abs(out.back.times(i, out.f.column[k]) - T(i == k ? 1.0 : 0.0));
        }
    }
    // the hand does not turn at first order, so that its turn is that of the spin alone
    const Row second{ahead_2, spin.acceleration, dot(across, of_z.second - z) - two * dot(along, of_z.first)};
    third.turn = spin.jerk;
    third.psi = dot(along, z - of_z.second * T(3.0)) + dot(across, of_z.third - of_z.first * T(3.0));
    fourth.turn = spin.snap;
    fourth.psi = dot(across, z - of_z.second * T(6.0) + elbow.fourth(z, of_z)) +
                 dot(along, of_z.first - of_z.third) * T(4.0);
    for (int i = 0; i < joints; ++i) {
        out.curved[i] = abs(out.back.times(i, second));
        out.jerked[i] = abs(out.back.times(i, third));
        out.snapped[i] = abs(out.back.times(i, fourth));
    }
    out.curvature = max(norm(second.wrist), norm(second.turn));
    out.jerk = max(norm(third.wrist), norm(third.turn));
    out.snap = max(norm(fourth.wrist), norm(fourth.turn));
}

/// Bounds of the third-order remainder of the Jacobian's columns over a stretch of psi and a box of joints.
template <class T>
struct ColumnRest {
    T wrist[joints], turn[joints], psi;
};

/// Computes ColumnRest for |t| <= half (rad) and joints within `radius` (rad) of their linear motion.
template <class T>
ARMANGLE_INLINE ColumnRest<T> column_rest(const ChainArm& arm, const HullCentre<T>& at, const T& half,
                                          const T (&radius)[joints]) noexcept {
    const double per_reach = 1.0 / arm.nominal.reach;
    T move[joints], all(0.0), box(0.0);
    for (int j = 0; j < joints; ++j) {
        move[j] = half * abs(at.u[j]);
        all = all + move[j];
        box = box + radius[j];
    }
    const T most_lever(max(1.0, arm.ahead[0] * per_reach)), square = all * all, sixth(1.0 / 6.0),
                                                            way = half * half;
    // how far pose and wrist may be from those at the middle: at second order, and behind it
    const T near = T(0.5) * way * at.curvature,
            off = way * (half * sixth * at.jerk + way * T(1.0 / 24.0) * at.snap) +
                  square * square * all * T(1.0 / 120.0) * most_lever;
    const T still =
        near + off + box * most_lever + taxi_length(at.f.left.wrist) + taxi_length(at.f.left.turn);
    ColumnRest<T> out;
    T before(0.0), behind = all;
    for (int k = 0; k < joints; ++k) {
        behind = behind - move[k];
        const T ahead(arm.ahead[k] * per_reach), whole((arm.ahead[0] + arm.behind[k]) * per_reach);
        const T by_before = sixth * before * before * before,
                by_behind = sixth * behind * behind * behind + off + near * behind;
        out.turn[k] = min(by_before, by_behind) + still + box;
        out.wrist[k] = min(by_before * whole + off + near * before, by_behind * ahead) + box * ahead;
        before = before + move[k];
    }
    const T elbow = half + move[0] + move[1] + move[2];
    out.psi = sixth * elbow * elbow * elbow + box;
    return out;
}

/// Computes in G[i][k] by how much a Newton step moves joint i (0..6), at most, for each radian that joint k
/// is off within the box.
template <class T>
ARMANGLE_INLINE void contraction(const ChainArm& arm, const HullCentre<T>& at, const T& half,
                                 const T (&radius)[joints], T (&G)[joints][joints]) noexcept {
    const ColumnRest<T> rest = column_rest(arm, at, half, radius);
    const T square = T(0.5) * half * half;
    for (int i = 0; i < joints; ++i)
        for (int k = 0; k < joints; ++k) {
            G[i][k] = half * at.sheared[i][k] + square * at.twisted[i][k] + at.lacking[i][k] +
                      at.row[i].wrist * rest.wrist[k] + at.row[i].turn * rest.turn[k];
            if (k < 3) G[i][k] = G[i][k] + at.row[i].psi * rest.psi;
        }
}

/// Element i of d + G x.
template <class T>
ARMANGLE_INLINE T grown_by(const T (&d)[joints], const T (&G)[joints][joints], const T (&x)[joints],
                           int i) noexcept {
    T sum = d[i];
    for (int k = 0; k < joints; ++k) sum = mul_add(G[i][k], x[k], sum);
    return sum;
}

}  // namespace detail

/// Computes the hull over |t| <= half (rad) about a posture with these angles; returns whether it is proven,
/// as a mask if T is several lanes.
template <class T>
inline auto prove_hull(const ChainArm& arm, const Pose<T>& pose, const detail::PsiPlane<T>& plane,
                       const SinCos<T>* angle, const T& psi, const T& half, Hull<T>& out) noexcept {
    detail::HullCentre<T> at;
    detail::hull_centre(arm, pose, plane, angle, at);
    const double lever = arm.ahead[0] / arm.nominal.reach;
    T steps(1.0), defect[joints], G[joints][joints];
    for (const T& rate : at.u) steps = steps + abs(rate);
    const T way = half * steps, square = way * way, fifth = square * square * way * T(1.0 / 120.0);
    for (int i = 0; i < joints; ++i) {
        const T size = at.row[i].wrist * T(lever) + at.row[i].turn + at.row[i].psi;
        defect[i] = abs(at.back.times(i, at.f.left)) +
                    half * half *
                        (T(0.5) * at.curved[i] +
                         half * (T(1.0 / 6.0) * at.jerked[i] + half * T(1.0 / 24.0) * at.snapped[i])) +
                    size * fifth + T(ChainHullTuning::rounding);
        out.radius[i] = T(ChainHullTuning::grown) * defect[i];
    }
    auto proven = T(1.0) < T(0.0);
    for (int pass = 0; pass < ChainHullTuning::growths && !all(proven); ++pass) {
        detail::contraction(arm, at, half, out.radius, G);
        T wanted[joints];
        auto holds = T(0.0) < T(1.0);
        for (int i = 0; i < joints; ++i) {
            wanted[i] = detail::grown_by(defect, G, out.radius, i);
            holds = holds & (wanted[i] < out.radius[i]);
        }
        proven = proven | holds;
        for (int i = 0; i < joints; ++i)
            out.radius[i] = select(proven, out.radius[i], T(ChainHullTuning::grown) * wanted[i]);
    }
    out.psi = psi;
    out.half = half;
    if (!any(proven)) return proven;
    // J theta' = -dF/dpsi: theta' = C (along . z_3) + (1 - C J) theta'
    T uneven[joints], elbow = half, box(0.0);
    for (int j = 0; j < joints; ++j) box = box + out.radius[j];
    for (int j = 0; j < 3; ++j) elbow = elbow + half * abs(at.u[j]) + out.radius[j];
    const T turning = half * abs(at.along_rate) + T(0.5) * elbow * elbow + box;
    for (int i = 0; i < joints; ++i) {
        uneven[i] = at.row[i].psi * turning;
        for (int k = 0; k < joints; ++k) uneven[i] = mul_add(G[i][k], abs(at.u[k]), uneven[i]);
        out.slope_radius[i] = T(ChainHullTuning::grown) * uneven[i];
    }
    auto settled = T(1.0) < T(0.0);
    for (int pass = 0; pass < ChainHullTuning::growths && !all(settled); ++pass) {
        T wanted[joints];
        auto holds = T(0.0) < T(1.0);
        for (int i = 0; i < joints; ++i) {
            wanted[i] = detail::grown_by(uneven, G, out.slope_radius, i);
            holds = holds & (wanted[i] < out.slope_radius[i]);
        }
        settled = settled | holds;
        const T more(pass + 1 < ChainHullTuning::growths ? ChainHullTuning::grown : infinity);
        for (int i = 0; i < joints; ++i)
            out.slope_radius[i] = select(settled, out.slope_radius[i], more * wanted[i]);
    }
    detail::theta_of(angle, out.theta);
    for (int j = 0; j < joints; ++j) out.slope[j] = at.u[j];
    return proven;
}

}  // namespace armangle

#include "../names/end.hpp"
