// All postures of a stretch of psi, proven: where each joint is, and how fast it moves.
//
// Around a posture theta_c of the seven equations F(theta, t) = 0, psi = psi_c + t, the self-motion is looked
// for as theta_c + u t + rho with u = dtheta/dpsi at t = 0. With C the inverse Jacobian there, one Newton
// step takes the box |rho_i| <= r_i into itself where
//     e + G r < r,   e_i >= |C F(theta_c + u t, t)|_i,   G_ik >= |1 - C J|_ik over |t| <= h and the box,
// so that for every t one posture lies in it, and no other (Krawczyk). G follows from the
// first and second derivatives at the centre, e from the third too, all cross products of the axes; and both
// from bounds of the next: those of turns are 1, those of the wrist the length of links that turn. What C
// lacks of an inverse is in G as well. Hulls side by side are lanes of T. Source: R.
// E. Moore, Interval Analysis (1966); A. Neumaier, Interval Methods (1990), chapter 5. Rounding is not in the
// bounds: near_rule::rounding stands for it.
#pragma once

#include "inverse.hpp"

namespace armangle {

namespace near_rule {
inline constexpr double rounding = 1e-12;  // rad, added to every radius
inline constexpr double grown = 2.0;       // a radius over the defect it has to hold, at first
inline constexpr int growths = 3;
}  // namespace near_rule

/// theta(t) is within `radius` of centre + slope t for |t| <= half, and dtheta/dt within slope_radius of
/// slope.
template <class T>
struct Hull {
    T psi, half;
    T theta[joints], slope[joints], radius[joints], slope_radius[joints];

    T reach(int joint) const noexcept { return half * abs(slope[joint]) + radius[joint]; }
};

/// One of hulls side by side.
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

/// What a hull is proven from: all derivatives at its centre.
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
    T along_rate;               // its rate along u
    T curved[joints];           // |C D2F[u, u]|
    T sheared[joints][joints];  // |C D2F[u, e_k]|
    T lacking[joints][joints];  // |1 - C J|
    T curvature;                // |D2F[u, u]|, wrist and turn
    T jerked[joints];           // |C D3F[u, u, u]|
    T jerk;                     // |D3F[u, u, u]|, wrist and turn
    Sizes row[joints];          // sizes of the rows of C
};

/// How a frame turns while the joints before it turn at constant rates: its velocity and two derivatives.
template <class T>
struct Spin {
    Vec3<T> velocity, acceleration, jerk;

    /// One more joint, whose axis turns with the frame before it.
    ARMANGLE_INLINE void add(const Vec3<T>& axis, const T& rate) noexcept {
        const Vec3<T> swept = cross(velocity, axis);
        jerk = jerk + (cross(acceleration, axis) + cross(velocity, swept)) * rate;
        acceleration = acceleration + swept * rate;
        velocity = velocity + axis * rate;
    }
    /// First three derivatives of a vector of the frame.
    ARMANGLE_INLINE Vec3<T> first(const Vec3<T>& v) const noexcept { return cross(velocity, v); }
    ARMANGLE_INLINE Vec3<T> second(const Vec3<T>& v) const noexcept {
        return cross(acceleration, v) + cross(velocity, first(v));
    }
    ARMANGLE_INLINE Vec3<T> third(const Vec3<T>& v) const noexcept {
        const Vec3<T> moved = first(v);
        return cross(jerk, v) + cross(acceleration, moved) * T(2.0) +
               cross(velocity, cross(acceleration, v)) + cross(velocity, cross(velocity, moved));
    }
};

/// A vector of zeros.
template <class T>
ARMANGLE_INLINE Vec3<T> no_vector() noexcept {
    return {T(0.0), T(0.0), T(0.0)};
}

/// D3F[u, u, u]: at constant rates u of the joints and of psi. The tip does not turn at first order, so that
/// its turn is the jerk alone.
template <class T>
ARMANGLE_INLINE typename SevenEquations<T>::Row third_along(const NearArm& arm, const PsiPlane<T>& plane,
                                                            const SinCos<T>* angle,
                                                            const Vec3<T> (&nominal_axis)[3],
                                                            const T (&u)[joints]) noexcept {
    Vec3<T> axis[joints], origin[joints + 1];
    const Vec3<T> in_tip = spread<T>(arm.wrist);
    walk_links(arm, angle, [&](int k, const Pose<T>& at) noexcept {
        if (k < joints) axis[k] = at.rotation.z;
        origin[k] = k < joints ? at.position : at.rotation * in_tip + at.position;
    });
    const Vec3<T> none = no_vector<T>();
    Spin<T> spin{none, none, none}, elbow{none, none, none};
    typename SevenEquations<T>::Row out{none, none, T(0.0)};
    for (int k = 0; k < joints; ++k) {
        spin.add(axis[k], u[k]);
        out.wrist = out.wrist + spin.third(origin[k + 1] - origin[k]);
        if (k < 3) elbow.add(nominal_axis[k], u[k]);
    }
    out.wrist = out.wrist * T(1.0 / arm.nominal.reach);
    out.turn = spin.jerk;
    const Vec3<T> z = elbow_axis(angle);
    out.psi = dot(plane.along, z - elbow.second(z) * T(3.0)) +
              dot(plane.across, elbow.third(z) - elbow.first(z) * T(3.0));
    return out;
}

/// Where the posture is singular nothing of it is a number.
template <class T>
ARMANGLE_INLINE void hull_centre(const NearArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                                 const SinCos<T>* angle, HullCentre<T>& out) noexcept {
    using Row = typename SevenEquations<T>::Row;
    const T zero(0.0);
    out.f = seven_equations(arm, pose, plane, angle);
    out.back = inverse_slope(out.f, Reduced<T>(out.f));
    const Vec3<T> z_3 = elbow_axis(angle), nominal_axis[3] = {{zero, zero, T(1.0)},
                                                              {-angle[0].sin, angle[0].cos, zero},
                                                              {angle[0].cos * angle[1].sin,
                                                               angle[0].sin * angle[1].sin, angle[1].cos}};
    out.turning = dot(plane.along, z_3);
    for (int i = 0; i < joints; ++i) {
        out.u[i] = out.back.row[i].psi * out.turning;
        out.row[i] = {norm(out.back.row[i].wrist), norm(out.back.row[i].turn), abs(out.back.row[i].psi)};
    }
    const auto& c = out.f.column;
    Vec3<T> turn_before = no_vector<T>(), all_moves = no_vector<T>(), elbow_before = no_vector<T>(),
            elbow_rate = no_vector<T>();
    for (int k = 0; k < joints; ++k) all_moves = all_moves + c[k].wrist * out.u[k];
    for (int k = 0; k < 3; ++k) elbow_rate = elbow_rate + cross(nominal_axis[k], z_3) * out.u[k];
    out.along_rate = dot(plane.across, z_3) + dot(plane.along, elbow_rate);
    Vec3<T> moves = all_moves, elbow_moves = elbow_rate;
    Row along_u{no_vector<T>(), no_vector<T>(), zero};  // D2F[u, u]
    for (int k = 0; k < joints; ++k) {
        const Vec3<T>& axis = c[k].turn;
        const Vec3<T> turn_through = turn_before + axis * out.u[k];
        moves = moves - c[k].wrist * out.u[k];  // of the joints behind k
        Row x;                                  // D2F[u, e_k]
        x.turn = cross(turn_before, axis);
        x.wrist = cross(turn_through, c[k].wrist) + cross(axis, moves);
        x.psi = zero;
        if (k < 3) {
            const Vec3<T> moved = cross(nominal_axis[k], z_3);
            const Vec3<T> elbow_through = elbow_before + nominal_axis[k] * out.u[k];
            elbow_moves = elbow_moves - moved * out.u[k];
            x.psi = dot(plane.across, cross(elbow_through, moved) + cross(nominal_axis[k], elbow_moves)) -
                    dot(plane.along, moved);
            elbow_before = elbow_through;
        }
        for (int i = 0; i < joints; ++i) {
            out.sheared[i][k] = abs(out.back.times(i, x));
            out.lacking[i][k] = abs(out.back.times(i, c[k]) - T(i == k ? 1.0 : 0.0));
        }
        along_u.wrist = along_u.wrist + x.wrist * out.u[k];
        along_u.turn = along_u.turn + x.turn * out.u[k];
        along_u.psi = along_u.psi + x.psi * out.u[k];
        turn_before = turn_through;
    }
    along_u.psi = along_u.psi - dot(plane.along, elbow_rate) - dot(plane.across, z_3);  // D2F[u, e_psi]
    for (int i = 0; i < joints; ++i) out.curved[i] = abs(out.back.times(i, along_u));
    out.curvature = max(norm(along_u.wrist), norm(along_u.turn));
    const Row third = third_along(arm, plane, angle, nominal_axis, out.u);
    for (int i = 0; i < joints; ++i) out.jerked[i] = abs(out.back.times(i, third));
    out.jerk = max(norm(third.wrist), norm(third.turn));
}

/// Bounds of the second-order rest of the Jacobian's columns over a stretch and a box.
template <class T>
struct ColumnRest {
    T wrist[joints], turn[joints], psi;
};

/// A column turns with the joints before it, or as seen from the tip, which nearly stays, with those behind.
template <class T>
ARMANGLE_INLINE ColumnRest<T> column_rest(const NearArm& arm, const HullCentre<T>& at, const T& half,
                                          const T (&radius)[joints]) noexcept {
    const double per_reach = 1.0 / arm.nominal.reach, lever = arm.ahead[0] * per_reach;
    T move[joints], all(0.0), box(0.0);
    for (int j = 0; j < joints; ++j) {
        move[j] = half * abs(at.u[j]) + radius[j];
        all = all + move[j];
        box = box + radius[j];
    }
    const T most_lever(max(1.0, lever)), square = all * all,
                                         fourth = square * square * T(1.0 / 24.0) * most_lever;
    const T still = half * half * (T(0.5) * at.curvature + half * T(1.0 / 6.0) * at.jerk) + fourth +
                    box * most_lever + taxi_length(at.f.left.wrist) +
                    taxi_length(at.f.left.turn);  // of pose and wrist
    ColumnRest<T> out;
    T before(0.0), behind = all;
    for (int k = 0; k < joints; ++k) {
        behind = behind - move[k];
        const T ahead(arm.ahead[k] * per_reach), whole((arm.ahead[0] + arm.behind[k]) * per_reach);
        const T by_before = T(0.5) * before * before, by_behind = T(0.5) * behind * behind + still;
        out.turn[k] = min(by_before, by_behind) + still + box;
        out.wrist[k] = min(by_before * whole + still, by_behind * ahead) + box * ahead;
        before = before + move[k];
    }
    const T elbow = half + move[0] + move[1] + move[2];
    out.psi = T(0.5) * elbow * elbow + box;
    return out;
}

/// G of a box.
template <class T>
ARMANGLE_INLINE void contraction(const NearArm& arm, const HullCentre<T>& at, const T& half,
                                 const T (&radius)[joints], T (&G)[joints][joints]) noexcept {
    const ColumnRest<T> rest = column_rest(arm, at, half, radius);
    for (int i = 0; i < joints; ++i)
        for (int k = 0; k < joints; ++k) {
            G[i][k] = half * at.sheared[i][k] + at.lacking[i][k] + at.row[i].wrist * rest.wrist[k] +
                      at.row[i].turn * rest.turn[k];
            if (k < 3) G[i][k] = G[i][k] + at.row[i].psi * rest.psi;
        }
}

/// d + G x
template <class T>
ARMANGLE_INLINE T grown_by(const T (&d)[joints], const T (&G)[joints][joints], const T (&x)[joints],
                           int i) noexcept {
    T sum = d[i];
    for (int k = 0; k < joints; ++k) sum = mul_add(G[i][k], x[k], sum);
    return sum;
}

}  // namespace detail

/// The hulls of |t| <= half about postures; false (a mask of lanes) where one is not proven.
template <class T>
inline auto prove_hull(const NearArm& arm, const Pose<T>& pose, const detail::PsiPlane<T>& plane,
                       const SinCos<T>* angle, const T& psi, const T& half, Hull<T>& out) noexcept {
    detail::HullCentre<T> at;
    detail::hull_centre(arm, pose, plane, angle, at);
    const double lever = arm.ahead[0] / arm.nominal.reach;
    T steps(1.0), defect[joints], G[joints][joints];
    for (const T& rate : at.u) steps = steps + abs(rate);
    const T way = half * steps, square = way * way, fourth = square * square * T(1.0 / 24.0);
    for (int i = 0; i < joints; ++i) {
        const T size = at.row[i].wrist * T(lever) + at.row[i].turn + at.row[i].psi;
        defect[i] = abs(at.back.times(i, at.f.left)) +
                    half * half * (T(0.5) * at.curved[i] + half * T(1.0 / 6.0) * at.jerked[i]) +
                    size * fourth + T(near_rule::rounding);
        out.radius[i] = T(near_rule::grown) * defect[i];
    }
    auto proven = T(1.0) < T(0.0);
    for (int pass = 0; pass < near_rule::growths && !all(proven); ++pass) {
        detail::contraction(arm, at, half, out.radius, G);
        T wanted[joints];
        auto holds = T(0.0) < T(1.0);
        for (int i = 0; i < joints; ++i) {
            wanted[i] = detail::grown_by(defect, G, out.radius, i);
            holds = holds & (wanted[i] < out.radius[i]);
        }
        proven = proven | holds;
        for (int i = 0; i < joints; ++i)
            out.radius[i] = select(proven, out.radius[i], T(near_rule::grown) * wanted[i]);
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
        out.slope_radius[i] = T(near_rule::grown) * uneven[i];
    }
    auto settled = T(1.0) < T(0.0);
    for (int pass = 0; pass < near_rule::growths && !all(settled); ++pass) {
        T wanted[joints];
        auto holds = T(0.0) < T(1.0);
        for (int i = 0; i < joints; ++i) {
            wanted[i] = detail::grown_by(uneven, G, out.slope_radius, i);
            holds = holds & (wanted[i] < out.slope_radius[i]);
        }
        settled = settled | holds;
        const T more(pass + 1 < near_rule::growths ? near_rule::grown : infinity);
        for (int i = 0; i < joints; ++i)
            out.slope_radius[i] = select(settled, out.slope_radius[i], more * wanted[i]);
    }
    detail::theta_of(angle, out.theta);
    for (int j = 0; j < joints; ++j) out.slope[j] = at.u[j];
    return proven;
}

}  // namespace armangle
