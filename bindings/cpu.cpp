// The module that says which instruction sets this processor has. Compiled for the plainest of them.
#include <nanobind/nanobind.h>

#include "levels.hpp"

NB_MODULE(_cpu, m) { m.def("supports", &binding::supports, nanobind::arg("level")); }
