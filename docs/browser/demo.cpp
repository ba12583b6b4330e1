// The core as WebAssembly, for the page of the documentation that shows an arm alive: one arm, one ball, one
// pose. The page writes what it asks into `asked` and reads what it is answered from `told`, both in doubles.
#include <cstring>

#include <armangle/arm/frames.hpp>
#include <armangle/circle/forward.hpp>
#include <armangle/circle/inverse.hpp>
#include <armangle/limits/feasible.hpp>
#include <armangle/numbers/arrays.hpp>
#include <armangle/scene/clear.hpp>
#include <armangle/status.hpp>

using namespace armangle;

namespace {

constexpr int circle_points = 72, most_arcs = 16;

struct Asked {
    double pose[16];  // 4x4, row by row
    double psi, gc;
    double ball[4];  // place and radius, m
    double keep;     // not 0: psi stays where it is, allowed or not
};

struct Told {
    double status;   // of the pose: 0 where it has a posture
    double psi;      // the one shown: the nearest that is allowed
    double allowed;  // 1: psi is within the limits and clear of the ball
    double q[joints];
    double arm[5][3];                  // base, shoulder, elbow, wrist, tool
    double circle[circle_points][3];   // where the elbow can be
    double within[1 + 2 * most_arcs];  // count, then ends: arcs within the joint limits
    double clear[1 + 2 * most_arcs];   // arcs that are clear of the ball too
};

Asked asked;
Told told;

constexpr double bone = 0.06;  // m: radius of upper arm and forearm

Arm iiwa() noexcept {
    ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.4;
    p.d_wf = 0.126;
    const double degrees[joints] = {170, 120, 170, 120, 170, 120, 175};
    for (int j = 0; j < joints; ++j) {
        p.limits.upper[j] = degrees[j] * pi / 180.0;
        p.limits.lower[j] = -p.limits.upper[j];
    }
    return make_arm(p);
}

const Arm& arm() noexcept {
    static const Arm made = iiwa();
    return made;
}

void put(const Vec3<double>& p, double* to) noexcept {
    const double xyz[3] = {p.x, p.y, p.z};
    std::memcpy(to, xyz, sizeof(xyz));
}

void put(const ArcSet& set, double* to) noexcept {
    const int count = set.count < most_arcs ? set.count : most_arcs;
    *to++ = count;
    for (int i = 0; i < count; ++i) {
        *to++ = set.arc[i].lower;
        *to++ = set.arc[i].upper;
    }
}

/// The arcs of a circle on which two bones keep off the ball.
void clear_of_ball(const SelfMotion<double>& m, Cleared& out) noexcept {
    BallBlock block;
    for (int k = 0; k < 8; ++k) {
        block.x[k] = block.y[k] = block.z[k] = 1e6;
        block.radius[k] = 0;
    }
    block.x[0] = asked.ball[0];
    block.y[0] = asked.ball[1];
    block.z[0] = asked.ball[2];
    block.radius[0] = asked.ball[3];
    const std::uint16_t id[8] = {0, no_ball, no_ball, no_ball, no_ball, no_ball, no_ball, no_ball};
    const Part parts[2] = {{{{0, -arm().d_se, 0}, {0, 0, 0}, bone}, false},
                           {{{0, 0, 0}, {0, 0, arm().d_ew}, bone}, true}};
    const std::uint8_t ignored[2] = {0, 0};
    Scene scene{};
    scene.blocks = &block;
    scene.ball_id = id;
    scene.block_count = 1;
    const BallGroup group{{block.x[0], block.y[0], block.z[0]}, block.radius[0], 0, 1};
    scene.groups = &group;
    scene.clusters = &group;
    scene.cluster_count = 1;
    scene.first_held = scene.first_base = 1;
    scene.parts = parts;
    scene.part_count = 2;
    scene.ignored = ignored;
    scene.link_count = 2;
    clear(arm(), scene, m, out);
}

}  // namespace

extern "C" {

double* asked_numbers() { return reinterpret_cast<double*>(&asked); }

double* told_numbers() { return reinterpret_cast<double*>(&told); }

/// An outcome in words.
const char* sentence_of(int status) { return sentence(static_cast<Status>(status)); }

/// A pose to begin with, its psi and branch.
void begin() {
    const double q[joints] = {0.3, 0.7, -0.3, -1.5, 0.2, 0.9, 0.0};
    const Posture at = forward(arm(), q);
    store_pose(at.pose, asked.pose);
    asked.psi = at.psi;
    asked.gc = at.gc;
    const double ball[4] = {0.35, -0.25, 0.62, 0.09};
    std::memcpy(asked.ball, ball, sizeof(ball));
}

/// Answers what is asked. Where the pose has no posture, arcs and circle are empty and the arm stays.
void answer() {
    const Pose<double> pose = load_pose(asked.pose);
    const SelfMotion<double> m = self_motion(arm(), pose, static_cast<int>(asked.gc));
    ArcSet within, open;
    make_empty(within);
    make_empty(open);
    Status status = is_unreachable(m.circle) ? Status::UNREACHABLE : Status::FOLDED;
    if (!is_unreachable(m.circle) && !is_folded(m.circle)) {
        status = feasible(m, limit_table(arm()), within);
        Cleared cleared;
        clear_of_ball(m, cleared);
        if (status == Status::OK) intersect(within, cleared.arcs, open);
        if (status == Status::OK && open.empty()) status = Status::CLEARANCE;
    }
    put(within, told.within);
    put(open, told.clear);
    told.status = static_cast<double>(status);
    if (status == Status::UNREACHABLE || status == Status::FOLDED) return;
    double psi = wrap(asked.psi);
    if (asked.keep == 0 && !open.empty() && !contains(open, psi)) psi = nearest(open, psi);
    told.psi = psi;
    told.allowed = contains(open, psi);
    const Inverse found = inverse(arm(), pose, psi, static_cast<int>(asked.gc));
    std::memcpy(told.q, found.q, sizeof(told.q));
    Pose<double> frame[joints + 1];
    frames(arm(), found.q, frame);
    const Vec3<double> place[5] = {frame[0].position, frame[1].position, elbow_position(arm(), found.q),
                                   frame[5].position, pose.position};
    for (int k = 0; k < 5; ++k) put(place[k], told.arm[k]);
    for (int k = 0; k < circle_points; ++k) {
        const Inverse at = inverse(arm(), pose, two_pi * k / circle_points, static_cast<int>(asked.gc));
        put(elbow_position(arm(), at.q), told.circle[k]);
    }
}
}
