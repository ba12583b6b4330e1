// Redundancy resolution: the next arm angle, from the present one and the feasible arcs. Eq. (36).
//
// A policy is a rule on one arc: it moves psi within [lower, upper]. The behaviour outside every arc is
// common to all.
#pragma once

#include "../circle/towards.hpp"
#include "../limits/arcs.hpp"
#include "../status.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The rule that chooses the next psi on its arc.
enum class Rule : std::uint8_t { repulsion, hold, centre, towards };
/// What to do with psi outside every arc: move to the nearer end in one step; stop; or, in a scene, leave the
/// collision in several steps.
enum class Outside : std::uint8_t { nearest, stop, escape };

/// K in [0, 1] per step; alpha > 0, of eq. (36); a target for Rule::towards.
struct Policy {
    Rule rule = Rule::repulsion;
    double K = 0.1;
    double alpha = 20.0;
    Outside outside = Outside::nearest;
    Towards towards{};
};

/// The policy for one self-motion: a point or direction for the elbow becomes a target psi, NaN if all psi
/// are equally good.
inline Policy resolved_policy(Policy policy, const Arm& arm, const SelfMotion<double>& m) noexcept {
    if (policy.rule == Rule::towards)
        policy.towards = {Wish::psi, psi_towards(arm, m, policy.towards).psi, {}};
    return policy;
}

/// The gain per step of a rate (1/s) over dt (s): 1 - exp(-rate dt), so that the motion does not depend on
/// the step length.
inline double gain(double rate, double dt) noexcept { return -std::expm1(-rate * dt); }

namespace detail {

/// The psi after a step of eq. (36): both ends of the arc repel, and the middle is at rest.
inline double repelled(const Policy& p, const Arc& arc, double psi) noexcept {
    const double width = arc.upper - arc.lower, share = (psi - arc.lower) / width;
    if (!(width > 0)) return psi;
    return psi + p.K * 0.5 * width * (std::exp(-p.alpha * share) - std::exp(-p.alpha * (1.0 - share)));
}

/// Moves psi towards the place of the arc nearest to the target psi, by the share K of the distance;
/// unchanged if that target is NaN. For a target outside the arc that place is the end on its side of the
/// middle.
inline double drawn(const Policy& p, const Arc& arc, double psi) noexcept {
    if (is_nan(p.towards.psi)) return psi;
    const double wish = lift(p.towards.psi, 0.5 * (arc.lower + arc.upper));
    const double goal = min(max(wish, arc.lower), arc.upper);
    return goal + (1.0 - p.K) * (psi - goal);
}

/// The psi after one step of the policy's rule within an arc.
inline double moved(const Policy& p, const Arc& arc, double psi) noexcept {
    switch (p.rule) {
        case Rule::repulsion: return repelled(p, arc, psi);
        case Rule::centre: return psi + p.K * (0.5 * (arc.lower + arc.upper) - psi);
        case Rule::towards: return drawn(p, arc, psi);
        case Rule::hold: return psi;
    }
    return psi;
}

}  // namespace detail

/// The next psi, or the reason for none.
struct Resolution {
    double psi;  // in (-pi, pi]
    Status status;
};

/// Computes the next psi by the policy. On the full circle only a target moves it, by the shorter way.
/// Outside every arc it moves to the nearest end, or with Outside::stop stays, OUTSIDE; LIMITS if there is no
/// arc. The target of the policy must be a psi (see resolved_policy).
inline Resolution resolve(const Policy& policy, const ArcSet& arcs, double psi) noexcept {
    if (arcs.empty()) return {wrap(psi), Status::LIMITS};
    if (arcs.full) {
        const double here = wrap(psi);
        if (policy.rule != Rule::towards) return {here, Status::OK};
        return {wrap(detail::drawn(policy, {here - pi, here + pi, 0, 0}, here)), Status::OK};
    }
    const Place place = find(arcs, psi);
    if (place.index < 0) {
        if (policy.outside == Outside::stop) return {wrap(psi), Status::OUTSIDE};
        return {nearest(arcs, psi), Status::OK};
    }
    const Arc& arc = arcs.arc[place.index];
    return {wrap(min(max(detail::moved(policy, arc, place.psi), arc.lower), arc.upper)), Status::OK};
}

/// Moves psi to the nearest end if it is outside the arcs, then applies the policy.
inline Resolution resolve_from_nearest_end(Policy policy, const ArcSet& arcs, double psi) noexcept {
    policy.outside = Outside::nearest;
    return resolve(policy, arcs, find(arcs, psi).index < 0 ? nearest(arcs, psi) : psi);
}

/// Computes the next psi, with the policy applied to the part of psi's arc that also lies in `kept`, unless
/// that part is empty.
inline Resolution resolve(const Policy& policy, const ArcSet& arcs, const ArcSet& kept, double psi) noexcept {
    const Place place = find(arcs, psi);
    if (place.index < 0) return resolve(policy, arcs, psi);
    ArcSet here, both;
    make_empty(here);
    here.arc[here.count++] = arcs.arc[place.index];
    here.full = arcs.full;
    intersect(here, kept, both);
    return both.empty() ? resolve(policy, arcs, psi) : resolve_from_nearest_end(policy, both, psi);
}

}  // namespace armangle

#include "../names/end.hpp"
