// The library as a solver with KDL's interface. Optional: it needs orocos-kdl and is not part of
// armangle.hpp.
#pragma once

#include <kdl/chainiksolver.hpp>

#include "armangle.hpp"

#include "names/begin.hpp"

namespace armangle {

/// Converts a KDL frame to a pose.
inline Pose<double> from_kdl(const KDL::Frame& f) noexcept {
    const auto column = [&](int i) { return Vec3<double>{f.M(0, i), f.M(1, i), f.M(2, i)}; };
    return {{column(0), column(1), column(2)}, {f.p.x(), f.p.y(), f.p.z()}};
}

/// Converts a pose to a KDL frame.
inline KDL::Frame to_kdl(const Pose<double>& p) {
    const auto& [x, y, z] = p.rotation;
    return {KDL::Rotation(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z),
            KDL::Vector(p.position.x, p.position.y, p.position.z)};
}

/// KDL::ChainIkSolverPos for an S-R-S arm: the solution nearest to q_init.
///
/// It is the nearest over all branches, arm angles and turns within the limits, by the root of the sum of
/// squares (nearest_posture). A q_init that solves the pose is returned unchanged. For a loop that must keep
/// its branch see armangle::step. Without a solution the result is an error code, strError has its sentence,
/// and q_out is unchanged. `arm` must match the chain: same frames, same joint coordinates.
class ChainIkSolverPos : public KDL::ChainIkSolverPos {
public:
    static constexpr int first_error = -100;  // error = first_error - Status

    /// A solver for an arm, which it copies, within limits reduced by a singularity margin (rad).
    explicit ChainIkSolverPos(const Arm& arm, double singularity_margin = 0.0)
        : arm_(arm), limits_(limit_table(arm, singularity_margin)) {}

    /// KDL's interface: the joints of a pose that are nearest to q_init; returns KDL's code, E_NOERROR if
    /// found.
    int CartToJnt(const KDL::JntArray& q_init, const KDL::Frame& p_in, KDL::JntArray& q_out) override {
        if (q_init.rows() != joints || q_out.rows() != joints) return error = E_SIZE_MISMATCH;
        double seed[joints];
        for (unsigned i = 0; i < joints; ++i) seed[i] = q_init(i);
        const Pose<double> pose = from_kdl(p_in);
        if (!is_finite(seed) || !is_rigid(pose)) return error = E_UNDEFINED;
        NearestOptions options;
        options.near = seed;
        const Nearest found = nearest_posture(arm_, limits_, pose, options);
        if (!is_solved(found.status)) return error = first_error - static_cast<int>(found.status);
        for (unsigned i = 0; i < joints; ++i) q_out(i) = found.q[i];
        return error = E_NOERROR;
    }

    /// KDL's interface; does nothing.
    void updateInternalDataStructures() override {}  // nothing to update: the arm is constant

    /// The meaning of a code that CartToJnt() returned.
    const char* strError(const int code) const override {
        const int status = first_error - code;
        if (status > 0 && status < status_count) return sentence(static_cast<Status>(status));
        return KDL::SolverI::strError(code);
    }

private:
    Arm arm_;
    LimitTable limits_;
};

}  // namespace armangle

#include "names/end.hpp"
