// The only place the version is written; pyproject.toml and CMake read it from here.
#pragma once

#define ARMANGLE_VERSION "0.1.0"
