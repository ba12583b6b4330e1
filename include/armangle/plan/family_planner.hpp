// The whole path at once, for any arm whose self-motion is a closed form: for each branch the arcs of the
// free number along the path, one search over postures on them, its descent to an optimum, a spline, its
// proof.
//
//     path -> sections -> search -> descent -> spline -> certify -> plan
//                ^          | no way    ^                   | a limit is broken, or it is open, there
//                +----------+           +-- more sections --+
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "branch_search.hpp"
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
    using Section = BranchSection;
    using State = BranchState;
    using Branch = SearchedBranch;
    using End = BranchEnd;

public:
    /// Keeps the path of n segments and computes the redundant parameter and branch of given start and goal
    /// joints.
    FamilyPlanner(const F& family, const Segment* segments, std::size_t n, const PlanOptions& options,
                  Work& work, const FamilyTuning& tuning)
        : family_(family),
          path_(segments, n),
          options_(options),
          work_(work),
          tuning_(tuning),
          limits_(drawn_in(family.rows().limits, options.limit_margin)),
          spread_(path_, family.rows().reach, tuning),
          objective_(with_slowness(options.objective, options.bounds, spread_.length)),
          search_(
              family, limits_, objective_, spread_.length, work, false,
              [this](double s, int gc) {
                  Section all[configurations];
                  look(s, 1u << gc, all);
                  return all[gc];
              },
              [this](double s, const double* q) { return touches(s, q); }, tuning) {
        if (options.start) ends_[0] = end(options.start, 0.0);
        if (options.goal) ends_[1] = end(options.goal, 1.0);
    }

    /// Plans the path and returns the plan or the reports of its failure.
    Plan run() {
        survey();
        for (Branch& branch : branches_) find_way(branch);
        std::stable_sort(branches_.begin(), branches_.end(),
                         [](const Branch& a, const Branch& b) { return before(a.report, b.report); });
        if (!options_.rate_only) draw_best();
        for (Branch& branch : branches_) {
            if (!options_.rate_only) explain(branch);
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
    /// Whether branch a comes before b: those with a path by cost, then the others by how far they lead.
    static bool before(const BranchReport& a, const BranchReport& b) noexcept {
        if ((a.verdict == Verdict::ok) != (b.verdict == Verdict::ok)) return a.verdict == Verdict::ok;
        if (a.verdict == Verdict::ok) return a.cost < b.cost;
        return a.elsewhere != b.elsewhere ? b.elsewhere : a.reached > b.reached;
    }

    /// The work of a section or a cell that takes this much with a closed form, with that of the scenes at s.
    long long work_of(long long closed_form, double s) const noexcept {
        return (explicit_family<F> ? 1 : WorkTuning::chain) * closed_form + work_of_pairs(options_.scenes, s);
    }
    /// The pose at s.
    Pose<double> pose(double s) const noexcept {
        return pose_at(path_[segment_index(path_.data(), path_.size(), s)], s);
    }

    /// Whether joints q at s touch an obstacle.
    bool touches(double s, const double* q) const {
        return options_.scenes && !is_clear(family_.arm(), options_.scenes.at(s), q);
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
        work_.take(std::popcount(asked) * work_of(WorkTuning::section, s));
        family_.arcs(at, limits, asked, found);
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(asked >> gc & 1u)) continue;
            Tag pair = 0;
            keep_open(s, at, gc, found[gc], pair);
            out[gc] = {s, at, found[gc].arcs, nullptr, found[gc].status, pair, not_a_number};
            if (!found[gc].open.empty()) out[gc].unproven = std::make_shared<const ArcSet>(found[gc].open);
        }
    }
    /// Reduces arcs to those that the user permits and in which the arm is collision-free; `pair` is the one
    /// that leaves none. found.open becomes what is proven neither way. Unless the family is explicit, it is
    /// added to the arcs: the proof of the curve decides there. If it is, it is empty where there are arcs.
    void keep_open(double s, const Pose<double>& at, int gc, ProvenArcs& found, Tag& pair) const {
        ArcSet open = found.open, all;
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
            const int looks = keep_clear(family_.arm(), scenes[k], at, gc, found, pair, false, {}, &left);
            work_.take(looks * (WorkTuning::cell + work_of_pairs(scenes, s)));
            if (found.status == Status::POSE_BLOCKED) make_empty(open);
            if (left.empty()) continue;
            unite(open, left, all);
            open = all;
        }
        if (explicit_family<F> && !found.arcs.empty()) make_empty(open);
        found.open = open;
        if (explicit_family<F> || open.empty()) return;
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
        std::vector<double> base = spread_.s;
        for (int k = 1; k < options_.scenes.count; ++k) base.push_back(options_.scenes.begin(k));
        if (options_.scenes.count > 1) tidy(base);
        unsigned asked = options_.branches;
        for (const End& end : ends_)
            if (end.q) asked &= 1u << end.gc;
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(options_.branches >> gc & 1u)) continue;
            Branch& branch = branches_.emplace_back();
            branch.report.gc = gc;
            for (int k = 0; k < 2; ++k) branch.ends[k] = ends_[k];
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

    /// Finds a path in a branch, with sections added where it ends, or writes the report why there is none.
    void find_way(Branch& branch) {
        BranchReport& report = branch.report;
        if (report.elsewhere || refuses_start(branch)) return advance();
        const std::size_t reached = search_.find(branch, [this](Branch& x) { return is_shut(x); });
        if (report.verdict != Verdict::ok) find_way_ahead(branch);
        report.sections = static_cast<unsigned>(branch.sections.size());
        if (report.verdict == Verdict::ok && !search_.misses_turn(branch) &&
            reached < branch.sections.size()) {
            const std::size_t k = reached;
            const bool at_start = k == 0 && ends_[0].q;
            const bool at_goal = k + 1 == branch.sections.size() && ends_[1].q &&
                                 !search_.is_held(branch.sections[k], ends_[1]);
            const bool unproven = branch.sections[k].unproven != nullptr;
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
            search_.lift_way(branch);
            if (search_.arrives(branch)) {
                search_.descend(branch);
                take_margins(branch, report);
            }
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
        if (!ends_[0].q || search_.is_held(branch.sections.front(), ends_[0]) ||
            !refuses(ends_[0], 0.0, report))
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

    /// Stores the path of a branch as far as it leads to the first section without an arc.
    void find_way_ahead(Branch& branch) const {
        const auto shut = [](const Section& x) { return x.arcs.empty(); };
        const auto first = std::find_if(branch.sections.begin(), branch.sections.end(), shut);
        branch.way.clear();
        if (first == branch.sections.begin() || first == branch.sections.end()) return;
        Branch part;
        part.report.gc = branch.report.gc;
        part.sections.assign(branch.sections.begin(), first);
        part.ends[0] = branch.ends[0];
        const std::size_t reached = search_.find(part, [](const Branch&) { return false; });
        if (reached > 0) branch.report.reached = part.sections[reached - 1].s;
        part.sections.insert(part.sections.end(), first, branch.sections.end());
        branch.sections = std::move(part.sections);
        branch.way = std::move(part.way);
    }
    /// Whether some section has no arc. If so, writes to the report of the branch where, and why: out of
    /// reach before any other reason, and what is proven before that nothing is.
    bool is_shut(Branch& branch) const {
        BranchReport& report = branch.report;
        const auto shut = [](const Section& x) { return x.arcs.empty(); };
        const auto proven = [&](const Section& x) { return shut(x) && !x.unproven; };
        auto first = std::find_if(branch.sections.begin(), branch.sections.end(), proven);
        report.given_up = first == branch.sections.end();
        if (report.given_up) first = std::find_if(branch.sections.begin(), branch.sections.end(), shut);
        if (first == branch.sections.end()) return report.given_up = false;
        const auto last = std::find_if_not(first, branch.sections.end(), shut);
        const auto beyond =
            std::find_if(first, last, [](const Section& x) { return x.status == Status::UNREACHABLE; });
        const Section& named = beyond != last ? *beyond : *first;
        report.from = named.s;
        report.to = (last - 1)->s;
        report.status = named.status;
        report.touching = named.pair;
        report.verdict = beyond != last ? Verdict::unreachable : Verdict::impossible;
        if (report.given_up) report.verdict = Verdict::unresolved;
        for (auto at = first; at != last; ++at) report.excess = max(report.excess, family_.excess(at->pose));
        return true;
    }

    // -- the curve

    /// Makes the curve of the best branch that is proven the plan; if none is, one without a known violation;
    /// if there is none, the beginning of a path.
    void draw_best() {
        for (Branch& branch : branches_) {
            if (plan_.ok && (plan_.proof.certified() || work_.spent())) break;
            if (branch.report.verdict != Verdict::ok) continue;
            draw(branch);
        }
        if (!plan_.ok) draw_part();
    }

    /// The stretches of a spline of the redundant parameter through the branch's path.
    std::vector<Stretch> curve_of(const Branch& branch) const {
        std::vector<Stretch> out = stretches_of(search_.drawn(branch), path_);
        while (out.size() > 1 && out.back().start >= branch.sections[branch.way.size() - 1].s) out.pop_back();
        lift_stretches(FamilyCurve<F>{family_, branch.report.gc, path_, out}, out, branch.way[0].q);
        return out;
    }

    /// Proves a curve of a branch as far as the work allows. Where the user permits arcs by the pose, nothing
    /// is known between the ends of its stretches.
    Proof proven(int gc, const std::vector<Stretch>& stretches) const {
        const long long cell = work_of(WorkTuning::cell, 0.0);
        const int most = static_cast<int>(std::max(work_.left(), 0LL) / cell);
        int looks = most;
        const bool asks = options_.allowed && !options_.allowed_everywhere;
        Proof out = certify(FamilyCurve<F>{family_, gc, path_, stretches}, limits_,
                            {options_.scenes, options_.allowed_everywhere, false, &work_}, tuning_.proof,
                            looks, [&](const Stretch& x) {
                                return !asks || (find(permitted(x.start), phi_at(x, x.start)).index >= 0 &&
                                                 find(permitted(x.end), phi_at(x, x.end)).index >= 0);
                            });
        work_.take((most - looks) * cell);
        return out;
    }

    /// Adds the ends of a curve that are not at the given joints to the violations of its proof: near a fold
    /// it may lead to another solution.
    void look_at_ends(const FamilyCurve<F>& curve, Proof& proof) const {
        for (int k = 0; k < 2; ++k) {
            if (!ends_[k].q) continue;
            const PlacedPosture at = curve.at(k);
            const bool there =
                is_finite(at.q) && largest_move(at.q, ends_[k].q) <= ends_[k].gap + PlanTuning::end_off;
            if (!there) proof.violated.insert(k ? proof.violated.end() : proof.violated.begin(), k);
        }
    }

    /// Draws the curve of a branch and proves it, with more sections where the proof fails, as long as work
    /// is left. A curve without a known violation becomes the plan if less of it is open; if there is none,
    /// the report says why.
    void draw(Branch& branch) {
        BranchReport& report = branch.report;
        Branch finer = branch;
        Proof all;
        all.open = {0.0, 1.0};
        search_.refine(finer, all);
        bool held = false;
        Proof proof;
        std::vector<Stretch> stretches;
        for (int round = 0; round <= tuning_.rounds; ++round) {
            stretches = curve_of(finer);
            proof = proven(report.gc, stretches);
            look_at_ends(FamilyCurve<F>{family_, report.gc, path_, stretches}, proof);
            const bool kept = proof.violated.empty() && (proof.certified() || !work_.spent());
            held = held || kept;
            if (kept && (!plan_.ok || proof.open.size() < plan_.proof.open.size())) {
                plan_.ok = true;
                plan_.gc = report.gc;
                plan_.stretches = std::move(stretches);
                plan_.proof = proof;
                take_margins(finer, report);
            }
            if (proof.certified() || work_.spent() || !search_.refine(finer, proof)) break;
            if (held) continue;
            if (is_shut(finer) || search_.search(finer) < finer.sections.size())
                break;  // another way about that place
            search_.lift_way(finer);
            search_.descend(finer);
        }
        if (held) return;
        report.given_up = proof.violated.empty();
        const std::vector<double>& at = report.given_up ? proof.open : proof.violated;
        report.verdict = Verdict::unresolved;
        report.status = options_.scenes.count > 0 ? Status::CLEARANCE : Status::LIMITS;
        report.from = at.front();
        const FamilyCurve<F> curve{family_, report.gc, path_, stretches};
        const PlacedPosture broken = curve.at(report.from);
        Directions<double> d;
        if (!(curve.place(stretch_at(stretches, report.from), report.from, d) > tuning_.proof.least_room))
            report.status = Status::NO_POSTURE;
        else if (!explicit_family<F> && !report.given_up &&
                 within_limits(limits_, broken.q, tuning_.proof.broken) && !touches(report.from, broken.q))
            report.status = Status::NEAR_SINGULAR;  // it jumps
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
            search_.lift_way(branch);
            plan_.stretches = curve_of(branch);
            const Proof proof = proven(branch.report.gc, plan_.stretches);
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
        for (int i = 0; i < tuning_.halvings && !work_.spent(); ++i) {
            const double middle = 0.5 * (low + high);
            (wider(middle) ? high : low) = middle;
        }
        return high;
    }

    const F family_;
    const std::span<const Segment> path_;
    const PlanOptions& options_;
    Work& work_;
    const FamilyTuning& tuning_;
    const Limits limits_;
    const SpreadOver spread_;
    const Objective objective_;  // with the slowness of the joints
    const BranchSearch<F> search_;
    End ends_[2];
    std::vector<Branch> branches_;
    Plan plan_;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
