// Feasible intervals of the free joint of an arm on its own chain: stretches proven to keep the limits, or to
// hold no posture of the branch that does.
//
// Both verdicts are of every posture of the branch. What is proven neither way, near where branches meet, is
// left out and counted.
#pragma once

#include "../feasible.hpp"
#include "chain_cells.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// How the feasible intervals are found.
struct OffsetChainArcsTuning {
    /// Cells of the circle to begin with.
    int cells = 24;
    /// Cells of a branch that are looked at before the rest is left out.
    int looks = 2000;
    /// Half width (rad) of a cell that is left out.
    double narrowest = 1e-3;
};

namespace detail {

/// A queue of cells of the free joint that are not decided yet; each half goes to its end, so the widest come
/// first.
struct ChainCellQueue {
    struct Cell {
        double lower, upper;

        double middle() const noexcept { return 0.5 * (lower + upper); }
        double half() const noexcept { return 0.5 * (upper - lower); }
    };
    static constexpr int capacity = 4096;
    int first = 0, last = 0;
    Cell cell[capacity];

    /// Begins with `cells` equal cells of the circle.
    explicit ChainCellQueue(int cells) noexcept {
        for (int k = 0; k < cells; ++k)
            cell[last++] = {-pi + two_pi * k / cells, -pi + two_pi * (k + 1) / cells};
    }
    /// Whether two more cells would not fit.
    bool full() const noexcept { return last + 2 > capacity; }
    /// Adds both halves of a cell.
    void halve(const Cell& one) noexcept {
        cell[last++] = {one.lower, one.middle()};
        cell[last++] = {one.middle(), one.upper};
    }
};

/// Whether branch gc is proven to have a posture at some value of the free joint, whatever the limits.
inline bool has_posture(const OffsetChain& arm, const Pose<double>& exact, int gc,
                        const OffsetChainArcsTuning& tuning) noexcept {
    Limits none;
    for (int j = 0; j < joints; ++j) {
        none.lower[j] = -infinity;
        none.upper[j] = infinity;
    }
    const ThetaRanges ranges(arm.nominal.rest, none, 0.0, configuration(gc));
    CellJudge<ChainCells> judge(arm, exact, gc, ranges);
    ChainCellQueue queue(tuning.cells);
    while (queue.first < queue.last && judge.looks() < tuning.looks && !queue.full()) {
        const auto cell = queue.cell[queue.first++];
        ChainCells::Over over;
        Piece piece;
        const Known known = judge.look(cell.lower, cell.upper, over, piece);
        if (known == Known::inside) return true;
        if (known == Known::open && cell.half() > judge.cells.narrowest(over, tuning.narrowest))
            queue.halve(cell);
    }
    return false;
}

}  // namespace detail

/// Writes the values of the free joint at which branch gc reaches a pose within limits (in the robot's order
/// of joints) to `out`, or the reason why there are none: NEAR_SINGULAR if some values are not decided. The
/// tags name joints of the formulas (see in_robot_order).
inline void feasible(const OffsetChain& arm, const Pose<double>& pose, int gc, const Limits& limits,
                     ProvenArcs& out, const OffsetChainArcsTuning& tuning = {}) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    Limits in_order = limits;
    for (int j = 0; j < joints; ++j) {
        in_order.lower[j] = limits.lower[robot_joint(arm, j)];
        in_order.upper[j] = limits.upper[robot_joint(arm, j)];
    }
    const ThetaRanges ranges(arm.nominal.rest, in_order, 0.0, configuration(gc));
    detail::CellJudge<detail::ChainCells> judge(arm, exact, gc, ranges);
    detail::ChainCellQueue queue(tuning.cells);
    detail::Pieces kept, open;
    make_empty(out.arcs);
    make_empty(out.open);
    out.unproven = 0;
    while (queue.first < queue.last) {
        const auto cell = queue.cell[queue.first++];
        detail::ChainCells::Over over;
        detail::Piece piece;
        const bool spent = judge.looks() >= tuning.looks || queue.full();
        const Known known = spent ? Known::open : judge.look(cell.lower, cell.upper, over, piece);
        if (known == Known::inside) kept.add(piece);
        if (known != Known::open) continue;
        if (!spent && cell.half() > judge.cells.narrowest(over, tuning.narrowest)) {
            queue.halve(cell);
            continue;
        }
        out.unproven += cell.upper - cell.lower;
        open.add({cell.lower, cell.upper, 0, 0});
    }
    double beyond = 0;
    kept.finish(out.arcs, out.unproven);
    open.finish(out.open, beyond);
    if (beyond > 0) make_full(out.open);
    out.status = Status::OK;
    if (!out.arcs.empty()) return;
    out.status = out.unproven > 0 ? Status::NEAR_SINGULAR : judge.refusal();
    // a cell that a limit excludes is not asked for its posture
    if (out.status == Status::NO_POSTURE && detail::has_posture(arm, exact, gc, tuning))
        out.status = Status::LIMITS;
}

/// Writes the values of the free joint at which branch gc reaches a pose within the arm's own limits to
/// `out`.
inline void feasible(const OffsetChain& arm, const Pose<double>& pose, int gc, ProvenArcs& out) noexcept {
    feasible(arm, pose, gc, arm.nominal.own.limits, out);
}

/// Writes the values of the free joint at which each branch reaches a pose within limits to `out`, as
/// feasible() does.
inline void feasible_all(const OffsetChain& arm, const Pose<double>& pose, const Limits& limits,
                         ProvenArcs (&out)[configurations],
                         const OffsetChainArcsTuning& tuning = {}) noexcept {
    for (int gc = 0; gc < configurations; ++gc) feasible(arm, pose, gc, limits, out[gc], tuning);
}

/// The same arcs with the robot's joint numbers in the tags of their ends.
inline ArcSet in_robot_order(const OffsetChain& arm, const ArcSet& arcs) noexcept {
    return in_robot_order(arm.nominal, arcs);
}

/// The joint value (rad) that ends an arc: the limit of the robot's joint in the tag; NaN if the tag names no
/// joint.
inline double end_value(const OffsetChain& arm, const Pose<double>&, int, Tag tag, double) noexcept {
    const int joint = tag_joint(tag) - 1;
    if (joint < 0) return not_a_number;
    const Limits& limits = arm.nominal.own.limits;
    return tag_side(tag) == Side::lower ? limits.lower[joint] : limits.upper[joint];
}

}  // namespace armangle

#include "../../names/end.hpp"
