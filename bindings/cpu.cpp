// Which instruction sets this processor has. Compiled for the plainest of them.
#include <nanobind/nanobind.h>

#include <cstring>

namespace {

bool supports(const char* level) {
    const auto is = [level](const char* name) { return std::strcmp(level, name) == 0; };
#if defined(__x86_64__)
    __builtin_cpu_init();
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
    if (is("sse2")) return true;
    if (is("avx2")) return avx2;
    if (is("avx512"))
        return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd");
    return false;
#else
    return is("base");
#endif
}

}  // namespace

NB_MODULE(_cpu, m) { m.def("supports", &supports, nanobind::arg("level")); }
