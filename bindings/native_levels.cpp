// Prints the best level for this processor, for a native build.
#include <cstdio>

#include "levels.hpp"

/// Prints the best level that this processor supports.
int main() {
    const bool is_x86 = binding::supports("sse2");
    if (binding::supports("avx512"))
        std::puts("avx512");
    else if (binding::supports("avx2"))
        std::puts("avx2");
    else
        std::puts(is_x86 ? "sse2" : "base");
}
