// The nearest posture of an arm with an offset wrist: of all branches, all values of the free joint and all
// windings the one nearest to given joints, globally.
//
// Branch and bound over the cells that feasible.hpp judges: a cell is dropped where no posture in it can be
// nearer than the best known, left with one end where the distance rises or falls all over it, and halved
// else. The best is finished by Newton's method on the slope. Among obstacles a cell that holds something
// nearer is asked how far it is clear of them: where it touches throughout it is dropped, and halved where
// that is open.
//
// Where two joints turn about one axis, at a fold, and at the stretched elbow the free joint has too few
// digits to tell postures apart: cells there stay open however narrow. What is nearest there is looked for in
// the joints themselves, from each such place (limits/settled.hpp).
#pragma once

#include <algorithm>
#include <optional>

#include "../limits/settled.hpp"
#include "feasible.hpp"
#include "straight_cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// On any status but OK the numbers are NaN and gc is -1.
struct OffsetNearest {
    double q[joint_slots];
    double free;
    int gc;
    Status status;
    double distance;  // root of sum w (q - near)^2, rad
    double margin;
};

namespace offset_rule {
inline constexpr int samples = 48;         // of each branch, for a first posture
inline constexpr double finest = 2e-7;     // rad: half width of a cell whose best is its middle's, finished
inline constexpr double left_open = 1e-8;  // rad: half width of a cell that is a place to start from
inline constexpr double tie = 1e-12;       // costs closer than this share of them are equal
inline constexpr int most_looks = 10000;   // of one pose in one branch
inline constexpr int newton = 8;
inline constexpr double beside = 1e-5;  // rad: off straight, where two joints may share a turn (of the reach)
inline constexpr double one_place = 1e-5;  // rad: open cells nearer than this are one place to start from
inline constexpr double widest_place = 0.02;
inline constexpr double difference = 1e-7;  // rad, of a slope
inline constexpr int places = 64;           // to start from
inline constexpr double narrowest = 1e-10;  // rad: half width of a cell that obstacles leave open
inline constexpr double seed = 0.3;         // a seed this near to the pose is one too (of the size; rad)
inline constexpr int settling = 1500;       // rounds of settled() for one pose
}  // namespace offset_rule

namespace detail {

/// The search of one pose over the free joint, in all branches.
class OffsetSearch {
public:
    OffsetSearch(const OffsetArm& arm, const Pose<double>& pose, const double* near, const double* weight,
                 const Scene* scene) noexcept
        : arm_(arm), pose_(pose), flange_(flange_pose(arm.own, pose)), seeded_(near != nullptr) {
        if (scene) {
            move_.emplace(arm, *scene);
            blocked_ = rest_contact(arm, *scene, pose) != 0;
        }
        for (int j = 0; j < joints; ++j) {
            const int k = robot_joint(arm, j);
            near_[j] = near ? near[k] : arm.rest.joint_middle[j];
            weight_[j] = weight ? weight[k] : 1.0;
            pull_.near[k] = near_[j];
            pull_.weight[k] = weight_[j];
        }
    }

    OffsetNearest run(unsigned branches) noexcept {
        branches_ = branches;
        OffsetNearest out;
        if (blocked_) return refused(Status::POSE_BLOCKED);
        if (keep_near(out)) return out;
        out = refused(Status::LIMITS);
        if (seeded_) look_beside_seed(out);
        if (out.status == Status::OK) cost_ = out.distance * out.distance;
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(branches >> gc & 1u)) continue;
            offer(OffsetCells(arm_, pose_, gc), gc, wrap(near_[6]), pi);
        }
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(branches >> gc & 1u)) continue;
            const OffsetCells cells(arm_, pose_, gc);
            for (int k = 0; k < offset_rule::samples; ++k) {
                const double free = -pi + two_pi * (k + 0.5) / offset_rule::samples;
                if (!too_far(free, 0.0)) offer(cells, gc, free, 0.0);
            }
        }
        const Status why = search_all();
        take(result(), out);
        look_beside(out);
        if (out.status != Status::OK)
            out.status = why == Status::OK ? refusal_among_obstacles() : why;
        else if (left_open_ < out.distance * out.distance * (1.0 - offset_rule::tie))
            out.status = Status::UNPROVEN;
        return out;
    }

private:
    /// Why there is nothing though the limits leave something.
    Status refusal_among_obstacles() const noexcept {
        if (left_open_ < infinity) return Status::NEAR_SINGULAR;
        return move_ ? Status::CLEARANCE : Status::LIMITS;
    }

    /// Whether the free joint alone is farther, over [free - half, free + half], than the best known.
    bool too_far(double free, double half) const noexcept {
        const double least = max(abs(wrap(free - near_[6])) - half, 0.0);
        return weight_[6] * least * least >= cost_ * (1.0 - offset_rule::tie) - 1e-24;
    }

    /// q of joint j on the turn within its limits that is nearest to what is wanted.
    double nearest_turn(int j, double theta) const noexcept {
        const Arm& rest = arm_.rest;
        return to_q(theta, rest.sign[j], rest.offset[j], rest.limits.lower[j], rest.limits.upper[j],
                    near_[j]);
    }

    /// Cost and slope of the posture at a value of the free joint, and whether it is within the limits.
    struct Value {
        bool feasible;
        double cost, slope, curvature;
    };
    Value value(const OffsetCells& cells, double free) const noexcept {
        using Curve = Jet<double, 2>;
        Value out{cells.inside(free) >= 0, infinity, 0.0, 0.0};
        if (!out.feasible) return out;
        Curve theta[joints];
        cells.at(free, theta);
        Curve sum(0.0);
        for (int j = 0; j < joints; ++j) {
            const double q = nearest_turn(j, theta[j].value());
            if (!(q >= arm_.rest.limits.lower[j] - tolerance::angle &&
                  q <= arm_.rest.limits.upper[j] + tolerance::angle))
                out.feasible = false;
            Curve off = Curve(arm_.rest.sign[j]) * theta[j];
            off.coefficient[0] = q - near_[j];
            sum = sum + Curve(weight_[j]) * (off * off);
        }
        out.cost = sum.coefficient[0];
        out.slope = sum.coefficient[1];
        out.curvature = 2.0 * sum.coefficient[2];
        return out;
    }

    /// Takes a posture that is nearer than the best; Newton's method moves it within `reach`.
    void offer(const OffsetCells& cells, int gc, double free, double reach) noexcept {
        Value now = value(cells, free);
        if (!now.feasible) return;
        const double from = free;
        for (int pass = 0; pass < offset_rule::newton && reach > 0 && now.curvature > 0; ++pass) {
            const double to = free - now.slope / now.curvature;
            if (!(abs(to - from) <= reach)) break;
            const Value next = value(cells, to);
            if (!next.feasible || !(next.cost <= now.cost)) break;
            const bool still = abs(to - free) < 1e-15;
            free = to;
            now = next;
            if (still) break;
        }
        if (!(now.cost < cost_) || !is_clear(cells, free)) return;
        cost_ = now.cost;
        free_ = wrap(free);
        gc_ = gc;
    }

    /// Whether the posture at a value of the free joint touches nothing.
    bool is_clear(const OffsetCells& cells, double free) noexcept {
        if (!move_) return true;
        double theta[joint_slots], q[joints];
        cells.at(free, theta);
        for (int j = 0; j < joints; ++j)
            q[robot_joint(arm_, j)] = to_q(theta[j], arm_.rest.sign[j], arm_.rest.offset[j]);
        return move_->is_clear_at(q);
    }

    /// What obstacles leave of a cell about its middle. `known`: clear or touching throughout, else open.
    struct Clear {
        Known known;
        double lower, upper;  // a part that is clear; of no width where none is known
    };
    Clear clear_of(const OffsetCells::Over& over, double middle, double half) noexcept {
        if (!move_) return {Known::inside, middle - half, middle + half};
        StraightCell cell;
        if (!straight_cell(arm_, over, half, cell)) return {Known::open, middle, middle};
        const Around at = move_->about(cell.q, cell.d, cell.off, &flange_);
        if (at.is_clear()) return {Known::inside, middle - half, middle + half};
        const bool touches = at.touching[0] >= 1.0 && at.touching[1] >= 1.0;
        return {touches ? Known::outside : Known::open, middle - at.clear[0] * half,
                middle + at.clear[1] * half};
    }

    /// The least cost of joint j over a cell, and d(cost)/d(free); false where no turn is within the limits.
    struct JointBound {
        double least;
        double middle;  // the cost at the middle of the cell, on the turn that `smooth` speaks of
        Interval slope;
        bool smooth;  // one turn is the nearest all over the cell
    };
    bool bound(int j, const JointOver& over, JointBound& out) const noexcept {
        const Arm& rest = arm_.rest;
        const double sign = rest.sign[j], lower = rest.limits.lower[j], upper = rest.limits.upper[j];
        out = {0.0, 0.0, Interval::whole(), false};
        if (!over.off.bounded()) return true;
        const Interval off = sign > 0 ? over.off : -over.off;
        const double at = to_q(over.middle, sign, rest.offset[j]);
        const double fewest = ceil((lower - at) / two_pi), most_turns = floor((upper - at) / two_pi);
        const double turn = min(max(round((near_[j] - at) / two_pi), fewest), max(fewest, most_turns));
        double least = infinity, most = infinity, second = infinity;
        double middle = at;
        for (const double k : {turn - 1.0, turn, turn + 1.0}) {
            const double here = at + two_pi * k;
            const double from = max(here + off.lo, lower - tolerance::angle),
                         to = min(here + off.hi, upper + tolerance::angle);
            if (!(from <= to)) continue;
            const double nearest = max(0.0, max(from - near_[j], near_[j] - to));
            if (nearest < least) {
                second = least;
                least = nearest;
                most = max(abs(from - near_[j]), abs(to - near_[j]));
                middle = here;
            } else {
                second = min(second, nearest);
            }
        }
        if (!(least < infinity)) return false;
        out.least = weight_[j] * least * least;
        // a turn of a joint that has several may end within the cell; other joints' pieces are cut there
        const bool whole = upper - lower < two_pi || (middle + off.lo >= lower && middle + off.hi <= upper);
        out.smooth = second > most && whole;
        out.middle = weight_[j] * (middle - near_[j]) * (middle - near_[j]);
        const Interval d{middle + off.lo - near_[j], middle + off.hi - near_[j]};
        out.slope = Interval(2.0 * weight_[j] * sign) * d * over.slope;
        return true;
    }

    /// Searches the branches asked; why none of them has a posture within the limits, or OK.
    Status search_all() noexcept {
        Status why = Status::UNREACHABLE;
        const auto rank = [](Status status) noexcept {
            if (status == Status::UNREACHABLE) return 0;
            return status == Status::NO_POSTURE ? 1 : 2;
        };
        for (int gc = 0; gc < configurations; ++gc) {
            if (!(branches_ >> gc & 1u)) continue;
            const Status refusal = search(gc);
            if (rank(refusal) > rank(why)) why = refusal;
        }
        return why;
    }

    /// Searches one branch; why it has no posture within the limits, or OK. Its looks are its own: branches
    /// that hold nothing, at the edge of reach, would take those of the others.
    Status search(int gc) noexcept {
        struct Cell {
            double lower, upper;
        };
        const ThetaRanges ranges(arm_.rest, arm_.rest.limits, 0.0, configuration(gc));
        OffsetJudge judge(arm_, pose_, gc, ranges);
        Cell stack[offset_rule::depth + 2];
        bool found = false;
        for (int k = 0; k < offset_rule::cells; ++k) {
            int top = 0;
            stack[top++] = {-pi + two_pi * k / offset_rule::cells,
                            -pi + two_pi * (k + 1) / offset_rule::cells};
            while (top > 0) {
                const Cell cell = stack[--top];
                if (too_far(0.5 * (cell.lower + cell.upper), 0.5 * (cell.upper - cell.lower))) continue;
                OffsetCells::Over over;
                Piece piece;
                const Known known = judge.look(cell.lower, cell.upper, over, piece);
                if (known == Known::outside) continue;
                if (known == Known::inside &&
                    !(piece.upper >= piece.lower && (piece.upper > piece.lower || piece.lower_tag != 0)))
                    continue;
                found = found || known == Known::inside;
                const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
                double least = 0, at_middle = 0;
                bool smooth = over.exists == Known::inside, possible = true;
                Interval slope(0.0);
                for (int j = 0; j < joints && possible; ++j) {
                    JointBound one;
                    possible = bound(j, over.joint[j], one);
                    least += one.least;
                    at_middle += one.middle;
                    smooth = smooth && one.smooth;
                    slope = slope + one.slope;
                }
                if (!possible) continue;
                smooth = smooth && slope.bounded();
                if (smooth) least = max(least, at_middle - half * max(abs(slope.lo), abs(slope.hi)));
                if (least >= cost_ * (1.0 - offset_rule::tie) - 1e-24) continue;
                const Clear clear = clear_of(over, middle, half);
                if (clear.known == Known::outside) continue;
                const double from = max(piece.lower, clear.lower), to = min(piece.upper, clear.upper);
                if (known == Known::inside && smooth && (slope.lo >= 0 || slope.hi <= 0)) {
                    const double best = slope.lo >= 0 ? piece.lower : piece.upper;
                    if (from <= best && best <= to) {
                        offer(judge.cells, gc, best, 0.0);
                        continue;
                    }
                }
                if (known == Known::inside) {
                    offer(judge.cells, gc, min(max(middle, from), to), half);
                    offer(judge.cells, gc, from, 0.0);
                    offer(judge.cells, gc, to, 0.0);
                } else {
                    offer(judge.cells, gc, middle, half);
                }
                const bool hidden = known == Known::inside && clear.known == Known::open,
                           told = known == Known::inside && !hidden && smooth;
                double end = told ? offset_rule::finest : offset_rule::left_open;
                if (hidden) end = offset_rule::narrowest;
                if (half < end || top > offset_rule::depth || judge.looks() >= offset_rule::most_looks) {
                    if (hidden) left_open_ = min(left_open_, least);
                    if (!told) remember(gc, cell.lower, cell.upper, least);
                    continue;
                }
                stack[top++] = {middle, cell.upper};
                stack[top++] = {cell.lower, middle};
            }
        }
        return found ? Status::OK : judge.refusal();
    }

    // -- results

    static OffsetNearest refused(Status why) noexcept {
        constexpr double no = not_a_number;
        return {{no, no, no, no, no, no, no, 0.0}, no, -1, why, no, no};
    }

    /// What is told of joints; refused where nobody asked for their branch.
    OffsetNearest told(const Joints& at) const noexcept {
        OffsetNearest out;
        const OffsetPosture here = forward(arm_, at.q);
        out.gc = asked_branch(here.gc, at);
        if (!(branches_ >> out.gc & 1u)) return refused(Status::NOT_ALLOWED);
        double cost = 0;
        for (int j = 0; j < joints; ++j) {
            const double off = at.q[j] - pull_.near[j];
            out.q[j] = at.q[j];
            cost += pull_.weight[j] * off * off;
        }
        out.q[joints] = 0.0;
        out.free = here.free;
        out.status = Status::OK;
        out.distance = sqrt(cost);
        out.margin = limit_margin(arm_.own.limits, out.q);
        return out;
    }

    /// The seed itself, where it is a posture of the pose: nothing is nearer.
    bool keep_near(OffsetNearest& out) noexcept {
        if (!seeded_ || !within_limits(arm_.own.limits, pull_.near, 0.0)) return false;
        const OffsetPosture here = forward(arm_, pull_.near);
        if (!(branches_ >> here.gc & 1u) || !same_pose(arm_.own.size, pose_, here.pose)) return false;
        if (move_ && !move_->is_clear_at(pull_.near)) return false;
        Joints near{};
        for (int j = 0; j < joints; ++j) near.q[j] = pull_.near[j];
        out = told(near);
        return true;
    }

    /// What the search of the cells has found; put on its pose and within its limits to the last bit.
    OffsetNearest result() const noexcept {
        if (gc_ < 0) return refused(Status::LIMITS);
        double theta[joint_slots];
        OffsetCells(arm_, pose_, gc_).at(free_, theta);
        Joints at{};
        for (int j = 0; j < joints; ++j) at.q[robot_joint(arm_, j)] = nearest_turn(j, theta[j]);
        Twist rest;
        const bool kept = within_limits(arm_.own.limits, at.q, 0.0);
        if (kept && distance(arm_, at.q, pose_, arm_.own.size, rest) <= near_pose()) return told(at);
        int rounds = settled_rule::rounds;
        const Relaxed on = settled(arm_, sides_of(gc_, at), at, pose_, {}, 0.0, rounds);
        return meets(arm_, on) ? told(on.at) : refused(Status::LIMITS);
    }

    /// A pose that is nearer than this is met (m).
    double near_pose() const noexcept { return 0.1 * settled_rule::meets * arm_.own.size; }

    // -- where the free joint has too few digits

    /// What is 0 where branches meet: theta_2, theta_4 - delta, and theta_5 + pi/2.
    struct Meeting {
        int joint;  // of the robot
        double zero;
        double untold;  // rad: nearer, a posture is of both branches; a bend is the root of a rounding
    };
    Meeting meeting(int bit) const noexcept {
        const double root = sqrt(2.0 * tolerance::stretched);
        static constexpr int joint[] = {1, 3, 4};
        const double zero[] = {0.0, arm_.rest.delta_angle, -half_pi};
        return {robot_joint(arm_, joint[bit]), zero[bit], bit == 0 ? tolerance::singular : root};
    }

    /// The branch `gc` of a posture if it is requested; otherwise a requested branch that the posture belongs
    /// to as well, because a sine that tells them apart is 0 up to rounding; `gc` if there is none.
    int asked_branch(int gc, const Joints& at) const noexcept {
        int both = 0;
        for (int bit = 0; bit < 3; ++bit) {
            const Meeting m = meeting(bit);
            const double sine = sin_cos(to_theta(arm_.own, m.joint, at.q[m.joint]) - m.zero).sin;
            if (abs(sine) <= m.untold) both |= 1 << bit;
        }
        for (int flip = 0; flip < configurations; ++flip)
            if ((flip & ~both) == 0 && (branches_ >> (gc ^ flip) & 1u)) return gc ^ flip;
        return gc;
    }

    /// The limits, with each sign of a branch kept where branches are chosen.
    Limits sides_of(int gc, const Joints& at) const noexcept {
        Limits out = arm_.own.limits;
        if (branches_ == (1u << configurations) - 1) return out;
        const OffsetBranch branch = configuration(gc);
        const double side[] = {branch.shoulder, branch.elbow, branch.wrist};
        for (int bit = 0; bit < 3; ++bit) {
            const Meeting m = meeting(bit);
            const double off = detail::off_angle(arm_.own, m.joint, m.zero, at.q[m.joint]);
            keep_beside(arm_.own, m.joint, at.q[m.joint] - arm_.own.sign[m.joint] * off, side[bit], 0.0, out);
        }
        return out;
    }

    /// A cell that stays open, or whose cost has no slope: a place to start from.
    void remember(int gc, double lower, double upper, double least) noexcept {
        if (places_ > 0) {
            Place& last = place_[places_ - 1];
            const bool beside = last.gc == gc && lower - last.upper <= offset_rule::one_place;
            if (beside && upper - last.lower <= offset_rule::widest_place) {
                last.upper = upper;
                last.least = min(last.least, least);
                return;
            }
        }
        if (places_ < offset_rule::places) {
            place_[places_++] = {gc, lower, upper, least};
            return;
        }
        Place& worst = *std::max_element(place_, place_ + places_,
                                         [](const Place& a, const Place& b) { return a.least < b.least; });
        if (least < worst.least) worst = {gc, lower, upper, least};
    }

    /// The places in the order of what they may cost.
    void look_beside(OffsetNearest& out) noexcept {
        while (places_ > 0) {
            int next = 0;
            for (int i = 1; i < places_; ++i)
                if (place_[i].least < place_[next].least) next = i;
            const Place place = place_[next];
            place_[next] = place_[--places_];
            if (out.status == Status::OK && !(place.least < out.distance * out.distance)) break;
            const double middle = 0.5 * (place.lower + place.upper), straight = straightest(place.gc, middle);
            try_start(start(place.gc, straight, offset_rule::beside), place.gc, out);
            for (const double free : {middle, place.lower, place.upper})
                try_start(start(place.gc, free, 0.0), place.gc, out);
        }
    }

    /// Where theta_2 is nearest to 0 or pi, beside a value of the free joint: sin(theta_2) (cos theta_1, sin
    /// theta_1) is smooth there. Gauss-Newton, of which what is nearest is kept.
    double straightest(int gc, double free) const noexcept {
        const OffsetMotion<> m = offset_motion(arm_, pose_, gc);
        const auto lean = [&](double at, double (&out)[2]) {
            const SinCos<double> theta_7 = sin_cos(to_theta(arm_.rest, 6, at));
            const OffsetWrist<double> wrist = offset_wrist(arm_, m, theta_7);
            const Directions<double> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, 0.0)));
            const double size = d.y[1] / hypot(d.y[0], d.x[0]);
            out[0] = size * d.x[0];
            out[1] = size * d.y[0];
            return abs(d.y[1]);
        };
        double now[2], then[2], best = free, least = infinity;
        for (int pass = 0; pass < offset_rule::newton; ++pass) {
            const double size = lean(free, now);
            if (!(size < least)) break;
            least = size;
            best = free;
            lean(free + offset_rule::difference, then);
            const double x = then[0] - now[0], y = then[1] - now[1];
            const double move = (now[0] * x + now[1] * y) / (x * x + y * y) * offset_rule::difference;
            if (!(abs(move) < offset_rule::widest_place)) break;
            free -= move;
        }
        return best;
    }

    /// The seed as a start, where it is not far from the pose.
    void look_beside_seed(OffsetNearest& out) noexcept {
        Joints near{};
        for (int j = 0; j < joints; ++j) near.q[j] = pull_.near[j];
        Twist rest;
        if (distance(arm_, near.q, pose_, arm_.own.size, rest) <= offset_rule::seed * arm_.own.size)
            try_start(near, forward(arm_, near.q).gc, out);
    }

    /// The posture at a value of the free joint, joints that nearly turn about one axis, up to `beside`, as
    /// wanted.
    Joints start(int gc, double free, double beside) const noexcept {
        const OffsetMotion<> m = offset_motion(arm_, pose_, gc);
        const SinCos<double> theta_7 = sin_cos(to_theta(arm_.rest, 6, free));
        const OffsetWrist<double> wrist = offset_wrist(arm_, m, theta_7);
        Directions<double> d;
        if (abs(wrist.g) > beside * arm_.rest.reach)
            d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, 0.0)));
        else
            d = directions(m, wrist, theta_7, free_theta_5(arm_, m, pull_.near), 0.0);
        share_turn(arm_, pull_.near, beside, d);
        return joints_within_limits(arm_.own, in_robot_order(arm_, d), pull_.near);
    }

    /// Settles a start, and takes it if it is nearer.
    void try_start(const Joints& start, int gc, OffsetNearest& out) noexcept {
        if (!is_finite(start.q)) return;
        const Relaxed at = settled_beside(arm_, sides_of(gc, start), start, pose_, pull_, rounds_);
        if (meets(arm_, at)) take(told(at.at), out);
    }

    void take(const OffsetNearest& found, OffsetNearest& out) noexcept {
        if (found.status != Status::OK || (out.status == Status::OK && out.distance <= found.distance))
            return;
        if (!move_ || move_->is_clear_at(found.q)) out = found;
    }

    struct Place {
        int gc;
        double lower, upper, least;  // of the free joint, rad; of the cost
    };

    const OffsetArm& arm_;
    const Pose<double>& pose_;
    const Pose<double> flange_;                    // in the DH base
    std::optional<StraightMove<OffsetArm>> move_;  // where there are obstacles
    bool blocked_ = false, seeded_;
    unsigned branches_ = 0;
    double near_[joints], weight_[joints];  // in the order of the formulas
    Drawing pull_;                          // in the robot's
    double cost_ = infinity, free_ = 0;
    double left_open_ = infinity;  // the least cost of cells that obstacles leave open
    int gc_ = -1;
    Place place_[offset_rule::places];
    int places_ = 0, rounds_ = offset_rule::settling;
};

}  // namespace detail

/// The posture nearest to `near` (7 joint values; null: the middles of the ranges) in the branches of the
/// bits, in the root of sum w d^2 (null: all weights 1), clear of a scene (null: none). UNPROVEN: a posture,
/// but obstacles may leave one that is nearer.
inline OffsetNearest nearest(const OffsetArm& arm, const Pose<double>& pose, const double* near,
                             const double* weight = nullptr, unsigned branches = 255u,
                             const Scene* scene = nullptr) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    return detail::OffsetSearch(arm, exact, near, weight, scene).run(branches);
}

}  // namespace armangle

#include "../names/end.hpp"
