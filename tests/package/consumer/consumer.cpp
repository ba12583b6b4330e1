// Laws that a user of the headers relies on. Prints what fails; exit code 1 then.
#include <armangle/armangle.hpp>

#include <cmath>
#include <cstdio>
#include <random>

double reach_of(const armangle::Arm& arm);

namespace {

int failures = 0;

/// Count and print a law that does not hold.
void check(bool holds, const char* law) {
    if (!holds) {
        ++failures;
        std::printf("fails: %s\n", law);
    }
}

/// An arm with the lengths of the KUKA iiwa7, and limits.
armangle::Arm iiwa7() {
    armangle::ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.4;
    p.d_wf = 0.126;
    constexpr double limit[armangle::joints] = {2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0};
    for (int i = 0; i < armangle::joints; ++i) {
        p.limits.lower[i] = -limit[i];
        p.limits.upper[i] = limit[i];
    }
    return armangle::make_arm(p);
}

/// `inverse` of what `forward` says, with the joints as seed, has the position within 1e-14 m.
void round_trips(const armangle::Arm& arm) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> joint(-1.9, 1.9);
    double worst = 0;
    for (int k = 0; k < 1000; ++k) {
        double q[armangle::joints];
        for (double& value : q) value = joint(random);
        const armangle::Posture posture = armangle::forward(arm, q);
        const armangle::Inverse back = armangle::inverse(arm, posture.pose, posture.psi, posture.gc, q);
        check(back.status == armangle::Status::OK && back.margin >= 0, "what forward says can be solved");
        const armangle::Posture again = armangle::forward(arm, back.q);
        worst = std::fmax(worst, armangle::norm(again.pose.position - posture.pose.position));
    }
    check(worst < 1e-14, "the pose of inverse(forward(q)) is that of q");
}

/// `inverse` without an answer has a status and NaN; outside the limits its margin is below 0.
void inverse_says_why(const armangle::Arm& arm) {
    using armangle::Status, armangle::not_a_number;
    const double q[armangle::joints] = {0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5};
    const armangle::Posture at = armangle::forward(arm, q);
    const auto answer = [&](const armangle::Inverse& x, Status status, const char* law) {
        check(x.status == status && std::isnan(x.q[0]) && std::isnan(x.margin), law);
    };
    armangle::Pose<double> pose = at.pose;
    pose.position.x = 9.0;
    answer(inverse(arm, pose, at.psi, at.gc), Status::UNREACHABLE, "a pose out of reach is unreachable");
    pose.position = armangle::Vec3<double>{0, 0, arm.d_bs} + pose.rotation.z * arm.d_wf;
    answer(inverse(arm, pose, at.psi, at.gc), Status::FOLDED, "a wrist on the shoulder is folded");
    pose = at.pose;
    pose.rotation.x = -pose.rotation.x;
    answer(inverse(arm, pose, at.psi, at.gc), Status::BAD_INPUT, "a reflection is no pose");
    answer(inverse(arm, at.pose, not_a_number, at.gc), Status::BAD_INPUT, "psi must be finite");
    answer(inverse(arm, at.pose, at.psi, 8), Status::BAD_INPUT, "gc ends at 7");
    answer(inverse(arm, at.pose, at.psi, -1), Status::BAD_INPUT, "gc begins at 0");
    const double bad[armangle::joints] = {0, 0, 0, 0, 0, 0, not_a_number};
    answer(inverse(arm, at.pose, at.psi, at.gc, bad), Status::BAD_INPUT, "a seed must be finite");
    armangle::ArmParameters narrow = arm;
    narrow.limits.lower[0] = narrow.limits.upper[0] = q[0] + 1;
    const armangle::Inverse outside = inverse(armangle::make_arm(narrow), at.pose, at.psi, at.gc);
    check(outside.status == Status::OK && std::fabs(outside.margin + 1) < 1e-12,
          "a margin says who is outside");
}

/// `step` refuses poses that are no rotations, and numbers that are not finite, by its status.
void bad_input_is_a_status(const armangle::Arm& arm) {
    const armangle::LimitTable limits = armangle::limit_table(arm);
    const double q[armangle::joints] = {0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5};
    const armangle::Pose<double> pose = armangle::forward(arm, q).pose;
    const auto status = [&](const armangle::Pose<double>& p, const double* at) {
        return armangle::step(arm, limits, at, p, {}).status;
    };
    check(status(pose, q) == armangle::Status::OK, "a step to the present pose is OK");
    for (const double bad : {armangle::not_a_number, armangle::infinity, 2.0, 1e300}) {
        armangle::Pose<double> p = pose;
        p.rotation.y.x = bad;
        check(status(p, q) == armangle::Status::BAD_INPUT, "a matrix that is no rotation is refused");
        if (std::isfinite(bad)) continue;
        p = pose;
        p.position.z = bad;
        check(status(p, q) == armangle::Status::BAD_INPUT, "a position that is not finite is refused");
        double from[armangle::joints] = {0.1, 0.4, 0.2, -1.2, 0.3, 0.8, bad};
        check(status(pose, from) == armangle::Status::BAD_INPUT, "joints that are not finite are refused");
    }
    armangle::Pose<double> mirrored = pose;
    mirrored.rotation.x = -mirrored.rotation.x;
    check(status(mirrored, q) == armangle::Status::BAD_INPUT, "a reflection is refused");
}

/// Arms with a link of length 0: `forward` answers, all else says that the pose is unreachable.
void an_arm_without_links_reaches_nothing() {
    using armangle::Status;
    armangle::ArmParameters one_link;
    one_link.d_ew = 0.4;
    const double q[armangle::joints] = {0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5};
    for (const armangle::ArmParameters& parameters : {armangle::ArmParameters{}, one_link}) {
        const armangle::Arm arm = armangle::make_arm(parameters);
        const armangle::LimitTable limits = armangle::limit_table(arm);
        const armangle::Posture at = armangle::forward(arm, q);
        check(std::isfinite(at.pose.position.x) && at.gc >= 0 && at.gc < 8, "forward needs no links");
        armangle::Pose<double> away = at.pose;
        away.position.x += 0.1;
        for (const armangle::Pose<double>& pose : {at.pose, away}) {
            const armangle::Inverse back = armangle::inverse(arm, pose, 0.3, at.gc);
            check(back.status == Status::UNREACHABLE && std::isnan(back.q[0]), "inverse says unreachable");
            const armangle::Step next = armangle::step(arm, limits, q, pose, {});
            check(next.status == Status::UNREACHABLE && next.q[3] == q[3], "a step stays, and says why");
            armangle::AllArcs all;
            armangle::feasible_all(arm, pose, limits, all);
            for (int gc = 0; gc < armangle::configurations; ++gc)
                check(all.status[gc] == Status::UNREACHABLE && all.arcs[gc].empty(), "no branch has an arc");
            const armangle::Nearest nearest =
                armangle::nearest_posture(arm, limits, pose, armangle::NearestOptions{});
            check(nearest.status == Status::UNREACHABLE, "no posture is the nearest");
        }
    }
}

}  // namespace

/// Checks all laws; the exit code is 1 if one does not hold.
int main() {
    const armangle::Arm arm = iiwa7();
    check(reach_of(arm) == 0.8, "the reach is the sum of the links, in every translation unit");
    round_trips(arm);
    inverse_says_why(arm);
    bad_input_is_a_status(arm);
    an_arm_without_links_reaches_nothing();
    return failures != 0;
}
