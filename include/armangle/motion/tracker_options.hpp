// What a tracker takes and reports: its bounds, the input of a control cycle, and its result.
#pragma once

#include "../scene/scene.hpp"
#include "../circle/towards.hpp"
#include "../status.hpp"
#include "hand_filter.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// State of the motion after a control cycle.
enum class Tracking : std::uint8_t {
    FOLLOWING,  // the end effector is at the target
    LAGGING,    // approaching the target as fast as the bounds allow
    NEAREST,    // the target is out of reach: at, or on the way to, the nearest pose
    HELD,       // no accepted sample: continuing as predicted
    TURNING,    // moving to another configuration in joint space: the end effector leaves the target
    RETURNING,  // a joint violates its limits, or a link collides, since the start: leaving that state
};

/// The bounds of a tracker, and the obstacles that it avoids.
struct TrackerOptions {
    double dt = 0.004;            // s
    double velocity[joints];      // rad/s; infinite: unbounded
    double acceleration[joints];  // rad/s^2; infinite: unbounded
    double jerk[joints] = {infinity, infinity, infinity, infinity,
                           infinity, infinity, infinity};  // rad/s^3; infinite: unbounded
    double length = 0.2;                                   // m that count as one radian
    double still_margin = 0.05;                            // rad from straight that joint 4 keeps at rest
    double elbow_margin = 0.35;       // rad from straight that it keeps while the target is fast
    double singularity_margin = 0.0;  // rad from theta_2, theta_6 = 0, if arcs allow it
    double soft_clearance = 0.02;     // m beyond the scene's clearance that the elbow keeps if arcs allow it
    bool detours = true;              // whether the end effector may leave the target to find another way
    const Scene* scene = nullptr;     // obstacles to avoid; must outlive the tracker
    HandFilter hand;
};

/// Input of a control cycle. If the pose is null or invalid, the target continues as predicted.
struct Command {
    const Pose<double>* pose = nullptr;
    const Towards* elbow = nullptr;      // point or direction for the elbow; null: free
    double dt = 0;                       // s of this cycle; 0: that of the options
    int reconfigure = -1;                // 0..7: go to this branch, through configurations off the target
    const Pose<double>* seen = nullptr;  // the target pose relative to this arm; null: unchanged
    Vec3<double> drift{};                // m/s: motion of that pose while the target is constant
};

/// Result of a control cycle: the next joints, and their distance from the target.
struct Tracked {
    double q[joint_slots];
    double velocity[joints];  // rad/s, (q - q before) / dt
    Tracking status;
    double distance;  // m from the end effector to the target: sqrt(|dp|^2 + (length angle)^2)
    double gap;       // m by which the target's wrist is outside joint 4's reach
    double psi;       // in (-pi, pi]
    int gc;
    Status why;  // why the end effector is not at the target
    Tag pair;    // if an obstacle is the reason: obstacle and link; 0: none
};

/// Parameters of the tracker.
struct TrackerTuning {
    static constexpr double exact = 1e-9;       // m: within this distance the end effector is at its target
    static constexpr double rounding = 2e-15;   // rad: error that a sum of joint values may have
    static constexpr double outside = 1e-9;     // rad: joints this far outside the box are rounding errors
    static constexpr double soft = 0.05;        // rad from limits that is kept if arcs allow it
    static constexpr double braking = 0.6;      // share of the acceleration that an approach assumes
    static constexpr double direct = 1.0;       // the same if only the position comes nearer
    static constexpr double assured = 0.2;      // share that always remains, however hard the target brakes
    static constexpr double aside = 0.1;        // of `length`: metres a radian counts beside position alone
    static constexpr double turning = 0.3;      // the same of psi
    static constexpr double ticks = 3.0;        // an approach ends no faster than geometrically over so many
    static constexpr double regular = 1e-4;     // added to H, m^2/rad^2
    static constexpr double damping = 2e-3;     // added as well if the end effector is late
    static constexpr double late = 0.0015;      // m from the target at which all of it is added
    static constexpr double preview = 0.15;     // s ahead for which psi is chosen
    static constexpr double fast = 0.1;         // m/s of the wrist at which the elbow's margin is full
    static constexpr double trembling = 0.05;   // s over which the wrist's velocity is averaged for that
    static constexpr double growing = 0.1;      // s in which that margin grows
    static constexpr double shrinking = 2.0;    // s in which it shrinks
    static constexpr double beyond = 1e-6;      // a configuration violating a limit by more (rad) is rejected
    static constexpr double seam = 2e-6;        // rad between limits a whole turn apart
    static constexpr double negligible = 1e-4;  // rad of that margin
    static constexpr double crossing =
        0.3;                             // rad of theta_2, theta_6 within which both branches are compared
    static constexpr double leap = 3.0;  // m/s: a goal that moves faster has jumped
    static constexpr double standing = 0.02;  // rad/s: slower joints count as standing in a stall
    static constexpr double stall = 0.3;      // s of standing away from a goal before the arm turns to it
    static constexpr double lively = 0.02;    // m: a target that has moved farther starts a new case
    static constexpr double slow = 0.1;       // m/s: for a slower target the arm tries detours after ...
    static constexpr double patience = 1.0;   // s without coming nearer by ...
    static constexpr double progress = 0.1;   // ... this share, which is a stall near obstacles
    static constexpr double turned = 0.05;    // rad from the goal's configuration at which turning ends
    static constexpr double irregular = 0.7;  // |sin| of theta_2, theta_6 below which psi turns less ...
    static constexpr double shut = 0.05;      // ... and joints move by the least amount, ...
    static constexpr double roomy = 0.15;     // ... rad from limits
    static constexpr double remote = 1.0;     // rad: a configuration with a joint farther away is not nearby
    static constexpr double near = 0.1;  // rad within which a configuration nearer to the target is taken ...
    static constexpr double pays = 1e-3;    // ... and m that it must gain for each rad beyond
    static constexpr double level = 0.01;   // rad from straight within which joint 4 has no side ...
    static constexpr double scant = 0.6;    // ... at a start, if limits leave it less than that
    static constexpr double worth = 0.005;  // m that another start of the relaxation must gain
    static constexpr double strayed = 0.1;  // m: a target that has moved this far invalidates a way to it
    static constexpr double gain = 1e-4;    // m nearer to a resting target for which time is extended
    static constexpr double calm = 1e-3;    // rad of the elbow's margin above that at rest, negligible
    static constexpr double led =
        0.02;                        // rad nearer to the elbow's target worth leaving theta_2, theta_6 = 0
    static constexpr int turns = 8;  // configurations that are tried for one target
    static constexpr int ways = 2, most_ways = 600;  // ways around an obstacle tried in a cycle, and in all
    static constexpr int rounds = 6, starts = 16;    // of the relaxation in one cycle
};

}  // namespace armangle

#include "../names/end.hpp"
