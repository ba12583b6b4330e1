// Proof that the true joints of a nearly S-R-S arm keep their limits between all samples of a curve.
//
//     theta |        __==      ==  p(s) +- r: one posture lies in it for every s, and limits are outside of
//     it
//           |    __==::::
//           | _==::::          each piece is proven about its middle m, and holds the posture that the next
//           +--[----m----]--[----m----]-- s       one begins with
//
// At m the posture and its Taylor coefficients are known: p is that cubic. With F the seven equations, C the
// inverse of their Jacobian at m and intervals for all s of the piece,
//     e_i >= |C F(p(s), s)|_i,   G_ik >= |1 - C J|_ik over p(s) +- r,   e + G r < r
// says that exactly one posture lies within r of p(s) for every s (Krawczyk). e follows from F's own Taylor
// coefficients: those of order 0 and 1 at m, that of order 2 over the piece. Source: R. E. Moore, Interval
// Analysis (1966); A. Neumaier, Interval Methods (1990), chapter 5.
#pragma once

#include "../plan/certify.hpp"
#include "hull_cells.hpp"
#include "joint_tube.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the proof of a curve of a chain.
struct ChainCertifyTuning {
    static constexpr int pieces = 64;  // that a stretch may take on average
};

/// Given joints (rad) at the start and at the goal of a path; null: that end is free.
struct GivenEnds {
    const double *start = nullptr, *goal = nullptr;
};

namespace detail {

/// Proves the joints of a nearly S-R-S arm along a curve of its nominal arm.
class TubeProver {
public:
    /// Keeps the curve of the true chain, its given ends, the proof `also` of its nominal arm's curve and a
    /// singularity margin (rad), and computes the work that the proof may take; `scene`, the chain among its
    /// obstacles, may be null.
    TubeProver(const CorrectedCurve& curve, const GivenEnds& ends, const Limits& limits, double margin,
               const Proof& also, StraightMove<ChainArm>* scene) noexcept
        : curve_(curve),
          ends_(ends),
          limits_(limits),
          also_(also),
          margin_(margin),
          sine_(sin_cos(Interval(max(margin, CurveProofTuning::least_margin))).sin.hi),
          move_(scene) {
        budget_ = static_cast<long long>(curve.curve.stretches.size() + 8) * ChainCertifyTuning::pieces;
    }

    /// Proves all stretches and returns the ranges of s that are not proven and the violations that were
    /// found; counts its pieces as `work`, if not null.
    Proof run(Work* work) {
        for (const Stretch& x : curve_.curve.stretches) {
            const long long before = budget_;
            const bool proven = also_proven(x) && prove(x, x.start, x.end, 0);
            if (!proven) {
                known_ = false;
                leave(x.start, x.end);
            }
            look(x, proven);
            if (work) work->take(WorkTuning::chain * WorkTuning::cell * (1 + before - budget_));
        }
        return std::move(proof_);
    }

    /// The largest violation (rad) of a joint limit found at sampled places; <= 0 if there is none, infinite
    /// if a place has no posture.
    double excess() const noexcept { return excess_; }

    /// The largest lack of clearance (m) found at sampled places; 0 if there is none.
    double short_of() const noexcept { return short_; }

    /// The largest lack of the singularity margin (rad) found at sampled places; 0 if there is none.
    double too_singular() const noexcept { return singular_; }

private:
    /// Whether the proof of the nominal arm holds all over a stretch.
    bool also_proven(const Stretch& x) const noexcept {
        for (std::size_t i = 0; i + 1 < also_.open.size(); i += 2)
            if (also_.open[i] < x.end && also_.open[i + 1] > x.start) return false;
        return true;
    }

    /// Adds [from, to] to the ranges of s that are not proven.
    void leave(double from, double to) {
        if (!proof_.open.empty() && proof_.open.back() == from) {
            proof_.open.back() = to;
        } else {
            proof_.open.push_back(from);
            proof_.open.push_back(to);
        }
    }

    /// Samples a stretch, and records how much limits, margin and clearance are violated, or that no posture
    /// is found or, unless the stretch is proven, that a joint jumps.
    void look(const Stretch& x, bool proven) {
        PlacedPosture before{};
        for (int i = 0; i <= looks; ++i) {
            const double s = x.start + (x.end - x.start) * i / looks;
            const PlacedPosture here = curve_.lifted(x, s, nominal_at(x, s));
            const double margin = limit_margin(limits_, here.q);
            const double room = move_ && is_finite(here.q) ? move_->nearest_pair(here.q, 0.0).room : 0.0;
            if (room < -StraightMoveTuning::slack - CurveProofTuning::broken) {
                short_ = max(short_, -room);
                if (margin >= -CurveProofTuning::broken) proof_.violated.push_back(s);
            }
            const double singular = margin_ > 0 && is_finite(here.q)
                                        ? margin_ - singular_distance(curve_.arm.nominal, here.q)
                                        : 0;
            if (singular > CurveProofTuning::broken) {
                singular_ = max(singular_, singular);
                proof_.violated.push_back(s);
            }
            const double step = (x.end - x.start) / looks;
            const bool leapt = !proven && i > 0 && is_finite(before.q) && is_finite(here.q) &&
                               leaps(curve_, x, s - step, s, before, here);
            before = here;
            if (margin >= -CurveProofTuning::broken && !leapt) continue;
            proof_.violated.push_back(leapt ? s - step : s);
            excess_ = margin < 0 && !leapt ? max(excess_, -margin) : infinity;  // no limit can be drawn in
        }
    }

    /// The posture of the nominal arm at s, found from the joints interpolated between the ends of the
    /// stretch.
    PlacedPosture nominal_at(const Stretch& x, double s) const noexcept {
        const double t = (s - x.start) / (x.end - x.start);
        double near[joints];
        for (int j = 0; j < joints; ++j) near[j] = x.q[j] + t * (x.q_end[j] - x.q[j]);
        return curve_.curve.solve(x, s, phi_at(x, s), near, x.psi);
    }

    /// Proves [from, to] of a stretch, in halves if it is not proven as a whole; false if these are not
    /// proven either, or the work is used up.
    bool prove(const Stretch& x, double from, double to, int depth) noexcept {
        JointTube tube;
        if (--budget_ < 0) return false;
        if (enclose(x, from, to, tube) && keeps(x, tube) && goes_on(tube) && holds_ends(x, tube, from, to) &&
            is_clear(tube)) {
            before_ = tube;
            return known_ = true;
        }
        if (depth == CurveProofTuning::depth) return false;
        const double half = 0.5 * (from + to);
        return prove(x, from, half, depth + 1) && prove(x, half, to, depth + 1);
    }

    /// Computes the tube of the piece [from, to] in `out`; returns whether it is proven to hold one posture.
    bool enclose(const Stretch& x, double from, double to, JointTube& out) const noexcept {
        const double middle = 0.5 * (from + to);
        const PlacedPosture here = curve_.lifted(x, middle, nominal_at(x, middle));
        if (!is_finite(here.q)) return false;
        double centre[joints];
        Jet<double, 3> series[joints];
        SinCos<double> angle[joints];
        theta_of(curve_.curve.arm, here.q, centre);
        curve_.expand(x, middle, centre, series);
        sin_cos_all(centre, angle);
        InverseSlope<double> back;
        return curve_.inverse_slope(x, curve_.equations(x, middle, angle), back) &&
               enclose_joints(
                   [&](const Jet<Interval, 2>& s, const SinCos<Jet<Interval, 2>>* turned) noexcept {
                       return curve_.equations(x, s, turned);
                   },
                   series, back, from, to, out);
    }

    /// Whether joint limits, singularity margin and branch hold for all postures of a tube.
    bool keeps(const Stretch& x, const JointTube& tube) const noexcept {
        const Arm& arm = curve_.curve.arm;
        const Configuration<double> side = configuration(curve_.curve.branch(x));
        const Interval off(-tube.half, tube.half);
        SinCos<Interval> angle[joints];
        for (int j = 0; j < joints; ++j) {
            const Interval theta = tube.range(j, off, tube.within[j]);
            const Interval q = Interval(arm.sign[j]) * (theta - Interval(arm.offset[j]));
            if (!(q.lo >= limits_.lower[j] + CurveProofTuning::slack &&
                  q.hi <= limits_.upper[j] - CurveProofTuning::slack))
                return false;
            angle[j] = sin_cos(theta);
        }
        const Interval bend = angle[3].sin * Interval(arm.delta.cos) - angle[3].cos * Interval(arm.delta.sin);
        const Interval s(tube.middle - tube.half, tube.middle + tube.half);
        const int through = hinge_crossed_by(static_cast<int>(x.lead));  // its sign comes out
        return (through == 0 || (angle[1].sin * Interval(side.shoulder)).lo > sine_) &&
               (bend * Interval(side.elbow)).lo > sine_ &&
               (through == 1 || (angle[5].sin * Interval(side.wrist)).lo > sine_) &&
               (x.lead != 0 || dot(curve_.plane_at(x, s).along, elbow_axis(angle)).lo > 0);
    }

    /// Whether the posture at the end of the previous tube, if there is one, is the one at the beginning of
    /// this tube.
    bool goes_on(const JointTube& tube) const noexcept {
        if (!known_) return true;
        bool held = true, holds = true;
        for (int j = 0; j < joints; ++j) {
            const double apart = size_of(before_.range(j, Interval(before_.half), 0.0) -
                                         tube.range(j, Interval(-tube.half), 0.0));
            held = held && apart + tube.within[j] < before_.radius[j];
            holds = holds && apart + before_.within[j] < tube.radius[j];
        }
        return held || holds;
    }

    /// Whether the one posture of a tube is, at both ends of its piece, that of the curve, and the one to
    /// which a given end of the path leads. Near where branches meet a branch may hold two postures.
    bool holds_ends(const Stretch& x, const JointTube& tube, double from, double to) const noexcept {
        const auto holds = [&](double s, const PlacedPosture& at) {
            double theta[joints];
            theta_of(curve_.curve.arm, at.q, theta);
            for (int j = 0; j < joints; ++j) {
                const Interval off = tube.range(j, Interval(s - tube.middle), 0.0) - Interval(theta[j]);
                if (!(abs(wrap(off.middle())) + off.hi - off.lo < tube.radius[j])) return false;
            }
            return true;
        };
        for (const double s : {from, to})
            if (!holds(s, curve_.lifted(x, s, nominal_at(x, s)))) return false;
        return (from > 0 || !ends_.start || holds(from, curve_.near(x, from, ends_.start))) &&
               (to < 1 || !ends_.goal || holds(to, curve_.near(x, to, ends_.goal)));
    }

    /// Whether no link collides in a tube: it is checked as a straight joint motion with a radius.
    bool is_clear(const JointTube& tube) noexcept {
        if (!move_) return true;
        double q[joints], d[joints], off[joints];
        for (int j = 0; j < joints; ++j) {
            const double* c = tube.theta[j];
            const double sign = curve_.curve.arm.sign[j], h = tube.half;
            q[j] = sign * (c[0] - curve_.curve.arm.offset[j]);
            d[j] = sign * h * c[1];
            off[j] = h * h * (abs(c[2]) + h * abs(c[3])) + tube.within[j];
        }
        return move_->about(q, d, off, nullptr).is_clear();
    }

    static constexpr int looks = 8;  // of a stretch

    const CorrectedCurve& curve_;
    const GivenEnds ends_;
    const Limits& limits_;
    const Proof& also_;
    const double margin_, sine_;
    Proof proof_;
    JointTube before_;
    bool known_ = false;
    long long budget_;
    double excess_ = -infinity, short_ = 0, singular_ = 0;
    StraightMove<ChainArm>* const move_;
};

}  // namespace detail

/// Proves that the true joints of a chain are one motion along a curve between the given ends, and keep
/// limits, singularity margin (rad) and the clearance of `scene`, the chain among its obstacles (null: none).
/// `also` is the proof for the nominal arm. Returns the ranges of s that are not proven, and where limits or
/// clearance are violated or the curve is another posture than the motion; `excess` is the largest violation
/// of a limit found (rad; <= 0: none, infinite: no posture), `short_of` the largest lack of clearance (m),
/// `too_singular` that of the margin (rad). `work` may be null.
inline Proof certify(const CorrectedCurve& curve, const GivenEnds& ends, const Limits& limits, double margin,
                     const Proof& also, StraightMove<ChainArm>* scene, double& excess, double& short_of,
                     double& too_singular, Work* work = nullptr) {
    detail::TubeProver prover(curve, ends, limits, margin, also, scene);
    Proof out = prover.run(work);
    excess = prover.excess();
    short_of = prover.short_of();
    too_singular = prover.too_singular();
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
