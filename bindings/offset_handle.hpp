// The bound arm with an offset wrist or shoulder.
#pragma once

#include "armangle/offset.hpp"
#include "buffers.hpp"

namespace binding {

/// The arm, made once from Python's numbers: lengths d_bs, d_se, d_ew, d_wf, a_3, a_4; rows signs, offsets,
/// lower, upper (4, 7).
struct OffsetHandle {
    armangle::OffsetArm arm;
    OffsetHandle(Floats lengths, Floats joint_rows, Floats base, Floats tool, double offset, bool mirrored)
        : arm(make_offset_arm(parameters(lengths, joint_rows, base, tool), offset, mirrored)) {}

private:
    static armangle::ArmParameters parameters(Floats lengths, Floats joint_rows, Floats base, Floats tool) {
        const Buffer l(lengths), rows(joint_rows), b(base), t(tool);
        armangle::ArmParameters out;
        const double* x = l.data<double>();
        out.d_bs = x[0];
        out.d_se = x[1];
        out.d_ew = x[2];
        out.d_wf = x[3];
        out.a_3 = x[4];
        out.a_4 = x[5];
        const double* r = rows.data<double>();
        for (int j = 0; j < armangle::joints; ++j) {
            out.sign[j] = r[j];
            out.offset[j] = r[armangle::joints + j];
            out.limits.lower[j] = r[2 * armangle::joints + j];
            out.limits.upper[j] = r[3 * armangle::joints + j];
        }
        out.base = armangle::load_pose(b.data<double>());
        out.tool = armangle::load_pose(t.data<double>());
        return out;
    }
};

void bind_offset(nb::class_<OffsetHandle>& arm);

/// The arm into whose reach a rounded pose is taken.
template <class AnyArm>
const armangle::Arm& reaching(const AnyArm& arm) noexcept {
    return nominal(arm);
}
inline const armangle::OffsetArm& reaching(const armangle::OffsetArm& arm) noexcept { return arm; }

void bind_offset_stepping(nb::class_<OffsetHandle>& arm);
void bind_offset_scenes(nb::class_<OffsetHandle>& arm);
void bind_offset_planning(nb::class_<OffsetHandle>& arm);
void bind_offset_reach(nb::class_<OffsetHandle>& arm);
void bind_offset_arcs(nb::class_<OffsetHandle>& arm);
void bind_offset_solving(nb::class_<OffsetHandle>& arm);
void bind_offset_kinematics(nb::class_<OffsetHandle>& arm);

}  // namespace binding
