// Where the elbow shall be: the value of the free joint that brings it nearest to a point, or farthest along
// a direction.
//
// The elbow E keeps its distance from the shoulder S, so that |P - E|^2 = const - 2 (P - S) . (E - S): the
// nearest elbow to a point P is the farthest along v = P - S, as in circle/towards.hpp. But E(theta_7) runs
// on no circle. Branch and bound over cells of the free joint finds the greatest v . (E - S):
//
//     gain |   /\        a cell is dropped where what it encloses is below the best,
//          |  /  \  /    halved else, and finished by Newton's method where it is narrow
//          +----------
//
//     E - S = w - a_4 x_4 - d_ew z_4
#pragma once

#include "../circle/towards.hpp"
#include "cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of psi_towards.
struct OffsetTowardsTuning {
    int cells = 24;           // of the circle, to begin with
    int looks = 4000;         // cells looked at before the best found is taken
    double narrowest = 1e-9;  // rad: half width of a cell that is not halved again
    double tie = 1e-14;       // of the arm's size: gains nearer than this are equal
    int newton = 12;
};

namespace detail {

/// Searches the best value of the free joint for one pose and branch.
class OffsetTowards {
public:
    /// `v`: the direction in which the elbow should be far, in the frame of the formulas.
    OffsetTowards(const OffsetArm& arm, const Pose<double>& exact, int gc, const Vec3<double>& v,
                  const OffsetTowardsTuning& tuning) noexcept
        : arm_(arm), motion_(offset_motion(arm, exact, gc)), cells_(arm, exact, gc), v_(v), tuning_(tuning) {}

    /// The best value of the free joint (rad), the best found if the cells are used up; NaN if the branch has
    /// no solution.
    double best() noexcept {
        struct Cell {
            double lower, upper;
        };
        const double tie = tuning_.tie * arm_.rest.size * norm(v_);
        Cell stack[most_cells];
        int top = 0, looks = 0;
        const double width = two_pi / tuning_.cells;
        for (int k = 0; k < tuning_.cells && top < most_cells; ++k)
            stack[top++] = {-pi + width * k, -pi + width * (k + 1)};
        for (int k = 0; k < tuning_.cells; ++k) offer(-pi + width * (k + 0.5));
        while (top > 0 && looks++ < tuning_.looks) {
            const Cell cell = stack[--top];
            const double middle = 0.5 * (cell.lower + cell.upper), half = middle - cell.lower;
            OffsetCells::Over over;
            OffsetCells::Begun begun;
            cells_.begin(middle, half, begun, over);
            if (over.exists == Known::outside) continue;
            const Jet<Interval, 1> gain = gain_of(begun.wrist);
            const Interval slope = gain.coefficient[1];
            double most = gain.value().hi;
            const bool smooth = over.exists == Known::inside && slope.bounded();
            if (smooth) most = min(most, gain_at(middle) + half * max(abs(slope.lo), abs(slope.hi)));
            if (!(most > best_gain_ + tie)) continue;
            offer(middle);
            if (smooth && (slope.lo >= 0 || slope.hi <= 0)) {
                offer(slope.lo >= 0 ? cell.upper : cell.lower);
                continue;
            }
            if (half < tuning_.narrowest || top + 2 > most_cells) {
                offer(cell.lower);
                offer(cell.upper);
                continue;
            }
            stack[top++] = {cell.lower, middle};
            stack[top++] = {middle, cell.upper};
        }
        return wrap(best_);
    }

private:
    static constexpr int most_cells = 128;

    /// The number to maximize, v times the elbow's position from the shoulder (scalar product), at a solved
    /// wrist.
    template <class T>
    T gain_of(const OffsetWrist<T>& wrist) const noexcept {
        const T root = sqrt(max(wrist.inside, T(0.0)));
        const SinCos<T> theta_5 = theta_5_of(motion_, wrist, root);
        const T side = select(wrist.g < T(0.0), T(-1.0), T(1.0)), r = side * T(motion_.branch.wrist) * root;
        const Vec3<T> z4 = axis_5(wrist, in_scalar<T>(motion_.flange.z), r);
        const Vec3<T> x4 = combine(wrist.y6, -theta_5.sin, cross(z4, wrist.y6), -theta_5.cos);
        const Vec3<T> elbow = wrist.w - x4 * T(arm_.rest.a_4) - z4 * T(arm_.rest.d_ew);
        return dot(in_scalar<T>(v_), elbow);
    }
    /// The number to maximize, v times the elbow's position from the shoulder, at a value of the free joint
    /// (rad), for any scalar.
    template <class T>
    T gain(const T& free) const noexcept {
        const SinCos<T> theta_7 = sin_cos(T(arm_.rest.sign[6]) * free + T(arm_.rest.offset[6]));
        return gain_of(offset_wrist(arm_, motion_, theta_7));
    }
    /// The number to maximize, v times the elbow's position from the shoulder, at a value of the free joint
    /// (rad).
    double gain_at(double free) const noexcept { return gain<double>(free); }

    /// If the branch has a solution at this value of the free joint (rad) and it is better than the best one,
    /// improves it by Newton's method and keeps it.
    void offer(double free) noexcept {
        if (!(cells_.inside(free) >= 0)) return;
        double now = gain_at(free);
        if (!(now > best_gain_)) return;
        for (int pass = 0; pass < tuning_.newton; ++pass) {
            const Jet<double, 2> here = gain(Jet<double, 2>::variable(free));
            const double move = -here.coefficient[1] / (2.0 * here.coefficient[2]);
            if (!(here.coefficient[2] < 0 && abs(move) <= pi / tuning_.cells)) break;
            if (!(cells_.inside(free + move) >= 0)) break;
            const double then = gain_at(free + move);
            if (!(then >= now)) break;
            free += move;
            now = then;
            if (abs(move) < tolerance::rounding) break;
        }
        best_gain_ = now;
        best_ = free;
    }

    const OffsetArm& arm_;
    const OffsetMotion<> motion_;
    const OffsetCells cells_;
    const Vec3<double> v_;
    const OffsetTowardsTuning& tuning_;
    double best_ = not_a_number, best_gain_ = -infinity;
};

}  // namespace detail

/// The value of the free joint (rad) at which the elbow is as near to its target as branch gc of the pose
/// allows, ignoring joint limits. A target that is itself a value of the free joint is returned, wrapped. NaN
/// with `on_axis` if the target point is the shoulder (for a mirrored arm: the wrist) or the direction has no
/// length, NaN with `no` if the branch has no solution.
inline WishedPsi psi_towards(const OffsetArm& arm, const Pose<double>& pose, int gc, const Towards& towards,
                             const OffsetTowardsTuning& tuning = {}) noexcept {
    if (towards.wish == Wish::psi) return {wrap(towards.psi), Indifferent::no};
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    // the frame of the formulas: the base's, or, of a mirrored arm, the flange's turned half round
    Pose<double> frame = arm.own.has_base ? arm.own.base_inverse : identity_pose();
    if (arm.mirrored) frame = half_turn_about_x * inverted(flange_pose(arm.own, exact)) * frame;
    Vec3<double> v = frame.rotation * towards.target;
    double size = norm(v);
    if (towards.wish == Wish::point) {
        v = v + frame.position - Vec3<double>{0, 0, arm.rest.d_bs};
        size += arm.rest.size;
    }
    if (!(norm(v) > tolerance::vanishing * size)) return {not_a_number, Indifferent::on_axis};
    return {detail::OffsetTowards(arm, exact, gc, v, tuning).best(), Indifferent::no};
}

}  // namespace armangle

#include "../names/end.hpp"
