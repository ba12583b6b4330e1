// The tolerances of the geometry, one reason each: no formula of arm/, circle/, limits/ or batch/ holds a
// literal of its own. How far a search or a proof looks is no tolerance: those numbers stand, named, beside
// their algorithm (namespaces ahead_rule, candidate_rule, link_rule, relax_rule, tube_rule, parameter_rule,
// turn_rule, plan_rule, proof).
#pragma once

#include "../names/begin.hpp"

namespace armangle::tolerance {

/// A direction whose terms are of size one is known to this, some units in the last place.
inline constexpr double rounding = 1e-15;
/// Angles closer than this are one angle: membership in arcs and limits, merging of pieces (rad).
inline constexpr double angle = 1e-9;
/// psi of one place, computed in two ways, differ by less than this: some units in the last place of pi
/// (rad).
inline constexpr double same_psi = 4e-15;
/// A hinge this near to 0 or pi makes one axis of the joints before and behind it: they share their turn as
/// they like, which moves the tool by less than this share of its distance (rad).
inline constexpr double one_axis = 1e-12;
/// A joint whose limits are this near to each other leaves arcs that may be shorter than `angle` (rad).
inline constexpr double locked = 1e-6;
/// A joint whose extreme over psi is this near to its limit may come to it at one psi alone: of the squares
/// of a boundary function's amplitude and offset (ratio).
inline constexpr double turning_back = 1e-10;
/// A psi that is feasible by itself leaves no joint further beyond its limit than this (rad).
inline constexpr double isolated = 1e-11;
/// The distance of the wrist from the shoulder may be off by this share of the arm's size at a limit of joint
/// 4: half of what a pose that is met may be off (ratio).
inline constexpr double elbow = 5e-14;
/// Wrist closer to the base axis than this share of the reach: the reference plane is the convention's
/// (ratio).
inline constexpr double reference = 1e-7;
/// Coefficients of a direction below this vanish on the whole circle: the posture is singular for every psi.
inline constexpr double singular = 1e-13;
/// A quantity this far from zero, relative to its terms, is zero: discriminants, cosines at +-1 (ratio).
inline constexpr double vanishing = 1e-12;
/// 1 - |cos| below which a hinge may come within `angle` of 0 or pi; that is 5e-19, the rest is rounding.
inline constexpr double touching = 1e-15;
/// Reach exceeded by less than this share of the arm's size, base and tool included, is rounding, not
/// distance (ratio).
inline constexpr double reach = 1e-13;
/// Within this share of the reach from its end, inside too, the arm is stretched (folded): a few ulp of a
/// rounded pose would otherwise bend the elbow by 1e-8 rad and turn theta_1 and theta_5 by anything (ratio).
inline constexpr double stretched = 4e-15;
/// Shoulder and wrist closer than this share of the reach coincide: no axis, no arm angle (ratio).
inline constexpr double folded = 1e-12;
/// Largest entry of |R^T R - I| that a rotation given by the user may have.
inline constexpr double rotation = 1e-6;
/// How far the length of a quaternion given by the user may be from 1: what six printed digits leave.
inline constexpr double unit = 1e-6;
/// Angles beyond this, 160 000 turns, are refused: taken to one turn they would lose the digits promised
/// (rad).
inline constexpr double largest_angle = 1e6;
/// What a bound on a step allows is drawn in by this, so that the inverse's rounding does not break the bound
/// (rad).
inline constexpr double bound = 1e-12;
/// A pose further away than this is refused: its last digit is 0.1 um, and squares of its distance soon
/// overflow (m).
inline constexpr double farthest = 1e9;
/// A length above this is not in metres (m).
inline constexpr double length = 1e3;

}  // namespace armangle::tolerance

#include "../names/end.hpp"
