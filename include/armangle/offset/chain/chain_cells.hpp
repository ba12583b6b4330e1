// Cells of the free joint of an arm on its own chain: what its joints do over a cell.
//
// Every posture of a branch is the nominal posture of a corrected pose X, which is within (shift, turn) of
// the pose (offset_chain.hpp). So the wrist's distance, theta_4, g and t of the closed form
// (offset_motion.hpp) are known over a cell, and with them where no posture is, and where all of these are
// regular.
//
// Around a posture of the true chain the self-motion is followed by theta' = u + y, u = -C J_7 at the middle
// of the cell, C the inverse of the Jacobian J of joints 1 to 6 there, u_7 = 1. With J' the rate of J along u
// at the middle and R >= |C (J(t) - J - t J')| over the way, all componentwise,
//
//     t |C J' u| + R |u| + (t |C J'| + R) Y < Y   =>   |y| <= Y:
//
// the joints cannot leave the box that R is made for, so that there is a posture for every value of the cell
// (a Krawczyk test, along one variable). As the end effector stays, an axis moves no more than the joints
// before it, or those behind it, turn it. Rounding is not in the bounds: ChainCellsTuning::rounding stands
// for it. Source: R. E. Moore, Interval Analysis (1966); A. Neumaier, Interval Methods (1990), chapter 5.
#pragma once

#include "../cells.hpp"
#include "inverse.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// How cells are enclosed.
struct ChainCellsTuning {
    /// Boxes that are tried, each larger than the one before by `grown`.
    int boxes = 4;
    double grown = 2.0;
    /// Added to every bound: more than the rounding of what it is made of (rad, share of the reach).
    double rounding = 1e-10;
};

namespace detail {

/// Bounds of the joints of a pose and branch over cells of the free joint, on the true chain; has the members
/// of OffsetCells.
class ChainCells {
public:
    /// Bounds of all postures over a cell.
    struct Over : OffsetCells::Over {
        bool regular;  // all nominal postures that there can be
    };

    /// Computes the flange pose of a pose (tool frame) in branch gc and the lengths (m) along the links.
    ChainCells(const OffsetChain& arm, const Pose<double>& pose, int gc,
               const ChainCellsTuning& tuning = {}) noexcept
        : arm_(arm),
          tuning_(tuning),
          flange_(flange_pose(arm, pose)),
          branch_(configuration(gc)),
          motion_(motion_of_flange(arm.nominal, flange_, branch_)) {
        length_[0] = 0;  // m along the links to the frame of each joint
        for (int k = 1; k < joints; ++k) length_[k] = length_[k - 1] + norm(arm.row[k].position);
    }

    /// Writes theta (rad) of all joints, in the order of the formulas, at a value of the free joint (rad) to
    /// `theta`; NaN if no posture is found.
    void at(double free, double* theta) const noexcept {
        ChainPosture found;
        const bool ok = posture(free, found) == Status::OK;
        for (int j = 0; j < joints; ++j)
            theta[j] = ok ? atan2(found.angle[j].sin, found.angle[j].cos) : not_a_number;
    }
    /// Writes the posture at a value of the free joint (rad) to `found`; if the status is not OK, there is
    /// none, or none was found.
    Status posture(double free, ChainPosture& found) const noexcept {
        return find_posture(arm_, flange_, theta_7_of(free), branch_, nullptr, found);
    }
    /// Sine and cosine of theta_7 at a value of the free joint.
    SinCos<double> theta_7_of(double free) const noexcept {
        return sin_cos(to_theta(arm_.nominal.rest, 6, free));
    }
    /// The flange pose whose postures are bounded.
    const Pose<double>& flange() const noexcept { return flange_; }
    /// The half width (rad) below which a cell is not divided further: `least`, or more if the cell is not
    /// regular.
    double narrowest(const Over& over, double least) const noexcept {
        return over.regular ? least : max(least, 0.5 * arm_.shift / arm_.nominal.rest.reach);
    }
    /// -infinity, always: this member of OffsetCells tests the nominal closed form, which is not the chain's.
    double inside(double) const noexcept { return -infinity; }

    /// A cell of which the wrist is bounded, but not yet all joints.
    struct Begun {
        double middle, half;
        JointOver theta_5;
    };

    /// Starts `out`: bounds of joints 4 and 7 over the cell [middle - half, middle + half] of the free joint,
    /// and whether postures can exist. `begun` keeps what finish() needs.
    void begin(double middle, double half, Begun& begun, Over& out) const noexcept {
        const OffsetArm& arm = arm_.nominal;
        const Arm& rest = arm.rest;
        const double sign = rest.sign[6], shift = arm_.shift + tuning_.rounding * rest.size,
                     turn = arm_.turn + tuning_.rounding;
        const Interval theta =
            Interval(sign) * Interval(middle - half, middle + half) + Interval(rest.offset[6]);
        const SinCos<Interval> theta_7 = sin_cos(theta);
        const Vec3<double>& s = motion_.from_shoulder;
        const Interval along_x(dot(motion_.flange.x, s)), along_y(dot(motion_.flange.y, s));
        // p moves by the shift, and x_6 and y_6 turn with the flange
        const Interval across = along_x * theta_7.cos - along_y * theta_7.sin;
        const Interval square = Interval(dot(s, s) + arm.a_6 * arm.a_6) - Interval(2.0 * arm.a_6) * across;
        const Interval length = sqrt(square);
        const double by = shift + abs(arm.a_6) * turn;
        const double nearest = greater(length.lo - by, 0.0), farthest = length.hi + by;
        out.fold = Interval::whole();
        out.beyond = nearest > rest.reach || farthest < rest.inner_reach;
        out.exists = out.beyond ? Known::outside : Known::open;
        begun = {middle, half, {0.0, Interval::whole(), Interval::whole()}};
        out.regular = nearest > rest.inner_reach && farthest < rest.reach;
        if (out.beyond) return;
        const double least = bend(lesser(farthest, rest.reach)),
                     most = bend(greater(nearest, rest.inner_reach));
        const double side = branch_.elbow,
                     from = rest.delta_angle + lesser(side * least, side * most) - tuning_.rounding,
                     to = rest.delta_angle + greater(side * least, side * most) + tuning_.rounding;
        out.joint[3] = joint_between(from, to);
        out.joint[6] = joint_between(theta.lo, theta.hi);
        const SinCos<Interval> theta_4 = sin_cos(Interval(from, to));
        const double off = shift + turn * norm(s);
        const Interval g = Interval(rest.a_3) * theta_4.cos + Interval(rest.d_se) * theta_4.sin +
                           Interval(rest.a_4),
                       t = along_x * theta_7.sin + along_y * theta_7.cos + Interval(-off, off),
                       least_g = abs(g), least_t = abs(t);
        if (least_t.lo > least_g.hi) out.exists = Known::outside;
        out.regular = out.regular && least_t.hi < least_g.lo;
        if (!(least_g.lo > 0) || out.exists == Known::outside) return;
        const Interval sine = meet(-(t / g), {-1.0, 1.0});
        const double a = asin_of(sine.lo), b = asin_of(sine.hi);
        begun.theta_5 = branch_.wrist > 0 ? joint_between(a, b) : joint_between(pi - b, pi - a);
    }

    /// Bounds all joints over a cell that was begun; unknown joints stay unbounded if no posture is proven
    /// all over the cell.
    void finish(const Begun& begun, Over& out) const noexcept {
        for (int j = 0; j < joints; ++j)
            if (j != 3 && j != 6) out.joint[j] = {0.0, Interval::whole(), Interval::whole()};
        out.joint[4] = begun.theta_5;
        ChainPosture here;
        if (!out.regular || !find_at_once(arm_, flange_, theta_7_of(begun.middle), branch_, here)) return;
        Followed way;
        if (!follow(here, begun.half, way)) return;
        double theta[joints];
        for (int j = 0; j < joints; ++j) theta[j] = atan2(here.angle[j].sin, here.angle[j].cos);
        if (!keeps_branch(theta, begun.half, way)) return;
        out.exists = Known::inside;
        for (int j = 0; j < joints; ++j) {
            const double sign = arm_.nominal.rest.sign[6];  // slopes are by the free joint's value
            const Interval slope =
                Interval(sign) * Interval(way.rate[j] - way.off[j], way.rate[j] + way.off[j]);
            const double reach = above(begun.half * (abs(way.rate[j]) + way.off[j])) + tuning_.rounding;
            out.joint[j] = {theta[j], {-reach, reach}, slope};
        }
    }

private:
    /// Derivatives of the joints by theta_7: over the cell each is within `off` of `rate`.
    struct Followed {
        double rate[joints], off[joints];
    };

    /// The elbow angle eta (rad) for a distance (m) of the wrist.
    double bend(double distance) const noexcept {
        const Triangle<double> found = triangle(arm_.nominal.rest, distance);
        return atan2(found.eta.sin, found.eta.cos);
    }

    /// The angle (rad) of a sine, also near 1.
    static double asin_of(double sine) noexcept {
        return atan2(sine, sqrt(max((1.0 - sine) * (1.0 + sine), 0.0)));
    }

    /// The bounds of a joint that is between two angles (rad).
    static JointOver joint_between(double from, double to) noexcept {
        const double middle = 0.5 * (from + to), half = above(0.5 * (to - from)) + angle_rounding;
        return {wrap(middle), {-half, half}, Interval::whole()};
    }

    /// Writes bounds of the joints' derivatives by theta_7 along the self-motion from a posture, for theta_7
    /// +- half, to `out`; false if they are not proven.
    bool follow(const ChainPosture& here, double half, Followed& out) const noexcept {
        double inverse[6][6];
        Pose<double> frame[joints + 1];
        walk_rows(arm_, here.angle, frame);
        if (!invert(frame, inverse, out.rate)) return false;
        out.rate[6] = 1.0;
        const double per_reach = 1.0 / arm_.nominal.rest.reach;
        const Vec3<double> at = origin_of_6(frame[joints]);
        // how the columns change along the way, at the middle, through the inverse
        double lever[joints], by_shift[6], by_turn[6], bent[6] = {}, sheared[6][joints];
        Vec3<double> turning{0, 0, 0}, moment{0, 0, 0};
        for (int i = 0; i < 6; ++i) {
            by_shift[i] = norm(Vec3<double>{inverse[i][0], inverse[i][1], inverse[i][2]}) * per_reach;
            by_turn[i] = norm(Vec3<double>{inverse[i][3], inverse[i][4], inverse[i][5]});
            out.off[i] = 0;
        }
        out.off[6] = 0;
        for (int k = 0; k < joints; ++k) {
            const Vec3<double>&axis = frame[k].rotation.z, &origin = frame[k].position, ahead = at - origin;
            lever[k] = norm(ahead);
            const Vec3<double> turned = cross(turning, axis), slid = cross(turning, origin) - moment;
            const Vec3<double> moved = (cross(turned, ahead) - cross(axis, slid)) * per_reach;
            for (int i = 0; i < 6; ++i) {
                const double* c = inverse[i];
                const double rate = c[0] * moved.x + c[1] * moved.y + c[2] * moved.z + c[3] * turned.x +
                                    c[4] * turned.y + c[5] * turned.z;
                sheared[i][k] = abs(rate);
                bent[i] += rate * out.rate[k];
            }
            turning = turning + axis * out.rate[k];
            moment = moment + cross(axis, origin) * out.rate[k];
        }
        for (int box = 0; box < tuning_.boxes; ++box) {
            double shift[joints], turn[joints];
            column_rest(lever, half, out, shift, turn);
            bool holds = true;
            double wanted[6];
            for (int i = 0; i < 6; ++i) {
                wanted[i] = tuning_.rounding + half * abs(bent[i]);
                for (int k = 0; k < joints; ++k) {
                    const double rest = by_shift[i] * shift[k] + by_turn[i] * turn[k];
                    wanted[i] += rest * abs(out.rate[k]) + (rest + half * sheared[i][k]) * out.off[k];
                }
                holds = holds && wanted[i] < out.off[i];
            }
            if (holds) return true;
            for (int i = 0; i < 6; ++i) out.off[i] = tuning_.grown * wanted[i];
        }
        return false;
    }

    /// Bounds by how much each joint axis (`turn`, rad) and the displacement of frame 6 that it causes
    /// (`shift`, m) differ over the cell from their linear change at its middle.
    void column_rest(const double (&lever)[joints], double half, const Followed& way, double (&shift)[joints],
                     double (&turn)[joints]) const noexcept {
        struct Side {
            double turn = 0, off = 0, slide = 0, slide_off = 0;
            double bent() const noexcept { return 0.5 * turn * turn + off; }
            double slid() const noexcept { return 0.5 * turn * slide + slide_off; }
        };
        for (int k = 0; k < joints; ++k) {
            Side before, behind;
            for (int j = 0; j < joints; ++j) {
                if (j == k) continue;
                Side& side = j < k ? before : behind;
                const double off = half * way.off[j], move = half * abs(way.rate[j]) + off,
                             length = abs(length_[k] - length_[j]);
                side.turn += move;
                side.off += off;
                side.slide += move * length;
                side.slide_off += off * length;
            }
            const double all = lesser(before.turn, behind.turn), slide = lesser(before.slide, behind.slide);
            turn[k] = lesser(before.bent(), behind.bent()) + tuning_.rounding;
            shift[k] =
                turn[k] * lever[k] + lesser(before.slid(), behind.slid()) + all * slide + tuning_.rounding;
        }
    }

    /// The origin of frame 6 (m) of a flange pose.
    Vec3<double> origin_of_6(const Pose<double>& flange) const noexcept {
        return mul_add(flange.rotation.z, -arm_.nominal.rest.d_wf, flange.position);
    }

    /// Writes the inverse of the Jacobian of joints 1 to 6 at a posture to `inverse` and their rates by
    /// theta_7 to `rate`; false if it is singular.
    bool invert(const Pose<double> (&frame)[joints + 1], double (&inverse)[6][6],
                double (&rate)[joints]) const noexcept {
        double columns[6][7];
        const double per_reach = 1.0 / arm_.nominal.rest.reach;
        const Vec3<double> at = origin_of_6(frame[joints]);
        for (int k = 0; k < joints; ++k) {
            const Vec3<double>& axis = frame[k].rotation.z;
            const Vec3<double> moved = cross(axis, at - frame[k].position) * per_reach;
            const double column[6] = {moved.x, moved.y, moved.z, axis.x, axis.y, axis.z};
            for (int i = 0; i < 6; ++i) columns[i][k] = column[i];
        }
        if (!invert_six(columns, inverse)) return false;
        for (int i = 0; i < 6; ++i) {
            rate[i] = 0;
            for (int k = 0; k < 6; ++k) rate[i] -= inverse[i][k] * columns[k][6];
        }
        return true;
    }

    /// Whether the signs of theta_2, theta_4 - delta and cos theta_5 stay those of the branch all over a
    /// cell.
    bool keeps_branch(const double* theta, double half, const Followed& way) const noexcept {
        const auto reach = [&](int j) { return half * (abs(way.rate[j]) + way.off[j]) + tuning_.rounding; };
        const double shoulder = branch_.shoulder * wrap(theta[1]),
                     elbow = branch_.elbow * wrap(theta[3] - arm_.nominal.rest.delta_angle),
                     wrist = half_pi - abs(wrap(branch_.wrist > 0 ? theta[4] : theta[4] + pi));
        const auto within = [](double angle, double by) { return angle > by && angle + by < pi; };
        return within(shoulder, reach(1)) && within(elbow, reach(3)) && wrist > reach(4);
    }

    const OffsetChain& arm_;
    const ChainCellsTuning tuning_;
    const Pose<double> flange_;
    const OffsetBranch branch_;
    const OffsetMotion<> motion_;
    double length_[joints];
};

}  // namespace detail

}  // namespace armangle

#include "../../names/end.hpp"
