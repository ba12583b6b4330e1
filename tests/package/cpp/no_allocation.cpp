// Counts allocations around each function that a control loop calls. Prints "name count" lines; the first
// line proves that the counter counts.
#include <cstdio>
#include <cstdlib>
#include <new>

#include <armangle/armangle.hpp>

namespace {
std::size_t allocations = 0;
}

/// As `new` is, but counted in `allocations`.
void* operator new(std::size_t size) {
    ++allocations;
    if (void* p = std::malloc(size)) return p;
    throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }

#if defined(__GLIBC__)
// glibc's own names for what these replace, so that C allocations are seen too
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* malloc(std::size_t size) {
    ++allocations;
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    ++allocations;
    return __libc_calloc(count, size);
}
void* realloc(void* p, std::size_t size) {
    ++allocations;
    return __libc_realloc(p, size);
}
}
#endif

namespace {

using namespace armangle;

constexpr std::size_t count = 21;

/// Poses around a bent posture, one of them out of reach so that failures are covered too.
struct Input {
    double q[7] = {0.1, 0.5, -0.2, -1.3, 0.4, 0.9, 0.3}, matrix[16 * count], psi[count];
    long long gc[count];

    explicit Input(const Arm& arm) {
        for (std::size_t i = 0; i < count; ++i) {
            q[0] += 0.001;
            const Posture at = forward(arm, q);
            store_pose(at.pose, matrix + 16 * i);
            psi[i] = at.psi;
            gc[i] = at.gc;
        }
        matrix[16 * (count - 1) + 3] = 9.0;
    }
};

/// Room for the results of `count` poses.
struct Output {
    double q[7 * count], psi[count], margin[count], residual[count];
    long long gc[count];
    std::int8_t status[count];
};

/// Print how many allocations `work` makes.
template <class Work>
void report(const char* name, const Work& work) {
    const std::size_t before = allocations;
    work();
    const std::size_t made = allocations - before;
    std::printf("%s %zu\n", name, made);
}

}  // namespace

/// Reports the allocations of each function that a control loop calls.
int main() {
    ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.4;
    p.d_wf = 0.126;
    for (int i = 0; i < joints; ++i) {
        p.limits.upper[i] = 2.0;
        p.limits.lower[i] = -2.0;
    }
    std::printf("start\n");  // stdout's own buffer
    report("counter", [] {
        void* volatile kept = operator new(1);  // twice where malloc is counted too
        operator delete(kept);
    });
    static Arm arm = make_arm(p);
    report("make_arm", [&] { arm = make_arm(p); });
    static LimitTable limits;
    report("limit_table", [] { limits = limit_table(arm, 0.05); });
    static const Input in(arm);
    static Output out;
    report("forward", [] { out.psi[0] = forward(arm, in.q).psi; });
    report("jacobian", [] { out.psi[0] = jacobian(arm, in.q).entry[0][0]; });
    report("inverse", [] {
        out.psi[0] = inverse(arm, load_pose(in.matrix), in.psi[0], static_cast<int>(in.gc[0]), in.q).q[0];
        const InverseBatch batch{{in.matrix, 16}, {in.psi, 1}, {nullptr, 0}, {in.gc, 1}, {out.q, 7}};
        Outcome outcome;
        inverse_range(arm, batch, 0, 1, outcome);
        inverse_range(arm, batch, 0, count, outcome);
    });
    report("feasible", [] {
        for (std::size_t i = 0; i < count; ++i) {
            const Circle<double> c = circle(arm, flange_pose(arm, load_pose(in.matrix + 16 * i)));
            for (int k = 0; k < configurations; ++k) {
                ArcSet set, rest;
                out.status[i] =
                    static_cast<std::int8_t>(feasible(self_motion(arm, c, configuration(k)), limits, set));
                complement(set, rest);
                out.psi[i] = measure(rest);
            }
        }
    });
    report("feasible_all", [] {
        for (std::size_t i = 0; i < count; ++i) {
            static AllArcs all;
            feasible_all(arm, load_pose(in.matrix + 16 * i), limits, all);
            out.status[i] = static_cast<std::int8_t>(all.status[0]);
        }
    });
    report("nearest", [] {
        for (std::size_t i = 0; i < count; ++i) {
            for (const Metric metric : {Metric::l2, Metric::max, Metric::margin}) {
                NearestOptions asked;
                asked.near = in.q;
                asked.metric = metric;
                const Pose<double> pose = load_pose(in.matrix + 16 * i);
                out.psi[i] = nearest_posture(arm, limits, pose, asked).psi;
                out.psi[i] = nearest_outside(arm, limits, pose, asked, 0.2).psi;
                static Nearests every;
                nearest_postures(arm, limits, pose, asked, every);
                out.gc[i] = every.count;
            }
        }
    });
    report("step", [] {
        for (std::size_t i = 0; i < count; ++i)
            out.psi[i] = step(arm, limits, in.q, load_pose(in.matrix + 16 * i), StepOptions{}).psi;
    });
    report("follow", [] {
        const FollowRows rows{out.q, out.psi, out.margin, out.residual, out.gc, out.status};
        follow(arm, limits, in.q, in.matrix, count, StepOptions{}, OnFail::stop, {nullptr, 0}, rows);
    });
    static Bounds bounds;
    bounds.dt = 0.01;
    for (int j = 0; j < joints; ++j) {
        bounds.velocity[j] = 2.0;
        bounds.acceleration[j] = 50.0;
        bounds.velocity_now[j] = 0.0;
    }
    StepOptions bounded;
    bounded.bounds = &bounds;
    report("bounded_step", [&] {
        for (std::size_t i = 0; i < count; ++i)
            out.psi[i] = step(arm, limits, in.q, load_pose(in.matrix + 16 * i), bounded).psi;
    });
    using Window = Lookahead<ExactSections>;
    static Window::Section sections[Window::sections_for(4)];
    report("lookahead", [&] {
        const FollowRows rows{out.q, out.psi, out.margin, out.residual, out.gc, out.status};
        Window ahead({arm, limits}, in.matrix, count, {nullptr, 0}, {nullptr, 0}, &bounds,
                     bounded.max_joint_step, sections, 4);
        follow(arm, limits, in.q, in.matrix, count, bounded, OnFail::hold, {nullptr, 0}, rows, &ahead);
    });
    static const Vec3<double> corners[] = {{-0.1, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
    static const float distances[8] = {0.1f, 0.2f, 0.1f, 0.2f, 0.1f, 0.2f, 0.1f, 0.2f};
    static const Field field{distances, {2, 2, 2}, 0.3};
    static const Mat3<double> upright = identity_pose().rotation;
    static const Solid solids[] = {
        {SolidKind::hull, 0.01, {0.3, -0.3, 0.5}, {0, 0, 0}, upright, corners, 4, 0.1},
        {SolidKind::field, 0.0, {-0.4, -0.4, 0.6}, {0.15, 0.15, 0.15}, upright, nullptr, 0, 0, &field},
        {SolidKind::box, 0.01, {0.4, 0.2, 0.5}, {0.1, 0.1, 0.1}, identity_pose().rotation},
        {SolidKind::capsule, 0.05, {-0.4, 0.2, 0.5}, {-0.4, 0.4, 0.9}, identity_pose().rotation},
        {SolidKind::half_space, 0.0, {0, 0, 1}, {0, 0, 0}, identity_pose().rotation}};
    static const std::uint16_t solid_id[] = {8, 9, 10, 11, 12};
    static BallBlock block;
    static std::uint16_t ball_id[8];
    for (int k = 0; k < 8; ++k) {
        block.x[k] = 0.1 * k - 0.4;
        block.y[k] = 0.4;
        block.z[k] = 0.5;
        block.radius[k] = 0.05;
        ball_id[k] = static_cast<std::uint16_t>(k);
    }
    static const Part parts[] = {{{{0, -0.4, 0}, {0, 0, 0}, 0.05}, false},
                                 {{{0.02, 0.01, 0}, {0, 0, 0.4}, 0.05}, true}};
    static const std::uint8_t ignored[13 * 2] = {};
    static const BallGroup group{{0, 0.4, 0.5}, 0.6, 0, 1};
    static Scene scene{};
    scene.blocks = &block;
    scene.ball_id = ball_id;
    scene.block_count = 1;
    scene.groups = &group;
    scene.clusters = &group;
    scene.cluster_count = 1;
    scene.solids = solids;
    scene.solid_id = solid_id;
    scene.solid_count = 5;
    scene.first_held = 13;
    scene.first_base = 13;
    scene.parts = parts;
    scene.part_count = 2;
    scene.ignored = ignored;
    scene.link_count = 2;
    scene.clearance = 0.01;
    scene.soft = 0.02;
    report("scene", [] {
        for (std::size_t i = 0; i < count; ++i) {
            const Pose<double> pose = load_pose(in.matrix + 16 * i);
            const SelfMotion<double> m = self_motion(arm, pose, static_cast<int>(in.gc[i]));
            ArcSet own;
            feasible(m, limits, own);
            out.margin[i] = proximity(arm, scene, m, in.psi[i]).distance;
            out.psi[i] = widest(arm, scene, m, own).psi;
            StepOptions among;
            among.scene = &scene;
            out.psi[i] += step(arm, limits, in.q, pose, among).psi;
        }
    });
    TrackerOptions tracked;
    for (int j = 0; j < joints; ++j) {
        tracked.velocity[j] = 2.0;
        tracked.acceleration[j] = 50.0;
    }
    static Tracker tracker(arm, tracked);
    report("tracker", [&] {
        tracker.start(in.q);
        for (std::size_t i = 0; i < count; ++i) {
            const Pose<double> hand = load_pose(in.matrix + 16 * i);
            Command command;
            command.pose = &hand;
            for (int k = 0; k < 20; ++k) out.psi[i] = tracker.step(command).psi;
        }
    });
    static Pose<double> links[joints + 1];
    detail::nominal_links(arm, links);
    for (Pose<double>& link : links) link.position.x += 1e-4;
    static ChainArm near = make_near_arm(p, links);
    report("chain_arm", [&] { near = make_near_arm(p, links); });
    report("near_inverse", [] {
        const Posture at = forward(near, in.q);
        out.psi[0] = inverse(near, at.pose, at.psi, at.gc).q[0];
    });
    report("near_feasible", [] {
        ProvenArcs arcs;
        const Posture at = forward(near, in.q);
        feasible(near, at.pose, at.gc, near.nominal.limits, 0.0, arcs);
        out.psi[0] = arcs.unproven;
    });
    report("near_follow", [] {
        const FollowRows rows{out.q, out.psi, out.margin, out.residual, out.gc, out.status};
        follow(ChainSteps(near, 0.0), in.q, in.matrix, count, StepOptions{}, OnFail::hold, {nullptr, 0},
               rows);
    });
    return 0;
}
