// The whole library. In reading order: the paper's story.
#pragma once

#include "version.hpp"
#include "arm.hpp"
#include "forward.hpp"
#include "circle.hpp"
#include "arm_angle.hpp"
#include "inverse.hpp"
#include "jacobian.hpp"
#include "joint_function.hpp"
#include "arcs.hpp"
#include "limit_table.hpp"
#include "feasible.hpp"
#include "feasible_all.hpp"
#include "resolution.hpp"
#include "step.hpp"
#include "batch.hpp"
#include "follow.hpp"
