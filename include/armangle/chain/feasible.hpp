// Feasible arcs of a nearly S-R-S arm: stretches of psi proven to keep the limits, or to break one.
//
//     |--inside--|--?--|--outside--|--?--|--inside--|
//                   ^ root            ^ root
//
// Limits are functions of psi that the corrected motion knows within a slack: where they are farther from 0
// all is said, and what is open are stretches about the ends. Those are looked at again about their own
// middle, where the slack is less, or in a hull, in which a joint comes to its limit once. What stays open is
// halved, in rounds over all of the circle, and at last left out. Where a function of a limit is proven to
// rise or to fall over all of such a stretch, its end is found at once and nothing more is looked at.
//
// An end is the psi at which the true joint is at its limit, to ChainInverseTuning::residual. What is proven
// neither way (beside a singularity, where branches merge and a psi may have two postures) is left out, and
// its measure is counted.
#pragma once

#include "../self_motion/pieces.hpp"
#include "corrected_motion.hpp"
#include "hull.hpp"
#include "meeting_share.hpp"
#include "posture_trail.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the proven arcs of a chain.
struct ChainArcsTuning {
    static constexpr int cells = 16;  // of a circle of which nothing is known to begin with
    static constexpr double widest_ball =
        0.2;  // rad: half width of a stretch that is looked at about its middle
    static constexpr double widest_hull = 0.05;  // rad: wider ones are hardly ever proven
    static constexpr int rounds = 3;             // over what is left of the circle
    static constexpr double narrowest[rounds] = {5e-3, 1e-3,
                                                 1e-4};  // rad: half width that is left to the next
    static constexpr double shrunk = 0.7;  // of a stretch: what is open then is worth another look as it is
    static constexpr int looks[rounds] = {800, 1000, 1200};  // of one pose and branch, all rounds together
    static constexpr double beside = 2.0;  // half widths: what lies that near to a stretch is its neighbour
    static constexpr double given_up = 1e-2;  // rad: half width of a stretch that has two postures of a psi
    static constexpr int depth = 24;          // looks within looks; narrowest is reached before
    static constexpr int root_steps = 8;
};

namespace detail {

/// The sections of a stretch by rising psi: each is inside the limits, outside, or undecided with the
/// conditions that are undecided.
struct Sections {
    using Open = unsigned;  // a bit each range; then one each hinge, beside which a posture may not be
    static constexpr int conditions = ThetaRanges::capacity + hinges;
    static constexpr int capacity = 8 * conditions + 1;
    struct Section {
        double lower, upper;
        Known known;
        Open open;
        Open low, high;  // of the open ones: which of their two functions
    };
    int count = 0;
    Section section[capacity];
};

/// The conditions of a motion that are tested, each with its bit.
struct AskedConditions {
    int count = 0;
    int bit[Sections::conditions];
    CorrectedMotion<double>::Condition condition[Sections::conditions];
};
inline constexpr Sections::Open hinge_bit = 1u << ThetaRanges::capacity;

/// Whether theta_2, theta_4 - delta and theta_6 keep the signs of the branch all over a hull.
inline bool keeps_branch(const Arm& nominal, const Configuration<double>& gc,
                         const Hull<double>& hull) noexcept {
    const double zero[] = {0.0, nominal.delta_angle, 0.0}, side[] = {gc.shoulder, gc.elbow, gc.wrist};
    for (int i = 0; i < 3; ++i) {
        const int j = 2 * i + 1;
        const double off = side[i] * wrap(hull.theta[j] - zero[i]), reach = hull.reach(j);
        if (!(off > reach && off + reach < pi)) return false;
    }
    return true;
}

/// Computes the feasible arcs of one pose and branch.
class ArcProof {
public:
    /// Keeps references to a pose in a branch and the joint ranges; only_joint (0..6) restricts the limits to
    /// one joint, -1: all.
    ArcProof(const ChainArm& arm, const Pose<double>& pose, const Triad<double>& on,
             const Configuration<double>& gc, const ThetaRanges& ranges, int only_joint) noexcept
        : arm_(arm),
          pose_(pose),
          on_(on),
          gc_(gc),
          ranges_(ranges),
          only_(only_joint),
          trail_(arm, pose, on, gc) {}

    /// Writes the arcs of psi that are proven feasible to `out`, with the length that remains unproven;
    /// empty, with the reason in its status, if there are none.
    void run(ProvenArcs& out) noexcept {
        const CorrectedMotion<double> all = motion_around(arm_, pose_, on_, gc_);
        Open every = hinge_bit | hinge_bit << 1;
        for (int i = 0; i < ranges_.count; ++i)
            if (only_ < 0 || ranges_.one[i].joint == only_) every |= 1u << i;
        if (all.usable()) {
            Sections sections;
            AskedConditions asked;
            part(all, every, -pi, pi, asked, sections);
            decide_sections(all, asked, sections);
        } else {
            for (int k = ChainArcsTuning::cells; k > 0; --k)
                open({-pi + two_pi * (k - 1) / ChainArcsTuning::cells,
                      -pi + two_pi * k / ChainArcsTuning::cells, every, 0});
        }
        decide_all();
        // the whole circle is looked at before any place of it takes all looks
        while (left_.count > 0 && ++round_ < ChainArcsTuning::rounds) {
            while (left_.count > 0) open(left_.stretch[--left_.count]);
            decide_all();
        }
        double beyond = 0;
        pieces_.finish(out.arcs, beyond);
        out.unproven = unproven_ + beyond;
        open_.finish(out.open, beyond);
        if (beyond > 0) make_full(out.open);  // it is not known where
        out.status = Status::OK;
        if (!out.arcs.empty()) return;
        out.status = out.unproven > 0 ? Status::NEAR_SINGULAR : Status::LIMITS;
        if (out.unproven == 0 && only_elbow_ && elbow_blocks_ != 0)
            out.status =
                tag_side(elbow_blocks_) >= Side::near_margin ? Status::ELBOW_MARGIN : Status::ELBOW_LIMIT;
    }

private:
    using Open = Sections::Open;
    static constexpr int several = register_width;
    using Several = Lane<several>;
    using Condition = CorrectedMotion<double>::Condition;

    /// An undecided stretch, its undecided conditions, and the number of divisions that led to it.
    struct Stretch {
        double lower, upper;
        Open open;
        int depth;

        double middle() const noexcept { return 0.5 * (lower + upper); }
        double half() const noexcept { return 0.5 * (upper - lower); }
    };
    template <int Capacity>
    struct Stretches {
        static constexpr int capacity = Capacity;
        int count = 0;
        Stretch stretch[Capacity];
    };

    /// An end to be computed in a hull: where joint j (0..6, `joint`) has the angle theta.
    struct End {
        int of, joint;
        double theta;
        bool lower;
        Tag tag;
    };

    /// Divides [lower, upper] into sections in which none of the conditions `asked` (bits) of the motion
    /// changes, and writes them to `out`; `conditions` gets these conditions.
    void part(const CorrectedMotion<double>& motion, Open asked, double lower, double upper,
              AskedConditions& conditions, Sections& out) noexcept {
        Condition(&condition)[Sections::conditions] = conditions.condition;
        int (&bit)[Sections::conditions] = conditions.bit;
        int& n = conditions.count;
        int ends = 0;
        n = 0;
        double at[Sections::capacity + 1];
        for (int i = 0; i < ranges_.count; ++i) {
            if (!(asked >> i & 1)) continue;
            const ThetaRanges::One& r = ranges_.one[i];
            bit[n] = i;
            condition[n++] = motion.condition(r.joint, r.middle - r.half, r.middle + r.half);
        }
        for (int h = 0; h < hinges; ++h) {
            if (!(asked & hinge_bit << h)) continue;
            bit[n] = ThetaRanges::capacity + h;
            condition[n++] = motion.regular(h);
        }
        const auto add = [&](double psi) {
            int k = ends++;
            for (; k > 0 && at[k - 1] > psi; --k) at[k] = at[k - 1];
            at[k] = psi;
        };
        add(lower);
        add(upper);
        Slackened side[2 * Sections::conditions];
        int sides = 0;
        for (int i = 0; i < n; ++i) {
            const Condition& c = condition[i];
            side[sides++] = {c.low, c.low_slack, c.limit};
            side[sides++] = {c.high, c.high_slack, c.limit};
        }
        for (int i = 0; i < sides; i += several)
            add_crossings(side + i, min_of(several, sides - i), lower, upper, add);
        out.count = 0;
        for (int k = 0; k + 1 < ends; k += several)
            tell(condition, bit, n, at + k, min_of(several, ends - 1 - k), out);
    }

    /// One side of a condition: a harmonic function that is known within a slack.
    struct Slackened {
        Harmonic<double> f;
        double slack;
        bool limit;
    };

    /// The lesser number.
    static constexpr int min_of(int a, int b) noexcept { return a < b ? a : b; }

    /// Calls add(psi) for the psi in (lower, upper) at which some of the functions reach plus or minus their
    /// slack.
    template <class Add>
    static void add_crossings(const Slackened* side, int count, double lower, double upper,
                              const Add& add) noexcept {
        double s[several] = {}, c[several] = {}, k[several] = {}, slack[several] = {};
        for (int i = 0; i < count; ++i) {
            s[i] = side[i].f.s;
            c[i] = side[i].f.c;
            k[i] = side[i].f.k;
            slack[i] = side[i].slack;
        }
        Harmonic<Several> f{Several::load(s), Several::load(c), Several::load(k)};
        const Several h = hypot(f.s, f.c), middle = atan2(f.s, f.c), constant = f.k;
        for (const bool beyond : {false, true}) {
            const Several by = Several::load(slack);
            f.k = beyond ? constant + by : constant - by;
            const Several half = half_between_roots(f, h), about(0.5 * (lower + upper));
            const Several one = lift(middle - half, about), other = lift(middle + half, about);
            const Several low(lower), high(upper);
            const auto some = has_roots(f, h);
            const unsigned first = bits(some & (one > low) & (one < high)),
                           second = bits(some & (other > low) & (other < high));
            for (int i = 0; i < count; ++i) {
                if (beyond && !side[i].limit) continue;
                if (first >> i & 1) add(one[i]);
                if (second >> i & 1) add(other[i]);
            }
        }
    }

    /// Decides the sections between consecutive ends by the conditions at their middles.
    void tell(const Condition* condition, const int* bit, int n, const double* at, int count,
              Sections& out) noexcept {
        double middle[several];
        for (int k = 0; k < several; ++k) {
            const int i = k < count ? k : count - 1;
            middle[k] = 0.5 * (at[i] + at[i + 1]);
        }
        const SinCos<Several> psi = sin_cos(Several::load(middle));
        Open is_open[several] = {}, broken[several] = {}, low[several] = {}, high[several] = {};
        for (int i = 0; i < n; ++i) {
            const Condition::Decided decided = condition[i].at(psi);
            for_each_bit(decided.outside & ((1u << count) - 1), [&](int k) { broken[k] |= 1u << bit[i]; });
            for_each_bit(~(decided.outside | decided.inside) & ((1u << count) - 1), [&](int k) {
                is_open[k] |= 1u << bit[i];
                low[k] |= (decided.low_open >> k & 1) << bit[i];
                high[k] |= (decided.high_open >> k & 1) << bit[i];
            });
        }
        for (int k = 0; k < count; ++k) {
            if (!(at[k] < at[k + 1])) continue;
            Sections::Section now{at[k], at[k + 1], Known::inside, is_open[k], low[k], high[k]};
            if (is_open[k] != 0) now.known = Known::open;
            if (broken[k] != 0) now = {at[k], at[k + 1], Known::outside, 0, 0, 0};
            block(broken[k]);
            Sections::Section* last = out.count > 0 ? &out.section[out.count - 1] : nullptr;
            if (last && last->known == now.known) {  // what is open together is looked at together
                last->upper = now.upper;
                last->open |= now.open;
                last->low |= now.low;
                last->high |= now.high;
            } else {
                out.section[out.count++] = now;
            }
        }
    }

    /// Records which conditions exclude a stretch, to report whether joint 4 alone excludes the pose.
    void block(Open broken) noexcept {
        if (broken == 0) return;
        Tag by_elbow = 0;
        for (int i = 0; i < ranges_.count; ++i)
            if ((broken >> i & 1) && ranges_.one[i].joint == 3) by_elbow = ranges_.one[i].low;
        if (by_elbow == 0) only_elbow_ = false;
        elbow_blocks_ = by_elbow;
    }

    /// Keeps the sections inside, and the undecided ones for another look; their psi counts from `origin`.
    void take(const Sections& parts, double origin, int depth) noexcept {
        for (int i = parts.count - 1; i >= 0; --i) {
            const Sections::Section& one = parts.section[i];
            if (one.known == Known::inside) pieces_.add({origin + one.lower, origin + one.upper, 0, 0});
            if (one.known == Known::open) open({origin + one.lower, origin + one.upper, one.open, depth});
        }
    }

    /// An end to be computed in a section: where joint j (0..6, `joint`) has the angle theta (or theta + pi);
    /// f is the function of its limit.
    struct Crossing {
        int of, joint;
        double theta;
        Tag tag, opposite_tag;
        bool either;  // with the next one: the range is kept where one of both is
        Harmonic<double> f;
    };

    /// Appends the undecided functions of a joint's range in a section, at most two, to `out` and counts them
    /// in `count`; false for joint 4, whose ends are not computed this way.
    static bool crossings_of(const ThetaRanges::One& range, const Condition& c, bool low, bool high,
                             double side, int of, Crossing* out, int& count) noexcept {
        if (range.joint == 3) return false;
        // a hinge's functions are of |theta|
        const bool mirrored = range.joint % 4 == 1 && side < 0, both = low && high && c.either;
        const double first = mirrored ? range.half : -range.half;
        const Tag tag = mirrored ? range.high : range.low, other = mirrored ? range.low : range.high;
        const bool opposite =
            abs(2.0 * range.half - pi) < tolerance::angle;  // either limit is the other's end
        if (low)
            out[count++] = {of, range.joint, range.middle + first, tag, opposite ? other : tag, both, c.low};
        if (high)
            out[count++] = {of,    range.joint, range.middle - first, other, opposite ? tag : other,
                            false, c.high};
        return true;
    }

    /// Keeps the sections inside, and computes ends in the undecided ones, several at once.
    void decide_sections(const CorrectedMotion<double>& all, const AskedConditions& asked,
                         const Sections& parts) noexcept {
        constexpr int most = 2 * several + 2;
        Crossing crossing[most];
        int count = 0, pending[several], waiting = 0;
        const auto cut_waiting = [&] {
            if (waiting > 0) cut_at_crossings(all, parts, pending, waiting, crossing, count);
            count = waiting = 0;
        };
        for (int i = 0; i < parts.count; ++i) {
            const Sections::Section& one = parts.section[i];
            if (one.known == Known::inside) pieces_.add({one.lower, one.upper, 0, 0});
            if (one.known != Known::open) continue;
            const int before = count;
            bool decided = one.open < hinge_bit;
            for (int k = 0; decided && k < asked.count; ++k) {
                const int bit = asked.bit[k];
                if (!(one.open >> bit & 1)) continue;
                const int joint = ranges_.one[bit].joint;
                decided = crossings_of(ranges_.one[bit], asked.condition[k], one.low >> bit & 1,
                                       one.high >> bit & 1, joint == 1 ? gc_.shoulder : gc_.wrist, waiting,
                                       crossing, count) &&
                          count - before <= several;
            }
            if (!decided) {
                count = before;
                open({one.lower, one.upper, one.open, 0});
                continue;
            }
            if (count > several) {  // those before go first
                Crossing mine[several];
                const int n = count - before;
                for (int k = 0; k < n; ++k) mine[k] = crossing[before + k];
                count = before;
                cut_waiting();
                for (; count < n; ++count) {
                    crossing[count] = mine[count];
                    crossing[count].of = 0;
                }
            }
            pending[waiting++] = i;
        }
        cut_waiting();
    }

    /// Cuts sections at computed ends: one for each function, if it is proven to be monotonic over the
    /// section. The true function differs from that of the motion's centre by a slowly changing amount.
    void cut_at_crossings(const CorrectedMotion<double>& all, const Sections& parts, const int* pending,
                          int sections, const Crossing* crossing, int count) noexcept {
        double s[several], c[several], k[several], target[several], section_lower[several],
            section_upper[several];
        int joint[several];
        bool of_shoulder[several];
        for (int i = 0; i < several; ++i) {
            const Crossing& one = crossing[i < count ? i : count - 1];
            const Sections::Section& section = parts.section[pending[one.of]];
            s[i] = one.f.s;
            c[i] = one.f.c;
            k[i] = one.f.k;
            target[i] = one.theta;
            joint[i] = one.joint;
            of_shoulder[i] = one.joint < 3;
            section_lower[i] = section.lower;
            section_upper[i] = section.upper;
        }
        const Harmonic<Several> f{Several::load(s), Several::load(c), Several::load(k)};
        const Several lower = Several::load(section_lower), upper = Several::load(section_upper),
                      about = Several(0.5) * (lower + upper);
        const Several size = hypot(f.s, f.c), top = atan2(f.s, f.c), half = half_between_roots(f, size);
        const Several one = lift(top - half, about), other = lift(top + half, about);
        Several psi = select(abs(one - about) < abs(other - about), one, other);
        auto good = has_roots(f, size);
        SinCos<Several> angle[joints];
        const Triad<Several> on = spread<Several>(on_);
        const Configuration<Several> gc = spread<Several>(gc_);
        nominal_posture(arm_.nominal, spread<Several>(flange_pose(arm_.nominal, pose_)),
                        PsiPlane<Several>(on, sin_cos(psi)), gc, angle);
        // where a function vanishes its joint is at the limit, or half a turn from it
        SinCos<Several> wanted = sin_cos(Several::load(target));
        const Several along = wanted.cos * of_joints(joint, [&](int j) { return angle[j].cos; }) +
                              wanted.sin * of_joints(joint, [&](int j) { return angle[j].sin; });
        const auto opposite = along < Several(0.0);
        wanted = {select(opposite, -wanted.sin, wanted.sin), select(opposite, -wanted.cos, wanted.cos)};
        good = good & lead(joint, wanted, good, angle, psi);
        good = good & is_of(arm_.nominal, PsiPlane<Several>(on, sin_cos(psi)), gc, angle);
        const Several from = min(lower, psi), to = max(upper, psi);
        const Several middle = Several(0.5) * (from + to), reach = Several(0.5) * (to - from);
        PoseRate<Several> x;
        good = good & (reach < Several(1.0)) & all.pose_rate(arm_, middle, reach, x);
        const SinCos<Several> at = sin_cos(middle), by = sin_cos(reach);
        const Several slope = f.s * at.cos - f.c * at.sin, bend = f.s * at.sin + f.c * at.cos;
        good = good & (abs(slope) * by.cos - abs(bend) * by.sin > all.drift(of_shoulder, x));
        Piece piece[several], hole[several];
        bool fails[several] = {}, has_hole[several] = {};
        for (int i = 0; i < sections; ++i) {
            const Sections::Section& of = parts.section[pending[i]];
            piece[i] = {of.lower, of.upper, 0, 0};
        }
        const unsigned found = bits(good), rising = bits(slope > Several(0.0)), turned = bits(opposite);
        const auto tag = [&](int i) { return turned >> i & 1 ? crossing[i].opposite_tag : crossing[i].tag; };
        for (int i = 0; i < count; ++i) {
            const int n = crossing[i].of;
            const bool both = crossing[i].either;
            if (!(found >> i & 1) || (both && !(found >> (i + 1) & 1))) {
                fails[n] = true;
                i += both;
                continue;
            }
            if (!both) {
                cut_piece(piece[n], psi[i], rising >> i & 1, tag(i));
                continue;
            }
            // kept where either function is: less is cut of two that go the same way, and a hole else
            const int next = i + 1, first = psi[i] < psi[next] ? i : next, last = first == i ? next : i;
            const bool first_rises = rising >> first & 1, last_rises = rising >> last & 1;
            if (first_rises == last_rises) {
                const int kept = first_rises ? first : last;
                cut_piece(piece[n], psi[kept], first_rises, tag(kept));
            } else if (last_rises) {
                fails[n] = fails[n] || has_hole[n];
                has_hole[n] = true;
                hole[n] = {psi[first], psi[last], tag(first), tag(last)};
            }
            ++i;
        }
        for (int i = 0; i < sections; ++i) {
            const Sections::Section& of = parts.section[pending[i]];
            if (fails[i]) {
                open({of.lower, of.upper, of.open, 0});
                continue;
            }
            only_elbow_ = false;
            Piece behind = piece[i];
            if (has_hole[i]) {
                cut_piece(piece[i], hole[i].lower, false, hole[i].lower_tag);
                cut_piece(behind, hole[i].upper, true, hole[i].upper_tag);
                pieces_.add(behind);
            }
            pieces_.add(piece[i]);
        }
    }

    /// Cuts off the part of a piece below psi, or above it, and sets the tag of the new end.
    static void cut_piece(Piece& piece, double psi, bool below, Tag tag) noexcept {
        if (below && psi > piece.lower) {
            piece.lower = psi;
            piece.lower_tag = tag;
        } else if (!below && psi < piece.upper) {
            piece.upper = psi;
            piece.upper_tag = tag;
        }
    }

    /// Moves postures by Newton's method until joint[i] has its wanted angle, with psi free; returns which of
    /// them converge.
    LaneMask<several> lead(const int (&joint)[several], const SinCos<Several>& wanted,
                           LaneMask<several> going, SinCos<Several>* angle, Several& psi) const noexcept {
        const Pose<Several> pose = spread<Several>(pose_);
        const Triad<Several> on = spread<Several>(on_);
        auto there = Several(1.0) < Several(0.0);
        for (int pass = 0; pass < ChainArcsTuning::root_steps; ++pass) {
            const PsiPlane<Several> plane(on, sin_cos(psi));
            const SevenEquations<Several> now = seven_equations(arm_, pose, plane, angle);
            const Several gap = gap_to(wanted, joint, angle);
            there = there | (going & (now.size() <= Several(ChainInverseTuning::residual)) &
                             (abs(gap) <= Several(ChainInverseTuning::residual)));
            going = going & !there;
            if (!any(going)) break;
            const Reduced<Several> to(now);
            Several straight[joints], sideways[joints];
            to.solve(now.left, straight);
            to.solve({{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, dot(plane.along, elbow_axis(angle))}, sideways);
            const Several by = (gap - of_joints(joint, [&](int j) { return straight[j]; })) /
                               of_joints(joint, [&](int j) { return sideways[j]; });
            going = going & (abs(by) < Several(ChainInverseTuning::largest_step));
            for (int j = 0; j < joints; ++j)
                straight[j] = select(going, straight[j] + by * sideways[j], Several(0.0));
            turn_by(straight, angle);
            psi = psi + select(going, by, Several(0.0));
        }
        return there;
    }

    /// For each lane the value of its joint.
    template <class Get>
    ARMANGLE_INLINE static Several of_joints(const int (&joint)[several], const Get& get) noexcept {
        Several row[joints], out;
        for (int j = 0; j < joints; ++j) row[j] = get(j);
        for (int i = 0; i < several; ++i) out.set(i, row[joint[i]][i]);
        return out;
    }

    /// For each lane the wanted angle minus that of its joint (rad).
    ARMANGLE_INLINE static Several gap_to(const SinCos<Several>& wanted, const int (&joint)[several],
                                          const SinCos<Several>* angle) noexcept {
        const Several s = of_joints(joint, [&](int j) { return angle[j].sin; }),
                      c = of_joints(joint, [&](int j) { return angle[j].cos; });
        return atan2(wanted.sin * c - wanted.cos * s, wanted.cos * c + wanted.sin * s);
    }

    /// Keeps a stretch to be examined in this round; if there is no memory, in the next.
    void open(const Stretch& one) noexcept {
        if (next_.count == next_.capacity) return leave(one);
        next_.stretch[next_.count++] = one;
    }

    /// Keeps a stretch for the next round; in the last one it is left unproven.
    void leave(const Stretch& one) noexcept {
        if (round_ + 1 < ChainArcsTuning::rounds && left_.count < left_.capacity) {
            left_.stretch[left_.count] = one;
            left_.stretch[left_.count++].depth = 0;
            return;
        }
        give_up(one);
    }

    /// Counts a stretch as unproven.
    void give_up(const Stretch& one) noexcept {
        unproven_ += one.upper - one.lower;
        open_.add({one.lower, one.upper, 0, 0});
    }

    /// Keeps both halves of a stretch to be examined, or a narrow stretch for the next round.
    void halve(const Stretch& one) noexcept {
        const double middle = one.middle();
        const bool narrow =
            one.upper - middle < ChainArcsTuning::narrowest[round_] || one.depth > ChainArcsTuning::depth;
        if (narrow || looks_ >= ChainArcsTuning::looks[round_]) return leave(one);
        open({middle, one.upper, one.open, one.depth + 1});
        open({one.lower, middle, one.open, one.depth + 1});
    }

    /// Examines undecided stretches, several at once, until none is left in this round.
    void decide_all() noexcept {
        while (next_.count > 0) {
            Stretch now[several];
            int count = 0;
            while (next_.count > 0 && count < several) {
                const Stretch one = next_.stretch[--next_.count];
                const bool spent =
                    one.depth > ChainArcsTuning::depth || looks_ >= ChainArcsTuning::looks[round_];
                if (spent || one.half() > ChainArcsTuning::widest_ball) {
                    halve(one);
                    continue;
                }
                ++looks_;
                now[count++] = one;
            }
            if (count > 0) decide(now, count);
        }
    }

    /// Decides some stretches by bounds of the joints over them, or halves those that it cannot decide.
    void decide(const Stretch* now, int count) noexcept {
        double middle[several], half[several];
        for (int k = 0; k < several; ++k) {
            const Stretch& one = now[k < count ? k : count - 1];
            middle[k] = one.middle();
            half[k] = one.half();
        }
        const Several psi = Several::load(middle);
        const PsiPlane<Several> plane(spread<Several>(on_), sin_cos(psi));
        const Pose<Several> pose = spread<Several>(pose_);
        bool is_found[several], is_decided[several] = {}, some_narrow = false;
        const Found<Several> found = trail_.find(middle, count, plane, is_found);
        const Several share = meeting_share(arm_, pose, plane, found.angle);
        for (int k = 0; k < count; ++k) some_narrow |= is_found[k] && half[k] <= ChainArcsTuning::widest_hull;
        if (some_narrow) {
            Hull<Several> hull;
            const auto proven = prove_hull(arm_, pose, plane, found.angle, psi, Several::load(half), hull);
            bool by_hull[several];
            for (int k = 0; k < several; ++k)
                by_hull[k] = k < count && is_found[k] && half[k] <= ChainArcsTuning::widest_hull && proven[k];
            decide_by_hulls(now, by_hull, hull, found, share, is_decided);
        }
        give_up_deep(middle, half, now, count, is_found, share, is_decided);
        bool by_motion[several] = {}, some_by_motion = false;
        for (int k = 0; k < count; ++k) {
            const bool second =
                !(share[k] < MeetingShareTuning::alone) && half[k] < ChainArcsTuning::given_up;
            by_motion[k] = !is_decided[k] && is_found[k] && !second;
            some_by_motion |= by_motion[k];
            if (!is_decided[k] && is_found[k] && second) give_up(now[k]);
        }
        if (!some_by_motion) {
            for (int k = count - 1; k >= 0; --k)
                if (!is_decided[k] && !is_found[k]) halve(now[k]);
            return;
        }
        Coarse<Several> over;
        const CorrectedMotion<Several> motions = motion_about(
            arm_, spread<Several>(on_), plane, found.angle, spread<Several>(gc_), Several::load(half), over);
        for (int k = count - 1; k >= 0; --k) {
            if (is_decided[k]) continue;
            if (!is_found[k])
                halve(now[k]);
            else if (by_motion[k])
                decide_by_motion(now[k], motions, over, k, share[k]);
        }
    }

    /// Leaves stretches unproven, and marks them in `is_decided`, where no unique posture is found there nor
    /// in their neighbours.
    void give_up_deep(const double (&middle)[several], const double (&half)[several], const Stretch* now,
                      int count, const bool (&is_found)[several], const Several& share,
                      bool (&is_decided)[several]) noexcept {
        bool unresolvable[several] = {};
        for (int k = 0; k < count; ++k)
            unresolvable[k] = !is_decided[k] && (!is_found[k] || !(share[k] < MeetingShareTuning::alone));
        for (int k = 0; k < count; ++k) {
            bool deep = unresolvable[k] && half[k] <= ChainArcsTuning::widest_hull, some_adjacent = false;
            for (int i = 0; i < count && deep; ++i) {
                if (i == k || abs(middle[i] - middle[k]) > ChainArcsTuning::beside * (half[i] + half[k]))
                    continue;
                some_adjacent = true;
                deep = unresolvable[i];
            }
            if (!deep || !some_adjacent) continue;
            is_decided[k] = true;
            give_up(now[k]);
        }
    }

    /// Decides a stretch, or parts of it, by the motion about the posture at its middle.
    void decide_by_motion(const Stretch& now, const CorrectedMotion<Several>& motions,
                          const Coarse<Several>& over, int k, double share) noexcept {
        const double middle = now.middle(), half = now.half();
        if (!motions.usable()[k]) return halve(now);
        double theta[joints], reach[joints];
        for (int j = 0; j < joints; ++j) {
            theta[j] = over.theta[j][k];
            reach[j] = over.reach[j][k];
        }
        if (!is_alone(arm_.nominal, share, theta, reach)) return halve(now);
        const CorrectedMotion<double> motion(motions, k);
        Sections parts;
        AskedConditions asked;
        part(motion, now.open, -half, half, asked, parts);
        for (int i = 0; i < parts.count; ++i) {
            const Sections::Section& one = parts.section[i];
            const bool wide = one.upper - one.lower > 2.0 * ChainArcsTuning::shrunk * half;
            if (wide && one.known == Known::open) return halve(now);
        }
        take(parts, middle, now.depth + 1);
    }

    /// Decides stretches by hulls around the postures at their middles and marks them in `is_decided`, where
    /// the hulls decide everything.
    void decide_by_hulls(const Stretch* now, const bool (&by_hull)[several], const Hull<Several>& hulls,
                         const Found<Several>& found, const Several& share,
                         bool (&is_decided)[several]) noexcept {
        Piece piece[several];
        End end[several];
        int ends = 0;
        bool fails[several] = {};
        const auto find_ends = [&] {
            if (ends > 0) cut(end, ends, hulls, found, piece, fails);
            ends = 0;
        };
        for (int k = 0; k < several; ++k) {
            if (!by_hull[k]) continue;
            const Hull<double> hull = lane(hulls, k);
            double reaches[joints];
            for (int j = 0; j < joints; ++j) reaches[j] = hull.reach(j);
            fails[k] = !keeps_branch(arm_.nominal, gc_, hull) ||
                       !is_alone(arm_.nominal, share[k], hull.theta, reaches);
            Open undecided = 0, broken = 0;
            for (int i = 0; i < ranges_.count && !fails[k]; ++i) {
                if (!(now[k].open >> i & 1)) continue;
                const ThetaRanges::One& r = ranges_.one[i];
                const double off = abs(wrap(hull.theta[r.joint] - r.middle)), reach = reaches[r.joint];
                if (off - reach > r.half)
                    broken |= 1u << i;
                else if (!(off + reach <= r.half))
                    undecided |= 1u << i;
            }
            block(broken);
            piece[k] = {now[k].lower, now[k].upper, 0, 0};
            is_decided[k] = broken != 0;
            if (is_decided[k]) continue;
            for (int i = 0; i < ranges_.count && !fails[k]; ++i) {
                if (!(undecided >> i & 1)) continue;
                if (ends + 2 > several) find_ends();
                fails[k] = fails[k] || !ends_of(ranges_.one[i], hull, k, end, ends);
            }
            if (undecided != 0 && !fails[k]) only_elbow_ = false;
        }
        find_ends();
        for (int k = 0; k < several; ++k) {
            if (!by_hull[k] || is_decided[k] || fails[k]) continue;
            pieces_.add(piece[k]);
            is_decided[k] = true;
        }
    }

    /// Appends where a joint reaches the ends of its range in a hull, each at most once, to `end`, counted in
    /// `count`; false if the hull does not determine that.
    static bool ends_of(const ThetaRanges::One& range, const Hull<double>& hull, int k, End* end,
                        int& count) noexcept {
        const int j = range.joint;
        const double slope = hull.slope[j], reach = hull.reach(j), off = wrap(hull.theta[j] - range.middle);
        if (!(abs(slope) > hull.slope_radius[j])) return false;
        if (!(abs(off) + reach < two_pi - range.half)) return false;  // it may come in again from behind
        const bool rising = slope > 0;
        if (off - reach < -range.half) end[count++] = {k, j, range.middle - range.half, rising, range.low};
        if (off + reach > range.half) end[count++] = {k, j, range.middle + range.half, !rising, range.high};
        return true;
    }

    /// Computes the ends by Newton's method, all at once, and cuts each hull's `piece` at them; `fails` tells
    /// for which hulls that fails. An end beside its hull cuts nothing.
    void cut(const End* end, int count, const Hull<Several>& hulls, const Found<Several>& found, Piece* piece,
             bool (&fails)[several]) const noexcept {
        int of[several], joint[several];
        double target[several];
        for (int i = 0; i < several; ++i) {
            const End& one = end[i < count ? i : count - 1];
            of[i] = one.of;
            joint[i] = one.joint;
            target[i] = one.theta;
        }
        const auto of_hulls = [&](const Several& row) {
            Several out;
            for (int i = 0; i < several; ++i) out.set(i, row[of[i]]);
            return out;
        };
        SinCos<Several> angle[joints];
        Several step[joints], psi = of_hulls(hulls.psi);
        for (int j = 0; j < joints; ++j) {
            angle[j] = {of_hulls(found.angle[j].sin), of_hulls(found.angle[j].cos)};
            step[j] = of_hulls(hulls.slope[j]);
        }
        const SinCos<Several> wanted = sin_cos(Several::load(target));
        const Several slope = of_joints(joint, [&](int j) { return step[j]; });
        const Several by = gap_to(wanted, joint, angle) / slope;
        const auto going = abs(by) < Several(ChainInverseTuning::largest_step);
        for (int j = 0; j < joints; ++j) step[j] = select(going, step[j] * by, Several(0.0));
        turn_by(step, angle);
        psi = psi + select(going, by, Several(0.0));
        const auto there = lead(joint, wanted, going, angle, psi);
        for (int i = 0; i < count; ++i) {
            const int k = end[i].of;
            if (!there[i] || !(abs(psi[i] - hulls.psi[k]) <= 2.0 * hulls.half[k]))
                fails[k] = true;
            else
                cut_piece(piece[k], psi[i], end[i].lower, end[i].tag);
        }
    }

    const ChainArm& arm_;
    const Pose<double>& pose_;
    const Triad<double>& on_;
    const Configuration<double>& gc_;
    const ThetaRanges& ranges_;
    int only_;

    Pieces pieces_, open_;
    Stretches<512> next_;  // of this round
    Stretches<256> left_;  // to the next
    int round_ = 0;
    double unproven_ = 0;
    int looks_ = 0;
    PostureTrail<several> trail_;
    Tag elbow_blocks_ = 0;    // the elbow's limit or margin that broke a cell
    bool only_elbow_ = true;  // and every other
};

}  // namespace detail

/// Writes to `out` the values of psi at which branch gc of the true chain reaches a pose within the limits
/// and the singularity margin (rad); of one joint's limits alone if `joint` (0..6) is given.
inline void feasible(const ChainArm& arm, const Pose<double>& pose, int gc, const Limits& limits,
                     double margin, ProvenArcs& out, int joint = -1) noexcept {
    make_empty(out.arcs);
    make_empty(out.open);
    out.unproven = 0;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, exact));
    out.status = detail::reach_status(arm, on);
    if (out.status != Status::OK) return;
    const Configuration<double> sign = configuration(gc);
    const ThetaRanges ranges(arm.nominal, limits, margin, sign);
    detail::ArcProof(arm, exact, on, sign, ranges, joint).run(out);
}

}  // namespace armangle

#include "../names/end.hpp"
