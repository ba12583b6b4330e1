// The nearest posture of an arm with an offset in every metric, globally over the branches, the values of the
// free joint and all turns; and one for each branch and arc.
//
//     1. a candidate near the seed     -> the box about the seed that holds whatever costs less
//     2. arcs of all branches in the box (feasible.hpp): on them every value has a posture
//     3. cells of the arcs, the one of the least bound first (cost_cells.hpp): dropped, left with one end,
//        finished by Newton's method where the cost is convex, or divided
//     4. where joints share a turn, or the free joint has too few digits, the joints themselves
//     (offset_joint_search.hpp)
//
//     cost |\      _        The first cell whose bound is above the best cost known ends the search: the best
//          | \    / \       is proven. A search whose cells are spent before says UNPROVEN.
//          +------------ free
#pragma once

#include <algorithm>
#include <optional>

#include "../scene/clear_cells.hpp"
#include "offset_joint_search.hpp"
#include "feasible.hpp"
#include "offset_posture_costs.hpp"
#include "straight_cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// How the least cost of a pose is found.
struct OffsetCostTuning {
    /// A cell to begin with is no wider (rad).
    double widest = 0.15;
    /// Looks at as many cells as the processor has lanes, for one pose; those left then are not proven.
    int looks = 160;
    /// Cells that all branches may take for pieces of the circle that roots leave undecided.
    int undecided = 160;
    /// Half width (rad) of a cell that is not divided again: a place to look beside.
    double narrowest = 1e-9;
    /// Steps of Newton's method.
    int newton = 12;
    /// Values of a candidate on both sides of the seed's.
    double aside[8] = {0.0, 0.05, -0.05, 0.15, -0.15, 0.4, -0.4, 1.0};
    /// The box about the seed is larger by this share.
    double roomy = 1e-6;
    /// rad: a start beside a shared turn is no farther than this from its posture.
    double near_best = 1e-3;
    /// rad: two places nearer to each other than this are one.
    double one_place = 1e-5;
};

namespace detail {

/// The search for the nearest posture of one pose. Options are in the order of the formulas.
class OffsetNearestSearch : OffsetPostureCosts {
public:
    /// Keeps references to its arguments; options are in the order of the formulas, `scene` may be null.
    OffsetNearestSearch(const OffsetArm& arm, const Pose<double>& exact, const NearestOptions& in_order,
                        const Scene* scene, const OffsetCostTuning& tuning) noexcept
        : OffsetPostureCosts(arm, exact, in_order),
          tuning_(tuning),
          scene_(scene),
          joint_search_(arm, exact, in_order) {
        if (scene_) move_.emplace(arm, *scene_);
    }

    /// The best posture, in the robot's order; UNPROVEN if a better one is not excluded, or the reason if
    /// there is none.
    Nearest best() noexcept {
        Nearest out;
        if (scene_ && rest_contact(offset_, *scene_, pose_)) return refused(Status::POSE_BLOCKED);
        if (keep_near(out)) return out;
        find_candidate();
        open_arcs();
        best_ = best_on_pose();
        if (!is_solved(best_.status)) best_ = nothing(status_);
        result_cost_ = cost_of_result(best_);
        search_by_joints(joint_search_);
        if (best_.status == Status::OK && best_.gc < 0) best_.status = Status::NEAR_SINGULAR;
        if (!is_solved(best_.status)) return best_;
        if (is_open_below(result_cost_)) best_.status = Status::UNPROVEN;
        return in_robot_order(best_);
    }

    /// Writes the best posture of each branch and arc to `out`, the best of all first.
    void all_of(Nearests& out) noexcept {
        const Nearest first = best();
        out.count = 0;
        out.status = first.status;
        box_ = infinity;
        open_arcs();
        const bool found = is_solved(first.status);
        const int its = found ? find(arcs_[first.gc], first.psi).index : -1;
        for (int gc = 0; gc < configurations; ++gc)
            for (int i = 0; i < arcs_[gc].count; ++i) {
                if (found && gc == first.gc && i == its) continue;
                const Nearest here = of_arc(gc, i);
                if (is_solved(here.status)) insert(out, in_robot_order(here));
            }
        if (!found) return;
        out.status = Status::OK;
        if (out.count == Nearests::capacity) --out.count;
        for (int at = out.count; at > 0; --at) out.found[at] = out.found[at - 1];
        ++out.count;
        out.found[0] = first;
    }

private:
    enum Extent { all, one };
    static constexpr int lanes = register_width, most_cells = 512, most_places = 64;
    static constexpr unsigned every = (1u << configurations) - 1;

    /// A part of an arc, and a lower bound of the cost in it.
    struct Cell {
        double lower, upper, least;
        int gc, arc;
    };
    /// A part of the circle in which postures are searched by their joints (offset_joint_search.hpp).
    struct SearchedPlace {
        int gc;
        double lower, upper, least;
        bool one;  // a single value, at which joints share a turn
    };
    /// Whether cell a comes after b in the heap, which has the least bound on top.
    static bool later(const Cell& a, const Cell& b) noexcept { return a.least > b.least; }

    /// Whether a branch is permitted.
    bool is_asked(int gc) const noexcept { return (options_.branches >> gc & 1u) != 0; }
    /// Whether a lower bound of a cost is not below the best cost, so that its cell is dropped.
    bool dropped(double least) const noexcept { return least >= cost_ - tie(cost_); }
    /// Forgets the best posture.
    void forget() noexcept {
        cost_ = infinity;
        gc_ = -1;
    }

    /// The best posture of arc number `arc` of branch gc, in the order of the formulas.
    Nearest of_arc(int gc, int arc) noexcept {
        forget();
        one_gc_ = gc;
        one_arc_ = arc;
        extent_ = one;
        best_ = best_on_pose();
        result_cost_ = cost_of_result(best_);
        NearestOptions options = options_;
        options.branches = 1u << gc;
        OffsetJointSearch joint_search(offset_, pose_, options);
        search_by_joints(joint_search);
        return best_;
    }

    /// If the seed itself solves the pose within limits, permitted arcs and scene, writes it to `out` as the
    /// solution, since it costs nothing. Otherwise returns false and leaves `out` unchanged.
    bool keep_near(Nearest& out) noexcept {
        if (!options_.near || options_.metric == Metric::margin) return false;
        const Joints near = robot_order(options_.near);
        if (!armangle::is_kept(offset_, near.q, 0.0)) return false;
        const OffsetPosture here = forward(offset_, near.q);
        if (!is_asked(here.gc) || !same_pose(offset_.own.size, pose_, here.pose)) return false;
        if (options_.allowed && !contains(*options_.allowed, here.free)) return false;
        if (move_ && !move_->is_clear_at(near.q)) return false;
        out = in_robot_order(finished(options_.near, here.free, here.gc));
        return true;
    }

    // -- a candidate, and the box that it leaves

    /// Keeps the best of some postures near the seed's value of the free joint: in the seed's branch, and if
    /// there is none, in the others.
    void find_candidate() noexcept {
        if (!options_.near || options_.metric == Metric::margin) return;
        const Joints near = robot_order(options_.near);
        const int own = forward(offset_, near.q).gc;
        try_branch(own);
        for (int gc = 0; gc < configurations && gc_ < 0; ++gc)
            if (gc != own) try_branch(gc);
        box_ = cost_;
    }
    /// Keeps the best of the postures of a branch at eight values near the seed's, improved by Newton's
    /// method, if it may be kept and costs less than the best.
    void try_branch(int gc) noexcept {
        if (!is_asked(gc)) return;
        const OffsetCells cells(offset_, pose_, gc);
        double free[8], value[8];
        const double at = options_.near[joints - 1];
        for (int i = 0; i < 8; ++i)
            free[i] = min(max(at + tuning_.aside[i], joint_[6].lower), joint_[6].upper);
        costs_within(cells.motion(), Boxes::load(free)).store(value);
        int best = 0;
        for (int i = 1; i < 8; ++i)
            if (value[i] < value[best]) best = i;
        if (!(value[best] < cost_) || !is_kept(cells, free[best])) return;
        double from = free[best], now = value[best];
        for (int pass = 0; squares() && pass < tuning_.newton; ++pass) {
            const Jet<double, 2> here = squares_at(cells, from);
            double to = from - 0.5 * here.coefficient[1] / here.coefficient[2];
            if (!(here.coefficient[2] > 0)) break;
            double then = infinity;
            for (int halving = 0; halving < 3 && !(then < now); ++halving, to = 0.5 * (from + to)) {
                double cost[8];
                costs_within(cells.motion(), Boxes(to)).store(cost);
                then = is_kept(cells, to) ? cost[0] : infinity;
                if (then < now) break;
            }
            if (!(then < now * (1.0 - 1e-6))) break;
            from = to;
            now = then;
        }
        cost_ = now;
        free_ = wrap(from);
        gc_ = gc;
        arc_ = {from, from, 0, 0};
    }
    /// Whether a value of the free joint is allowed, and its posture keeps the singularity margin and is free
    /// of collisions.
    bool is_kept(const OffsetCells& cells, double free) noexcept {
        if (options_.allowed && !contains(*options_.allowed, wrap(free))) return false;
        if (!move_ && !(offset_.margin > 0)) return true;
        double q[joint_slots];
        joints_at(cells, free, q);
        const Joints at = robot_order(q);
        if (offset_.margin > 0 && !armangle::is_kept(offset_, at.q, 0.0)) return false;
        return !move_ || move_->is_clear_at(at.q);
    }

    /// The limits in the robot's order, narrowed around the seed to the joints that cost less than the
    /// candidate.
    Limits box() const noexcept {
        Limits out = offset_.own.limits;
        if (!(box_ < infinity)) return out;
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            if (!(c.weight > 0)) continue;
            const double most = squares() ? sqrt(box_ / c.weight) : (box_ + c.room) / c.weight;
            const double reach = most * (1.0 + tuning_.roomy) + tolerance::angle;
            const int k = robot_joint(offset_, j);
            out.lower[k] = max(out.lower[k], c.near - reach);
            out.upper[k] = min(out.upper[k], c.near + reach);
        }
        return out;
    }

    /// Computes the permitted arcs of each branch, or the reason for none, and the places that arcs do not
    /// cover.
    void open_arcs() noexcept {
        OffsetArcsTuning how;
        how.looks = tuning_.undecided;
        OffsetArcs arcs(offset_, pose_, box(), how);
        unsigned elbows = 0;
        for (int gc = 0; gc < configurations; ++gc) {
            make_empty(arcs_[gc]);
            make_empty(left_open_[gc]);
            status_[gc] = Status::UNREACHABLE;
            if (!is_asked(gc)) continue;
            ProvenArcs found;
            arcs.find(gc, std::popcount(options_.branches & every & ~((1u << gc) - 1u)), found);
            for (int i = 0; i < found.open.count; ++i) remember_open(gc, found.open.arc[i]);
            arcs.crowded(gc, [&](double lower, double upper) { remember_open(gc, {lower, upper, 0, 0}); });
            for (int i = 0; i < found.arcs.count; ++i) {
                const Arc& arc = found.arcs.arc[i];
                if (arc.upper > arc.lower) continue;  // a value that is feasible by itself
                remember_shared(gc, arc.lower);
                remember_open(gc, arc);
            }
            Tag blocking = 0;
            if (scene_) keep_clear(offset_, *scene_, pose_, gc, found, blocking, false, {}, &left_open_[gc]);
            arcs_[gc] = found.arcs;
            status_[gc] = found.status;
            const unsigned elbow = configuration(gc).elbow > 0 ? 1u : 2u;
            if ((elbows & elbow) == 0) {
                elbows |= elbow;
                const auto remember_it = [&](double free) { remember_shared(gc, free); };
                arcs.straight(gc, remember_it);
                joint_search_.across_axis_6(gc, remember_it);
            }
            if (status_[gc] != Status::OK || !options_.allowed) continue;
            intersect(found.arcs, *options_.allowed, arcs_[gc]);
            if (arcs_[gc].empty()) status_[gc] = Status::NOT_ALLOWED;
        }
    }
    /// Remembers an undecided part, if it may hold a lower cost.
    void remember_open(int gc, const Arc& arc) noexcept {
        const double least = least_over(gc, arc.lower, arc.upper);
        if (!dropped(least)) remember(gc, arc.lower, arc.upper, least);
    }
    /// Remembers a value at which joints of both branches with one elbow sign may rotate about a common axis.
    void remember_shared(int gc, double free) noexcept {
        const int sides[] = {gc, gc ^ wrist_bit(gc)};
        for (const int side : sides) {
            int asked = is_asked(side) ? side : side ^ shoulder_bit(side);
            if (!is_asked(asked)) continue;
            const double at = joint_search_.shared(side, free);
            if (!is_nan(at)) remember(asked, at, at, -infinity, true);
        }
    }

    // -- cells

    /// Searches all arcs, or one, for postures that cost less than the best.
    void search() noexcept {
        count_ = 0;
        looks_ = 0;
        for (int gc = 0; gc < configurations; ++gc)
            for (int i = 0; i < arcs_[gc].count; ++i) {
                if (extent_ == one && !(gc == one_gc_ && i == one_arc_)) continue;
                begin(gc, i);
            }
        while (count_ > 0) {
            // as many cells of one branch as there are lanes, the first of which has the least bound
            Cell cell[lanes];
            int n = 0;
            while (count_ > 0 && n == 0) {
                const Cell next = pop();
                if (dropped(next.least)) {  // so are all others
                    count_ = 0;
                    return;
                }
                n = divide(next, cell);
            }
            if (n == 0) return;
            if (looks_++ >= tuning_.looks) {
                open_below_ = min(open_below_, cell[0].least);
                return;
            }
            look(cell, n);
        }
    }

    /// Adds the first cells of an arc to the heap, with the least cost of the free joint alone as bound.
    void begin(int gc, int index) noexcept {
        const Arc& arc = arcs_[gc].arc[index];
        if (arc.upper < arc.lower) return;
        const OffsetCells cells(offset_, pose_, gc);
        offer(cells, gc, arc, arc.lower);
        if (!(arc.upper > arc.lower)) {
            if (is_nan(cost_at(cells, arc.lower))) remember(gc, arc.lower, arc.lower, -infinity, true);
            return;
        }
        offer(cells, gc, arc, arc.upper);
        const int parts = 1 + static_cast<int>((arc.upper - arc.lower) / (tuning_.widest * lanes));
        const double width = (arc.upper - arc.lower) / parts;
        for (int k = 0; k < parts; ++k) {
            Cell cell{arc.lower + k * width, k + 1 < parts ? arc.lower + (k + 1) * width : arc.upper, 0, gc,
                      index};
            cell.least = least_of_free(cell);
            push(cell);
        }
    }
    /// The least cost of the free joint alone over a cell; -infinity if the metric does not weigh it.
    double least_of_free(const Cell& cell) const noexcept {
        const JointCost& c = joint_[joints - 1];
        const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
        const double off = abs(c.wide ? wrap(middle - c.near)
                                      : turned(joints - 1, to_theta(middle, c.sign, c.offset)) - c.near) -
                           half;
        return squares() || c.weight > 0 ? cost_of(c, max(off, 0.0)) : -infinity;
    }
    /// Divides a cell into as many equal ones as there are lanes, written to `out`, and returns their number.
    static int divide(const Cell& cell, Cell (&out)[lanes]) noexcept {
        const double width = (cell.upper - cell.lower) / lanes;
        for (int k = 0; k < lanes; ++k) {
            out[k] = cell;
            out[k].lower = cell.lower + k * width;
            out[k].upper = k + 1 < lanes ? cell.lower + (k + 1) * width : cell.upper;
        }
        return lanes;
    }
    /// Adds a cell to the heap; if the heap is full, its bound stays unproven.
    void push(const Cell& cell) noexcept {
        if (count_ == most_cells) {
            open_below_ = min(open_below_, cell.least);
            return;
        }
        cell_[count_++] = cell;
        std::push_heap(cell_, cell_ + count_, later);
    }
    /// Removes the cell with the least bound from the heap and returns it.
    Cell pop() noexcept {
        std::pop_heap(cell_, cell_ + count_, later);
        return cell_[--count_];
    }

    /// Computes the bounds of cells of one arc, and keeps those that may hold a lower cost.
    void look(const Cell (&cell)[lanes], int n) noexcept {
        const int gc = cell[0].gc;
        const Arc& arc = arcs_[gc].arc[cell[0].arc];
        const OffsetCells cells(offset_, pose_, gc);
        double middle[lanes], half[lanes];
        for (int i = 0; i < lanes; ++i) {
            const Cell& at = cell[i < n ? i : 0];
            middle[i] = 0.5 * (at.lower + at.upper);
            half[i] = 0.5 * (at.upper - at.lower) * (1.0 + 1e-9) + tolerance::same_psi;
        }
        const OffsetCellCosts found =
            costs(OffsetOverCells(offset_, cells.motion(), CostCells::load(middle), CostCells::load(half)));
        double value[lanes], least[lanes], best[lanes];
        found.value.store(value);
        found.least.store(least);
        found.best.store(best);
        int first = 0;
        for (int i = 1; i < n; ++i)
            if (value[i] < value[first]) first = i;
        if (value[first] < cost_) offer(cells, gc, arc, middle[first]);
        for (int i = 0; i < n; ++i) {
            Cell left = cell[i];
            left.least = is_nan(least[i]) ? cell[i].least : max(cell[i].least, least[i]);
            if (dropped(left.least)) continue;
            if ((found.rises | found.falls) >> i & 1u) {
                offer(cells, gc, arc, found.rises >> i & 1u ? left.lower : left.upper);
                continue;
            }
            if (found.bowl >> i & 1u && finish(cells, gc, arc, left, middle[i] + best[i] * half[i])) continue;
            if (!squares())
                offer(cells, gc, arc, min(max(middle[i] + best[i] * half[i], left.lower), left.upper));
            if (dropped(left.least)) continue;
            if (half[i] < tuning_.narrowest) {
                offer(cells, gc, arc, left.lower);
                offer(cells, gc, arc, left.upper);
                if (!dropped(left.least)) remember(gc, left.lower, left.upper, left.least);
                continue;
            }
            push(left);
        }
    }

    /// Finds and keeps the least cost in a cell over which it is convex, by Newton's method from the value
    /// `free`; false if that fails.
    bool finish(const OffsetCells& cells, int gc, const Arc& arc, const Cell& cell, double free) noexcept {
        free = min(max(free, cell.lower), cell.upper);
        double lower = cell.lower, upper = cell.upper;
        for (int pass = 0; pass < tuning_.newton; ++pass) {
            const Jet<double, 2> here = squares_at(cells, free);
            const double slope = here.coefficient[1], bend = 2.0 * here.coefficient[2];
            (slope > 0 ? upper : lower) = free;
            double to = free - slope / bend;
            if (!(bend > 0)) to = 0.5 * (lower + upper);
            to = min(max(to, lower), upper);
            const bool still = abs(to - free) <= tolerance::rounding * (1.0 + abs(free));
            free = to;
            if (!still) continue;
            offer(cells, gc, arc, free);
            return true;
        }
        offer(cells, gc, arc, free);
        return false;
    }

    /// Keeps a posture of an arc if it costs less than the best.
    void offer(const OffsetCells& cells, int gc, const Arc& arc, double free) noexcept {
        const double now = cost_at(cells, free);
        if (!(now < cost_)) return;
        cost_ = now;
        free_ = wrap(free);
        gc_ = gc;
        arc_ = arc;
    }

    // -- results

    /// The best posture found, moved onto the pose exactly, in the order of the formulas; NEAR_SINGULAR if
    /// none is left. If that fails or costs more, because the free joint has too few digits there, the place
    /// is removed from its arc to be searched otherwise, and the search continues.
    Nearest best_on_pose() noexcept {
        Nearest out = refused(Status::NEAR_SINGULAR);
        search();
        for (int pass = 0; gc_ >= 0 && pass < most_places; ++pass) {
            const Nearest found = result();
            const double cost = cost_of_result(found), least = cost_of_result(out);
            if (cost < least) out = found;
            if (is_near(cost)) return out;
            if (box_ < infinity) {  // the candidate may not exist
                box_ = infinity;
                open_arcs();
            }
            cut_off_best();
            cost_ = min(cost, least);
            gc_ = -1;
            search();
        }
        return out;
    }
    /// Whether a cost equals the best up to the accuracy of a start.
    bool is_near(double cost) const noexcept {
        if (squares()) return sqrt(cost) <= sqrt(cost_) + tuning_.near_best;
        return cost <= cost_ + tuning_.near_best;
    }
    /// Removes the best value and its neighbourhood from its arc, and remembers it as a place to search by
    /// joints.
    void cut_off_best() noexcept {
        ArcSet& arcs = arcs_[gc_];
        const Place at = find(arcs, free_);
        if (at.index < 0) return;
        Arc& arc = arcs.arc[at.index];
        arcs.full = false;
        const double lower = max(arc.lower, at.psi - tuning_.one_place),
                     upper = min(arc.upper, at.psi + tuning_.one_place);
        remember(gc_, lower, upper, -infinity);
        if (at.psi - arc.lower <= arc.upper - at.psi) {
            if (lower > arc.lower) remember(gc_, arc.lower, lower, -infinity);
            arc.lower = at.psi + tuning_.one_place;
        } else {
            if (upper < arc.upper) remember(gc_, upper, arc.upper, -infinity);
            arc.upper = at.psi - tuning_.one_place;
        }
    }

    /// The best posture in the order of the formulas, moved onto the pose to the last digits; NEAR_SINGULAR
    /// if that fails.
    Nearest result() const noexcept {
        const OffsetCells cells(offset_, pose_, gc_);
        const auto at = [&](double free) {
            Joints out{};
            joints_at(cells, free, out.q);
            return out;
        };
        const auto is_open = [&](double free) {
            const double lifted = lift(free, 0.5 * (arc_.lower + arc_.upper));
            return lifted >= arc_.lower && lifted <= arc_.upper;
        };
        Nearest out = kept_within(at, is_open, free_, gc_);
        if (!move_onto_pose(out)) return refused(Status::NEAR_SINGULAR);
        return out;
    }

    // -- where the free joint has too few digits

    /// Remembers a part of the circle, or a single value, to be searched by joints; neighbours of one kind
    /// are joined.
    void remember(int gc, double lower, double upper, double least, bool single = false) noexcept {
        for (int i = 0; i < places_; ++i) {
            SearchedPlace& known = place_[i];
            if (known.gc != gc || known.one != single || lower > known.upper + tuning_.one_place ||
                upper < known.lower - tuning_.one_place)
                continue;
            known.lower = min(known.lower, lower);
            known.upper = max(known.upper, upper);
            known.least = min(known.least, least);
            return;
        }
        if (places_ == most_places)
            open_below_ = min(open_below_, least);
        else
            place_[places_++] = {gc, lower, upper, least, single};
    }

    /// Searches the remembered places by joints, the least bound first, and keeps what is better than the
    /// best posture.
    void search_by_joints(OffsetJointSearch& joint_search) noexcept {
        const auto share = [this](Joints& robot) { share_turn(robot); };
        const auto worth = [this](const Joints& robot) { return is_worth(robot); };
        const auto take = [this](const Joints& robot, int gc) { take_found(robot, gc); };
        if (squares() && best_.gc >= 0) {
            Joints at = robot_order(best_.q);
            joint_search.begin(best_.gc, at, share, worth, take);
        }
        std::sort(place_, place_ + places_,
                  [](const SearchedPlace& a, const SearchedPlace& b) { return a.least < b.least; });
        const auto look_at = [&](int gc, double lower, double upper) {
            const bool done = joint_search.look(gc, lower, upper, share, worth, take);
            result_cost_ = cost_of_result(best_);
            return done;
        };
        count_ = looks_ = 0;
        for (int i = 0; i < places_; ++i) {
            const SearchedPlace& place = place_[i];
            if (!is_searched(place)) continue;
            if (place.least >= result_cost_ - tie(result_cost_)) break;
            if (!place.one)
                divide_place({place.lower, place.upper, place.least, place.gc, 0}, look_at);
            else {
                if (!look_at(place.gc, place.lower, place.upper)) open_below_ = -infinity;
                open_below_ = min(open_below_, place.least);
            }
        }
        if (!joint_search.finish(worth, take)) open_below_ = -infinity;
    }
    /// Searches the parts of a place by rising bound. Parts over which joints move too far are divided; where
    /// they move however narrow the part is, joints rotate about a common axis.
    template <class Look>
    void divide_place(const Cell& whole, const Look& look_at) noexcept {
        const OffsetCells cells(offset_, pose_, whole.gc);
        Cell cell[lanes] = {whole};
        for (int n = 1; n > 0;) {
            const int gc = cell[0].gc;
            double middle[lanes], half[lanes], least[lanes], moved[lanes];
            for (int i = 0; i < lanes; ++i) {
                const Cell& at = cell[i < n ? i : 0];
                middle[i] = 0.5 * (at.lower + at.upper);
                half[i] = 0.5 * (at.upper - at.lower) * (1.0 + 1e-9) + tolerance::same_psi;
            }
            const OffsetOverCells over(offset_, cells.motion(), CostCells::load(middle),
                                       CostCells::load(half));
            CostCells square(0.0);
            for (int j = 0; j < joints; ++j)
                square = mul_add(CostCells(joint_[j].weight) * over.travel[j], over.travel[j], square);
            costs(over).least.store(least);
            sqrt(square).store(moved);
            for (int i = 0; i < n; ++i) {
                Cell part = cell[i];
                part.least = is_nan(least[i]) ? part.least : max(part.least, least[i]);
                if (part.least >= result_cost_ - tie(result_cost_)) continue;
                OffsetCells::Begun begun;
                OffsetCells::Over known;
                cells.begin(middle[i], half[i], begun, known);
                if (known.exists == Known::outside) continue;
                const bool near =
                    moved[i] <= tuning_.near_best || joint_search_.is_shared(gc, part.lower, part.upper);
                if (!near && half[i] > tuning_.narrowest) {
                    push(part);
                    continue;
                }
                look_at(gc, part.lower, part.upper);
                open_below_ = min(open_below_, part.least);
            }
            n = 0;
            if (count_ == 0) return;
            const Cell next = pop();
            if (next.least >= result_cost_ - tie(result_cost_)) break;
            if (looks_++ >= tuning_.looks) {
                open_below_ = min(open_below_, next.least);
                break;
            }
            n = divide(next, cell);
        }
        count_ = 0;
    }
    /// Whether the present search includes a place: it is for all branches, or for the place's arc.
    bool is_searched(const SearchedPlace& place) const noexcept {
        if (extent_ == all) return true;
        if (place.gc != one_gc_ && !(place.one && place.gc == (one_gc_ ^ shoulder_bit(one_gc_))))
            return false;
        const Arc& arc = arcs_[one_gc_].arc[one_arc_];
        const double half = 0.5 * (place.upper - place.lower) + tuning_.one_place,
                     at = lift(0.5 * (place.lower + place.upper), 0.5 * (arc.lower + arc.upper));
        return at + half >= arc.lower && at - half <= arc.upper;
    }
    /// Whether a posture near these joints may cost less than the best.
    bool is_worth(const Joints& robot) const noexcept {
        if (!squares() || !(result_cost_ < infinity)) return true;
        return sqrt(cost_of_all(formula_order(robot.q).q)) < sqrt(result_cost_) + tuning_.near_best;
    }
    /// Keeps a posture, joints in the robot's order, if it costs less than the best, and permitted arcs and
    /// obstacles allow it.
    void take_found(const Joints& robot, int gc) noexcept {
        const Joints in_order = formula_order(robot.q);
        const double* q = in_order.q;
        const double cost = cost_of_all(q), free = wrap(q[joints - 1]);
        if (offset_.margin > 0 && !armangle::is_kept(offset_, robot.q, tolerance::angle)) return;
        if (cost >= result_cost_ - tie(result_cost_)) return;
        if (options_.allowed && !contains(*options_.allowed, free)) return;
        if (extent_ == one && find(arcs_[one_gc_], free).index != one_arc_) return;
        if (move_ && !move_->is_clear_at(robot.q)) return;
        best_ = finished(q, free, gc);
        result_cost_ = cost;
    }

    /// Sets joints 1 and 3 of `robot`, which rotate about one axis, to the cheapest values within the limits
    /// with the same sum; leaves them unchanged if there are none.
    void share_turn(Joints& robot) const noexcept {
        Joints in_order = formula_order(robot.q);
        double* q = in_order.q;
        const JointCost &a = joint_[0], &b = joint_[2];
        const double cosine = sin_cos(to_theta(q[1], joint_[1].sign, joint_[1].offset)).cos;
        const double eps = a.sign * b.sign * (cosine < 0 ? -1.0 : 1.0);
        const double wish = wrap(q[2] - b.near + eps * (q[0] - a.near));
        Split best{0, 0, infinity};
        for (const int k : {0, -1, 1, -2, 2}) {
            const Split now = split(a, b, eps, wish + two_pi * k);
            if (now.cost < best.cost) best = now;
        }
        if (!(best.cost < infinity)) return;
        q[0] = a.near + best.u;
        q[2] = b.near + best.v;
        for (const int j : {0, 2}) robot.q[robot_joint(offset_, j)] = q[j];
    }

    /// Whether cells that were not examined, or not decided for obstacles, may hold a posture of lower cost.
    bool is_open_below(double cost) const noexcept {
        const double slack = squares() ? 2.0 * sqrt(cost) * tolerance::angle : tolerance::angle;
        if (open_below_ < cost - slack) return true;
        for (int gc = 0; gc < configurations; ++gc)
            for (int i = 0; i < left_open_[gc].count; ++i) {
                const Arc& arc = left_open_[gc].arc[i];
                if (least_over(gc, arc.lower, arc.upper) < cost - slack) return true;
            }
        return false;
    }

    const OffsetCostTuning& tuning_;
    const Scene* const scene_;
    std::optional<StraightMove<OffsetArm>> move_;  // where there are obstacles
    OffsetJointSearch joint_search_;
    ArcSet arcs_[configurations], left_open_[configurations];
    Status status_[configurations];
    double cost_ = infinity, free_ = 0, box_ = infinity;
    Extent extent_ = all;
    int gc_ = -1, one_gc_ = 0, one_arc_ = 0, looks_ = 0, count_ = 0, places_ = 0;
    Arc arc_{};
    double open_below_ = infinity, result_cost_ = infinity;
    Nearest best_{};
    Cell cell_[most_cells];
    SearchedPlace place_[most_places];
};

/// The options in the order of the formulas; `near` stores the seed.
inline NearestOptions in_formula_order(const OffsetArm& arm, const NearestOptions& asked,
                                       double (&near)[joints]) noexcept {
    NearestOptions out = asked;
    for (int j = 0; j < joints; ++j) {
        const int k = robot_joint(arm, j);
        out.weight[j] = asked.weight[k];
        if (asked.near) near[j] = asked.near[k];
    }
    if (asked.near) out.near = near;
    return out;
}

}  // namespace detail

/// The posture of a pose with the least cost, globally: over the permitted branches and values of the free
/// joint and all multiples of 2 pi, without collision in `scene` (null: none). Without one, the status is the
/// reason. UNPROVEN: a posture, but a cheaper one is not excluded.
inline Nearest nearest_posture(const OffsetArm& arm, const Pose<double>& pose, const NearestOptions& options,
                               const Scene* scene = nullptr, const OffsetCostTuning& tuning = {}) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    double near[joints];
    const NearestOptions in_order = detail::in_formula_order(arm, options, near);
    return detail::OffsetNearestSearch(arm, exact, in_order, scene, tuning).best();
}

/// Writes the nearest posture of each branch and arc to `out`, as many as fit: first that of
/// nearest_posture(), then by rising cost.
inline void nearest_postures(const OffsetArm& arm, const Pose<double>& pose, const NearestOptions& options,
                             Nearests& out, const Scene* scene = nullptr,
                             const OffsetCostTuning& tuning = {}) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    double near[joints];
    const NearestOptions in_order = detail::in_formula_order(arm, options, near);
    detail::OffsetNearestSearch(arm, exact, in_order, scene, tuning).all_of(out);
}

}  // namespace armangle

#include "../names/end.hpp"
