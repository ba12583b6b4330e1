// (pose, free joint, GC) -> q of an arm whose own chain is near to an offset arm.
//
// The free joint is a joint of the arm itself: its value is exact, and six equations are left for six joints.
// One correction of the pose, then Newton's method on the true chain. Where that does not lead to the branch,
// the chain grows from the nominal one in steps and its posture with it.
#pragma once

#include "../../numbers/rotations.hpp"
#include "offset_chain.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// How a posture is found.
struct OffsetChainTuning {
    /// Corrections of the pose before Newton's method.
    int corrections = 2;
    /// Newton steps to the end, and on each part of the way from the nominal arm.
    int steps = 12;
    /// Parts of the way from the nominal arm to the true one, where the direct way does not lead there.
    int parts = 16;
    /// Largest Newton step of a joint (rad).
    double largest_step = 0.3;
    /// What is left of shift (share of the reach) and turn (rad) in a solution, and where steps end.
    double residual = 1e-12, settled = 2e-14;
    /// A pivot this small (ratio) is no step: postures meet there.
    double least_pivot = 1e-12;
};

namespace detail {

/// A posture as directions of its joints in the order of the formulas, and its error: translation over the
/// reach plus rotation (rad).
struct ChainPosture {
    SinCos<double> angle[joints];
    double left = infinity;
};

/// Computes the frames of the true chain: frame[k] of joint k + 1 before its rotation, and the flange.
template <class T>
void walk_rows(const OffsetChain& arm, const SinCos<T>* angle, Pose<T> (&frame)[joints + 1]) noexcept {
    frame[0] = spread<T>(arm.row[0]);
    for (int k = 0; k < joints; ++k)
        frame[k + 1] = turned_about_z(frame[k], angle[k]) * spread<T>(arm.row[k + 1]);
}

/// Solves six equations (a: coefficients, then the right side; overwritten) by elimination with pivots and
/// writes the solution to x; false if a pivot is too small.
inline bool solve_six(double (&a)[6][7], double (&x)[6], double least_pivot) noexcept {
    for (int c = 0; c < 6; ++c) {
        int best = c;
        for (int r = c + 1; r < 6; ++r)
            if (abs(a[r][c]) > abs(a[best][c])) best = r;
        if (!(abs(a[best][c]) > least_pivot)) return false;
        for (int k = c; k < 7; ++k) {
            const double swap = a[c][k];
            a[c][k] = a[best][k];
            a[best][k] = swap;
        }
        for (int r = c + 1; r < 6; ++r) {
            const double share = a[r][c] / a[c][c];
            for (int k = c; k < 7; ++k) a[r][k] -= share * a[c][k];
        }
    }
    for (int c = 5; c >= 0; --c) {
        double sum = a[c][6];
        for (int k = c + 1; k < 6; ++k) sum -= a[c][k] * x[k];
        x[c] = sum / a[c][c];
    }
    return true;
}

/// Writes the six equations of all joints except `held` (0..6) at a posture to a: how the joints move the
/// flange, then what is missing to the pose. The position is that of frame 6's origin. Returns the flange.
template <class T>
Pose<T> six_equations(const OffsetChain& arm, const Pose<T>& flange, const SinCos<T>* angle, int held,
                      T (&a)[6][7]) noexcept {
    Pose<T> frame[joints + 1];
    walk_rows(arm, angle, frame);
    const Pose<T>& now = frame[joints];
    const T per_reach(1.0 / arm.nominal.rest.reach), back(-arm.nominal.rest.d_wf);
    const Vec3<T> at = mul_add(now.rotation.z, back, now.position);
    const Vec3<T> shift = (mul_add(flange.rotation.z, back, flange.position) - at) * per_reach;
    const Vec3<T> turn =
        (cross(now.rotation.x, flange.rotation.x) + cross(now.rotation.y, flange.rotation.y) +
         cross(now.rotation.z, flange.rotation.z)) *
        T(0.5);
    const auto put = [&a](int k, const Vec3<T>& moved, const Vec3<T>& turned) noexcept {
        const T column[6] = {moved.x, moved.y, moved.z, turned.x, turned.y, turned.z};
        for (int i = 0; i < 6; ++i) a[i][k] = column[i];
    };
    for (int i = 0; i < 6; ++i) {
        const Pose<T>& of = frame[i < held ? i : i + 1];
        put(i, cross(of.rotation.z, at - of.position) * per_reach, of.rotation.z);
    }
    put(6, shift, turn);
    return now;
}

/// Writes the inverse of the first six columns to `inverse`, by elimination with pivots; false if one is too
/// small.
inline bool invert_six(const double (&columns)[6][7], double (&inverse)[6][6]) noexcept {
    double a[6][12] = {};
    for (int i = 0; i < 6; ++i) {
        for (int k = 0; k < 6; ++k) a[i][k] = columns[i][k];
        a[i][6 + i] = 1.0;
    }
    for (int c = 0; c < 6; ++c) {
        int best = c;
        for (int r = c + 1; r < 6; ++r)
            if (abs(a[r][c]) > abs(a[best][c])) best = r;
        if (!(abs(a[best][c]) > 1e-9)) return false;
        std::swap(a[c], a[best]);
        const double per = 1.0 / a[c][c];
        for (double& x : a[c]) x *= per;
        for (int r = 0; r < 6; ++r) {
            if (r == c) continue;
            const double share = a[r][c];
            for (int k = 0; k < 12; ++k) a[r][k] -= share * a[c][k];
        }
    }
    for (int i = 0; i < 6; ++i)
        for (int k = 0; k < 6; ++k) inverse[i][k] = a[i][6 + k];
    return true;
}

/// Writes the posture of the nominal arm for a flange pose and theta_7 to `angle`; if there is none, that of
/// a pose nearby that has one.
inline void nominal_posture(const OffsetArm& arm, const Pose<double>& flange, const SinCos<double>& theta_7,
                            const OffsetBranch& branch, SinCos<double> (&angle)[joints]) noexcept {
    const OffsetMotion<> m = motion_of_flange(arm, flange, branch);
    OffsetWrist<double> wrist = offset_wrist(arm, m, theta_7);
    if (!(wrist.inside >= 0)) {  // axis 5 as square to axis 6 as it can be
        wrist.t = wrist.t < 0 ? -abs(wrist.g) : abs(wrist.g);
        wrist.inside = 0;
    }
    const Directions<double> d = directions(m, wrist, theta_7, sqrt(wrist.inside));
    for (int j = 0; j < joints; ++j) {
        const double length = hypot(d.y[j], d.x[j]);
        angle[j] = length > 0 ? SinCos<double>{d.y[j] / length, d.x[j] / length} : SinCos<double>{0.0, 1.0};
    }
    angle[6] = theta_7;
}

/// Rotates a joint by an angle (rad).
inline void turn_joint(double by, SinCos<double>& angle) noexcept {
    const SinCos<double> more = sin_cos(by);
    const double sine = angle.sin * more.cos + angle.cos * more.sin,
                 cosine = angle.cos * more.cos - angle.sin * more.sin, per = 1.0 / hypot(sine, cosine);
    angle = {sine * per, cosine * per};
}

/// Moves the posture `at`, the first guess, onto the flange pose by Newton's method, with joint `held` (0..6,
/// in the order of the formulas) fixed, whatever the limits. `at.left` is the error that remains: large if
/// the method fails.
inline void solve_on_pose(const OffsetChain& arm, const Pose<double>& flange, int held,
                          const OffsetChainTuning& tuning, ChainPosture& at) noexcept {
    double a[6][7], step[6], before = infinity;
    for (int pass = 0; pass <= tuning.steps; ++pass) {
        const Pose<double> now = six_equations(arm, flange, at.angle, held, a);
        at.left =
            norm(Vec3<double>{a[0][6], a[1][6], a[2][6]}) + norm(Vec3<double>{a[3][6], a[4][6], a[5][6]});
        if (!(trace_between(now.rotation, flange.rotation) > 1.0))
            at.left = infinity;  // farther it looks nearer
        const bool no_nearer = at.left <= tuning.residual && !(at.left < before);
        if (at.left <= tuning.settled || no_nearer || !(at.left < infinity)) return;
        before = at.left;
        if (pass == tuning.steps || !solve_six(a, step, tuning.least_pivot)) return;
        double longest = 0;
        for (const double part : step) longest = max(longest, abs(part));
        const double share = longest > tuning.largest_step ? tuning.largest_step / longest : 1.0;
        if (!(longest < infinity)) return;
        for (int i = 0; i < 6; ++i) turn_joint(share * step[i], at.angle[i < held ? i : i + 1]);
    }
}

/// The branch of a posture.
inline OffsetBranch branch_of(const OffsetChain& arm, const SinCos<double>* angle) noexcept {
    double theta[joints];
    for (int j = 0; j < joints; ++j) theta[j] = atan2(angle[j].sin, angle[j].cos);
    return offset_branch(arm.nominal, theta);
}

/// Whether a posture reaches the pose within the tolerance, in the branch. Where branches meet, and rounding
/// decides the sign, a posture is in both.
inline bool is_of(const OffsetChain& arm, const OffsetBranch& branch, const ChainPosture& at,
                  const OffsetChainTuning& tuning) noexcept {
    const SinCos<double>&delta = arm.nominal.rest.delta, &theta_4 = at.angle[3];
    const double bend = theta_4.sin * delta.cos - theta_4.cos * delta.sin, least = -tuning.residual;
    return at.left <= tuning.residual && at.angle[1].sin * branch.shoulder >= least &&
           bend * branch.elbow >= least && at.angle[4].cos * branch.wrist >= least;
}

/// The arm whose links are between the nominal ones (share 0) and the true ones (share 1).
inline OffsetChain grown(const OffsetChain& arm, double share) noexcept {
    OffsetChain out = arm;
    for (int k = 1; k < joints; ++k) {
        const Pose<double>&h = arm.nominal_row[k], &g = arm.row[k];
        Mat3<double> r = h.rotation;
        r.x = r.x + (g.rotation.x - r.x) * share;
        r.y = r.y + (g.rotation.y - r.y) * share;
        r.z = r.z + (g.rotation.z - r.z) * share;
        out.row[k] = {orthonormal(orthonormal(r)), h.position + (g.position - h.position) * share};
    }
    return out;
}

/// Finds the posture of a flange pose, theta_7 and branch by corrections and Newton's method from the nominal
/// posture; false if that fails.
inline bool find_at_once(const OffsetChain& arm, const Pose<double>& flange, const SinCos<double>& theta_7,
                         const OffsetBranch& branch, ChainPosture& out,
                         const OffsetChainTuning& tuning = {}) noexcept {
    Pose<double> wanted = flange;
    for (int pass = 0; pass < tuning.corrections; ++pass) {
        nominal_posture(arm.nominal, wanted, theta_7, branch, out.angle);
        wanted = corrected_pose(arm, flange, out.angle);
        wanted.rotation = orthonormal(wanted.rotation);
    }
    nominal_posture(arm.nominal, wanted, theta_7, branch, out.angle);
    solve_on_pose(arm, flange, 6, tuning, out);
    return is_of(arm, branch, out, tuning);
}

/// By how much (m) at least the wrist of a flange pose is beyond the reach, or inside the inner reach; <= 0
/// if that is not certain.
inline double certain_excess(const OffsetChain& arm, const Pose<double>& flange,
                             const SinCos<double>& theta_7) noexcept {
    const OffsetMotion<> m = motion_of_flange(arm.nominal, flange, configuration(0));
    return offset_wrist(arm.nominal, m, theta_7).excess - (arm.shift + abs(arm.nominal.a_6) * arm.turn);
}

/// Finds the posture by Newton's method from joints of a seed (q); false if it fails or is in another branch.
inline bool find_near_seed(const OffsetChain& arm, const Pose<double>& flange, const SinCos<double>& theta_7,
                           const OffsetBranch& branch, const double* seed, ChainPosture& out,
                           const OffsetChainTuning& tuning) noexcept {
    for (int j = 0; j < 6; ++j)
        out.angle[j] = sin_cos(to_theta(arm.nominal.rest, j, seed[robot_joint(arm, j)]));
    out.angle[6] = theta_7;
    solve_on_pose(arm, flange, 6, tuning, out);
    return is_of(arm, branch, out, tuning);
}

/// Finds the posture by all methods, first from the seed (q, or null): near where branches meet a branch may
/// hold several. Otherwise UNREACHABLE, which is certain, or NEAR_SINGULAR: no posture in the branch was
/// found.
inline Status find_posture(const OffsetChain& arm, const Pose<double>& flange, const SinCos<double>& theta_7,
                           const OffsetBranch& branch, const double* seed, ChainPosture& out,
                           const OffsetChainTuning& tuning = {}) noexcept {
    if (seed && find_near_seed(arm, flange, theta_7, branch, seed, out, tuning)) return Status::OK;
    if (find_at_once(arm, flange, theta_7, branch, out, tuning)) return Status::OK;
    if (certain_excess(arm, flange, theta_7) > 0) return Status::UNREACHABLE;
    nominal_posture(arm.nominal, flange, theta_7, branch, out.angle);
    for (int part = 1; part < tuning.parts; ++part)
        solve_on_pose(grown(arm, static_cast<double>(part) / tuning.parts), flange, 6, tuning, out);
    solve_on_pose(arm, flange, 6, tuning, out);
    return is_of(arm, branch, out, tuning) ? Status::OK : Status::NEAR_SINGULAR;
}

/// The directions of the robot's joints.
inline Directions<double> directions_of(const OffsetChain& arm, const ChainPosture& at) noexcept {
    Directions<double> out{};
    for (int j = 0; j < joints; ++j) {
        out.y[robot_joint(arm, j)] = at.angle[j].sin;
        out.x[robot_joint(arm, j)] = at.angle[j].cos;
    }
    out.x[7] = 1.0;
    return out;
}

}  // namespace detail

/// Writes the directions of the robot's joints at an exact pose, a value of the free joint (rad) and a branch
/// to d: of the solution that Newton's method finds from the joints of a seed (q, or null), or else of any.
/// If the status is not OK, d is no solution.
inline Status directions(const OffsetChain& arm, const Pose<double>& pose, double free, int gc,
                         const double* seed, Directions<double>& d) noexcept {
    const Pose<double> flange = flange_pose(arm, pose);
    const SinCos<double> theta_7 = sin_cos(to_theta(arm.nominal.rest, 6, free));
    detail::ChainPosture found;
    const Status status = detail::find_posture(arm, flange, theta_7, configuration(gc), seed, found);
    d = detail::directions_of(arm, found);
    return status;
}

/// The joint values of the true chain for a pose, a value of the free joint (rad) and a branch: of the
/// solution that Newton's method finds from the joints of the seed, or else of any, each in the revolution
/// within its limits nearest to the seed, or to the middle of its range without one. Otherwise they are NaN
/// and the status is UNREACHABLE, BAD_INPUT or NEAR_SINGULAR: no solution in the branch is found, near where
/// two branches meet.
inline Inverse inverse(const OffsetChain& arm, const Pose<double>& pose, double free, int gc,
                       const double* seed = nullptr) noexcept {
    constexpr double no = not_a_number;
    Inverse out{{no, no, no, no, no, no, no, 0.0}, Status::BAD_INPUT, no};
    if (gc < 0 || gc >= configurations || !(abs(free) <= tolerance::largest_angle)) return out;
    if (!is_rigid(pose) || (seed && !is_finite(seed))) return out;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const SinCos<double> theta_7 = sin_cos(to_theta(arm.nominal.rest, 6, free));
    detail::ChainPosture at;
    out.status = detail::find_posture(arm, flange_pose(arm, exact), theta_7, configuration(gc), seed, at);
    if (out.status != Status::OK) return out;
    const Joints found = joints_within_limits(arm.nominal.own, detail::directions_of(arm, at), seed);
    for (int j = 0; j < joints; ++j) out.q[j] = found.q[j];
    out.margin = limit_margin(arm.nominal.own.limits, out.q);
    return out;
}

}  // namespace armangle

#include "../../names/end.hpp"
