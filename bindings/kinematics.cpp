// Forward, inverse, Jacobian, self-motion.
#include <memory>

#include "offset_handle.hpp"
#include "elements.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Writes the joints of a pose (16 numbers), psi (rad) and gc of an S-R-S arm to q, ignoring limits; false if
/// one is invalid, psi exceeds `likely_degrees`, or the pose is out of reach or folded.
bool solve_regular(const Arm& arm, const double* m, double psi, long long gc, double* q) noexcept {
    double value;
    if (!(std::fabs(psi) <= likely_degrees) || gc < 0 || gc >= configurations) return false;
    if (check_pose(arm, m, value) != Problem::none) return false;
    const SelfMotion<double> motion = self_motion(arm, load_pose(m), static_cast<int>(gc));
    if (is_folded(motion.circle) || is_unreachable(motion.circle)) return false;
    const Joints found = joints_within_limits(arm, directions(motion, sin_cos(psi)), nullptr);
    std::memcpy(q, found.q, joints * sizeof(double));
    return true;
}
/// Writes the joints of a pose (16 numbers), psi (rad) and gc of a nearly S-R-S arm to q; false if one is
/// invalid, psi exceeds two turns, or no solution is found.
bool solve_regular(const ChainArm& arm, const double* m, double psi, long long gc, double* q) noexcept {
    double value;
    if (!(std::fabs(psi) <= likely_degrees) || gc < 0 || gc >= configurations) return false;
    if (check_pose(arm, m, value) != Problem::none) return false;
    const Inverse found = inverse(arm, load_pose(m), psi, static_cast<int>(gc));
    std::memcpy(q, found.q, joints * sizeof(double));
    return found.status == Status::OK;
}

/// The joints (7,) of the inverse of a (4,4) matrix, a float psi and an integer gc, or those (n, 7) of up to
/// `few` rows of them. None for any other arguments, out of reach, or beyond required limits: the general
/// function then answers, or raises.
template <class Handle>
nb::object inverse_few(const Handle& self, nb::handle pose, nb::handle psi, nb::handle gc, bool limits) {
    const Limits& own = reaching(self.arm).limits;
    const auto kept = [&](const double* q) { return !limits || limit_margin(own, q) >= -tolerance::angle; };
    double m[16], angle = 0, q[few * joints];
    long long branch[few];
    const bool one_angle = as_double(psi, angle);
    if (one_angle && as_index(gc, branch[0]) && SmallMatrix().read_pose(reaching(self.arm), pose, m)) {
        if (!solve_regular(self.arm, m, angle, branch[0], q) || !kept(q)) return nb::none();
        return filled(new_array7(), q, joints);
    }
    Buffer poses, angles;
    const Py_ssize_t n = few_rows(pose, poses, {4, 4});
    if (!n || !(one_angle || few_rows(psi, angles, {}) == n) || !few_branches(gc, n, branch))
        return nb::none();
    for (Py_ssize_t i = 0; i < n; ++i) {
        const double at = one_angle ? angle : angles.data<double>()[i];
        double* to = q + i * joints;
        if (!solve_regular(self.arm, poses.data<double>() + 16 * i, at, branch[i], to) || !kept(to))
            return nb::none();
    }
    return filled(new_rows(n, joints), q, static_cast<std::size_t>(n) * joints);
}

/// Inverse kinematics of arrays of poses, psi and branches; writes joints (..., 7). A seed (None: no seed)
/// chooses the turn of each joint. `all_branches` only words errors.
template <class Handle>
void inverse_many(const Handle& self, Floats pose, Floats psi, Ints gc, Floats seed, Floats out,
                  Enforce limits, Enforce unreachable, int threads, bool all_branches) {
    const Buffer p(pose), a(psi), g(gc), q(out, true);
    Buffer s;
    if (!seed.is_none()) s.get(seed);
    const Grid<5> grid({&p, &a, &g, s.held() ? &s : nullptr, &q}, {2, 0, 0, 1, 1});
    Outcome outcomes[most_threads];
    watched(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        grid.for_runs(
            begin, end,
            [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                InverseBatch b;
                b.pose = {p.data<double>() + at[0], step[0]};
                b.psi = {a.data<double>() + at[1], step[1]};
                b.gc = {g.data<long long>() + at[2], step[2]};
                b.seed = {s.held() ? s.data<double>() + at[3] : nullptr, step[3]};
                b.out = {q.data<double>() + at[4], step[4]};
                b.limits = limits;
                b.unreachable = unreachable;
                Outcome here;
                inverse_range(self.arm, b, 0, count, here);
                if (here.problem != Problem::none)
                    outcomes[thread].report(here.problem, flat + here.index, here.value);
            },
            [&](std::size_t done) { return watch.ended(thread, done); });
    });
    const Outcome found = first_problem(outcomes, most_threads);
    const bool of_branch = all_branches && !is_in_one_value(found.problem);
    refuse(found, p, 2, of_branch ? "branch" : "pose", "seed");
}

/// Forward kinematics of one small vector (7,): returns (pose, psi, gc). None for any other argument, or if
/// the arm angle does not exist: the general function then answers, or raises.
template <class Handle>
nb::object forward_one(const Handle& self, nb::handle q) {
    double joint[joints], value;
    if (!SmallMatrix().read(q, 1, joints, joint) || check_joints(self.arm, joint, value) != Problem::none)
        return nb::none();
    const Posture posture = forward(self.arm, joint);
    if (std::isnan(posture.psi)) return nb::none();
    nb::object pose = new_array44();
    const Buffer to(pose, true);
    store_pose(posture.pose, to.data<double>());
    return nb::make_tuple(pose, numpy_float(posture.psi), numpy_index(posture.gc));
}

/// Forward kinematics of joints (..., 7); writes poses, psi and branches. With `nan`, psi is NaN where it
/// does not exist, instead of an error.
template <class Handle>
void forward_many(const Handle& self, Floats q, Floats pose, Floats psi, Ints gc, bool nan, int threads) {
    const Buffer in(q), p(pose, true), a(psi, true), g(gc, true);
    for_each<4>("q", {&in, &p, &a, &g}, {1, 2, 0, 0}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const Problem problem = check_joints(self.arm, joint, value);
        if (problem != Problem::none) return problem;
        const Posture posture = forward(self.arm, joint);
        store_pose(posture.pose, p.data<double>() + at[1]);
        a.data<double>()[at[2]] = posture.psi;
        g.data<long long>()[at[3]] = posture.gc;
        return std::isnan(posture.psi) && !nan ? Problem::folded : Problem::none;
    });
}

/// Writes the eight link frames (..., 8, 4, 4) of joints (..., 7).
template <class Handle>
void frames_many(const Handle& self, Floats q, Floats out, int threads) {
    for_each_joints<double>(self.arm, q, out, 3, threads, [&](const double* joint, double* to) {
        Pose<double> frame[joints + 1];
        frames(self.arm, joint, frame);
        for (int i = 0; i <= joints; ++i) store_pose(frame[i], to + 16 * i);
    });
}

/// Writes the elbow positions (..., 3) of joints (..., 7).
template <class Handle>
void elbow_many(const Handle& self, Floats q, Floats out, int threads) {
    for_each_joints<double>(self.arm, q, out, 1, threads, [&](const double* joint, double* to) {
        const Vec3<double> elbow = elbow_position(self.arm, joint);
        to[0] = elbow.x;
        to[1] = elbow.y;
        to[2] = elbow.z;
    });
}

/// The psi of an elbow's target, or the problem if there is none.
struct Wished {
    double psi;
    Problem problem;
    double value;
};

/// The psi nearest to a target of the elbow, or the problem if there is none.
Wished wished_psi(const Arm& arm, const Pose<double>& pose, int gc, const Towards& wish) {
    const SelfMotion<double> motion = self_motion(arm, pose, gc);
    const WishedPsi found = psi_towards(arm, motion, wish);
    if (found.why == Indifferent::no) return {found.psi, Problem::none, 0};
    if (is_unreachable(motion.circle))
        return {found.psi, Problem::unreachable, motion.circle.triangle.excess};
    if (is_folded(motion.circle)) return {found.psi, Problem::folded, 0};
    return {found.psi, found.why == Indifferent::still ? Problem::still : Problem::on_axis, 0};
}
/// The value of the free joint nearest to a target of the elbow, or the problem if there is none.
Wished wished_psi(const OffsetArm& arm, const Pose<double>& pose, int gc, const Towards& wish) {
    const WishedPsi found = psi_towards(arm, pose, gc, wish);
    if (found.why == Indifferent::on_axis) return {found.psi, Problem::on_end, 0};
    if (!std::isnan(found.psi)) return {found.psi, Problem::none, 0};
    const double excess = reach_excess(arm, pose);
    return {found.psi, excess > 0 ? Problem::unreachable : Problem::no_posture, excess};
}

/// Writes the psi of the elbow's target (..., 3), a point (m) or direction as `wish` says, for each pose and
/// branch; with `nan`, NaN if there is none, instead of an error.
template <class Handle>
void psi_towards_many(const Handle& self, Floats pose, Ints gc, Wish wish, Floats target, Floats out,
                      bool nan, int threads) {
    const Buffer p(pose), g(gc), t(target), to(out, true);
    for_each<4>("pose", {&p, &g, &t, &to}, {2, 0, 1, 0}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* m = p.data<double>() + at[0];
        const Problem problem = check_pose(self.arm, m, value);
        if (problem != Problem::none) return problem;
        const long long branch = g.data<long long>()[at[1]];
        if (branch < 0 || branch >= configurations) {
            value = static_cast<double>(branch);
            return Problem::gc_range;
        }
        const double* v = t.data<double>() + at[2];
        const Wished found =
            wished_psi(self.arm, load_pose(m), static_cast<int>(branch), {wish, 0.0, {v[0], v[1], v[2]}});
        to.data<double>()[at[3]] = found.psi;
        value = found.value;
        return nan ? Problem::none : found.problem;
    });
}

/// Writes the Jacobians (..., 6, 7) of joints (..., 7).
template <class Handle>
void jacobian_many(const Handle& self, Floats q, Floats out, int threads) {
    for_each_joints<double>(self.arm, q, out, 2, threads, [&](const double* joint, double* to) {
        const Jacobian j = jacobian(self.arm, joint);
        std::memcpy(to, j.entry, sizeof(j.entry));
    });
}

/// Writes the gradients dpsi/dq (..., 7) of joints (..., 7).
template <class Handle>
void psi_gradient_many(const Handle& self, Floats q, Floats out, int threads) {
    for_each_joints<double>(self.arm, q, out, 1, threads, [&](const double* joint, double* to) {
        double gradient[joints];
        psi_gradient(self.arm, joint, gradient);
        std::memcpy(to, gradient, sizeof(gradient));
    });
}

/// Writes the distance (rad) of joints (..., 7) to their nearest limit.
template <class Handle>
void limit_margin_many(const Handle& self, Floats q, Floats out) {
    for_each_joints<double>(self.arm, q, out, 0, 1, [&](const double* joint, double* to) {
        *to = limit_margin(nominal(self.arm).limits, joint);
    });
}

/// Writes dq/dpsi (..., 7) of an S-R-S arm for each pose, psi and branch.
void self_motion_many(const ArmHandle& self, Floats pose, Floats psi, Ints gc, Floats out, int threads) {
    for_each_asked(self.arm, pose, psi, gc, out, 1, threads, [&](const Asked& asked, double* to, double&) {
        const SelfMotion<double> m = self_motion(self.arm, asked.pose, asked.gc);
        const Joints dq = rate(self.arm, joint_functions(m), sin_cos(asked.psi));
        std::memcpy(to, dq.q, joints * sizeof(double));
        return Problem::none;
    });
}

/// The distance (m) of an unsolvable pose beyond the reach, the least over all psi.
double excess_of(const ChainArm& arm, const Asked& asked) { return reach_excess(arm, asked.pose); }
/// By how much (m) the wrist is out of reach at a value of the free joint.
template <free_joint_arm A>
double excess_of(const A& arm, const Asked& asked) {
    return reach_excess(arm, asked.pose, asked.psi);
}

/// Writes dq/dpsi of a nearly S-R-S arm, or dq/d(free joint) of an arm with an offset.
template <class Handle>
void self_motion_rate_many(const Handle& self, Floats pose, Floats psi, Ints gc, Floats out, int threads) {
    for_each_asked(self.arm, pose, psi, gc, out, 1, threads,
                   [&](const Asked& asked, double* to, double& value) {
                       const Inverse dq = self_motion_rate(self.arm, asked.pose, asked.psi, asked.gc);
                       if (dq.status == Status::UNREACHABLE) value = excess_of(self.arm, asked);
                       std::memcpy(to, dq.q, joints * sizeof(double));
                       return detail::problem_of(dq.status);
                   });
}

/// Writes the derivatives (..., 7, 7) of the joints with respect to twist and psi; with `nan`, NaN if the
/// pose has no solution.
void inverse_derivative_many(const ArmHandle& self, Floats pose, Floats psi, Ints gc, Floats out, bool nan,
                             int threads) {
    const Buffer p(pose), a(psi), g(gc), to(out, true);
    for_each_run<4>("pose", {&p, &a, &g, &to}, {2, 0, 0, 2}, threads,
                    [&](const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count, Outcome& outcome) {
                        InverseBatch b = asked_batch(p, a, g, at, step, nan);
                        b.out = {to.data<double>() + at[3], step[3]};
                        derivative_range(self.arm, b, 0, count, outcome);
                    });
}

/// Writes the derivatives (..., 7, 7) of the joints of any other arm with respect to twist and psi; with
/// `nan`, NaN if the pose has no solution.
template <class Handle>
void other_derivative_many(const Handle& self, Floats pose, Floats psi, Ints gc, Floats out, bool nan,
                           int threads) {
    for_each_asked(
        self.arm, pose, psi, gc, out, 2, threads, [&](const Asked& asked, double* to, double& value) {
            const Derivatives d = inverse_derivative(self.arm, asked.pose, asked.psi, asked.gc);
            if (d.status == Status::UNREACHABLE) value = excess_of(self.arm, asked);
            std::memcpy(to, d.entry, sizeof(d.entry));
            return nan && d.status != Status::BAD_INPUT ? Problem::none : detail::problem_of(d.status);
        });
}

/// Converts gradients with respect to the joints (..., 7) to gradients with respect to poses (..., 4, 4) and
/// psi; for the operators of torch.
template <class Handle>
void inverse_pullback_many(const Handle& self, Floats pose, Floats psi, Ints gc, Floats by_q, Floats by_pose,
                           Floats by_psi, bool nan) {
    const Buffer p(pose), a(psi), g(gc), q(by_q), to(by_pose, true), to_psi(by_psi, true);
    for_each_run<6>("pose", {&p, &a, &g, &q, &to, &to_psi}, {2, 0, 0, 1, 2, 0}, 1,
                    [&](const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count, Outcome& outcome) {
                        const PullbackBatch b{asked_batch(p, a, g, at, step, nan),
                                              {q.data<double>() + at[3], step[3]},
                                              {to.data<double>() + at[4], step[4]},
                                              {to_psi.data<double>() + at[5], step[5]}};
                        pullback_range(self.arm, b, 0, count, outcome);
                    });
}

/// Converts gradients with respect to poses and psi to gradients with respect to the joints; with `nan`, NaN
/// if they do not exist.
template <class Handle>
void forward_pullback_many(const Handle& self, Floats q, Floats by_pose, Floats by_psi, Floats by_q,
                           bool nan) {
    const Buffer in(q), p(by_pose), a(by_psi), to(by_q, true);
    for_each<4>("q", {&in, &p, &a, &to}, {1, 2, 0, 1}, 1, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const Problem problem = check_joints(self.arm, joint, value);
        if (problem != Problem::none) return problem;
        double gradient[joints];
        const Hindrance why =
            forward_pullback(self.arm, joint, p.data<double>() + at[1], a.data<double>()[at[2]], gradient);
        std::memcpy(to.data<double>() + at[3], gradient, sizeof(gradient));
        value = static_cast<double>(why);
        return why == Hindrance::none || nan ? Problem::none : Problem::no_derivative;
    });
}

/// Converts gradients with respect to twists (..., 6) to gradients with respect to the entries of poses.
void pose_gradient_many(Floats pose, Floats by_twist, Floats by_pose) {
    const Buffer p(pose), t(by_twist), to(by_pose, true);
    for_each<3>("pose", {&p, &t, &to}, {2, 1, 2}, 1, [&](const Py_ssize_t* at, double&) {
        const double* g = t.data<double>() + at[1];
        const Pose<double> here = load_pose(p.data<double>() + at[0]);
        store_gradient(pose_gradient(here, {g[0], g[1], g[2]}, {g[3], g[4], g[5]}),
                       to.data<double>() + at[2]);
        return Problem::none;
    });
}

/// Writes the gradients (..., 7) of the distance to the nearest limit.
template <class Handle>
void limit_margin_gradient_many(const Handle& self, Floats q, Floats out) {
    for_each_joints<double>(self.arm, q, out, 1, 1, [&](const double* joint, double* to) {
        double slope[joints];
        limit_margin_gradient(nominal(self.arm).limits, joint, slope);
        std::memcpy(to, slope, sizeof(slope));
    });
}

/// Writes the nearest reachable pose and returns its distance (m) from the given one.
template <class Handle>
double nearest_pose(const Handle& self, Floats pose, Floats out) {
    const Buffer from(pose), to(out, true);
    const NearestPose nearest = nearest_within_reach(self.arm, load_pose(from.data<double>()));
    store_pose(nearest.pose, to.data<double>());
    return nearest.gap;
}

/// Converts joint values (..., 7) to model angles theta, or back (joint_map.hpp).
template <class Handle, bool to_model>
void joint_map_many(const Handle& self, Floats from, Floats to) {
    const Buffer in(from), out(to, true);
    for_each<2>("q", {&in, &out}, {1, 1}, 1, [&](const Py_ssize_t* at, double&) {
        for (int j = 0; j < joints; ++j) {
            const double value = in.data<double>()[at[0] + j];
            out.data<double>()[at[1] + j] =
                to_model ? to_theta(nominal(self.arm), j, value) : to_q(nominal(self.arm), j, value);
        }
        return Problem::none;
    });
}

/// Corrects poses in place for the rounding of their numbers to `precision` (ratio).
template <class Handle>
void correct_poses_many(const Handle& self, Floats poses, double precision) {
    const Buffer in_place(poses, true);
    for_each<1>("pose", {&in_place}, {2}, 1, [&](const Py_ssize_t* at, double&) {
        correct_rounding(reaching(self.arm), precision, in_place.data<double>() + at[0]);
        return Problem::none;
    });
}

/// Binds the functions that have the same form for S-R-S and nearly S-R-S arms.
template <class Handle>
void bind_both(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    bind_checks(arm);
    arm.def("inverse_many", &inverse_many<Handle>, "pose"_a, "psi"_a, "gc"_a, "seed"_a.none(), "out"_a,
            "limits"_a, "unreachable"_a, "threads"_a, "all_branches"_a = false);
    arm.def("forward_one", &forward_one<Handle>, "q"_a.none());
    arm.def("forward_many", &forward_many<Handle>, "q"_a, "pose"_a, "psi"_a, "gc"_a, "nan"_a, "threads"_a);
    arm.def("frames_many", &frames_many<Handle>, "q"_a, "out"_a, "threads"_a);
    arm.def("elbow_many", &elbow_many<Handle>, "q"_a, "out"_a, "threads"_a);
    arm.def("jacobian_many", &jacobian_many<Handle>, "q"_a, "out"_a, "threads"_a);
    arm.def("theta_many", &joint_map_many<Handle, true>, "q"_a, "out"_a);
    arm.def("q_many", &joint_map_many<Handle, false>, "theta"_a, "out"_a);
    arm.def("correct_poses_many", &correct_poses_many<Handle>, "poses"_a, "precision"_a);
    arm.def("limit_margin_many", &limit_margin_many<Handle>, "q"_a, "out"_a);
    arm.def("limit_margin_gradient_many", &limit_margin_gradient_many<Handle>, "q"_a, "out"_a);
}

/// Binds the gradients of forward and inverse kinematics.
template <class Handle>
void bind_gradients(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    constexpr auto derivative_many = [] {
        if constexpr (std::is_same_v<Handle, ArmHandle>)
            return &inverse_derivative_many;
        else
            return &other_derivative_many<Handle>;
    }();
    arm.def("inverse_derivative_many", derivative_many, "pose"_a, "psi"_a, "gc"_a, "out"_a, "nan"_a,
            "threads"_a);
    arm.def("inverse_pullback_many", &inverse_pullback_many<Handle>, "pose"_a, "psi"_a, "gc"_a, "by_q"_a,
            "by_pose"_a, "by_psi"_a, "nan"_a);
    arm.def("forward_pullback_many", &forward_pullback_many<Handle>, "q"_a, "by_pose"_a, "by_psi"_a, "by_q"_a,
            "nan"_a);
    arm.def("psi_gradient_many", &psi_gradient_many<Handle>, "q"_a, "out"_a, "threads"_a);
}

}  // namespace

/// Registers Enforce, Wish, pose_gradient_many, and the kinematics of an S-R-S arm.
void bind_kinematics(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Enforce>(m, "Enforce")
        .value("IGNORE", Enforce::ignore)
        .value("RAISE", Enforce::raise)
        .value("NAN", Enforce::nan);
    arm.def("inverse_few", &inverse_few<ArmHandle>, "pose"_a.none(), "psi"_a.none(), "gc"_a.none(),
            "limits"_a = false);
    bind_both(arm);
    nb::enum_<Wish>(m, "Wish")
        .value("PSI", Wish::psi)
        .value("POINT", Wish::point)
        .value("DIRECTION", Wish::direction);
    arm.def("psi_towards_many", &psi_towards_many<ArmHandle>, "pose"_a, "gc"_a, "wish"_a, "target"_a, "out"_a,
            "nan"_a, "threads"_a);
    arm.def("self_motion_many", &self_motion_many, "pose"_a, "psi"_a, "gc"_a, "out"_a, "threads"_a);
    bind_gradients(arm);
    m.def("pose_gradient_many", &pose_gradient_many, "pose"_a, "by_twist"_a, "by_pose"_a);
    arm.def("nearest_pose", &nearest_pose<ArmHandle>, "pose"_a, "out"_a);
}

/// Binds the kinematics of a nearly S-R-S arm.
void bind_chain_kinematics(nb::class_<ChainArmHandle>& arm) {
    using namespace nb::literals;
    arm.def("inverse_few", &inverse_few<ChainArmHandle>, "pose"_a.none(), "psi"_a.none(), "gc"_a.none(),
            "limits"_a = false);
    bind_both(arm);
    bind_gradients(arm);
    arm.def("self_motion_many", &self_motion_rate_many<ChainArmHandle>, "pose"_a, "psi"_a, "gc"_a, "out"_a,
            "threads"_a);
}

/// Binds the functions that arms with an offset have with and without an own chain.
template <class Handle>
void bind_offset_rows(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("correct_poses_many", &correct_poses_many<Handle>, "poses"_a, "precision"_a);
    arm.def("theta_many", &joint_map_many<Handle, true>, "q"_a, "out"_a);
    arm.def("q_many", &joint_map_many<Handle, false>, "theta"_a, "out"_a);
    arm.def("limit_margin_many", &limit_margin_many<Handle>, "q"_a, "out"_a);
    arm.def("limit_margin_gradient_many", &limit_margin_gradient_many<Handle>, "q"_a, "out"_a);
    arm.def("jacobian_many", &jacobian_many<Handle>, "q"_a, "out"_a, "threads"_a);
    arm.def("self_motion_many", &self_motion_rate_many<Handle>, "pose"_a, "psi"_a, "gc"_a, "out"_a,
            "threads"_a);
    bind_gradients(arm);
    arm.def_prop_ro("reach", [](const Handle& a) { return nominal(a.arm).reach; });
    arm.def_prop_ro("inner_reach", [](const Handle& a) { return nominal(a.arm).inner_reach; });
    arm.def_prop_ro("delta", [](const Handle& a) { return nominal(a.arm).delta_angle; });
}

/// Binds the kinematics of an arm with an offset and its own chain.
void bind_offset_chain_kinematics(nb::class_<OffsetChainHandle>& arm) { bind_offset_rows(arm); }

/// Binds the kinematics of an arm with an offset.
void bind_offset_kinematics(nb::class_<OffsetHandle>& arm) {
    using namespace nb::literals;
    arm.def("psi_towards_many", &psi_towards_many<OffsetHandle>, "pose"_a, "gc"_a, "wish"_a, "target"_a,
            "out"_a, "nan"_a, "threads"_a);
    arm.def("nearest_pose", &nearest_pose<OffsetHandle>, "pose"_a, "out"_a);
    bind_offset_rows(arm);
}

}  // namespace binding
