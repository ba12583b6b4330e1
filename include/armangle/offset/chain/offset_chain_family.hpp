// An arm on its own chain with an offset nominal arm as a family of self-motions (explicit_family.hpp): its
// directions have no closed form, but values, Taylor coefficients, and enclosures along a path.
//
//     double            Newton's method on the true chain (inverse.hpp)
//     Jet<double, K>    one coefficient after the other from the same six equations
//     a piece of s      a tube about the Taylor polynomial, proven to hold one posture for each s, which at
//     the
//                       ends is the one that Newton's method finds (chain/joint_tube.hpp)
//
// The neighbouring tubes hold the same posture at their common end, and each no other: together they are one
// motion.
#pragma once

#include "../../chain/joint_tube.hpp"
#include "../../self_motion/explicit_family.hpp"
#include "../offset_family.hpp"
#include "feasible.hpp"

#include "../../names/begin.hpp"

namespace armangle {

namespace detail {

/// The seven equations of an own chain with a free joint, whose sine and cosine are `wanted`, in the robot's
/// order: the position of the tip, its rotation and the free joint. The columns are exact derivatives at
/// every posture.
template <class T>
SevenEquations<T> free_joint_equations(const OffsetChain& arm, const Pose<T>& pose, const SinCos<T>& wanted,
                                       const SinCos<T>* angle) noexcept {
    Pose<T> frame[joints + 1];
    frame[0] = spread<T>(arm.link[0]);
    for (int k = 0; k < joints; ++k)
        frame[k + 1] = turned_about_z(frame[k], angle[k]) * spread<T>(arm.link[k + 1]);
    const Pose<T>& now = frame[joints];
    const Mat3<T>&a = now.rotation, &b = pose.rotation;
    const T per_reach(1.0 / arm.nominal.rest.reach), half(0.5), trace = trace_between(a, b);
    const int held = robot_joint(arm, 6);
    SevenEquations<T> out;
    out.left.wrist = (pose.position - now.position) * per_reach;
    out.left.turn = (cross(a.x, b.x) + cross(a.y, b.y) + cross(a.z, b.z)) * half;
    out.left.psi = wanted.sin * angle[held].cos - wanted.cos * angle[held].sin;
    for (int k = 0; k < joints; ++k) {
        const Vec3<T>& axis = frame[k].rotation.z;
        out.column[k].wrist = cross(axis, now.position - frame[k].position) * per_reach;
        out.column[k].turn = turn_slope(a, b, trace, axis);
        out.column[k].psi = k == held ? wanted.cos * angle[k].cos + wanted.sin * angle[k].sin : T(0.0);
    }
    return out;
}

}  // namespace detail

/// Adapts an arm on its own chain to the functions that need a family (self_motion/explicit_family.hpp, which
/// explains the members).
class OffsetChainFamily {
public:
    /// Keeps a pointer to the arm.
    explicit OffsetChainFamily(const OffsetChain& arm) noexcept : arm_(&arm) {}

    /// The arm.
    const OffsetChain& arm() const noexcept { return *arm_; }
    /// The arm without the offset, whose limits and rows of joints count.
    const Arm& rows() const noexcept { return nominal(*arm_); }

    /// The value of the free joint (rad) and the branch at joints q.
    OnSelfMotion on(const double* q) const noexcept {
        return {q[robot_joint(*arm_, 6)], forward(*arm_, q).gc};
    }

    /// Writes the directions of the joints at a value of the free joint (rad) to `out`: of the posture that
    /// Newton's method finds from joints `near` (or null), or else of any. Returns 1 if a posture is found,
    /// else -1: how far it is from where there is none is not known.
    double place(const Pose<double>& pose, int gc, double free, const double* near,
                 Directions<double>& out) const noexcept {
        detail::ChainPosture at;
        const bool found = posture(flange_pose(*arm_, pose), gc, free, near, at);
        out = detail::directions_of(*arm_, at);
        return found ? 1.0 : -1.0;
    }

    /// The same with Taylor coefficients.
    template <int K>
    Jet<double, K> place(const Pose<Jet<double, K>>& pose, int gc, const Jet<double, K>& free,
                         const double* near, Directions<Jet<double, K>>& out) const noexcept {
        using J = Jet<double, K>;
        const Pose<J> flange = flange_pose(*arm_, pose);
        const Pose<double> here = each_of<double>(flange, [](const J& x) { return x.value(); });
        detail::ChainPosture at;
        double back[6][6];
        if (!posture(here, gc, free.value(), near, at) || !inverse_at(here, at, back)) return J(-1.0);
        SinCos<J> angle[joints];
        for (int j = 0; j < 6; ++j) angle[j] = {J(at.angle[j].sin), J(at.angle[j].cos)};
        angle[6] = sin_cos(theta_7_of(free));
        for (int k = 1; k <= K; ++k) {  // the equations are linear in the coefficient that is not known yet
            J left[6][7], step[joints] = {};
            (void)detail::six_equations(*arm_, flange, angle, 6, left);
            for (int j = 0; j < 6; ++j)
                for (int i = 0; i < 6; ++i) step[j].coefficient[k] += back[j][i] * left[i][6].coefficient[k];
            detail::turn_by(step, angle);
        }
        put(angle, out);
        return J(1.0);
    }

    /// The same over a piece of a path: pose(s) and free(s) on any scalar, joints near(s). `out` bounds the
    /// joints; its derivatives bound their differences from the middle. Returns -1 if it is not proven that
    /// there is exactly one posture near those found at the middle and at both ends, and that it stays in the
    /// branch.
    template <class PoseAt, class FreeAt, class Near>
    Jet<Interval, 1> enclose(const PoseAt& pose, const FreeAt& free, const Near& near, int gc,
                             const Interval& s, Directions<Jet<Interval, 1>>& out) const noexcept {
        using J = Jet<double, 3>;
        const Jet<Interval, 1> none(Interval(-1.0));
        const auto equations = [&]<class T>(const T& at, const SinCos<T>* angle) noexcept {
            return detail::free_joint_equations(*arm_, pose(at), sin_cos(theta_7_of(free(at))), angle);
        };
        const double middle = 0.5 * (s.lo + s.hi);
        const J at = J::variable(middle);
        Directions<J> d;
        J series[joints];
        SinCos<double> angle[joints];
        detail::InverseSlope<double> back;
        detail::JointTube tube;
        if (!(place(pose(at), gc, free(at), near(middle).q, d).value() > 0)) return none;
        for (int j = 0; j < joints; ++j) {
            series[j] = atan2(d.y[j], d.x[j]);
            angle[j] = sin_cos(series[j].value());
        }
        if (!detail::eliminate(equations(middle, angle), back)) return none;
        if (!detail::enclose_joints(equations, series, back, s.lo, s.hi, tube)) return none;
        for (const double end : {s.lo, s.hi}) {
            Directions<double> e;
            if (!(place(pose(end), gc, free(end), near(end).q, e) > 0)) return none;
            for (int j = 0; j < joints; ++j) {
                const Interval off =
                    tube.range(j, Interval(end - middle), 0.0) - Interval(atan2(e.y[j], e.x[j]));
                if (!(abs(wrap(off.middle())) + off.hi - off.lo < tube.radius[j])) return none;
            }
        }
        const Interval way(-tube.half, tube.half);
        SinCos<Interval> within[joints];
        for (int j = 0; j < joints; ++j) {
            const double* c = tube.theta[j];
            within[j] = sin_cos(tube.range(j, way, tube.within[j]));
            const double rest =
                tube.half * (abs(c[2]) + tube.half * abs(c[3])) + 2.0 * tube.within[j] / tube.half;
            const Interval slope = Interval(c[1]) + Interval(-rest, rest);
            out.y[j] = within[j].sin;
            out.x[j] = within[j].cos;
            out.y[j].coefficient[1] = within[j].cos * slope;
            out.x[j].coefficient[1] = -(within[j].sin * slope);
        }
        return stays(configuration(gc), within) ? Jet<Interval, 1>(Interval(1.0)) : none;
    }

    /// Computes the proven arcs of the branches in `asked` (bits), or why a branch has none, in `out`.
    void arcs(const Pose<double>& pose, const Limits& limits, unsigned asked,
              ProvenArcs (&out)[configurations]) const noexcept {
        for (int gc = 0; gc < configurations; ++gc)
            if (asked >> gc & 1u) feasible(*arm_, pose, gc, limits, out[gc]);
    }

    /// Leaves limits as they are: an arm on its own chain with an offset has no singularity margin.
    void keep_margin(const double*, Limits&) const noexcept {}

    /// By how much (m) a pose is out of reach at least; <= 0 if it may be in reach.
    double excess(const Pose<double>& pose) const noexcept {
        const OffsetArm& formulas = arm_->nominal;
        const Pose<double> flange = flange_pose(*arm_, pose);
        const Pose<double> asked =
            user_pose(formulas.own, formulas.mirrored ? mirrored_pose(flange) : flange);
        return OffsetFamily(formulas).excess(asked) - (arm_->shift + abs(formulas.a_6) * arm_->turn);
    }

    /// As OffsetFamily::singular_distances() for the nominal arm; theta: angles of the robot's joints.
    template <class T, class Take>
    void singular_distances(const T* theta, const Take& take) const noexcept {
        OffsetFamily(arm_->nominal).singular_distances(theta, take);
    }

private:
    /// theta_7 of the formulas at a value of the free joint (rad).
    template <class T>
    T theta_7_of(const T& free) const noexcept {
        const Arm& rest = arm_->nominal.rest;
        return T(rest.sign[6]) * free + T(rest.offset[6]);
    }
    /// Whether the signs of theta_2, theta_4 - delta and cos theta_5 of the formulas are those of a branch.
    bool stays(const OffsetBranch& branch, const SinCos<Interval>* within) const noexcept {
        const Arm& rest = arm_->nominal.rest;
        const auto of = [&](int j) noexcept { return within[robot_joint(*arm_, j)]; };
        const Interval bend = of(3).sin * Interval(rest.delta.cos) - of(3).cos * Interval(rest.delta.sin);
        return (of(1).sin * Interval(branch.shoulder)).lo > 0 && (bend * Interval(branch.elbow)).lo > 0 &&
               (of(4).cos * Interval(branch.wrist)).lo > 0;
    }
    /// Finds the posture of a flange pose at a value of the free joint (rad), if there are several that near
    /// joints `near` (or null); false if it finds none.
    bool posture(const Pose<double>& flange, int gc, double free, const double* near,
                 detail::ChainPosture& out) const noexcept {
        return detail::find_posture(*arm_, flange, sin_cos(theta_7_of(free)), configuration(gc), near, out) ==
               Status::OK;
    }
    /// Writes the inverse of the six equations' Jacobian at a posture to `out`; false if it is singular.
    bool inverse_at(const Pose<double>& flange, const detail::ChainPosture& at,
                    double (&out)[6][6]) const noexcept {
        double columns[6][7];
        (void)detail::six_equations(*arm_, flange, at.angle, 6, columns);
        return detail::invert_six(columns, out);
    }
    /// Writes angles of the formulas as directions of the robot's joints.
    template <class T>
    void put(const SinCos<T>* angle, Directions<T>& out) const noexcept {
        for (int j = 0; j < joints; ++j) {
            out.y[robot_joint(*arm_, j)] = angle[j].sin;
            out.x[robot_joint(*arm_, j)] = angle[j].cos;
        }
    }
    /// The pose with part(x) in the place of each number x.
    template <class To, class T, class Part>
    static Pose<To> each_of(const Pose<T>& p, const Part& part) noexcept {
        const auto of = [&part](const Vec3<T>& v) { return Vec3<To>{part(v.x), part(v.y), part(v.z)}; };
        return {{of(p.rotation.x), of(p.rotation.y), of(p.rotation.z)}, of(p.position)};
    }

    const OffsetChain* arm_;
};

static_assert(planned_family<OffsetChainFamily>);

}  // namespace armangle

#include "../../names/end.hpp"
