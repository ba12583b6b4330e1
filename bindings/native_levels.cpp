// Prints the level that a build for this processor needs: its best one.
#include <cstdio>

#include "levels.hpp"

int main() {
    const bool is_x86 = binding::supports("sse2");
    if (binding::supports("avx512"))
        std::puts("avx512");
    else if (binding::supports("avx2"))
        std::puts("avx2");
    else
        std::puts(is_x86 ? "sse2" : "base");
}
