// The posture of a pose that costs least, of an arm on its own chain with an offset nominal arm: branch and
// bound over cells of the free joint of all branches.
//
// A cell is dropped where no posture in it can cost less than the best found, finished at one end where the
// cost goes one way, and halved else. What stays open near where branches meet is searched at its middle, and
// the answer is UNPROVEN where something nearer could be there.
#pragma once

#include <algorithm>
#include <optional>

#include "../../limits/nearest_search.hpp"
#include "../psi_gradient.hpp"
#include "../straight_cells.hpp"
#include "feasible.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// Registers the bounds for an arm on its own chain: cells of the true chain.
template <>
struct CellsOf<OffsetChain> {
    using type = detail::StraightCells<OffsetChain, detail::ChainCells>;
};

/// How the posture that costs least is found.
struct OffsetChainNearestTuning {
    /// Cells of the circle, or of what is allowed, to begin with: one is at most this share of a turn.
    int cells = 24;
    /// Values of the free joint that are tried in each branch before.
    int first = 48;
    /// Cells of a pose that are looked at before the rest is left open.
    int looks = 6000;
    /// Half width (rad) of a cell that stays open, and of one that is known: its middle is the best there.
    double narrowest = 1e-3, finest = 1e-7;
    /// Postures looked for in an open place, and how far joint 5 is turned from the fold for them (rad).
    int samples = 16;
    double near_fold = 0.4;
    /// Steps of the search for the best beside an open place, and its last step (rad).
    int polish = 200;
    double polished = 1e-10;
    /// Steps of Newton's method to the best value of the free joint.
    int newton = 12;
    /// Costs closer than this share of them are equal.
    double tie = 1e-12;
};

namespace detail {

/// A number that is larger the nearer a status is to a solution.
inline int how_near(Status status) noexcept {
    switch (status) {
        case Status::UNREACHABLE: return 0;
        case Status::NO_POSTURE: return 1;
        case Status::NOT_ALLOWED: return 3;
        case Status::CLEARANCE: return 4;
        default: return is_solved(status) ? 5 : 2;
    }
}

/// The result for a pose without a solution, with the reason as its status; its numbers are NaN, its branch
/// -1.
inline Nearest unsolved(Status why) noexcept {
    Nearest out{};
    for (double& q : out.q) q = not_a_number;
    out.psi = out.distance = out.margin = out.gap = not_a_number;
    out.gc = -1;
    out.status = why;
    return out;
}

/// Whether `a` is better than `b`: of two solutions the one that costs less (metric margin: that has the
/// larger margin), otherwise the one whose status is nearer to a solution.
inline bool is_better(const Nearest& a, const Nearest& b, Metric metric) noexcept {
    if (!is_solved(a.status) || !is_solved(b.status)) return how_near(a.status) > how_near(b.status);
    return metric == Metric::margin ? a.margin > b.margin : a.distance < b.distance;
}

/// The search for the nearest posture of one pose.
class ChainSearch {
public:
    /// Keeps references to its arguments but the pose. Without a seed, costs count from the middles of the
    /// joint ranges. With a scene, solutions that collide are rejected.
    ChainSearch(const OffsetChain& arm, const Pose<double>& pose, const NearestOptions& options,
                const Scene* scene, const OffsetChainNearestTuning& tuning) noexcept
        : arm_(arm),
          pose_{orthonormal(pose.rotation), pose.position},
          o_(options),
          scene_(scene),
          tuning_(tuning) {
        const Arm& own = arm.nominal.own;
        for (int j = 0; j < joints; ++j) near_[j] = o_.near ? o_.near[j] : own.joint_middle[j];
    }

    /// Returns the nearest solution in the permitted branches, or the reason for none; UNPROVEN if a nearer
    /// one may exist.
    Nearest run() noexcept {
        if (o_.allowed && o_.allowed->empty()) return unsolved(Status::NOT_ALLOWED);
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(o_.branches >> gc & 1u)) continue;
            Branch& one = branch_[gc].emplace(arm_, pose_, gc);
            offer(one.judge.cells, gc, near_[robot_joint(arm_, 6)]);
            for (int k = 0; k < tuning_.first; ++k)
                offer(one.judge.cells, gc, -pi + two_pi * (k + 0.5) / tuning_.first);
            begin(gc);
        }
        if (o_.near) search_near_seed();
        search();
        Status why = Status::UNREACHABLE;
        for (const std::optional<Branch>& one : branch_) {
            if (!one) continue;
            const Status its = one->any ? Status::OK : one->judge.refusal();
            if (how_near(its) > how_near(why)) why = its;
        }
        look_at_folds();
        if (left_open_ < cost_ && found_.gc >= 0) polish(branch_[found_.gc]->judge.cells.flange());
        if (found_.gc >= 0 && (o_.metric == Metric::l2 || o_.metric == Metric::margin)) settle();
        if (found_.gc < 0) {
            if (left_open_ < infinity) return unsolved(Status::NEAR_SINGULAR);
            if (why == Status::OK) why = Status::LIMITS;
            return unsolved(o_.allowed && why == Status::LIMITS ? Status::NOT_ALLOWED : why);
        }
        found_.status = left_open_ < cost_ - tie() ? Status::UNPROVEN : Status::OK;
        return found_;
    }

private:
    static constexpr int most_cells = 4096, most_open = 512;
    struct Branch {
        Branch(const OffsetChain& arm, const Pose<double>& pose, int gc) noexcept
            : ranges(arm.nominal.rest, arm.nominal.rest.limits, 0.0, configuration(gc)),
              judge(arm, pose, gc, ranges) {}
        const ThetaRanges ranges;
        CellJudge<ChainCells> judge;
        bool any = false;  // postures are known
    };
    struct Cell {
        double least, lower, upper;
        int gc;

        double middle() const noexcept { return 0.5 * (lower + upper); }
        double half() const noexcept { return 0.5 * (upper - lower); }
        friend bool operator<(const Cell& a, const Cell& b) noexcept { return a.least > b.least; }  // a heap
    };

    /// The difference up to which two costs count as equal.
    double tie() const noexcept { return tuning_.tie * abs(cost_) + 1e-24; }

    /// Keeps the posture that find_at_once() finds at a value of the free joint (rad) as the best, if that
    /// value is allowed, the posture within the limits and collision-free, and it costs less than the best.
    void offer(const ChainCells& cells, int gc, double free) noexcept {
        ChainPosture at;
        if (find_at_once(arm_, cells.flange(), cells.theta_7_of(free), configuration(gc), at))
            take(at, gc, free);
    }

    /// Keeps a posture as the best if its value of the free joint is allowed, it is within the limits and
    /// collision-free, and it costs less than the best; returns whether it did.
    bool take(const ChainPosture& at, int gc, double free) noexcept { return take(at, gc, free, cost_); }
    /// Keeps a posture, each joint in the turn nearest to the seed, as the best if its value of the free
    /// joint is allowed, it is within the limits and collision-free, and it costs less than `most`; returns
    /// whether it did.
    bool take(const ChainPosture& at, int gc, double free, double most) noexcept {
        if (o_.allowed && !contains(*o_.allowed, free)) return false;
        const Arm& own = arm_.nominal.own;
        const Joints q = joints_within_limits(own, directions_of(arm_, at), near_);
        const double margin = limit_margin(own.limits, q.q);
        if (!(margin >= -tolerance::angle)) return false;
        double sum = 0;
        for (int j = 0; j < joints; ++j) {
            const double d = abs(q.q[j] - near_[j]);
            sum = o_.metric == Metric::l2 ? sum + o_.weight[j] * d * d : max(sum, sqrt(o_.weight[j]) * d);
        }
        const double cost = o_.metric == Metric::margin ? -margin : sum;
        if (!(cost < most) || (scene_ && !is_clear(arm_, *scene_, q.q))) return false;
        cost_ = cost;
        best_ = at;
        for (int j = 0; j < joints; ++j) found_.q[j] = q.q[j];
        found_.psi = wrap(free) <= -pi ? pi : wrap(free);
        found_.gc = gc;
        if (o_.metric != Metric::margin) found_.distance = o_.metric == Metric::l2 ? sqrt(sum) : sum;
        found_.margin = margin;
        found_.gap = 0;
        return true;
    }

    /// Keeps a posture as the best, with its own branch and value of the free joint, if it reaches the pose,
    /// both are permitted, it is within the limits and collision-free, and it costs less than the best;
    /// returns whether it did.
    bool take(const ChainPosture& at) noexcept {
        if (!(at.left <= posture_.residual)) return false;
        const int gc = index(branch_of(arm_, at.angle));
        const double theta = atan2(at.angle[6].sin, at.angle[6].cos);
        return (o_.branches >> gc & 1u) != 0 && take(at, gc, wrap(to_q(arm_.nominal.rest, 6, theta)));
    }

    /// A lower bound of the cost in a cell, and bounds of its slope.
    struct Bound {
        double least = 0;
        bool possible = true, smooth = true;
        Interval slope{0.0};  // of the cost l2, where it is smooth
        double squares = 0, largest = 0, margin = infinity;
    };

    /// Adds the cost of joint j (0..6, in the order of the formulas) over a cell.
    void add(int j, const JointOver& over, Bound& out) const noexcept {
        const Arm& own = arm_.nominal.own;
        const int k = robot_joint(arm_, j);
        const double sign = own.sign[k], lower = own.limits.lower[k], upper = own.limits.upper[k];
        if (!over.off.bounded()) {
            out.smooth = false;
            return;
        }
        const Interval off = sign > 0 ? over.off : -over.off;
        const double at = to_q(own, k, over.middle);
        const double fewest = ceil((lower - at - off.hi) / two_pi),
                     most = floor((upper - at - off.lo) / two_pi);
        if (!(fewest <= most)) {
            out.possible = false;
            return;
        }
        const double turn = min(max(round((near_[k] - at) / two_pi), fewest), most);
        double least = infinity, margin = -infinity;
        int turns = 0;
        for (const double t : {turn - 1.0, turn, turn + 1.0}) {
            if (t < fewest || t > most) continue;
            ++turns;
            const double here = at + two_pi * t;
            const double from = max(here + off.lo, lower), to = min(here + off.hi, upper);
            least = min(least, max(0.0, max(from - near_[k], near_[k] - to)));
            margin = max(margin, min(to - lower, upper - from));
        }
        const double here = at + two_pi * turn;
        out.smooth = out.smooth && (turns == 1 || abs(here - near_[k]) + (off.hi - off.lo) < pi);
        out.squares += o_.weight[k] * least * least;
        out.largest = max(out.largest, sqrt(o_.weight[k]) * least);
        out.margin = min(out.margin, margin);
        out.slope = out.slope + Interval(2.0 * o_.weight[k] * sign) *
                                    Interval(here + off.lo - near_[k], here + off.hi - near_[k]) * over.slope;
    }

    /// The bound of a cell.
    Bound bound(const ChainCells::Over& over) const noexcept {
        Bound out;
        for (int j = 0; j < joints && out.possible; ++j) add(j, over.joint[j], out);
        out.least = o_.metric == Metric::l2 ? out.squares : out.largest;
        if (o_.metric == Metric::margin) out.least = -out.margin;
        out.smooth = out.smooth && o_.metric == Metric::l2 && out.slope.bounded();
        return out;
    }

    /// Keeps the best of the postures that Newton's method finds from the seed, with each joint fixed in
    /// turn.
    void search_near_seed() noexcept {
        const Pose<double> flange = flange_pose(arm_, pose_);
        for (int held = 0; held < joints; ++held) {
            ChainPosture at;
            for (int j = 0; j < joints; ++j)
                at.angle[j] = sin_cos(to_theta(arm_.nominal.rest, j, near_[robot_joint(arm_, j)]));
            solve_on_pose(arm_, flange, held, posture_, at);
            take(at);
        }
    }

    /// Adds a cell to the queue; if the queue is full, its bound stays unproven.
    void push(const Cell& cell) noexcept {
        if (count_ == most_cells) {
            left_open_ = min(left_open_, cell.least);
            return;
        }
        heap_[count_++] = cell;
        std::push_heap(heap_, heap_ + count_);
    }

    /// Adds the first cells of a branch: of the circle, or of the allowed arcs.
    void begin(int gc) noexcept {
        const double width = two_pi / tuning_.cells, least = o_.metric == Metric::margin ? -infinity : 0.0;
        const auto put = [&](double lower, double upper) {
            const int parts = 1 + static_cast<int>((upper - lower) / width - 1e-9);
            const double part = (upper - lower) / parts;
            for (int k = 0; k < parts; ++k)
                push({least, lower + k * part, k + 1 < parts ? lower + (k + 1) * part : upper, gc});
        };
        if (!o_.allowed || o_.allowed->full) return put(-pi, pi);
        for (int i = 0; i < o_.allowed->count; ++i) put(o_.allowed->arc[i].lower, o_.allowed->arc[i].upper);
    }

    /// Examines the cells of all branches, the one with the least bound first.
    void search() noexcept {
        for (int looks = 0; count_ > 0; ++looks) {
            std::pop_heap(heap_, heap_ + count_);
            const Cell cell = heap_[--count_];
            if (cell.least >= cost_ - tie()) return;
            if (looks == tuning_.looks) {
                left_open_ = min(left_open_, cell.least);
                return;
            }
            look(cell);
        }
    }

    /// Examines a cell: dismisses it, decides it at its best end, divides it or leaves it open.
    void look(const Cell& cell) noexcept {
        Branch& one = *branch_[cell.gc];
        const ChainCells& cells = one.judge.cells;
        ChainCells::Over over;
        Piece piece;
        const Known known = one.judge.look(cell.lower, cell.upper, over, piece);
        const bool inside = known == Known::inside;
        if (known == Known::outside) return;
        if (inside && !(piece.upper > piece.lower || (piece.upper == piece.lower && piece.lower_tag != 0)))
            return;
        one.any = one.any || inside;
        const Bound of = bound(over);
        const double least = max(of.least, cell.least);
        if (!of.possible || least >= cost_ - tie()) return;
        if (inside && of.smooth && (of.slope.lo >= 0 || of.slope.hi <= 0))
            return offer(cells, cell.gc, of.slope.lo >= 0 ? piece.lower : piece.upper);
        const double middle = cell.middle();
        const double end = inside ? tuning_.finest : cells.narrowest(over, tuning_.narrowest);
        const bool halved = cell.half() > end;
        if (over.exists == Known::inside || !halved)
            offer(cells, cell.gc, inside ? min(max(middle, piece.lower), piece.upper) : middle);
        if (halved) {
            push({least, cell.lower, middle, cell.gc});
            push({least, middle, cell.upper, cell.gc});
            return;
        }
        if (inside) {
            offer(cells, cell.gc, piece.lower);
            offer(cells, cell.gc, piece.upper);
            return;
        }
        left_open_ = min(left_open_, least);
        if (open_count_ < most_open) open_[open_count_++] = cell;
    }

    /// Searches postures in open cells, neighbours together, at values of the free joint and with joint 5
    /// fixed near the fold. Finds solutions, but proves nothing.
    void look_at_folds() noexcept {
        std::sort(open_, open_ + open_count_, [](const Cell& a, const Cell& b) noexcept {
            return a.gc != b.gc ? a.gc < b.gc : a.lower < b.lower;
        });
        for (int i = 0; i < open_count_;) {
            int end = i + 1;
            while (end < open_count_ && open_[end].gc == open_[i].gc &&
                   open_[end].lower - open_[end - 1].upper < tuning_.narrowest)
                ++end;
            look_at_fold(open_[i].gc, open_[i].lower, open_[end - 1].upper);
            i = end;
        }
    }

    /// Searches postures in a range of open cells, at values of the free joint and with joint 5 fixed near
    /// the fold.
    void look_at_fold(int gc, double lower, double upper) noexcept {
        const ChainCells& cells = branch_[gc]->judge.cells;
        const double side = 1.0 / (tuning_.samples - 1);
        for (int k = 0; k < tuning_.samples; ++k) {
            ChainPosture at;
            const double free = lower + side * k * (upper - lower);
            if (cells.posture(free, at) == Status::OK) take(at, gc, free);
        }
        ChainPosture fold;
        nominal_posture(arm_.nominal, cells.flange(), cells.theta_7_of(0.5 * (lower + upper)),
                        configuration(gc), fold.angle);
        const double sine = fold.angle[4].sin < 0 ? -1.0 : 1.0;
        for (int k = 0; k < tuning_.samples; ++k) {
            ChainPosture at = fold;
            const SinCos<double> by = sin_cos((2.0 * side * k - 1.0) * tuning_.near_fold);
            at.angle[4] = {sine * by.cos, -by.sin};
            solve_on_pose(arm_, cells.flange(), 4, posture_, at);
            take(at);
        }
    }

    /// Moves the best posture along its self-motion as long as the cost falls, by steps of joint 7 or joint
    /// 5.
    void polish(const Pose<double>& flange) noexcept {
        double step = tuning_.near_fold / tuning_.samples;
        for (int pass = 0; pass < tuning_.polish && step > tuning_.polished; ++pass) {
            bool better = false;
            for (const int held : {6, 4})
                for (const double by : {step, -step}) {
                    ChainPosture at = best_;
                    turn_joint(by, at.angle[held]);
                    solve_on_pose(arm_, flange, held, posture_, at);
                    better = take(at) || better;
                }
            if (!better) step *= 0.5;
        }
    }

    /// The Newton step (rad) of the free joint from the best posture to where the slope of the cost l2 is 0,
    /// with the derivatives `by` of the joints and `bend` of their slopes; NaN if the cost is not convex
    /// there.
    double to_level(const double (&by)[joints][joints], const double (&bend)[joints][joints]) const noexcept {
        double first = 0, second = 0;
        for (int j = 0; j < joints; ++j) {
            const double off = found_.q[j] - near_[j], rate = by[j][6];
            first += o_.weight[j] * off * rate;
            second += o_.weight[j] * (rate * rate + off * bend[j][6]);
        }
        return second > 0 ? -first / second : not_a_number;
    }
    /// The step (rad) of the free joint from the best posture to where the least distance to a limit is
    /// stationary, or where another one falls to its size.
    double to_largest(const double (&by)[joints][joints],
                      const double (&bend)[joints][joints]) const noexcept {
        const Limits& limits = arm_.nominal.own.limits;
        double distance[2 * joints], slope[2 * joints];
        int least = 0;
        for (int i = 0; i < 2 * joints; ++i) {
            const int j = i / 2;
            distance[i] = i % 2 == 0 ? found_.q[j] - limits.lower[j] : limits.upper[j] - found_.q[j];
            slope[i] = i % 2 == 0 ? by[j][6] : -by[j][6];
            if (distance[i] < distance[least]) least = i;
        }
        const double way = slope[least] < 0 ? -1.0 : 1.0, rise = abs(slope[least]),
                     second = bend[least / 2][6] * (least % 2 == 0 ? 1.0 : -1.0);
        double move = second < 0 ? rise / -second : infinity;
        for (int i = 0; i < 2 * joints; ++i) {
            const double closing = rise - way * slope[i];
            if (closing > 0) move = min(move, (distance[i] - distance[least]) / closing);
        }
        return way * move;
    }
    /// Moves the best posture to where the slope of the cost l2 is 0, or to the largest margin, by Newton's
    /// method: the cost alone tells half the digits of the free joint. Stops at limits, permitted arcs and
    /// obstacles.
    void settle() noexcept {
        const ChainCells& cells = branch_[found_.gc]->judge.cells;
        double before = infinity;
        for (int pass = 0; pass < tuning_.newton; ++pass) {
            const Jacobian jac = jacobian(arm_, found_.q);
            double by[joints][joints], bend[joints][joints];
            derivatives_at(arm_, found_.q, jac, by);
            slope_derivatives_at(arm_, found_.q, jac, by, bend);
            const double move = o_.metric == Metric::l2 ? to_level(by, bend) : to_largest(by, bend);
            if (!(abs(move) < before) || abs(move) <= tolerance::rounding) return;
            before = abs(move);
            ChainPosture at = best_;
            const double free = found_.psi + move;
            at.angle[6] = cells.theta_7_of(free);
            solve_on_pose(arm_, cells.flange(), 6, posture_, at);
            if (!is_of(arm_, configuration(found_.gc), at, posture_)) return;
            if (!take(at, found_.gc, free, cost_ + tie())) return;
        }
    }

    const OffsetChain& arm_;
    const Pose<double> pose_;
    const NearestOptions& o_;
    const Scene* const scene_;
    const OffsetChainNearestTuning& tuning_;
    const OffsetChainTuning posture_;
    double near_[joints], cost_ = infinity, left_open_ = infinity;
    std::optional<Branch> branch_[configurations];
    int count_ = 0, open_count_ = 0;
    Cell heap_[most_cells], open_[most_open];
    ChainPosture best_;
    Nearest found_ = unsolved(Status::LIMITS);
};

}  // namespace detail

/// The feasible, collision-free and allowed intervals of a branch; `scene` may be null.
inline ProvenArcs intervals_to_search(const OffsetChain& arm, const Pose<double>& exact, int gc,
                                      const ArcSet* allowed, const Scene* scene) noexcept {
    ProvenArcs out;
    Tag blocking = 0;
    feasible(arm, exact, gc, out);
    if (allowed && !out.arcs.empty()) {
        const ArcSet every = out.arcs;
        intersect(every, *allowed, out.arcs);
        if (out.arcs.empty()) out.status = Status::NOT_ALLOWED;
    }
    if (scene) keep_clear(arm, *scene, exact, gc, out, blocking);
    return out;
}

/// Returns the joints of a pose that cost least: over the branches and values of the free joint that may be
/// used, and all turns. The status is UNPROVEN if a solution that costs less is not excluded. With a scene,
/// only collision-free values are searched, and any unproven interval makes the answer UNPROVEN, or without a
/// solution NEAR_SINGULAR.
inline Nearest nearest_posture(const OffsetChain& arm, const Pose<double>& pose,
                               const NearestOptions& options, const Scene* scene = nullptr,
                               const OffsetChainNearestTuning& tuning = {}) noexcept {
    if (!scene) return detail::ChainSearch(arm, pose, options, nullptr, tuning).run();
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    if (rest_contact(arm, *scene, exact)) return detail::unsolved(Status::POSE_BLOCKED);
    Nearest best = detail::unsolved(Status::UNREACHABLE);
    bool unproven = false;
    for (int gc = 0; gc < configurations; ++gc) {
        if (!(options.branches >> gc & 1u)) continue;
        const ProvenArcs clear = intervals_to_search(arm, exact, gc, options.allowed, scene);
        unproven = unproven || clear.unproven > 0;
        Nearest found = detail::unsolved(clear.status);
        if (!clear.arcs.empty()) {
            NearestOptions one = options;
            one.branches = 1u << gc;
            one.allowed = &clear.arcs;
            found = detail::ChainSearch(arm, pose, one, scene, tuning).run();
        }
        if (is_solved(found.status)) unproven = unproven || found.status == Status::UNPROVEN;
        if (detail::is_better(found, best, options.metric)) best = found;
    }
    if (unproven) best.status = is_solved(best.status) ? Status::UNPROVEN : Status::NEAR_SINGULAR;
    return best;
}

/// Writes the best solution of each branch and interval to `out`, the best first, as many as fit. The status
/// is OK if there is one, otherwise that of nearest_posture().
inline void nearest_postures(const OffsetChain& arm, const Pose<double>& pose, const NearestOptions& options,
                             Nearests& out, const Scene* scene = nullptr,
                             const OffsetChainNearestTuning& tuning = {}) noexcept {
    out.count = 0;
    out.status = nearest_posture(arm, pose, options, scene, tuning).status;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    for (int gc = 0; gc < configurations; ++gc) {
        if (!(options.branches >> gc & 1u)) continue;
        const ArcSet open = intervals_to_search(arm, exact, gc, options.allowed, scene).arcs;
        for (int i = 0; i < open.count && out.count < Nearests::capacity; ++i) {
            NearestOptions one = options;
            ArcSet own;
            make_arc(own, open.arc[i].lower, open.arc[i].upper, 0, 0);
            if (open.full) make_full(own);
            one.branches = 1u << gc;
            one.allowed = &own;
            const Nearest found = detail::ChainSearch(arm, pose, one, scene, tuning).run();
            if (!is_solved(found.status)) continue;
            int at = out.count++;
            for (; at > 0 && detail::is_better(found, out.found[at - 1], options.metric); --at)
                out.found[at] = out.found[at - 1];
            out.found[at] = found;
        }
    }
    if (out.count > 0) out.status = Status::OK;
}

}  // namespace armangle

#include "../../names/end.hpp"
