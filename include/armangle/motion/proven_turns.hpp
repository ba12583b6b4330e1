// All turns of the base, and all rolls of the tool, at which an arm is proven to hold a pose, from what is
// proven of its joints over cells of its redundant parameter.
//
// A pose turned by alpha about the arm's own axis 1 or 7 has the same solutions with alpha added to that
// joint alone (limits/turn_arcs.hpp). So an arc of the redundant parameter that all other joints permit holds
// the turns
//
//     alpha in [lower - max theta, upper - min theta].
//
// Over a cell the joint is on a straight line within a box (scene/clear_cells.hpp): theta = m + t d + e with
// |t| <= 1 and |e| <= off. So m + |d| - off is attained, and m + |d| + off is not exceeded. What is between
// both is not proven; nor is any turn where a branch has arcs that are proven neither way.
#pragma once

#include "../limits/turn_arcs.hpp"
#include "../scene/clear_cells.hpp"
#include "stepping_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Computes the rotations of one pose around axis 1 or 7 at which it is proven to be reachable.
template <stepping_family F>
class ProvenTurns {
    using AnyArm = std::remove_cvref_t<decltype(std::declval<const F&>().arm())>;
    using Cells = typename CellsOf<AnyArm>::type;

public:
    /// Keeps a pose with an exact rotation; joint 1 (Turned::base) or 7 (Turned::tool) turns.
    ProvenTurns(const F& family, const Pose<double>& exact, Turned turned) noexcept
        : family_(family),
          pose_(exact),
          joint_(turned == Turned::base ? 0 : joints - 1),
          range_(theta_range(family.rows(), family.rows().limits, joint_)) {}

    /// Writes the rotations (rad) to `out` and how much of the others is not excluded to `unproven`. Returns
    /// the reason if there are none, NEAR_SINGULAR if some are not excluded.
    Status find(ArcSet& out, double& unproven) noexcept {
        Limits others = family_.rows().limits;
        others.lower[joint_] = -infinity;
        others.upper[joint_] = infinity;
        ProvenArcs found[configurations];
        for (int gc = 0; gc < configurations; ++gc) family_.arcs(pose_, gc, others, found[gc]);
        return find(found, out, unproven);
    }

    /// The same, given the arcs `found` that all joints but the turned one permit.
    Status find(const ProvenArcs (&found)[configurations], ArcSet& out, double& unproven) noexcept {
        Status why = Status::UNREACHABLE;
        unsigned open = 0;
        for (int gc = 0; gc < configurations; ++gc) {
            why = nearer_reason(why, found[gc].status);
            Cells cells(family_.arm(), pose_, gc);
            looks_ = tuning_.looks;
            bool known = found[gc].unproven <= 0;
            for (int i = 0; i < found[gc].arcs.count && !turns_.full(); ++i)
                known &= add_arc(cells, found[gc].arcs.arc[i]);
            if (!known) open |= 1u << gc;
        }
        turns_.finish(out);
        if (open != 0 && !contains(out, 0.0)) {
            add_found(open);
            turns_.finish(out);
        }
        ArcSet may;
        possible_.finish(may);
        unproven = max((open != 0 ? two_pi : measure(may)) - measure(out), 0.0);
        if (!out.empty()) return Status::OK;
        return open != 0 ? Status::NEAR_SINGULAR : why;
    }

private:
    /// The least and the greatest theta (rad) of the turned joint along a part of an arc: attained, and at
    /// most possible.
    struct Swing {
        bool begun = false;
        double now = 0, least = 0, most = 0, lowest = 0, highest = 0;
    };

    /// Adds the rotation of a solution that a search finds in some branches (bits), if it finds one.
    void add_found(unsigned branches) noexcept {
        NearestOptions asked;
        asked.branches = branches;
        const Nearest found = family_.nearest(pose_, asked, nullptr);
        if (!is_solved(found.status)) return;
        const double theta = to_theta(family_.rows(), joint_, found.q[joint_]);
        add(theta, theta, turns_);
        add(theta, theta, possible_);
    }

    /// Adds to `to` the rotations at which the joint is within its limits, if its theta lies between least
    /// and most.
    void add(double least, double most, UnionOfArcs& to) const noexcept {
        if (!(range_.upper - range_.lower < two_pi)) return to.add_full();
        if (!(least <= most)) return;
        to.add({range_.lower - most, range_.upper - least,
                make_tag(joint_ + 1, limit_side(family_.rows(), joint_, true)),
                make_tag(joint_ + 1, limit_side(family_.rows(), joint_, false))});
    }
    /// Adds the rotations of a part of an arc, if it has begun, and ends it.
    void close(Swing& swing) noexcept {
        if (swing.begun) {
            add(swing.least, swing.most, turns_);
            add(swing.lowest, swing.highest, possible_);
        }
        swing = {};
    }

    /// Adds the rotations along an arc of the redundant parameter; false if parts of it are not known.
    bool add_arc(Cells& cells, const Arc& arc) noexcept {
        if (!(range_.upper - range_.lower < two_pi)) {
            turns_.add_full();
            possible_.add_full();
            return true;
        }
        const int parts = 1 + static_cast<int>((arc.upper - arc.lower) / (2.0 * Cells::widest));
        const double width = (arc.upper - arc.lower) / parts;
        Swing swing;
        bool known = true;
        for (int k = 0; k < parts; ++k)
            known &= follow(cells, arc.lower + k * width,
                            k + 1 < parts ? arc.lower + (k + 1) * width : arc.upper, swing);
        close(swing);
        return known;
    }
    /// Follows the joint over a cell, or over both halves of it; false if parts of it are not known.
    bool follow(Cells& cells, double lower, double upper, Swing& swing) noexcept {
        const double middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
        StraightCell cell;
        const bool spent = --looks_ < 0;
        // farther apart, the revolution of one cell would not tell that of the next
        const bool bounded = !spent && cells.over(middle, half, cell) &&
                             abs(cell.d[joint_]) + cell.off[joint_] < 0.25 * two_pi;
        if (!bounded) {
            if (spent || half <= tuning_.unknown) {
                close(swing);
                return false;
            }
            const bool first = follow(cells, lower, middle, swing);
            return follow(cells, middle, upper, swing) && first;
        }
        const double theta = to_theta(family_.rows(), joint_, cell.q[joint_]), along = abs(cell.d[joint_]),
                     off = cell.off[joint_];
        const double now = swing.begun ? lift(theta, swing.now) : theta;
        if (!swing.begun) swing = {true, now, now + off, now - off, now, now};
        swing.now = now;
        swing.least = min(swing.least, now - along + off);
        swing.most = max(swing.most, now + along - off);
        swing.lowest = min(swing.lowest, now - along - off);
        swing.highest = max(swing.highest, now + along + off);
        return true;
    }

    const F& family_;
    const Pose<double>& pose_;
    const int joint_;
    const ThetaRange range_;
    const ClearCellsTuning tuning_;
    int looks_ = 0;
    UnionOfArcs turns_, possible_;
};

}  // namespace detail

/// Computes the angles alpha (rad) such that some branch and redundant parameter is proven to solve the pose,
/// rotated by alpha around the arm's own axis 1 or 7, within the limits. `unproven` is the length (rad) of
/// the other angles that are not excluded. OK, NEAR_SINGULAR if none is proven and some are not excluded, or
/// the reason if there are none.
template <stepping_family F>
Status proven_turn_arcs(const F& family, const Pose<double>& pose, Turned turned, ArcSet& out,
                        double& unproven) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    return detail::ProvenTurns<F>(family, exact, turned).find(out, unproven);
}

}  // namespace armangle

#include "../names/end.hpp"
