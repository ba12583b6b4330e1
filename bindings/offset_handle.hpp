// The bound arm with an offset wrist or shoulder.
#pragma once

#include "armangle/offset.hpp"
#include "buffers.hpp"

namespace binding {

/// The arm, made once from Python's numbers: lengths d_bs, d_se, d_ew, d_wf, a_3, a_4; rows signs, offsets,
/// lower, upper (4, 7).
struct OffsetHandle {
    armangle::OffsetArm arm;
    /// Constructs an arm with an offset (m), at the shoulder if `mirrored`, and a singularity margin (rad)
    /// from these arrays.
    OffsetHandle(Floats lengths, Floats joint_rows, Floats base, Floats tool, double offset, bool mirrored,
                 double margin)
        : arm(make_offset_arm(parameters(lengths, joint_rows, base, tool), offset, mirrored, margin)) {}

    /// The parameters of the arm without the offset, from these arrays.
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

/// The arm on its own chain with an offset nominal arm; it is no OffsetHandle, so functions that do not
/// support it cannot take it. chain: eight transforms, 16 numbers each.
struct OffsetChainHandle {
    armangle::OffsetChain arm;
    /// Constructs an arm on its own chain whose nominal arm has an offset; chain: eight transforms.
    OffsetChainHandle(Floats lengths, Floats joint_rows, Floats base, Floats tool, double offset,
                      bool mirrored, Floats chain)
        : arm(made(OffsetHandle::parameters(lengths, joint_rows, base, tool), offset, mirrored, chain)) {}

private:
    /// Makes the arm; raises unless the chain has eight transforms.
    static armangle::OffsetChain made(const armangle::ArmParameters& parameters, double offset, bool mirrored,
                                      Floats chain) {
        constexpr int links = armangle::joints + 1;
        const Buffer numbers(chain);
        if (!numbers.is_array('d', {links, 4, 4})) throw std::invalid_argument("8 transforms were expected");
        armangle::Pose<double> link[links];
        for (int k = 0; k < links; ++k) link[k] = armangle::load_pose(numbers.data<double>() + 16 * k);
        return armangle::make_offset_chain(parameters, offset, mirrored, link);
    }
};

void bind_xla(nb::module_& m, nb::class_<ArmHandle>& arm, nb::class_<ChainArmHandle>& chain,
              nb::class_<OffsetHandle>& offset, nb::class_<OffsetChainHandle>& offset_chain);
void bind_offset(nb::class_<OffsetHandle>& arm);
void bind_offset_chain(nb::class_<OffsetChainHandle>& arm);

/// The arm whose reach limits a rounded pose.
template <class AnyArm>
const armangle::Arm& reaching(const AnyArm& arm) noexcept {
    return nominal(arm);
}
/// The arm whose reach counts: itself.
inline const armangle::OffsetArm& reaching(const armangle::OffsetArm& arm) noexcept { return arm; }
/// The arm whose reach counts: the nominal one.
inline const armangle::OffsetArm& reaching(const armangle::OffsetChain& arm) noexcept { return arm.nominal; }

void bind_offset_stepping(nb::class_<OffsetHandle>& arm);
void bind_offset_scenes(nb::class_<OffsetHandle>& arm);
void bind_offset_planning(nb::class_<OffsetHandle>& arm);
void bind_offset_reach(nb::class_<OffsetHandle>& arm);
void bind_offset_arcs(nb::class_<OffsetHandle>& arm);
void bind_offset_solving(nb::class_<OffsetHandle>& arm);
void bind_offset_kinematics(nb::class_<OffsetHandle>& arm);
void bind_offset_chain_planning(nb::class_<OffsetChainHandle>& arm);
void bind_offset_chain_reach(nb::class_<OffsetChainHandle>& arm);
void bind_offset_chain_scenes(nb::class_<OffsetChainHandle>& arm);
void bind_offset_chain_stepping(nb::class_<OffsetChainHandle>& arm);
void bind_offset_chain_arcs(nb::class_<OffsetChainHandle>& arm);
void bind_offset_chain_solving(nb::class_<OffsetChainHandle>& arm);
void bind_offset_chain_kinematics(nb::class_<OffsetChainHandle>& arm);

}  // namespace binding
