// Includes path planning: all of plan/. It allocates memory, so armangle.hpp leaves it out.
#pragma once

#include "plan/planner.hpp"
#include "chain/plan.hpp"
#include "offset/plan.hpp"
