// Proof that a curve respects its limits between all samples: interval arithmetic on the boundary functions
// along it.
//
//     f |   /~~~~~\  <- range over the stretch          proven where the band lies above 0: by the range, or
//       |  /~~~~~~~\~~                                  by the mean value form f(m) + f'(S) (S - m); else the
//     0 +--[---S---]---- s                              stretch is halved
//
// For every joint a condition is positive if the joint, with its turn, is within its limits:
//   pivot of less than a turn: the direction (V, U) stays in the open cone of its limits, so that the
//     angle, which is continuous, cannot change its turn;
//   pivot of a turn or more: the direction stays in a sector of +-60 degrees about an angle that continues
//     from stretch to stretch, and within its limits by the same boundary functions;
//   hinge, elbow: sin > 0 keeps the half turn, and so the turn; cos is between those of its limits.
// If a joint leads (psi_from_joint.hpp), its theta is a polynomial of s. The condition sin > 0 of the hinge
// next to it is replaced: the root that gives phi must stay simple, and the hinge within its limits, of less
// than a turn. So the hinge may pass 0. Source: R. E. Moore, Interval Analysis (1966): the mean value form
// and bisection.
//
// Arcs of psi from the user are one more pivot, with the direction of psi. Collisions are excluded by
// distances (clear_prover.hpp).
#pragma once

#include "clear_prover.hpp"
#include "scenes_along.hpp"
#include "work.hpp"
#include "curve.hpp"
#include "../limits/feasible.hpp"
#include "../numbers/interval.hpp"
#include "../arm/joint_map.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the proof of a curve of an exact arm.
struct CurveProofTuning {
    /// Limits are proven with this reserve (rad): more than the rounding of joint values from the curve. A
    /// limit on which the curve begins or ends has no reserve: the proven violation is at most this.
    static constexpr double slack = 1e-9;
    /// A condition below minus this is violated, not touched.
    static constexpr double broken = 4e-9;
    /// Least proven distance to singularities (rad), whatever margin is requested. At this distance the
    /// values used to compute joints round to less than the slack (directions round to 2e-15).
    static constexpr double least_margin = 3e-6;
    /// The root given by a leading joint is simple: the square of its slope stays above this, so that its
    /// rounding stays below the slack.
    static constexpr double least_slope_square = 1e-8;
    static constexpr double converted =
        2e-15;  // rounding of a joint value converted to theta and back (of its size)
    static constexpr double gap =
        1e-9;  // between the joints at the end of a stretch and at the next one (rad)
    static constexpr double join = 1e-12;     // largest overlap of a stretch with the next segment (of s)
    static constexpr double sector = pi / 3;  // half width (rad)
    static constexpr double sector_step =
        2.2;  // of its middle from one to the next (rad); 2 sector + this < 2 pi
    static constexpr double end_step =
        2.0;                          // of its middle from the ends of a stretch (rad); sector + this < pi
    static constexpr int looks = 32;  // samples that search violations in an unproven stretch
    static constexpr double leap = 1e-3;          // jump of a joint (rad) ...
    static constexpr double leap_within = 1e-12;  // ... within so much of s
    static constexpr int depth = 14;              // halvings of a stretch
    static constexpr int evaluations = 256;       // average per stretch before the rest is left unproven
};

/// Conditions on a curve besides limits and margins.
struct AlsoKept {
    ScenesAlong scenes = {};          // the curve must be collision-free
    const ArcSet* allowed = nullptr;  // psi must stay in one of these arcs
    bool touching = false;            // a requested end may touch an obstacle, but only by rounding
    Work* work = nullptr;             // that the proof may take
};

/// Unproven stretches of s, and the places where a limit is violated or a collision occurs.
struct Proof {
    std::vector<double> open;      // ends of unproven stretches, two each, merged if they meet
    std::vector<double> violated;  // s
    /// Whether nothing is left unproven.
    bool certified() const noexcept { return open.empty(); }
};

namespace detail {

/// Whether a joint moves by more than `leap` within `leap_within` of s somewhere on stretch x of a curve
/// between configuration a at s = `from` and b at `to`, searched by halving.
template <class AnyCurve>
bool leaps(const AnyCurve& curve, const Stretch& x, double from, double to, PlacedPosture a,
           PlacedPosture b) noexcept {
    while (largest_move(a.q, b.q) > CurveProofTuning::leap) {
        const double half = 0.5 * (from + to);
        if (!(half > from && half < to) || to - from < CurveProofTuning::leap_within) return true;
        const PlacedPosture middle = curve.at(x, half);
        const bool first = largest_move(a.q, middle.q) > largest_move(middle.q, b.q);
        (first ? b : a) = middle;
        (first ? to : from) = half;
    }
    return false;
}

/// Conditions to prove: each row has one or two entries, of which one must be positive.
template <class T>
struct Conditions {
    static constexpr int capacity = 28;
    struct Row {
        int entries;
        T entry[2];
    };
    int count = 0;
    Row row[capacity];

    /// Adds the condition that a number is positive.
    void add(const T& only) noexcept {
        row[count].entries = 1;
        row[count].entry[0] = only;
        ++count;
    }
    /// Adds the condition that one of two numbers is positive.
    void add_either(const T& one, const T& other) noexcept {
        row[count].entries = 2;
        row[count].entry[0] = one;
        row[count].entry[1] = other;
        ++count;
    }
};

/// A range (near, far) of |theta| with the cosines of its ends; near <= 0 and far >= pi have no effect.
struct HalfTurn {
    bool has_near = false, has_far = false, empty = false;
    Interval cos_near{0.0}, cos_far{0.0};
};

/// The range of |a| for which theta = turn + g |a|, g = 1 or -1, stays within the limits `range`, narrowed by
/// the slack.
inline HalfTurn half_turn(const ThetaRange& range, double turn, double g) noexcept {
    const double lower = range.lower, upper = range.upper;
    const double near = (g > 0 ? lower - turn : turn - upper) + CurveProofTuning::slack,
                 far = (g > 0 ? upper - turn : turn - lower) - CurveProofTuning::slack;
    HalfTurn out;
    out.has_near = near > 0;
    out.has_far = far < pi;
    out.empty = !(near < far) || near > pi || far < 0;
    if (out.has_near && !out.empty) out.cos_near = sin_cos(Interval(near)).cos;
    if (out.has_far && !out.empty) out.cos_far = sin_cos(Interval(far)).cos;
    return out;
}

/// How joints 1, 3, 5 and 7 are proven: by sectors if the range is 2 pi or more, otherwise by a cone of
/// directions of up to (narrow) or over (wide) 180 degrees.
enum class PivotKind { turning, narrow, wide };

/// The statement to prove about a curve.
struct Claim {
    const Curve& curve;
    const Limits& limits;                   // to prove
    const ArcSet* allowed;                  // of psi, to prove; null: any
    double asked_margin;                    // to singularities (rad) ...
    double sine_square;                     // ... and the proven part of it
    bool stretched[2];                      // whether the curve begins (ends) with the arm stretched
    HalfTurn hinge[2][2], elbow;            // of joints 2 and 6, for positive and negative theta
    double hinge_lower[2], hinge_upper[2];  // range of theta within which a hinge may cross 0, without turns
    bool locked[joints] = {};               // joints that lead all the way and are constant
    PivotKind kind[pivots];
    double lower[pivots], upper[pivots];  // theta, narrowed by the slack
    SinCos<Interval> at_lower[pivots], at_upper[pivots];

    /// Computes what a proof of curve c must show: limits `l`, singularity margin (rad) and allowed arcs
    /// (null: all), and in which revolution each joint begins.
    Claim(const Curve& c, const Limits& l, double margin, const ArcSet* arcs) noexcept
        : curve(c), limits(l), allowed(arcs), asked_margin(margin) {
        const Arm& arm = c.arm;
        const Interval sine = sin_cos(Interval(max(margin, CurveProofTuning::least_margin))).sin;
        sine_square = square(sine).hi;
        const Stretch &front = c.stretches.front(), &back = c.stretches.back();
        stretched[0] = margin == 0 && straight(front, front.start);
        stretched[1] = margin == 0 && straight(back, back.end);
        const auto turn = [&](int j, double centre) {
            const double theta = to_theta(arm, j, c.stretches.front().q[j]);
            const ThetaRange range =
                theta_range(arm, limits, j);  // if it is half a turn off, choose the side of the limits
            const double inward =
                std::copysign(CurveProofTuning::slack, 0.5 * (range.lower + range.upper) - theta);
            return centre + two_pi * round((theta + inward - centre) / two_pi);
        };
        for (int h = 0; h < hinges; ++h) {
            const int j = hinge_joint[h];
            const ThetaRange range = claimed_range(j);
            const double whole = turn(j, 0.0);
            for (const bool negative : {false, true})
                hinge[h][negative] = half_turn(range, whole, negative ? -1.0 : 1.0);
            double &low = hinge_lower[h] = range.lower - whole + CurveProofTuning::slack,
                   &high = hinge_upper[h] = range.upper - whole - CurveProofTuning::slack;
            if (high - low < two_pi - 4 * CurveProofTuning::slack) continue;
            low = max(low, -CurveProofTuning::sector);
            high = min(high, CurveProofTuning::sector);
        }
        elbow = half_turn(claimed_range(3), turn(3, arm.delta_angle), configuration(c.gc).elbow);
        for (int j = 0; j < joints; ++j) locked[j] = stands_still(c, limits, j);
        for (int p = 0; p < pivots; ++p) {
            const int j = pivot_joint[p];
            const ThetaRange range = claimed_range(j);
            lower[p] = range.lower + CurveProofTuning::slack;
            upper[p] = range.upper - CurveProofTuning::slack;
            const double width = upper[p] - lower[p];
            kind[p] = PivotKind::turning;
            if (width < two_pi - 4 * CurveProofTuning::slack)
                kind[p] = width > pi ? PivotKind::wide : PivotKind::narrow;
            if (lower[p] > -infinity) at_lower[p] = sin_cos(Interval(lower[p]));
            if (upper[p] < infinity) at_upper[p] = sin_cos(Interval(upper[p]));
        }
    }

    /// The limits of joint j as a range of theta; one on which the curve begins or ends is moved out a
    /// little.
    ThetaRange claimed_range(int j) const noexcept {
        const ThetaRange range = theta_range(curve.arm, limits, j);
        ThetaRange out = range;
        for (const double q : {curve.stretches.front().q[j], curve.stretches.back().q_end[j]}) {
            const double theta = to_theta(curve.arm, j, q);
            if (abs(theta - range.lower) <= CurveProofTuning::slack)
                out.lower = range.lower - 2 * CurveProofTuning::slack;
            if (abs(theta - range.upper) <= CurveProofTuning::slack)
                out.upper = range.upper + 2 * CurveProofTuning::slack;
        }
        return out;
    }

    /// Whether the arm is stretched at s of stretch x, up to rounding.
    bool straight(const Stretch& x, double s) const noexcept {
        const Triangle<double> t = curve.motion_at(x, s).circle.triangle;
        return t.eta.sin == 0 && t.eta.cos > 0 && t.excess <= t.rounding;
    }

    /// Whether a range of s begins with the curve's start, or ends with its end, where the arm is stretched;
    /// the elbow is not kept away from its end there.
    bool stretches_out(double from, double to) const noexcept {
        return (stretched[0] && from == curve.stretches.front().start) ||
               (stretched[1] && to == curve.stretches.back().end);
    }

    /// The joint (0: joint 2, 1: joint 6) that is 0 or pi at the start (end) of the curve, if the range of s
    /// begins (ends) there (Curve::singular_hinge); -1: none, or a margin is requested. `way` is 1 at the
    /// start, otherwise -1.
    int shut_at(const Stretch& x, double from, double to, double& way) const noexcept {
        const Stretch &front = curve.stretches.front(), &back = curve.stretches.back();
        if (asked_margin > 0) return -1;
        way = &x == &front && from == front.start ? 1 : -1;
        if (way > 0) return curve.singular_hinge(x, x.q);
        return &x == &back && to == back.end ? curve.singular_hinge(x, x.q_end) : -1;
    }

    /// Whether the limits permit any curve: no range of a joint is empty.
    bool possible() const noexcept {
        bool ok = !elbow.empty;
        for (int h = 0; h < hinges; ++h)
            ok = ok && (locked[hinge_joint[h]] || !hinge[h][0].empty || !hinge[h][1].empty);
        for (int p = 0; p < pivots; ++p) ok = ok && (locked[pivot_joint[p]] || lower[p] < upper[p]);
        return ok;
    }

    /// Whether joint j leads the whole curve with a constant value within its limits, up to rounding. The
    /// curve then returns the limit itself, since a locked joint has no other value.
    static bool stands_still(const Curve& c, const Limits& limits, int j) noexcept {
        const double theta = c.stretches.front().coefficient[0];
        for (const Stretch& x : c.stretches) {
            bool still = x.lead == j + 1 && x.coefficient[0] == theta;
            for (int k = 1; k <= 3; ++k) still = still && x.coefficient[k] == 0;
            if (!still) return false;
        }
        const double q = to_q(c.arm, j, theta);
        return max(limits.lower[j] - q, q - limits.upper[j]) <=
               CurveProofTuning::converted * (1 + abs(theta));
    }

    /// Adds the conditions that |theta|, with this cosine, lies within the range h.
    template <class T>
    static void limit_half_turn(const HalfTurn& h, const T& cosine, Conditions<T>& out) noexcept {
        if (h.has_near) out.add(T(h.cos_near) - cosine);
        if (h.has_far) out.add(cosine - T(h.cos_far));
    }

    /// The value sin(theta - angle) times the length of the direction vector (u, v).
    template <class T>
    static T beyond(const T& u, const T& v, const SinCos<Interval>& angle) noexcept {
        return u * T(angle.cos) - v * T(angle.sin);
    }

    /// Adds the conditions that theta of pivot p, with sine u and cosine v (times a length), stays in the
    /// sector around `middle` (rad) and within the limits; false if `middle` is outside the limits.
    template <class T>
    bool turning(int p, const T& u, const T& v, double middle, Conditions<T>& out) const noexcept {
        if (!(middle > lower[p] && middle < upper[p])) return false;
        const double l = middle - CurveProofTuning::sector, r = middle + CurveProofTuning::sector;
        out.add(beyond(u, v, sin_cos(Interval(l))));
        out.add(-beyond(u, v, sin_cos(Interval(r))));
        if (l <= lower[p]) out.add(beyond(u, v, at_lower[p]));
        if (r >= upper[p]) out.add(-beyond(u, v, at_upper[p]));
        return true;
    }

    /// The index of the allowed arc in which a stretch is to be proven: the one that contains psi at s; -1:
    /// none. `allowed` must not be null.
    int arc_at(const Stretch& x, double s) const noexcept {
        const double near = s < 0.5 * (x.start + x.end) ? x.psi : x.psi_end;
        return find(*allowed, curve.solve(x, s, phi_at(x, s), x.q, near).psi, 0.0).index;
    }

    /// Adds the conditions that psi, at `here`, the configuration at s, stays within an arc narrowed by the
    /// slack.
    template <class T>
    void limit_psi(const Arc& arc, const Stretch& x, const T& s, const PlacedDirections<T>& here,
                   Conditions<T>& out) const noexcept {
        const Circle<T>& c = here.motion.circle;
        const Triad<T> own = triad(curve.arm, flange_pose(curve.arm, pose_at(curve.segment(x), s)));
        const Vec3<T> z3 = combine(c.z, here.phi.cos, c.e, here.phi.sin);
        const T u = dot(own.e, z3), v = dot(own.z, z3);
        const double l = arc.lower + CurveProofTuning::slack, r = arc.upper - CurveProofTuning::slack;
        const T above = beyond(u, v, sin_cos(Interval(l))), below = -beyond(u, v, sin_cos(Interval(r)));
        limit_cone(above, below, r - l > pi, out);
    }

    /// Appends all conditions over a range of s to `out`; false if they cannot hold. middle: theta (rad) of
    /// joints 1, 3, 5 and 7 at the middle of the range. arc: must contain psi; null: any. bent: whether the
    /// elbow stays away from its end. shut: joint 2 or 6 (0, 1) if it is 0 or pi at an end of the range; -1:
    /// neither. The directions of its neighbours are then divided by the distance to that end; by the mean
    /// value theorem the quotients are their slopes. way: 1 if the range begins at that end, else -1.
    template <class T>
    bool evaluate(const Stretch& x, const T& s, const double* middle, const Arc* arc, bool bent,
                  Conditions<T>& out, int shut = -1, double way = 1) const noexcept {
        const T value = phi_at(x, s);
        const PlacedDirections<T> here = curve.place(x, s, value);
        const Directions<T>& d = here.angles;
        const JointFunctions<T> f = x.lead == 0 ? joint_functions(here.motion) : here.functions;
        const int lead = static_cast<int>(x.lead) - 1;
        const Configuration<double> sign = configuration(curve.branch(x));
        const SinCos<T>& eta = here.motion.circle.triangle.eta;
        if (bent) out.add(eta.sin * eta.sin - T(sine_square));
        if (arc) limit_psi(*arc, x, s, here, out);
        limit_half_turn(elbow, eta.cos, out);
        if (lead >= 0) out.add(here.room - T(CurveProofTuning::least_slope_square));
        for (int h = 0; h < hinges; ++h) {
            const bool crosses = h == hinge_crossed_by(static_cast<int>(x.lead));
            if (crosses) {
                if (!(hinge_lower[h] < hinge_upper[h])) return false;
                limit_crossing(h, d.y[hinge_joint[h]], d.x[hinge_joint[h]], out);
            } else {
                const HalfTurn& half = hinge[h][(h == 0 ? sign.shoulder : sign.wrist) < 0];
                if (half.empty && !locked[hinge_joint[h]]) return false;
                if (!locked[hinge_joint[h]]) limit_half_turn(half, f.hinge[h].H.at(here.phi), out);
            }
            for (const int p : {2 * h, 2 * h + 1}) {
                const int j = pivot_joint[p];
                if (j == joints - 1 && curve.arm.roll_free) continue;  // it is constant
                T u = crosses ? d.y[j] : f.pivot[p].g * f.pivot[p].U.at(here.phi),
                  v = crosses ? d.x[j] : f.pivot[p].g * f.pivot[p].V.at(here.phi);
                if constexpr (!std::is_same_v<T, Interval>)
                    if (h == shut) {
                        u = T(way * u.coefficient[1]);
                        v = T(way * v.coefficient[1]);
                    }
                if (p % 2 == 0 && !crosses) out.add(u * u + v * v - T(sine_square));
                if (lead == j) {
                    if (!crosses)
                        out.add(u * here.theta.sin + v * here.theta.cos);  // excludes half a turn away
                    if (!locked[j] && lower[p] > -infinity) out.add(value - T(lower[p]));
                    if (!locked[j] && upper[p] < infinity) out.add(T(upper[p]) - value);
                    continue;
                }
                if (!limit_pivot(p, u, v, middle[p], out)) return false;
            }
        }
        return true;
    }

    /// Adds the conditions that pivot p (0 to 3: joint 1, 3, 5, 7), with theta's sine u and cosine v (times a
    /// length), stays within its limits. If their range is 360 degrees or more, it must also stay in the
    /// sector around `middle` (rad); false if `middle` is then outside the limits.
    template <class T>
    bool limit_pivot(int p, const T& u, const T& v, double middle, Conditions<T>& out) const noexcept {
        if (kind[p] == PivotKind::turning) return turning(p, u, v, middle, out);
        limit_cone(beyond(u, v, at_lower[p]), -beyond(u, v, at_upper[p]), kind[p] == PivotKind::wide, out);
        return true;
    }

    /// Adds the conditions that joint 2 or 6 (h: 0, 1), with sine and cosine of theta (times a length), stays
    /// within its limits, and within +-60 degrees if their range is 360 degrees or more. It may cross 0,
    /// unless a singularity margin is requested.
    template <class T>
    void limit_crossing(int h, const T& sine, const T& cosine, Conditions<T>& out) const noexcept {
        const double l = hinge_lower[h], u = hinge_upper[h];
        limit_cone(beyond(sine, cosine, sin_cos(Interval(l))), -beyond(sine, cosine, sin_cos(Interval(u))),
                   u - l > pi, out);
        if (asked_margin > 0) out.add(sine * sine - T(sine_square));
    }

    /// Adds the conditions that a direction stays in a cone: `above` its lower and `below` its upper end
    /// (positive if so), or, if the cone is wider than 180 degrees, one of both.
    template <class T>
    static void limit_cone(const T& above, const T& below, bool wide, Conditions<T>& out) noexcept {
        if (wide) return out.add_either(above, below);
        out.add(above);
        out.add(below);
    }
};

/// Whether every row has an entry that is positive over the whole range; lower(i, k) is a lower bound of
/// entry k of row i.
template <class T, class Lower>
bool all_positive(const Conditions<T>& c, const Lower& lower) noexcept {
    for (int i = 0; i < c.count; ++i) {
        const bool first = lower(i, 0) > 0, second = c.row[i].entries == 2 && lower(i, 1) > 0;
        if (!first && !second) return false;
    }
    return true;
}

/// Proves a curve stretch by stretch, or records where and why it cannot.
class Prover {
public:
    /// Keeps references to the curve and the limits, and computes the conditions and the work that their
    /// proof may take; run() proves them.
    Prover(const Curve& curve, const Limits& limits, double margin, const AlsoKept& kept)
        : curve_(curve), claim_(curve, limits, margin, kept.allowed), kept_(kept) {
        budget_ = static_cast<long long>(curve.stretches.size() + 8) * CurveProofTuning::evaluations;
        for (int k = 0; k < kept.scenes.count; ++k) clear_.emplace_back(curve, kept.scenes[k], kept.touching);
    }

    /// Proves all stretches; returns what remains unproven and the violations found. Can be called once.
    Proof run() {
        const bool possible = claim_.possible();
        const Stretch* last = nullptr;
        for (const Stretch& x : curve_.stretches) {
            const long long before = budget_;
            const Segment& g = curve_.segment(x);
            const bool within =
                x.start >= g.start - CurveProofTuning::join && x.end <= g.end + CurveProofTuning::join;
            const bool joined = !last || largest_move(last->q_end, x.q) <= CurveProofTuning::gap;
            last = &x;
            if (!joined) proof_.violated.push_back(x.start);
            const bool limited = possible && within && joined && prove(x, x.start, x.end, 0);
            const bool clear = keeps_clear(x);
            if (kept_.work) kept_.work->take(WorkTuning::cell * (1 + before - budget_));
            if (limited && clear) continue;
            leave(x.start, x.end);
            if (limited) continue;
            lifted_ = false;
            look(x);
        }
        return proof_;
    }

private:
    /// Whether a stretch is proven collision-free, in each scene on its part of the path. A collision that is
    /// found is added to the violations of the proof.
    bool keeps_clear(const Stretch& x) {
        const int count = kept_.scenes.count;
        for (int k = 0; k < count; ++k) {
            const double from = k == 0 ? x.start : max(x.start, kept_.scenes.begin(k)),
                         to = k + 1 == count ? x.end : min(x.end, kept_.scenes.begin(k + 1));
            if (from > to || (from == to && x.start < x.end)) continue;
            ClearProver& prover = clear_[static_cast<std::size_t>(k)];
            const bool clear = prover.prove(x, from, to, proof_.violated);
            if (kept_.work)
                kept_.work->take((WorkTuning::cell + work_of_pairs(kept_.scenes, from)) * prover.looks());
            if (!clear) return false;
        }
        return true;
    }

    /// Records an unproven range of s; neighbouring ones are joined.
    void leave(double from, double to) {
        if (!proof_.open.empty() && proof_.open.back() == from)
            proof_.open.back() = to;
        else {
            proof_.open.push_back(from);
            proof_.open.push_back(to);
        }
    }

    /// Samples an unproven stretch, and records the first of its samples s at which a limit is violated, the
    /// pose is out of reach, or a joint jumps; nothing if there is none.
    void look(const Stretch& x) {
        PlacedPosture before{};
        for (int i = 0; i <= CurveProofTuning::looks; ++i) {
            const double s = x.start + (x.end - x.start) * i / CurveProofTuning::looks;
            const PlacedPosture here = curve_.at(x, s);
            const Pose<double> flange = flange_pose(curve_.arm, here.pose);
            const double excess = circle(curve_.arm, flange, curve_.plane).triangle.excess;
            const bool kept = is_finite(here.q) &&
                              limit_margin(claim_.limits, here.q) >= -CurveProofTuning::broken &&
                              excess <= tolerance::reach * curve_.arm.reach;
            const double step = (x.end - x.start) / CurveProofTuning::looks;
            if (kept && (i == 0 || !leaps(curve_, x, s - step, s, before, here))) {
                before = here;
                continue;
            }
            proof_.violated.push_back(s);
            return;
        }
    }

    /// Proves the conditions of the claim over a range of s by bisection; false if some part remains
    /// unproven. depth: halvings so far.
    bool prove(const Stretch& x, double from, double to, int depth) {
        if (budget_ <= 0) return false;
        double middle[pivots];
        if (!place(x, 0.5 * (from + to), middle)) return false;
        if (stands(x, from, to, middle)) {
            for (int p = 0; p < pivots; ++p) last_[p] = middle[p];
            return lifted_ = true;
        }
        if (depth == CurveProofTuning::depth || broken(x, 0.5 * (from + to), middle)) return false;
        const double half = 0.5 * (from + to);
        return prove(x, from, half, depth + 1) && prove(x, half, to, depth + 1);
    }

    /// Computes theta (rad) at s of joints 1, 3, 5 and 7 into `middle`, without jumps by 2 pi, if one of them
    /// is proven by sectors; otherwise leaves `middle` unchanged. False if the ends of the stretch do not
    /// determine the revolution.
    bool place(const Stretch& x, double s, double* middle) const noexcept {
        bool any = false;
        for (int p = 0; p < pivots; ++p) any = any || claim_.kind[p] == PivotKind::turning;
        if (!any) return true;
        const PlacedPosture now = curve_.at(s);
        for (int p = 0; p < pivots; ++p) {
            const int j = pivot_joint[p];
            middle[p] = to_theta(curve_.arm, j, now.q[j]);
            if (claim_.kind[p] != PivotKind::turning) continue;
            if (!(max(abs(x.q[j] - now.q[j]), abs(x.q_end[j] - now.q[j])) < CurveProofTuning::end_step))
                return false;
        }
        return true;
    }

    /// Whether all conditions of the claim are proven over a range of s without halving it. middle: see
    /// place().
    bool stands(const Stretch& x, double from, double to, const double* middle) noexcept {
        const Arc* arc = nullptr;
        if (claim_.allowed && !claim_.allowed->full) {
            const int at = claim_.arc_at(x, 0.5 * (from + to));
            if (at < 0) return false;
            arc = &claim_.allowed->arc[at];
        }
        for (int p = 0; p < pivots; ++p)
            if (lifted_ && claim_.kind[p] == PivotKind::turning &&
                !(abs(middle[p] - last_[p]) < CurveProofTuning::sector_step))
                return false;
        const Interval range(from, to);
        const bool bent = !claim_.stretches_out(from, to);
        using J = Jet<Interval, 1>;
        double way = 1;
        if (const int shut = claim_.shut_at(x, from, to, way); shut >= 0) {
            budget_ -= 4;
            Conditions<J> opened;
            return claim_.evaluate(x, J::variable(range), middle, arc, bent, opened, shut, way) &&
                   all_positive(opened,
                                [&opened](int i, int k) { return opened.row[i].entry[k].value().lo; });
        }
        Conditions<Interval> plain;
        --budget_;
        if (!claim_.evaluate(x, range, middle, arc, bent, plain)) return false;
        if (all_positive(plain, [&plain](int i, int k) { return plain.row[i].entry[k].lo; })) return true;
        budget_ -= 4;
        const double m = 0.5 * (from + to);
        Conditions<J> slopes;
        Conditions<Interval> centre;
        if (!claim_.evaluate(x, J::variable(range), middle, arc, bent, slopes) ||
            !claim_.evaluate(x, Interval(m), middle, arc, bent, centre))
            return false;
        const Interval off = range - Interval(m);
        const auto lower = [&](int i, int k) {
            const J& f = slopes.row[i].entry[k];
            return greater(f.value().lo, (centre.row[i].entry[k] + f.coefficient[1] * off).lo);
        };
        return all_positive(slopes, lower);
    }

    /// Whether a condition of the claim is certainly violated at s, beyond rounding; if so, records s.
    /// middle: see place().
    bool broken(const Stretch& x, double s, const double* middle) {
        Conditions<Interval> at;
        bool bad = claim_.allowed && !claim_.allowed->full && claim_.arc_at(x, s) < 0;
        for (int p = 0; p < pivots; ++p)
            bad = bad ||
                  (claim_.kind[p] == PivotKind::turning &&
                   max(claim_.lower[p] - middle[p], middle[p] - claim_.upper[p]) > CurveProofTuning::broken);
        const auto fails = [](const Interval& f) { return f.hi < -CurveProofTuning::broken; };
        if (claim_.evaluate(x, Interval(s), middle, nullptr, true, at)) {
            for (int i = 0; i < at.count; ++i) {
                const auto& row = at.row[i];
                bad = bad || (fails(row.entry[0]) && (row.entries == 1 || fails(row.entry[1])));
            }
        }
        if (bad) proof_.violated.push_back(s);
        return bad;
    }

    const Curve& curve_;
    const Claim claim_;
    const AlsoKept kept_;
    std::vector<ClearProver> clear_;
    Proof proof_;
    long long budget_;
    bool lifted_ = false;
    double last_[pivots] = {};
};

}  // namespace detail

/// Proves limits (the arm's, or narrowed by the requested margin), a singularity margin (rad), and further
/// conditions along a curve. Returns the unproven stretches and the violations that were found.
inline Proof certify(const Curve& curve, const Limits& limits, double margin, const AlsoKept& kept = {}) {
    return detail::Prover(curve, limits, margin, kept).run();
}

}  // namespace armangle

#include "../names/end.hpp"
