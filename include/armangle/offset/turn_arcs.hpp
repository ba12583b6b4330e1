// All turns of the base, and all rolls of the tool, at which an arm with an
// offset can hold a pose.
//
// A pose turned by alpha about axis 1 or 7 has the same solutions with alpha
// added to that joint alone (limits/turn_arcs.hpp). So an arc of the free joint
// that all other joints leave holds the turns
//
//     alpha in [lower - max theta, upper - min theta],
//
// extremes over the arc of the lifted angle of that joint. The free joint's are
// at the ends of the arc; the other end's are found by cells on which it rises
// or falls.
#pragma once

#include "../limits/turn_arcs.hpp"
#include "freedom.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Parameters of OffsetTurns.
struct OffsetTurnTuning {
    int cells = 24;            // of the circle, to begin with
    int looks = 4000;          // cells looked at on one arc
    double narrowest = 1e-9;   // rad: half width of a cell that is not halved again
    double continuous = 1e-3;  // rad: what an angle may move over such a cell; by more it jumps
};

/// Computes the rotations of one pose around axis 1 or 7 at which it is reachable.
class OffsetTurns {
public:
    /// Keeps a pose with an exact rotation; the joint that turns is the one at the tool or the base.
    OffsetTurns(const OffsetArm& arm, const Pose<double>& exact, Turned turned,
                const OffsetTurnTuning& tuning) noexcept
        : arm_(arm),
          pose_(exact),
          tuning_(tuning),
          joint_((turned == Turned::tool) != arm.mirrored ? joints - 1 : 0),
          range_(theta_range(arm.rest, arm.rest.limits, joint_)) {}

    /// Computes the rotations, or the reason if there are none.
    Status find(ArcSet& out) noexcept {
        Limits others = arm_.own.limits;
        const int own = robot_joint(arm_, joint_);
        others.lower[own] = -infinity;
        others.upper[own] = infinity;
        ProvenArcs found[configurations];
        feasible_all(arm_, pose_, others, found);
        return find(found, out);
    }

    /// Writes the rotations (rad) at which the pose has a solution to `out`, given the arcs `found` that all
    /// joints but the turned one permit; the reason if there are none.
    Status find(const ProvenArcs (&found)[configurations], ArcSet& out) noexcept {
        Status why = Status::UNREACHABLE;
        unsigned open = 0;
        for (int gc = 0; gc < configurations; ++gc) {
            why = nearer_reason(why, found[gc].status);
            open |= found[gc].unproven > 0 ? 1u << gc : 0u;
            const OffsetCells cells(arm_, pose_, gc);
            for (int i = 0; i < found[gc].arcs.count && !turns_.full(); ++i)
                add_arc(cells, found[gc].arcs.arc[i]);
        }
        turns_.finish(out);
        if (open != 0 && !contains(out, 0.0)) [[unlikely]] {
            add_hidden(arm_, open);
            if (out.empty()) add_hidden_elsewhere(open);
            turns_.finish(out);
        }
        return out.empty() ? why : Status::OK;
    }

private:
    struct Cell {
        double lower, upper;
    };

    /// Adds the rotation of a solution that a search finds in some branches (bits), if it finds one within
    /// the limits of `arm`.
    [[gnu::noinline, gnu::cold]] void add_hidden(const OffsetArm& arm, unsigned branches) noexcept {
        const Nearest found = find_any(arm, pose_, branches);
        if (!is_solved(found.status)) return;
        const double theta = to_theta(arm.rest, joint_, found.q[robot_joint(arm, joint_)]);
        add(theta, theta);
    }

    /// Adds the rotation of a solution that a search finds in some branches (bits) if the turned joint may
    /// have any value.
    [[gnu::noinline, gnu::cold]] void add_hidden_elsewhere(unsigned branches) noexcept {
        ArmParameters p = arm_.own;
        p.limits.lower[robot_joint(arm_, joint_)] = -infinity;
        p.limits.upper[robot_joint(arm_, joint_)] = infinity;
        add_hidden(remade(arm_, p), branches);
    }

    /// Adds the rotations at which the joint is within its limits, if its angle lies between least and most.
    void add(double least, double most) noexcept {
        if (!(range_.upper - range_.lower < two_pi)) return turns_.add_full();
        const int own = robot_joint(arm_, joint_) + 1;
        turns_.add({range_.lower - most, range_.upper - least,
                    make_tag(own, limit_side(arm_.rest, joint_, true)),
                    make_tag(own, limit_side(arm_.rest, joint_, false))});
    }

    /// Theta (rad) of the turned joint at a value of the free joint (rad) with a solution.
    double theta_at(const OffsetCells& cells, double free) const noexcept {
        double theta[joint_slots];
        cells.at(free, theta);
        return theta[joint_];
    }

    /// Adds the angles of the turned joint along an arc of the free joint.
    void add_arc(const OffsetCells& cells, const Arc& arc) noexcept {
        if (joint_ == joints - 1) {
            const double a = to_theta(arm_.rest, joint_, arc.lower),
                         b = to_theta(arm_.rest, joint_, arc.upper);
            return add(min(a, b), max(a, b));
        }
        Cell stack[most_cells];
        const int parts = 1 + static_cast<int>((arc.upper - arc.lower) / (two_pi / tuning_.cells));
        const double width = (arc.upper - arc.lower) / parts;
        int top = 0, looks = 0;
        for (int k = parts; k-- > 0;)
            stack[top++] = {arc.lower + k * width, k + 1 < parts ? arc.lower + (k + 1) * width : arc.upper};
        double before = theta_at(cells, arc.lower), now = before, least = now, most = now;
        while (top > 0) {
            const Cell cell = stack[--top];
            const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
            const JointOver over = over_cell(cells, middle, half);
            const bool one_way = over.slope.lo >= 0 || over.slope.hi <= 0;
            const double then = theta_at(cells, cell.upper);
            const double about = now + wrap(over.middle - before), to = now + wrap(then - before);
            const bool decided = over.off.bounded() &&
                                 about + over.off.hi <= max(most, to) + tolerance::angle &&
                                 about + over.off.lo >= min(least, to) - tolerance::angle;
            const bool narrow = half < tuning_.narrowest || ++looks > tuning_.looks || top + 2 > most_cells;
            if (!one_way && !decided && !narrow) {
                stack[top++] = {middle, cell.upper};
                stack[top++] = {cell.lower, middle};
                continue;
            }
            double moved = wrap(then - before);
            before = then;
            if (one_way && over.slope.lo >= 0 && moved < -TurnArcsTuning::noise) moved += two_pi;
            if (one_way && over.slope.hi <= 0 && moved > TurnArcsTuning::noise) moved -= two_pi;
            if (!one_way && !decided &&
                abs(moved) > tuning_.continuous) {  // what lies in between is not known
                add(least, most);
                now = least = most = then;
                continue;
            }
            now += moved;
            least = min(least, now);
            most = max(most, now);
            if (most - least >= two_pi - (range_.upper - range_.lower)) return turns_.add_full();
        }
        add(least, most);
    }

    /// Bounds the turned joint's angle (rad) over a cell of values middle +- half of the free joint (rad);
    /// unbounded if nothing is known.
    JointOver over_cell(const OffsetCells& cells, double middle, double half) const noexcept {
        const JointOver unknown{0.0, Interval::whole(), Interval::whole()};
        OffsetCells::Over over;
        OffsetCells::Begun begun;
        cells.begin(middle, half, begun, over);
        if (over.exists != Known::inside) return unknown;
        cells.finish(begun, over);
        const JointOver& found = over.joint[joint_];
        return found.slope.bounded() ? found : unknown;
    }

    static constexpr int most_cells = 128;
    const OffsetArm& arm_;
    const Pose<double>& pose_;
    const OffsetTurnTuning& tuning_;
    const int joint_;  // in the order of the formulas
    const ThetaRange range_;
    UnionOfArcs turns_;
};

}  // namespace detail

/// Computes the angles alpha (rad) such that some branch and value of the free joint solves the pose, rotated
/// by alpha around axis 1 of the base or axis 7, within the limits. OK, or the reason if there are none.
inline Status turn_arcs(const OffsetArm& arm, const Pose<double>& pose, OffsetLimits, Turned turned,
                        ArcSet& out) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    return detail::OffsetTurns(arm, exact, turned, {}).find(out);
}

}  // namespace armangle

#include "../names/end.hpp"
