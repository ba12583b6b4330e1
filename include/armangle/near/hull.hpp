// All postures of a stretch of psi, proven: where each joint is, and how fast it moves.
//
// Around a posture theta_c of the seven equations F(theta, t) = 0, psi = psi_c + t, the self-motion is looked
// for as theta_c + u t + rho with u = dtheta/dpsi at t = 0. With C the inverse Jacobian there, one Newton
// step takes the box |rho_i| <= r_i into itself where
//     e + G r < r,   e_i >= |C F(theta_c + u t, t)|_i,   G_ik >= |1 - C J|_ik over |t| <= h and the box,
// so that for every t one posture lies in it, and no other (Krawczyk). G follows from the
// first and second derivatives at the centre, e from the third too, all cross products of the axes; and both
// from bounds of the next: those of turns are 1, those of the wrist the length of links that turn. Source: R.
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
struct Hull {
    double psi, half;
    double theta[joints], slope[joints], radius[joints], slope_radius[joints];

    double reach(int joint) const noexcept { return half * abs(slope[joint]) + radius[joint]; }
};

namespace detail {

using Row = SevenEquations<double>::Row;

/// What a hull is proven from: all derivatives at its centre.
struct HullCentre {
    SevenEquations<double> f;
    InverseSlope back;
    double u[joints];
    double turning;                  // along . z_3: minus dF/dpsi
    double along_rate;               // its rate along u
    double curved[joints];           // |C D2F[u, u]|
    double sheared[joints][joints];  // |C D2F[u, e_k]|
    double curvature;                // |D2F[u, u]|, wrist and turn
    double jerked[joints];           // |C D3F[u, u, u]|
    double jerk;                     // |D3F[u, u, u]|, wrist and turn
    struct {
        double wrist, turn, psi;
    } row[joints];  // sizes of the rows of C
};

/// How a frame turns while the joints before it turn at constant rates: its velocity and two derivatives.
struct Spin {
    Vec3<double> velocity, acceleration, jerk;

    /// One more joint, whose axis turns with the frame before it.
    void add(const Vec3<double>& axis, double rate) noexcept {
        const Vec3<double> swept = cross(velocity, axis);
        jerk = jerk + (cross(acceleration, axis) + cross(velocity, swept)) * rate;
        acceleration = acceleration + swept * rate;
        velocity = velocity + axis * rate;
    }
    /// First three derivatives of a vector of the frame.
    Vec3<double> first(const Vec3<double>& v) const noexcept { return cross(velocity, v); }
    Vec3<double> second(const Vec3<double>& v) const noexcept {
        return cross(acceleration, v) + cross(velocity, first(v));
    }
    Vec3<double> third(const Vec3<double>& v) const noexcept {
        const Vec3<double> moved = first(v);
        return cross(jerk, v) + cross(acceleration, moved) * 2.0 + cross(velocity, cross(acceleration, v)) +
               cross(velocity, cross(velocity, moved));
    }
};

/// D3F[u, u, u]: at constant rates u of the joints and of psi. The tip does not turn at first order, so that
/// its turn is the jerk alone.
inline Row third_along(const NearArm& arm, const PsiPlane<double>& plane, const SinCos<double>* angle,
                       const Vec3<double> (&nominal_axis)[3], const double (&u)[joints]) noexcept {
    Vec3<double> axis[joints], origin[joints + 1];
    walk_links(arm, angle, [&](int k, const Pose<double>& at) noexcept {
        if (k < joints) axis[k] = at.rotation.z;
        origin[k] = k < joints ? at.position : at.rotation * arm.wrist + at.position;
    });
    Spin spin{}, elbow{};
    Row out{};
    for (int k = 0; k < joints; ++k) {
        spin.add(axis[k], u[k]);
        out.wrist = out.wrist + spin.third(origin[k + 1] - origin[k]);
        if (k < 3) elbow.add(nominal_axis[k], u[k]);
    }
    out.wrist = out.wrist * (1.0 / arm.nominal.reach);
    out.turn = spin.jerk;
    const Vec3<double> z = elbow_axis(angle);
    out.psi = dot(plane.along, z - elbow.second(z) * 3.0) +
              dot(plane.across, elbow.third(z) - elbow.first(z) * 3.0);
    return out;
}

/// False where the posture is singular.
inline bool hull_centre(const NearArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                        const SinCos<double>* angle, HullCentre& out) noexcept {
    out.f = seven_equations(arm, pose, plane, angle);
    if (!invert(out.f, out.back)) return false;
    const Vec3<double> z_3 = elbow_axis(angle),
                       nominal_axis[3] = {
                           {0, 0, 1},
                           {-angle[0].sin, angle[0].cos, 0},
                           {angle[0].cos * angle[1].sin, angle[0].sin * angle[1].sin, angle[1].cos}};
    out.turning = dot(plane.along, z_3);
    for (int i = 0; i < joints; ++i) {
        out.u[i] = out.back.row[i].psi * out.turning;
        out.row[i] = {norm(out.back.row[i].wrist), norm(out.back.row[i].turn), abs(out.back.row[i].psi)};
    }
    const auto& c = out.f.column;
    Vec3<double> turn_before{}, all_moves{}, elbow_before{}, elbow_rate{};
    for (int k = 0; k < joints; ++k) all_moves = all_moves + c[k].wrist * out.u[k];
    for (int k = 0; k < 3; ++k) elbow_rate = elbow_rate + cross(nominal_axis[k], z_3) * out.u[k];
    out.along_rate = dot(plane.across, z_3) + dot(plane.along, elbow_rate);
    Vec3<double> moves = all_moves, elbow_moves = elbow_rate;
    Row along_u{};  // D2F[u, u]
    for (int k = 0; k < joints; ++k) {
        const Vec3<double>& axis = c[k].turn;
        const Vec3<double> turn_through = turn_before + axis * out.u[k];
        moves = moves - c[k].wrist * out.u[k];  // of the joints behind k
        Row x;                                  // D2F[u, e_k]
        x.turn = (cross(turn_before, axis) * 2.0) * 0.5;
        x.wrist = cross(turn_through, c[k].wrist) + cross(axis, moves);
        x.psi = 0.0;
        if (k < 3) {
            const Vec3<double> moved = cross(nominal_axis[k], z_3);
            const Vec3<double> elbow_through = elbow_before + nominal_axis[k] * out.u[k];
            elbow_moves = elbow_moves - moved * out.u[k];
            x.psi = dot(plane.across, cross(elbow_through, moved) + cross(nominal_axis[k], elbow_moves)) -
                    dot(plane.along, moved);
            elbow_before = elbow_through;
        }
        for (int i = 0; i < joints; ++i) out.sheared[i][k] = abs(out.back.times(i, x));
        along_u.wrist = along_u.wrist + x.wrist * out.u[k];
        along_u.turn = along_u.turn + x.turn * out.u[k];
        along_u.psi += x.psi * out.u[k];
        turn_before = turn_through;
    }
    along_u.psi += -dot(plane.along, elbow_rate) - dot(plane.across, z_3);  // D2F[u, e_psi]
    for (int i = 0; i < joints; ++i) out.curved[i] = abs(out.back.times(i, along_u));
    out.curvature = max(norm(along_u.wrist), norm(along_u.turn));
    const Row third = third_along(arm, plane, angle, nominal_axis, out.u);
    for (int i = 0; i < joints; ++i) out.jerked[i] = abs(out.back.times(i, third));
    out.jerk = max(norm(third.wrist), norm(third.turn));
    return true;
}

/// Bounds of the second-order rest of the Jacobian's columns over a stretch and a box.
struct ColumnRest {
    double wrist[joints], turn[joints], psi;
};

/// A column turns with the joints before it, or as seen from the tip, which nearly stays, with those behind.
inline ColumnRest column_rest(const NearArm& arm, const HullCentre& at, double half,
                              const double (&radius)[joints]) noexcept {
    const double per_reach = 1.0 / arm.nominal.reach, lever = arm.ahead[0] * per_reach;
    double move[joints], all = 0, box = 0, still = 0;
    for (int j = 0; j < joints; ++j) {
        move[j] = half * abs(at.u[j]) + radius[j];
        all += move[j];
        box += radius[j];
    }
    const double fourth = all * all * all * all / 24.0 * max(1.0, lever);
    still = half * half * (0.5 * at.curvature + half / 6.0 * at.jerk) + fourth + box * max(1.0, lever) +
            taxi_length(at.f.left.wrist) + taxi_length(at.f.left.turn);  // of pose and wrist
    ColumnRest out;
    double before = 0, behind = all;
    for (int k = 0; k < joints; ++k) {
        behind -= move[k];
        const double ahead = arm.ahead[k] * per_reach;
        const double by_before = 0.5 * before * before, by_behind = 0.5 * behind * behind + still;
        out.turn[k] = min(by_before, by_behind) + still + box;
        out.wrist[k] =
            min(by_before * (arm.ahead[0] + arm.behind[k]) * per_reach + still, by_behind * ahead) +
            box * ahead;
        before += move[k];
    }
    const double elbow = half + move[0] + move[1] + move[2];
    out.psi = 0.5 * elbow * elbow + box;
    return out;
}

/// G of a box.
inline void contraction(const NearArm& arm, const HullCentre& at, double half, const double (&radius)[joints],
                        double (&G)[joints][joints]) noexcept {
    const ColumnRest rest = column_rest(arm, at, half, radius);
    for (int i = 0; i < joints; ++i)
        for (int k = 0; k < joints; ++k)
            G[i][k] = half * at.sheared[i][k] + at.row[i].wrist * rest.wrist[k] +
                      at.row[i].turn * rest.turn[k] + (k < 3 ? at.row[i].psi * rest.psi : 0.0);
}

/// d + G x
inline double grown_by(const double (&d)[joints], const double (&G)[joints][joints],
                       const double (&x)[joints], int i) noexcept {
    double sum = d[i];
    for (int k = 0; k < joints; ++k) sum += G[i][k] * x[k];
    return sum;
}

}  // namespace detail

/// The hull of |t| <= half about a posture; false where it is not proven.
inline bool prove_hull(const NearArm& arm, const Pose<double>& pose, const detail::PsiPlane<double>& plane,
                       const SinCos<double> (&angle)[joints], double psi, double half, Hull& out) noexcept {
    detail::HullCentre at;
    if (!detail::hull_centre(arm, pose, plane, angle, at)) return false;
    const double lever = arm.ahead[0] / arm.nominal.reach;
    double steps = 1.0, defect[joints], G[joints][joints];
    for (const double rate : at.u) steps += abs(rate);
    const double way = half * steps, fourth = way * way * way * way / 24.0;
    for (int i = 0; i < joints; ++i) {
        const double size = at.row[i].wrist * lever + at.row[i].turn + at.row[i].psi;
        defect[i] = abs(at.back.times(i, at.f.left)) +
                    half * half * (0.5 * at.curved[i] + half / 6.0 * at.jerked[i]) + size * fourth +
                    near_rule::rounding;
        out.radius[i] = near_rule::grown * defect[i];
    }
    bool proven = false;
    for (int pass = 0; pass < near_rule::growths && !proven; ++pass) {
        detail::contraction(arm, at, half, out.radius, G);
        double wanted[joints];
        proven = true;
        for (int i = 0; i < joints; ++i) {
            wanted[i] = detail::grown_by(defect, G, out.radius, i);
            proven &= wanted[i] < out.radius[i];
        }
        for (int i = 0; i < joints && !proven; ++i) out.radius[i] = near_rule::grown * wanted[i];
    }
    if (!proven) return false;
    // J theta' = -dF/dpsi: theta' = C (along . z_3) + (1 - C J) theta'
    double uneven[joints], elbow = half, box = 0;
    for (int j = 0; j < joints; ++j) box += out.radius[j];
    for (int j = 0; j < 3; ++j) elbow += half * abs(at.u[j]) + out.radius[j];
    const double turning = half * abs(at.along_rate) + 0.5 * elbow * elbow + box;
    for (int i = 0; i < joints; ++i) {
        uneven[i] = at.row[i].psi * turning;
        for (int k = 0; k < joints; ++k) uneven[i] += G[i][k] * abs(at.u[k]);
        out.slope_radius[i] = near_rule::grown * uneven[i];
    }
    for (int pass = 0; pass < near_rule::growths; ++pass) {
        double wanted[joints];
        bool holds = true;
        for (int i = 0; i < joints; ++i) {
            wanted[i] = detail::grown_by(uneven, G, out.slope_radius, i);
            holds &= wanted[i] < out.slope_radius[i];
        }
        if (holds) break;
        for (int i = 0; i < joints; ++i)
            out.slope_radius[i] = pass + 1 < near_rule::growths ? near_rule::grown * wanted[i] : infinity;
    }
    out.psi = psi;
    out.half = half;
    const JointLanes theta = detail::theta_of(angle);
    for (int j = 0; j < joints; ++j) {
        out.theta[j] = theta[j];
        out.slope[j] = at.u[j];
    }
    return true;
}

}  // namespace armangle
