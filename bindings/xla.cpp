// The kinematics as functions that XLA calls: the handlers behind armangle.jax. No mathematics here.
//
// A handler uses version 0.1 of XLA's C interface, which newer versions of XLA accept too.
// Elements are consecutive; all arguments have the same batch.
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <variant>

#include "armangle/offset/psi_gradient.hpp"
#include "elements.hpp"
#include "limits_of_handle.hpp"
#include "xla_interface.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Arms by a key that Python computed from their numbers. They are never removed, since compiled functions
/// use the key.
class KeptArms {
public:
    /// An arm of any kind.
    using AnyHandle = std::variant<ArmHandle, ChainArmHandle, OffsetHandle, OffsetChainHandle>;

    /// Keeps an arm under a key; does nothing if the key has one.
    template <class Handle>
    void keep(std::int64_t key, const Handle& arm) {
        const std::lock_guard lock(mutex_);
        if (!arms_.contains(key)) arms_.emplace(key, std::make_unique<AnyHandle>(arm));
    }

    /// The arm of a key; null if it is unknown.
    const AnyHandle* find(std::int64_t key) {
        const std::lock_guard lock(mutex_);
        const auto found = arms_.find(key);
        return found == arms_.end() ? nullptr : found->second.get();
    }

private:
    std::mutex mutex_;
    std::unordered_map<std::int64_t, std::unique_ptr<AnyHandle>> arms_;
};

/// The arms that compiled functions hold keys of.
KeptArms& kept_arms() {
    static KeptArms arms;
    return arms;
}

constexpr std::size_t most_elements = 64;  // of a block, whose numbers are converted on the stack
constexpr std::size_t pose_size = 16;

/// What an arm of this kind takes in place of a table of limits.
template <class Handle>
using TableOf = decltype(table(std::declval<const Handle&>(), 0.0));

/// A block of `count` consecutive elements of a call: arguments and results.
template <class Handle>
struct Block {
    const Handle* self;
    const TableOf<Handle>* limits;
    double margin;  // rad: to singularities, also part of the limits
    std::size_t count;
    const double* in;   // q, or the pose
    const double* psi;  // for the inverse
    const long long* gc;
    const double* change;      // tangent of the argument, or gradient by the first result
    const double* psi_change;  // the same for psi
    double* out;               // the first result
    double* out_psi;
    long long* out_gc;
    Outcome outcome;
};

/// The properties of most tasks: no psi and gc among the arguments, no change (tangent or gradient) per
/// element, no psi and gc among the results.
struct Plain {
    static constexpr std::size_t change = 0;
    static constexpr bool has_branch = false, psi_changes = false, gives_psi = false, gives_branch = false;
};

/// Writes `count` NaN.
void no_numbers(double* to, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) to[k] = not_a_number;
}

/// Calls one(element, joints, its first output number) for elements with finite joints; others become NaN.
template <class Handle, class One>
void each_posture(Block<Handle>& b, std::size_t size, const One& one) {
    for (std::size_t i = 0; i < b.count; ++i) {
        const double* q = b.in + joints * i;
        if (is_finite(q))
            one(i, q, b.out + size * i);
        else
            no_numbers(b.out + size * i, size);
    }
}

/// Calls one(element, pose, its first output number) for elements with rigid poses; others become NaN, and
/// non-rigid ones are reported.
template <class Handle, class One>
void each_pose(Block<Handle>& b, std::size_t size, const One& one) {
    for (std::size_t i = 0; i < b.count; ++i) {
        const double* m = b.in + pose_size * i;
        double value = 0;
        const Problem problem = check_pose(m, value);
        if (problem == Problem::none)
            one(i, load_pose(m), b.out + size * i);
        else
            no_numbers(b.out + size * i, size);
        if (problem != Problem::none && problem != Problem::pose_not_finite)
            b.outcome.report(problem, i, value);
    }
}

/// Replaces the outcome: reports invalid poses, and gc outside 0..7. Non-finite numbers, which give NaN, are
/// no problem.
template <class Handle>
void report_misshapen(Block<Handle>& b) {
    b.outcome = {};
    for (std::size_t i = 0; i < b.count; ++i) {
        double value = 0;
        const Problem problem = check_pose(b.in + pose_size * i, value);
        if (problem != Problem::none && problem != Problem::pose_not_finite)
            b.outcome.report(problem, i, value);
        if (b.gc[i] < 0 || b.gc[i] >= configurations) b.outcome.report(Problem::gc_range, i, 0);
    }
}

/// The arguments of the inverse for a block.
template <class Handle>
InverseBatch asked_of(const Block<Handle>& b) {
    InverseBatch batch;
    batch.pose = {b.in, pose_size};
    batch.psi = {b.psi, 1};
    batch.seed = {nullptr, 0};
    batch.gc = {b.gc, 1};
    batch.unreachable = Enforce::nan;
    return batch;
}

struct ForwardTask : Plain {
    static constexpr std::size_t input = joints, output = pose_size;
    static constexpr bool gives_psi = true, gives_branch = true;
    /// Writes pose, psi and gc of joints.
    template <class Handle>
    static void run(Block<Handle>& b) {
        for (std::size_t i = 0; i < b.count; ++i) {
            b.out_psi[i] = not_a_number;
            b.out_gc[i] = 0;
        }
        each_posture(b, output, [&b](std::size_t i, const double* q, double* pose) {
            const auto posture = forward(b.self->arm, q);
            store_pose(posture.pose, pose);
            b.out_psi[i] = redundancy(posture);
            b.out_gc[i] = posture.gc;
        });
    }
};

/// Tangents of pose and psi for tangents of the joints.
struct ForwardPushTask : Plain {
    static constexpr std::size_t input = joints, change = joints, output = pose_size;
    static constexpr bool gives_psi = true;
    /// Writes the changes of pose and psi for a change of the joints.
    template <class Handle>
    static void run(Block<Handle>& b) {
        no_numbers(b.out_psi, b.count);
        each_posture(b, output, [&b](std::size_t i, const double* q, double* pose) {
            forward_pushforward(b.self->arm, q, b.change + joints * i, pose, b.out_psi[i]);
        });
    }
};

/// Reverse mode: gradients by the joints from gradients by pose and psi.
struct ForwardPullTask : Plain {
    static constexpr std::size_t input = joints, change = pose_size, output = joints;
    static constexpr bool psi_changes = true;
    /// Writes the gradient by the joints for gradients by pose and psi.
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_posture(b, output, [&b](std::size_t i, const double* q, double* to) {
            double by_q[joints];
            (void)forward_pullback(b.self->arm, q, b.change + pose_size * i, b.psi_change[i], by_q);
            std::memcpy(to, by_q, sizeof(by_q));
        });
    }
};

struct InverseTask : Plain {
    static constexpr std::size_t input = pose_size, output = joints;
    static constexpr bool has_branch = true;
    /// Writes joints of poses, arm angles and branches, whatever the limits; NaN if there is no solution.
    template <class Handle>
    static void run(Block<Handle>& b) {
        if constexpr (std::is_same_v<Handle, ArmHandle>) {
            InverseBatch batch = asked_of(b);
            batch.out = {b.out, joints};
            inverse_range(b.self->arm, batch, 0, b.count, b.outcome);
            if (b.outcome.problem == Problem::none) return;
        } else {
            each_pose(b, output, [&b](std::size_t i, const Pose<double>& pose, double* to) {
                const Inverse found = inverse(b.self->arm, pose, b.psi[i], static_cast<int>(b.gc[i]));
                std::memcpy(to, found.q, output * sizeof(double));
            });
        }
        report_misshapen(b);
    }
};

/// Tangents of the joints for tangents of pose and psi.
struct InversePushTask : Plain {
    static constexpr std::size_t input = pose_size, change = pose_size, output = joints;
    static constexpr bool has_branch = true, psi_changes = true;
    /// Writes the change of the joints for changes of pose and psi.
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_pose(b, output, [&b](std::size_t i, const Pose<double>& pose, double* to) {
            inverse_pushforward(b.self->arm, pose, b.psi[i], static_cast<int>(b.gc[i]),
                                b.change + pose_size * i, b.psi_change[i], to);
        });
    }
};

/// Reverse mode: gradients by pose and psi from gradients by the joints.
struct InversePullTask : Plain {
    static constexpr std::size_t input = pose_size, change = joints, output = pose_size;
    static constexpr bool has_branch = true, gives_psi = true;
    /// Writes the gradients by pose and psi for a gradient by the joints.
    template <class Handle>
    static void run(Block<Handle>& b) {
        const PullbackBatch batch{asked_of(b), {b.change, joints}, {b.out, pose_size}, {b.out_psi, 1}};
        pullback_range(b.self->arm, batch, 0, b.count, b.outcome);
        if (b.outcome.problem != Problem::none) report_misshapen(b);
    }
};

/// The solution of a pose with these options, within the limits of the call.
template <class Handle>
Nearest solved(const Block<Handle>& b, const Pose<double>& pose, const NearestOptions& options) noexcept {
    if constexpr (free_joint_arm<decltype(Handle::arm)>)
        return nearest_posture(b.self->arm, pose, options);
    else if constexpr (std::is_same_v<Handle, ChainArmHandle>)
        return nearest_posture(b.self->arm, b.margin, pose, options);
    else
        return nearest_posture(b.self->arm, *b.limits, pose, options);
}

/// Searches the solution nearest to a seed, or the one with the largest margin, which ignores the seed.
template <Metric metric>
struct SolveTask : Plain {
    static constexpr std::size_t input = pose_size, change = joints, output = joints;
    static constexpr bool gives_psi = true, gives_branch = true;

    /// The options of a search from a seed.
    static NearestOptions options(const double* seed) {
        NearestOptions out;
        out.metric = metric;
        out.near = seed;
        return out;
    }

    /// Writes joints, psi and gc of the solution of each pose.
    template <class Handle>
    static void run(Block<Handle>& b) {
        for (std::size_t i = 0; i < b.count; ++i) {
            b.out_psi[i] = not_a_number;
            b.out_gc[i] = -1;
        }
        each_pose(b, output, [&b](std::size_t i, const Pose<double>& pose, double* to) {
            const double* seed = b.change + joints * i;
            if (!is_finite(seed)) return no_numbers(to, output);
            const Nearest found = solved(b, pose, options(seed));
            std::memcpy(to, found.q, output * sizeof(double));
            b.out_psi[i] = found.psi;
            b.out_gc[i] = found.gc;
        });
    }
};

/// Computes the derivative (7, 13) of the solution of SolveTask with respect to the twist of the pose and the
/// seed. It is solved again, because float32 results have lost the digits that identify a joint at its limit.
template <Metric metric>
struct SolveDerivativeTask : Plain {
    static constexpr std::size_t input = pose_size, change = joints;
    static constexpr std::size_t output = joints * SolutionDerivative::columns;
    /// Writes the derivative of the solution's joints by pose and seed.
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_pose(b, output, [&b](std::size_t i, const Pose<double>& pose, double* to) {
            const double* seed = b.change + joints * i;
            if (!is_finite(seed)) return no_numbers(to, output);
            const NearestOptions asked = SolveTask<metric>::options(seed);
            const Nearest found = solved(b, pose, asked);
            const SolutionDerivative slopes = solution_derivative(b.self->arm, b.margin, pose, found, asked);
            std::memcpy(to, slopes.entry, sizeof(slopes.entry));
        });
    }
};

struct FreedomTask : Plain {
    static constexpr std::size_t input = pose_size, output = 1;
    /// Writes the length of the feasible intervals of each pose (rad).
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_pose(b, output, [&b](std::size_t, const Pose<double>& pose, double* to) {
            *to = freedom_within(b.self->arm, *b.limits, pose).total;
        });
    }
};

struct FreedomGradientTask : Plain {
    static constexpr std::size_t input = pose_size, output = 6;
    /// Writes the derivative (6,) of the length of the feasible intervals by the twist of each pose.
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_pose(b, output, [&b](std::size_t, const Pose<double>& pose, double* to) {
            double slope[output];
            freedom_slope(b.self->arm, *b.limits, pose, slope);
            std::memcpy(to, slope, sizeof(slope));
        });
    }
};

struct LimitMarginTask : Plain {
    static constexpr std::size_t input = joints, output = 1;
    /// Writes the distance to the nearest joint limit (rad).
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_posture(b, output, [&b](std::size_t, const double* q, double* to) {
            *to = limit_margin(nominal(b.self->arm).limits, q);
        });
    }
};

struct LimitMarginGradientTask : Plain {
    static constexpr std::size_t input = joints, output = joints;
    /// Writes the derivative of the limit margin by the joints.
    template <class Handle>
    static void run(Block<Handle>& b) {
        each_posture(b, output, [&b](std::size_t, const double* q, double* to) {
            double slope[joints];
            limit_margin_gradient(nominal(b.self->arm).limits, q, slope);
            std::memcpy(to, slope, sizeof(slope));
        });
    }
};

/// Makes an error for XLA.
xla::Error* failed(const xla::Call& call, xla::ErrorCode code, const std::string& why) {
    xla::NewError error{};
    error.head.size = xla::new_error_size;
    error.message = why.c_str();
    error.code = code;
    return call.api->make_error(&error);
}

/// A sentence for the problem of an element. Python has better messages, but XLA cannot call it.
std::string words(const Outcome& outcome) {
    const std::string at = " at element " + std::to_string(outcome.index) + " of the batch";
    switch (outcome.problem) {
        case Problem::gc_range: return "gc is outside 0..7" + at;
        case Problem::pose_last_row: return "the last row of pose is not 0 0 0 1" + at;
        case Problem::pose_reflection: return "the rotation of pose is a reflection" + at;
        default: return "the rotation of pose is not orthonormal" + at;
    }
}

/// Argument k of a call.
const xla::Buffer& argument(const xla::Call& call, int k) {
    return *static_cast<const xla::Buffer*>(call.arguments.items[k]);
}

/// Result k of a call.
const xla::Buffer& result(const xla::Call& call, int k) {
    return *static_cast<const xla::Buffer*>(call.results.items[k]);
}

/// A scalar attribute; Python always writes all of them.
template <class T>
T attribute(const xla::Call& call, std::string_view name) {
    for (std::int64_t k = 0; k < call.attributes.count; ++k) {
        const xla::Name& given = *call.attributes.names[k];
        if (std::string_view(given.text, given.length) != name) continue;
        return *static_cast<const T*>(static_cast<const xla::Scalar*>(call.attributes.items[k])->value);
    }
    return T{};
}

/// The numbers of a block of a buffer as doubles: in place, or converted into `room`.
template <class T>
const double* read(const xla::Buffer& buffer, std::size_t first, std::size_t count, double* room) {
    const T* from = static_cast<const T*>(buffer.data) + first;
    if constexpr (std::is_same_v<T, double>) return from;
    for (std::size_t k = 0; k < count; ++k) room[k] = static_cast<double>(from[k]);
    return room;
}

/// Where to write a block of results: in place, or into `room` before conversion.
template <class T>
double* target(const xla::Buffer& buffer, std::size_t first, double* room) {
    if constexpr (std::is_same_v<T, double>) return static_cast<T*>(buffer.data) + first;
    return room;
}

/// Converts a block of results into a buffer of floats; doubles are there already.
template <class T>
void write(const xla::Buffer& buffer, std::size_t first, std::size_t count, const double* from) {
    if constexpr (!std::is_same_v<T, double>) {
        T* to = static_cast<T*>(buffer.data) + first;
        for (std::size_t k = 0; k < count; ++k) to[k] = static_cast<T>(from[k]);
    }
}

/// Corrects poses for the rounding of their numbers to float.
template <class AnyArm>
void correct_rounding(const AnyArm& arm, double* poses, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        double* m = poses + pose_size * i;
        double value = 0;
        if (check_pose(m, value) == Problem::pose_not_finite) continue;
        double last_row[4];
        std::memcpy(last_row, m + 12, sizeof(last_row));
        store_pose(within_rounding(arm, load_pose(m), std::numeric_limits<float>::epsilon()), m);
        std::memcpy(m + 12, last_row, sizeof(last_row));
    }
}

/// Runs a task for all elements of a call, block by block; T is float or double.
template <class Task, class T, class Handle>
Outcome over(const xla::Call& call, const Handle& self, const TableOf<Handle>& limits, std::size_t n) {
    constexpr int first_change = Task::has_branch ? 3 : 1;
    alignas(64) double in[Task::input * most_elements], out[Task::output * most_elements];
    alignas(64) double change[(Task::change + 1) * most_elements];
    alignas(64) double psi[most_elements], psi_change[most_elements];
    long long gc[most_elements];
    Block<Handle> b{};
    b.self = &self;
    b.limits = &limits;
    b.margin = attribute<double>(call, "margin");
    for (std::size_t first = 0; first < n; first += most_elements) {
        b.count = n - first < most_elements ? n - first : most_elements;
        b.in = read<T>(argument(call, 0), first * Task::input, b.count * Task::input, in);
        if constexpr (Task::input == pose_size && !std::is_same_v<T, double>)
            correct_rounding(reaching(self.arm), in, b.count);
        if constexpr (Task::has_branch) {
            b.psi = read<T>(argument(call, 1), first, b.count, psi);
            const auto* branch = static_cast<const std::int32_t*>(argument(call, 2).data) + first;
            for (std::size_t k = 0; k < b.count; ++k) gc[k] = branch[k];
            b.gc = gc;
        }
        if constexpr (Task::change > 0)
            b.change =
                read<T>(argument(call, first_change), first * Task::change, b.count * Task::change, change);
        if constexpr (Task::psi_changes)
            b.psi_change = read<T>(argument(call, first_change + 1), first, b.count, psi_change);
        b.out = target<T>(result(call, 0), first * Task::output, out);
        if constexpr (Task::gives_psi) b.out_psi = target<T>(result(call, 1), first, psi_change);
        if constexpr (Task::gives_branch) b.out_gc = gc;
        b.outcome = {};
        Task::run(b);
        if (b.outcome.problem != Problem::none) {
            b.outcome.index += first;
            return b.outcome;
        }
        write<T>(result(call, 0), first * Task::output, b.count * Task::output, b.out);
        if constexpr (Task::gives_psi) write<T>(result(call, 1), first, b.count, b.out_psi);
        if constexpr (Task::gives_branch) {
            auto* branch = static_cast<std::int32_t*>(result(call, 2).data) + first;
            for (std::size_t k = 0; k < b.count; ++k) branch[k] = static_cast<std::int32_t>(gc[k]);
        }
    }
    return {};
}

/// Answers XLA's query for the version of a handler; false if it is another call.
bool answer_version_query(const xla::Call& call) {
    for (xla::Extension* e = call.head.extensions; e; e = e->next) {
        if (e->kind != xla::asks_metadata) continue;
        xla::Version& version = reinterpret_cast<xla::MetadataQuestion*>(e)->answer->version;
        version.major = xla::major_version;
        version.minor = xla::minor_version;
        return true;
    }
    return false;
}

/// The handler that XLA calls for a task.
template <class Task>
xla::Error* handler(xla::Call* asked) noexcept {
    const xla::Call& call = *asked;
    if (answer_version_query(call) || call.stage != xla::Stage::execute) return nullptr;
    const KeptArms::AnyHandle* self = kept_arms().find(attribute<std::int64_t>(call, "arm"));
    if (!self)
        return failed(call, xla::ErrorCode::not_found,
                      "this process does not know the arm of a compiled function: make its Kinematics first");
    const xla::Buffer& lead = argument(call, 0);
    std::size_t n = 1;
    for (std::int64_t k = 0; k < lead.rank; ++k) n *= static_cast<std::size_t>(lead.extents[k]);
    n /= Task::input;
    const bool single = lead.number == xla::Number::float32;
    const Outcome outcome = std::visit(
        [&](const auto& arm) {
            const auto limits = table(arm, attribute<double>(call, "margin"));
            return single ? over<Task, float>(call, arm, limits, n)
                          : over<Task, double>(call, arm, limits, n);
        },
        *self);
    if (outcome.problem == Problem::none) return nullptr;
    return failed(call, xla::ErrorCode::invalid_argument, words(outcome));
}

/// The handler of a task, as a capsule for jax.ffi.register_ffi_target.
template <class Task>
nb::capsule target_of() {
    xla::Handler* const function = &handler<Task>;
    return nb::capsule(reinterpret_cast<void*>(function), "xla._CUSTOM_CALL_TARGET");
}

/// Returns the handlers by name, for jax.ffi.register_ffi_target.
nb::typed<nb::dict, nb::str, nb::object> xla_targets() {
    nb::dict targets;
    targets["forward"] = target_of<ForwardTask>();
    targets["forward_push"] = target_of<ForwardPushTask>();
    targets["forward_pull"] = target_of<ForwardPullTask>();
    targets["inverse"] = target_of<InverseTask>();
    targets["inverse_push"] = target_of<InversePushTask>();
    targets["inverse_pull"] = target_of<InversePullTask>();
    targets["solve"] = target_of<SolveTask<Metric::l2>>();
    targets["solve_margin"] = target_of<SolveTask<Metric::margin>>();
    targets["solve_derivative"] = target_of<SolveDerivativeTask<Metric::l2>>();
    targets["solve_margin_derivative"] = target_of<SolveDerivativeTask<Metric::margin>>();
    targets["freedom"] = target_of<FreedomTask>();
    targets["freedom_gradient"] = target_of<FreedomGradientTask>();
    targets["limit_margin"] = target_of<LimitMarginTask>();
    targets["limit_margin_gradient"] = target_of<LimitMarginGradientTask>();
    return nb::borrow<nb::typed<nb::dict, nb::str, nb::object>>(targets);
}

}  // namespace

/// Registers xla_targets, and `keep` for each kind of arm.
void bind_xla(nb::module_& m, nb::class_<ArmHandle>& arm, nb::class_<ChainArmHandle>& chain,
              nb::class_<OffsetHandle>& offset, nb::class_<OffsetChainHandle>& offset_chain) {
    using namespace nb::literals;
    m.def("xla_targets", &xla_targets);
    const auto bind = []<class Handle>(nb::class_<Handle>& kind) {
        kind.def("keep", [](const Handle& self, std::int64_t key) { kept_arms().keep(key, self); }, "key"_a);
    };
    bind(arm);
    bind(chain);
    bind(offset);
    bind(offset_chain);
}

}  // namespace binding
