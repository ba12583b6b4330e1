// Cells of the free joint as ways of all joints, along which scenes are asked: straight, within a box.
#pragma once

#include "../scene/clear_cells.hpp"
#include "cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Bounds all joints, in the robot's order, over a cell of half width `half` (rad) by straight lines plus
/// errors. If the slope of a joint gives no good bound, as near a fold, its whole range is the error. False
/// if a joint has no bound.
inline bool straight_cell(const OffsetArm& arm, const OffsetCells::Over& over, double half,
                          StraightCell& out) noexcept {
    for (int j = 0; j < joints; ++j) {
        const JointOver& joint = over.joint[j];
        if (!joint.off.bounded()) return false;
        const StraightJoint way = straight_joint(joint, half, over.exists == Known::inside);
        const double sign = arm.rest.sign[j];
        const int to = robot_joint(arm, j);
        out.q[to] = to_q(way.middle, sign, arm.rest.offset[j]);
        out.d[to] = sign * way.along;
        out.off[to] = way.beside;
    }
    return true;
}

/// Bounds the joints over cells for one pose and branch.
template <class AnyArm, class FreeCells>
class StraightCells {
public:
    static constexpr double widest = 0.05;  // rad: half width

    /// Keeps a pose in branch gc.
    StraightCells(const AnyArm& arm, const Pose<double>& pose, int gc) noexcept
        : arm_(nominal_offset(arm)), cells_(arm, pose, gc) {}

    /// Writes bounds of the joints over the cell [middle - half, middle + half] of the free joint (rad) to
    /// `out`; false if there is no solution, or no bound.
    bool over(double middle, double half, StraightCell& out) const noexcept {
        typename FreeCells::Begun begun;
        typename FreeCells::Over over;
        cells_.begin(middle, half, begun, over);
        if (over.exists == Known::outside) return false;
        cells_.finish(begun, over);
        return straight_cell(arm_, over, half, out);
    }

private:
    const OffsetArm& arm_;
    const FreeCells cells_;
};

}  // namespace detail

/// Registers the bounds for an arm with an offset: the closed form on intervals.
template <>
struct CellsOf<OffsetArm> {
    using type = detail::StraightCells<OffsetArm, detail::OffsetCells>;
};

}  // namespace armangle

#include "../names/end.hpp"
