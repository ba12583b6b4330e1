// Views of arrays owned by the caller: strided elements, poses as 4x4 matrices, and the first invalid element
// of a batch.
#pragma once

#include <cstddef>

#include "linalg.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// An array of elements `stride` doubles (or integers) apart; stride 0 repeats one element.
template <class T>
struct Strided {
    T* data;
    std::ptrdiff_t stride;

    /// A pointer to element i, whether or not the array is that long.
    T* at(std::size_t i) const noexcept { return data + static_cast<std::ptrdiff_t>(i) * stride; }
    /// The array that starts at element i.
    Strided from(std::size_t i) const noexcept { return {at(i), stride}; }
};

/// Everything that can be wrong with an element of a batch.
enum class Problem : int {
    none = 0,
    pose_not_finite,
    pose_last_row,      // a 4x4 pose ends with 0 0 0 1
    pose_not_rotation,  // value: largest entry of |R^T R - I|
    pose_reflection,
    pose_too_far,         // value: m, beyond tolerance::farthest
    pose_in_millimetres,  // value: m, far beyond the sum of all lengths of the arm
    psi_not_finite,       // or beyond tolerance::largest_angle; also used for joints
    gc_range,             // value: the gc
    joints_not_finite,
    joints_in_degrees,  // value: a joint value more than a turn outside its limits
    unreachable,        // value: distance (m) beyond the reach, or inside the inner reach
    folded,
    joint_limit,     // value: joint 1..7
    still,           // psi does not move the elbow
    on_axis,         // no place of the elbow is nearer to the target than another
    not_unit,        // value: the length of a quaternion
    near_singular,   // a nearly S-R-S arm near a singularity, where branches meet
    no_convergence,  // the iteration for a nearly S-R-S arm did not converge
    on_end,          // of an arm with an offset: the same, of the shoulder or the wrist
    no_posture,      // of an arm with an offset: at this value of the free joint, or of the branch
    no_derivative,   // value: the Hindrance
};

/// The first problem of a batch: its kind, its index, and the offending value.
struct Outcome {
    Problem problem = Problem::none;
    std::size_t index = 0;
    double value = 0;

    /// Records a problem unless an earlier index already has one.
    void report(Problem p, std::size_t i, double v) noexcept {
        if (problem == Problem::none || i < index) {
            problem = p;
            index = i;
            value = v;
        }
    }
};

/// Reads a 4x4 row-major homogeneous matrix as a pose.
inline Pose<double> load_pose(const double* m) noexcept {
    return {{{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}}, {m[3], m[7], m[11]}};
}

/// Writes a pose to m as 16 numbers, row by row.
inline void store_pose(const Pose<double>& p, double* m) noexcept {
    const auto& [x, y, z] = p.rotation;
    const double rows[16] = {x.x, y.x, z.x, p.position.x, x.y, y.y, z.y, p.position.y,
                             x.z, y.z, z.z, p.position.z, 0,   0,   0,   1};
    for (int i = 0; i < 16; ++i) m[i] = rows[i];
}

/// Checks a 4x4 pose (16 numbers, row by row). Returns the problem, or none, and stores the offending value.
inline Problem check_pose(const double* m, double& value) noexcept {
    for (int i = 0; i < 16; ++i)
        if (!std::isfinite(m[i])) {
            value = m[i];
            return Problem::pose_not_finite;
        }
    for (int i = 0; i < 4; ++i)
        if (m[12 + i] != (i == 3 ? 1.0 : 0.0)) {
            value = m[12 + i];
            return Problem::pose_last_row;
        }
    const Mat3<double> r = load_pose(m).rotation;
    value = orthonormality_error(r);
    if (!(value <= tolerance::rotation)) return Problem::pose_not_rotation;
    if (dot(cross(r.x, r.y), r.z) < 0) return Problem::pose_reflection;
    value = abs(m[3]) + abs(m[7]) + abs(m[11]);
    if (!(value <= tolerance::farthest)) return Problem::pose_too_far;
    return Problem::none;
}

}  // namespace armangle

#include "../names/end.hpp"
