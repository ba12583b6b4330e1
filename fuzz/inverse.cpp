// The batched inverse over any bits: a problem is reported, or q is finite and holds the pose; never NaN
// without a word.
#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    using namespace fuzz;
    Input in(data, size);
    const Arm arm = in.arm();
    constexpr std::size_t n = 3;
    double pose[16 * n], psi[n], seed[7 * n], q[7 * n];
    long long gc[n];
    for (std::size_t i = 0; i < n; ++i) {
        const unsigned kind = in.byte();
        store_pose(kind & 1 ? in.reachable(arm).pose : in.rigid(1.0), pose + 16 * i);
        if (kind & 2) pose[16 * i + in.byte() % 16] = in.number(1.0);
        psi[i] = in.number(pi);
        gc[i] = kind & 4 ? static_cast<long long>(in.byte()) - 100 : in.byte() % 8;
        for (std::size_t j = 0; j < 7; ++j) seed[7 * i + j] = in.number(3.0);
    }
    const unsigned options = in.byte();
    InverseBatch b;
    b.pose = {pose, 16};
    b.psi = {psi, 1};
    b.gc = {gc, 1};
    b.seed = {options & 1 ? seed : nullptr, 7};
    b.out = {q, 7};
    b.unreachable = options & 2 ? Enforce::nan : Enforce::raise;
    Outcome outcome;
    inverse_range(arm, b, 0, n, outcome);
    for (std::size_t i = 0; i < n; ++i) {
        double value = 0;
        const Problem problem = detail::check_element(arm, b, i, value);
        bool finite = true;
        for (std::size_t j = 0; j < 7; ++j) finite = finite && std::isfinite(q[7 * i + j]);
        if (problem == Problem::none) {
            demand(finite, "an element without a problem has finite joints");
            const Pose<double> wanted = load_pose(pose + 16 * i);
            const double slack = 5e-6 * (1 + norm(wanted.position) + norm(arm.tool.position) +
                                         std::fabs(arm.d_wf));  // a rotation may be off by 1e-6
            demand(pose_error(forward(arm, q + 7 * i).pose, wanted) < slack + 1e3 * rounding(arm, wanted),
                   "the joints hold the pose");
        } else {
            const bool geometry = problem == Problem::unreachable || problem == Problem::folded;
            demand(!finite, "an element with a problem is NaN");
            demand((geometry && (options & 2)) || outcome.problem != Problem::none, "a problem is reported");
        }
    }
    return 0;
}
