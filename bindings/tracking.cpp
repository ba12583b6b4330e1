// The tracker: one configuration in every control cycle.
#include "armangle/arm/check_joints.hpp"
#include "offset_handle.hpp"
#include "refusal.hpp"
#include "scene_handle.hpp"
#include "watch.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Order of the option numbers from Python: dt, length, still_margin, elbow_margin, singularity_margin,
/// omega, patience, jump, turn, soft_clearance, detours; then seven velocities, seven accelerations and seven
/// jerks.
constexpr int option_count = 11;

/// Reads the options of a tracker from the option numbers and the seven velocities, accelerations and jerks.
TrackerOptions options_of(Floats numbers) {
    const Buffer given(numbers);
    if (!given.is_array('d', {option_count + 3 * joints}))
        throw std::invalid_argument("32 numbers were expected");
    const double* x = given.data<double>();
    TrackerOptions o;
    o.dt = x[0];
    o.length = x[1];
    o.still_margin = x[2];
    o.elbow_margin = x[3];
    o.singularity_margin = x[4];
    o.hand = {x[5], x[6], x[7], x[8]};
    o.soft_clearance = x[9];
    o.detours = x[10] != 0;
    for (int j = 0; j < joints; ++j) {
        o.velocity[j] = x[option_count + j];
        o.acceleration[j] = x[option_count + joints + j];
        o.jerk[j] = x[option_count + 2 * joints + j];
    }
    return o;
}

/// Constructs the tracker of an S-R-S arm. The scene must outlive it.
void make_tracker(Tracker<>* self, const ArmHandle& arm, Floats numbers, const SceneHandle* scene) {
    TrackerOptions o = options_of(numbers);
    if (scene) o.scene = &scene->view;
    new (self) Tracker<>(arm.arm, o);
}

/// Constructs the tracker of an arm whose end effector is not where its nominal arm's is. A scene is given
/// twice: prepared for the nominal arm and for the true links.
template <class AnyArm, class Handle>
void make_corrected_tracker(CorrectedTracker<AnyArm>* self, const Handle& arm, Floats numbers,
                            const SceneHandle* nominal, const SceneHandle* scene) {
    TrackerOptions o = options_of(numbers);
    if (nominal) o.scene = &nominal->view;
    new (self) CorrectedTracker<AnyArm>(arm.arm, o, scene ? &scene->view : nullptr);
}

/// Starts a tracker at rest at joints q (7,).
template <class Loop>
void start_tracker(Loop& self, Floats q) {
    const Buffer given(q);
    if (!given.is_array('d', {joints})) throw std::invalid_argument("7 joint values were expected");
    self.start(given.data<double>());
}

/// Writes the state of a tracker to `numbers`; raises if these are not saved_size doubles.
template <class Loop>
void save_tracker(const Loop& self, Floats numbers) {
    const Buffer out(numbers, true);
    if (!out.is_array('d', {saved_size(self)}))
        throw std::invalid_argument("saved_size numbers were expected");
    save(self, out.data<double>());
}

/// Restores a state of save_tracker(); raises if `numbers` are not saved_size doubles.
template <class Loop>
void restore_tracker(Loop& self, Floats numbers) {
    const Buffer in(numbers);
    if (!in.is_array('d', {saved_size(self)}))
        throw std::invalid_argument("saved_size numbers were expected");
    restore(self, in.data<double>());
}

/// Element `index` of a tuple.
nb::object at(nb::handle values, int index) {
    PyObject* item = PyTuple_GetItem(values.ptr(), index);
    if (!item) throw nb::python_error();
    return nb::borrow(item);
}

/// A new array (7,) of these numbers.
nb::object joint_array(const double* values) {
    nb::object array = new_array7();
    std::memcpy(Buffer(array, true).data<double>(), values, joints * sizeof(double));
    return array;
}

/// Advances one cycle and returns its result as a named tuple of (q, velocity, status, distance, gap, psi,
/// gc, why, pair). `names` holds its class, trackings and statuses by their numbers, and the function that
/// names a pair.
template <class Loop>
nb::object advance(Loop& self, const Command& command, nb::handle names) {
    const Tracked now = self.step(command);
    return new_named(at(names, 0), joint_array(now.q), joint_array(now.velocity),
                     at(at(names, 1), static_cast<int>(now.status)), now.distance, now.gap, now.psi, now.gc,
                     at(at(names, 2), static_cast<int>(now.why)),
                     now.pair ? at(names, 3)(pair_number(now.pair)) : nb::none());
}

/// A target pose from Python, and the command to the tracker that uses it.
class HandGiven {
public:
    /// Reads the pose (None: no pose) into the command, which ignores an invalid one. False if it is no small
    /// matrix: the general function then converts it or raises the error. Throws if it was probably not meant
    /// in m.
    template <class AnyArm>
    bool read(const AnyArm& arm, nb::handle pose, Command& command) {
        double m[16], value = 0;
        if (pose.is_none()) return true;
        if (!SmallMatrix().read(pose, 4, 4, m)) return false;
        wanted_ = load_pose(m);
        const Problem problem = check_pose(arm, m, value);
        if (problem == Problem::none) command.pose = &wanted_;
        if (problem == Problem::pose_in_millimetres) refuse_one(problem, "pose", value);
        return true;
    }

private:
    Pose<double> wanted_;
};

/// Advances one cycle with a target pose alone, which is the usual case; None if HandGiven::read returns
/// false.
template <class Loop>
nb::object track_hand(Loop& self, nb::handle pose, nb::handle names) {
    HandGiven hand;
    Command command;
    return hand.read(self.arm(), pose, command) ? advance(self, command, names) : nb::none();
}

/// Advances one cycle with any command (dt and reconfigure as in Command); None if pose or elbow is no small
/// matrix.
template <class Loop>
nb::object track_one(Loop& self, nb::handle pose, nb::handle names, nb::handle elbow, Wish wish, double dt,
                     int reconfigure) {
    HandGiven hand;
    Command command;
    double point[3]{};
    if (!hand.read(self.arm(), pose, command)) return nb::none();
    if (!elbow.is_none() && !SmallMatrix().read(elbow, 1, 3, point)) return nb::none();
    const Towards hint{wish, 0.0, {point[0], point[1], point[2]}};
    if (!elbow.is_none()) command.elbow = &hint;
    command.dt = dt;
    command.reconfigure = reconfigure;
    return advance(self, command, names);
}

/// The nearest pair of the present configuration within `reach` (m), for a tracker with a scene: its distance
/// beyond the clearance (m), the distance of the cores (m), and its number.
template <class Loop>
nb::tuple nearest_of(const Loop& self, double reach) {
    const NearestPair nearest = self.nearest_pair(reach);
    return nb::make_tuple(nearest.room, nearest.core, pair_number(nearest.pair));
}

/// Advances one cycle for each of the poses (n, 4, 4); writes q (n, 7). An invalid pose counts as missing;
/// one in mm raises before the first cycle. An interrupted run leaves the tracker unchanged.
template <class Loop>
void track_many(Loop& self, Floats poses, Floats q) {
    const Buffer in(poses), out(q, true);
    const Py_ssize_t n = in.shape(0);
    if (!in.is_array('d', {n, 4, 4}) || !out.is_array('d', {n, joints}))
        throw std::invalid_argument("poses (n, 4, 4) and joints (n, 7) were expected");
    Outcome outcome;
    for (Py_ssize_t i = 0; i < n; ++i) {
        double value = 0;
        const Problem problem = check_pose(self.arm(), in.data<double>() + 16 * i, value);
        if (problem == Problem::pose_in_millimetres)
            outcome.report(problem, static_cast<std::size_t>(i), value);
    }
    refuse(outcome, in, 2, "poses");
    Loop moved = self;
    watched(static_cast<std::size_t>(n), 1, [&](std::size_t, std::size_t end, std::size_t, Watch& watch) {
        for (std::size_t i = 0; i < end && !(i > 0 && watch.ended(0, i)); ++i) {
            const double* m = in.data<double>() + 16 * i;
            const Pose<double> wanted = load_pose(m);
            Command command;
            double value = 0;
            if (check_pose(m, value) == Problem::none) command.pose = &wanted;
            const Tracked now = moved.step(command);
            std::memcpy(out.data<double>() + joints * i, now.q, joints * sizeof(double));
        }
    });
    self = moved;
}

/// Writes the poses (n, 4, 4) that a target filter (omega, patience, jump, turn) computes from samples, one
/// every dt s; a sample that is no rigid pose counts as missing, and before the first the identity is
/// written.
void smooth_hand(double omega, double patience, double jump, double turn, Floats samples, double dt,
                 Floats poses) {
    const Buffer in(samples), out(poses, true);
    const Py_ssize_t n = in.shape(0);
    if (!in.is_array('d', {n, 4, 4}) || !out.is_array('d', {n, 4, 4}))
        throw std::invalid_argument("samples and poses (n, 4, 4) were expected");
    Hand hand({omega, patience, jump, turn});
    bool begun = false;
    for (Py_ssize_t i = 0; i < n; ++i) {
        const double* m = in.data<double>() + 16 * i;
        const Pose<double> sample = load_pose(m);
        double value = 0;
        const bool valid = check_pose(m, value) == Problem::none;
        if (valid && !begun) hand.start(sample);
        begun |= valid;
        hand.tick(valid ? &sample : nullptr, dt);
        store_pose(hand.pose(), out.data<double>() + 16 * i);
    }
}

/// Binds the members that trackers of all arms have.
template <class Loop>
void bind_loop(nb::class_<Loop>& tracker) {
    using namespace nb::literals;
    tracker.def("nearest_pair", &nearest_of<Loop>, "reach"_a)
        .def_prop_ro("q", [](const Loop& self) { return joint_array(self.q()); })
        .def_prop_ro("saved_size", [](const Loop& self) { return saved_size(self); })
        .def("save", &save_tracker<Loop>, "numbers"_a)
        .def("restore", &restore_tracker<Loop>, "numbers"_a)
        .def("look_again", &Loop::look_again)
        .def("start", &start_tracker<Loop>, "q"_a)
        .def("step_hand", &track_hand<Loop>, "pose"_a.none(), "names"_a)
        .def("step_one", &track_one<Loop>, "pose"_a.none(), "names"_a, "elbow"_a.none(), "wish"_a, "dt"_a,
             "reconfigure"_a)
        .def("run", &track_many<Loop>, "poses"_a, "q"_a);
}

/// Registers the tracker of an arm whose links differ from its nominal arm's, under `name`.
template <class AnyArm, class Handle>
void bind_corrected(nb::module_& m, const char* name) {
    using namespace nb::literals;
    nb::class_<CorrectedTracker<AnyArm>> tracker(m, name);
    tracker.def("__init__", &make_corrected_tracker<AnyArm, Handle>, "arm"_a, "numbers"_a, "nominal"_a.none(),
                "scene"_a.none(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>());
    bind_loop(tracker);
}

}  // namespace

/// Registers Tracking, smooth_hand, and the trackers of each kind of arm.
void bind_tracking(nb::module_& m) {
    using namespace nb::literals;
    nb::enum_<Tracking>(m, "Tracking", nb::is_arithmetic())
        .value("FOLLOWING", Tracking::FOLLOWING)
        .value("LAGGING", Tracking::LAGGING)
        .value("NEAREST", Tracking::NEAREST)
        .value("HELD", Tracking::HELD)
        .value("TURNING", Tracking::TURNING)
        .value("RETURNING", Tracking::RETURNING);
    m.def("smooth_hand", &smooth_hand, "omega"_a, "patience"_a, "jump"_a, "turn"_a, "samples"_a, "dt"_a,
          "poses"_a);
    nb::class_<Tracker<>> tracker(m, "Tracker");
    tracker.def("__init__", &make_tracker, "arm"_a, "numbers"_a, "scene"_a.none(), nb::keep_alive<1, 4>());
    bind_loop(tracker);
    bind_corrected<ChainArm, ChainArmHandle>(m, "ChainTracker");
    bind_corrected<OffsetArm, OffsetHandle>(m, "OffsetTracker");
    bind_corrected<OffsetChain, OffsetChainHandle>(m, "OffsetChainTracker");
}

}  // namespace binding
