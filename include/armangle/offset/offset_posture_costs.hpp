// Postures of an arm with an offset at values of its free joint, what they cost, and the two orders of
// joints.
#pragma once

#include <algorithm>

#include "cost_cells.hpp"
#include "offset_joint_search.hpp"

#include "../names/begin.hpp"

namespace armangle {
namespace detail {

/// The bit of the branch number that is the wrist's sign.
inline int wrist_bit(int gc) noexcept {
    for (int bit = 1; bit < configurations; bit <<= 1)
        if (configuration(gc ^ bit).wrist != configuration(gc).wrist) return bit;
    return 0;
}
/// The bit of the branch number that is the shoulder's sign.
inline int shoulder_bit(int gc) noexcept {
    for (int bit = 1; bit < configurations; bit <<= 1)
        if (configuration(gc ^ bit).shoulder != configuration(gc).shoulder) return bit;
    return 0;
}

/// The postures of one pose and their costs. Options are in the order of the formulas.
class OffsetPostureCosts : protected OffsetCosts {
protected:
    /// Keeps references to arm and pose.
    OffsetPostureCosts(const OffsetArm& arm, const Pose<double>& exact,
                       const NearestOptions& in_order) noexcept
        : OffsetCosts(arm.rest, in_order), offset_(arm), pose_(exact) {}

    /// Joints in the robot's order, of seven in the order of the formulas.
    Joints robot_order(const double* in_order) const noexcept {
        Joints out{};
        for (int j = 0; j < joints; ++j) out.q[robot_joint(offset_, j)] = in_order[j];
        return out;
    }
    /// Joints in the order of the formulas, of seven in the robot's order.
    Joints formula_order(const double* robot) const noexcept {
        Joints out{};
        for (int j = 0; j < joints; ++j) out.q[j] = robot[robot_joint(offset_, j)];
        return out;
    }

    /// Writes the joints at a value of the free joint (rad) to q, in the order of the formulas, each with its
    /// cheapest multiple of 2 pi. There must be a solution.
    void joints_at(const OffsetCells& cells, double free, double* q) const noexcept {
        double theta[joint_slots];
        cells.at(free, theta);
        for (int j = 0; j < joints; ++j) q[j] = turned(j, theta[j]);
    }
    /// The value of joint j (0..6) at theta, within its limits and with the cheapest multiple of 2 pi.
    double turned(int j, double theta) const noexcept {
        const JointCost& c = joint_[j];
        return to_q(theta, c.sign, c.offset, c.lower, c.upper, c.near);
    }
    /// The cost of all joints.
    double cost_of_all(const double* q) const noexcept {
        double sum = cost_of(joint_[0], q[0] - joint_[0].near);
        for (int j = 1; j < joints; ++j) sum = both(sum, cost_of(joint_[j], q[j] - joint_[j].near));
        return sum;
    }
    /// The cost of the posture at a value of the free joint.
    double cost_at(const OffsetCells& cells, double free) const noexcept {
        double q[joint_slots];
        joints_at(cells, free, q);
        return cost_of_all(q);
    }
    /// The cost as a sum of squares, with two derivatives by the free joint.
    Jet<double, 2> squares_at(const OffsetCells& cells, double free) const noexcept {
        using J = Jet<double, 2>;
        J theta[joints];
        J sum(0.0);
        cells.at(free, theta);
        for (int j = 0; j < joints; ++j) {
            J off = J(joint_[j].sign) * theta[j];
            off.coefficient[0] = turned(j, theta[j].value()) - joint_[j].near;
            sum = sum + J(joint_[j].weight) * (off * off);
        }
        return sum;
    }
    /// The costs of eight postures of a branch; infinite without one within the limits.
    Boxes costs_within(const OffsetMotion<>& m, const Boxes& free) const noexcept {
        const SinCos<Boxes> theta_7 = sin_cos(to_theta(free, Boxes(joint_[6].sign), Boxes(joint_[6].offset)));
        const OffsetWrist<Boxes> wrist = offset_wrist(offset_, m, theta_7);
        auto exists = (wrist.excess <= Boxes(0.0)) & (Boxes(0.0) <= wrist.inside);
        Boxes sum(squares() ? 0.0 : -infinity);
        if (!any(exists)) return Boxes(infinity);
        const Directions<Boxes> d = directions(m, wrist, theta_7, sqrt(max(wrist.inside, Boxes(0.0))));
        for (int j = 0; j < joints; ++j) {
            const JointCost& c = joint_[j];
            const Boxes q = to_q(atan2(d.y[j], d.x[j]), Boxes(c.sign), Boxes(c.offset), Boxes(c.lower),
                                 Boxes(c.upper), Boxes(c.near));
            exists = exists & (Boxes(c.lower) <= q) & (q <= Boxes(c.upper));
            const Boxes d_j = q - Boxes(c.near), weight(c.weight);
            if (squares())
                sum = mul_add(weight * d_j, d_j, sum);
            else
                sum = max(sum, c.weight > 0 ? weight * abs(d_j) - Boxes(c.room) : Boxes(0.0));
        }
        return select(exists, sum, Boxes(infinity));
    }
    /// A lower bound of the cost over [lower, upper] of the free joint (rad); -infinity if none is known.
    double least_over(int gc, double lower, double upper) const noexcept {
        const CostCells middle(0.5 * (lower + upper)), half(0.5 * (upper - lower) + tolerance::same_psi);
        const OffsetMotion<> m = offset_motion(offset_, pose_, gc);
        const double least = costs(OffsetOverCells(offset_, m, middle, half)).least[0];
        return is_nan(least) ? -infinity : least;
    }
    /// Moves a posture, whose free joint may have too few digits, onto the pose; false, without a change, if
    /// that fails.
    bool move_onto_pose(Nearest& in_order) const noexcept {
        const Joints at = robot_order(in_order.q);
        const double size = offset_.own.size;
        Twist rest;
        Limits about;
        const bool kept = limits_about(offset_, at.q, about) && within_limits(about, at.q, 0.0);
        if (kept && distance(offset_, at.q, pose_, size, rest) <= 0.1 * LocalSolveTuning::meets * size)
            return true;
        int rounds = LocalSolveTuning::rounds;
        const Relaxed on = solve_locally(offset_, about, at, pose_, {}, 0.0, rounds);
        if (!meets(offset_, on)) return false;
        in_order = finished(formula_order(on.at.q).q, in_order.psi, in_order.gc);
        return true;
    }
    /// The result with joints in the robot's order.
    Nearest in_robot_order(const Nearest& in_order) const noexcept {
        Nearest out = in_order;
        const Joints at = robot_order(in_order.q);
        std::copy(at.q, at.q + joints, out.q);
        out.psi = out.psi <= -pi ? pi : out.psi;
        return out;
    }
    /// The cost of a result; infinite without a solution.
    double cost_of_result(const Nearest& in_order) const noexcept {
        return is_solved(in_order.status) ? cost_of_all(in_order.q) : infinity;
    }

    const OffsetArm& offset_;
    const Pose<double>& pose_;
};

}  // namespace detail
}  // namespace armangle

#include "../names/end.hpp"
