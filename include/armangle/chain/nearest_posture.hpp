// The nearest posture of a pose of a nearly S-R-S arm: of all branches, all proven psi and all windings the
// one that costs least, globally.
//
// Branch and bound over pieces of the arcs. What joints do over a piece is known from the corrected motion
// (a bound of first order), and in a narrow piece from its hull, whose slopes tell where the cost only falls:
// there an end is left. The rest is halved, and what is left at last is polished. Branches come in the order
// of a first bound, and the arcs of one are asked for only where it may hold something nearer.
//
// Stretches that are proven neither way hold postures too, and there psi is no good guide: joints about one
// axis turn half round while it hardly changes. Where the first bound of one does not say that nothing in it
// is nearer, the joints themselves are settled on the pose, from the seed, from the best posture and from the
// middle of the stretch, and the answer is Status::UNPROVEN.
#pragma once

#include "../limits/nearest_search.hpp"
#include "../limits/solve_locally.hpp"
#include "hull_cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the search of the nearest posture of a chain.
struct ChainNearestTuning {
    static constexpr int first_pieces = 16;  // of the whole circle
    static constexpr double widest_piece =
        0.4;                                  // rad: half width of a piece that is looked at about its middle
    static constexpr double polished = 1e-4;  // rad: half width of a piece that is polished
    static constexpr double doubtful = 0.1;   // rad: width of a part of a stretch that is not proven
    static constexpr int unproven_parts = 24;  // such parts that joints are settled from
    static constexpr int local_rounds =
        600;  // rounds of solve_locally() for one pose, of some microseconds each
    static constexpr double shared = 0.3;  // sine of a hinge beside which two joints share a turn
    static constexpr int polishes = 60;    // halvings, or golden sections, of a piece
    static constexpr int hard = 600;       // postures of a pose that Newton's method finds only from afar
    static constexpr double golden = 0.6180339887498949;
    static constexpr double elbow_tie = 1e-12;  // rad, of joint 4 where it alone decides
    static constexpr double straight = 0.2;     // rad off straight: an elbow that may
};

namespace detail {

/// The search for the nearest posture of a pose: branch and bound on the proven arcs of psi, and a local
/// search where nothing is proven.
class ProvenSearch : PostureCosts {
public:
    /// Computes the status of every permitted branch for a pose and first bounds of its costs; `margin` (rad)
    /// is the singularity margin, `scene` may be null.
    ProvenSearch(const ChainArm& arm, double margin, const Pose<double>& pose, const NearestOptions& options,
                 const Scene* scene) noexcept
        : PostureCosts(arm.nominal, options),
          near_(arm),
          scene_(scene),
          margin_(margin),
          pose_{orthonormal(pose.rotation), pose.position},
          on_(triad(arm.nominal, flange_pose(arm.nominal, pose_))) {
        const Status reached = reach_status(arm, on_);
        for (int gc = 0; gc < configurations; ++gc) {
            make_empty(doubt_[gc]);
            const bool may = options.branches >> gc & 1;
            status_[gc] = may ? reached : Status::NOT_ALLOWED;
            if (may && reached == Status::OK) survey(gc);
        }
    }

    /// The nearest posture over all permitted branches.
    Nearest best() noexcept {
        Nearest out;
        if (keep_near(out)) return out;
        begin_at_seed();
        search();
        // where costs are a maximum and joint 4 decides, the other joints choose among what it leaves
        if (best_.gc >= 0 && !squares()) {
            const PointSolution at = solution_at(best_.gc, best_.psi);
            const double of_elbow = elbow_cost(at.q);
            if (of_elbow >= best_.cost - ChainNearestTuning::elbow_tie) {
                elbow_most_ = of_elbow + ChainNearestTuning::elbow_tie;
                best_.cost = cost(at.q);
                for (int gc = 0; gc < configurations; ++gc)
                    if (status_[gc] == Status::OK) survey(gc);
                search();
            }
        }
        if (best_.gc >= 0) {
            out = result();
        } else {
            for (int gc = 0; gc < configurations; ++gc) ask(gc);
            out = nothing(status_);
            if (out.status == Status::OK) out = refused(Status::LIMITS);
        }
        search_by_joints(out);
        return out;
    }

    /// Writes the nearest posture of each permitted branch and proven arc to `out`.
    void all(Nearests& out) noexcept {
        out.count = 0;
        for (int gc = 0; gc < configurations; ++gc) {
            if (!ask(gc)) continue;
            for (int arc = 0; arc < arcs_.arcs.count; ++arc) {
                best_ = {};
                search_arc(arcs_.arcs.arc[arc], gc);
                if (best_.gc >= 0) insert(out, result());
            }
        }
        out.status = out.count > 0 ? Status::OK : nothing(status_).status;
    }

private:
    // some eight more for each halving down to the narrowest, far below the capacity
    static constexpr int several = register_width, capacity = 512;
    using Several = Lane<several>;

    struct Best {
        double cost = infinity, psi = 0;
        int gc = -1;
    };
    /// A posture: whether one was found, and whether it is within the limits.
    struct PointSolution {
        SinCos<double> angle[joints];
        double q[joint_slots];
        bool found = false, kept = false;
    };

    // -- postures

    /// The posture of a branch and psi, as inverse() gives it.
    PointSolution solution_at(int gc, double psi) const noexcept {
        PointSolution out;
        const PsiPlane<double> plane(on_, sin_cos(psi));
        out.found = solve_angles(near_, pose_, plane, configuration(gc), out.angle) == Status::OK;
        finish(out);
        return out;
    }

    /// Computes the joint values of a posture from its angles, and whether they are within the limits.
    void finish(PointSolution& out) const noexcept {
        if (!out.found) return;
        double near[joint_slots] = {};
        for (int j = 0; j < joints; ++j) near[j] = joint_[j].near;
        const Limits& limits = arm_.limits;
        to_q(theta_of(out.angle), JointLanes::load(arm_.sign), JointLanes::load(arm_.offset),
             JointLanes::load(limits.lower), JointLanes::load(limits.upper), JointLanes::load(near))
            .store(out.q);
        out.kept = within_limits(limits, out.q, tolerance::angle);
    }

    /// The cost of joint 4 alone.
    double elbow_cost(const double* q) const noexcept { return cost_of(joint_[3], q[3] - joint_[3].near); }

    /// The cost of joint values. For the metric of the largest difference it includes joint 4; once that cost
    /// is fixed as a bound, it is infinite beyond it.
    double cost(const double* q) const noexcept {
        if (squares()) return cost_of(q);
        const double of_elbow = elbow_cost(q);
        if (elbow_most_ == infinity) return max(cost_of(q), of_elbow);
        return of_elbow <= elbow_most_ ? cost_of(q) : infinity;
    }

    /// Keeps the posture at a psi if it is within the limits and the best so far, and returns its cost;
    /// infinite without one.
    double offer(int gc, double psi) noexcept {
        const PointSolution at = solution_at(gc, psi);
        return offer(gc, psi, at);
    }
    /// Tries a given posture at a psi: keeps it if it is the best so far, and returns its cost. What is kept
    /// is the posture that inverse() gives there, as a psi may have two near singularities.
    double offer(int gc, double psi, const PointSolution& at) noexcept {
        double here = at.kept ? cost(at.q) : infinity;
        if (!(here < best_.cost)) return here;
        const PointSolution exact = solution_at(gc, wrap(psi));
        here = exact.found && within_limits(arm_.limits, exact.q, tolerance::isolated) ? cost(exact.q)
                                                                                       : infinity;
        if (here < best_.cost) best_ = {here, psi, gc};
        return here;
    }

    // -- bounds

    /// The least |q - near| (rad) of a joint whose angle is within `reach` of theta, over the multiples of 2
    /// pi within its limits; infinite if there are none.
    static double least_off(const JointCost& c, double theta, double reach) noexcept {
        const double lower = c.lower - tolerance::angle, upper = c.upper + tolerance::angle;
        if (!(reach < pi)) return abs(c.centre() - c.near);
        const double first = lift(to_q(theta, c.sign, c.offset), c.centre());
        double out = infinity;
        for (const double turn : {-two_pi, 0.0, two_pi}) {
            const double from = max(first + turn - reach, lower), to = min(first + turn + reach, upper);
            if (from <= to) out = min(out, max(max(from - c.near, c.near - to), 0.0));
        }
        return out;
    }

    /// A lower bound of the cost of postures whose joints are each within `reach` (rad) of theta; infinite if
    /// a limit is violated by all, or joint 4 costs more than it may.
    double bound(const double* theta, const double* reach) const noexcept {
        double sum = squares() ? 0.0 : -infinity;
        for (int j = 0; j < joints; ++j) {
            const double off = least_off(joint_[j], theta[j], reach[j]);
            if (!(off < infinity)) return infinity;  // a limit is broken
            const double one = cost_of(joint_[j], off);
            if (j == 3 && elbow_most_ < infinity) {
                if (one > elbow_most_) return infinity;
                continue;
            }
            sum = both(sum, one);
        }
        return sum;
    }

    /// Whether a lower bound is not below the best cost so far.
    bool dropped(double least) const noexcept {
        return !(least < (best_.cost < infinity ? best_.cost - tie(best_.cost) : infinity));
    }

    /// The motion of the nominal arm, widened to contain all postures of the true chain in a branch.
    CorrectedMotion<double> motion_of_all(int gc) const noexcept {
        Triad<double> on = on_;
        const double shy = tolerance::reach * arm_.reach;  // of a stretched elbow, whose rates are infinite
        on.distance = min(max(on.distance, arm_.inner_reach + shy), arm_.reach - shy);
        CorrectedMotion<double> out(arm_, flange_pose(arm_, pose_), on, configuration(gc));
        out.widen_within_reach({near_.wrist_shift + abs(on.distance - on_.distance), near_.turn}, 0.0);
        return out;
    }

    /// Computes first lower bounds of the cost in each piece of the circle of a branch.
    void survey(int gc) noexcept {
        const CorrectedMotion<double> coarse = motion_of_all(gc);
        const double half = pi / ChainNearestTuning::first_pieces;
        least_[gc] = infinity;
        for (int i = 0; i < ChainNearestTuning::first_pieces; ++i) {
            const Coarse<double> c = coarse.over(-pi + half * (2 * i + 1), half);
            piece_least_[gc][i] = bound(c.theta, c.reach);
            least_[gc] = min(least_[gc], piece_least_[gc][i]);
        }
    }

    // -- branch and bound

    /// Computes the proven arcs of a branch, restricted to those that the caller allows and that are free of
    /// collisions; whether any are left.
    bool ask(int gc) noexcept {
        if (asked_ == gc) return true;
        if (status_[gc] != Status::OK) return false;
        asked_ = gc;
        feasible(near_, pose_, gc, arm_.limits, margin_, arcs_);
        if (options_.allowed) {
            const ProvenArcs before = arcs_;
            intersect(before.arcs, *options_.allowed, arcs_.arcs);
            intersect(before.open, *options_.allowed, arcs_.open);
            if (arcs_.arcs.empty() && !before.arcs.empty()) arcs_.status = Status::NOT_ALLOWED;
        }
        doubt_[gc] = arcs_.open;
        Tag blocking = 0;
        if (scene_) {
            const double by_limits = arcs_.unproven;
            keep_clear(near_, *scene_, pose_, gc, arcs_, blocking);
            if (arcs_.status == Status::POSE_BLOCKED)
                make_empty(doubt_[gc]);
            else if (arcs_.unproven > by_limits)
                make_full(doubt_[gc]);
        }
        status_[gc] = arcs_.status;
        if (!arcs_.arcs.empty()) return true;
        asked_ = -1;
        return false;
    }

    /// Searches all branches, those with the least lower bound first.
    void search() noexcept {
        bool done[configurations] = {};
        for (;;) {
            int gc = -1;
            for (int k = 0; k < configurations; ++k)
                if (!done[k] && status_[k] == Status::OK && (gc < 0 || least_[k] < least_[gc])) gc = k;
            if (gc < 0 || dropped(least_[gc])) return;
            done[gc] = true;
            if (!ask(gc)) continue;
            for (int i = 0; i < arcs_.arcs.count; ++i) search_arc(arcs_.arcs.arc[i], gc);
        }
    }

    /// A piece of an arc, and a lower bound of the cost in it.
    struct Piece {
        double lower, upper, least;

        double middle() const noexcept { return 0.5 * (lower + upper); }
        double half() const noexcept { return 0.5 * (upper - lower); }
    };

    /// Searches an arc of a branch for a cheaper posture than the best, divided into pieces.
    void search_arc(const Arc& arc, int gc) noexcept {
        constexpr int n = ChainNearestTuning::first_pieces;
        constexpr double width = two_pi / n;
        waiting_ = 0;
        const int first = static_cast<int>(std::floor((arc.lower + pi) / width));
        for (int k = first; waiting_ < 2 * n + 2; ++k) {
            const double from = max(arc.lower, -pi + width * k), to = min(arc.upper, -pi + width * (k + 1));
            if (from > arc.upper || (from == arc.upper && waiting_ > 0)) break;
            if (to >= from) wait({from, to, piece_least_[gc][(k % n + n) % n]}, 0);
        }
        PostureTrail<several> trail(near_, pose_, on_, configuration(gc));
        while (waiting_ > 0) look(gc, trail);
    }

    /// Puts a piece on the stack, sorted by bound above index `base`: the least is on top.
    void wait(const Piece& piece, int base) noexcept {
        int k = waiting_++;
        for (; k > base && piece_[k - 1].least < piece.least; --k) piece_[k] = piece_[k - 1];
        piece_[k] = piece;
    }

    /// Examines several pieces from the top of the stack at once: each is dismissed, polished or divided.
    /// `trail` finds their postures.
    void look(int gc, PostureTrail<several>& trail) noexcept {
        Piece now[several];
        int count = 0;
        while (waiting_ > 0 && count < several) {
            const Piece one = piece_[--waiting_];
            if (!dropped(one.least)) now[count++] = one;
        }
        if (count == 0) return;
        double middle[several], half[several];
        for (int k = 0; k < several; ++k) {
            middle[k] = now[k < count ? k : count - 1].middle();
            half[k] = now[k < count ? k : count - 1].half();
        }
        const Several psi = Several::load(middle);
        const PsiPlane<Several> plane(spread<Several>(on_), sin_cos(psi));
        bool is_found[several], narrow[several], some_narrow = false;
        Found<Several> found = trail.find(middle, count, plane, is_found);
        PointSolution at[several];
        for (int k = 0; k < count; ++k) {
            for (int j = 0; j < joints; ++j) at[k].angle[j] = {found.angle[j].sin[k], found.angle[j].cos[k]};
            at[k].found = is_found[k];
            if (!is_found[k]) {  // a proven stretch has one
                --hard_;
                at[k].found = solve_angles(near_, pose_, {on_, sin_cos(middle[k])}, configuration(gc),
                                           at[k].angle) == Status::OK;
                for (int j = 0; j < joints; ++j) {
                    found.angle[j].sin.set(k, at[k].angle[j].sin);
                    found.angle[j].cos.set(k, at[k].angle[j].cos);
                }
            }
            finish(at[k]);
            offer(gc, middle[k], at[k]);
            narrow[k] = at[k].found && half[k] <= ChainArcsTuning::widest_hull;
            some_narrow |= narrow[k];
        }
        Hull<Several> hulls;
        if (some_narrow) {
            const auto proven = prove_hull(near_, spread<Several>(pose_), plane, found.angle, psi,
                                           Several::load(half), hulls);
            for (int k = 0; k < count; ++k) narrow[k] = narrow[k] && proven[k];
        }
        bool coarse[several], some_coarse = false;
        for (int k = 0; k < count; ++k) {
            coarse[k] = !narrow[k] && at[k].found && half[k] <= ChainNearestTuning::widest_piece;
            some_coarse |= coarse[k];
        }
        Coarse<Several> over;
        if (some_coarse)
            over = coarse_about(near_, spread<Several>(on_), plane, found.angle,
                                spread<Several>(configuration(gc)), Several::load(half));
        const int parts = count + waiting_ < several / 2 ? several : 2, base = waiting_;
        for (int k = 0; k < count; ++k) {
            double least = now[k].least;
            if (narrow[k]) {
                const Hull<double> hull = lane(hulls, k);
                double reach[joints];
                for (int j = 0; j < joints; ++j) reach[j] = hull.reach(j);
                least = max(least, bound(hull.theta, reach));
                if (dropped(least)) continue;
                if (const double way = falling(hull, at[k], reach); way != 0) {
                    offer(gc, middle[k] + way * half[k]);
                    continue;
                }
            } else if (coarse[k]) {
                double theta[joints], reach[joints];
                for (int j = 0; j < joints; ++j) {
                    theta[j] = over.theta[j][k];
                    reach[j] = over.reach[j][k];
                }
                least = max(least, bound(theta, reach));
                if (dropped(least)) continue;
            }
            if (hard_ <= 0) {
                lost_ = min(lost_, least);
                continue;
            }
            if (half[k] <= ChainNearestTuning::polished || waiting_ + parts > capacity) {
                if (half[k] > ChainNearestTuning::polished || !at[k].found) lost_ = min(lost_, least);
                polish(gc, now[k].lower, now[k].upper);
                if (!is_found[k]) hard_ -= ChainNearestTuning::polishes;
                continue;
            }
            const double step = 2.0 * half[k] / parts;
            for (int i = 0; i < parts; ++i) {
                const bool last = i + 1 == parts;
                const double from = now[k].lower + i * step;
                wait({from, last ? now[k].upper : from + step, least}, base);
            }
        }
    }

    /// The end of a hull (-1 or 1) at which the cost is least because it is monotonic over the hull; 0 if
    /// that is not proven.
    double falling(const Hull<double>& hull, const PointSolution& at,
                   const double (&reach)[joints]) const noexcept {
        if (!squares() || !at.kept) return 0.0;
        double slope = 0, radius = 0;
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            const double off = at.q[j] - c.near;
            const double room = min(at.q[j] - c.lower, c.upper - at.q[j]);
            const bool goes_round =
                c.upper - c.lower + 2.0 * reach[j] >= two_pi;  // past a limit to the other
            if (goes_round && !(abs(off) + reach[j] < pi && reach[j] <= room)) return 0.0;
            const double most = abs(hull.slope[j]) + hull.slope_radius[j];
            slope += c.weight * c.sign * off * hull.slope[j];
            radius += c.weight * (reach[j] * most + abs(off) * hull.slope_radius[j]);
        }
        if (!(abs(slope) > radius)) return 0.0;
        return slope > 0 ? -1.0 : 1.0;
    }

    /// Keeps the posture at a psi if it is the best so far, and returns half of dcost/dpsi there, for costs
    /// that are sums of squares; NaN if there is no posture within the limits, or a singular one.
    double offer_and_slope(int gc, double psi) noexcept {
        return offer_and_slope(gc, psi, solution_at(gc, psi));
    }
    /// Keeps a given posture at a psi if it is the best so far, and returns half of dcost/dpsi there; NaN if
    /// it is beyond the limits, and is not kept, or singular.
    double offer_and_slope(int gc, double psi, const PointSolution& at) noexcept {
        offer(gc, psi, at);
        if (!at.kept) return not_a_number;
        const PsiPlane<double> plane(on_, sin_cos(psi));
        const SevenEquations<double> f = seven_equations(near_, pose_, plane, at.angle);
        const Reduced<double> to(f);
        if (!to.is_regular()) return not_a_number;
        double rate[joints], out = 0;
        to.solve({{0, 0, 0}, {0, 0, 0}, dot(plane.along, elbow_axis(at.angle))}, rate);
        for (int j = 0; j < joints; ++j)
            out += joint_[j].weight * joint_[j].sign * (at.q[j] - joint_[j].near) * rate[j];
        return out;
    }

    /// Offers the least cost in a narrow piece, found to rounding, as the best.
    void polish(int gc, double from, double to) noexcept {
        const PointSolution first = solution_at(gc, from), last = solution_at(gc, to);
        for (int j = 0; first.found && last.found && j < joints; ++j) {
            if (!(abs(first.q[j] - last.q[j]) > pi)) continue;
            polish(gc, from, winding_end(gc, from, to, j));
            return polish(gc, winding_end(gc, to, from, j), to);
        }
        if (!squares()) return by_sections(gc, from, to);
        double a = from, b = to, at_a = offer_and_slope(gc, a, first), at_b = offer_and_slope(gc, b, last);
        if (is_nan(at_a) || is_nan(at_b)) return by_sections(gc, from, to);
        if (!(at_a < 0 && at_b > 0)) return;  // an end costs least
        for (int pass = 0; pass < ChainNearestTuning::polishes && b - a > ChainInverseTuning::residual;
             ++pass) {
            const double secant = a - at_a * (b - a) / (at_b - at_a);
            const bool even = pass % 3 == 2 || !(secant > a && secant < b);
            const double psi = even ? 0.5 * (a + b) : secant, slope = offer_and_slope(gc, psi);
            if (is_nan(slope)) return by_sections(gc, from, to);
            if (slope == 0 || psi == a || psi == b) break;
            (slope < 0 ? a : b) = psi;
            (slope < 0 ? at_a : at_b) = slope;
        }
        solve_at(gc, 0.5 * (a + b));
    }

    /// The psi between `inside` and `outside` up to which joint j (0..6) keeps its multiple of 2 pi; beyond
    /// it, the joint jumps from one limit to the other.
    double winding_end(int gc, double inside, double outside, int j) const noexcept {
        const double begun = solution_at(gc, inside).q[j];
        for (int pass = 0;
             pass < ChainNearestTuning::polishes && abs(outside - inside) > ChainInverseTuning::residual;
             ++pass) {
            const double middle = 0.5 * (inside + outside);
            const PointSolution at = solution_at(gc, middle);
            const bool stays = at.found && abs(at.q[j] - begun) < pi && at.q[j] >= joint_[j].lower &&
                               at.q[j] <= joint_[j].upper;
            (stays ? inside : outside) = middle;
        }
        return inside;
    }

    /// Replaces the best psi by `psi`, a stationary one, if it is near and costs the same up to rounding: it
    /// is more accurate.
    void solve_at(int gc, double psi) noexcept {
        const PointSolution at = solution_at(gc, psi);
        if (gc != best_.gc || !at.kept || !(abs(psi - best_.psi) <= ChainNearestTuning::polished)) return;
        const double here = cost(at.q);
        if (here <= best_.cost + tie(best_.cost)) best_ = {here, psi, gc};
    }

    /// Offers the least cost between two psi of branch gc, found by golden sections, as the best.
    void by_sections(int gc, double from, double to) noexcept {
        offer(gc, from);
        offer(gc, to);
        double a = from, b = to;
        double left = b - ChainNearestTuning::golden * (b - a),
               right = a + ChainNearestTuning::golden * (b - a);
        double at_left = offer(gc, left), at_right = offer(gc, right);
        for (int pass = 0; pass < ChainNearestTuning::polishes && b - a > tolerance::angle; ++pass) {
            if (at_left < at_right) {
                b = right;
                right = left;
                at_right = at_left;
                left = b - ChainNearestTuning::golden * (b - a);
                at_left = offer(gc, left);
            } else {
                a = left;
                left = right;
                at_left = at_right;
                right = a + ChainNearestTuning::golden * (b - a);
                at_right = offer(gc, right);
            }
        }
    }

    // -- what arcs do not tell of

    /// A part of psi that is not proven: its middle and a lower bound of the cost in it.
    struct UnprovenPart {
        double psi, least;
        int gc;
    };
    /// The unproven parts with the least bounds, in order, and the least bound of all.
    struct UnprovenParts {
        int count = 0;
        double least = infinity;
        UnprovenPart part[ChainNearestTuning::unproven_parts];

        /// Adds a part if its bound is among the least.
        void add(const UnprovenPart& one) noexcept {
            least = min(least, one.least);
            if (count == ChainNearestTuning::unproven_parts && !(one.least < part[count - 1].least)) return;
            int k = count < ChainNearestTuning::unproven_parts ? count++ : count - 1;
            for (; k > 0 && one.least < part[k - 1].least; --k) part[k] = part[k - 1];
            part[k] = one;
        }
    };
    /// Collects the unproven parts that may hold a lower cost than the best.
    UnprovenParts unproven_parts() const noexcept {
        UnprovenParts out;
        out.least = lost_;
        for (int gc = 0; gc < configurations; ++gc) {
            if (doubt_[gc].empty() || dropped(least_[gc])) continue;
            const CorrectedMotion<double> coarse = motion_of_all(gc);
            for (int i = 0; i < doubt_[gc].count; ++i) {
                const Arc& arc = doubt_[gc].arc[i];
                const int parts =
                    1 + static_cast<int>((arc.upper - arc.lower) / ChainNearestTuning::doubtful);
                const double half = 0.5 * (arc.upper - arc.lower) / parts;
                for (int k = 0; k < parts; ++k) {
                    const double psi = arc.lower + half * (2 * k + 1);
                    const Coarse<double> c = coarse.over(psi, half);
                    const double least = bound(c.theta, c.reach);
                    if (!dropped(least)) out.add({psi, least, gc});
                }
            }
        }
        return out;
    }

    /// Replaces the solution by a better one found in unproven parts; its status is UNPROVEN if there may be
    /// an even better one.
    void search_by_joints(Nearest& out) noexcept {
        const UnprovenParts all = unproven_parts();
        if (dropped(all.least)) return;
        if (!(margin_ > 0)) {
            if (options_.near) {
                Joints seed{};
                for (int j = 0; j < joints; ++j) seed.q[j] = options_.near[j];
                with_either_bend(arm_, seed, ChainNearestTuning::straight, [&](const Joints& from) {
                    try_locally(from.q, out);
                    return false;
                });
            }
            if (is_solved(out.status)) try_locally(out.q, out);
            for (int i = 0; i < all.count && (rounds_ > 0 || !is_solved(out.status)); ++i)
                if (!dropped(all.part[i].least)) try_unproven(all.part[i], out);
            if (!is_solved(out.status) && !scene_ && offer_all_over()) {
                out = result();
                try_locally(out.q, out);
            }
        }
        if (dropped(all.least)) return;
        if (is_solved(out.status)) out.status = Status::UNPROVEN;
        if (out.status == Status::LIMITS) out.status = Status::NEAR_SINGULAR;  // not proven either
    }

    /// Keeps the best of the postures in the middles of all unproven parts; false if none is within the
    /// limits.
    bool offer_all_over() noexcept {
        for (int gc = 0; gc < configurations; ++gc) {
            PostureTrail<several> trail(near_, pose_, on_, configuration(gc));
            for (int i = 0; i < doubt_[gc].count; ++i) {
                const Arc& arc = doubt_[gc].arc[i];
                const int parts =
                    1 + static_cast<int>((arc.upper - arc.lower) / ChainNearestTuning::doubtful);
                for (int part = 0; part < parts; part += several) {
                    const int count = parts - part < several ? parts - part : several;
                    double psi[several];
                    for (int k = 0; k < several; ++k) {
                        const int at = k < count ? part + k : parts - 1;
                        psi[k] = arc.lower + (arc.upper - arc.lower) * (at + 0.5) / parts;
                    }
                    const PsiPlane<Several> plane(spread<Several>(on_), sin_cos(Several::load(psi)));
                    bool is_found[several];
                    const Found<Several> found = trail.find(psi, count, plane, is_found);
                    for (int k = 0; k < count; ++k) {
                        if (!is_found[k]) continue;
                        PointSolution at;
                        for (int j = 0; j < joints; ++j)
                            at.angle[j] = {found.angle[j].sin[k], found.angle[j].cos[k]};
                        at.found = true;
                        finish(at);
                        offer(gc, psi[k], at);
                    }
                }
            }
        }
        return best_.gc >= 0;
    }

    /// Searches from the middle of an unproven part: from the nominal posture there, and from one in which
    /// joints that rotate about one axis are near the seed.
    void try_unproven(const UnprovenPart& unproven, Nearest& out) noexcept {
        if (!is_solved(out.status) && !scene_) {  // settling gives up where it goes slowly
            offer(unproven.gc, unproven.psi);
            if (best_.gc >= 0) out = result();
        }
        const Found<double> found = correct(near_, pose_, PsiPlane<double>(on_, sin_cos(unproven.psi)),
                                            configuration(unproven.gc), ChainInverseTuning::corrections);
        PointSolution at;
        for (int j = 0; j < joints; ++j) at.angle[j] = found.angle[j];
        at.found = true;
        finish(at);
        try_locally(at.q, out);
        const SinCos<double>(&angle)[joints] = at.angle;
        const double bend = angle[3].sin * arm_.delta.cos - angle[3].cos * arm_.delta.sin;
        bool shared = share(0, angle[1].sin, angle[1].cos, at.q);
        shared |= share(2, bend, angle[3].cos, at.q);
        shared |= share(4, angle[5].sin, angle[5].cos, at.q);
        if (shared) try_locally(at.q, out);
    }

    /// Distributes in q the rotation of joints j and j + 2 (j: 0, 2 or 4) between them at least cost, without
    /// regard to limits, if the joint between them (`sine`, `cosine` of its angle) is near 0 or pi, where
    /// only their sum matters; false, without a change, if it is not.
    bool share(int j, double sine, double cosine, double* q) const noexcept {
        const JointCost &a = joint_[j], &b = joint_[j + 2];
        const double weight = a.weight + b.weight;
        if (abs(sine) > ChainNearestTuning::shared || !(weight > 0)) return false;
        const double to_b = (cosine > 0 ? -1.0 : 1.0) * a.sign * b.sign;
        const double turn = (a.weight * (a.near - q[j]) + b.weight * to_b * (b.near - q[j + 2])) / weight;
        q[j] += turn;
        q[j + 2] += to_b * turn;
        return true;
    }

    /// Searches from joints `start` (rad) for a posture of the pose within the limits, then for one of lower
    /// cost, and keeps it if it is permitted, clear and better than `out`.
    void try_locally(const double* start, Nearest& out) noexcept {
        Joints from{};
        for (int j = 0; j < joints; ++j) from.q[j] = start[j];
        Attraction pull;
        for (int j = 0; options_.metric != Metric::margin && j < joints; ++j) {
            pull.weight[j] = options_.weight[j];
            pull.near[j] = joint_[j].near;
        }
        const Relaxed at = solve_locally_attracted(near_, arm_.limits, from, pose_, pull, rounds_);
        if (!meets(near_, at)) return;
        const Posture here = forward(near_, at.at.q);
        if (is_nan(here.psi) || !(options_.branches >> here.gc & 1)) return;
        if (options_.allowed && !contains(*options_.allowed, here.psi)) return;
        if (scene_ && !is_clear(near_, *scene_, at.at.q)) return;
        const Nearest found = finished(at.at.q, here.psi, here.gc);
        const double rank = rank_of(found);
        if (is_solved(out.status) && !(rank < rank_of(out) - NearestTuning::gain)) return;
        out = found;
        best_.cost = squares() ? rank * rank : rank;
    }

    /// The value by which solutions are compared, lower is better: the distance, or minus the limit margin.
    double rank_of(const Nearest& x) const noexcept {
        return options_.metric == Metric::margin ? -x.margin : x.distance;
    }

    // -- results

    /// If the seed itself solves the pose within limits, permitted arcs and scene, writes it to `out` as the
    /// solution, since it costs nothing. Otherwise returns false and leaves `out` unchanged.
    bool keep_near(Nearest& out) noexcept {
        if (!options_.near || options_.metric == Metric::margin) return false;
        if (!within_limits(arm_.limits, options_.near, 0.0)) return false;
        const Posture here = forward(near_, options_.near);
        if (is_nan(here.psi) || !(options_.branches >> here.gc & 1)) return false;
        if (!same_pose(arm_.size, pose_, here.pose)) return false;
        if (options_.allowed && !contains(*options_.allowed, here.psi)) return false;
        if (margin_ > 0 && !(ask(here.gc) && contains(arcs_.arcs, here.psi))) return false;
        if (scene_ && !(margin_ > 0) && !is_clear(near_, *scene_, options_.near)) return false;
        out = finished(options_.near, here.psi, here.gc);
        return true;
    }

    /// Keeps the solution at the branch and psi of the seed, if these are feasible, as a first one to compare
    /// with.
    void begin_at_seed() noexcept {
        if (!options_.near || options_.metric == Metric::margin) return;
        const Posture here = forward(near_, options_.near);
        if (is_nan(here.psi) || !ask(here.gc)) return;
        if (contains(arcs_.arcs, here.psi)) offer(here.gc, here.psi);
    }

    /// The best posture found, as a result.
    Nearest result() noexcept {
        const int gc = best_.gc;
        const auto at = [this, gc](double psi) {
            const PointSolution here = solution_at(gc, psi);
            Joints out{};
            for (int j = 0; j < joints; ++j) out.q[j] = here.q[j];
            return out;
        };
        const auto is_open = [this, gc](double psi) {
            return solution_at(gc, psi).found && !(options_.allowed && !contains(*options_.allowed, psi));
        };
        return kept_within(at, is_open, wrap(best_.psi), gc);  // what inverse() gives at the psi that is told
    }

    const ChainArm& near_;
    const Scene* scene_;  // to be kept clear of; null: none
    double margin_;
    Pose<double> pose_;
    Triad<double> on_;
    Status status_[configurations];
    double least_[configurations], piece_least_[configurations][ChainNearestTuning::first_pieces];
    ProvenArcs arcs_;
    int asked_ = -1;  // the branch whose arcs these are
    Best best_;
    double elbow_most_ = infinity;                   // what joint 4 may cost
    ArcSet doubt_[configurations];                   // what is not proven of the branches that were asked
    double lost_ = infinity;                         // the least bound of what was given up
    int hard_ = ChainNearestTuning::hard;            // postures left to the pose
    int rounds_ = ChainNearestTuning::local_rounds;  // of solve_locally(), left to the pose
    int waiting_ = 0;
    Piece piece_[capacity];  // of the arc that is searched
};

}  // namespace detail

/// The posture of a pose that is nearest to a seed, or furthest from the limits, globally: over the permitted
/// branches, all psi and all multiples of 2 pi within the limits. UNPROVEN: a posture, but a nearer one is
/// not excluded. `margin` is the singularity margin (rad), and `scene` may be null. Unproven parts are
/// searched only without a margin.
inline Nearest nearest_posture(const ChainArm& arm, double margin, const Pose<double>& pose,
                               const NearestOptions& options, const Scene* scene = nullptr) noexcept {
    return detail::ProvenSearch(arm, margin, pose, options, scene).best();
}

/// Writes the nearest posture of each permitted branch and proven arc to `out`, by rising cost.
inline void nearest_postures(const ChainArm& arm, double margin, const Pose<double>& pose,
                             const NearestOptions& options, Nearests& out,
                             const Scene* scene = nullptr) noexcept {
    detail::ProvenSearch(arm, margin, pose, options, scene).all(out);
}

}  // namespace armangle

#include "../names/end.hpp"
