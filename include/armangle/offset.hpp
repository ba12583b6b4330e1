// Includes the arms with an offset wrist or shoulder.
#pragma once

#include "armangle.hpp"
#include "offset/step.hpp"
#include "offset/chain/nearest_posture.hpp"
#include "offset/chain/self_motion_rate.hpp"
#include "offset/next_guess.hpp"
#include "offset/nearest_posture.hpp"
#include "offset/singular_end_slope.hpp"
#include "offset/psi_gradient.hpp"
#include "offset/psi_towards.hpp"
#include "offset/reduced_place.hpp"
#include "offset/turn_arcs.hpp"
