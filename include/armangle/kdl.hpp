// The library as a solver behind KDL's interface. Optional: needs orocos-kdl, and is not part of
// armangle.hpp.
#pragma once

#include <kdl/chainiksolver.hpp>

#include "armangle.hpp"

namespace armangle {

inline Pose<double> from_kdl(const KDL::Frame& f) noexcept {
    const auto column = [&](int i) { return Vec3<double>{f.M(0, i), f.M(1, i), f.M(2, i)}; };
    return {{column(0), column(1), column(2)}, {f.p.x(), f.p.y(), f.p.z()}};
}

inline KDL::Frame to_kdl(const Pose<double>& p) {
    const auto& [x, y, z] = p.rotation;
    return {KDL::Rotation(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z),
            KDL::Vector(p.position.x, p.position.y, p.position.z)};
}

/// KDL::ChainIkSolverPos of an S-R-S arm, in closed form: q_init says the branch and the arm angle to stay
/// near.
///
/// The elbow stays as near to that of q_init as the joint limits allow. The branch of q_init is kept where it
/// holds a solution; else the solution of the other seven that moves its furthest joint least. No solution is
/// an error code with the library's own sentence in strError; q_out is then left alone. `arm` must be the
/// chain's: same frames, same joint coordinates.
class ChainIkSolverPos : public KDL::ChainIkSolverPos {
public:
    static constexpr int first_error = -100;  // error = first_error - Status

    explicit ChainIkSolverPos(const Arm& arm, double singularity_margin = 0.0)
        : arm_(arm), limits_(limit_table(arm, singularity_margin)) {}

    int CartToJnt(const KDL::JntArray& q_init, const KDL::Frame& p_in, KDL::JntArray& q_out) override {
        if (q_init.rows() != joints || q_out.rows() != joints) return error = E_SIZE_MISMATCH;
        double seed[joints];
        for (unsigned i = 0; i < joints; ++i) seed[i] = q_init(i);
        const Pose<double> pose = from_kdl(p_in);
        if (!is_finite(seed) || !is_rigid(pose)) return error = E_UNDEFINED;
        Joints q;
        const Status status = solve(seed, pose, q);
        if (status != Status::OK) return error = first_error - static_cast<int>(status);
        for (unsigned i = 0; i < joints; ++i) q_out(i) = q.q[i];
        return error = E_NOERROR;
    }

    void updateInternalDataStructures() override {}  // the arm is a constant

    const char* strError(const int code) const override {
        const int status = first_error - code;
        if (status > 0 && status < status_count) return sentence(static_cast<Status>(status));
        return KDL::SolverI::strError(code);
    }

private:
    /// One branch: the feasible psi nearest to the elbow axis z3 of the seed, and its joints.
    Status solve_branch(const Circle<double>& c, int gc, const Vec3<double>& z3, const double* seed,
                        Joints& q) const noexcept {
        const SelfMotion<double> m = self_motion(arm_, c, configuration(gc));
        ArcSet arcs;
        const Status status = feasible(m, limits_, arcs);
        if (status != Status::OK) return status;
        q = joints_within_limits(arm_, directions(m, sin_cos(nearest(arcs, arm_angle(c, z3)))), seed);
        return Status::OK;
    }

    Status solve(const double* seed, const Pose<double>& pose, Joints& q) const noexcept {
        const Chain now = chain(arm_, seed);
        const Circle<double> c = circle(arm_, flange_pose(arm_, pose));
        const int own = index(configuration(arm_, now.theta));
        const Status status = solve_branch(c, own, now.z3, seed, q);
        if (status == Status::OK) return status;
        double least = infinity;
        for (int gc = 0; gc < configurations; ++gc) {
            Joints other;
            if (gc == own || solve_branch(c, gc, now.z3, seed, other) != Status::OK) continue;
            const double move = detail::largest_move(other.q, seed);
            if (move < least) {
                least = move;
                q = other;
            }
        }
        return least < infinity ? Status::OK : status;
    }

    Arm arm_;
    LimitTable limits_;
};

}  // namespace armangle
