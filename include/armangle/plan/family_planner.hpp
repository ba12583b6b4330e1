// The whole path at once, for any arm whose self-motion is a closed form: for each branch the arcs of the
// free number along the path, one search over postures on them, its descent to an optimum, a spline, its
// proof.
//
//     path -> sections -> search -> descent -> spline -> certify -> plan
//                ^          | no way    ^                   | a limit is broken, or it is open, there
//                +----------+           +-- more sections --+
//
// The search is dynamic programming over a grid of each arc; a link is how far, and how fast, the joints
// move. The descent is Newton's method on the numbers at all sections at once: travel and duration make a
// tridiagonal system (Gauss-Newton), margins and wishes its diagonal.
#pragma once

#include <algorithm>
#include <vector>

#include "family_curve.hpp"
#include "family_tuning.hpp"
#include "planner.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Plans a path for one arm of any kind. The singularity margin is the arm's own, that of PlanOptions is
/// ignored, and so is a free roll.
template <planned_family F>
class FamilyPlanner {
public:
    /// Keeps the path of n segments and computes the redundant parameter and branch of given start and goal
    /// joints.
    FamilyPlanner(const F& family, const Segment* segments, std::size_t n, const PlanOptions& options,
                  const FamilyTuning& tuning)
        : family_(family),
          path_(segments, n),
          options_(options),
          objective_(options.objective),
          tuning_(tuning),
          limits_(drawn_in(family.rows().limits, options.limit_margin)) {
        for (int j = 0; j < joints; ++j) has_a_turn_[j] = has_a_turn(limits_, j);
        if (options.start) ends_[0] = end(options.start, 0.0);
        if (options.goal) ends_[1] = end(options.goal, 1.0);
    }

    /// Plans the path and returns the plan or the reports of its failure.
    Plan run() {
        survey();
        for (Branch& branch : branches_) find_way(branch);
        std::stable_sort(branches_.begin(), branches_.end(),
                         [](const Branch& a, const Branch& b) { return before(a.report, b.report); });
        for (Branch& branch : branches_) {
            if (plan_.ok && plan_.proof.certified()) break;
            if (branch.report.verdict != Verdict::ok) continue;
            draw(branch);
        }
        if (!plan_.ok) draw_part();
        for (Branch& branch : branches_) {
            explain(branch);
            plan_.branches.push_back(branch.report);
        }
        std::stable_sort(plan_.branches.begin(), plan_.branches.end(),
                         [this](const BranchReport& a, const BranchReport& b) {
                             if ((a.gc == plan_.gc) != (b.gc == plan_.gc)) return a.gc == plan_.gc;
                             return a.gc != plan_.gc && before(a, b);
                         });
        plan_.start_gap = ends_[0].gap;
        plan_.goal_gap = ends_[1].gap;
        if (options_.advanced) options_.advanced();
        return std::move(plan_);
    }

private:
    struct Section {
        double s;
        Pose<double> pose;
        ArcSet arcs, unproven;  // all that may be used, and what of it is not proven
        Status status;
        Tag pair;       // that touches, where obstacles leave nothing
        double wished;  // the target of the redundant parameter; NaN if none is best
    };
    /// A configuration with two derivatives with respect to the redundant parameter.
    struct State {
        double free, q[joints], slope[joints], theta[joints];
        double cost, cost_1, cost_2;  // of margins and the wish
        double margin, elbow_margin;
    };
    struct Branch {
        BranchReport report;
        std::vector<Section> sections;
        std::vector<State> way;  // at the first sections, all of them where there is a way
        double cost = infinity;
    };
    /// A start or a goal.
    struct End {
        const double* q = nullptr;
        double lambda = 0, gap = 0;
        int gc = -1;
    };
    struct Node {
        State state;
        double cost;
        int from;
    };

    /// Whether branch a comes before b: those with a path by cost, then the others by how far they lead.
    static bool before(const BranchReport& a, const BranchReport& b) noexcept {
        if ((a.verdict == Verdict::ok) != (b.verdict == Verdict::ok)) return a.verdict == Verdict::ok;
        if (a.verdict == Verdict::ok) return a.cost < b.cost;
        return a.elsewhere != b.elsewhere ? b.elsewhere : a.reached > b.reached;
    }
    /// Calls the caller's checkpoint, if any, which may throw to stop the computation.
    void pass_checkpoint() const {
        if (options_.checkpoint) options_.checkpoint();
    }
    /// The pose at s.
    Pose<double> pose(double s) const noexcept {
        return pose_at(path_[segment_index(path_.data(), path_.size(), s)], s);
    }

    // -- postures

    /// Computes the configuration of a value of the redundant parameter, in the revolution nearest to `near`,
    /// or to the middles of the limits if it is null. False if there is no solution.
    bool state(const Section& at, int gc, double free, const double* near, State& out) const noexcept {
        using J = Jet<double, 2>;
        const Arm& rows = family_.rows();
        const Mat3<double>& turned = at.pose.rotation;
        const Pose<J> fixed{{spread<J>(turned.x), spread<J>(turned.y), spread<J>(turned.z)},
                            spread<J>(at.pose.position)};
        Directions<J> d;
        if (!(family_.place(fixed, gc, J::variable(free), near, d).value() > 0)) return false;
        J theta[joints], cost(0.0);
        out.free = free;
        out.margin = out.elbow_margin = infinity;
        const Objective& w = objective_;
        const auto weigh = [&](const J& distance, Kind kind, double& margin) {
            if (!(weight(w, kind) > 0)) return;
            margin = min(margin, distance.value());
            cost = cost + J(weight(w, kind)) * armangle::cost(distance, kind, w.enough);
        };
        for (int j = 0; j < joints; ++j) {
            theta[j] = atan2(d.y[j], d.x[j]);
            out.theta[j] = theta[j].value();
            const double value = to_q(rows, j, out.theta[j]);
            out.q[j] = lift(value, near ? near[j] : rows.joint_middle[j]);
            J q = theta[j] * J(rows.sign[j]);
            q.coefficient[0] = out.q[j];
            out.slope[j] = q.coefficient[1];
            double& margin = j == 3 ? out.elbow_margin : out.margin;
            if (limits_.lower[j] > -infinity) weigh(q - J(limits_.lower[j]), Kind::limit, margin);
            if (limits_.upper[j] < infinity) weigh(J(limits_.upper[j]) - q, Kind::limit, margin);
        }
        family_.singular_distances(theta, [&](const J& x) { weigh(x, Kind::singularity, out.margin); });
        cost = cost * J(margin_scale(length_));
        if (!is_nan(at.wished)) {
            const J off = J::variable(free) - J(at.wished);
            cost = cost + J(w.psi * wish_scale(length_)) * (J(2.0) - J(2.0) * sin_cos(off).cos);
        }
        out.cost = cost.value();
        out.cost_1 = cost.coefficient[1];
        out.cost_2 = 2 * cost.coefficient[2];
        return out.cost == out.cost;
    }

    /// The same, and false if the value is not proven and touches an obstacle.
    bool clear_state(const Section& at, int gc, double free, const double* near, State& out) const noexcept {
        return state(at, gc, free, near, out) && !touches(at, free, out.q);
    }
    /// Whether joints of a section touch an obstacle; false where that is proven of their redundant
    /// parameter.
    bool touches(const Section& at, double free, const double* q) const noexcept {
        if (!options_.scenes || find(at.unproven, wrap(free)).index < 0) return false;
        return !is_clear(family_.arm(), options_.scenes.at(at.s), q);
    }

    /// The difference of two values of joint j (rad): the shorter way round if its range is at least 2 pi.
    double way(int j, double from, double to) const noexcept {
        return has_a_turn_[j] ? wrap(to - from) : to - from;
    }

    /// The place of given joints at an end of the path; `gap` is infinite if they do not solve its pose.
    End end(const double* q, double s) const noexcept {
        const OnSelfMotion on = family_.on(q);
        End out{q, on.lambda, infinity, on.gc};
        Directions<double> d;
        if (!(family_.place(pose(s), on.gc, on.lambda, q, d) >= 0)) return out;
        out.gap = 0;
        for (int j = 0; j < joints; ++j) {
            const double there = to_q(family_.rows(), j, atan2(d.y[j], d.x[j]));
            out.gap = max(out.gap, abs(lift(there, q[j]) - q[j]));
        }
        return out;
    }

    // -- sections

    /// Computes the sections at s of the branches in `asked` (bits).
    void look(double s, unsigned asked, Section (&out)[configurations]) const {
        pass_checkpoint();
        const Pose<double> at = pose(s);
        find_arcs(s, at, limits_, asked, out);
        for (int gc = 0; gc < configurations; ++gc)
            if (asked >> gc & 1u) out[gc].wished = wished(s, at, gc);
    }
    /// Writes sections without a target: the arcs within these limits that the user permits and in which the
    /// arm is collision-free, or the reason for none.
    void find_arcs(double s, const Pose<double>& at, const Limits& limits, unsigned asked,
                   Section (&out)[configurations]) const {
        ProvenArcs found[configurations];
        family_.arcs(at, limits, asked, found);
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(asked >> gc & 1u)) continue;
            Tag pair = 0;
            keep_open(s, at, gc, found[gc], pair);
            out[gc] = {s, at, found[gc].arcs, found[gc].open, found[gc].status, pair, not_a_number};
        }
    }
    /// Reduces arcs to those that the user permits and in which the arm is collision-free; `pair` is the one
    /// that leaves none. Unless the family is explicit, found.open becomes what is proven neither way, and is
    /// added to the arcs: the proof of the curve decides there.
    void keep_open(double s, const Pose<double>& at, int gc, ProvenArcs& found, Tag& pair) const {
        ArcSet open = found.open, all;
        if constexpr (explicit_family<F>) make_empty(open);
        if (options_.allowed && !(found.arcs.empty() && open.empty())) {
            const ArcSet may = permitted(s);
            for (ArcSet* arcs : {&found.arcs, &open}) {
                const ArcSet own = *arcs;
                intersect(own, may, *arcs);
            }
            if (found.arcs.empty()) found.status = Status::NOT_ALLOWED;
        }
        const ScenesAlong& scenes = options_.scenes;
        for (int k = scenes ? scenes.first(s) : 0; scenes && k <= scenes.last(s) && !found.arcs.empty();
             ++k) {
            ArcSet left;
            keep_clear(family_.arm(), scenes[k], at, gc, found, pair, false, {}, &left);
            if (found.status == Status::POSE_BLOCKED) make_empty(open);
            if (explicit_family<F> || left.empty()) continue;
            unite(open, left, all);
            open = all;
        }
        found.open = open;
        if (open.empty()) return;
        unite(found.arcs, open, all);
        found.arcs = all;
        found.status = Status::OK;
    }
    /// The arcs that the user permits at s.
    ArcSet permitted(double s) const {
        ArcSet out;
        make_empty(out);
        options_.allowed(s, out);
        return out;
    }
    /// The target of the redundant parameter at s; NaN if there is none, or all values are equally good.
    double wished(double s, const Pose<double>& at, int gc) const noexcept {
        const WishAlong* const wish = options_.wish;
        if (!wish || !(objective_.psi > 0)) return not_a_number;
        if (wish->kind == Wish::psi) return wish->psi_at(s);
        return psi_towards(family_.arm(), at, gc, {wish->kind, not_a_number, wish->target}).psi;
    }

    /// Computes sections at equal distances along the tool's path and at changes of the scene, for all
    /// permitted branches that contain the given ends.
    void survey() {
        const double reach = family_.rows().reach;
        constexpr int parts = 8;
        std::vector<double> at{0.0}, gone{0.0};
        Pose<double> last = pose(0.0);
        for (const Segment& g : path_)
            for (int k = 1; k <= parts; ++k) {
                const double s = k < parts ? g.start + (g.end - g.start) * k / parts : g.end;
                const Pose<double> here = pose_at(g, s);
                const Twist moved = difference(last, here);
                length_ += norm(moved.linear) / reach + norm(moved.angular);
                at.push_back(s);
                gone.push_back(length_ + tuning_.spacing * s);
                last = here;
            }
        length_ = max(length_, tube_parameter_tuning::least_length);
        weigh_joints(options_.bounds, length_, objective_);
        const double whole = gone.back();
        const int count =
            std::max(tuning_.least_sections - 1, static_cast<int>(std::ceil(whole / tuning_.spacing)));
        std::vector<double> base{0.0};
        std::size_t i = 1;
        for (int k = 1; k < count; ++k) {
            const double wanted = whole * k / count;
            while (i + 1 < gone.size() && gone[i] < wanted) ++i;
            const double share = (wanted - gone[i - 1]) / (gone[i] - gone[i - 1]);
            base.push_back(at[i - 1] + share * (at[i] - at[i - 1]));
        }
        base.push_back(1.0);
        most_sections_ = base.size() * static_cast<std::size_t>(tuning_.rounds);
        most_looks_ = static_cast<int>(most_sections_) * tuning_.proof.looks;
        for (int k = 1; k < options_.scenes.count; ++k) base.push_back(options_.scenes.begin(k));
        if (options_.scenes.count > 1) tidy(base);
        unsigned asked = options_.branches;
        for (const End& end : ends_)
            if (end.q) asked &= 1u << end.gc;
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(options_.branches >> gc & 1u)) continue;
            Branch& branch = branches_.emplace_back();
            branch.report.gc = gc;
            for (int k = 0; k < 2; ++k)
                if (ends_[k].q && ends_[k].gc != gc) {
                    branch.report.verdict = k ? Verdict::goal : Verdict::start;
                    branch.report.from = branch.report.to = k;
                    branch.report.elsewhere = true;
                }
        }
        Section all[configurations];
        for (const double s : base) {
            look(s, asked, all);
            for (Branch& branch : branches_)
                if (!branch.report.elsewhere) branch.sections.push_back(all[branch.report.gc]);
        }
    }

    /// Inserts a section of the branch half way between its sections k and k + 1; false, without a change, if
    /// they are too close.
    bool halve(Branch& branch, std::size_t k) const {
        const double a = branch.sections[k].s, b = branch.sections[k + 1].s, s = 0.5 * (a + b);
        if (!(b - a > tube_parameter_tuning::same)) return false;
        Section all[configurations];
        look(s, 1u << branch.report.gc, all);
        branch.sections.insert(branch.sections.begin() + static_cast<std::ptrdiff_t>(k) + 1,
                               all[branch.report.gc]);
        return true;
    }

    // -- search

    /// Whether the arcs of a section contain a given end, up to rounding, which does not touch an obstacle.
    bool is_held(const Section& at, const End& end) const noexcept {
        return abs(wrap(nearest(at.arcs, wrap(end.lambda)) - end.lambda)) <= tuning_.beside &&
               !touches(at, end.lambda, end.q);
    }
    /// The start or goal that section k must use; null: none.
    const End* anchor(const Branch& branch, std::size_t k) const noexcept {
        if (k == 0 && ends_[0].q) return &ends_[0];
        return k + 1 == branch.sections.size() && ends_[1].q ? &ends_[1] : nullptr;
    }

    /// The configurations of section k that the search tries: that of a given end, or some on each arc; empty
    /// if the section has no arc, or not that of the end.
    std::vector<Node> nodes(const Branch& branch, std::size_t k) const {
        std::vector<Node> out;
        const Section& section = branch.sections[k];
        const auto add = [&](double free, const double* near) {
            Node node{{}, infinity, -1};
            if (clear_state(section, branch.report.gc, free, near, node.state) &&
                within_limits(limits_, node.state.q, tolerance::angle))
                out.push_back(node);
        };
        if (const End* end = anchor(branch, k)) {
            if (is_held(section, *end)) add(end->lambda, end->q);
            return out;
        }
        for (int i = 0; i < section.arcs.count; ++i) {
            const Arc& arc = section.arcs.arc[i];
            const double width = arc.upper - arc.lower;
            const double inset = min(tuning_.inset, tuning_.inset_share * width);
            const double low = arc.lower + inset, high = arc.upper - inset;
            const double first = std::ceil(low / tuning_.step) * tuning_.step;
            add(low, nullptr);
            for (double free = first; free < high; free += tuning_.step)
                if (free > low) add(free, nullptr);
            if (high > low) add(high, nullptr);
        }
        return out;
    }

    /// Finds the path of least cost from section to section, stores it in the branch as far as it leads, and
    /// returns the number of sections reached.
    std::size_t search(Branch& branch) const {
        std::vector<std::vector<Node>> layer;
        const Objective& w = objective_;
        for (std::size_t k = 0; k < branch.sections.size(); ++k) {
            pass_checkpoint();
            std::vector<Node> here = nodes(branch, k);
            bool reached = k == 0 && !here.empty();
            for (Node& to : here) {
                if (k == 0) {
                    to.cost = 0;
                    continue;
                }
                const double ds = branch.sections[k].s - branch.sections[k - 1].s;
                const std::vector<Node>& last = layer.back();
                for (std::size_t i = 0; i < last.size(); ++i) {
                    const Node& from = last[i];
                    if (!(from.cost < to.cost)) continue;
                    double sum = 0, most = 0, rate[joints];
                    for (int j = joints - 1; j >= 0 && most <= tuning_.link; --j) {
                        const double move = way(j, from.state.q[j], to.state.q[j]);
                        most = max(most, abs(move));
                        sum += move * move;
                        rate[j] = move / ds;
                    }
                    if (most > tuning_.link) continue;
                    double cost =
                        from.cost + w.travel * sum / ds + 0.5 * ds * (from.state.cost + to.state.cost);
                    if (!(cost < to.cost)) continue;
                    cost += ds * hurry(w, length_, rate);
                    if (!(cost < to.cost)) continue;
                    to.cost = cost;
                    to.from = static_cast<int>(i);
                    reached = true;
                }
            }
            if (!reached) break;
            std::erase_if(here, [](const Node& node) { return !(node.cost < infinity); });
            layer.push_back(std::move(here));
        }
        branch.way.clear();
        if (layer.empty()) return 0;
        const auto least = std::min_element(layer.back().begin(), layer.back().end(),
                                            [](const Node& a, const Node& b) { return a.cost < b.cost; });
        std::size_t at = static_cast<std::size_t>(least - layer.back().begin());
        branch.way.resize(layer.size());
        for (std::size_t k = layer.size(); k-- > 0;) {
            branch.way[k] = layer[k][at].state;
            at = static_cast<std::size_t>(std::max(layer[k][at].from, 0));
        }
        return layer.size();
    }

    /// Finds a path in a branch, with sections added where it ends, or writes the report why there is none.
    void find_way(Branch& branch) {
        BranchReport& report = branch.report;
        if (report.elsewhere || refuses_start(branch)) return advance();
        std::size_t reached = 0;
        for (int round = 0; round <= tuning_.rounds; ++round) {
            if (is_shut(branch)) break;
            reached = search(branch);
            if (reached == branch.sections.size() || reached == 0) break;
            report.given_up = round == tuning_.rounds;
            if (report.given_up || !halve(branch, reached - 1)) break;
            if (reached >= 2) halve(branch, reached - 2);
        }
        report.sections = static_cast<unsigned>(branch.sections.size());
        if (report.verdict == Verdict::ok && reached < branch.sections.size()) {
            const std::size_t k = reached;
            const bool at_start = k == 0 && ends_[0].q;
            const bool at_goal =
                k + 1 == branch.sections.size() && ends_[1].q && !is_held(branch.sections[k], ends_[1]);
            const bool unproven = !branch.sections[k].unproven.empty();
            report.verdict = report.given_up || unproven ? Verdict::unresolved : Verdict::dead_end;
            if (at_start) report.verdict = Verdict::start;
            if (at_goal) report.verdict = Verdict::goal;
            report.status = unproven ? Status::NEAR_SINGULAR : Status::LIMITS;
            report.from = report.to = branch.sections[k > 0 ? k - 1 : 0].s;
            report.reached = report.from;
            if (at_start) refuses(ends_[0], 0.0, report);
            if (at_goal) refuses(ends_[1], 1.0, report);
        }
        if (report.verdict == Verdict::ok) {
            lift_way(branch);
            descend(branch);
            take_margins(branch, report);
        }
        advance();
    }
    /// Reports progress.
    void advance() const {
        if (options_.advanced) options_.advanced();
    }

    /// Whether limits, the user or obstacles refuse the start; if so, reports why.
    bool refuses_start(Branch& branch) const {
        BranchReport& report = branch.report;
        if (!ends_[0].q || is_held(branch.sections.front(), ends_[0]) || !refuses(ends_[0], 0.0, report))
            return false;
        report.verdict = Verdict::start;
        report.sections = static_cast<unsigned>(branch.sections.size());
        return true;
    }
    /// Whether an end at s violates its limits, is not permitted by the user, or is too near to an obstacle;
    /// if so, reports which.
    bool refuses(const End& end, double s, BranchReport& report) const {
        if (!within_limits(limits_, end.q, tolerance::angle)) {
            report.status = Status::LIMITS;
            return true;
        }
        Limits apart = limits_;
        family_.keep_margin(end.q, apart);
        if (!within_limits(apart, end.q, tolerance::angle)) {
            report.status = Status::NEAR_SINGULAR;
            return true;
        }
        if (options_.allowed && find(permitted(s), end.lambda, tuning_.beside).index < 0) {
            report.status = Status::NOT_ALLOWED;
            return true;
        }
        if (!options_.scenes) return false;
        const Scene& scene = options_.scenes.at(s);
        const Proximity near = proximity(family_.arm(), scene, end.q, {});
        if (!(near.distance < scene.clearance)) return false;
        report.status = Status::CLEARANCE;
        report.touching = near.pair;
        report.shortfall = scene.clearance - near.distance;
        return true;
    }

    /// Whether some section has no arc. If so, writes to the report of the branch where, why (out of reach
    /// before any other reason), and how far a path leads.
    bool is_shut(Branch& branch) const {
        BranchReport& report = branch.report;
        const auto shut = [](const Section& x) { return x.arcs.empty(); };
        const auto first = std::find_if(branch.sections.begin(), branch.sections.end(), shut);
        if (first == branch.sections.end()) return false;
        const auto last = std::find_if_not(first, branch.sections.end(), shut);
        const auto beyond =
            std::find_if(first, last, [](const Section& x) { return x.status == Status::UNREACHABLE; });
        const Section& named = beyond != last ? *beyond : *first;
        report.from = named.s;
        report.to = (last - 1)->s;
        report.status = named.status;
        report.touching = named.pair;
        report.verdict = beyond != last ? Verdict::unreachable : Verdict::impossible;
        const std::vector<Section> ahead(branch.sections.begin(), first);
        if (!ahead.empty()) {
            Branch part;
            part.report.gc = report.gc;
            part.sections = ahead;
            const std::size_t reached = search(part);
            if (reached > 0) report.reached = ahead[reached - 1].s;
            branch.way = std::move(part.way);
        }
        for (auto at = first; at != last; ++at) report.excess = max(report.excess, family_.excess(at->pose));
        return true;
    }

    // -- descent

    /// The cost of the motion from one configuration to another over ds.
    double moving(const State& a, const State& b, double ds) const noexcept {
        double sum = 0, rate[joints];
        for (int j = 0; j < joints; ++j) {
            sum += (b.q[j] - a.q[j]) * (b.q[j] - a.q[j]);
            rate[j] = (b.q[j] - a.q[j]) / ds;
        }
        return objective_.travel * sum / ds + ds * hurry(objective_, length_, rate);
    }
    /// The part of s that section k represents.
    double share_of(const std::vector<Section>& x, std::size_t k, std::size_t n) const noexcept {
        return 0.5 * ((k + 1 < n ? x[k + 1].s : x[k].s) - (k > 0 ? x[k - 1].s : x[k].s));
    }
    /// The objective of a path: distances from limits and target, travel and duration, summed over sections.
    double cost_of(const Branch& branch, const std::vector<State>& way) const noexcept {
        double sum = 0;
        for (std::size_t k = 0; k < way.size(); ++k) {
            sum += share_of(branch.sections, k, way.size()) * way[k].cost;
            if (k + 1 < way.size())
                sum += moving(way[k], way[k + 1], branch.sections[k + 1].s - branch.sections[k].s);
        }
        return sum;
    }

    /// Adds turns of 2 pi to the joints of the branch's path, so that they are continuous and, if possible,
    /// within the limits. It begins at the given start, else ends at the given goal, else begins in the
    /// revolution with the fewest turns.
    void lift_way(Branch& branch) const noexcept {
        std::vector<State>& way = branch.way;
        if (way.empty()) return;
        for (std::size_t k = 1; k < way.size(); ++k) way[k].free = lift(way[k].free, way[k - 1].free);
        for (int j = 0; j < joints; ++j) {
            if (ends_[0].q) way[0].q[j] = lift(way[0].q[j], ends_[0].q[j]);
            double low = way[0].q[j], high = low;
            for (std::size_t k = 1; k < way.size(); ++k) {
                way[k].q[j] = lift(way[k].q[j], way[k - 1].q[j]);
                low = min(low, way[k].q[j]);
                high = max(high, way[k].q[j]);
            }
            if (ends_[0].q) continue;
            double turn = 0;  // as few as keep the limits; of a goal its own
            const double under = limits_.lower[j] - low - tolerance::angle,
                         over = high - limits_.upper[j] - tolerance::angle;
            if (under > 0) turn = std::ceil(under / two_pi);
            if (over > 0) turn = -std::ceil(over / two_pi);
            if (ends_[1].q) turn = round((ends_[1].q[j] - way.back().q[j]) / two_pi);
            for (State& at : way) at.q[j] += two_pi * turn;
        }
    }

    /// The value near `wanted` within the arc of a section that contains `free`, slightly inside its ends.
    double within_arc(const Section& section, double free, double wanted) const noexcept {
        const double at = nearest(section.arcs, wrap(free));
        for (int i = 0; i < section.arcs.count; ++i) {
            const Arc& arc = section.arcs.arc[i];
            const double middle = 0.5 * (arc.lower + arc.upper), half = 0.5 * (arc.upper - arc.lower);
            if (abs(lift(at, middle) - middle) > half + tolerance::angle) continue;
            if (half >= pi - tolerance::angle) return wanted;
            const double room =
                half - min(tuning_.inset, 2 * tuning_.inset_share * half) * tuning_.inset_share;
            const double moved = wanted - free + lift(free, middle);
            return wanted + (min(max(moved, middle - room), middle + room) - moved);
        }
        return free;
    }

    /// The derivatives of the cost of duration between two sections by their redundant parameters, the
    /// second ones without the bend of the joints.
    struct Haste {
        double from = 0, to = 0, from_from = 0, from_to = 0, to_to = 0;
    };
    /// The derivatives of the cost of duration for two configurations ds apart, by their redundant
    /// parameters.
    Haste haste_of(const State& a, const State& b, double ds) const noexcept {
        double rate[joints];
        for (int j = 0; j < joints; ++j) rate[j] = (b.q[j] - a.q[j]) / ds;
        const double weight = objective_.duration * length_, n = pace(objective_.slowness, rate);
        Haste out;
        for (int j = 0; j < joints; ++j) {
            const auto [slope, curved] = pace_slope(objective_.slowness[j], rate[j], n);
            out.from -= slope * a.slope[j];
            out.to += slope * b.slope[j];
            out.from_from += curved * a.slope[j] * a.slope[j];
            out.from_to -= curved * a.slope[j] * b.slope[j];
            out.to_to += curved * b.slope[j] * b.slope[j];
        }
        out.from_from = weight / ds * (out.from_from - 7 / n * out.from * out.from);
        out.from_to = weight / ds * (out.from_to - 7 / n * out.from * out.to);
        out.to_to = weight / ds * (out.to_to - 7 / n * out.to * out.to);
        out.from *= weight;
        out.to *= weight;
        return out;
    }

    /// Lowers the objective of the branch's path by Newton steps of the redundant parameter at all sections
    /// that are not fixed.
    void descend(Branch& branch) const {
        std::vector<State>& way = branch.way;
        const std::vector<Section>& at = branch.sections;
        const std::size_t n = way.size();
        const double w = 2 * objective_.travel;
        std::vector<double> diagonal(n), beside(n), move(n);
        branch.cost = cost_of(branch, way);
        for (int step = 0; step < tuning_.steps; ++step) {
            pass_checkpoint();
            for (std::size_t k = 0; k < n; ++k) {
                const double share = share_of(at, k, n);
                diagonal[k] = share * max(way[k].cost_2, 0.0);
                move[k] = -share * way[k].cost_1;
                beside[k] = 0;
            }
            for (std::size_t k = 0; k + 1 < n; ++k) {
                const double per = w / (at[k + 1].s - at[k].s);
                for (int j = 0; j < joints; ++j) {
                    const double d = way[k + 1].q[j] - way[k].q[j], a = way[k].slope[j],
                                 b = way[k + 1].slope[j];
                    diagonal[k] += per * a * a;
                    diagonal[k + 1] += per * b * b;
                    beside[k] -= per * a * b;
                    move[k] += per * d * a;
                    move[k + 1] -= per * d * b;
                }
                if (objective_.duration > 0) {
                    const Haste haste = haste_of(way[k], way[k + 1], at[k + 1].s - at[k].s);
                    diagonal[k] += haste.from_from;
                    diagonal[k + 1] += haste.to_to;
                    beside[k] += haste.from_to;
                    move[k] -= haste.from;
                    move[k + 1] -= haste.to;
                }
            }
            for (std::size_t k = 0; k < n; ++k) {
                const bool held = anchor(branch, k) != nullptr;
                if (held) {
                    diagonal[k] = 1;
                    move[k] = beside[k] = 0;
                    if (k > 0) beside[k - 1] = 0;
                }
                diagonal[k] = diagonal[k] * (1 + 1e-9) + 1e-12;
            }
            for (std::size_t k = 1; k < n; ++k) {
                const double factor = beside[k - 1] / diagonal[k - 1];
                diagonal[k] -= factor * beside[k - 1];
                move[k] -= factor * move[k - 1];
            }
            double most = 0;
            for (std::size_t k = n; k-- > 0;) {
                move[k] = (move[k] - (k + 1 < n ? beside[k] * move[k + 1] : 0.0)) / diagonal[k];
                most = max(most, abs(move[k]));
            }
            const double before = branch.cost;
            double share = most > tuning_.farthest ? tuning_.farthest / most : 1.0;
            for (; share * most > tolerance::angle; share *= 0.5) {
                std::vector<State> next(n);
                bool there = true;
                for (std::size_t k = 0; k < n && there; ++k) {
                    const double wanted = way[k].free + share * move[k];
                    const double free =
                        anchor(branch, k) ? way[k].free : within_arc(at[k], way[k].free, wanted);
                    there = clear_state(at[k], branch.report.gc, free, way[k].q, next[k]);
                }
                const double cost = there ? cost_of(branch, next) : infinity;
                if (!(cost < branch.cost)) continue;
                way = std::move(next);
                branch.cost = cost;
                break;
            }
            if (!(before - branch.cost > tuning_.settled * before)) return;
        }
    }

    // -- the curve

    /// The stretches of a spline of the redundant parameter through the branch's path.
    std::vector<Stretch> curve_of(const Branch& branch) const {
        std::vector<double> s, free;
        for (std::size_t k = 0; k < branch.way.size(); ++k) {
            s.push_back(branch.sections[k].s);
            free.push_back(branch.way[k].free);
        }
        std::vector<Stretch> out = stretches_of(spline(s, s, free), path_);
        while (out.size() > 1 && out.back().start >= s.back()) out.pop_back();
        lift_stretches(FamilyCurve<F>{family_, branch.report.gc, path_, out}, out, branch.way[0].q);
        return out;
    }

    /// Inserts sections and configurations into the branch's path where the proof is open, and minimizes
    /// again; false if nothing was inserted, or if that would be more sections than a branch may have.
    bool refine(Branch& branch, const Proof& proof) const {
        if (branch.sections.size() > most_sections_) return false;
        std::vector<Section> sections{branch.sections[0]};
        std::vector<State> way{branch.way[0]};
        bool finer = false;
        for (std::size_t k = 1; k < branch.sections.size(); ++k) {
            const double a = branch.sections[k - 1].s, b = branch.sections[k].s;
            bool open = false;
            for (std::size_t i = 0; i < proof.open.size(); i += 2)
                open = open || (proof.open[i] < b && proof.open[i + 1] > a);
            if (open && b - a > tube_parameter_tuning::same) {
                Section all[configurations];
                look(0.5 * (a + b), 1u << branch.report.gc, all);
                const Section& half = all[branch.report.gc];
                if (half.arcs.empty()) return false;
                const State &from = way.back(), &to = branch.way[k];
                const double between = 0.5 * (from.free + to.free);
                const double moved = between + wrap(nearest(half.arcs, wrap(between)) - between);
                State here;
                if (!clear_state(half, branch.report.gc, within_arc(half, moved, moved), from.q, here))
                    return false;
                sections.push_back(half);
                way.push_back(here);
                finer = true;
            }
            sections.push_back(branch.sections[k]);
            way.push_back(branch.way[k]);
        }
        branch.sections = std::move(sections);
        branch.way = std::move(way);
        branch.report.sections = static_cast<unsigned>(branch.sections.size());
        if (finer) descend(branch);
        return finer;
    }

    /// Proves a curve of a branch, and reduces `looks` by the cells that this takes. Where the user permits
    /// arcs by the pose, nothing is known between the ends of its stretches.
    Proof proven(int gc, const std::vector<Stretch>& stretches, int& looks) const {
        const bool asks = options_.allowed && !options_.allowed_everywhere;
        return certify(FamilyCurve<F>{family_, gc, path_, stretches}, limits_,
                       {options_.scenes, options_.allowed_everywhere, false, &options_.checkpoint},
                       tuning_.proof, looks, [&](const Stretch& x) {
                           return !asks || (find(permitted(x.start), phi_at(x, x.start)).index >= 0 &&
                                            find(permitted(x.end), phi_at(x, x.end)).index >= 0);
                       });
    }

    /// Draws the curve of a branch and proves it, with more sections where the proof fails, as long as that
    /// takes no more cells than a branch may have. A curve without a known violation becomes the plan if less
    /// of it is open; if there is none, the report says why.
    void draw(Branch& branch) {
        BranchReport& report = branch.report;
        int looks = most_looks_;
        Branch finer = branch;
        Proof all;
        all.open = {0.0, 1.0};
        refine(finer, all);
        bool held = false;
        Proof proof;
        std::vector<Stretch> stretches;
        for (int round = 0; round <= tuning_.rounds; ++round) {
            stretches = curve_of(finer);
            proof = proven(report.gc, stretches, looks);
            const bool kept = proof.certified() || (proof.violated.empty() && looks > 0);
            held = held || kept;
            if (kept && (!plan_.ok || proof.open.size() < plan_.proof.open.size())) {
                plan_.ok = true;
                plan_.gc = report.gc;
                plan_.stretches = std::move(stretches);
                plan_.proof = proof;
                take_margins(finer, report);
            }
            if (proof.certified() || looks == 0 || !refine(finer, proof)) break;
            if (held) continue;
            if (is_shut(finer) || search(finer) < finer.sections.size())
                break;  // another way about that place
            lift_way(finer);
            descend(finer);
        }
        if (held) return;
        report.given_up = proof.violated.empty();
        const std::vector<double>& at = report.given_up ? proof.open : proof.violated;
        report.verdict = Verdict::unresolved;
        report.status = options_.scenes.count > 0 ? Status::CLEARANCE : Status::LIMITS;
        report.from = at.front();
        const FamilyCurve<F> curve{family_, report.gc, path_, stretches};
        Directions<double> d;
        if (!(curve.place(stretch_at(stretches, report.from), report.from, d) > tuning_.proof.least_room))
            report.status = Status::NO_POSTURE;
        report.to = at.back();
        report.reached = report.from;
        branch.sections = std::move(finer.sections);
        branch.way = std::move(finer.way);
    }
    /// Writes the cost of a path and its least distances (rad) from limits to `report`.
    void take_margins(const Branch& branch, BranchReport& report) const noexcept {
        report.margin = report.elbow_margin = infinity;
        for (const State& at : branch.way) {
            report.margin = min(report.margin, at.margin);
            report.elbow_margin = min(report.elbow_margin, at.elbow_margin);
        }
        report.cost = branch.cost;
    }

    /// If no path leads to the end, makes the proven beginning of the one that leads farthest the plan.
    void draw_part() {
        std::stable_sort(branches_.begin(), branches_.end(),
                         [](const Branch& a, const Branch& b) { return before(a.report, b.report); });
        for (Branch& branch : branches_) {
            if (branch.way.size() < 2) continue;
            lift_way(branch);
            plan_.stretches = curve_of(branch);
            int looks = most_looks_;
            const Proof proof = proven(branch.report.gc, plan_.stretches, looks);
            const double end = proof.certified() ? 1.0 : proof.open.front();
            while (!plan_.stretches.empty() && plan_.stretches.back().end > end) plan_.stretches.pop_back();
            plan_.gc = branch.report.gc;
            return;
        }
    }

    // -- why there is none

    /// Reports the limits that a start (goal) violates, those that leave no solution where a branch has none,
    /// and those that, widened alone, would leave some.
    void explain(Branch& branch) const {
        BranchReport& report = branch.report;
        for (int k = 0; k < 2; ++k)
            if (report.verdict == (k ? Verdict::goal : Verdict::start) && !report.elsewhere)
                for (int j = 0; j < joints; ++j) {
                    const double low = limits_.lower[j] - ends_[k].q[j],
                                 high = ends_[k].q[j] - limits_.upper[j];
                    if (max(low, high) > tolerance::angle)
                        report.openings.push_back({j + 1, high > low, max(low, high)});
                }
        if (report.verdict != Verdict::impossible || report.status != Status::LIMITS) return;
        std::vector<const Section*> shut;
        for (const Section& x : branch.sections)
            if (x.arcs.empty() && x.s >= report.from && x.s <= report.to) shut.push_back(&x);
        const auto opens = [&](const Section& x, const Limits& limits) {
            Section all[configurations];
            pass_checkpoint();
            find_arcs(x.s, x.pose, limits, 1u << report.gc, all);
            return !all[report.gc].arcs.empty();
        };
        Limits some = limits_;
        for (int j = 0; j < joints; ++j) {
            const Limits before = some;
            some.lower[j] = -infinity;
            some.upper[j] = infinity;
            if (!opens(*shut.front(), some)) continue;
            some = before;
            report.blocking |= 1u << j;
        }
        for (int j = 0; j < joints; ++j)
            for (const bool upper : {false, true}) {
                double extra = 0;
                for (int k = 0; k < tuning_.explained && extra < infinity; ++k) {
                    const std::size_t i = (shut.size() - 1) * static_cast<std::size_t>(k) /
                                          static_cast<std::size_t>(tuning_.explained - 1);
                    extra = max(extra, opening(*shut[i], j, upper, extra, opens));
                }
                if (extra < infinity) report.openings.push_back({j + 1, upper, 1.01 * extra});
            }
    }
    /// How far (rad) one limit of joint j (0 to 6) must be widened so that opens(x, limits). Returns `known`
    /// if that amount, above 0, suffices, infinity if 2 pi does not.
    template <class Opens>
    double opening(const Section& x, int j, bool upper, double known, const Opens& opens) const {
        const auto wider = [&](double by) {
            Limits out = limits_;
            (upper ? out.upper : out.lower)[j] += upper ? by : -by;
            return opens(x, out);
        };
        if (!(abs(upper ? limits_.upper[j] : limits_.lower[j]) < infinity) || !wider(two_pi)) return infinity;
        if (known > 0 && wider(known)) return known;
        double low = known, high = two_pi;
        for (int i = 0; i < tuning_.halvings; ++i) {
            const double middle = 0.5 * (low + high);
            (wider(middle) ? high : low) = middle;
        }
        return high;
    }

    const F family_;
    const std::span<const Segment> path_;
    const PlanOptions& options_;
    Objective objective_;  // with the slowness of the joints
    const FamilyTuning& tuning_;
    const Limits limits_;
    bool has_a_turn_[joints];
    double length_ = 0;              // how far the path turns the arm (rad)
    std::size_t most_sections_ = 0;  // of a branch; with more it is given up
    int most_looks_ = 0;             // at cells that the proofs of a branch may take
    End ends_[2];
    std::vector<Branch> branches_;
    Plan plan_;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
