// The values of the free number, psi or a joint, at which an arm touches nothing: stretches that are proven.
//
//     |---clear---o---clear---|touching|---clear---|      o: a middle that was looked at
//                 <---- one look ---->
//
// About the posture at the middle of a cell the joints are on a straight way, within a box: what an arm
// proves of its cell. straight_move.hpp says how far that way is proven to touch nothing, and how far nothing
// of it is clear, back and ahead. What is between is looked at again: the ends come near in a few looks, each
// as the square of the last one. So all is told, but where nothing is known of the joints.
#pragma once

#include "clear.hpp"
#include "straight_move.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of ClearCells.
struct ClearCellsTuning {
    /// The largest number of cells that are examined for one pose and branch.
    int looks = 3000;
    /// A cell is halved if less than this share of each half is decided.
    double least_decided = 0.2;
    /// Cells narrower than this half width (rad) are abandoned; `unknown` holds if no bound of the joints
    /// exists.
    double narrowest = 1e-11, unknown = 1e-8;
    /// The number of bisections of the clearance in the search for the widest value.
    int widest_halvings = 26;
};

/// Bounds the joints of an arm over cells of its free number. A specialisation has a constructor of (arm,
/// exact pose, branch), the half width `widest` (rad) of the first cells, and over(middle, half, cell), which
/// returns false if it has no bound.
template <class AnyArm>
struct CellsOf;

/// The joints over a cell: q + s d + e with |s| <= 1 and |e_j| <= off_j; rad, in the robot's order and signs.
struct StraightCell {
    double q[joints], d[joints], off[joints];
};

namespace detail {

/// Finds the intervals of the free number of one pose and branch on which the arm is proven collision-free.
template <class AnyArm>
class ClearCells {
    using Cells = typename CellsOf<AnyArm>::type;

public:
    /// Keeps a pose, whose rotation must be orthonormal, in branch gc and a scene.
    ClearCells(const AnyArm& arm, const Scene& scene, const Pose<double>& pose, int gc,
               const ClearCellsTuning& tuning) noexcept
        : tuning_(tuning),
          cells_(arm, pose, gc),
          flange_(flange_pose(nominal(arm), pose)),
          move_(arm, scene),
          looks_(tuning.looks) {}

    /// Writes the proven collision-free parts of the arcs `own`. `unproven` grows by the length (rad) that
    /// remains undecided.
    void run(const ArcSet& own, ArcSet& out, double& unproven) noexcept {
        make_empty(out);
        for (int i = 0; i < own.count; ++i) {
            const Arc& arc = own.arc[i];
            const double width = arc.upper - arc.lower;
            const int n = 1 + static_cast<int>(width / (2.0 * Cells::widest));
            tag_ = own.full ? 0 : arc.lower_tag;
            open_ = false;
            for (int k = 0; k < n; ++k)
                decide(arc.lower + width * k / n, arc.lower + width * (k + 1) / n, out);
            if (open_) close(own.full ? 0 : arc.upper_tag, out);
        }
        merge(out);
        unproven += unproven_;
    }

    /// The last pair that was found to touch; 0 if there was none.
    Tag touching() const noexcept { return touching_; }
    /// The number of cells that were looked at.
    int looks() const noexcept { return tuning_.looks - looks_; }
    /// The arcs on which it is not known whether something touches; empty if all is decided.
    const ArcSet& left_open() const noexcept { return left_open_; }

private:
    /// Decides a cell, or halves it and decides both halves in rising order.
    void decide(double lower, double upper, ArcSet& out) noexcept {
        const double middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
        StraightCell cell;
        const bool spent = --looks_ < 0, known = !spent && cells_.over(middle, half, cell);
        const Around at = known ? move_.about(cell.q, cell.d, cell.off, &flange_) : Around{};
        if (at.is_clear()) return add_clear(lower, upper);
        if (spent || half <= (known ? tuning_.narrowest : tuning_.unknown))
            return leave_out(lower, upper, at, out);
        const double back = max(at.clear[0], at.touching[0]), ahead = max(at.clear[1], at.touching[1]);
        if (max(back, ahead) < tuning_.least_decided) {
            decide(lower, middle, out);
            return decide(middle, upper, out);
        }
        const double from = back < 1.0 ? middle - back * half : lower,
                     to = ahead < 1.0 ? middle + ahead * half : upper;
        if (from > lower) decide(lower, from, out);
        tell(at.clear[0] >= at.touching[0], from, middle, at.pair, out);
        tell(at.clear[1] >= at.touching[1], middle, to, at.pair, out);
        if (to < upper) decide(to, upper, out);
    }

    /// Records the interval [lower, upper] as collision-free or as blocked by a pair.
    void tell(bool clear, double lower, double upper, Tag pair, ArcSet& out) noexcept {
        if (!(upper > lower)) return;
        if (clear) return add_clear(lower, upper);
        touching_ = pair;
        end(pair, out);
    }
    /// Leaves out a cell that is too narrow to halve: it collides, or nothing is proven and it counts as
    /// unproven.
    void leave_out(double lower, double upper, const Around& at, ArcSet& out) noexcept {
        const bool touches = min(at.touching[0], at.touching[1]) >= 1.0;
        if (touches) touching_ = at.pair;
        if (!touches) {
            unproven_ += max(upper - lower, tolerance::angle);
            leave_open(lower, upper);
        }
        end(touches ? at.pair : make_tag(0, Side::unproven), out);
    }
    /// Adds an undecided cell, right of those before; everything counts as undecided if there are too many.
    void leave_open(double lower, double upper) noexcept {
        if (left_open_.full) return;
        Arc* const last = left_open_.count > 0 ? &left_open_.arc[left_open_.count - 1] : nullptr;
        if (last && last->upper >= lower)
            last->upper = upper;
        else if (left_open_.count < ArcSet::capacity)
            put(left_open_, {lower, upper, 0, 0});
        else
            make_full(left_open_);
    }
    /// Begins a collision-free arc, or continues it to `upper`.
    void add_clear(double lower, double upper) noexcept {
        if (!open_) start_ = lower;
        open_ = true;
        end_ = upper;
    }
    /// Ends the present collision-free arc, if any, at the pair `by`, which the next one begins with.
    void end(Tag by, ArcSet& out) noexcept {
        if (open_) close(by, out);
        tag_ = by;
    }
    /// Appends the collision-free arc to `out`, ended by the pair `by`.
    void close(Tag by, ArcSet& out) noexcept {
        if (out.count == ArcSet::capacity) unproven_ += end_ - start_;
        put(out, {start_, end_, tag_, by});
        open_ = false;
    }

    const ClearCellsTuning& tuning_;
    Cells cells_;
    const Pose<double> flange_;
    StraightMove<AnyArm> move_;
    bool open_ = false;
    double start_ = 0, end_ = 0, unproven_ = 0;
    Tag tag_ = 0, touching_ = 0;
    ArcSet left_open_;
    int looks_;
};

}  // namespace detail

/// The nearest pair of shapes, also two of the arm's own, at joint angles q (rad) for any kind of arm; pair 0
/// if there is none. Its rate is the derivative of the distance along d (rad). `turning_alone` skips the tool
/// and link 0 against the ground, and the tool counts as at rest.
template <class AnyArm>
Proximity proximity(const AnyArm& arm, const Scene& scene, const double* q, const double (&d)[joints],
                    bool turning_alone = false) noexcept {
    return StraightMove<AnyArm>(arm, scene).proximity(q, d, turning_alone);
}

/// The first pair that touches at a pose at all joint angles: link 0 or the tool against the ground; 0 if
/// there is none.
template <class AnyArm>
Tag rest_contact(const AnyArm& arm, const Scene& scene, const Pose<double>& pose) noexcept {
    return scene.base_tag ? scene.base_tag : held_contact(scene, flange_pose(nominal(arm), pose));
}

/// Reduces the proven arcs of a pose and branch to their collision-free parts. If nothing remains, `blocking`
/// becomes a pair found to touch; 0 if none is known. `turning_alone` skips the tool and link 0. `left_open`,
/// if not null, becomes the part where it is not known whether something touches. Returns the number of cells
/// that were looked at.
template <class AnyArm>
int keep_clear(const AnyArm& arm, const Scene& scene, const Pose<double>& pose, int gc, ProvenArcs& arcs,
               Tag& blocking, bool turning_alone = false, const ClearCellsTuning& tuning = {},
               ArcSet* left_open = nullptr) noexcept {
    blocking = 0;
    if (left_open) make_empty(*left_open);
    make_empty(arcs.open);
    if (arcs.arcs.empty()) return 0;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    if (!turning_alone) blocking = rest_contact(arm, scene, exact);
    if (blocking) {
        make_empty(arcs.arcs);
        arcs.status = Status::POSE_BLOCKED;
        return 0;
    }
    const ArcSet own = arcs.arcs;
    detail::ClearCells<AnyArm> proof(arm, scene, exact, gc, tuning);
    proof.run(own, arcs.arcs, arcs.unproven);
    if (left_open) *left_open = proof.left_open();
    if (!arcs.arcs.empty()) return proof.looks();
    blocking = proof.touching();
    arcs.status = blocking ? Status::CLEARANCE : Status::NEAR_SINGULAR;
    return proof.looks();
}

/// Within the arc of `open` that contains psi, writes the parts that also keep the soft clearance. False if
/// there are none or if no arc contains psi. The rotation of the pose must be orthonormal.
template <class AnyArm>
bool keep_soft(const AnyArm& arm, const Scene& scene, const Pose<double>& pose, int gc, const ArcSet& open,
               double psi, ArcSet& out, const ClearCellsTuning& tuning = {}) noexcept {
    const Place at = find(open, psi);
    if (at.index < 0) return false;
    Scene asked = scene;
    asked.clearance += scene.soft;
    ArcSet here;
    make_empty(here);
    here.arc[here.count++] = open.arc[at.index];
    here.full = open.full;
    double unproven = 0;
    detail::ClearCells<AnyArm>(arm, asked, pose, gc, tuning).run(here, out, unproven);
    return !out.empty();
}

/// The psi within the proven arcs `own` at which the arm keeps the largest distance from obstacles, and the
/// nearest pair there; no_widest if there is none. The rotation of the pose must be orthonormal.
template <class AnyArm>
Widest widest(const AnyArm& arm, const Scene& scene, const Pose<double>& pose, int gc, const ArcSet& own,
              const ClearCellsTuning& tuning = {}) noexcept {
    if (own.empty()) return no_widest;
    const double psi =
        widest_psi(scene, nominal(arm).size, tuning.widest_halvings, [&](double clearance, ArcSet& left) {
            Scene asked = scene;
            asked.clearance = clearance;
            double unproven = 0;
            detail::ClearCells<AnyArm>(arm, asked, pose, gc, tuning).run(own, left, unproven);
        });
    if (is_nan(psi)) return no_widest;
    const Inverse at = inverse(arm, pose, psi, gc), rate = self_motion_rate(arm, pose, psi, gc);
    if (at.status != Status::OK || rate.status != Status::OK) return no_widest;
    double d[joints];
    for (int j = 0; j < joints; ++j) d[j] = rate.q[j];
    return {psi, proximity(arm, scene, at.q, d, true)};
}

}  // namespace armangle

#include "../names/end.hpp"
