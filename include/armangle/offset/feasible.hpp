// Feasible intervals of the free joint: where a posture of a branch exists and keeps the limits, exact.
//
//     |--inside--|--------outside--------|--inside--|
//                ^ a root of a limit's form          ^ fold, reach
//
// Every limit is a root of a form in theta_7 (limit_forms.hpp), shared by both wrists and both shoulders.
// Between two neighbouring roots nothing changes: one evaluation there decides. An end is then found on the
// true joint value. Roots that stay undecided, tangencies, are pieces that interval cells judge (cells.hpp);
// what those leave open too is left out and counted.
#pragma once

#include <algorithm>

#include "cells.hpp"
#include "limit_forms.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of OffsetArcs.
struct OffsetArcsTuning {
    TrigRootsTuning roots;
    /// The number of cells that all branches of a pose together may use for undecided pieces.
    int looks = 1200;
    /// Cells narrower than this half width (rad) are abandoned.
    double narrowest = 1e-9;
    /// Roots nearer to each other than this (rad) are one place, since an arc between them would be a single
    /// angle.
    double one_place = tolerance::angle;
    /// A place with more than one root that is wider than this (rad) is undecided.
    double widest_place = 4e-9;
    /// How far (rad) from a place its end may be searched before the next root.
    double beside = 1e-11;
    /// Steps of regula falsi to an end; every `bisected`-th one bisects.
    int end_steps = 40;
    int bisected = 4;
    /// The number of rounds of eight values that search an isolated feasible value.
    int alone_looks = 10;
    /// The unproven length (rad) that may hide an arc.
    double hidden = 1e-6;
};

namespace detail {

/// Computes the arcs of one pose within limits, branch by branch.
class OffsetArcs {
public:
    /// Computes the boundary functions of a pose that all branches share. The limits are given in the robot's
    /// joint order. The singularity margin is that of the robot's joint `joint` alone, or of all (-1).
    OffsetArcs(const OffsetArm& arm, const Pose<double>& pose, const Limits& limits,
               const OffsetArcsTuning& tuning, int joint = -1) noexcept
        : arm_(arm),
          exact_{orthonormal(pose.rotation), pose.position},
          tuning_(tuning),
          limits_in_order_(arm.rest, in_order(arm, limits), 0.0, configuration(0)),
          ranges_(limits_in_order_),
          joint_(joint),
          forms_(arm, offset_motion(arm, exact_, 0)),
          kappa_(forms_.kappa()),
          looks_(tuning.looks) {}

    /// Computes the arcs of branch gc (0..7). `branches` is the number of branches still to be computed, this
    /// one included, which share the cells.
    void find(int gc, int branches, ProvenArcs& out) noexcept {
        make_empty(out.arcs);
        make_empty(out.open);
        Branch branch(offset_motion(arm_, exact_, gc), gc);
        keep_margin(branch.motion.branch);
        const int share = looks_ / branches;
        branch.looks = share;
        const bool bent_up = branch.motion.branch.elbow > 0;
        Circle& circle = circle_[bent_up];
        if (!circle.made) make_circle(branch.motion.branch.elbow, circle);
        judge_segments(circle, branch);
        if (circle.count == 0) {
            if (branch.inside[0]) add(-pi, pi, 0, 0, branch.pieces);
        } else {
            find_ends(circle, branch);
            for (int i = 0; i < circle.count; ++i) {
                if (undecided(circle.place[i]))
                    judge_place(circle.place[i].lower, circle.place[i].upper, branch);
                if (branch.inside[i])
                    add(branch.lower[i], branch.upper[i], branch.lower_tag[i], branch.upper_tag[i],
                        branch.pieces);
            }
        }
        looks_ -= share - branch.looks;
        double beyond = 0;
        out.unproven = branch.unproven;
        branch.pieces.finish(out.arcs, out.unproven);
        branch.open.finish(out.open, beyond);
        if (beyond > 0) make_full(out.open);
        out.status = Status::OK;
        if (!out.arcs.empty()) return;
        out.status = out.unproven > tuning_.hidden ? Status::NEAR_SINGULAR : refusal(circle, branch);
    }

    /// Calls take(free) for the values of the free joint at which theta_2 of branch gc may be 0 or pi, among
    /// those that joints 4 and 7 permit.
    template <class Take>
    void straight(int gc, const Take& take) noexcept {
        const double elbow = configuration(gc).elbow;
        Circle& circle = circle_[elbow > 0];
        if (!circle.made) make_circle(elbow, circle);
        const auto tell = [&](const BentForm& form) {
            for (int i = 0; i < circle.pieces; ++i)
                trig_roots(form, kappa_, elbow, circle.piece_lower[i], circle.piece_upper[i], tuning_.roots,
                           [&](const RootEnclosure& root) {
                               take(to_q(arm_.rest, 6, 0.5 * (root.lower + root.upper)));
                           });
        };
        for (const double cosine : {1.0, -1.0})
            if (may_be(1, cosine > 0 ? 0.0 : pi)) tell(forms_.straight(cosine));
    }

    /// Calls take(lower, upper), two values of the free joint (rad), for the places of branch gc with more
    /// than one root: arcs between those are not looked for. A place is narrow, but at a fold the joints move
    /// by the root of its width.
    template <class Take>
    void crowded(int gc, const Take& take) noexcept {
        const double elbow = configuration(gc).elbow;
        Circle& circle = circle_[elbow > 0];
        if (!circle.made) make_circle(elbow, circle);
        for (int i = 0; i < circle.count; ++i) {
            const Place& place = circle.place[i];
            if (place.roots < 2 || undecided(place)) continue;
            const double p = to_q(place.lower, arm_.rest.sign[6], arm_.rest.offset[6]),
                         q = to_q(place.upper, arm_.rest.sign[6], arm_.rest.offset[6]),
                         lower = wrap(min(p, q));
            take(lower, lower + abs(q - p));
        }
    }

private:
    static constexpr int most_places = 256, most_forms = 2 * ThetaRanges::capacity + 3, most_cells = 1024;

    /// A place where the verdict may change: roots of one or more limits. A root of a locked joint counts
    /// twice, and so does an enclosure that may contain several roots.
    struct Place {
        double lower, upper;  // lower in [-pi, pi)
        int roots;
    };
    /// The circle of the free joint for one elbow sign: places, and after each a segment up to the next one,
    /// which may have solutions or not. Without a place the whole circle is one segment.
    struct Circle {
        bool made = false, within_reach = false;
        int count = 0;
        Place place[most_places];
        bool possible[most_places];
        double length[most_places];  // of the segments
        int pieces = 0;              // that reach and joints 4 and 7 leave
        double piece_lower[most_places], piece_upper[most_places];

        /// The number of the place before place i; around the circle, the last comes before the first.
        int before(int i) const noexcept { return i > 0 ? i - 1 : count - 1; }
        /// The number of the place after place i; the first comes after the last.
        int behind(int i) const noexcept { return i + 1 < count ? i + 1 : 0; }
    };
    /// The results of one branch; the ends belong to the segments inside.
    struct Branch {
        Branch(const OffsetMotion<>& m, int index) noexcept : motion(m), gc(index) {}
        OffsetMotion<> motion;
        int gc, looks = 0;
        bool exists = false;
        double unproven = 0;
        bool inside[most_places];
        double lower[most_places], upper[most_places];
        Tag lower_tag[most_places], upper_tag[most_places];
        Pieces pieces, open;
    };
    struct Limit {
        BentForm form;
        bool locked;
    };
    /// The margins of eight values of the free joint: the least of the joint limits (rad), of g^2 - t^2 and
    /// of the reach (as shares of the arm's), which of them is the least, and where a solution exists.
    struct Margin {
        RootLanes least, which;
        RootLanes asked;  // by how much the limit that was asked for is kept
        LaneMask<8> exists;
    };
    /// An end of a feasible interval, to be found between a value inside and one outside.
    struct End {
        double inside, outside, far_inside, far_outside;
        int segment;
        bool is_lower;
    };

    /// Adds the singularity margin on the sides of a branch to the ranges. Its roots are of these sides
    /// alone.
    void keep_margin(const OffsetBranch& sides) noexcept {
        if (!(arm_.margin > 0)) return;
        ranges_ = limits_in_order_;
        for (Circle& circle : circle_) circle.made = false;
        limits_ = 0;
        const auto keep = [&](int joint, double zero, double side) {
            if (joint_ < 0 || joint_ == robot_joint(arm_, joint))
                ranges_.keep_off(joint, zero, side, arm_.margin);
        };
        keep(1, 0.0, sides.shoulder);
        keep(3, arm_.rest.delta_angle, sides.elbow);
    }
    /// The limits in the order of the formulas.
    static Limits in_order(const OffsetArm& arm, const Limits& limits) noexcept {
        Limits out;
        for (int j = 0; j < joints; ++j) {
            out.lower[j] = limits.lower[robot_joint(arm, j)];
            out.upper[j] = limits.upper[robot_joint(arm, j)];
        }
        return out;
    }
    /// Whether a range is so narrow that the joint is fixed.
    static bool locked(const ThetaRanges::One& range) noexcept { return 2.0 * range.half < tolerance::angle; }
    /// Whether a joint (0..6) may have an angle within its ranges, or nearly.
    bool may_be(int joint, double angle) const noexcept {
        for (int i = 0; i < ranges_.count; ++i) {
            const ThetaRanges::One& range = ranges_.one[i];
            if (range.joint == joint && abs(wrap(angle - range.middle)) > range.half + tolerance::locked)
                return false;
        }
        return true;
    }
    /// Whether a place with several roots is too wide to be decided as one.
    bool undecided(const Place& place) const noexcept {
        return place.roots > 1 && place.upper - place.lower > tuning_.widest_place;
    }

    // -- places

    /// Stores in `circle` the places where the verdicts of the branches with one elbow sign may change, and
    /// the segments between them.
    void make_circle(double elbow, Circle& circle) noexcept {
        circle.made = true;
        circle.count = 0;
        bool full = false;
        const auto put = [&](const RootEnclosure& root, int roots) {
            if (circle.count == most_places) join(circle);
            if (circle.count == most_places) {
                full = true;
                return;
            }
            double turn = root.lower >= pi ? -two_pi : 0.0;
            if (root.lower < -pi) turn = two_pi;
            circle.place[circle.count++] = {root.lower + turn, root.upper + turn, root.settled ? roots : 2};
        };
        const auto roots_of = [&](const BentForm& form, double lower, double upper, int roots) {
            trig_roots(form, kappa_, elbow, lower, upper, tuning_.roots,
                       [&](const RootEnclosure& root) { put(root, roots); });
        };
        for (const double end : {1.0, -1.0}) roots_of(forms_.bend(end), -pi, pi, 1);
        for (int i = 0; i < ranges_.count; ++i) {
            const ThetaRanges::One& range = ranges_.one[i];
            if (range.joint != 3 && range.joint != 6) continue;
            for (const double side : {-1.0, 1.0}) {
                if (side > 0 && locked(range)) continue;
                const double limit = range.middle + side * range.half;
                if (range.joint == 6) {
                    const double at = wrap(limit);
                    put({at - tolerance::rounding, at + tolerance::rounding, true}, 1 + locked(range));
                } else if (elbow * wrap(limit - arm_.rest.delta_angle) > -tolerance::angle) {
                    const double end = sin_cos(limit - arm_.rest.delta_angle).cos;
                    if (abs(end) < 1.0 || locked(range))  // otherwise the root of the reach, not one more
                        roots_of(forms_.bend(end), -pi, pi, 1 + locked(range));
                }
            }
        }
        join(circle);
        measure_segments(circle);
        const int segments = circle.count > 0 ? circle.count : 1;
        double (&lower)[most_places] = circle.piece_lower;
        double (&upper)[most_places] = circle.piece_upper;
        int& pieces = circle.pieces;
        pieces = 0;
        for (int i = 0; i < segments; ++i) {
            const double from = circle.count > 0 ? circle.place[i].upper : -pi;
            const double middle = from + 0.5 * circle.length[i];
            circle.within_reach = circle.within_reach || abs(kappa_at(middle)) <= 1.0;
            if (!possible(elbow, middle)) continue;
            lower[pieces] = from;
            upper[pieces++] = from + circle.length[i];
        }
        if (pieces > 0 && limits_ == 0) find_limits();
        for (int i = 0; i < pieces && !full; ++i)
            for (int k = 0; k < limits_; ++k)
                roots_of(limit_[k].form, lower[i], upper[i], 1 + limit_[k].locked);
        if (full) {  // all of it is undecided
            circle.count = 1;
            circle.place[0] = {-pi, pi, 2};
        }
        join(circle);
        measure_segments(circle);
        for (int i = 0; i < (circle.count > 0 ? circle.count : 1); ++i) {
            const double middle = middle_of(circle, i);
            circle.possible[i] = false;
            for (int k = 0; k < pieces && !full; ++k) {
                const double at = lift(middle, 0.5 * (lower[k] + upper[k]));
                circle.possible[i] = circle.possible[i] || (at >= lower[k] && at <= upper[k]);
            }
        }
    }

    /// Sorts the places of `circle` and joins those that are too near to each other for an arc between them.
    void join(Circle& circle) const noexcept {
        std::sort(circle.place, circle.place + circle.count,
                  [](const Place& a, const Place& b) { return a.lower < b.lower; });
        int kept = 0;
        for (int i = 1; i < circle.count; ++i) {
            Place &last = circle.place[kept], &next = circle.place[i];
            if (next.lower - last.upper < tuning_.one_place) {
                last.upper = max(last.upper, next.upper);
                last.roots += next.roots;
            } else {
                circle.place[++kept] = next;
            }
        }
        circle.count = circle.count > 0 ? kept + 1 : 0;
        if (circle.count < 2) return;
        Place &first = circle.place[0], &last = circle.place[circle.count - 1];
        if (first.lower + two_pi - last.upper >= tuning_.one_place) return;
        last.upper = max(last.upper, first.upper + two_pi);
        last.roots += first.roots;
        std::move(circle.place + 1, circle.place + circle.count, circle.place);
        --circle.count;
    }

    /// Stores in `circle` the lengths (rad) of the segments between places; one of 2 pi without places.
    static void measure_segments(Circle& circle) noexcept {
        if (circle.count == 0) circle.length[0] = two_pi;
        for (int i = 0; i < circle.count; ++i) {
            const int next = circle.behind(i);
            const double end = circle.place[next].lower + (next <= i ? two_pi : 0.0);
            circle.length[i] = max(end - circle.place[i].upper, 0.0);
        }
    }
    /// The middle of the segment after place i.
    static double middle_of(const Circle& circle, int i) noexcept {
        return circle.count > 0 ? circle.place[i].upper + 0.5 * circle.length[i] : 0.0;
    }

    /// The cosine kappa of the elbow angle at a value of theta_7.
    double kappa_at(double x) const noexcept {
        const SinCos<double> at = sin_cos(x);
        return kappa_.c[0] + kappa_.c[1] * at.cos + kappa_.s[1] * at.sin;
    }

    /// Whether reach and the limits of joints 4 and 7 permit a value of theta_7.
    bool possible(double elbow, double x) const noexcept {
        const double kappa = kappa_at(x);
        if (!(abs(kappa) <= 1.0)) return false;
        const double bend = elbow * atan2(sqrt((1.0 - kappa) * (1.0 + kappa)), kappa);
        for (int i = 0; i < ranges_.count; ++i) {
            const ThetaRanges::One& range = ranges_.one[i];
            const double at = range.joint == 3 ? arm_.rest.delta_angle + bend : x;
            if ((range.joint == 3 || range.joint == 6) && !(abs(wrap(at - range.middle)) <= range.half))
                return false;
        }
        return true;
    }

    /// Collects the equations of the limits of joints 1, 2, 3, 5 and 6, of the folds, and of the values at
    /// which axis 5 is undefined.
    void find_limits() noexcept {
        const auto put = [this](const BentForm& form, bool is_locked) {
            limit_[limits_++] = {form, is_locked};
        };
        put(forms_.theta_5(1.0), false);
        put(forms_.theta_5(-1.0), false);
        put(forms_.across(), false);
        for (int i = 0; i < ranges_.count; ++i) {
            const ThetaRanges::One& range = ranges_.one[i];
            double cosine = not_a_number;
            for (const double side : {-1.0, 1.0}) {
                const double limit = range.middle + side * range.half;
                const SinCos<double> angle = sin_cos(limit);
                if (side > 0 && (locked(range) || (range.joint == 1 && angle.cos == cosine))) continue;
                cosine = angle.cos;
                if (range.joint == 0) put(forms_.theta_1(limit), locked(range));
                if (range.joint == 1) put(forms_.theta_2(limit), locked(range));
                if (range.joint == 2) put(forms_.theta_3(limit), locked(range));
                if (range.joint == 4) put(forms_.theta_5(angle.sin), locked(range));
                if (range.joint == 5) put(forms_.theta_6(limit), locked(range));
            }
        }
    }

    // -- verdicts

    /// Computes the margins of eight values of theta_7, and of the limits whose numbers are `asked`. Limits
    /// are numbered: 2 i and 2 i + 1 are the lower and the upper end of range i, then follow fold and reach.
    Margin margin(const OffsetMotion<>& motion, const RootLanes& x,
                  const RootLanes& asked = RootLanes(0.0)) const noexcept {
        const SinCos<RootLanes> theta_7 = sin_cos(x);
        const OffsetWrist<RootLanes> wrist = offset_wrist(arm_, motion, theta_7);
        const double reach = 1.0 / arm_.rest.reach;
        const RootLanes of_reach = wrist.excess * RootLanes(-reach),
                        of_fold = wrist.inside * RootLanes(reach * reach);
        const RootLanes fold(2.0 * ranges_.count);
        Margin out{min(of_reach, of_fold), select(of_reach < of_fold, fold + RootLanes(1.0), fold),
                   select(asked > fold, of_reach, of_fold),
                   (wrist.excess <= RootLanes(0.0)) & (wrist.inside >= RootLanes(0.0))};
        if (!any(out.least >= RootLanes(-tolerance::isolated))) return out;
        const Directions<RootLanes> d =
            directions(motion, wrist, theta_7, sqrt(max(wrist.inside, RootLanes(0.0))));
        for (int i = 0; i < ranges_.count; ++i) {
            const ThetaRanges::One& range = ranges_.one[i];
            const RootLanes off = wrap(atan2(d.y[range.joint], d.x[range.joint]) - RootLanes(range.middle));
            const RootLanes low(2.0 * i), high(2.0 * i + 1.0), half(range.half);
            const RootLanes room = half - abs(off);
            const RootLanes kept = select(room <= half, room, RootLanes(-1.0));  // NaN keeps nothing
            const auto less = kept < out.least;
            out.which = select(less, select(off < RootLanes(0.0), low, high), out.which);
            out.least = select(less, kept, out.least);
            out.asked = select(asked == low, half + off, select(asked == high, half - off, out.asked));
        }
        return out;
    }

    /// The tag of the limit with this number.
    Tag tag_of(double which) const noexcept {
        const int i = static_cast<int>(which) / 2;
        const bool second = static_cast<int>(which) % 2 != 0;
        if (i < ranges_.count) return second ? ranges_.one[i].high : ranges_.one[i].low;
        return make_tag(second ? 4 : 5, Side::near_singular);
    }

    /// Stores in `branch` whether each segment is within the limits, decided at its middle.
    void judge_segments(const Circle& circle, Branch& branch) const noexcept {
        const int n = circle.count > 0 ? circle.count : 1;
        int asked[8], count = 0;
        double x[8];
        const auto judge = [&] {
            for (int i = count; i < 8; ++i) x[i] = x[0];
            const Margin at = margin(branch.motion, RootLanes::load(x));
            const unsigned kept = bits(at.least >= RootLanes(0.0));
            branch.exists = branch.exists || any(at.exists);
            for (int i = 0; i < count; ++i) branch.inside[asked[i]] = (kept >> i & 1u) != 0;
            count = 0;
        };
        for (int i = 0; i < n; ++i) {
            branch.inside[i] = false;
            if (!circle.possible[i]) continue;
            asked[count] = i;
            x[count++] = middle_of(circle, i);
            if (count == 8) judge();
        }
        if (count > 0) judge();
    }

    // -- ends

    /// Adds to `branch` the ends of the segments inside, and isolated feasible values.
    void find_ends(const Circle& circle, Branch& branch) noexcept {
        End end[8];
        int count = 0;
        const auto ask = [&](int segment, bool is_lower) {
            const int place = is_lower ? segment : circle.behind(segment);
            const int beyond = is_lower ? circle.before(segment) : place;
            const double toward = is_lower ? 1.0 : -1.0, inner = circle.length[segment],
                         outer = circle.length[beyond];
            const double at_in = is_lower ? circle.place[place].upper : circle.place[segment].upper + inner;
            const double at_out = at_in - toward * (circle.place[place].upper - circle.place[place].lower);
            end[count++] = {at_in + toward * min(tuning_.beside, 0.25 * inner),
                            at_out - toward * min(tuning_.beside, 0.25 * outer),
                            at_in + toward * 0.5 * inner,
                            at_out - toward * 0.5 * outer,
                            segment,
                            is_lower};
            if (count < 8) return;
            refine_ends(end, count, branch);
            count = 0;
        };
        for (int i = 0; i < circle.count; ++i) {
            const Place& place = circle.place[i];
            const int before = circle.before(i);
            const bool in_before = branch.inside[before], in_behind = branch.inside[i];
            if (in_behind) {
                branch.lower[i] = place.upper;
                branch.lower_tag[i] = 0;
            }
            if (in_before) {
                branch.upper[before] = (before >= i ? place.lower + two_pi : place.lower);
                branch.upper_tag[before] = 0;
            }
            if (undecided(place)) {
                if (!in_before && !in_behind) find_alone(place, branch);
                continue;
            }
            if (in_before && in_behind) branch.lower[i] = place.lower;
            if (!in_before && in_behind) ask(i, true);
            if (in_before && !in_behind) ask(before, false);
            // roots at the very end of what joints 4 and 7 leave are not looked for
            const bool ends = circle.possible[before] != circle.possible[i];
            if (!in_before && !in_behind && (place.roots > 1 || ends)) find_alone(place, branch);
        }
        if (count > 0) refine_ends(end, count, branch);
    }

    /// Finds up to eight ends at once by regula falsi (Illinois) on the limit that is violated beyond each,
    /// and stores them in `branch`.
    void refine_ends(const End* end, int count, Branch& branch) const noexcept {
        double in[8], out[8];
        for (int i = 0; i < 8; ++i) {
            in[i] = end[i < count ? i : 0].inside;
            out[i] = end[i < count ? i : 0].outside;
        }
        const RootLanes zero(0.0), half(0.5);
        Margin beyond = margin(branch.motion, RootLanes::load(out));
        Margin here = margin(branch.motion, RootLanes::load(in), beyond.which);
        const auto between = (here.least >= zero) & (beyond.least < zero);
        if (!all(between)) {  // beside other roots: between the middles of the segments
            for (int i = 0; i < count; ++i) {
                if (between[i]) continue;
                in[i] = end[i].far_inside;
                out[i] = end[i].far_outside;
            }
            beyond = margin(branch.motion, RootLanes::load(out));
            here = margin(branch.motion, RootLanes::load(in), beyond.which);
        }
        RootLanes a = RootLanes::load(in), b = RootLanes::load(out), at = a;
        RootLanes f_a = here.asked, f_b = beyond.least, which = beyond.which;
        const RootLanes still(4.0 * tolerance::rounding);
        auto going = !(a == b);
        for (int step = 1; step <= tuning_.end_steps && any(going); ++step) {
            const RootLanes to = (a * f_b - b * f_a) / (f_b - f_a);
            auto falsi = ((to > a) & (to < b)) | ((to < a) & (to > b));
            if (step % tuning_.bisected == 0) falsi = falsi & !falsi;
            const RootLanes before = at;
            at = select(going, select(falsi, to, half * (a + b)), at);
            const Margin now = margin(branch.motion, at, which);
            const auto inside = (now.least >= zero) & going, outside = (now.least < zero) & going;
            const auto changed = outside & !(now.which == which);
            f_b = select(outside, now.least, select(inside, half * f_b, f_b));
            f_a = select(inside, now.asked, select(outside, half * f_a, f_a));
            a = select(inside, at, a);
            b = select(outside, at, b);
            which = select(outside, now.which, which);
            if (any(changed)) f_a = select(changed, margin(branch.motion, a, which).asked, f_a);
            going = going & (abs(at - before) > still) & (abs(a - b) > still) & !(now.least == zero);
        }
        // the last value may be outside while the bracket is wide: where two limits meet, or at a fold
        auto outside = margin(branch.motion, at).least < RootLanes(-tolerance::reach);
        while (any(outside)) {
            const RootLanes middle = half * (a + at);
            const auto inside = margin(branch.motion, middle).least >= zero;
            const auto wide = abs(a - at) > still;
            a = select(outside & inside, middle, a);
            at = select(outside & !inside, middle, at);
            at = select(outside & !wide, a, at);
            outside = outside & wide;
        }
        for (int i = 0; i < count; ++i) {
            const int k = end[i].segment;
            (end[i].is_lower ? branch.lower : branch.upper)[k] = at[i];
            (end[i].is_lower ? branch.lower_tag : branch.upper_tag)[k] = tag_of(which[i]);
        }
    }

    /// Searches a feasible value at a single place, where two limits meet or a joint is locked, and stores it
    /// in `branch` if there is one.
    void find_alone(const Place& place, Branch& branch) const noexcept {
        double lower = place.lower - tuning_.beside, upper = place.upper + tuning_.beside;
        double best = -infinity, value = lower;
        Margin at;
        for (int pass = 0; pass < tuning_.alone_looks; ++pass) {
            double x[8];
            for (int i = 0; i < 8; ++i) x[i] = lower + (upper - lower) * (i + 1) / 9.0;
            at = margin(branch.motion, RootLanes::load(x));
            int most = 0;
            for (int i = 1; i < 8; ++i)
                if (at.least[i] > at.least[most]) most = i;
            if (at.least[most] > best) {
                best = at.least[most];
                value = x[most];
            }
            if (best < -1e-3 || best >= 0) break;
            const double step = (upper - lower) / 9.0;
            lower = value - step;
            upper = value + step;
        }
        Directions<double> there;  // limits may be touched within their tolerance, but a posture must exist
        if (directions(arm_, exact_, to_q(value, arm_.rest.sign[6], arm_.rest.offset[6]), branch.gc, nullptr,
                       there) != Status::OK)
            return;
        branch.exists = true;
        if (!(best >= -tolerance::isolated)) return;
        const Tag tag = tag_of(at.which[0]);
        add(value, value, tag, tag, branch.pieces);
    }

    // -- what is undecided

    /// Decides an undecided place [lower, upper] of theta_7 by interval cells, as far as the budget allows;
    /// `branch` gets the parts inside and those that remain unproven.
    void judge_place(double lower, double upper, Branch& branch) noexcept {
        struct Cell {
            double lower, upper;
        };
        const double p = to_q(lower, arm_.rest.sign[6], arm_.rest.offset[6]),
                     q = to_q(upper, arm_.rest.sign[6], arm_.rest.offset[6]);
        OffsetJudge judge(arm_, exact_, branch.gc, ranges_);
        Cell queue[most_cells];  // the widest first
        int first = 0, last = 0;
        queue[last++] = {min(p, q), max(p, q)};
        while (first < last) {
            const Cell cell = queue[first++];
            const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
            OffsetCells::Over over;
            Piece piece;
            Known known = Known::open;
            const bool spent = branch.looks <= 0 || last + 2 > most_cells;
            if (!spent) {
                --branch.looks;
                known = judge.look(cell.lower, cell.upper, over, piece);
            }
            if (known == Known::inside) add_free(piece, branch.pieces);
            if (known != Known::open) continue;
            if (spent || half < tuning_.narrowest) {
                branch.unproven += cell.upper - cell.lower;
                add_free({cell.lower, cell.upper, 0, 0}, branch.open);
                continue;
            }
            queue[last++] = {cell.lower, middle};
            queue[last++] = {middle, cell.upper};
        }
        branch.exists = branch.exists || judge.refusal() == Status::LIMITS;
    }

    /// The reason why a branch has no solution.
    Status refusal(const Circle& circle, const Branch& branch) noexcept {
        if (branch.exists) return Status::LIMITS;
        if (!circle.within_reach) return Status::UNREACHABLE;
        // limits of joints 4 and 7 may hide the postures that there are
        const double elbow = branch.motion.branch.elbow;
        double place[64] = {-pi, pi};
        int count = 2;
        const auto put = [&](const RootEnclosure& root) {
            if (count < 64) place[count++] = 0.5 * (root.lower + root.upper);
        };
        for (const double end : {1.0, -1.0}) {
            trig_roots(forms_.bend(end), kappa_, elbow, -pi, pi, tuning_.roots, put);
            trig_roots(forms_.theta_5(end), kappa_, elbow, -pi, pi, tuning_.roots, put);
        }
        std::sort(place, place + count);
        for (int first = 0; first + 1 < count; first += 8) {
            double x[8];
            for (int i = 0; i < 8; ++i) {
                const int k = std::min(first + i, count - 2);
                x[i] = 0.5 * (place[k] + place[k + 1]);
            }
            if (any(margin(branch.motion, RootLanes::load(x)).exists)) return Status::LIMITS;
        }
        return Status::NO_POSTURE;
    }

    // -- pieces

    /// Adds a range of theta_7 (rad), on any multiple of 2 pi, to `pieces` as a range of the free joint.
    void add(double lower, double upper, Tag lower_tag, Tag upper_tag, Pieces& pieces) const noexcept {
        const double sign = arm_.rest.sign[6], p = to_q(lower, sign, arm_.rest.offset[6]),
                     q = to_q(upper, sign, arm_.rest.offset[6]);
        if (sign > 0)
            add_free({p, q, lower_tag, upper_tag}, pieces);
        else
            add_free({q, p, upper_tag, lower_tag}, pieces);
    }
    /// Adds a range of the free joint (rad), on any multiple of 2 pi, to `pieces`, cut at pi.
    static void add_free(Piece piece, Pieces& pieces) noexcept {
        const double start = wrap(piece.lower) >= pi ? -pi : wrap(piece.lower), by = start - piece.lower;
        piece.lower = start;
        piece.upper += by;
        if (!(piece.upper > pi)) return pieces.add(piece);
        pieces.add({-pi, piece.upper - two_pi, 0, piece.upper_tag});
        piece.upper = pi;
        piece.upper_tag = 0;
        pieces.add(piece);
    }

    const OffsetArm& arm_;
    const Pose<double> exact_;
    const OffsetArcsTuning& tuning_;
    const ThetaRanges limits_in_order_;
    ThetaRanges ranges_;  // with the singularity margin of the present branch
    const int joint_;
    const LimitForms forms_;
    const TrigPolynomial kappa_;
    int limits_ = 0, looks_;
    Limit limit_[most_forms];
    Circle circle_[2];
};

}  // namespace detail

/// Computes the values of the free joint (rad) at which branch gc solves a pose within limits in the robot's
/// order of joints, and keeps the arm's singularity margin; of that only the part of one joint, if `joint`
/// (0..6) is given. The status says why there are none. The tags name joints of the formulas (see
/// in_robot_order).
inline void feasible(const OffsetArm& arm, const Pose<double>& pose, int gc, const Limits& limits,
                     ProvenArcs& out, const OffsetArcsTuning& tuning = {}, int joint = -1) noexcept {
    detail::OffsetArcs(arm, pose, limits, tuning, joint).find(gc, 1, out);
}

/// Computes the values of the free joint at which branch gc solves a pose within the arm's own limits.
inline void feasible(const OffsetArm& arm, const Pose<double>& pose, int gc, ProvenArcs& out) noexcept {
    feasible(arm, pose, gc, arm.own.limits, out);
}

/// Computes the values of the free joint at which each branch solves a pose within limits, as feasible()
/// does; all share the roots.
inline void feasible_all(const OffsetArm& arm, const Pose<double>& pose, const Limits& limits,
                         ProvenArcs (&out)[configurations], const OffsetArcsTuning& tuning = {}) noexcept {
    detail::OffsetArcs all(arm, pose, limits, tuning);
    for (int gc = 0; gc < configurations; ++gc) all.find(gc, configurations - gc, out[gc]);
}

/// The same arcs, with tags that name the robot's joints instead of those of the formulas.
inline ArcSet in_robot_order(const OffsetArm& arm, ArcSet arcs) noexcept {
    const auto named = [&arm](Tag tag) {
        const int joint = tag_joint(tag);
        return joint == 0 ? tag : make_tag(robot_joint(arm, joint - 1) + 1, tag_side(tag));
    };
    for (int i = 0; i < arcs.count; ++i) {
        arcs.arc[i].lower_tag = named(arcs.arc[i].lower_tag);
        arcs.arc[i].upper_tag = named(arcs.arc[i].upper_tag);
    }
    return arcs;
}

/// The value q (rad) of the robot's joint in `tag`, which causes an end of an arc at the value `free` of the
/// free joint; NaN if the tag names no joint.
inline double end_value(const OffsetArm& arm, const Pose<double>& pose, int gc, Tag tag,
                        double free) noexcept {
    const int joint = tag_joint(tag) - 1;
    if (joint < 0) return not_a_number;
    if (tag_side(tag) == Side::lower) return arm.own.limits.lower[joint];
    if (tag_side(tag) == Side::upper) return arm.own.limits.upper[joint];
    return inverse(arm, pose, free, gc).q[joint];
}

}  // namespace armangle

#include "../names/end.hpp"
