// Planning whole paths: all of plan/. It allocates, so armangle.hpp leaves it out.
#pragma once

#include "plan/planner.hpp"
#include "near/plan.hpp"
