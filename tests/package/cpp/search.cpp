// The laws of search.hpp against a dense grid of the whole circle in all branches. Prints "name count" lines:
// what was compared, then what was wrong, which must all be 0.
#include <cstdio>
#include <random>
#include <vector>

#include <armangle/search.hpp>

using namespace armangle;

namespace {

constexpr int grid = 720;

/// A posture of the grid or of the search.
struct Sample {
    Joints q;
    double psi;
    int gc;
};

/// All postures of a grid of psi within these limits, in place of the arm's; turns are those nearest to the
/// seed.
std::vector<Sample> brute_force(const Arm& arm, const Pose<double>& pose, const Limits& limits,
                                const double* seed) {
    ArmParameters p = arm;
    p.limits = limits;
    const Arm boxed = make_arm(p);
    std::vector<Sample> out;
    for (int gc = 0; gc < configurations; ++gc)
        for (int i = 0; i < grid; ++i) {
            const double psi = -pi + two_pi * (i + 0.5) / grid;
            const Inverse found = inverse(boxed, pose, psi, gc, seed);
            if (found.status != Status::OK || found.margin < 0) continue;
            Sample s{{}, psi, gc};
            for (int j = 0; j < joint_slots; ++j) s.q.q[j] = found.q[j];
            out.push_back(s);
        }
    return out;
}

/// The Euclidean distance (rad) of joints.
double distance(const double* a, const double* b) {
    double sum = 0;
    for (int j = 0; j < joints; ++j) sum += (a[j] - b[j]) * (a[j] - b[j]);
    return std::sqrt(sum);
}

/// How far the pose of q is from `pose`, 1 rad as 1 m.
double off(const Arm& arm, const double* q, const Pose<double>& pose) {
    return size(difference(forward(arm, q).pose, pose), 1.0);
}

}  // namespace

/// Compares 60 searches of each kind with the grid and prints what was compared and what was wrong.
int main() {
    ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.4;
    p.d_wf = 0.126;
    const double range[joints] = {2.96, 2.09, 2.96, 2.09, 2.96, 2.09, 3.05};
    for (int j = 0; j < joints; ++j) {
        p.limits.lower[j] = -range[j];
        p.limits.upper[j] = range[j];
    }
    ArmParameters offset = p;
    offset.a_3 = 0.045;
    offset.a_4 = -0.045;
    offset.limits.upper[0] = offset.limits.lower[0] + 9.0;
    const Arm arms[] = {make_arm(p), make_arm(offset)};
    std::mt19937 random(17);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    int narrow = 0, held = 0, refused = 0, accepted = 0, beyond = 0, shown = 0;
    int outside = 0, farther = 0, missed = 0, off_pose = 0, moved = 0, uncovered = 0, unproven = 0, worse = 0;
    for (int k = 0; k < 60; ++k) {
        const Arm& arm = arms[k & 1];
        double q[joints], seed[joints], room[joints];
        for (int j = 0; j < joints; ++j) {
            const double middle = 0.5 * (arm.limits.lower[j] + arm.limits.upper[j]);
            const double half = 0.5 * (arm.limits.upper[j] - arm.limits.lower[j]);
            q[j] = middle + half * uniform(random);
            seed[j] = min(max(q[j] + 0.4 * uniform(random), arm.limits.lower[j]), arm.limits.upper[j]);
            room[j] = 0.3 + 0.5 * std::fabs(uniform(random));
        }
        const Pose<double> pose = forward(arm, q).pose;
        SearchOptions options;
        options.seed = seed;
        // moves kept small: never worse than the grid, within the window
        options.consistency = room;
        Found found = search(arm, pose, options);
        const Limits window = search_window(arm, options);
        std::vector<Sample> all = brute_force(arm, pose, window, seed);
        if (found.posture.status == Status::OK) {
            ++narrow;
            if (!within_limits(window, found.posture.q, 1e-9)) ++outside;
            if (off(arm, found.posture.q, pose) > 1e-9) ++off_pose;
        } else if (!all.empty())
            ++missed;
        for (const Sample& s : all)
            if (distance(s.q.q, seed) < found.posture.distance - 1e-9) ++farther;
        // a callback that refuses all is shown all, to the resolution, within the window
        std::vector<Sample> seen;
        const Found none = search(arm, pose, options, [&](const double* at) {
            const Posture here = forward(arm, at);
            Sample s{{}, here.psi, here.gc};
            for (int j = 0; j < joints; ++j) s.q.q[j] = at[j];
            seen.push_back(s);
            if (!within_limits(window, at, 1e-9)) ++outside;
            if (off(arm, at, pose) > 1e-9) ++off_pose;
            return Answer::refused;
        });
        if (found.posture.status == Status::OK) {
            ++refused;
            if (!none.proven || none.posture.status != Status::NOT_ALLOWED) ++unproven;
            shown += none.shown;
        }
        for (const Sample& s : all) {
            bool near = false;
            for (const Sample& t : seen)
                near |= t.gc == s.gc && std::fabs(wrap(t.psi - s.psi)) <= 0.5 * options.resolution + 1e-9;
            if (!near) ++uncovered;
        }
        // a callback with a wish finds it where a stretch of postures as long as the resolution fulfils it
        options.consistency = nullptr;
        const double level = uniform(random);
        const auto wish = [&](const double* at) {
            return at[2] > level ? Answer::accepted : Answer::refused;
        };
        found = search(arm, pose, options, wish);
        if (found.posture.status == Status::OK) {
            ++accepted;
            if (!(found.posture.q[2] > level)) ++missed;
        } else
            for (const Sample& s : seen)
                if (wish(s.q.q) == Answer::accepted) ++missed;
        // one joint held in closed form: the known posture has it, so the answer is no farther
        const int joint = k % joints == 3 ? 0 : k % joints;  // joint 4 is the pose's
        double with_held[joints];
        for (int j = 0; j < joints; ++j) with_held[j] = seed[j];
        with_held[joint] = q[joint];
        options.seed = with_held;
        options.held = 1u << joint;
        found = search(arm, pose, options);
        ++held;
        if (found.posture.status != Status::OK || found.posture.distance > distance(q, with_held) + 1e-7)
            ++missed;
        if (std::fabs(found.posture.q[joint] - q[joint]) > 1e-7) ++moved;
        if (off(arm, found.posture.q, pose) > 1e-7) ++off_pose;
        // out of reach: no answer, or the nearest with its gap, no farther than the wrist must come back
        options.held = 0;
        Pose<double> far = pose;
        far.position = far.position * 3.0 + Vec3<double>{0.3, 0.3, 1.5};
        found = search(arm, far, options);
        if (found.posture.status != Status::UNREACHABLE || !std::isnan(found.posture.q[0])) ++missed;
        options.length = 0.5;
        found = search(arm, far, options);
        ++beyond;
        if (found.posture.status != Status::UNREACHABLE || !within_limits(arm.limits, found.posture.q, 1e-9))
            ++outside;
        Twist rest = difference(forward(arm, found.posture.q).pose, far);
        if (std::fabs(size(rest, options.length) - found.gap) > 1e-9) ++off_pose;
        rest = difference(forward(arm, with_held).pose, far);
        if (found.gap > size(rest, options.length)) ++worse;  // than the seed itself
    }
    const double lost[joints] = {std::nan(""), 0, 0, 0, 0, 0, 0};
    SearchOptions bad;
    bad.seed = lost;
    if (search(arms[0], identity_pose(), bad).posture.status != Status::BAD_INPUT) ++missed;
    bad.seed = nullptr;
    if (search(arms[0], identity_pose(), bad).posture.status != Status::BAD_INPUT) ++missed;
    const int counts[] = {narrow, held, refused, accepted, beyond, shown};
    const char* named[] = {"narrow", "held", "refused", "accepted", "beyond", "shown"};
    for (int i = 0; i < 6; ++i) std::printf("%s %d\n", named[i], counts[i]);
    const int wrong[] = {outside, farther, missed, off_pose, moved, uncovered, unproven, worse};
    const char* what[] = {"outside", "farther",   "missed",   "off_pose",
                          "moved",   "uncovered", "unproven", "worse"};
    for (int i = 0; i < 8; ++i) std::printf("wrong_%s %d\n", what[i], wrong[i]);
}
