// (pose, psi, GC) -> q of a nearly S-R-S arm.
//
// Every true posture is the nominal posture of a corrected pose X = N(theta) T(theta)^-1 pose. Where theta is
// the nominal inverse of X, N(theta) is X itself: so X <- X (T(theta)^-1 pose) is the whole correction, and
// T(theta)^-1 pose what is left to do. One correction shrinks it by about deviation / (lever sin theta_2 or
// _6); the rest is Newton on the seven equations (pose, psi), with their Jacobian in closed form.
#pragma once

#include "../circle/inverse.hpp"
#include "../numbers/rotations.hpp"
#include "forward.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the inverse of a chain.
struct ChainInverseTuning {
    static constexpr int corrections = 1;       // of the pose, before Newton takes over
    static constexpr int more_corrections = 8;  // where that does not lead to the posture
    static constexpr int quick_steps = 4;       // of Newton in closed form
    static constexpr int newton_steps = 24;     // of Newton with short steps
    static constexpr int bends = 4;             // tried where two branches are near
    static constexpr double bend[bends] = {0.01, 0.03, 0.1, 0.003};  // rad
    static constexpr double aside[] = {0.02, -0.02};                 // rad of psi: and then from beside
    static constexpr int walk = 4;                                   // steps back from there
    static constexpr int far = 8;                                    // and at last from all round the circle
    static constexpr double far_off[far] = {0.06, -0.06, 0.2, -0.2, 0.6, -0.6, 1.5, -1.5};  // rad of psi
    static constexpr double stride = 0.05;     // rad: a step back
    static constexpr double settled = 2e-14;   // of what is left (ratio): another step would change rounding
    static constexpr double residual = 1e-12;  // largest that is taken for an answer (ratio; m of a metre)
    static constexpr double held =
        1e-6;  // a seed this near to the pose is one of its postures (ratio; rad) ...
    static constexpr double kept = 1e-3;         // ... if one is this near to it (rad of a joint)
    static constexpr double largest_step = 0.5;  // rad, of Newton
    static constexpr double vanishing = 1e-12;   // a determinant of the Jacobian (ratio): two branches meet
    /// Newton has never failed farther than this from theta_2, theta_6 = 0 or a stretched elbow (rad): sine.
    static constexpr double band_sine = 0.17;
};

namespace detail {

/// The plane of a psi (rad) in the frame of a pose: what the elbow axis z_3 must fulfil to have that psi.
template <class T>
struct PsiPlane {
    Vec3<T> across;  // e cos(psi) - z sin(psi): the elbow axis z_3 is orthogonal to it
    Vec3<T> along;   // e sin(psi) + z cos(psi): and on the side of this

    /// The plane of a psi on the circle of a pose.
    PsiPlane(const Triad<T>& on, const SinCos<T>& psi) noexcept
        : across(combine(on.e, psi.cos, on.z, -psi.sin)), along(combine(on.e, psi.sin, on.z, psi.cos)) {}

    /// The plane of psi that these two orthogonal unit vectors, `across` and `along`, define.
    PsiPlane(const Vec3<T>& a, const Vec3<T>& b) noexcept : across(a), along(b) {}

    /// The plane of psi + `by`.
    PsiPlane turned(const T& by) const noexcept {
        const SinCos<T> sc = sin_cos(by);
        return {combine(across, sc.cos, along, -sc.sin), combine(along, sc.cos, across, sc.sin)};
    }

    /// The unit normal that stands for psi = 0 in the closed form of a pose whose wrist is p (m, from the
    /// shoulder; w = p / |p|), so that its psi is this plane's.
    Vec3<T> normal(const Arm& arm, const Vec3<T>& p, const Vec3<T>& w) const noexcept {
        const Vec3<T> in_plane = w - across * dot(across, w);
        const Vec3<T> upright = in_plane * (T(1.0) / norm(in_plane)), z = cross(across, upright);
        if (arm.d_4 == 0) return z;
        const T distance = norm(p), tilt = arm.d_4 / distance;  // z_3 leans by it along w
        const T a = tilt / norm(in_plane), b = sqrt(max(T(1.0) - a * a, T(0.0)));
        const Vec3<T> z_3 = combine(upright, a, z, b);
        return (z_3 - w * tilt) * (T(1.0) / sqrt(max(T(1.0) - tilt * tilt, T(tolerance::vanishing))));
    }
};

/// Writes the angles of the nominal arm's posture for a flange pose, a psi and a branch to `angle`; a wrist
/// out of reach is moved to the nearest reachable distance.
template <class T>
ARMANGLE_INLINE void nominal_posture(const Arm& arm, const Pose<T>& flange, const PsiPlane<T>& plane,
                                     const Configuration<T>& gc, SinCos<T>* angle) noexcept {
    Triad<T> on = triad(arm, flange,
                        [&](const Vec3<T>& p, const Vec3<T>& w) noexcept { return plane.normal(arm, p, w); });
    on.distance = min(max(on.distance, T(arm.inner_reach)), T(arm.reach));
    const Directions<T> d =
        directions(self_motion(arm, circle_on(arm, on, flange), gc), SinCos<T>{T(0.0), T(1.0)});
    for (int j = 0; j < joints; ++j) {
        const T length = hypot(d.y[j], d.x[j]), scale = T(1.0) / select(length == T(0.0), T(1.0), length);
        angle[j] = {d.y[j] * scale, select(length == T(0.0), T(1.0), d.x[j] * scale)};
    }
}

/// Pose b in the frame of a: a^-1 b.
template <class T>
ARMANGLE_INLINE Pose<T> from_to(const Pose<T>& a, const Pose<T>& b) noexcept {
    const Mat3<T>& r = a.rotation;
    return {{transposed_times(r, b.rotation.x), transposed_times(r, b.rotation.y),
             transposed_times(r, b.rotation.z)},
            transposed_times(r, b.position - a.position)};
}

/// |x| + |y| + |z|; max would pass over a NaN.
template <class T>
ARMANGLE_INLINE T taxi_length(const Vec3<T>& v) noexcept {
    return abs(v.x) + abs(v.y) + abs(v.z);
}

/// A measure of how far a pose is from the identity: the absolute coordinates of its translation (m) over
/// `size`, plus those of its rotation vector (rad, for small rotations).
template <class T>
ARMANGLE_INLINE T remainder(const Pose<T>& p, double size) noexcept {
    const Mat3<T>& r = p.rotation;
    const Vec3<T> turn{r.y.z - r.z.y, r.z.x - r.x.z, r.x.y - r.y.x};
    return taxi_length(p.position) * T(1.0 / size) + T(0.5) * taxi_length(turn);
}

/// A posture and its error: position over size, plus rotation and psi in rad.
template <class T>
struct Found {
    SinCos<T> angle[joints];
    T left;
};

/// The posture after at most `corrections` corrections of the pose; a lane that has converged is not changed.
template <class T>
ARMANGLE_INLINE Found<T> correct(const ChainArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                                 const Configuration<T>& gc, int corrections) noexcept {
    const double size = max(1.0, arm.nominal.size);
    Pose<T> wanted = pose;
    Found<T> out;
    out.left = T(infinity);
    for (int pass = 0;; ++pass) {
        SinCos<T> angle[joints];
        nominal_posture(arm.nominal, flange_pose(arm.nominal, wanted), plane, gc, angle);
        const Pose<T> rest = from_to(tip(arm, angle), pose);
        const auto settled = out.left <= T(ChainInverseTuning::settled);
        for (int j = 0; j < joints; ++j)
            out.angle[j] = {select(settled, out.angle[j].sin, angle[j].sin),
                            select(settled, out.angle[j].cos, angle[j].cos)};
        out.left = select(settled, out.left, remainder(rest, size));
        if (pass == corrections || all(out.left <= T(ChainInverseTuning::settled))) return out;
        wanted = wanted * rest;
    }
}

/// The seven equations at a posture: the errors `left` of the wrist (m, over the reach), rotation (rad) and
/// psi, and the columns of their Jacobian by the joints. psi is measured by the elbow axis z_3, which must be
/// orthogonal to the plane's `across`.
template <class T>
struct SevenEquations {
    struct Row {
        Vec3<T> wrist, turn;
        T psi;
    };
    Row left, column[joints];

    /// The sum of all absolute errors.
    T size() const noexcept { return taxi_length(left.wrist) + taxi_length(left.turn) + abs(left.psi); }
};

/// Whether T is a Taylor series of intervals: the equations then hold for a box of postures, for a proof.
template <class T>
concept enclosing = requires(const T& x) { x.value().lo; };

/// How fast half the sum of the cross products of a's axes with b's falls per radian by which a is turned
/// about `axis`: (tr M - M) axis / 2 with M the sum of a_i b_i^T, whose trace is `trace`.
template <class T>
Vec3<T> turn_slope(const Mat3<T>& a, const Mat3<T>& b, const T& trace, const Vec3<T>& axis) noexcept {
    return (axis * trace - a.x * dot(b.x, axis) - a.y * dot(b.y, axis) - a.z * dot(b.z, axis)) * T(0.5);
}

/// Computes the seven equations at a posture with these angles. The columns of the rotation are exact on the
/// pose, which Newton's method needs; with intervals they are exact at every posture, which a proof needs.
template <class T>
ARMANGLE_INLINE SevenEquations<T> seven_equations(const ChainArm& arm, const Pose<T>& pose,
                                                  const PsiPlane<T>& plane, const SinCos<T>* angle) noexcept {
    Pose<T> frame[joints + 1];
    walk_links(arm, angle, [&frame](int k, const Pose<T>& at) noexcept { frame[k] = at; });
    const Pose<T>& now = frame[joints];
    const Vec3<T> in_tip = spread<T>(arm.wrist), wrist = now.rotation * in_tip + now.position;
    const T per_reach(1.0 / arm.nominal.reach), zero(0.0);
    const Vec3<T> z_3 = elbow_axis(angle), z_0{zero, zero, T(1.0)}, z_1{-angle[0].sin, angle[0].cos, zero},
                  z_2{angle[0].cos * angle[1].sin, angle[0].sin * angle[1].sin, angle[1].cos};
    const Vec3<T> nominal_axis[3] = {z_0, z_1, z_2};
    SevenEquations<T> out;
    out.left.wrist = (pose.rotation * in_tip + pose.position - wrist) * per_reach;
    out.left.turn = (cross(now.rotation.x, pose.rotation.x) + cross(now.rotation.y, pose.rotation.y) +
                     cross(now.rotation.z, pose.rotation.z)) *
                    T(0.5);
    out.left.psi = -dot(plane.across, z_3);
    for (int i = 0; i < joints; ++i) {
        const Vec3<T>& axis = frame[i].rotation.z;
        out.column[i].wrist = cross(axis, wrist - frame[i].position) * per_reach;
        out.column[i].turn = axis;
        out.column[i].psi = i < 3 ? dot(plane.across, cross(nominal_axis[i], z_3)) : zero;
    }
    if constexpr (enclosing<T>) {
        const Mat3<T>&a = now.rotation, &b = pose.rotation;
        const T trace = trace_between(a, b);
        for (auto& column : out.column) column.turn = turn_slope(a, b, trace, column.turn);
    }
    return out;
}

/// a . (b x c).
template <class T>
ARMANGLE_INLINE T triple(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) noexcept {
    return dot(a, cross(b, c));
}

/// The seven equations with joints 5-7 eliminated by the rows of the rotation: the rest is for joints 1-4. At
/// a vanishing determinant the values that are divided by it are NaN or infinite.
template <class T>
struct Reduced {
    using Row = typename SevenEquations<T>::Row;
    Vec3<T> undo[3];  // rows of the block's inverse: joints 5-7 that make a turn
    Vec3<T> back[4];  // joints 5-7 that undo the turn of joints 1-4
    Vec3<T> w[4];     // how the wrist moves with joints 1-4 then
    Vec3<T> n_0, n_1, n_2;
    T m_12, m_02, m_01;  // Cramer's rule: minors
    T per_det, per;      // one over each determinant

    /// Eliminates joints 5 to 7 from the seven equations; see is_regular().
    ARMANGLE_INLINE explicit Reduced(const SevenEquations<T>& f) noexcept : c_(f.column) {
        const Vec3<T> r_5 = cross(c_[5].turn, c_[6].turn), r_6 = cross(c_[6].turn, c_[4].turn),
                      r_7 = cross(c_[4].turn, c_[5].turn);
        per_det = T(1.0) / dot(c_[4].turn, r_5);
        undo[0] = r_5 * per_det;
        undo[1] = r_6 * per_det;
        undo[2] = r_7 * per_det;
        for (int i = 0; i < 4; ++i) {
            back[i] = turned_back(c_[i].turn);
            w[i] = c_[i].wrist - moved(back[i]);
        }
        n_0 = cross(w[0], w[3]);
        n_1 = cross(w[1], w[3]);
        n_2 = cross(w[2], w[3]);
        m_12 = dot(w[1], n_2);
        m_02 = dot(w[0], n_2);
        m_01 = dot(w[0], n_1);
        per = T(1.0) / (c_[1].psi * m_02 - c_[0].psi * m_12 - c_[2].psi * m_01);
    }

    /// Whether both determinants are clearly not 0.
    ARMANGLE_INLINE auto is_regular() const noexcept {
        const T most(1.0 / ChainInverseTuning::vanishing), of_turn = abs(per_det), of_rest = abs(per);
        return (of_turn < most) & (of_rest < most);
    }
    /// The rates of joints 5-7 that give a rotation vector.
    ARMANGLE_INLINE Vec3<T> turned_back(const Vec3<T>& v) const noexcept {
        return {dot(undo[0], v), dot(undo[1], v), dot(undo[2], v)};
    }
    /// The displacement of the wrist by rates x of joints 5-7.
    ARMANGLE_INLINE Vec3<T> moved(const Vec3<T>& x) const noexcept {
        return c_[4].wrist * x.x + c_[5].wrist * x.y + c_[6].wrist * x.z;
    }
    /// Solves the equations: writes the joint step (rad) that makes the errors `left` vanish to `step`.
    ARMANGLE_INLINE void solve(const Row& left, T (&step)[joints]) const noexcept {
        const Vec3<T> rest = turned_back(left.turn), s = left.wrist - moved(rest);
        const T h = left.psi, g_0 = c_[0].psi, g_1 = c_[1].psi, g_2 = c_[2].psi;
        const T s_0 = dot(s, n_0), s_1 = dot(s, n_1), s_2 = dot(s, n_2);
        step[0] = (g_1 * s_2 - g_2 * s_1 - h * m_12) * per;
        step[1] = (h * m_02 - g_0 * s_2 + g_2 * s_0) * per;
        step[2] = (g_0 * s_1 - g_1 * s_0 - h * m_01) * per;
        step[3] = (g_1 * triple(w[0], w[2], s) - g_0 * triple(w[1], w[2], s) - g_2 * triple(w[0], w[1], s) +
                   h * triple(w[0], w[1], w[2])) *
                  per;
        const Vec3<T> last =
            rest - (back[0] * step[0] + back[1] * step[1] + back[2] * step[2] + back[3] * step[3]);
        step[4] = last.x;
        step[5] = last.y;
        step[6] = last.z;
    }

private:
    const Row* c_;
};

/// Writes the joint step (rad) of Newton's method for the seven equations to `step`.
template <class T>
ARMANGLE_INLINE void newton_step(const SevenEquations<T>& f, T (&step)[joints]) noexcept {
    Reduced<T>(f).solve(f.left, step);
}

/// Adds a step (rad) to each joint angle in `angle`, in place and without normalization.
template <class T>
ARMANGLE_INLINE void turn_by(const T (&step)[joints], SinCos<T>* angle) noexcept {
    for (int j = 0; j < joints; ++j) {
        const SinCos<T> by = sin_cos(step[j]), from = angle[j];
        angle[j] = {mul_add(from.sin, by.cos, from.cos * by.sin),
                    mul_add(from.cos, by.cos, -(from.sin * by.sin))};
    }
}

/// Whether a posture is in the branch and has the plane's psi, not psi + pi.
template <class T>
ARMANGLE_INLINE auto is_of(const Arm& arm, const PsiPlane<T>& plane, const Configuration<T>& gc,
                           const SinCos<T>* angle) noexcept {
    const T bend = angle[3].sin * arm.delta.cos - angle[3].cos * arm.delta.sin;
    return (angle[1].sin * gc.shoulder >= T(0.0)) & (bend * gc.elbow >= T(0.0)) &
           (angle[5].sin * gc.wrist >= T(0.0)) & (dot(plane.along, elbow_axis(angle)) > T(0.0));
}

/// The posture of a pose, psi and branch by one correction and a few Newton steps. `left` is infinite if it
/// is in another branch, NaN if a step failed.
template <class T>
ARMANGLE_INLINE Found<T> find_posture(const ChainArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                                      const Configuration<T>& gc) noexcept {
    Found<T> out = correct(arm, pose, plane, gc, ChainInverseTuning::corrections);
    for (int pass = 0; !all(out.left <= T(ChainInverseTuning::settled)); ++pass) {
        const SevenEquations<T> now = seven_equations(arm, pose, plane, out.angle);
        out.left = select(out.left <= T(ChainInverseTuning::settled), out.left, now.size());
        if (pass == ChainInverseTuning::quick_steps) break;
        const auto settled = out.left <= T(ChainInverseTuning::settled);
        T step[joints];
        newton_step(now, step);
        for (T& part : step) part = select(settled, T(0.0), part);
        turn_by(step, out.angle);
    }
    out.left = select(is_of(arm.nominal, plane, gc, out.angle), out.left, T(infinity));
    return out;
}

/// The inverse of the seven equations' Jacobian: row i belongs to joint i + 1, with the columns in the order
/// of the equations.
template <class T>
struct InverseSlope {
    typename SevenEquations<T>::Row row[joints];

    /// The step (rad) of joint i + 1 that removes the errors x: row i of this inverse times x.
    ARMANGLE_INLINE T times(int i, const typename SevenEquations<T>::Row& x) const noexcept {
        return dot(row[i].wrist, x.wrist) + dot(row[i].turn, x.turn) + row[i].psi * x.psi;
    }
};

/// Computes the inverse of the Jacobian in closed form, from the reduced equations.
template <class T>
ARMANGLE_INLINE InverseSlope<T> inverse_slope(const SevenEquations<T>& f, const Reduced<T>& to) noexcept {
    const auto& w = to.w;
    const T g_0 = f.column[0].psi, g_1 = f.column[1].psi, g_2 = f.column[2].psi;
    InverseSlope<T> out;
    out.row[0].wrist = (to.n_2 * g_1 - to.n_1 * g_2) * to.per;
    out.row[1].wrist = (to.n_0 * g_2 - to.n_2 * g_0) * to.per;
    out.row[2].wrist = (to.n_1 * g_0 - to.n_0 * g_1) * to.per;
    const Vec3<T> w_02 = cross(w[0], w[2]), w_12 = cross(w[1], w[2]), w_01 = cross(w[0], w[1]);
    out.row[3].wrist = (w_02 * g_1 - w_12 * g_0 - w_01 * g_2) * to.per;
    out.row[0].psi = -to.m_12 * to.per;
    out.row[1].psi = to.m_02 * to.per;
    out.row[2].psi = -to.m_01 * to.per;
    out.row[3].psi = dot(w[0], w_12) * to.per;
    for (int i = 0; i < 4; ++i) {
        const Vec3<T>& by_wrist = out.row[i].wrist;
        out.row[i].turn =
            -(to.undo[0] * dot(by_wrist, f.column[4].wrist) + to.undo[1] * dot(by_wrist, f.column[5].wrist) +
              to.undo[2] * dot(by_wrist, f.column[6].wrist));
    }
    for (int i = 0; i < 3; ++i) out.row[4 + i] = {{T(0.0), T(0.0), T(0.0)}, to.undo[i], T(0.0)};
    for (int k = 0; k < 4; ++k) {
        const T undone[3] = {-to.back[k].x, -to.back[k].y, -to.back[k].z};
        for (int i = 0; i < 3; ++i) {
            auto& row = out.row[4 + i];
            row.wrist = mul_add(out.row[k].wrist, undone[i], row.wrist);
            row.turn = mul_add(out.row[k].turn, undone[i], row.turn);
            row.psi = mul_add(out.row[k].psi, undone[i], row.psi);
        }
    }
    return out;
}

/// Whether a posture is near a singularity: |sin| of theta_2, theta_4 - delta or theta_6 is small.
inline bool near_singular(const Arm& arm, const SinCos<double>* angle) noexcept {
    const double bend = angle[3].sin * arm.delta.cos - angle[3].cos * arm.delta.sin;
    return !(min(min(abs(angle[1].sin), abs(angle[5].sin)), abs(bend)) > ChainInverseTuning::band_sine);
}

/// Newton's method with limited steps from the posture `angle`, which is replaced; for postures that
/// find_posture() misses. Returns OK, NEAR_SINGULAR or NO_CONVERGENCE; `angle` is a posture only with OK.
inline Status newton(const ChainArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                     const Configuration<double>& gc, SinCos<double> (&angle)[joints]) noexcept {
    bool solved = false;
    double before = infinity;
    for (int pass = 0;; ++pass) {
        const SevenEquations<double> now = seven_equations(arm, pose, plane, angle);
        const double left = now.size();
        solved = left <= ChainInverseTuning::residual;
        double step[joints], longest = 0;
        if (left <= ChainInverseTuning::settled || (solved && !(left < before)) || !(left < infinity)) break;
        if (pass == ChainInverseTuning::newton_steps) break;  // after the last step is looked at
        before = left;
        const Reduced<double> to(now);
        if (!to.is_regular()) break;
        to.solve(now.left, step);
        for (const double part : step) longest = max(longest, abs(part));
        if (longest > ChainInverseTuning::largest_step)
            for (double& part : step) part *= ChainInverseTuning::largest_step / longest;
        turn_by(step, angle);
    }
    if (solved && is_of(arm.nominal, plane, gc, angle)) return Status::OK;
    return solved || near_singular(arm.nominal, angle) ? Status::NEAR_SINGULAR : Status::NO_CONVERGENCE;
}

/// Newton's method with limited steps from several postures `angle` at once, only those in `wanted`; returns
/// which of them converge to a posture of the branch.
template <int N>
inline LaneMask<N> newton(const ChainArm& arm, const Pose<Lane<N>>& pose, const PsiPlane<Lane<N>>& plane,
                          const Configuration<Lane<N>>& gc, const LaneMask<N>& wanted,
                          SinCos<Lane<N>> (&angle)[joints]) noexcept {
    using T = Lane<N>;
    auto going = wanted, solved = T(1.0) < T(0.0);
    T before(infinity);
    for (int pass = 0;; ++pass) {
        const SevenEquations<T> now = seven_equations(arm, pose, plane, angle);
        const T left = now.size();
        const auto good = left <= T(ChainInverseTuning::residual);
        const auto done = (left <= T(ChainInverseTuning::settled)) | (good & !(left < before));
        solved = solved | (going & done);
        going = going & !done & (left < T(infinity));
        if (pass == ChainInverseTuning::newton_steps) {
            solved = solved | (going & good);
            break;
        }
        const Reduced<T> to(now);
        going = going & to.is_regular();
        if (!any(going)) break;
        before = left;
        T step[joints], longest(0.0);
        to.solve(now.left, step);
        for (const T& part : step) longest = max(longest, abs(part));
        const T most(ChainInverseTuning::largest_step),
            scale = select(longest > most, most / longest, T(1.0));
        for (T& part : step) part = select(going, part * scale, T(0.0));
        turn_by(step, angle);
    }
    return solved & is_of(arm.nominal, plane, gc, angle);
}

/// Replaces theta_2, theta_4 - delta and theta_6 in `angle` by `bend` (rad), with the sign of the branch,
/// where they are nearer to a singularity than that: a new start for Newton's method.
template <class T>
ARMANGLE_INLINE void bend_by(double bend, const Arm& arm, const Configuration<T>& gc,
                             SinCos<T> (&angle)[joints]) noexcept {
    const SinCos<double> by = sin_cos(bend);
    const auto bent = [&](SinCos<T>& at, const SinCos<double>& zero, const T& side) {
        const T sine = at.sin * zero.cos - at.cos * zero.sin, cosine = at.cos * zero.cos + at.sin * zero.sin;
        const auto straight = abs(sine) < T(by.sin);
        const T s = side * by.sin, c = select(cosine < T(0.0), T(-by.cos), T(by.cos));
        at = {select(straight, s * zero.cos + c * zero.sin, at.sin),
              select(straight, c * zero.cos - s * zero.sin, at.cos)};
    };
    bent(angle[1], {0, 1}, gc.shoulder);
    bent(angle[3], arm.delta, gc.elbow);
    bent(angle[5], {0, 1}, gc.wrist);
}

/// Writes the posture that find_posture() finds to `angle`; false if it does not converge.
inline bool solve_quickly(const ChainArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                          const Configuration<double>& gc, SinCos<double> (&angle)[joints]) noexcept {
    const Found<double> found = find_posture(arm, pose, plane, gc);
    for (int j = 0; j < joints; ++j) angle[j] = found.angle[j];
    return found.left <= ChainInverseTuning::settled;
}

/// Computes the posture `angle` by Newton's method from starts that are moved away from singularities. A
/// status as of newton().
inline Status solve_bent(const ChainArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                         const Configuration<double>& gc, SinCos<double> (&angle)[joints]) noexcept {
    const auto begin = [&angle](const Found<double>& from) {
        for (int j = 0; j < joints; ++j) angle[j] = from.angle[j];
    };
    const Found<double> start = correct(arm, pose, plane, gc, ChainInverseTuning::more_corrections);
    begin(start);
    Status status = newton(arm, pose, plane, gc, angle);
    for (int k = 0; k < ChainInverseTuning::bends && status != Status::OK; ++k) {
        begin(start);
        bend_by(ChainInverseTuning::bend[k], arm.nominal, gc, angle);
        status = newton(arm, pose, plane, gc, angle);
    }
    return status;
}

/// Computes the posture `angle` by finding that of psi + `by` (rad) and following it back in steps. A status
/// as of newton().
inline Status solve_from_nearby_psi(const ChainArm& arm, const Pose<double>& pose,
                                    const PsiPlane<double>& plane, double by, const Configuration<double>& gc,
                                    SinCos<double> (&angle)[joints]) noexcept {
    const PsiPlane<double> beside = plane.turned(by);
    Status status = Status::OK;
    if (!solve_quickly(arm, pose, beside, gc, angle)) status = solve_bent(arm, pose, beside, gc, angle);
    for (int k = ChainInverseTuning::walk - 1; k >= 0 && status == Status::OK; --k)
        status = newton(arm, pose, plane.turned(by * k / ChainInverseTuning::walk), gc, angle);
    return status;
}

/// Computes the posture `angle` by finding those of several distant psi at once and following one back in
/// steps. Returns OK or NEAR_SINGULAR.
inline Status solve_from_far(const ChainArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                             const Configuration<double>& gc, SinCos<double> (&angle)[joints]) noexcept {
    using Far = Lane<ChainInverseTuning::far>;
    const PsiPlane<Far> there = PsiPlane<Far>(spread<Far>(plane.across), spread<Far>(plane.along))
                                    .turned(Far::load(ChainInverseTuning::far_off));
    const Pose<Far> same = spread<Far>(pose);
    const Configuration<Far> branch = spread<Far>(gc);
    const Found<Far> start = correct(arm, same, there, branch, ChainInverseTuning::more_corrections);
    SinCos<Far> at[joints];
    for (int j = 0; j < joints; ++j) at[j] = start.angle[j];
    auto found = Far(1.0) < Far(0.0);
    for (int k = 0; k <= ChainInverseTuning::bends && !all(found); ++k) {
        SinCos<Far> begun[joints];
        for (int j = 0; j < joints; ++j)
            begun[j] = {select(found, at[j].sin, start.angle[j].sin),
                        select(found, at[j].cos, start.angle[j].cos)};
        if (k > 0) bend_by(ChainInverseTuning::bend[k - 1], arm.nominal, branch, begun);
        const auto more = newton(arm, same, there, branch, !found, begun);
        for (int j = 0; j < joints; ++j)
            at[j] = {select(more, begun[j].sin, at[j].sin), select(more, begun[j].cos, at[j].cos)};
        found = found | more;
    }
    for (int k = 0; k < ChainInverseTuning::far; ++k) {
        if (!found[k]) continue;
        for (int j = 0; j < joints; ++j) angle[j] = {at[j].sin[k], at[j].cos[k]};
        const double by = ChainInverseTuning::far_off[k];
        const int steps = 1 + static_cast<int>(abs(by) / ChainInverseTuning::stride);
        Status status = Status::OK;
        for (int i = steps - 1; i >= 0 && status == Status::OK; --i)
            status = newton(arm, pose, plane.turned(by * i / steps), gc, angle);
        if (status == Status::OK) return status;
    }
    return Status::NEAR_SINGULAR;
}

/// Computes the posture `angle` of a pose within reach: tries all methods above, the fastest first. A status
/// as of newton().
inline Status solve_angles(const ChainArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                           const Configuration<double>& gc, SinCos<double> (&angle)[joints]) noexcept {
    if (solve_quickly(arm, pose, plane, gc, angle)) return Status::OK;
    Status status = solve_bent(arm, pose, plane, gc, angle);
    for (const double by : ChainInverseTuning::aside)
        if (status == Status::NEAR_SINGULAR) status = solve_from_nearby_psi(arm, pose, plane, by, gc, angle);
    return status == Status::NEAR_SINGULAR ? solve_from_far(arm, pose, plane, gc, angle) : status;
}

/// Whether a seed (joint values, rad) is a posture of the pose, psi and branch, or so near to one that
/// Newton's method converges to it; the posture is then in `angle`. Used because a psi may have two postures.
inline bool is_held_by(const ChainArm& arm, const Pose<double>& pose, const PsiPlane<double>& plane,
                       const Configuration<double>& gc, const double* seed,
                       SinCos<double> (&angle)[joints]) noexcept {
    double theta[joints];
    theta_of(arm.nominal, seed, theta);
    sin_cos_all(theta, angle);
    if (!(remainder(from_to(tip(arm, angle), pose), max(1.0, arm.nominal.size)) <= ChainInverseTuning::held))
        return false;
    SinCos<double> from[joints];
    for (int j = 0; j < joints; ++j) from[j] = angle[j];
    bool led = newton(arm, pose, plane, gc, angle) == Status::OK;
    for (int j = 0; j < joints; ++j)
        led &= hypot(angle[j].sin - from[j].sin, angle[j].cos - from[j].cos) <= ChainInverseTuning::kept;
    if (led) return true;
    // where branches meet a step is as good as anything, but none is needed
    for (int j = 0; j < joints; ++j) angle[j] = from[j];
    return seven_equations(arm, pose, plane, angle).size() <= ChainInverseTuning::residual &&
           is_of(arm.nominal, plane, gc, angle);
}

/// The joint angles in (-pi, pi] of a posture, from sines and cosines; the eighth slot is 0.
inline JointLanes theta_of(const SinCos<double>* angle) noexcept {
    double y[joint_slots] = {}, x[joint_slots] = {0, 0, 0, 0, 0, 0, 0, 1};
    for (int j = 0; j < joints; ++j) {
        y[j] = angle[j].sin;
        x[j] = angle[j].cos;
    }
    return atan2(JointLanes::of(y), JointLanes::of(x));
}

/// Writes the joint angles (rad) of several postures at once to `theta`, from sines and cosines.
template <int N>
ARMANGLE_INLINE void theta_of(const SinCos<Lane<N>>* angle, Lane<N> (&theta)[joints]) noexcept {
    for (int j = 0; j < joints; ++j) theta[j] = atan2(angle[j].sin, angle[j].cos);
}
/// Writes the joint angles (rad) of a posture to `theta`, from sines and cosines.
inline void theta_of(const SinCos<double>* angle, double (&theta)[joints]) noexcept {
    const JointLanes all = theta_of(angle);
    for (int j = 0; j < joints; ++j) theta[j] = all[j];
}

/// UNREACHABLE or FOLDED if a pose, whose triad is `on`, surely has no posture; OK if it may have one.
inline Status reach_status(const ChainArm& arm, const Triad<double>& on) noexcept {
    const Arm& nominal = arm.nominal;
    const double outside = max(on.distance - nominal.reach, nominal.inner_reach - on.distance);
    if (!(outside <= arm.wrist_shift + tolerance::reach * nominal.size)) return Status::UNREACHABLE;
    return is_folded(on) ? Status::FOLDED : Status::OK;
}

}  // namespace detail

/// The joint values of the true chain for a pose, psi and branch, in the turns nearest to the seed (null: the
/// middles of the ranges). The result has the pose and psi within ChainInverseTuning::residual and exactly
/// this branch; otherwise the joints are NaN and the status is BAD_INPUT, UNREACHABLE, FOLDED, NEAR_SINGULAR
/// where branches meet, or NO_CONVERGENCE. A rotation within its tolerance is replaced by the nearest exact
/// one. If there are two postures, the seed's own is returned if it is one of them.
inline Inverse inverse(const ChainArm& arm, const Pose<double>& pose, double psi, int gc,
                       const double* seed = nullptr) noexcept {
    constexpr double no = not_a_number;
    Inverse out{{no, no, no, no, no, no, no, 0.0}, Status::BAD_INPUT, no};
    if (gc < 0 || gc >= configurations || !(abs(psi) <= tolerance::largest_angle)) return out;
    if (!is_rigid(pose) || (seed && !is_finite(seed))) return out;
    const Arm& nominal = arm.nominal;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const Triad<double> on = triad(nominal, flange_pose(nominal, exact));
    out.status = detail::reach_status(arm, on);
    if (out.status != Status::OK) return out;
    SinCos<double> angle[joints];
    const detail::PsiPlane<double> plane(on, sin_cos(psi));
    if (!(seed && detail::is_held_by(arm, exact, plane, configuration(gc), seed, angle)))
        out.status = detail::solve_angles(arm, exact, plane, configuration(gc), angle);
    if (out.status != Status::OK) return out;
    const JointLanes near = seed ? joint_lanes(seed) : JointLanes::load(nominal.joint_middle);
    to_q(detail::theta_of(angle), JointLanes::load(nominal.sign), JointLanes::load(nominal.offset),
         JointLanes::load(nominal.limits.lower), JointLanes::load(nominal.limits.upper), near)
        .store(out.q);
    out.margin = limit_margin(nominal.limits, out.q);
    return out;
}

/// By how much (m) the wrist of a pose is outside the nominal arm's reach; <= 0 if it is inside.
inline double reach_excess(const ChainArm& arm, const Pose<double>& pose) noexcept {
    return circle(arm.nominal, flange_pose(arm.nominal, pose)).triangle.excess;
}

/// The derivative dq/dpsi (rad/rad) of the true chain at a pose, psi and branch, in the member `q` of the
/// result; if there is none, `q` is NaN and the status says why: one of inverse(), or NEAR_SINGULAR.
inline Inverse self_motion_rate(const ChainArm& arm, const Pose<double>& pose, double psi, int gc) noexcept {
    Inverse out = inverse(arm, pose, psi, gc);
    if (out.status != Status::OK) return out;
    const Arm& nominal = arm.nominal;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const detail::PsiPlane<double> plane(triad(nominal, flange_pose(nominal, exact)), sin_cos(psi));
    SinCos<double> angle[joints];
    double theta[joints];
    detail::theta_of(nominal, out.q, theta);
    detail::sin_cos_all(theta, angle);
    const detail::SevenEquations<double> f = detail::seven_equations(arm, exact, plane, angle);
    const detail::SevenEquations<double>::Row by_psi{
        {0, 0, 0}, {0, 0, 0}, dot(plane.along, detail::elbow_axis(angle))};
    const detail::Reduced<double> to(f);
    double rate[joints];
    to.solve(by_psi, rate);
    if (!to.is_regular()) out.status = Status::NEAR_SINGULAR;
    for (int j = 0; j < joints; ++j)
        out.q[j] = out.status == Status::OK ? nominal.sign[j] * rate[j] : not_a_number;
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
