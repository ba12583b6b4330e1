// What a step and a lookahead ask of an arm with one redundant joint, whatever its formulas: intervals of its
// free number within limits, and the joints at one value of it.
#pragma once

#include <concepts>
#include <span>

#include "../self_motion/explicit_family.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The members of a family, which is a view of one arm:
///   arm(), rows()                  the arm itself; its signs, offsets and limits in the robot's order
///   margin()                       rad kept around singularities
///   on(q, pose, carry)             the branch of joints q, and their free number carried to a pose
///   at(pose, gc, lambda, seed, d)  the directions of the joints at a value of the free number
///   arcs(pose, gc, limits, out)    the values at which all joints keep these limits
///   meetings()                     where branches meet that differ in bit 0, 1 or 2 of their index
///   hinges()                       joints whose neighbours turn about one axis where their angle is 0 or pi
///   towards(pose, gc, towards)     the value that serves a target of the elbow best; NaN if all are equal
///   turned_by(roll)                what the number grows by in the same postures where a pose with a free
///                                  roll is turned by `roll` about its own z axis
///   nearest(pose, options, scene)  the solution nearest to given joints
/// Poses are exact: their rotations are.
template <class F>
concept stepping_family =
    requires(const F& f, const double* q, const Pose<double>& pose, const Limits& limits, const Scene* scene,
             const NearestOptions& options, Directions<double>& d, ProvenArcs& arcs) {
        f.arm();
        { f.rows() } -> std::same_as<const Arm&>;
        { f.margin() } -> std::same_as<double>;
        { f.on(q, pose, Carry::psi) } -> std::same_as<OnSelfMotion>;
        { f.at(pose, 0, 0.0, q, d) } -> std::same_as<Status>;
        f.arcs(pose, 0, limits, arcs);
        { f.meetings() } -> std::same_as<BranchMeetings>;
        { f.hinges() } -> std::convertible_to<std::span<const int>>;
        { f.towards(pose, 0, Towards{}) } -> std::same_as<double>;
        { f.turned_by(0.0) } -> std::same_as<double>;
        { f.nearest(pose, options, scene) } -> std::same_as<Nearest>;
    };

}  // namespace armangle

#include "../names/end.hpp"
