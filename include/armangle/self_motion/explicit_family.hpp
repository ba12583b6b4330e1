// Arms whose self-motion is a closed form: a pose, a branch and one free number give the joints, on any
// scalar.
//
//     pose, branch, lambda  --place-->  seven directions, and the room up to where the posture ceases
//
// Jet<double, K> in place of double gives derivatives, Jet<Interval, 1> gives proofs. What is written on this
// concept, curves, their proof and plans, is there for every such arm.
#pragma once

#include <concepts>

#include "../circle/inverse.hpp"
#include "../limits/arcs.hpp"
#include "prove_stretch.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A configuration given by its place on the self-motion of its pose: the free number and the branch.
struct OnSelfMotion {
    double lambda;  // rad
    int gc;
};

/// The members of a family:
///   arm()                           the arm itself, which functions of scenes and targets take
///   rows()                          the arm with signs, offsets and limits in the robot's order
///   on(q)                           the free number and the branch of joints q
///   place(pose, gc, lambda, near, d)  directions of a posture; returns the room, a share of the reach, that
///                                   is positive where there is one: 0 at a fold and at the end of the reach
///                                   of an explicit family. Of several postures, which an explicit family
///                                   does not have, it takes that near joints `near`, which may be null
///   arcs(pose, limits, asked, out)  the feasible arcs of the branches asked (bit k: GC k)
///   keep_margin(q, limits)          draws limits in to the joints that keep the arm's singularity margin, in
///                                   the branch and the revolutions of q
///   excess(pose)                    m that the pose is out of reach at least, whatever lambda; <= 0: it is
///                                   not
///   singular_distances(theta, take) take(distance) of the angles from where the self-motion is singular
template <class F>
concept planned_family =
    requires(const F& f, const double* q, const Pose<double>& pose, Directions<double>& d,
             const Limits& limits, Limits& drawn_in, ProvenArcs (&arcs)[configurations]) {
        f.arm();
        { f.rows() } -> std::same_as<const Arm&>;
        { f.on(q) } -> std::same_as<OnSelfMotion>;
        { f.place(pose, 0, 0.0, q, d) } -> std::same_as<double>;
        f.arcs(pose, limits, 0xffu, arcs);
        f.keep_margin(q, drawn_in);
        { f.excess(pose) } -> std::same_as<double>;
        f.singular_distances(q, [](double) {});
    };

/// A family whose place() is a closed form, on intervals too. Others have enclose() for them
/// (offset/chain/offset_chain_family.hpp).
template <class F>
concept explicit_family =
    planned_family<F> && requires(const F& f, const Pose<Jet<Interval, 1>>& cell,
                                  const Jet<Interval, 1>& lambda, Directions<Jet<Interval, 1>>& d) {
        { f.place(cell, 0, lambda, nullptr, d) } -> std::same_as<Jet<Interval, 1>>;
    };

/// A function place(free, near, out) that writes the directions of a posture at this pose, near joints `near`
/// (may be null), for a free number with or without derivatives, to `out` and returns the room as a number.
/// Keeps a reference to the family.
template <planned_family F>
auto placer(const F& family, const Pose<double>& pose, int gc) noexcept {
    return [&family, pose, gc]<class T>(const T& free, const double* near,
                                        Directions<T>& out) noexcept -> double {
        const T room = family.place(spread<T>(pose), gc, free, near, out);
        if constexpr (std::is_same_v<T, double>)
            return room;
        else
            return room.value();
    };
}
/// The value of joint j without any reference (rad): the middle of its range.
template <planned_family F>
double at_rest(const F& family, int j) noexcept {
    return family.rows().joint_middle[j];
}

}  // namespace armangle

#include "../names/end.hpp"
