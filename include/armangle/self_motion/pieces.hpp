// Limits as ranges of the model angles, and intervals of the free number that keep them, collected one by
// one.
#pragma once

#include <cstdint>

#include "../limits/feasible.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What is known of a condition over an interval of the free number.
enum class Known : std::uint8_t { inside, outside, open };

/// The ranges of theta that limits and a margin around singularities leave, each as a middle and a half width
/// below pi.
struct ThetaRanges {
    struct One {
        int joint;
        double middle, half;
        Tag low, high;
    };
    static constexpr int capacity = joints + 3;
    int count = 0;
    One one[capacity];

    /// Collects the ranges of joint limits and of the singularity margin (rad) in a branch.
    ThetaRanges(const Arm& arm, const Limits& limits, double margin,
                const Configuration<double>& gc) noexcept {
        for (int j = 0; j < joints; ++j) {
            const ThetaRange range = theta_range(arm, limits, j);
            if (!(range.upper - range.lower < two_pi)) continue;
            add(j, range.lower, range.upper, make_tag(j + 1, detail::limit_side(arm, j, true)),
                make_tag(j + 1, detail::limit_side(arm, j, false)));
        }
        if (!(margin > 0)) return;
        keep_off(1, 0.0, gc.shoulder, margin);
        keep_off(3, arm.delta_angle, gc.elbow, margin);
        keep_off(5, 0.0, gc.wrist, margin);
    }
    /// Adds the range in which a joint (0..6) keeps `margin` from `zero` and zero + pi, on one side.
    void keep_off(int joint, double zero, double side, double margin) noexcept {
        const Tag near = make_tag(joint + 1, Side::near_margin), far = make_tag(joint + 1, Side::far_margin);
        const double a = zero + side * margin, b = zero + side * (pi - margin);
        if (side > 0) add(joint, a, b, near, far);
        if (side < 0) add(joint, b, a, far, near);
    }

private:
    /// Adds the range [lower, upper] (rad) of a joint (0..6), with the tags of its ends.
    void add(int joint, double lower, double upper, Tag low, Tag high) noexcept {
        one[count++] = {joint, wrap(0.5 * (lower + upper)), 0.5 * (upper - lower), low, high};
    }
};

namespace detail {

/// An interval [lower, upper] of the free number within the limits, and what ends it.
struct Piece {
    double lower, upper;
    Tag lower_tag, upper_tag;
};

/// Collects intervals of the circle [-pi, pi], in any order.
class Pieces {
public:
    /// Adds an interval. One without width is kept if limits make both ends, as for a locked joint.
    /// Neighbours are joined when the capacity is reached; what does not fit then is lost.
    void add(Piece piece) noexcept {
        const bool ended = piece.lower_tag != 0 && piece.upper_tag != 0;
        if (ended && abs(piece.upper - piece.lower) < tolerance::angle) piece.upper = piece.lower;
        if (!(piece.upper > piece.lower || (ended && piece.upper == piece.lower))) return;
        if (count_ == capacity) join();
        if (count_ == capacity) {
            lost_ += piece.upper - piece.lower;
            return;
        }
        int k = count_++;
        for (; k > 0 && piece_[k - 1].lower > piece.lower; --k) piece_[k] = piece_[k - 1];
        piece_[k] = piece;
    }

    /// Writes the intervals to `out`, neighbours joined, also across +-pi, and adds the lost length to
    /// `lost`.
    void finish(ArcSet& out, double& lost) noexcept {
        make_empty(out);
        lost += lost_;
        join();
        for (int i = 0; i < count_; ++i) {
            const Piece& one = piece_[i];
            if (out.count == ArcSet::capacity)
                lost += one.upper - one.lower;
            else
                put(out, {one.lower, one.upper, one.lower_tag, one.upper_tag});
        }
        if (out.count == 1 && out.arc[0].upper - out.arc[0].lower >= two_pi - tolerance::angle)
            return make_full(out);
        merge(out);
        for (int i = 0; i < out.count && !out.full; ++i) {
            Arc& arc = out.arc[i];
            if (arc.lower_tag == 0) arc.lower_tag = make_tag(0, Side::unproven);
            if (arc.upper_tag == 0) arc.upper_tag = make_tag(0, Side::unproven);
        }
    }

private:
    /// Joins intervals that overlap or are nearer to each other than tolerance::angle.
    void join() noexcept {
        int joined = 0;
        for (int i = 0; i < count_; ++joined) {
            Piece one = piece_[i];
            for (++i; i < count_ && piece_[i].lower - one.upper < tolerance::angle; ++i) {
                if (piece_[i].upper < one.upper) continue;
                one.upper = piece_[i].upper;
                one.upper_tag = piece_[i].upper_tag;
            }
            piece_[joined] = one;
        }
        count_ = joined;
    }

    static constexpr int capacity = 512;
    int count_ = 0;
    Piece piece_[capacity];
    double lost_ = 0;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
