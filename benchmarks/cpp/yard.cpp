// The yardstick as a function that Python can call, to be measured in the same process as the library.
#include "yard.hpp"

extern "C" double armangle_yards(const double* y, const double* x, const double* psi, std::size_t n) {
    return walk_yards(y, x, psi, n);
}
