// Feasible arcs of all eight branches of a pose at once, sharing what the branches share.
//
// Joints 1-3 depend on GC_4 and GC_2 alone, joints 5-7 on GC_4 and GC_6: twice two blocked lists a side make eight sets.
#pragma once

#include "feasible.hpp"

namespace armangle {

/// The sets of GC 0..7, and why an empty one is empty.
struct AllArcs {
    ArcSet arcs[configurations];
    Status status[configurations];
};

namespace detail {

inline void append(const Blocked& from, Blocked& to) noexcept {
    to.all |= from.all;
    for (int i = 0; i < from.count; ++i) to.add(from.arc[i]);
}

/// What the joints on either side of the elbow block, for one sign of theta_2 and theta_6.
struct Sides {
    JointFunctions<double> f;
    Blocked shoulder, wrist;
};

inline void block_sides(const LimitTable& t, const Circle<double>& c, const Fold<double>& bend, double sign, Sides& out) noexcept {
    out.f = joint_functions(c, bend, Configuration<double>{sign, 1.0, sign});
    Boundaries b;
    boundaries(t, out.f, b);
    for (int half = 0; half < hinges; ++half) {
        Blocked& side = half == 0 ? out.shoulder : out.wrist;
        block_hinge(t, out.f, b, half, side);
        block_pivots(t, out.f, b, half == 0 ? shoulder_pivots : wrist_pivots, side);
    }
}

}  // namespace detail

/// Psi_all of the eight branches of one circle; the same sets as feasible() gives one by one.
inline void feasible_all(const Arm& arm, const LimitTable& t, const Circle<double>& c, AllArcs& out) noexcept {
    for (int elbow = 0; elbow < 2; ++elbow) {
        const Fold<double> bend = fold(arm, c.triangle, elbow ? -1.0 : 1.0);
        const Status status = elbow_status(arm, t, c, bend);
        detail::Sides sides[2];
        if (status == Status::OK)
            for (int negative = 0; negative < 2; ++negative) detail::block_sides(t, c, bend, negative ? -1.0 : 1.0, sides[negative]);
        for (int branch = 0; branch < 4; ++branch) {
            const int shoulder = branch & 1, wrist = branch >> 1, gc = shoulder + 2 * elbow + 4 * wrist;
            make_empty(out.arcs[gc]);
            out.status[gc] = status;
            if (status != Status::OK) continue;
            Blocked both = sides[shoulder].shoulder;
            detail::append(sides[wrist].wrist, both);
            out.status[gc] = detail::finish(t, sides[shoulder].f, sides[wrist].f, both, out.arcs[gc]);
        }
    }
}

}  // namespace armangle
