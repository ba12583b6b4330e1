// The module that reports the processor's instruction sets. Compiled for the most basic one.
#include <nanobind/nanobind.h>

#include "levels.hpp"

/// Makes the Python module that tells what the processor supports.
NB_MODULE(_cpu, m) { m.def("supports", &binding::supports, nanobind::arg("level")); }
