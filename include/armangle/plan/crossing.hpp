// Paths that change from branch to branch where two of them meet, and paths that begin or end there.
//
//     theta_2 |.        GC 0        At theta_2 = 0 the solutions of two branches coincide, and theta_1 is
//             |  ` .                free: a motion that keeps theta_1 passes through. phi does not
//           0 +------`o--------> s  describe it there (every theta_1 belongs to one phi), but theta_1 does:
//             |        ` . _        it leads, and phi follows (psi_from_joint.hpp).
//             |    GC 1     ` '
//
// The search is dynamic programming over the configurations of several branches at once (candidates.hpp). It
// adds grids of the leading angle near theta_2 = 0 (theta_6 = 0). Links join configurations of one branch, or
// of two that meet there, by |dq| alone. Each row then moves along the fastest of phi, theta_1 and theta_5,
// with finite rates of all joints, to the least travel. Runs of rows with the same leader become splines that
// join twice differentiably. certify.hpp proves the result; otherwise it is dropped.
#pragma once

#include <memory>

#include "certify.hpp"
#include "anchor.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of paths that change from branch to branch.
struct CrossingTuning {
    static constexpr double near =
        0.35;  // |theta| of a hinge up to which the pivot next to it may lead (rad)
    static constexpr double grid = 0.25;   // spacing of the leading theta (rad)
    static constexpr double move = 0.8;    // of a joint from section to section (rad)
    static constexpr double leads = 3.0;   // a pivot leads if it turns so many times as fast as phi ...
    static constexpr double keeps = 1.0;   // ... and may still lead at the next row if it turns so fast
    static constexpr double slope = 1e-3;  // least slope of the tie of a leading angle
    static constexpr int rounds = 40;      // of smoothing
    static constexpr double damping = 1e-3, ease = 0.1, firm = 100,
                            least_damping = 1e-14;  // of a row's own stiffness: some rows are only 1e-6 of s
                                                    // apart
    static constexpr double worth = 1e-4;      // share of the energy that rounds must save, or there are ...
    static constexpr int patience = 10;        // ... at most as many more
    static constexpr double step = 0.3;        // largest move of a row in one round (rad)
    static constexpr double done = 1e-12;      // share of the energy that a last round saves
    static constexpr double apart = 1e-3;      // of s: between knots of the leader, and of phi ...
    static constexpr double straight = 1e-4;   // ... if rows between deviate less from a straight line (rad)
    static constexpr double least_bend = 0.1;  // share of the greatest curvature of the target's cost
    static constexpr double probe = 1e-5;      // move of a row that measures its slope (rad)
    static constexpr double reference = 0.1,
                            floor = 1e-3;      // cost of a distance d from a limit: (reference / d)^2
    static constexpr double longest = 0.0055;  // of s from section to section
    static constexpr std::size_t most_sections = 4000;
    static constexpr long long share = 4;            // of the work left: the links that one search is to try
    static constexpr long long least_postures = 50;  // continuing configurations of a section, in any case
    static constexpr double shut_step = 5e-3;  // of s: from an end with both hinges at 0 to the next section
    static constexpr double beside[] = {
        1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3,
        0.01, 0.03, 0.08, 0.2,  0.45};  // of the step at a fixed end: additional sections
};

/// The problem of a path that may change its branch.
struct CrossingTask {
    std::vector<int> branches;     // branches that may be used
    std::vector<double> sections;  // s, rising from 0 to 1
    Anchor start, goal;
    bool partial = false;  // as far as possible from the start
    int locked = 0;        // a joint, 1..7, without room within its limits: it leads all the way ...
    double theta = 0;      // ... with this theta
    double wish = 0;       // cost of the squared angle to the task's target for psi
};

namespace detail {

/// The signed difference (rad) of theta of joint 2 or 6 from the nearest of 0 and +-pi, where branches meet.
inline double from_meeting(double theta) noexcept { return theta - pi * round(theta / pi); }

/// Whether joint 2 or 6 (h: 0, 1) comes near 0, or near pi if limits permit, at some phi.
inline bool meets(const JointFunctions<double>& f, const LimitTable& limits, int h) noexcept {
    const double most = 1.0 - std::cos(CrossingTuning::near);
    return f.hinge[h].high.below_one < most ||
           (f.hinge[h].low.above_minus_one < most && limits.least_cosine[h] < most - 1.0);
}

/// The joint that may lead near joint 2 or 6 (h: 0, 1), because it shares the axis of the joint two further
/// on if that one is 0: joint 1 or 5.
inline int leading_joint(int h) noexcept { return pivot_joint[2 * h] + 1; }

/// Searches a path that may change its branch where two branches meet.
class Crossing {
public:
    /// Keeps references to its arguments; run() searches the path.
    Crossing(const Task& task, const CrossingTask& asked) : task_(task), asked_(asked) {
        if (task.encumbered()) left_.resize(asked.sections.size() * configurations);
    }

    /// Returns the stretches of a path and writes the branch in which it begins to `gc`; empty, with `gc`
    /// unchanged, if it finds none, also if the work of the task is spent.
    std::vector<Stretch> run(int& gc) {
        find_wished();
        if (!search()) return {};
        if (asked_.locked) {
            gc = rows_.front().gc;
            return stand_still();
        }
        choose_leads();
        relax();
        choose_leads();
        relax();
        gc = rows_.front().gc;
        return draw(false);
    }

    /// Returns the path that run() found with fewer knots of phi, since third derivatives of a spline with
    /// knots 1e-6 of s apart are mere rounding. Empty if a joint is locked.
    std::vector<Stretch> calmly() const { return asked_.locked ? std::vector<Stretch>{} : draw(true); }

    /// The joints (rad) at the start of the path that run() found.
    const double* first() const noexcept { return rows_.front().q; }

private:
    struct Node {
        Candidate posture;
        double hinge[2], rated, cost = infinity;
        std::uint32_t from = 0;
    };

    struct Block {  // the turns of one phi
        Windings windings;
        int gc;
    };

    struct EightBlocks {  // of one branch
        EightWindings windings;
        int gc;
    };

    /// One row of the path: its place, what it moves along, and its joints.
    struct Row {
        double s;
        int gc, lead = 0;
        double side = 0, x = 0;  // phi, or theta of the leading joint
        double q[joint_slots], slope[joints];
        double phi, phi_slope;
        Circle<double> circle;
        bool fixed = false;
    };

    // ---- search

    /// The cost of the distances of joints q from their limits, without joint 4.
    double limit_cost(const double* q) const noexcept {
        double sum = 0;
        for (int j = 0; j < joints; ++j) {
            if (j == 3) continue;
            for (const double d : {q[j] - task_.limits.lower[j], task_.limits.upper[j] - q[j]}) {
                if (!(d < infinity)) continue;
                const double share = CrossingTuning::reference / max(d, CrossingTuning::floor);
                sum += share * share;
            }
        }
        return task_.margin_scale() * sum;
    }

    /// Computes the target phi at each section; NaN without a target. It is the same in all branches with one
    /// sign of the elbow.
    void find_wished() {
        wished_.assign(asked_.sections.size(), not_a_number);
        if (!(asked_.wish > 0) || asked_.branches.empty()) return;
        for (std::size_t k = 0; k < wished_.size(); ++k)
            wished_[k] = task_.wished_phi(asked_.branches.front(), asked_.sections[k]);
    }

    /// The cost of phi at section k for its distance from the target; 0 without a target.
    double wish_cost_of(std::size_t k, double phi) const noexcept {
        return asked_.wish * wish_cost(phi - wished_[k]);
    }

    /// The node of a configuration at section k with its own cost per s (`rated`), not yet linked.
    Node node(std::size_t k, const Candidate& x) const noexcept {
        Node out{x, {}, limit_cost(x.q) + wish_cost_of(k, x.phi)};
        for (int h = 0; h < hinges; ++h)
            out.hinge[h] = from_meeting(to_theta(task_.arm, hinge_joint[h], x.q[hinge_joint[h]]));
        return out;
    }

    /// Whether obstacles and the user permit phi of self-motion m at section k. The permitted arcs are
    /// stored, because they are needed often.
    bool open(std::size_t k, const SelfMotion<double>& m, double phi) {
        if (!task_.encumbered()) return true;
        std::unique_ptr<ArcSet>& left = left_[k * configurations + static_cast<std::size_t>(index(m.gc))];
        if (!left) {
            left = std::make_unique<ArcSet>();
            ArcSet any;
            make_full(any);
            Tag blocking = 0;
            task_.take(task_.section_work(asked_.sections[k]));
            task_.keep_open(asked_.sections[k], m, any, *left, blocking);
        }
        return contains(*left, phi);
    }

    /// Appends to `out` the permitted configurations of section k in branch gc at which theta_1 (theta_5) has
    /// values on a grid and theta_2 (theta_6) is near 0 or pi (h: 0, 1); none if the pose is out of reach.
    void fill_by_lead(std::size_t k, const Section& l, int gc, int h, const Window& window,
                      Candidates& candidates, Postures& out) {
        if (l.status == Status::UNREACHABLE || l.status == Status::FOLDED) return;
        if (!meets(l.functions, task_.table, h)) return;
        const int joint = leading_joint(h), j = hinge_joint[h];
        const double own = (h == 0 ? configuration(gc).shoulder : configuration(gc).wrist);
        const Anchor& end = asked_.start.given ? asked_.start : asked_.goal;
        const double from = end.given ? to_theta(task_.arm, joint - 1, end.q[joint - 1]) : 0.0;
        const int n = static_cast<int>(two_pi / CrossingTuning::grid);
        for (int i = 0; i < n; ++i) {
            const SinCos<double> theta = sin_cos(from + two_pi * i / n);
            const Harmonic<double> f = joint_condition(l.functions, joint, theta);
            for (const double side : {-1.0, 1.0}) {
                const PsiFromJoint<double> led = psi_from_joint(f, side);
                if (!(led.slope_square > CrossingTuning::slope * CrossingTuning::slope)) continue;
                const Directions<double> d = directions_with_joint(l.motion, led.psi, joint, theta);
                const double angle = atan2(d.y[j], d.x[j]);
                if (abs(from_meeting(angle)) > CrossingTuning::near || (angle * own < 0) ||
                    (angle == 0 && own < 0))
                    continue;
                if (!open(k, l.motion, atan2(led.psi.sin, led.psi.cos))) continue;
                double all[joint_slots];
                angles(d).store(all);
                candidates.put_posture(atan2(led.psi.sin, led.psi.cos), all, window, out);
            }
        }
    }

    /// Appends to `out` the permitted configurations of section k in branch gc with the locked joint at its
    /// value; none if the pose is out of reach.
    void fill_locked(std::size_t k, const Section& l, int gc, const Window& window, Candidates& candidates,
                     Postures& out) {
        if (l.status == Status::UNREACHABLE || l.status == Status::FOLDED) return;
        const int j = asked_.locked - 1;
        const SinCos<double> theta = sin_cos(asked_.theta);
        const Harmonic<double> f = joint_condition(l.functions, asked_.locked, theta);
        for (const double side : {-1.0, 1.0}) {
            const PsiFromJoint<double> led = psi_from_joint(f, side);
            if (!(led.slope_square > CrossingTuning::slope * CrossingTuning::slope)) continue;
            const Directions<double> d = directions_with_joint(l.motion, led.psi, asked_.locked, theta);
            double all[joint_slots];
            angles(d).store(all);
            double now[joints];
            for (int i = 0; i < joints; ++i) now[i] = all[i];
            const bool there = abs(wrap(all[j] - asked_.theta)) < CrossingTuning::slope;
            if (!there || index(configuration(task_.arm, now)) != gc) continue;
            if (!open(k, l.motion, atan2(led.psi.sin, led.psi.cos))) continue;
            all[j] = asked_.theta;
            candidates.put_posture(atan2(led.psi.sin, led.psi.cos), all, window, out);
        }
    }

    /// Searches the path of least cost from section to section, if the task is partial as far as possible,
    /// and stores its rows; false if there is none, or the work of the task is spent.
    bool search() {
        long long links = task_.work->left() / CrossingTuning::share;
        const Objective plain;
        std::size_t n = asked_.sections.size();
        std::vector<std::vector<Node>> layers(n);
        std::vector<std::vector<int>> branch(n);
        std::vector<Candidates> candidates(asked_.branches.size(), Candidates(task_, plain));
        std::vector<Block> blocks, before;
        std::vector<EightBlocks> eights;
        Window window;
        for (std::size_t k = 0; k < n; ++k) {
            const double s = asked_.sections[k];
            before.swap(blocks);
            blocks.clear();
            const bool first = k == 0 && asked_.start.given, last = k + 1 == n && asked_.goal.given;
            for (std::size_t b = 0; b < asked_.branches.size(); ++b) {
                const int gc = asked_.branches[b];
                Postures here;
                if (first || last) {
                    const Anchor& end = first ? asked_.start : asked_.goal;
                    if (own_branch(end) != gc) continue;
                    candidates[b].put_fixed(end.phi, 0, end.q, here);
                } else {
                    Tube alone;
                    const SolvedSection solved = solve_section(task_, gc, s);
                    alone.sections.push_back(solved.section);
                    alone.arcs.assign(solved.arcs.arc, solved.arcs.arc + solved.arcs.count);
                    alone.sections[0].first = 0;
                    alone.sections[0].count = static_cast<std::uint32_t>(solved.arcs.count);
                    if (asked_.goal.given && !asked_.start.given) candidates[b].set_reference(asked_.goal.q);
                    const Section& l = alone.sections[0];
                    if (asked_.locked) {
                        fill_locked(k, l, gc, window, candidates[b], here);
                    } else {
                        candidates[b].fill(alone, l, window, here);
                        for (int h = 0; h < hinges; ++h)
                            fill_by_lead(k, l, gc, h, window, candidates[b], here);
                    }
                }
                task_.take(WorkTuning::posture * static_cast<long long>(here.groups.size()));
                const std::size_t at = layers[k].size();
                for (Windings& w : here.groups) {
                    w.first += static_cast<std::uint32_t>(at);
                    blocks.push_back({w, gc});
                }
                for (const Candidate& x : here.all) {
                    layers[k].push_back(node(k, x));
                    branch[k].push_back(gc);
                }
            }
            if (k) std::erase_if(before, [&](const Block& x) { return !leads_on(x, layers[k - 1]); });
            eights.clear();
            for (const Block& block : before) {
                if (eights.empty() || eights.back().gc != block.gc || eights.back().windings.used == 8)
                    eights.push_back({{}, block.gc});
                eights.back().windings.add(block.windings);
            }
            bool alive = false;
            window.set = true;
            for (int j = 0; j < joints; ++j) {
                window.lower[j] = infinity;
                window.upper[j] = -infinity;
            }
            for (std::size_t i = 0; i < layers[k].size(); ++i) {
                Node& x = layers[k][i];
                if (k == 0) {
                    x.cost = 0;
                } else {
                    links = std::max(0LL, links - static_cast<long long>(before.size()));
                    task_.take(2 * static_cast<long long>(eights.size()));
                    const double ds = s - asked_.sections[k - 1];
                    for (const EightBlocks& eight : eights) link(x, branch[k][i], eight, layers[k - 1], ds);
                }
            }
            if (task_.work->spent()) return false;
            keep_cheapest(layers[k], links / (2 * static_cast<long long>(n - k)));
            for (const Node& x : layers[k]) {
                if (!(x.cost < infinity)) continue;
                alive = true;
                for (int j = 0; j < joints; ++j) {
                    window.lower[j] = min(window.lower[j], x.posture.q[j] - CrossingTuning::move);
                    window.upper[j] = max(window.upper[j], x.posture.q[j] + CrossingTuning::move);
                }
            }
            if (alive) continue;
            if (!asked_.partial || k < 2) return false;
            n = k;
        }
        std::size_t at = 0;
        for (std::size_t i = 1; i < layers[n - 1].size(); ++i)
            if (layers[n - 1][i].cost < layers[n - 1][at].cost) at = i;
        rows_.resize(n);
        for (std::size_t k = n; k-- > 0;) {
            const Node& x = layers[k][at];
            Row& row = rows_[k];
            row.s = asked_.sections[k];
            row.gc = branch[k][at];
            row.phi = x.posture.phi;
            row.circle = task_.circle_at(row.s);
            std::copy(x.posture.q, x.posture.q + joints, row.q);
            row.fixed = (k == 0 && asked_.start.given) || (k + 1 == n && asked_.goal.given);
            at = x.from;
        }
        if (n > 1) {
            share_branch(rows_.front(), rows_[1]);
            share_branch(rows_.back(), rows_[n - 2]);
        }
        for (std::size_t k = 1; k < n; ++k)
            for (int j = 0; j < joints; ++j)
                if (is_unlimited(task_.limits, j)) rows_[k].q[j] = lift(rows_[k].q[j], rows_[k - 1].q[j]);
        return true;
    }

    /// Sets the cost of all but the cheapest configurations of a section to infinity, so that the links to
    /// the next section, if it has as many configurations, stay within about `links`; at least 50 keep their
    /// cost, and more if costs are equal.
    void keep_cheapest(std::vector<Node>& layer, long long links) {
        const auto size = static_cast<long long>(layer.size());
        const long long most = std::max(CrossingTuning::least_postures, links / std::max(size, 1LL));
        if (size <= most) return;
        costs_.clear();
        for (const Node& x : layer) costs_.push_back(x.cost);
        const auto last = costs_.begin() + static_cast<std::ptrdiff_t>(most);
        std::nth_element(costs_.begin(), last, costs_.end());
        for (Node& x : layer)
            if (x.cost > *last) x.cost = infinity;
    }

    /// Whether any revolution of a block was reached.
    static bool leads_on(const Block& block, const std::vector<Node>& layer) noexcept {
        std::size_t count = 1;
        for (const int n : block.windings.count) count *= static_cast<std::size_t>(n);
        for (std::size_t i = 0; i < count; ++i)
            if (layer[block.windings.first + i].cost < infinity) return true;
        return false;
    }

    /// If theta_2 or theta_6 of a row is 0 or pi, gives it the branch signs of the row next to it.
    void share_branch(Row& row, const Row& beside) const noexcept {
        const int shared = shared_signs(chain(task_.arm, row.q).theta);
        row.gc = (row.gc & ~shared) | (beside.gc & shared);
    }

    /// The branch of an end of the path, with the elbow sign of the requested branches. If two branches
    /// coincide there, a requested one.
    int own_branch(const Anchor& end) const noexcept {
        const Chain now = chain(task_.arm, end.q);
        const int own = (index(configuration(task_.arm, now.theta)) & ~2) | (asked_.branches.front() & 2);
        const int shared = shared_signs(now.theta);
        int out = asked_.branches.front();
        for (const int gc : asked_.branches)
            if (gc == own || ((out ^ own) & ~shared)) out = gc;
        return (out ^ own) & ~shared ? own : out;
    }

    /// Whether theta_2 and theta_6 are both 0 or pi at a configuration.
    static bool both_shut(const Node& x) noexcept {
        return max(abs(x.hinge[0]), abs(x.hinge[1])) <= tolerance::one_axis;
    }

    /// Links x, in branch gc, to a node of `before`, the previous section at the distance ds of s, where that
    /// lowers the cost of x; leaves x unchanged if none does. Branches may differ only where joint 2 or 6 is
    /// near 0 or pi.
    void link(Node& x, int gc, const EightBlocks& eight, const std::vector<Node>& before,
              double ds) const noexcept {
        const int differ = gc ^ eight.gc;
        if (differ & 2) return;
        const EightMoves moves(task_, x.posture, eight.windings, infinity, CrossingTuning::move);
        for_each_bit(moves.linked, [&](int i) {
            const auto from = static_cast<std::uint32_t>(moves.from[i]);
            const Node& y = before[from];
            const double cost = y.cost + moves.travel[i] * moves.travel[i] / ds + ds * x.rated;
            if (!(cost < x.cost)) return;
            for (int h = 0; h < hinges; ++h) {
                if (!(differ & (h == 0 ? 1 : 4))) continue;
                if (abs(x.hinge[h]) > CrossingTuning::near || abs(y.hinge[h]) > CrossingTuning::near) return;
            }
            if (differ == 5 && !both_shut(x) && !both_shut(y)) return;
            x.cost = cost;
            x.from = from;
        });
    }

    // ---- rows

    /// The self-motion of a row.
    SelfMotion<double> motion(const Row& row) const noexcept {
        return self_motion(task_.arm, row.circle, configuration(row.gc));
    }

    /// Moves a row to the value x (rad) of its parameter; false, with the row unchanged, if the leading joint
    /// does not determine phi there.
    bool put(Row& row, double x) const noexcept {
        const SelfMotion<double> m = motion(row);
        Directions<double> d;
        SinCos<double> phi;
        if (row.lead == 0) {
            phi = sin_cos(x);
            d = directions(m, phi);
        } else {
            const SinCos<double> theta = sin_cos(x);
            const PsiFromJoint<double> led =
                psi_from_joint(joint_condition(joint_functions(m), row.lead, theta), row.side);
            if (!(led.slope_square > CrossingTuning::slope * CrossingTuning::slope)) return false;
            phi = led.psi;
            d = directions_with_joint(m, phi, row.lead, theta);
            Configuration<double> sign = m.gc;
            (row.lead == 1 ? sign.shoulder : sign.wrist) = d.y[row.lead] < 0 ? -1.0 : 1.0;
            row.gc = index(sign);
        }
        const Joints q = joints_near(task_.arm, d, row.q);
        std::copy(q.q, q.q + joints, row.q);
        row.x = x;
        row.phi = row.lead == 0 ? x : lift(atan2(phi.sin, phi.cos), row.phi);
        return true;
    }

    /// The speed |dtheta / dphi| of joint 1 or 5 (h: 0, 1) at a row; 0 if joint 2 (6) is not near 0 or pi, or
    /// theta does not determine phi.
    double speed(const Row& row, int h) const noexcept {
        const double theta = from_meeting(to_theta(task_.arm, hinge_joint[h], row.q[hinge_joint[h]]));
        if (abs(theta) > 2 * CrossingTuning::near) return 0;
        const JointFunctions<double> f = joint_functions(motion(row));
        const Harmonic<double> t = joint_condition(f, leading_joint(h), leading_theta(row, h));
        const double slope = abs(t.slope(sin_cos(row.phi)));
        return slope > CrossingTuning::slope ? slope / max(abs(std::sin(theta)), 1e-12) : 0.0;
    }
    /// Sine and cosine of theta, at a row, of the joint that may lead near joint 2 or 6 (h: 0, 1).
    SinCos<double> leading_theta(const Row& row, int h) const noexcept {
        const int j = leading_joint(h) - 1;
        return sin_cos(to_theta(task_.arm, j, row.q[j]));
    }

    /// Makes joint `lead` (1..7) the parameter of a row, at its present value; 0: phi.
    void set_lead(Row& row, int lead) const noexcept {
        row.lead = lead;
        if (lead == 0) {
            row.x = row.phi;
            return;
        }
        row.x = to_theta(task_.arm, lead - 1, row.q[lead - 1]);
        const Harmonic<double> t = joint_condition(joint_functions(motion(row)), lead, sin_cos(row.x));
        row.side = t.slope(sin_cos(row.phi)) > 0 ? -1.0 : 1.0;
    }

    /// Chooses the parameter of each row: theta_1 or theta_5 where it is much faster than phi, otherwise phi.
    /// A joint keeps leading while it is no slower than phi, so that the change happens where both are
    /// possible.
    void choose_leads() {
        const std::size_t n = rows_.size();
        std::vector<int> lead(n, 0);
        for (std::size_t k = 0; k < n; ++k) {
            double most = CrossingTuning::leads;
            for (int h = 0; h < hinges; ++h) {
                const double now = speed(rows_[k], h);
                if (now > most) {
                    most = now;
                    lead[k] = leading_joint(h);
                }
            }
        }
        const auto spread = [&](std::size_t k, std::size_t from) {
            if (lead[k] != 0 || lead[from] == 0) return;
            if (speed(rows_[k], lead[from] == 1 ? 0 : 1) > CrossingTuning::keeps) lead[k] = lead[from];
        };
        for (std::size_t k = 1; k < n; ++k) spread(k, k - 1);
        for (std::size_t k = n - 1; k-- > 0;) spread(k, k + 1);
        for (std::size_t k = 0; k < n; ++k) {
            set_lead(rows_[k], lead[k]);
            if (lead[k] == 0 && k && rows_[k - 1].lead == 0)
                rows_[k].x = rows_[k].phi = lift(rows_[k].phi, rows_[k - 1].phi);
        }
    }

    // ---- smoothing: Gauss-Newton steps with Marquardt's damping

    /// The cost of the path: joint travel, distances from limits, and distances from the target.
    double energy() const noexcept {
        double sum = 0;
        for (std::size_t k = 0; k < rows_.size(); ++k) {
            sum += share(k) * (limit_cost(rows_[k].q) + wish_cost_of(k, rows_[k].phi));
            if (k == 0) continue;
            double d = 0;
            for (int j = 0; j < joints; ++j) {
                const double move = rows_[k].q[j] - rows_[k - 1].q[j];
                d += move * move;
            }
            sum += d / (rows_[k].s - rows_[k - 1].s);
        }
        return sum;
    }
    /// The part of s that a row represents: half the distance between its neighbours.
    double share(std::size_t k) const noexcept {
        const std::size_t n = rows_.size();
        return 0.5 *
               ((k ? rows_[k].s - rows_[k - 1].s : 0.0) + (k + 1 < n ? rows_[k + 1].s - rows_[k].s : 0.0));
    }

    /// Computes the derivatives of each row's joints and phi with respect to its parameter, by differences; 0
    /// where there is no configuration.
    void find_slopes() {
        for (Row& row : rows_) {
            Row left = row, right = row;
            const bool both =
                put(left, row.x - CrossingTuning::probe) && put(right, row.x + CrossingTuning::probe);
            for (int j = 0; j < joints; ++j)
                row.slope[j] = both ? (right.q[j] - left.q[j]) / (2 * CrossingTuning::probe) : 0.0;
            row.phi_slope = both ? wrap(right.phi - left.phi) / (2 * CrossingTuning::probe) : 0.0;
        }
    }

    /// Moves the rows that are not fixed to reduce the cost of the path, by damped Gauss-Newton steps.
    void relax() {
        const std::size_t n = rows_.size();
        if (n < 2) return;
        std::vector<double> gradient(n), diagonal(n), off(n), move(n);
        std::vector<Row> best;
        double now = energy(), damping = CrossingTuning::damping, mark = now;
        int idle = 0;
        for (int round = 0; round < CrossingTuning::rounds && damping < 1e6; ++round) {
            task_.take(WorkTuning::cell * static_cast<long long>(n));
            find_slopes();
            for (std::size_t k = 0; k < n; ++k) {
                gradient[k] = diagonal[k] = off[k] = 0;
                own_slopes(k, gradient[k], diagonal[k]);
            }
            for (std::size_t k = 0; k + 1 < n; ++k) {
                const Row &a = rows_[k], &b = rows_[k + 1];
                const double w = 2 / (b.s - a.s);
                for (int j = 0; j < joints; ++j) {
                    const double d = b.q[j] - a.q[j];
                    gradient[k] -= w * d * a.slope[j];
                    gradient[k + 1] += w * d * b.slope[j];
                    diagonal[k] += w * a.slope[j] * a.slope[j];
                    diagonal[k + 1] += w * b.slope[j] * b.slope[j];
                    off[k] -= w * a.slope[j] * b.slope[j];
                }
            }
            double carried = 0, moved = 0;
            for (std::size_t k = 0; k < n; ++k) {
                const bool free = !rows_[k].fixed, linked = k > 0 && free && !rows_[k - 1].fixed;
                const double below = linked ? off[k - 1] : 0.0;
                const double pivot = (free ? diagonal[k] * (1 + damping) + 1e-12 : 1.0) - below * carried;
                carried = (k + 1 < n && free && !rows_[k + 1].fixed ? off[k] : 0.0) / pivot;
                moved = ((free ? -gradient[k] : 0.0) - below * moved) / pivot;
                move[k] = moved;
                diagonal[k] = carried;
            }
            for (std::size_t k = n - 1; k-- > 0;) move[k] -= diagonal[k] * move[k + 1];
            best = rows_;
            for (std::size_t k = 0; k < n; ++k) {
                const double step = min(max(move[k], -CrossingTuning::step), CrossingTuning::step);
                Row row = rows_[k];
                if (!row.fixed && put(row, row.x + step) && within_limits(task_.limits, row.q, 0.0) &&
                    open(k, motion(row), row.phi))
                    rows_[k] = row;
            }
            const double then = energy();
            if (then < now) {
                const bool done = now - then < CrossingTuning::done * now;
                now = then;
                damping = max(damping * CrossingTuning::ease, CrossingTuning::least_damping);
                if (done) return;
            } else {
                rows_ = best;
                damping *= CrossingTuning::firm;
            }
            if (now < (1 - CrossingTuning::worth) * mark) {
                mark = now;
                idle = 0;
            } else if (++idle == CrossingTuning::patience) {
                return;
            }
        }
    }

    /// Adds the first derivative (to `gradient`) and a positive second derivative (to `diagonal`) of the cost
    /// of row k by its parameter.
    void own_slopes(std::size_t k, double& gradient, double& diagonal) const noexcept {
        const Row& row = rows_[k];
        if (!is_nan(wished_[k])) {
            const SinCos<double> gap = sin_cos(row.phi - wished_[k]);
            const double w = 2 * share(k) * asked_.wish * row.phi_slope;
            gradient += w * gap.sin;
            diagonal += w * row.phi_slope * max(gap.cos, CrossingTuning::least_bend);
        }
        for (int j = 0; j < joints; ++j) {
            if (j == 3) continue;
            for (const double sign : {-1.0, 1.0}) {
                const double d =
                    sign < 0 ? task_.limits.upper[j] - row.q[j] : row.q[j] - task_.limits.lower[j];
                if (!(d < infinity)) continue;
                const double held = max(d, CrossingTuning::floor);
                const double c = share(k) * task_.margin_scale() * CrossingTuning::reference *
                                 CrossingTuning::reference / (held * held);
                const double slope = -2 * c / held * sign * row.slope[j];
                gradient += slope;
                diagonal += 1.5 * slope * slope / max(c, 1e-300);
            }
        }
    }

    // ---- curve

    /// Value, first and second derivative of a parameter with respect to s.
    struct Joint3 {
        double value, slope, curvature;
    };
    /// Computes the parameter of the next run (joint `lead`, or phi if 0) at the end of a stretch, with two
    /// derivatives by s, in the revolution nearest to `near` (rad).
    Joint3 at_end(const Curve& curve, const Stretch& x, int lead, double near) const noexcept {
        using J = Jet<double, 3>;
        const J s = J::variable(x.end);
        const PlacedDirections<J> here = curve.place(x, s, phi_at(x, s));
        const J angle = lead == 0 ? atan2(here.phi.sin, here.phi.cos)
                                  : atan2(here.angles.y[lead - 1], here.angles.x[lead - 1]);
        return {lift(angle.value(), near), angle.coefficient[1], 2 * angle.coefficient[2]};
    }

    /// Draws the path as splines over runs of rows with the same parameter; `few`: with fewer knots of phi.
    /// Each spline joins the next with two continuous derivatives.
    std::vector<Stretch> draw(bool few) const {
        std::vector<Stretch> out;
        const std::size_t n = rows_.size();
        std::size_t from = 0;
        while (from + 1 < n) {
            const int lead = step_lead(from);
            std::size_t to = from + 1;
            while (to + 1 < n && step_lead(to) == lead) ++to;
            if (!piece(from, to, lead, few, out)) return {};
            from = to;
        }
        return out;
    }

    /// The stretches from row to row if a joint is locked: it leads each, with its constant value.
    std::vector<Stretch> stand_still() {
        std::vector<Stretch> out;
        for (Row& row : rows_) set_lead(row, asked_.locked);
        for (std::size_t k = 0; k + 1 < rows_.size(); ++k) {
            Stretch& x = out.emplace_back();
            x.start = rows_[k].s;
            x.end = rows_[k + 1].s;
            for (double& c : x.coefficient) c = 0;
            x.coefficient[0] = asked_.theta;
            x.lead = asked_.locked;
            x.side = rows_[k].side;
            x.branch = rows_[k].gc;
        }
        return out;
    }

    /// The leading joint from row k to the next: that of the later row or, if phi leads there, of the
    /// earlier; 0: phi.
    int step_lead(std::size_t k) const noexcept {
        return rows_[k + 1].lead != 0 ? rows_[k + 1].lead : rows_[k].lead;
    }

    /// Whether a spline needs no knot at s, because it is close to the latest of the knots `before` or to
    /// `last`, the end of the run. After another run (`first` is false), knots start as dense as rows and
    /// thin out; the end of each segment stays a knot.
    bool crowded(double s, const std::vector<double>& before, double last, bool first) const noexcept {
        const std::size_t n = before.size();
        double apart = CrossingTuning::apart;
        if (!first) apart = n < 2 ? 0.0 : min(apart, 2 * (before[n - 1] - before[n - 2]));
        if (s - before[n - 1] >= apart && last - s >= CrossingTuning::apart) return false;
        for (std::size_t i = 0; i < task_.segment_count; ++i)
            if (task_.segments[i].end == s) return false;
        return true;
    }

    /// Whether phi is nearly straight from a knot (s, phi) over the next rows, from k to `to` at most.
    bool is_straight(std::size_t k, std::size_t to, double s, double phi) const noexcept {
        std::size_t end = k;
        while (end < to && rows_[end].s < s + CrossingTuning::apart) ++end;
        if (rows_[end].lead != 0) return false;
        const double all = lift(rows_[end].x, phi) - phi;
        for (std::size_t i = k; i < end; ++i) {
            if (rows_[i].lead != 0) return false;
            const double on = phi + all * (rows_[i].s - s) / (rows_[end].s - s);
            if (abs(lift(rows_[i].x, on) - on) > CrossingTuning::straight) return false;
        }
        return true;
    }

    /// Appends the stretches from row `from` to row `to`, all with the leading joint `lead`, to `out` as a
    /// spline; `few`: with fewer knots. Returns true.
    bool piece(std::size_t from, std::size_t to, int lead, bool few, std::vector<Stretch>& out) const {
        std::vector<double> s, x;
        Row led = rows_[from];
        set_lead(led, lead);
        for (std::size_t k = from; k <= to; ++k) {
            Row row = rows_[k];
            const bool spare = k != from && k != to && crowded(row.s, s, rows_[to].s, out.empty());
            if (spare && (lead != 0 || (few && is_straight(k, to, s.back(), x.back())))) continue;
            if (row.lead != lead) set_lead(row, lead);
            s.push_back(row.s);
            x.push_back(x.empty() || lead != 0 ? row.x : lift(row.x, x.back()));
        }
        const int gc = led.gc;
        Spline drawn = spline(s, s, x);
        std::vector<double>& control = drawn.control;
        if (!out.empty()) {
            const Curve so_far{task_.arm, task_.plane, gc, {task_.segments, task_.segment_count}, out};
            const Joint3 before = at_end(so_far, out.back(), lead, x.front());
            const double h = s[1] - s[0], both = (s.size() > 2 ? s[2] : s[1]) - s[0];
            control[0] = before.value;
            control[1] = before.value + before.slope * h / 3;
            control[2] = control[1] + both * (before.curvature * h / 6 + (control[1] - control[0]) / h);
        }
        for (Stretch& y : stretches_of(drawn, {})) {
            y.lead = lead;
            y.side = led.side;
            y.branch = gc;
            out.push_back(y);
        }
        return true;
    }

    const Task& task_;
    const CrossingTask& asked_;
    std::vector<Row> rows_;
    std::vector<double> wished_;                 // target phi of each section
    std::vector<double> costs_;                  // of the configurations of a section
    std::vector<std::unique_ptr<ArcSet>> left_;  // permitted arcs of each section and branch
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
