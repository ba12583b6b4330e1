// The S-R-S arm of a plan as a family of closed-form self-motions: its free number is phi, the arm angle
// from the smooth plane of the path.
#pragma once

#include <array>

#include "objective.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Adapts the arm of a task to the search of a path (branch_search.hpp, which explains the members).
class TaskFamily {
public:
    /// Keeps a pointer to the task.
    explicit TaskFamily(const Task& task) noexcept : task_(&task) {}

    /// The arm.
    const Arm& rows() const noexcept { return task_->arm; }

    /// A function place(phi, near, out) that writes the directions of the joints at this pose to `out`; joint
    /// 7 keeps its value if the roll is free. It returns 1, also for the straight arm, and -1 out of reach.
    friend auto placer(const TaskFamily& family, const Pose<double>& pose, int gc) noexcept {
        const Task& task = *family.task_;
        const Circle<double> c = circle(task.arm, flange_pose(task.arm, pose), task.plane);
        const SelfMotion<double> m = self_motion(task.arm, c, configuration(gc));
        return [f = task.functions(m), elbow = m.elbow.theta_4, room = is_unreachable(c) ? -1.0 : 1.0,
                lost = std::array{shoulder_singular(m), wrist_singular(m)}]<class T>(
                   const T& phi, const double*, Directions<T>& out) noexcept -> double {
            const SinCos<T> sc = sin_cos(phi);
            const auto at = [&sc](const Harmonic<double>& x) {
                return T(x.s) * sc.sin + T(x.c) * sc.cos + T(x.k);
            };
            for (int p = 0; p < pivots; ++p) {
                const Pivot<double>& pivot = f.pivot[p];
                const int j = pivot_joint[p];
                out.y[j] = at(pivot.U) * T(pivot.g);
                out.x[j] = at(pivot.V) * T(pivot.g);
                if (p % 2) continue;
                const auto h = static_cast<std::size_t>(p / 2);
                const Hinge<double>& hinge = f.hinge[h];
                out.y[hinge_joint[h]] = lost[h] ? T(0.0) : hypot(out.y[j], out.x[j]) * T(hinge.g);
                out.x[hinge_joint[h]] = at(hinge.H);
            }
            out.y[3] = T(elbow.sin);
            out.x[3] = T(elbow.cos);
            return room;
        };
    }
    /// The value of joint j without any reference (rad): the middle of its range, or its fixed value.
    friend double at_rest(const TaskFamily& family, int j) noexcept { return family.task_->at_rest(j); }

    /// theta: angles of the joints. Distances from where the margin from theta_2, theta_6 = 0 begins.
    template <class T, class Take>
    void singular_distances(const T* theta, const Take& take) const noexcept {
        for (const int j : {1, 5})
            detail::singular_distances(*task_, theta[j], [&](const T& x, Kind) { take(x); });
    }

private:
    const Task* task_;
};

}  // namespace armangle

#include "../names/end.hpp"
