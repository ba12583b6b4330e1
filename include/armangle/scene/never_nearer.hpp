// How near two shapes of one arm ever come, whatever its joints: what is proven apart need not be asked.
//
//     link i  ===( joints i+1 .. j )===  link j        a cell: a range of each of these joints
//
// In the middle of a cell the distance is known. From there a joint turns what lies beyond it by at most the
// chord of half its range, at the farthest radius that the joints after it allow; so the distance of the
// whole cell is that of its middle but for the sum of these ways, at least. Cells that prove too little are
// halved across the joint with the longest way.
#pragma once

#include "../arm/frames.hpp"
#include "solids.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What is proven of no pair, m.
inline constexpr double not_apart = -infinity;

namespace detail {

/// Parameters of the least distance of two shapes of one arm.
struct NeverNearerTuning {
    /// A cell is finished if it proves this share of the least distance found.
    static constexpr double worth = 0.5;
    /// m: the rounding of frames and distances.
    static constexpr double rounding = 1e-9;
    /// The largest number of waiting cells.
    static constexpr int most_waiting = 512;
};

/// Frame i of table 1 relative to frame i - 1, at joint angle theta (rad).
inline Pose<double> dh_frame(const Arm& arm, int i, double theta) noexcept {
    const SinCos<double> t = sin_cos(theta);
    const Pose<double> from = identity_pose();
    switch (i) {
        case 1: return dh_step<-1>(from, t.sin, t.cos, arm.d_bs, 0.0);
        case 3: return dh_step<1>(from, t.sin, t.cos, arm.d_se, arm.a_3);
        case 4: return dh_step<-1>(from, t.sin, t.cos, arm.d_4, arm.a_4);
        case 5: return dh_step<-1>(from, t.sin, t.cos, arm.d_ew, 0.0);
        case 7: return dh_step<0>(from, t.sin, t.cos, arm.d_wf, 0.0);
        default: return dh_step<1>(from, t.sin, t.cos, 0.0, 0.0);
    }
}

/// Whether a rod lies on the z axis of its frame.
inline bool is_on_axis(const Rod& rod) noexcept {
    return rod.begin.x == 0 && rod.begin.y == 0 && rod.end.x == 0 && rod.end.y == 0;
}

/// A range of each joint between two links: middle and half width (rad); index k is the joint that moves link
/// k.
struct JointCell {
    double middle[joints + 1], half[joints + 1];
};

/// For a cell: the distance (m) of the pair in its middle, the proven lower bound, and the joint that
/// contributes most to the difference.
struct CellApart {
    double met, proven;
    int widest;
};

/// Computes the distance of two rods in the middle of a cell and its lower bound over the cell.
inline CellApart cell_apart(const Arm& arm, const Rod& a, int i, const Rod& b, int j,
                            const JointCell& cell) noexcept {
    Pose<double> frame[joints + 1];
    frame[i] = identity_pose();
    for (int k = i + 1; k <= j; ++k) frame[k] = frame[k - 1] * dh_frame(arm, k, cell.middle[k]);
    const Rod there = placed(frame[j], b);
    CellApart out{nearest(there.begin, there.end, as_solid(a)).distance - a.radius - b.radius, 0.0, i + 1};
    double way = 0, longest = -1;
    for (int k = j; k > i; --k) {  // joint k turns about z of frame k - 1
        const auto radius = [&](const Vec3<double>& p) {
            return norm(cross(frame[k - 1].rotation.z, p - frame[k - 1].position));
        };
        const double chord = 2.0 * std::sin(0.5 * min(cell.half[k], pi)),
                     turned = chord * (max(radius(there.begin), radius(there.end)) + way);
        way += turned;
        if (turned > longest) {
            longest = turned;
            out.widest = k;
        }
    }
    out.proven = out.met - way - NeverNearerTuning::rounding;
    return out;
}

}  // namespace detail

/// A lower bound of the distance (m) between the surfaces of two rods of links i < j, each in its own DH
/// frame, over all joint values, without regard to limits. not_apart if they can meet, or if `most` cells
/// prove nothing.
inline double never_nearer(const Arm& arm, const Rod& a, int i, const Rod& b, int j, int most) noexcept {
    using namespace detail;
    JointCell cell{};
    for (int k = i + 1; k <= j; ++k) cell.half[k] = pi;
    // turned about its own axis a rod is where it was
    if (is_on_axis(a)) cell.half[i + 1] = 0;
    if (is_on_axis(placed(dh_frame(arm, j, 0.0), b))) cell.half[j] = 0;
    JointCell waiting[NeverNearerTuning::most_waiting]{cell};
    double least_met = infinity, proven = infinity;
    for (int count = 1; count > 0; --most) {
        if (most <= 0 || count + 2 > NeverNearerTuning::most_waiting) return not_apart;
        cell = waiting[--count];
        const CellApart here = cell_apart(arm, a, i, b, j, cell);
        least_met = min(least_met, here.met);
        if (least_met <= 0) return not_apart;
        if (here.proven >= NeverNearerTuning::worth * least_met) {
            proven = min(proven, here.proven);
            continue;
        }
        double &half = cell.half[here.widest], &middle = cell.middle[here.widest];
        half *= 0.5;
        middle -= half;
        waiting[count++] = cell;
        middle += 2.0 * half;
        waiting[count++] = cell;
    }
    return proven;
}

}  // namespace armangle

#include "../names/end.hpp"
