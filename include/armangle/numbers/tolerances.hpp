// The tolerances of the geometry, each with its reason. Formulas in arm/, circle/, limits/ and batch/ hold no
// literal of their own. Search ranges and proof depths are not tolerances; each algorithm has its own in a
// struct whose name ends in Tuning.
#pragma once

#include "../names/begin.hpp"

namespace armangle::tolerance {

/// Error of a direction whose terms are of size one: some units in the last place.
inline constexpr double rounding = 1e-15;
/// Angles closer than this count as equal: membership in arcs and limits, merging of pieces (rad).
inline constexpr double angle = 1e-9;
/// Two computations of the psi of one place differ by less than this: some units in the last place of pi
/// (rad).
inline constexpr double same_psi = 4e-15;
/// If joint 2 or 6 is this near to 0 or pi, its neighbours rotate about one axis. Sharing their turn
/// differently moves the end effector by less than this share of its distance (rad).
inline constexpr double one_axis = 1e-12;
/// Joint limits closer together than this leave feasible arcs that may be shorter than `angle` (rad).
inline constexpr double locked = 1e-6;
/// If the extreme of a joint over psi is this near to its limit, the joint may reach the limit at a single
/// psi. Compares the squares of a boundary function's amplitude and offset (ratio).
inline constexpr double turning_back = 1e-10;
/// At an isolated feasible psi no joint violates its limit by more than this (rad).
inline constexpr double isolated = 1e-11;
/// At a limit of joint 4 the distance between shoulder and wrist may be off by this share of the arm's size.
/// This is half of the error that a solved pose may have (ratio).
inline constexpr double elbow = 5e-14;
/// If the wrist is closer to the base axis than this share of the reach, a convention defines the reference
/// plane (ratio).
inline constexpr double reference = 1e-7;
/// If the coefficients of a direction are below this, it vanishes: the arm is singular at every psi.
inline constexpr double singular = 1e-13;
/// A quantity this near to 0, relative to its terms, counts as 0: discriminants, cosines at +-1 (ratio).
inline constexpr double vanishing = 1e-12;
/// 1 - |cos| below which joint 2 or 6 may come within `angle` of 0 or pi: 5e-19; the rest is rounding.
inline constexpr double touching = 1e-15;
/// A distance beyond the reach by less than this share of the arm's size, base and tool included, is rounding
/// (ratio).
inline constexpr double reach = 1e-13;
/// Within this share of the reach from its end, also inside, the arm counts as stretched (folded). Otherwise
/// a few ulp of a pose bend the elbow by 1e-8 rad and turn theta_1 and theta_5 arbitrarily (ratio).
inline constexpr double stretched = 4e-15;
/// Shoulder and wrist closer than this share of the reach coincide: no axis, no arm angle (ratio).
inline constexpr double folded = 1e-12;
/// Largest entry of |R^T R - I| that a rotation from the user may have.
inline constexpr double rotation = 1e-6;
/// Largest deviation from 1 of the length of a quaternion from the user: the error of six printed digits.
inline constexpr double unit = 1e-6;
/// Larger angles, beyond 160 000 turns, are rejected: reducing them to one turn would lose the promised
/// digits (rad).
inline constexpr double largest_angle = 1e6;
/// The range that a step bound allows is narrowed by this, so the rounding of the inverse does not violate
/// the bound (rad).
inline constexpr double bound = 1e-12;
/// Poses farther away than this are rejected: their last digit is 0.1 um, and squares of the distance soon
/// overflow (m).
inline constexpr double farthest = 1e9;
/// A length above this is not in metres (m).
inline constexpr double length = 1e3;

}  // namespace armangle::tolerance

#include "../names/end.hpp"
