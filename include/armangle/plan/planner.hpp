// Plans the whole path at once. For each branch: the tube, the best path through it, a smooth curve, and its
// proof; or the reason for none.
//
//     path -> tube -> candidates -> search -> relax -> curve -> certify -> plan
//                                     | no path          ^         | a limit is violated
//                                     v                  |         v
//                                  diagnose              +--- more sections
//
// Unlike the rest of the library this allocates: its memory grows with the path.
#pragma once

#include <algorithm>
#include <atomic>
#include <optional>
#include <utility>

#include "crossing.hpp"
#include "curve_cost.hpp"
#include "duration.hpp"
#include "tube.hpp"
#include "optimum.hpp"
#include "plan_ends.hpp"
#include "plan_options.hpp"
#include "plan_reasons.hpp"
#include "relax.hpp"
#include "blocked_ranges.hpp"
#include "../batch/parallel.hpp"
#include "../scene/proximity.hpp"
#include "../scene/straight_move.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace plan_tuning {
inline constexpr int rounds = 4;            // of new sections where the proof found a violation
inline constexpr int crossing_rounds = 10;  // the same for a path through several branches
inline constexpr double cheap = 0.02;       // least margin of the path of least cost (rad)
/// Links tried per requested section, over all branches, before a search is given up, and as many again to
/// draw its result. This is some ten times the need of an arm without extra turns, some 2 s for 250 poses.
inline constexpr long long links = 300000;
inline constexpr long long least_sections = 250;  // a short path may try as many as this one
inline constexpr long long at_once = 4;           // share of them that a branch may try in parallel
inline constexpr std::size_t alone = 16;  // requested sections below which a thread costs more than it saves
inline constexpr int few_winding = 2;     // joints of two turns or more that are tried on all turns
inline constexpr double of_wish[] = {1, 0.1, 0};  // weights of psi's target tried in a path through branches
inline constexpr double end_step =
    1e-9;  // of the first (last) stretch: distance of the sample nearest to an end
inline constexpr double end_off = 1e-7;  // error of joints at the end itself (rad), by rounding
}  // namespace plan_tuning

namespace detail {

/// Writes into an objective, if it weighs duration, the time that a radian of each joint takes on a path that
/// turns the arm by `length` (rad).
inline void weigh_joints(const JointBounds& bounds, double length, Objective& objective) noexcept {
    for (int j = 0; j < joints && objective.duration > 0; ++j)
        objective.slowness[j] = 1 / joint_speed(bounds.velocity[j], bounds.acceleration[j], length);
}

/// Sorts parameters in place, removes duplicates, and sets the first to 0 and the last to 1.
inline void tidy(std::vector<double>& s) {
    std::sort(s.begin(), s.end());
    s.erase(std::unique(s.begin(), s.end(),
                        [](double a, double b) { return b - a <= tube_parameter_tuning::same; }),
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
            const PlanOptions& options)
        : options_(with_held_roll(arm, options)),
          base_(base_parameters(segments, n, rows, row_count)),
          links_(allowance()),
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
        weigh_joints(options.bounds, task_.length, options_.objective);
        task_.wish = options.wish;
        task_.scenes = options.scenes;
        task_.allowed = options.allowed;
        task_.allowed_everywhere = options.allowed_everywhere;
        task_.checkpoint = options.checkpoint;
        loosen();
        touching_ = touches();
    }

    /// Plans all permitted branches and returns the best plan.
    Plan run() {
        survey_all();
        std::stable_sort(plan_.branches.begin(), plan_.branches.end(),
                         [](const BranchReport& a, const BranchReport& b) { return before(a, b); });
        plan_.plane = task_.plane;
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
    /// Reports progress.
    void advance() const {
        if (options_.advanced) options_.advanced();
    }

    /// The tube of a branch, with additional sections where obstacles block phi between the parameters of
    /// `base`.
    Tube tube_on(int gc, const std::vector<double>& base) const {
        if (!task_.scenes) return tube(task_, gc, base);
        std::vector<double> all = base;
        const std::vector<double>& more = blocked_ranges_[gc & 2 ? 1 : 0];
        all.insert(all.end(), more.begin(), more.end());
        tidy(all);
        return tube(task_, gc, all);
    }

    /// Parameters between those of `base_` at which obstacles block some phi, for one sign of the elbow (0 or
    /// 2), and those at which the scene changes.
    std::vector<double> blocked_ranges(int elbow) const {
        std::vector<double> found;
        for (int k = 0; k < task_.scenes.count; ++k) {
            const double begin = task_.scenes.begin(k), end = task_.scenes.begin(k + 1);
            std::vector<double> within{begin};
            for (const double s : base_)
                if (s > begin && s < end) within.push_back(s);
            within.push_back(end);
            for (const double s : BlockedRanges(task_, task_.scenes[k], elbow).find(within))
                found.push_back(s);
            if (k) found.push_back(begin);
        }
        return found;
    }

    /// Proves a curve.
    Proof proven(const Curve& drawn) const {
        return certify(drawn, task_.limits, options_.singularity_margin,
                       {task_.scenes, task_.allowed_everywhere, touching_, &task_.checkpoint});
    }

    /// Whether the start or the goal has no more than the required clearance, up to rounding. Joints from the
    /// end of a collision-free arc are exactly at it.
    bool touches() const noexcept { return touches(options_.start, 0) || touches(options_.goal, 1); }

    /// Whether joints q (null: false) at s have no more than the required clearance, up to rounding.
    bool touches(const double* q, double s) const noexcept {
        if (!q || !task_.scenes) return false;
        StraightMove at(task_.arm, task_.scenes.at(s));
        return at.nearest_pair(q, straight_move_tuning::slack).room < straight_move_tuning::slack;
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
        if (abs(x - y) > way_tuning::tie) return x > y;
        return a.margin > b.margin;
    }

    /// Results for a branch before its curve is drawn.
    struct Surveyed {
        BranchReport report;
        std::vector<Optimum> coarse;  // on few knots, the best first
        int spread = 0;               // the turns with which its path was found
        double start_gap = 0, goal_gap = 0;
        long long links = 0;  // links that it tried ...
        long long most = 0;   // ... including those not counted
    };

    /// Surveys all permitted branches, which share the permitted number of links in order. Threads survey
    /// branches with a share each. A result counts if the branch would have found the same in its turn;
    /// otherwise it is surveyed again.
    void survey_all() {
        std::vector<int> asked;
        for (int gc = 0; gc < configurations; ++gc)
            if (options_.branches >> gc & 1u) asked.push_back(gc);
        for (const int elbow : {0, 2})
            if (task_.scenes &&
                std::any_of(asked.begin(), asked.end(), [=](int gc) { return (gc & 2) == elbow; }))
                blocked_ranges_[elbow / 2] = blocked_ranges(elbow);
        std::vector<std::optional<Surveyed>> found(asked.size());
        const bool of_user = options_.allowed && !options_.allowed_everywhere;  // one thread calls the user's
                                                                                // function
        if (options_.threads != 1 && asked.size() > 1 && base_.size() >= plan_tuning::alone && !of_user) {
            const long long share = links_ / plan_tuning::at_once;
            std::atomic<bool> spent{false};
            const auto look = [&](std::size_t k) {
                if (spent) return;
                Surveyed now = survey(asked[k], share);
                advance();
                if (now.most > share)
                    spent = true;
                else
                    found[k] = std::move(now);
            };
            in_turn(asked.size(), options_.threads, look, [this] { task_.pass_checkpoint(); });
        }
        for (std::size_t k = 0; k < asked.size(); ++k) {
            const bool unseen = !found[k];
            if (unseen || found[k]->most > links_) found[k] = survey(asked[k], links_);
            if (unseen) advance();
            Surveyed& one = *found[k];
            links_ -= one.links;
            plan_.start_gap = max(plan_.start_gap, one.start_gap);  // 0 except in the branch of the start
            plan_.goal_gap = max(plan_.goal_gap, one.goal_gap);
            const auto gc = static_cast<std::size_t>(asked[k]);
            coarse_[gc] = std::move(one.coarse);
            spread_[gc] = one.spread;
            plan_.branches.push_back(std::move(one.report));
        }
    }

    /// Searches a path in a branch; the result has its rating, or the reason for none. allowed: permitted
    /// links.
    Surveyed survey(int gc, const long long allowed) const {
        Surveyed found;
        BranchReport& out = found.report;
        out.gc = gc;
        const Tube t = tube_on(gc, base_);
        const AnchoredEnds fixed = ends_.ends(t, options_.start, options_.goal);
        found.start_gap = fixed.start.gap;
        found.goal_gap = fixed.goal.gap;
        long long left = allowed;
        if (!fixed.held()) reasons_.refuse_end(fixed, options_.start, options_.goal, out);
        const bool refused = !fixed.held() && !out.elsewhere && out.status != Status::OUTSIDE;
        out.sections = static_cast<unsigned>(t.sections.size());
        Way way;
        if (fixed.starts) {
            way = widest(t, fixed, left, found.spread);
            if (way.reached) out.reached = t.sections[way.reached - 1].s;
        }
        if (const std::size_t at = reasons_.first_empty(t); at < t.sections.size() && !refused) {
            reasons_.explain_empty(t, at, out);
        } else if (fixed.held() && !way.whole) {
            out.given_up = way.given_up || t.coarse;
            out.verdict = out.given_up ? Verdict::unresolved : Verdict::dead_end;
            out.status = Status::LIMITS;
            if (way.reached) reasons_.explain_end(t, way, out);
            if (options_.start && out.reached < PlanReasonsTuning::nearly_shut)
                reasons_.explain_turns(options_.start, 0, out);
            out.from = out.reached;
            out.to = way.reached < t.sections.size() ? t.sections[way.reached].s : 1.0;
            if (way.reached)
                out.nearest_psi = reasons_.nearest_psi(t, t.sections[way.reached], way.rows.back().phi);
        } else if (fixed.held()) {
            const FixedEnds ends = fixed_ends(fixed, way.rows[0].q);
            Way cheap;
            long long uncounted = left;  // the budget of other branches is not spent on it
            if (options_.start || options_.goal)
                cheap = search(t, fixed.start, fixed.goal, found.spread, uncounted)
                            .run(min(way.margin, plan_tuning::cheap));
            found.most = allowed - uncounted;
            found.coarse = coarse_optima(task_, options_.objective, t, way, cheap, ends);
            if (found.coarse.empty())
                found.coarse.push_back(as_it_is(task_, options_.objective, gc, ends, along(t, way, base_)));
            const Optimum& best = found.coarse.front();
            out.margin = best.found() ? best.margin : way.margin;
            out.cost = best.found() ? best.terms.weighed(options_.objective) : infinity;
            out.stationarity = best.stationarity;
            out.elbow_margin = cost_.least_elbow_margin(t, way);
        }
        found.links = allowed - left;
        found.most = std::max(found.most, found.links);
        return found;
    }

    /// The best path with the fewest revolutions at a free start that give `enough` margin, or with all that
    /// are tried; `found` returns their number. links: permitted number, counted down.
    Way widest(const Tube& t, const AnchoredEnds& fixed, long long& links, int& found) const {
        Way best;
        const int first = loose_ && !fixed.start.given && !fixed.goal.given ? any_winding : 0;
        for (int spread = first; spread <= candidate_tuning::windings; ++spread) {
            Way way = search(t, fixed.start, fixed.goal, spread, links).run(-infinity);
            if (spread == any_winding && way.whole && !is_inside(way)) continue;
            const bool more = way.more && !way.given_up, spent = way.given_up;
            if (best.rows.empty() || better(way, best)) {
                best = std::move(way);
                found = spread;
            }
            best.given_up = spent && !best.whole;
            if (!more || spread == any_winding || (best.whole && winds_well(best))) break;
        }
        return best;
    }

    /// The search with this spread of revolutions; if it is `any_winding`, with the task `loose_`.
    Search search(const Tube& t, const Anchor& start, const Anchor& goal, int spread,
                  long long& links) const {
        const Task& task = spread == any_winding ? *loose_ : task_;
        return {task, t, options_.objective, start, goal, std::max(spread, 0), links};
    }

    /// Whether a path found without the limits of joints with several revolutions respects them as well as
    /// any path.
    bool is_inside(const Way& way) const noexcept {
        for (const Candidate& x : way.rows)
            if (!within_limits(task_.limits, x.q, 0.0)) return false;
        return winds_well(way);
    }

    /// Makes the task without the limits of joints with a range of 4 pi or more, if there are many. Their
    /// combinations are too many to search, and a motion seldom needs them.
    void loosen() {
        Limits free = task_.limits;
        int wide = 0;
        for (const int j : pivot_joint) {
            const double range = free.upper[j] - free.lower[j];
            if (range < 2.0 * two_pi - tolerance::angle || is_unlimited(free, j)) continue;
            free.lower[j] = -infinity;
            free.upper[j] = infinity;
            ++wide;
        }
        if (wide > plan_tuning::few_winding) loose_.emplace(task_).limits = free;
    }

    /// Whether path a is better than b: by margin if both lead from start to goal, else by how far they lead.
    static bool better(const Way& a, const Way& b) noexcept {
        if (a.whole != b.whole) return a.whole;
        return a.whole ? a.margin > b.margin + way_tuning::tie : a.reached > b.reached;
    }

    /// Whether other revolutions cannot improve a path, because its distance from the limits of all joints
    /// with several revolutions exceeds its margin, or the required one.
    bool winds_well(const Way& way) const noexcept {
        const double enough = min(way.margin + way_tuning::tie, options_.objective.enough);
        for (const Candidate& x : way.rows)
            for (int p = 0; p < pivots && options_.objective.limits > 0; ++p) {
                const int j = pivot_joint[p];
                const double low = task_.limits.lower[j], high = task_.limits.upper[j];
                if (high - low > two_pi && min(x.q[j] - low, high - x.q[j]) < enough) return false;
            }
        return true;
    }

    /// The number of links that may be tried.
    long long allowance() const noexcept {
        return plan_tuning::links *
               std::max(static_cast<long long>(base_.size()), plan_tuning::least_sections);
    }

    /// Chooses the best branch with a proven curve; else the first without a violation; else a partial path.
    void choose() {
        links_ = std::max(links_, 0LL) + allowance();
        Plan first;
        bool any = false, proven = false;
        double least = infinity;  // of the proven ones
        for (BranchReport& report : plan_.branches) {
            // if no descent found a cost it is infinite, which does not exclude a path
            if (report.verdict != Verdict::ok || (proven && !(report.cost < least))) break;
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
        if (margin || base_.size() > crossing_tuning::most_sections || (proven && free)) return;
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
        if (!plan_.ok && links_ < 0) give_up_crossing();
        if (!plan_.ok && tried.start.given) cross_partly(tried);
    }

    /// Draws the curve as far as the start leads through branches that meet, up to the first violated limit.
    /// Used if that is farther than in a single branch.
    void cross_partly(CrossingTask& asked) {
        asked.goal = {};
        asked.partial = true;
        links_ = allowance();
        Plan found;
        double end = 0;
        for (int round = 0; round < plan_tuning::rounds; ++round) {
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
                asked.sections.size() > crossing_tuning::most_sections)
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
            const int parts = static_cast<int>(std::ceil(gap / crossing_tuning::longest));
            for (int i = 0; i < parts; ++i) out.push_back(base_[k] + gap * i / parts);
        }
        out.push_back(1.0);
        const double first = out[1], last = 1.0 - out[out.size() - 2];
        if (base_.size() <= plan_tuning::least_sections)
            for (const int gc : asked.branches) {
                const Tube t = tube_on(gc, base_);
                if (t.sections.size() > base_.size() + plan_tuning::least_sections) continue;
                for (const Section& x : t.sections) out.push_back(x.s);
            }
        for (const double share : crossing_tuning::beside) {
            if (asked.start.given) out.push_back(share * first);
            if (asked.goal.given) out.push_back(1.0 - share * last);
        }
        const bool from_shut =
                       asked.start.given && singularity_sine(task_.arm, asked.start.q) <= tolerance::one_axis,
                   to_shut =
                       asked.goal.given && singularity_sine(task_.arm, asked.goal.q) <= tolerance::one_axis;
        std::erase_if(out, [&](double s) {
            return (from_shut && s > 0 && s < crossing_tuning::shut_step) ||
                   (to_shut && s < 1 && 1 - s < crossing_tuning::shut_step);
        });
        tidy(out);
        return out;
    }

    /// Writes the curve of a path that changes branches, and its proof, to `out`; false if there is no path.
    /// The curve need not be proven.
    bool draw_crossing_once(const CrossingTask& asked, Plan& out) {
        Crossing crossing(task_, asked);
        out.stretches = crossing.run(out.gc, links_);
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
        for (int round = 0; round < plan_tuning::crossing_rounds; ++round) {
            if (!draw_crossing_once(asked, out)) return false;
            const bool held = !leaps(asked.start, out, false) && !leaps(asked.goal, out, true);
            if (held && (out.proof.certified() || out.proof.violated.empty())) return true;
            const std::size_t before = asked.sections.size();
            add_sections(out, asked.sections);
            if (asked.sections.size() == before || asked.sections.size() > crossing_tuning::most_sections)
                break;
        }
        return false;
    }

    /// Draws the curve with the full target for psi. If that is not proven, or a joint moves too fast, takes
    /// the curve of least objective with a smaller weight of the target. Near theta_2 = 0 or theta_6 = 0 the
    /// target may need too much joint motion.
    bool draw_wished(const CrossingTask& asked, Plan& out) {
        bool any = false;
        for (const double share : plan_tuning::of_wish) {
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

    /// Writes the curve of a branch that has a path to `out`: the curve of least objective. If that is not
    /// proven, a smooth curve along the path, with new sections where it violates a limit. False, with the
    /// reason in `report`, if none is proven or at least without a known violation.
    bool realise(BranchReport& report, Plan& out) {
        std::vector<double> base = base_;
        Plan best;
        for (int round = 0; round < plan_tuning::rounds; ++round) {
            const Tube t = tube_on(report.gc, base);
            const AnchoredEnds fixed = ends_.ends(t, options_.start, options_.goal);
            if (!fixed.held()) break;
            if (round == 0 && optimise(t, fixed, report, best)) {
                out = std::move(best);
                return true;
            }
            if (!follow_way(t, fixed, base, report, out)) break;
            if (!holds_ends(fixed, out)) {
                const bool start = leaps(fixed.start, out, false);
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
            add_sections(out, base);
        }
        report.verdict = Verdict::unresolved;
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
        const double inside = plan_tuning::end_step * (x.end - x.start);
        const auto off = [&](double s) { return largest_move(drawn.at(s).q, anchor.q); };
        return !(off(end ? x.end : x.start) <= plan_tuning::end_off) ||
               !(off(end ? x.end - inside : x.start + inside) <= PlanEndsTuning::end_move);
    }
    /// Whether the curve begins and ends at the given joints.
    bool holds_ends(const AnchoredEnds& fixed, const Plan& out) const noexcept {
        return !leaps(fixed.start, out, false) && !leaps(fixed.goal, out, true);
    }

    /// Finds the curve of least objective near the branch's coarse ones and writes it to `out`, with its cost
    /// in `report`; false if none is proven: `out` is then the last one tried.
    bool optimise(const Tube& t, const AnchoredEnds& fixed, BranchReport& report, Plan& out) const {
        const std::vector<Optimum>& coarse = coarse_[static_cast<std::size_t>(report.gc)];
        const FixedEnds ends = fixed_ends(fixed, coarse.front().q);
        for (const double wall : descent_tuning::wall) {
            bool slipped = false;
            for (const Optimum& best : fine_optima(task_, options_.objective, t.gc, ends, coarse, wall)) {
                draw(t, best, fixed.start.given ? fixed.start.q : best.q, report, out);
                if (holds_ends(fixed, out) && out.proof.certified()) return true;
                slipped = slipped || !out.proof.violated.empty();
                if (!holds_ends(fixed, out)) out.stretches.clear();
            }
            if (!slipped) break;
        }
        return false;
    }

    /// Writes a curve along the path of the search to `out`, proven or not. If it is proven, the objective is
    /// also minimized on its knots, which is kept if it is proven too. False if the search has no whole path.
    bool follow_way(const Tube& t, const AnchoredEnds& fixed, const std::vector<double>& base,
                    BranchReport& report, Plan& out) {
        Search ways = search(t, fixed.start, fixed.goal, spread_[t.gc], links_);
        const Way best = ways.run(-infinity);
        if (!best.whole) return false;
        const double floor = way_tuning::keep * min(best.margin, options_.objective.enough);
        Way way = ways.run(floor);
        if (!way.whole) way = best;
        relax(task_, t, options_.objective, way, fixed.start.given, fixed.goal.given, floor);
        const double* first = way.rows[0].q;
        const Spline drawn = along(t, way, base);
        const FixedEnds ends = fixed_ends(fixed, first);
        draw(t, as_it_is(task_, options_.objective, t.gc, ends, drawn), first, report, out);
        if (!out.proof.certified()) return true;
        Plan better;
        BranchReport its = report;
        const Optimum least =
            fine_optimum(task_, options_.objective, t.gc, ends, drawn, descent_tuning::wall[0]);
        if (least.found()) draw(t, least, first, its, better);
        if (least.found() && better.proof.certified() && holds_ends(fixed, better)) {
            out = std::move(better);
            report = its;
        }
        return true;
    }

    /// The curve of a plan as it is now.
    Curve curve(const Plan& x) const noexcept {
        return {task_.arm, task_.plane, x.gc, {task_.segments, task_.segment_count}, x.stretches};
    }

    /// The spline through the phi of a path at its knots.
    Spline along(const Tube& t, const Way& way, const std::vector<double>& base) const {
        std::vector<double> s, phi;
        for (const std::size_t k : knots(t, base, way.rows.size())) {
            s.push_back(t.sections[k].s);
            phi.push_back(way.rows[k].phi);
        }
        return spline(s, s, phi);
    }

    /// Writes a spline of phi(s) into a plan: its branch and its stretches with joint values. The first
    /// joints are in the revolution nearest to q.
    void draw(const Tube& t, const Spline& drawn, const double* q, Plan& out) const {
        out.gc = t.gc;
        out.stretches = stretches_of(drawn, {task_.segments, task_.segment_count});
        const Circle<double>& c = t.sections[0].motion.circle;
        const SinCos<double> sc = sin_cos(drawn.control.front());
        const double psi =
            arm_angle(triad(task_.arm, flange_pose(task_.arm, task_.pose(0.0))), c.z * sc.cos + c.e * sc.sin);
        lift_stretches(curve(out), out.stretches, q, psi);
    }

    /// Writes an optimal curve into a plan, with its proof, and its rating into the report. The first joints
    /// are in the revolution nearest to q.
    void draw(const Tube& t, const Optimum& x, const double* q, BranchReport& report, Plan& out) const {
        draw(t, x.curve, q, out);
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
        const Tube t = tube_on(gc, base_);
        Anchor start;
        if (options_.start) {
            start = ends_.anchor(t, t.sections.front(), options_.start);
            if (!start.given) return;
        }
        const Anchor goal;
        links_ = allowance();
        Way way = search(t, start, goal, spread_[gc], links_).run(-infinity);
        if (way.reached < 2) return;
        relax(task_, t, options_.objective, way, start.given, false,
              way_tuning::keep * min(way.margin, options_.objective.enough));
        draw(t, along(t, way, base_), way.rows[0].q, plan_);
    }

    double start_[joints] = {}, goal_[joints] = {};  // with the fixed joint 7
    PlanOptions options_;
    std::vector<Optimum> coarse_[configurations];  // of each branch, on few knots, the best first
    std::vector<double> base_;
    long long links_;  // that may still be tried
    static constexpr int any_winding = -1;
    int spread_[configurations] = {};        // of each branch: the turns with which its path was found
    std::vector<double> blocked_ranges_[2];  // for each requested side of the elbow
    Task task_;
    PlanEnds ends_{task_};
    PlanReasons reasons_{task_};
    CurveCost cost_{task_, options_.objective};
    std::optional<Task> loose_;
    bool touching_ = false;  // a requested end is in contact, see touches()
    Plan plan_;
};

}  // namespace detail

namespace plan_tuning {
/// Alternatives tried if duration is weighed, besides a plan without it: its weight next to a weight of
/// travel that is at least this share of it.
inline constexpr double calm[] = {0, 0.1, 1};
}  // namespace plan_tuning

namespace detail {

/// The plan of planned(options). If the objective weighs duration, alternatives are planned too: one without
/// weight on it, and some with more weight on travel. The proven plan of least duration is returned, or the
/// one without weight if none is proven. The weighed measure (pace) ignores accelerations, so alone it may
/// cost time, and even joint motion is often faster. curve_of(plan): its curve.
template <class Planned, class CurveOf>
Plan fastest(const PlanOptions& options, const Planned& planned, const CurveOf& curve_of) {
    PlanOptions asked = options;
    const auto takes = [&](const Plan& x) {
        return x.ok && x.proof.certified() ? duration(curve_of(x), options.bounds) : infinity;
    };
    const double weight = options.objective.duration;
    asked.objective.duration = 0;
    Plan best = planned(asked);
    if (!(weight > 0) || !best.ok) return best;
    asked.objective.duration = weight;
    double least = takes(best);
    for (const double calm : plan_tuning::calm) {
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

/// Plans the path of n segments, from s = 0 to 1. rows: parameters that must be sections.
inline Plan plan(const Arm& arm, const Segment* segments, std::size_t n, const double* rows,
                 std::size_t row_count, const PlanOptions& options) {
    const auto planned = [&](const PlanOptions& asked) {
        return detail::Planner(arm, segments, n, rows, row_count, asked).run();
    };
    return detail::fastest(options, planned, [&](const Plan& x) {
        return Curve{arm, x.plane, x.gc, {segments, n}, x.stretches};
    });
}

}  // namespace armangle

#include "../names/end.hpp"
