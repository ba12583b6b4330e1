// Paths, plans, their curves, and explanations of failed plans.
#include "armangle/plan.hpp"

#include "armangle/plan/curve_through.hpp"
#include "armangle/plan/rows_within.hpp"
#include "armangle/offset/offset_curve.hpp"

#include <nanobind/stl/vector.h>

#include <bitset>
#include <exception>
#include <map>

#include "arc_arrays.hpp"
#include "offset_handle.hpp"
#include "refusal.hpp"
#include "scene_handle.hpp"
#include "watch.hpp"

namespace binding {

using namespace armangle;

namespace {

/// The rows of a buffer as segments.
const Segment* as_segments(const Buffer& b) noexcept {
    return reinterpret_cast<const Segment*>(b.data<double>());
}
/// The vector of three numbers.
Vec3<double> as_vector(const double* v) noexcept { return {v[0], v[1], v[2]}; }

/// Writes the segments through n poses at rising s; one pose gives a constant path.
void path_waypoints(Floats poses, Floats s, Floats out) {
    const Buffer p(poses), at(s), to(out, true);
    const double* const begins = at.data<double>();
    const auto n = static_cast<std::size_t>(p.shape(0));
    auto* segments = reinterpret_cast<Segment*>(to.data<double>());
    const std::size_t count = n > 1 ? n - 1 : 1;
    const auto pose = [&](std::size_t i) { return load_pose(p.data<double>() + 16 * (i < n ? i : n - 1)); };
    for (std::size_t i = 0; i < count; ++i)
        segments[i] = line(begins[i], n > 1 ? begins[i + 1] : 1.0, pose(i), pose(i + 1), false);
}

/// Writes a straight segment between two poses; `fixed`: the frame keeps its first orientation.
void path_line(Floats start, Floats end, bool fixed, Floats out) {
    const Buffer a(start), b(end), to(out, true);
    *reinterpret_cast<Segment*>(to.data<double>()) =
        line(0, 1, load_pose(a.data<double>()), load_pose(b.data<double>()), fixed);
}

/// Writes a rotation around a line by `angle` (rad), with an advance (m) along it; `carried`: the frame
/// rotates too. With the pose `end` the frame takes the shortest rotation to it instead.
void path_screw(Floats start, Floats point, Floats direction, double angle, double advance, bool carried,
                Floats end, Floats out) {
    const Buffer a(start), p(point), d(direction), to(out, true);
    Segment g = screw(0, 1, load_pose(a.data<double>()), as_vector(p.data<double>()),
                      as_vector(d.data<double>()), angle, advance, carried);
    if (!end.is_none()) g = arc_to(g, load_pose(Buffer(end).data<double>()));
    *reinterpret_cast<Segment*>(to.data<double>()) = g;
}

/// The centre, axis and angle (rad) of the arc through three points; angle 0 if they lie on a line.
nb::tuple arc_through_points(Floats from, Floats via, Floats to) {
    const Buffer a(from), b(via), c(to);
    const ArcThrough arc =
        arc_through(as_vector(a.data<double>()), as_vector(b.data<double>()), as_vector(c.data<double>()));
    return nb::make_tuple(nb::make_tuple(arc.centre.x, arc.centre.y, arc.centre.z),
                          nb::make_tuple(arc.axis.x, arc.axis.y, arc.axis.z), arc.angle);
}

/// The index of the first segment that does not begin where the previous one ends, and the gap (m or rad);
/// the number of segments if there is none.
nb::tuple path_gap(Floats segments) {
    const Buffer g(segments);
    const auto n = static_cast<std::size_t>(g.shape(0));
    for (std::size_t i = 1; i < n; ++i) {
        const double off = gap(as_segments(g)[i - 1], as_segments(g)[i]);
        if (!(off <= PathTuning::apart)) return nb::make_tuple(i, off);
    }
    return nb::make_tuple(n, 0.0);
}

/// Joins segments with rounded corners; radius (n,), m: of the corner after each. Also returns the largest
/// deviations from the given segments (m, rad).
nb::tuple path_joined(Floats segments, Floats radius) {
    const Buffer g(segments), r(radius);
    const auto n = static_cast<std::size_t>(g.shape(0));
    if (!r.is_array('d', {g.shape(0)}))
        throw std::invalid_argument("one radius for each segment was expected");
    const Joined path = joined({as_segments(g), n}, {r.data<double>(), n});
    nb::object out = new_array(nb::make_tuple(path.segments.size(), segment_width));
    std::memcpy(Buffer(out, true).data<double>(), path.segments.data(),
                path.segments.size() * sizeof(Segment));
    return nb::make_tuple(out, path.off_position, path.off_rotation);
}

/// Writes the segments with frames that also rotate around their own z axes, by roll + rate s (rad).
void path_rolled(Floats segments, double roll, double rate, Floats out) {
    const Buffer g(segments), to(out, true);
    auto* turned = reinterpret_cast<Segment*>(to.data<double>());
    for (Py_ssize_t i = 0; i < g.shape(0); ++i) turned[i] = rolled(as_segments(g)[i], roll, rate);
}

/// Writes the poses (4x4) at s.
void path_poses(Floats segments, Floats s, Floats out) {
    const Buffer g(segments), x(s), to(out, true);
    const auto n = static_cast<std::size_t>(g.shape(0));
    for (Py_ssize_t i = 0; i < x.shape(0); ++i) {
        const double at = x.data<double>()[i];
        store_pose(pose_at(as_segments(g)[segment_index(as_segments(g), n, at)], at),
                   to.data<double>() + 16 * i);
    }
}

/// Writes the derivatives 1, 2, 3 of the position with respect to s, and 0, 1, 2 of the angular velocity: (3,
/// 6) for each s.
void path_derivatives(Floats segments, Floats s, Floats out) {
    const Buffer g(segments), x(s), to(out, true);
    const auto n = static_cast<std::size_t>(g.shape(0));
    for (Py_ssize_t i = 0; i < x.shape(0); ++i) {
        const double at = x.data<double>()[i];
        const Segment& segment = as_segments(g)[segment_index(as_segments(g), n, at)];
        const auto s_jet = Jet<double, 3>::variable(at);
        const Vec3<Jet<double, 3>> p = pose_at(segment, s_jet).position, w = angular_velocity(segment, s_jet);
        double* row = to.data<double>() + 18 * i;
        for (int k = 1; k <= 3; ++k, row += 6) {
            const double factorial = k == 3 ? 6.0 : k, below = k == 3 ? 2.0 : 1.0;  // k!, (k - 1)!
            const double values[6] = {p.x.coefficient[k] * factorial, p.y.coefficient[k] * factorial,
                                      p.z.coefficient[k] * factorial, w.x.coefficient[k - 1] * below,
                                      w.y.coefficient[k - 1] * below, w.z.coefficient[k - 1] * below};
            std::memcpy(row, values, sizeof(values));
        }
    }
}

/// A branch report as a tuple for Python.
nb::tuple as_tuple(const BranchReport& r) {
    nb::list openings;
    for (const Opening& o : r.openings) openings.append(nb::make_tuple(o.joint, o.upper, o.extra));
    return nb::make_tuple(r.gc, static_cast<int>(r.verdict), static_cast<int>(r.status), r.from, r.to,
                          r.excess, r.reached, r.margin, r.elbow_margin, r.cost, r.stationarity,
                          r.nearest_psi, r.blocking, openings, r.sections, r.given_up, r.through,
                          pair_number(r.touching), r.shortfall, r.elsewhere,
                          nb::make_tuple(r.turns[0], r.turns[1]));
}

/// Values as a float64 array with `width` columns.
nb::object as_array(const std::vector<double>& values, std::size_t width) {
    nb::object out = new_array(nb::make_tuple(values.size() / width, width));
    if (!values.empty())
        std::memcpy(Buffer(out, true).data<double>(), values.data(), values.size() * sizeof(double));
    return out;
}

/// Reads a set of arcs and marks its ends as the user's.
ArcSet of_user(nb::handle count, nb::handle psi) {
    ArcSet out = ArcArrays(count, psi).load(0, 0);
    for (int i = 0; i < out.count; ++i) out.arc[i].lower_tag = out.arc[i].upper_tag = make_tag(0, Side::user);
    return out;
}

/// Arcs of psi from a Python function of s that returns (count, psi); it is called once for each s. If it
/// raises, the exception is stored, and all further arcs are empty.
class AskedArcs {
public:
    /// Keeps the user's function, which is called for the arcs permitted at each s.
    explicit AskedArcs(nb::object function) : function_(std::move(function)) {}

    /// Writes the arcs at s to `out`: the function's answer, called once for each s; empty after it raised.
    void at(double s, ArcSet& out) {
        make_empty(out);
        if (raised_) return;
        const auto known = known_.find(s);
        if (known != known_.end()) {
            out = known->second;
            return;
        }
        nb::gil_scoped_acquire held;
        try {
            const nb::object arcs = function_(s);
            out = of_user(arcs[0], arcs[1]);
            known_.emplace(s, out);
        } catch (...) { raised_ = std::current_exception(); }
    }

    /// Raises what the function raised.
    void raise() const {
        if (raised_) std::rethrow_exception(raised_);
    }

private:
    nb::object function_;
    std::map<double, ArcSet> known_;
    std::exception_ptr raised_;
};

/// Thrown to end a plan at its next checkpoint.
struct Interrupted {};

/// Plans on an S-R-S arm. rows: values of s that must be sections of the plan.
ChainPlan planned(const Arm& arm, const Segment* segments, std::size_t n, const double* rows,
                  std::size_t row_count, const PlanOptions& options, const Scene*) {
    return {plan(arm, segments, n, rows, row_count, options), {}, {}};
}
/// Plans on an arm with its own chain; `scene` is prepared for its true links. rows: values of s that must be
/// sections of the plan.
ChainPlan planned(const ChainArm& arm, const Segment* segments, std::size_t n, const double* rows,
                  std::size_t row_count, const PlanOptions& options, const Scene* scene) {
    return plan(arm, segments, n, rows, row_count, options, scene);
}

/// Plans on an arm with an offset, without given sections; its scenes are in the options.
template <free_joint_arm A>
ChainPlan planned(const A& arm, const Segment* segments, std::size_t n, const double*, std::size_t,
                  const PlanOptions& options, const Scene*) {
    return {plan(arm, segments, n, options), {}, {}};
}

/// Plans a path and returns (ok, gc, plane, stretches, open, start gap, goal gap, branches, work left,
/// shifts, base). rows: values of s that must be sections of the plan (ignored with an offset). branches: a
/// bit for each. weights: limits, singularities, travel, enough, psi, duration, and seven velocities and
/// accelerations. wished: psi at equal steps of s, or the elbow's point or direction; None without a target.
/// allowed: count and arcs, the same for every s; allowed_at: a function of s that returns them. scenes: each
/// for an equal part of the path. held_q_7: q of joint 7 if the roll is free. true_scene: the scene of an arm
/// with its own chain; `scenes` are then those of its nominal arm. work: that the plan may take. rate_only:
/// rates the branches by their searches, and proves no curve.
template <class Handle>
nb::object plan_path(const Handle& self, Floats segments, Floats rows, Floats start, Floats goal,
                     unsigned branches, Floats weights, double singularity_margin, double limit_margin,
                     Wish wish, Floats wished, const std::vector<const SceneHandle*>& scenes,
                     Ints allowed_count, Floats allowed_psi, nb::object allowed_at, double held_q_7,
                     const SceneHandle* true_scene, int threads, long long work, bool rate_only) {
    const Buffer g(segments), r(rows), w(weights);
    Buffer from, to;
    PlanOptions options;
    if (!start.is_none()) {
        from.get(start);
        options.start = from.data<double>();
    }
    if (!goal.is_none()) {
        to.get(goal);
        options.goal = to.data<double>();
    }
    const double* weight = w.data<double>();
    options.objective = {weight[0], weight[1], weight[2], weight[3], weight[4], weight[5]};
    std::copy(weight + 6, weight + 6 + joints, options.bounds.velocity);
    std::copy(weight + 6 + joints, weight + 6 + 2 * joints, options.bounds.acceleration);
    Buffer angles;
    WishAlong along{wish, {}, nullptr, 0};
    if (!wished.is_none()) {
        angles.get(wished);
        along.psi = angles.data<double>();
        along.count = static_cast<std::size_t>(angles.shape(0));
        if (wish != Wish::psi) along.target = as_vector(along.psi);
        options.wish = &along;
    }
    options.branches = branches;
    options.singularity_margin = singularity_margin;
    options.limit_margin = limit_margin;
    options.held_q_7 = held_q_7;
    options.threads = threads;
    options.work = work;
    options.rate_only = rate_only;
    std::vector<const Scene*> views;
    for (const SceneHandle* scene : scenes) views.push_back(&scene->view);
    options.scenes = {views.data(), static_cast<int>(views.size())};
    ArcSet everywhere;
    AskedArcs asked(allowed_at);
    if (!allowed_count.is_none()) {
        everywhere = of_user(allowed_count, allowed_psi);
        options.allowed_everywhere = &everywhere;
        options.allowed = [&everywhere](double, ArcSet& arcs) { arcs = everywhere; };
    } else if (!allowed_at.is_none()) {
        options.allowed = [&asked](double s, ArcSet& arcs) { asked.at(s, arcs); };
    }
    ChainPlan out;
    const std::size_t plans = options.objective.duration > 0 ? 1 + std::size(PlanTuning::calm) : 1;
    Watch watch(plans * (std::bitset<configurations>(branches).count() + 1));
    options.checkpoint = [&watch] {
        if (watch.ended()) throw Interrupted{};
    };
    options.advanced = [&watch] { watch.advance(); };
    try {
        nb::gil_scoped_release release;
        out =
            planned(self.arm, as_segments(g), static_cast<std::size_t>(g.shape(0)), r.data<double>(),
                    static_cast<std::size_t>(r.shape(0)), options, true_scene ? &true_scene->view : nullptr);
    } catch (const Interrupted&) {}
    watch.raise();
    asked.raise();
    nb::object stretches = new_array(nb::make_tuple(out.stretches.size(), stretch_width));
    if (!out.stretches.empty())
        std::memcpy(Buffer(stretches, true).data<double>(), out.stretches.data(),
                    out.stretches.size() * sizeof(Stretch));
    nb::list reports;
    for (const BranchReport& b : out.branches) reports.append(as_tuple(b));
    nb::object shifts = new_array(nb::make_tuple(out.shifts.size(), lead_shift_width));
    if (!out.shifts.empty())
        std::memcpy(Buffer(shifts, true).data<double>(), out.shifts.data(),
                    out.shifts.size() * sizeof(LeadShift));
    nb::object base = nb::none();
    if (out.base) {
        base = new_array(nb::make_tuple(4, 4));
        store_pose(*out.base, Buffer(base, true).data<double>());
    }
    const auto &p = out.plane.pole, &s = out.plane.side;
    return nb::make_tuple(out.ok, out.gc, as_array({p.x, p.y, p.z, s.x, s.y, s.z}, 6), stretches,
                          as_array(out.proof.open, 2), out.start_gap, out.goal_gap, reports, out.work_left,
                          shifts, base);
}

/// A view of the arrays of a curve.
Curve as_curve(const Arm& arm, const Buffer& segments, const Buffer& stretches, const Buffer& plane,
               int gc) noexcept {
    const double* v = plane.data<double>();
    return {arm,
            {as_vector(v), as_vector(v + 3)},
            gc,
            {as_segments(segments), static_cast<std::size_t>(segments.shape(0))},
            {reinterpret_cast<const Stretch*>(stretches.data<double>()),
             static_cast<std::size_t>(stretches.shape(0))}};
}

/// The curve itself, which gives the joints of an S-R-S arm.
const Curve& joints_along(const Arm&, const Curve& curve, const Buffer&) noexcept { return curve; }
/// The curve of the joints of an arm with its own chain: the nominal curve with corrections.
CorrectedCurve joints_along(const ChainArm& arm, const Curve& curve, const Buffer& shifts) noexcept {
    return {arm,
            curve,
            {reinterpret_cast<const LeadShift*>(shifts.data<double>()),
             static_cast<std::size_t>(shifts.shape(0))}};
}

/// The curve of an arm with an offset.
FamilyCurve<OffsetFamily> joints_along(const OffsetArm& arm, const Curve& curve, const Buffer&) noexcept {
    return {OffsetFamily(arm), curve.gc, curve.segments, curve.stretches};
}
/// The curve of an arm on its own chain with an offset.
FamilyCurve<OffsetChainFamily> joints_along(const OffsetChain& arm, const Curve& curve,
                                            const Buffer&) noexcept {
    return {OffsetChainFamily(arm), curve.gc, curve.segments, curve.stretches};
}

/// The arm itself, whose plan has no base of its own.
const Arm& standing(const Arm& arm, const Floats&) noexcept { return arm; }
/// The arm itself, whose plan has no base of its own.
template <free_joint_arm A>
const A& standing(const A& arm, const Floats&) noexcept {
    return arm;
}
/// The arm on the base of its plan, if that has one.
ChainArm standing(const ChainArm& arm, const Floats& base) {
    return base.is_none() ? arm : with_base(arm, load_pose(Buffer(base).data<double>()));
}

/// The psi of a configuration on a curve, in the arm's own definition.
double psi_of(const Arm&, const PlacedPosture& at) noexcept { return at.psi; }
/// The psi of a posture on a curve: the free joint.
template <free_joint_arm A>
double psi_of(const A&, const PlacedPosture& at) noexcept {
    return at.psi;
}
/// The psi of a posture on a curve of the nominal arm, in the true arm's definition.
double psi_of(const ChainArm& arm, const PlacedPosture& at) noexcept {
    return lift(forward(arm, at.q).psi, at.psi);
}

/// The configuration at s of a curve of an S-R-S arm.
PlacedPosture along(const Arm&, const Curve& curve, double s) noexcept { return curve.at(s); }
/// The configuration at s of a curve of the nominal arm, corrected to the true chain.
PlacedPosture along(const ChainArm& arm, const Curve& curve, double s) noexcept {
    return CorrectedCurve{arm, curve, {}}.at(s);
}

/// The distance (m) of the end effector from a pose at joints q.
double off(const Arm& arm, const double* q, const Pose<double>& pose) noexcept {
    return position_error(arm, chain(arm, q), pose);
}
/// The distance (m) of the end effector from a pose at joints q.
template <class AnyArm>
double off(const AnyArm& arm, const double* q, const Pose<double>& pose) noexcept {
    return norm(forward(arm, q).pose.position - pose.position);
}

/// Writes q, psi, branch (as a float), pose, distance to the nearest limit and residual (m, of the end
/// effector from the curve's pose) at each s. base: of the plan, None for the arm's own. roll_free: joint 7
/// is constant, and the pose is the one reached.
template <class Handle>
void curve_at(const Handle& self, Floats segments, Floats stretches, Floats plane, int gc, bool roll_free,
              Floats shifts, Floats base, Floats s, Floats q, Floats psi, Floats branch, Floats pose,
              Floats margin, Floats residual) {
    const Buffer g(segments), x(stretches), v(plane), shifted(shifts), at(s), q_out(q, true),
        psi_out(psi, true), pose_out(pose, true);
    const Buffer margin_out(margin, true), residual_out(residual, true), branch_out(branch, true);
    const auto& arm = standing(self.arm, base);
    const Arm moving = roll_free ? with_free_roll(nominal(arm)) : nominal(arm);
    const Curve curve = as_curve(moving, g, x, v, gc);
    for (Py_ssize_t i = 0; i < at.shape(0); ++i) {
        const PlacedPosture here = joints_along(arm, curve, shifted).at(at.data<double>()[i]);
        std::memcpy(q_out.data<double>() + joints * i, here.q, joints * sizeof(double));
        psi_out.data<double>()[i] = base.is_none() ? here.psi : psi_of(self.arm, here);
        branch_out.data<double>()[i] = here.gc;
        store_pose(roll_free ? forward(self.arm, here.q).pose : here.pose, pose_out.data<double>() + 16 * i);
        margin_out.data<double>()[i] = limit_margin(nominal(self.arm).limits, here.q);
        residual_out.data<double>()[i] = off(self.arm, here.q, here.pose);
    }
}

/// Writes q', q'', q''' at each s: (3, 7).
template <class Handle>
void curve_derivatives(const Handle& self, Floats segments, Floats stretches, Floats plane, int gc,
                       bool roll_free, Floats shifts, Floats base, Floats s, Floats out) {
    const Buffer g(segments), x(stretches), v(plane), shifted(shifts), at(s), to(out, true);
    const auto& arm = standing(self.arm, base);
    const Arm moving = roll_free ? with_free_roll(nominal(arm)) : nominal(arm);
    const Curve curve = as_curve(moving, g, x, v, gc);
    for (Py_ssize_t i = 0; i < at.shape(0); ++i)
        joints_along(arm, curve, shifted)
            .derivatives(at.data<double>()[i], to.data<double>() + 3 * joints * i);
}

/// A view of the segments of a path.
std::span<const Segment> as_path(const Buffer& segments) noexcept {
    return {as_segments(segments), static_cast<std::size_t>(segments.shape(0))};
}
/// The pose at s of a path.
Pose<double> pose_of(std::span<const Segment> path, double s) noexcept {
    return pose_at(path[segment_index(path.data(), path.size(), s)], s);
}

/// The arrays as rows of a path.
PathRows as_rows(const Buffer& s, const Buffer& psi, const Buffer& q, const Buffer& gc) {
    const auto n = static_cast<std::size_t>(s.shape(0));
    const auto all = [](const Buffer& x, std::size_t count) {
        return std::vector<double>(x.data<double>(), x.data<double>() + count);
    };
    return {all(s, n), all(psi, n), all(q, joints * n),
            std::vector<int>(gc.data<std::int64_t>(), gc.data<std::int64_t>() + n)};
}

/// The curve through rows that were computed elsewhere.
CurveThrough through(const Arm& arm, std::span<const Segment> path, const PathRows& rows) {
    return {arm, path, rows, [](const Curve&, const Stretch&, double, PlacedPosture q) { return q; }};
}
/// The curve of an arm with its own chain through rows.
CurveThrough through(const ChainArm& arm, std::span<const Segment> path, const PathRows& rows) {
    return {arm.nominal, path, rows,
            [&arm](const Curve& curve, const Stretch& x, double s, const PlacedPosture& q) {
                return CorrectedCurve{arm, curve, {}}.lifted(x, s, q);
            }};
}

/// Returns plane and stretches of the curve through rows, and the first row after which it has no
/// continuation, or -1.
template <class Handle>
nb::object curve_through(const Handle& self, Floats segments, Floats s, Floats q, Floats psi, Ints gc) {
    const Buffer g(segments), at(s), joint_values(q), angles(psi), branches(gc);
    const CurveThrough curve = through(self.arm, as_path(g), as_rows(at, angles, joint_values, branches));
    nb::object out = new_array(nb::make_tuple(curve.stretches.size(), stretch_width));
    std::memcpy(Buffer(out, true).data<double>(), curve.stretches.data(),
                curve.stretches.size() * sizeof(Stretch));
    const auto &p = curve.plane.pole, &e = curve.plane.side;
    return nb::make_tuple(as_array({p.x, p.y, p.z, e.x, e.y, e.z}, 6), out, curve.torn);
}

/// Returns a function of s that gives the configuration between rows.
template <class SrsArm>
auto between(const SrsArm& arm, std::span<const Segment> path, const PathRows& rows) {
    return [&arm, path, gc = rows.gc[0], curve = through(arm, path, rows)](double s) {
        return along(arm, Curve{nominal(arm), curve.plane, gc, path, curve.stretches}, s);
    };
}
/// A function that gives the configuration at s between rows of an arm with an offset.
template <free_joint_arm A>
auto between(const A& arm, std::span<const Segment> path, const PathRows& rows) {
    return [&arm, path, rows](double s) {
        return OffsetCurve<A>{arm, path, rows.s, rows.psi, rows.q.data()}.at(s);
    };
}

/// Returns the rows (s, psi, q, gc), with more inserted where the curve between them violates a limit
/// (rows_within.hpp); also the largest remaining violation (rad), its joint (1 to 7), and the row before it.
template <class Handle>
nb::object rows_within(const Handle& self, Floats segments, Floats s, Floats q, Floats psi, Ints gc) {
    const Buffer g(segments), at(s), joint_values(q), angles(psi), branches(gc);
    const std::span<const Segment> path = as_path(g);
    PathRows rows = as_rows(at, angles, joint_values, branches);
    const Limits& limits = nominal(self.arm).limits;
    const auto draw = [&](const PathRows& drawn) { return between(self.arm, path, drawn); };
    const auto solve = [&](double x, double value, int branch, const double* near, double* out) {
        const Inverse found = inverse(self.arm, pose_of(path, x), value, branch, near);
        for (int j = 0; j < joints; ++j)  // another turn may be within the limits too, but the path would
                                          // jump
            out[j] = has_a_turn(limits, j) ? lift(found.q[j], near[j]) : found.q[j];
        return is_solved(found.status);
    };
    const PassedLimit passed = keep_within(limits, draw, solve, rows);
    const std::vector<double> kept(rows.gc.begin(), rows.gc.end());
    return nb::make_tuple(as_array(rows.s, 1), as_array(rows.psi, 1), as_array(rows.q, joints),
                          as_array(kept, 1), passed.excess, passed.joint, passed.row);
}

/// Arrays of the rows (s, free, q) of a path of an arm with an offset, kept during queries.
class OffsetRows {
public:
    /// Acquires the arrays of a curve.
    OffsetRows(Floats segments, Floats s, Floats free, Floats q)
        : segments_(segments), s_(s), free_(free), q_(q) {}
    /// The curve of these rows.
    template <free_joint_arm A>
    OffsetCurve<A> curve(const A& arm) const noexcept {
        const auto n = static_cast<std::size_t>(s_.shape(0));
        return {arm,
                {as_segments(segments_), static_cast<std::size_t>(segments_.shape(0))},
                {s_.data<double>(), n},
                {free_.data<double>(), n},
                q_.data<double>()};
    }

private:
    const Buffer segments_, s_, free_, q_;
};

/// Writes q, free, branch, pose, margin and residual at each s of the curve through the rows (rows_s, free,
/// rows_q).
template <class Handle>
void rows_at(const Handle& self, Floats segments, Floats rows_s, Floats free, Floats rows_q, Floats s,
             Floats q, Floats psi, Floats branch, Floats pose, Floats margin, Floats residual) {
    const OffsetRows rows(segments, rows_s, free, rows_q);
    const auto curve = rows.curve(self.arm);
    const Buffer at(s), q_out(q, true), psi_out(psi, true), branch_out(branch, true), pose_out(pose, true),
        margin_out(margin, true), residual_out(residual, true);
    for (Py_ssize_t i = 0; i < at.shape(0); ++i) {
        const PlacedPosture here = curve.at(at.data<double>()[i]);
        std::memcpy(q_out.data<double>() + joints * i, here.q, joints * sizeof(double));
        psi_out.data<double>()[i] = here.psi;
        branch_out.data<double>()[i] = here.gc;
        store_pose(here.pose, pose_out.data<double>() + 16 * i);
        margin_out.data<double>()[i] = limit_margin(nominal(self.arm).limits, here.q);
        residual_out.data<double>()[i] = off(self.arm, here.q, here.pose);
    }
}

/// Writes q', q'', q''' (3, 7) at each s of the curve through the rows (rows_s, free, rows_q).
template <class Handle>
void rows_derivatives(const Handle& self, Floats segments, Floats rows_s, Floats free, Floats rows_q,
                      Floats s, Floats out) {
    const OffsetRows rows(segments, rows_s, free, rows_q);
    const auto curve = rows.curve(self.arm);
    const Buffer at(s), to(out, true);
    for (Py_ssize_t i = 0; i < at.shape(0); ++i)
        curve.derivatives(at.data<double>()[i], to.data<double>() + 3 * joints * i);
}

/// The eight branch reports of the pose at s = 0 of a segment.
nb::object explain_pose(const ArmHandle& self, Floats segment, double singularity_margin) {
    const Buffer g(segment);
    Task task{self.arm, self.arm.limits, limit_table(self.arm, singularity_margin), as_segments(g), 1, {}};
    task.plane = smooth_plane({triad(self.arm, flange_pose(self.arm, task.pose(0))).w});
    nb::list out;
    for (int gc = 0; gc < configurations; ++gc) out.append(as_tuple(diagnose(task, 0, gc)));
    return out;
}

/// Evaluates an interval operation on arrays of (lower, upper); used by the tests of interval arithmetic.
/// Operations 0 to 11: + - * /, sqrt, sin, cos, hypot, square, abs, min, max.
void interval_many(int operation, Floats a, Floats b, Floats out) {
    const Buffer x(a), y(b), to(out, true);
    for (Py_ssize_t i = 0; i < x.shape(0); ++i) {
        const Interval p(x.data<double>()[2 * i], x.data<double>()[2 * i + 1]),
            q(y.data<double>()[2 * i], y.data<double>()[2 * i + 1]);
        const Interval results[] = {p + q,          p - q,       p * q,     p / q,  sqrt(p),   sin_cos(p).sin,
                                    sin_cos(p).cos, hypot(p, q), square(p), abs(p), min(p, q), max(p, q)};
        to.data<double>()[2 * i] = results[operation].lo;
        to.data<double>()[2 * i + 1] = results[operation].hi;
    }
}

/// Proves a curve: returns its unproven stretches (k, 2) and the places of violations (m, 1), in s.
nb::tuple certify_curve(const ArmHandle& self, Floats segments, Floats stretches, Floats plane, int gc,
                        double singularity_margin, const SceneHandle* scene) {
    const Buffer g(segments), x(stretches), v(plane);
    const Scene* const view = scene ? &scene->view : nullptr;
    const Proof proof = certify(as_curve(nominal(self.arm), g, x, v, gc), self.arm.limits, singularity_margin,
                                {{&view, scene ? 1 : 0}, nullptr});
    return nb::make_tuple(as_array(proof.open, 2), as_array(proof.violated, 1));
}

/// Binds plan_path, curve_at, curve_derivatives and rows_within.
template <class Handle>
void bind_planning_of(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("plan_path", &plan_path<Handle>, "segments"_a, "rows"_a, "start"_a.none(), "goal"_a.none(),
            "branches"_a, "weights"_a, "singularity_margin"_a, "limit_margin"_a, "wish"_a, "wished"_a.none(),
            "scenes"_a, "allowed_count"_a.none(), "allowed_psi"_a.none(), "allowed_at"_a.none(), "held_q_7"_a,
            "true_scene"_a.none(), "threads"_a, "work"_a, "rate_only"_a);
    arm.def("curve_at", &curve_at<Handle>, "segments"_a, "stretches"_a, "plane"_a, "gc"_a, "roll_free"_a,
            "shifts"_a, "base"_a.none(), "s"_a, "q"_a, "psi"_a, "branch"_a, "pose"_a, "margin"_a,
            "residual"_a);
    arm.def("curve_derivatives", &curve_derivatives<Handle>, "segments"_a, "stretches"_a, "plane"_a, "gc"_a,
            "roll_free"_a, "shifts"_a, "base"_a.none(), "s"_a, "out"_a);
    arm.def("rows_within", &rows_within<Handle>, "segments"_a, "s"_a, "q"_a, "psi"_a, "gc"_a);
}

/// Binds curve_through, which arms with an arm angle have.
template <class Handle>
void bind_curve_through(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("curve_through", &curve_through<Handle>, "segments"_a, "s"_a, "q"_a, "psi"_a, "gc"_a);
}

/// Binds rows_at and rows_derivatives, which arms with a free joint have.
template <class Handle>
void bind_rows(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("rows_at", &rows_at<Handle>, "segments"_a, "rows_s"_a, "free"_a, "rows_q"_a, "s"_a, "q"_a,
            "psi"_a, "branch"_a, "pose"_a, "margin"_a, "residual"_a);
    arm.def("rows_derivatives", &rows_derivatives<Handle>, "segments"_a, "rows_s"_a, "free"_a, "rows_q"_a,
            "s"_a, "out"_a);
}

}  // namespace

/// Binds planning for an arm with its own chain.
void bind_chain_planning(nb::class_<ChainArmHandle>& arm) {
    bind_planning_of(arm);
    bind_curve_through(arm);
}

/// Binds planning for an arm with an offset, and the curves through its rows.
void bind_offset_planning(nb::class_<OffsetHandle>& arm) {
    bind_planning_of(arm);
    bind_rows(arm);
}

/// Binds planning for an arm with an offset and its own chain, and the curves through its rows.
void bind_offset_chain_planning(nb::class_<OffsetChainHandle>& arm) {
    bind_planning_of(arm);
    bind_rows(arm);
}

/// Registers Verdict, the functions of paths, interval_many, and planning for an S-R-S arm.
void bind_planning(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Verdict>(m, "Verdict", nb::is_arithmetic())
        .value("OK", Verdict::ok)
        .value("UNREACHABLE", Verdict::unreachable)
        .value("IMPOSSIBLE", Verdict::impossible)
        .value("DEAD_END", Verdict::dead_end)
        .value("START", Verdict::start)
        .value("GOAL", Verdict::goal)
        .value("UNRESOLVED", Verdict::unresolved);
    m.attr("SEGMENT_WIDTH") = segment_width;
    m.attr("STRETCH_WIDTH") = stretch_width;
    m.attr("PLAN_WORK") = WorkTuning::plan;
    m.attr("PROOF_WORK") = WorkTuning::proofs;
    m.def("path_waypoints", &path_waypoints, "poses"_a, "s"_a, "out"_a);
    m.def("path_line", &path_line, "start"_a, "end"_a, "fixed"_a, "out"_a);
    m.def("path_screw", &path_screw, "start"_a, "point"_a, "direction"_a, "angle"_a, "advance"_a, "carried"_a,
          "end"_a.none(), "out"_a);
    m.def("arc_through", &arc_through_points, "start"_a, "via"_a, "end"_a);
    m.def("path_gap", &path_gap, "segments"_a);
    m.def("path_joined", &path_joined, "segments"_a, "radius"_a);
    m.def("path_rolled", &path_rolled, "segments"_a, "roll"_a, "rate"_a, "out"_a);
    m.attr("RADIAN") = PathTuning::radian;
    m.def("path_poses", &path_poses, "segments"_a, "s"_a, "out"_a);
    m.def("path_derivatives", &path_derivatives, "segments"_a, "s"_a, "out"_a);
    m.def("interval_many", &interval_many, "operation"_a, "a"_a, "b"_a, "out"_a);
    bind_planning_of(arm);
    bind_curve_through(arm);
    arm.def("certify_curve", &certify_curve, "segments"_a, "stretches"_a, "plane"_a, "gc"_a,
            "singularity_margin"_a, "scene"_a.none() = nb::none());
    arm.def("explain_pose", &explain_pose, "segment"_a, "singularity_margin"_a);
}

}  // namespace binding
