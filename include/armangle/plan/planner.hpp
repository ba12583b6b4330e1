// Plans the whole path at once. For each branch: the tube, the best path through it, its descent to an
// optimum, and its proof; or the reason for none.
//
//     path -> tube -> search -> descent -> spline -> certify -> plan
//                       | no path  ^                   | a limit is violated
//                       v          +-- more sections --+
//                    diagnose
//
// Unlike the rest of the library this allocates: its memory grows with the path.
#pragma once

#include <algorithm>
#include <atomic>
#include <optional>
#include <utility>

#include "branch_search.hpp"
#include "crossing.hpp"
#include "curve_cost.hpp"
#include "duration.hpp"
#include "optimum.hpp"
#include "plan_ends.hpp"
#include "plan_options.hpp"
#include "plan_reasons.hpp"
#include "task_family.hpp"
#include "tube.hpp"
#include "../batch/parallel.hpp"
#include "../scene/straight_move.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of plans of an exact arm.
struct PlanTuning {
    static constexpr int rounds = 4;            // of new sections where the proof found a violation
    static constexpr int crossing_rounds = 10;  // the same for a path through several branches
    /// With fewer sections than this, a path through several branches uses those of the tubes too.
    static constexpr std::size_t least_sections = 250;
    static constexpr double of_wish[] = {1, 0.1,
                                         0};  // weights of psi's target tried in a path through branches
    static constexpr double tie = 1e-6;       // margins closer than this are equal (rad)
    static constexpr double end_step =
        1e-9;  // of the first (last) stretch: distance of the sample nearest to an end
    static constexpr double end_off = 1e-7;  // error of joints at the end itself (rad), by rounding
    /// Alternatives tried if duration is weighed, besides a plan without it: its weight next to a weight of
    /// travel that is at least this share of it.
    static constexpr double calm[] = {0, 0.1, 1};
};

namespace detail {

/// Sorts parameters in place, removes duplicates, and sets the first to 0 and the last to 1.
inline void tidy(std::vector<double>& s) {
    std::sort(s.begin(), s.end());
    s.erase(std::unique(s.begin(), s.end(),
                        [](double a, double b) { return b - a <= TubeParameterTuning::same; }),
            s.end());
    s.front() = 0;
    s.back() = 1;
}

/// Plans one path: sections, search, curve and proof of each branch; docs/background/paths.md.
class Planner {
public:
    /// Computes the sections of a path of n segments, with rows at the given s, the limits with their
    /// margins, and the zero of phi along it.
    Planner(const Arm& arm, const Segment* segments, std::size_t n, const double* rows, std::size_t row_count,
            const PlanOptions& options, Work& work)
        : options_(with_held_roll(arm, options)),
          base_(base_parameters(segments, n, rows, row_count)),
          task_{arm, drawn_in(arm.limits, options.limit_margin), {}, segments, n, {}} {
        task_.table = limit_table(arm, task_.limits, options.singularity_margin);
        std::vector<Vec3<double>> wrists;
        for (std::size_t i = 0; i < base_.size(); ++i) {
            wrists.push_back(wrist(base_[i]));
            if (i + 1 < base_.size()) wrists.push_back(wrist(0.5 * (base_[i] + base_[i + 1])));
        }
        task_.plane = smooth_plane(wrists);
        task_.held_theta_7 = to_theta(arm, joints - 1, options.held_q_7);
        task_.length = turned_length(task_, base_);
        options_.objective = with_slowness(options.objective, options.bounds, task_.length);
        task_.wish = options.wish;
        task_.scenes = options.scenes;
        task_.allowed = options.allowed;
        task_.allowed_everywhere = options.allowed_everywhere;
        task_.work = &work;
        spread_ = SpreadOver({segments, n}, arm.reach, tuning_).s;
        for (int k = 1; k < task_.scenes.count; ++k) spread_.push_back(task_.scenes.begin(k));
        if (task_.scenes.count > 1) tidy(spread_);
        search_.emplace(
            TaskFamily(task_), task_.limits, options_.objective, task_.length, work, true,
            [this](double s, int gc) { return section(solve_section(task_, gc, s)); }, nullptr, tuning_);
        touching_ = touches();
    }

    /// Plans all permitted branches and returns the best plan.
    Plan run() {
        survey_all();
        std::stable_sort(plan_.branches.begin(), plan_.branches.end(),
                         [](const BranchReport& a, const BranchReport& b) { return before(a, b); });
        plan_.plane = task_.plane;
        if (options_.rate_only) return std::move(plan_);
        choose();
        advance();
        cross();
        std::stable_sort(plan_.branches.begin(), plan_.branches.end(),
                         [this](const BranchReport& a, const BranchReport& b) {
                             return a.gc == plan_.gc ? b.gc != plan_.gc : (b.gc != plan_.gc && before(a, b));
                         });
        return std::move(plan_);
    }

private:
    /// The tuning of the search: the ends are anchored already (plan_ends.hpp), and a descent follows.
    static FamilyTuning search_tuning() noexcept {
        FamilyTuning out;
        out.beside = pi;
        out.link = 1.0;
        return out;
    }

    /// Reports progress.
    void advance() const {
        if (options_.advanced) options_.advanced();
    }

    /// A section as the search takes it.
    BranchSection section(const SolvedSection& x) const noexcept {
        const double s = x.section.s;
        const int gc = index(x.section.motion.gc);
        return {s,
                task_.pose(s),
                x.arcs,
                nullptr,
                x.section.status,
                x.section.blocking,
                options_.objective.psi > 0 ? task_.wished_phi(gc, s) : not_a_number};
    }

    /// Proves a curve.
    Proof proven(const Curve& drawn) const {
        return certify(drawn, task_.limits, options_.singularity_margin,
                       {task_.scenes, task_.allowed_everywhere, touching_, task_.work});
    }

    /// Whether the start or the goal has no more than the required clearance, up to rounding. Joints from the
    /// end of a collision-free arc are exactly at it.
    bool touches() const noexcept { return touches(options_.start, 0) || touches(options_.goal, 1); }

    /// Whether joints q (null: false) at s have no more than the required clearance, up to rounding.
    bool touches(const double* q, double s) const noexcept {
        if (!q || !task_.scenes) return false;
        StraightMove at(task_.arm, task_.scenes.at(s));
        return at.nearest_pair(q, StraightMoveTuning::slack).room < StraightMoveTuning::slack;
    }

    /// The options with joint 7 of both ends set to its fixed value, for an arm with free roll.
    PlanOptions with_held_roll(const Arm& arm, const PlanOptions& given) noexcept {
        PlanOptions out = given;
        if (!arm.roll_free) return out;
        const auto held = [&](const double* q, double (&to)[joints]) {
            std::copy(q, q + joints, to);
            to[joints - 1] = given.held_q_7;
            return to;
        };
        if (given.start) out.start = held(given.start, start_);
        if (given.goal) out.goal = held(given.goal, goal_);
        return out;
    }

    /// The unit direction from shoulder to wrist at s, in the frame of the DH rows.
    Vec3<double> wrist(double s) const noexcept {
        return triad(task_.arm, flange_pose(task_.arm, task_.pose(s))).w;
    }

    /// Whether branch a comes before b: those with a path first, by the objective, then by the least margin.
    /// The others follow: those that contain start and goal first, then by how far they lead.
    static bool before(const BranchReport& a, const BranchReport& b) noexcept {
        if ((a.verdict == Verdict::ok) != (b.verdict == Verdict::ok)) return a.verdict == Verdict::ok;
        if (a.verdict != Verdict::ok && a.elsewhere != b.elsewhere) return b.elsewhere;
        if (a.verdict != Verdict::ok) return a.reached > b.reached;
        if (a.cost != b.cost) return a.cost < b.cost;
        const double x = min(a.margin, a.elbow_margin), y = min(b.margin, b.elbow_margin);
        if (abs(x - y) > PlanTuning::tie) return x > y;
        return a.margin > b.margin;
    }

    /// Results for a branch before its curve is drawn.
    struct Surveyed {
        Tube tube;
        AnchoredEnds ends;
        SearchedBranch branch;
        Optimum coarse;  // on few knots

        /// The ends that a descent keeps fixed.
        FixedEnds fixed() const noexcept { return fixed_ends(ends, branch.way.front().q); }
    };

    /// Surveys all permitted branches, in threads.
    void survey_all() {
        std::vector<int> asked;
        for (int gc = 0; gc < configurations; ++gc)
            if (options_.branches >> gc & 1u) asked.push_back(gc);
        const auto look = [&](std::size_t k) {
            survey(surveyed_[asked[k]], asked[k]);
            advance();
        };
        const bool of_user = options_.allowed && !options_.allowed_everywhere;  // one thread calls the user's
                                                                                // function
        in_turn(asked.size(), of_user ? 1 : options_.threads, look, [this] { task_.take(0); });
        for (const int gc : asked) {
            const Surveyed& one = surveyed_[gc];
            plan_.start_gap = max(plan_.start_gap, one.ends.start.gap);  // 0 except in its own branch
            plan_.goal_gap = max(plan_.goal_gap, one.ends.goal.gap);
            plan_.branches.push_back(one.branch.report);
        }
    }

    /// Computes the sections of a branch's tube up to the first without an arc, and its ends, for the search.
    void begin(Surveyed& found, int gc, const std::vector<double>& base) const {
        found.tube = tube(task_, gc, base);
        const Tube& t = found.tube;
        found.ends = ends_.ends(t, options_.start, options_.goal);
        SearchedBranch& branch = found.branch;
        branch.sections.clear();
        for (const Section& l : t.sections) {
            if (l.status != Status::OK) break;
            SolvedSection x{l, {}};
            make_empty(x.arcs);
            x.arcs.full = l.full;
            for (std::uint32_t k = 0; k < l.count; ++k) x.arcs.arc[x.arcs.count++] = t.arc(l)[k];
            branch.sections.push_back(section(x));
        }
        const auto end = [gc](const Anchor& x, const double* q) {
            return x.given ? BranchEnd{q, x.phi, x.gap, gc} : BranchEnd{};
        };
        branch.ends[0] = end(found.ends.start, found.ends.start.q);
        if (branch.sections.size() == t.sections.size())
            branch.ends[1] = end(found.ends.goal, found.ends.goal.q);
    }

    /// Searches a path in a branch; its report has its rating, or the reason for none.
    void survey(Surveyed& found, int gc) const {
        SearchedBranch& branch = found.branch;
        BranchReport& out = branch.report;
        out.gc = gc;
        const auto is_shut = [](const SearchedBranch& x) {
            return std::any_of(x.sections.begin(), x.sections.end(),
                               [](const BranchSection& each) { return each.arcs.empty(); });
        };
        std::vector<double> base = spread_;
        std::size_t reached = 0;
        for (int round = 0; round <= tuning_.rounds; ++round) {
            begin(found, gc, base);
            if (!found.ends.starts || branch.sections.empty()) break;
            reached = search_->find(branch, is_shut);
            if (!is_shut(branch)) break;
            for (const BranchSection& x : branch.sections)
                if (x.arcs.empty()) base.push_back(x.s);  // the tube missed it
            tidy(base);
        }
        const Tube& t = found.tube;
        const AnchoredEnds& fixed = found.ends;
        if (!fixed.held()) reasons_.refuse_end(fixed, options_.start, options_.goal, out);
        const bool refused = !fixed.held() && !out.elsewhere && out.status != Status::OUTSIDE;
        out.sections = static_cast<unsigned>(t.sections.size());
        if (reached) out.reached = branch.sections[reached - 1].s;
        if (const std::size_t at = reasons_.first_empty(t); at < t.sections.size() && !refused)
            return reasons_.explain_empty(t, at, out);
        if (!fixed.held()) return;
        if (search_->misses_turn(branch)) return;
        if (reached < branch.sections.size()) {
            out.given_up = t.coarse || branch.spent;
            out.verdict = out.given_up ? Verdict::unresolved : Verdict::dead_end;
            out.status = Status::LIMITS;
            const auto next = std::upper_bound(t.sections.begin(), t.sections.end(), out.reached,
                                               [](double s, const Section& x) { return s < x.s; });
            const Section& last = next == t.sections.begin() ? *next : *(next - 1);
            if (reached) reasons_.explain_end(t, last, branch.way.back().free, out);
            if (options_.start && out.reached < PlanReasonsTuning::nearly_shut)
                reasons_.explain_turns(options_.start, 0, out);
            out.from = out.reached;
            out.to = next == t.sections.end() ? 1.0 : next->s;
            if (reached) out.nearest_psi = reasons_.nearest_psi(t, last, branch.way.back().free);
            return;
        }
        search_->settle(branch);
        if (!search_->arrives(branch)) return;
        found.coarse = coarse_optimum(task_, options_.objective, gc, found.fixed(), branch);
        const Optimum& best = found.coarse;
        out.margin = best.margin;
        out.cost = best.found() ? best.terms.weighed(options_.objective) : infinity;
        out.stationarity = best.stationarity;
        out.elbow_margin = cost_.least_elbow_margin(branch);
    }

    /// Chooses the best branch with a proven curve; else the first without a violation; else a partial path.
    void choose() {
        Plan first;
        bool any = false, proven = false;
        double least = infinity;  // of the proven ones
        for (BranchReport& report : plan_.branches) {
            // if no descent found a cost it is infinite, which does not exclude a path
            if (report.verdict != Verdict::ok || (proven && !(report.cost < least))) break;
            if (any && task_.work->spent()) break;
            Plan now;
            if (!realise(report, now)) continue;
            const bool certified = now.proof.certified();
            if (certified ? !proven || report.cost < least : !any) {
                first = std::move(now);
                any = true;
            }
            if (certified) least = min(least, report.cost);
            proven = proven || certified;
        }
        if (any) {
            plan_.ok = true;
            plan_.gc = first.gc;
            plan_.stretches.swap(first.stretches);
            plan_.proof = first.proof;
            return;
        }
        const auto farthest = std::max_element(
            plan_.branches.begin(), plan_.branches.end(), [](const BranchReport& a, const BranchReport& b) {
                return (a.verdict == Verdict::unresolved ? -1.0 : a.reached) <
                       (b.verdict == Verdict::unresolved ? -1.0 : b.reached);
            });
        if (farthest != plan_.branches.end()) partial(farthest->gc);
    }

    // ---- paths through several branches (crossing.hpp)

    /// Which of joints 2 and 6 come near 0 (pi) on some section of the path with this sign of the elbow (0 or
    /// 2), by the bit of their sign in gc.
    int meeting(int elbow) const noexcept {
        int out = 0;
        for (const double s : base_) {
            const SelfMotion<double> m = self_motion(task_.arm, task_.circle_at(s), configuration(elbow));
            if (is_unreachable(m.circle) || is_folded(m.circle)) continue;
            const JointFunctions<double> f = joint_functions(m);
            for (int h = 0; h < hinges; ++h)
                if (meets(f, task_.table, h)) out |= h == 0 ? 1 : 4;
        }
        return out;
    }

    /// Searches a path that changes branches, or begins or ends where two meet. Used if no branch has a
    /// proven path, or if the proven path from a given start (goal) costs much more.
    void cross() {
        const bool proven = plan_.ok && plan_.proof.certified(), free = !options_.start && !options_.goal;
        const int locked = proven ? 0 : ends_.locked_joint();
        const bool margin = options_.singularity_margin > 0 && !locked;
        if (margin || base_.size() > CrossingTuning::most_sections || (proven && free)) return;
        CrossingTask tried;
        for (const int elbow : {0, 2}) {
            const int meet = locked ? 5 : meeting(elbow);
            if (!meet) continue;
            CrossingTask asked;
            if (locked) ends_.lock(asked, locked, options_.start ? options_.start : options_.goal);
            if (options_.start) asked.start = ends_.meeting_anchor(0.0, options_.start, elbow, asked);
            if (options_.goal) asked.goal = ends_.meeting_anchor(1.0, options_.goal, elbow, asked);
            if (!ends_.hold(asked.start, options_.start, elbow) ||
                !ends_.hold(asked.goal, options_.goal, elbow))
                continue;
            const double* end = options_.start ? options_.start : options_.goal;
            const int own = end ? index(configuration(task_.arm, chain(task_.arm, end).theta)) : 0;
            for (int gc = elbow; gc < configurations; ++gc)
                if ((gc & 2) == elbow && (options_.branches >> gc & 1u) &&
                    (!end || !((gc ^ own) & ~(meet | 2))))
                    asked.branches.push_back(gc);
            if (asked.branches.empty()) continue;
            const Objective& of = options_.objective;
            if (task_.wish) asked.wish = task_.wish_scale() * of.psi / (of.travel > 0 ? of.travel : 1.0);
            asked.sections = crossing_sections(asked);
            tried = asked;
            Plan found;
            if (!draw_wished(asked, found)) continue;
            if (!found.proof.certified()) {
                if (!plan_.ok) take(found);
                continue;
            }
            if (proven && !cost_.calmer(curve(found), curve(plan_), options_.start, options_.goal)) continue;
            take(found);
            return;
        }
        if (!plan_.ok && task_.work->spent()) give_up_crossing();
        if (!plan_.ok && tried.start.given) cross_partly(tried);
    }

    /// Draws the curve as far as the start leads through branches that meet, up to the first violated limit.
    /// Used if that is farther than in a single branch.
    void cross_partly(CrossingTask& asked) {
        asked.goal = {};
        asked.partial = true;
        Plan found;
        double end = 0;
        for (int round = 0; round < PlanTuning::rounds; ++round) {
            Plan drawn;
            if (!draw_crossing_once(asked, drawn) || leaps(asked.start, drawn, false)) break;
            double kept = drawn.stretches.back().end;
            for (const double s : drawn.proof.violated) kept = min(kept, s);
            const bool whole = !(kept < drawn.stretches.back().end);
            const std::size_t before = asked.sections.size();
            if (!whole) add_sections(drawn, asked.sections);
            if (kept > end) {
                end = kept;
                found = std::move(drawn);
            }
            if (whole || asked.sections.size() == before ||
                asked.sections.size() > CrossingTuning::most_sections)
                break;
        }
        std::erase_if(found.stretches, [end](const Stretch& x) { return x.end > end; });
        if (found.stretches.empty()) return;
        end = found.stretches.back().end;
        if (!plan_.stretches.empty() && !(end > plan_.stretches.back().end)) return;
        const unsigned through = cost_.passed(curve(found));
        plan_.gc = found.gc;
        plan_.stretches.swap(found.stretches);
        for (BranchReport& x : plan_.branches) {
            if (x.gc != found.gc || !(end > x.reached)) continue;
            x.reached = end;
            const bool shut = x.verdict == Verdict::dead_end || x.verdict == Verdict::impossible;
            if (!shut || !(end > x.from)) continue;
            x.verdict = Verdict::dead_end;
            x.status = Status::LIMITS;
            x.from = end;
            x.to = max(x.to, end);
            x.nearest_psi = x.shortfall = x.turns[0] = x.turns[1] = not_a_number;
            x.touching = 0;
            x.blocking = 0;
            x.openings.clear();
            x.through = through & ~(1u << x.gc);
        }
    }

    /// Reports for branches with a singular end that the search of a continuation was stopped early.
    void give_up_crossing() noexcept {
        for (BranchReport& x : plan_.branches) {
            const bool end = x.verdict == Verdict::start || x.verdict == Verdict::goal;
            if (!end || x.elsewhere || x.status != Status::OUTSIDE) continue;
            x.verdict = Verdict::unresolved;
            x.given_up = true;
        }
    }

    /// The sections of a crossing, for all branches used, and some close to a fixed end.
    std::vector<double> crossing_sections(const CrossingTask& asked) {
        std::vector<double> out;  // so the same path is found however few rows are requested
        for (std::size_t k = 0; k + 1 < base_.size(); ++k) {
            const double gap = base_[k + 1] - base_[k];
            const int parts = static_cast<int>(std::ceil(gap / CrossingTuning::longest));
            for (int i = 0; i < parts; ++i) out.push_back(base_[k] + gap * i / parts);
        }
        out.push_back(1.0);
        const double first = out[1], last = 1.0 - out[out.size() - 2];
        if (base_.size() <= PlanTuning::least_sections)
            for (const int gc : asked.branches) {
                const Tube& t = surveyed_[gc].tube;
                if (t.sections.size() > base_.size() + PlanTuning::least_sections) continue;
                for (const Section& x : t.sections) out.push_back(x.s);
            }
        for (const double share : CrossingTuning::beside) {
            if (asked.start.given) out.push_back(share * first);
            if (asked.goal.given) out.push_back(1.0 - share * last);
        }
        const bool from_shut =
                       asked.start.given && singularity_sine(task_.arm, asked.start.q) <= tolerance::one_axis,
                   to_shut =
                       asked.goal.given && singularity_sine(task_.arm, asked.goal.q) <= tolerance::one_axis;
        std::erase_if(out, [&](double s) {
            return (from_shut && s > 0 && s < CrossingTuning::shut_step) ||
                   (to_shut && s < 1 && 1 - s < CrossingTuning::shut_step);
        });
        tidy(out);
        return out;
    }

    /// Writes the curve of a path that changes branches, and its proof, to `out`; false if there is no path.
    /// The curve need not be proven.
    bool draw_crossing_once(const CrossingTask& asked, Plan& out) {
        Crossing crossing(task_, asked);
        out.stretches = crossing.run(out.gc);
        if (out.stretches.empty()) return false;
        const double* q = crossing.first();
        const Chain first = chain(task_.arm, q);
        const double psi = arm_angle(triad(task_.arm, flange_pose(task_.arm, task_.pose(0.0))), first.z3);
        const auto prove = [&](Plan& drawn) {
            lift_stretches(curve(drawn), drawn.stretches, q, psi);
            if (asked.goal.given) end_at(asked.goal.q, drawn.stretches.back());
            drawn.proof = proven(curve(drawn));
        };
        prove(out);
        if (!out.proof.certified()) return true;
        Plan calm;
        calm.gc = out.gc;
        calm.stretches = crossing.calmly();
        if (calm.stretches.empty()) return true;
        prove(calm);
        if (calm.proof.certified()) out = std::move(calm);
        return true;
    }

    /// Writes a curve that changes branches, proven or without a known violation, to `out`: draws it several
    /// times with more sections in `asked` where it violates a limit. False if that fails.
    bool draw_crossing(CrossingTask& asked, Plan& out) {
        for (int round = 0; round < PlanTuning::crossing_rounds; ++round) {
            if (!draw_crossing_once(asked, out)) return false;
            const bool held = !leaps(asked.start, out, false) && !leaps(asked.goal, out, true);
            if (held && (out.proof.certified() || out.proof.violated.empty())) return true;
            const std::size_t before = asked.sections.size();
            add_sections(out, asked.sections);
            if (asked.sections.size() == before || asked.sections.size() > CrossingTuning::most_sections)
                break;
        }
        return false;
    }

    /// Draws the curve with the full target for psi. If that is not proven, or a joint moves too fast, takes
    /// the curve of least objective with a smaller weight of the target. Near theta_2 = 0 or theta_6 = 0 the
    /// target may need too much joint motion.
    bool draw_wished(const CrossingTask& asked, Plan& out) {
        bool any = false;
        for (const double share : PlanTuning::of_wish) {
            if (share < 1 && !(asked.wish > 0)) break;
            CrossingTask some = asked;
            some.wish *= share;
            Plan found;
            if (!draw_crossing(some, found)) continue;
            const bool better = found.proof.certified() != out.proof.certified()
                                    ? found.proof.certified()
                                    : cost_.objective(curve(found)) < cost_.objective(curve(out));
            if (!any || better) out = std::move(found);
            any = true;
            if (out.proof.certified() && !cost_.hurries(curve(out))) break;
        }
        return any;
    }

    /// Makes `found`, a path through several branches, the plan, and reports its least distances (rad) from
    /// limits.
    void take(Plan& found) {
        const Curve drawn = curve(found);
        const unsigned through = cost_.passed(drawn);
        double least = infinity, least_elbow = infinity;
        for (const Stretch& x : drawn.stretches)
            for (int i = 0; i <= CurveCostTuning::looks; ++i) {
                const PlacedPosture here =
                    cost_.curve_at(drawn, x, x.start + (x.end - x.start) * i / CurveCostTuning::looks);
                for (int j = 0; j < joints; ++j) {
                    double& to = j == 3 ? least_elbow : least;
                    to = min(to, min(here.q[j] - task_.limits.lower[j], task_.limits.upper[j] - here.q[j]));
                }
            }
        for (BranchReport& x : plan_.branches) {
            if (x.gc != found.gc) continue;
            x.verdict = Verdict::ok;
            x.status = Status::OK;
            x.from = x.to = 0;
            x.reached = 1;
            x.margin = least;
            x.elbow_margin = least_elbow;
            x.cost = cost_.objective(drawn);
            x.stationarity = not_a_number;
            x.through = through & ~(1u << x.gc);
            x.given_up = false;
        }
        plan_.ok = true;
        plan_.gc = found.gc;
        plan_.stretches.swap(found.stretches);
        plan_.proof = found.proof;
    }

    /// Writes the proven curve of a branch that has a path to `out`: the curve of least objective. If that is
    /// not proven, the search's own curve, with new sections where it violates a limit. False, with the
    /// reason in `report`, if none is without a violation.
    bool realise(BranchReport& report, Plan& out) const {
        const Surveyed& mine = surveyed_[report.gc];
        SearchedBranch branch = mine.branch;
        Proof all;
        all.open = {0.0, 1.0};
        search_->refine(branch, all);
        Plan best;
        for (int round = 0; round <= tuning_.rounds; ++round) {
            const Spline drawn = search_->drawn(branch);
            if ((round == 0 && mine.coarse.found() && optimise(mine.coarse.curve, mine, report, best)) ||
                optimise(drawn, mine, report, best)) {
                out = std::move(best);
                return true;
            }
            draw(report.gc, as_it_is(task_, options_.objective, report.gc, mine.fixed(), drawn),
                 branch.way.front().q, report, out);
            if (!holds_ends(mine.ends, out)) {
                const bool start = leaps(mine.ends.start, out, false);
                report.verdict = start ? Verdict::start : Verdict::goal;
                report.status = Status::OUTSIDE;
                report.reached = report.from = report.to = start ? 0 : 1;
                return false;
            }
            if (out.proof.certified()) return true;
            if (!best.stretches.empty() && best.proof.violated.empty()) {
                out = std::move(best);
                return true;
            }
            if (out.proof.violated.empty()) return true;
            if (task_.work->spent() || !search_->refine(branch, out.proof)) break;
            if (search_->search(branch) < branch.sections.size()) break;  // another way about that place
            search_->settle(branch);
        }
        report.verdict = Verdict::unresolved;
        report.given_up = task_.work->spent();
        report.status = task_.scenes ? Status::CLEARANCE : Status::LIMITS;
        if (!out.proof.open.empty()) {
            report.from = out.proof.open.front();
            report.to = out.proof.open.back();
            report.reached = min(report.reached, report.from);
        }
        return false;
    }

    /// Whether the curve begins (ends) away from an anchor, or leaves it in a jump. With theta_2 or theta_6
    /// at 0 or pi the joints are no continuous function of the arm angle.
    bool leaps(const Anchor& anchor, const Plan& out, bool end) const noexcept {
        if (!anchor.given) return false;
        const Curve drawn = curve(out);
        const Stretch& x = end ? out.stretches.back() : out.stretches.front();
        const double inside = PlanTuning::end_step * (x.end - x.start);
        const auto off = [&](double s) { return largest_move(drawn.at(s).q, anchor.q); };
        return !(off(end ? x.end : x.start) <= PlanTuning::end_off) ||
               !(off(end ? x.end - inside : x.start + inside) <= PlanEndsTuning::end_move);
    }
    /// Whether the curve begins and ends at the given joints.
    bool holds_ends(const AnchoredEnds& fixed, const Plan& out) const noexcept {
        return !leaps(fixed.start, out, false) && !leaps(fixed.goal, out, true);
    }

    /// Finds the curve of least objective near a given one and writes it to `out`, with its cost in `report`;
    /// false if it is not proven.
    bool optimise(const Spline& from, const Surveyed& mine, BranchReport& report, Plan& out) const {
        const AnchoredEnds& fixed = mine.ends;
        for (const double wall : DescentTuning::wall) {
            const Optimum best = fine_optimum(task_, options_.objective, report.gc, mine.fixed(), from, wall);
            if (!best.found()) return false;
            draw(report.gc, best, fixed.start.given ? fixed.start.q : best.q, report, out);
            if (holds_ends(fixed, out) && out.proof.certified()) return true;
            const bool slipped = !out.proof.violated.empty();
            if (!holds_ends(fixed, out)) out.stretches.clear();
            if (!slipped) return false;
        }
        return false;
    }

    /// The curve of a plan as it is now.
    Curve curve(const Plan& x) const noexcept {
        return {task_.arm, task_.plane, x.gc, {task_.segments, task_.segment_count}, x.stretches};
    }

    /// Writes a spline of phi(s) into a plan: its branch and its stretches with joint values. The first
    /// joints are in the revolution nearest to q.
    void draw(int gc, const Spline& drawn, const double* q, Plan& out) const {
        out.gc = gc;
        out.stretches = stretches_of(drawn, {task_.segments, task_.segment_count});
        const Circle<double> c = task_.circle_at(0.0);
        const SinCos<double> sc = sin_cos(drawn.control.front());
        const double psi =
            arm_angle(triad(task_.arm, flange_pose(task_.arm, task_.pose(0.0))), c.z * sc.cos + c.e * sc.sin);
        lift_stretches(curve(out), out.stretches, q, psi);
    }

    /// Writes an optimal curve into a plan, with its proof, and its rating into the report. The first joints
    /// are in the revolution nearest to q.
    void draw(int gc, const Optimum& x, const double* q, BranchReport& report, Plan& out) const {
        draw(gc, x.curve, q, out);
        out.proof = proven(curve(out));
        report.cost = x.found() ? x.terms.weighed(options_.objective) : infinity;
        report.stationarity = x.stationarity;
        report.margin = cost_.least_margin(curve(out));
    }

    /// Adds sections to `base` around each violation of a plan's proof, so that the tube has exact arcs
    /// there.
    void add_sections(const Plan& plan, std::vector<double>& base) const {
        const Curve drawn = curve(plan);
        for (const double s : plan.proof.violated) {
            const Stretch& x = drawn.stretch(s);
            const double width = x.end - x.start;
            for (const double at :
                 {s, s - 0.25 * width, s + 0.25 * width, x.start - 0.5 * width, x.end + 0.5 * width})
                if (at > 0 && at < 1) base.push_back(at);
        }
        tidy(base);
    }

    /// Makes the curve of a branch the plan, as far as a path from the start leads.
    void partial(int gc) {
        SearchedBranch part = surveyed_[gc].branch;
        if (part.way.size() < 2) return;
        part.sections.resize(part.way.size());
        part.ends[1] = {};
        search_->lift_way(part);
        search_->descend(part);
        draw(gc, search_->drawn(part), part.way.front().q, plan_);
    }

    double start_[joints] = {}, goal_[joints] = {};  // with the fixed joint 7
    PlanOptions options_;
    const FamilyTuning tuning_ = search_tuning();
    Surveyed surveyed_[configurations];
    std::vector<double> base_;
    std::vector<double> spread_;  // the first sections of the tubes
    Task task_;
    PlanEnds ends_{task_};
    PlanReasons reasons_{task_};
    CurveCost cost_{task_, options_.objective};
    std::optional<BranchSearch<TaskFamily>> search_;
    bool touching_ = false;  // a requested end is in contact, see touches()
    Plan plan_;
};

}  // namespace detail

namespace detail {

/// The plan of planned(options). If the objective weighs duration, alternatives are planned too: one without
/// weight on it, and some with more weight on travel. The proven plan of least duration is returned, or the
/// one without weight if none is proven. The weighed measure (pace) ignores accelerations, so alone it may
/// cost time, and even joint motion is often faster. curve_of(plan): its curve.
template <class Planned, class CurveOf>
Plan fastest(const PlanOptions& options, Work& work, const Planned& planned, const CurveOf& curve_of) {
    PlanOptions asked = options;
    const auto takes = [&](const Plan& x) {
        if (!x.ok || !x.proof.certified()) return infinity;
        work.take(WorkTuning::section * static_cast<long long>(DurationTuning::places));
        return duration(curve_of(x), options.bounds);
    };
    const double weight = options.objective.duration;
    asked.objective.duration = 0;
    Plan best = planned(asked);
    if (!(weight > 0) || !best.ok) return best;
    asked.objective.duration = weight;
    double least = takes(best);
    for (const double calm : PlanTuning::calm) {
        if (work.spent()) break;
        asked.objective.travel = max(options.objective.travel, calm * weight);
        Plan now = planned(asked);
        const double time = takes(now);
        if (!(time < least)) continue;
        best = std::move(now);
        least = time;
    }
    return best;
}

}  // namespace detail

namespace detail {

/// Plans as plan(), with what is left of some work.
inline Plan plan_within(Work& work, const Arm& arm, const Segment* segments, std::size_t n,
                        const double* rows, std::size_t row_count, const PlanOptions& options) {
    const auto planned = [&](const PlanOptions& asked) {
        return Planner(arm, segments, n, rows, row_count, asked, work).run();
    };
    return fastest(options, work, planned,
                   [&](const Plan& x) { return Curve{arm, x.plane, x.gc, {segments, n}, x.stretches}; });
}

}  // namespace detail

/// Plans the path of n segments, from s = 0 to 1. rows: parameters that must be sections.
inline Plan plan(const Arm& arm, const Segment* segments, std::size_t n, const double* rows,
                 std::size_t row_count, const PlanOptions& options) {
    Work work(options.checkpoint, options.work);
    Plan out = detail::plan_within(work, arm, segments, n, rows, row_count, options);
    out.work_left = work.left();
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
