// What a search over postures takes: the joints at given ends, and the moves between configurations with
// their turns, eight at a time.
#pragma once

#include <algorithm>

#include "candidates.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A configuration with which a plan must begin or end.
struct Anchor {
    bool given = false;
    bool elsewhere = false;  // the requested joints are in another branch
    double phi = 0;
    std::uint32_t arc = 0;
    double q[joints] = {};
    double gap = 0;                   // rad: distance of q from the requested joints
    Status why = Status::OUTSIDE;     // the reason if it is not given
    Tag touching = 0;                 // the nearest pair then, if obstacles are the reason ...
    double shortfall = not_a_number;  // ... and by how much it is too near (m)
};

namespace detail {

/// The revolutions of up to eight phi, for vector operations.
struct EightWindings {
    double phi[8], q[joints][8] = {}, count[joints][8] = {}, first[8] = {};
    int used = 0;

    /// Begins with eight empty places.
    EightWindings() noexcept { std::fill(phi, phi + 8, not_a_number); }

    /// Stores the revolutions of the joints at one phi in the next of the eight places.
    void add(const Windings& group) noexcept {
        const int i = used++;
        phi[i] = group.phi;
        first[i] = group.first;
        for (int j = 0; j < joints; ++j) {
            q[j][i] = group.q[j];
            count[j][i] = group.count[j];
        }
    }
};

/// The joint moves from eight phi to a configuration: from which configuration, and how long (rad).
struct EightMoves {
    unsigned linked;  // bit i: neither phi nor a joint moves too far from phi i
    double from[8], travel[8];

    /// Computes the moves from the nearest revolutions; any other is more than pi away. turn: largest change
    /// of phi; move: largest move of a joint (rad).
    EightMoves(const Task& task, const Candidate& to, const EightWindings& groups, double turn,
               double move) noexcept {
        const Slots most = move, none = 0.0;
        const Slots apart = Slots(to.phi) - Slots::load(groups.phi);
        LaneMask<8> near = abs(apart - two_pi * round(apart * (1.0 / two_pi))) <= Slots(turn);
        linked = bits(near);
        if (!linked) return;
        Slots sum = 0.0, at = 0.0, stride = 1.0;
        for (int j = 0; j < joints; ++j) {
            const Slots moved = Slots(to.q[j]) - Slots::load(groups.q[j]),
                        count = Slots::load(groups.count[j]);
            const Slots turns = select(abs(moved) > most, round(moved * (1.0 / two_pi)), none);
            const Slots d = moved - two_pi * turns;
            near = near & (abs(d) <= most);
            if (!any(near)) break;
            if (!is_unlimited(task.limits, j)) {
                near = near & (turns >= none) & (turns < count);
                at = at + turns * stride;
            }
            stride = stride * count;
            sum = sum + d * d;
        }
        linked = bits(near);
        (Slots::load(groups.first) + at).store(from);
        sqrt(sum).store(travel);
    }
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
