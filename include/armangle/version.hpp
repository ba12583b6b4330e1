// The only definition of the version; pyproject.toml and CMake read it from here.
#pragma once

#define ARMANGLE_VERSION "0.1.0"
