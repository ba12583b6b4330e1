// The headers in a second translation unit: no definition may be there twice.
#include <armangle/armangle.hpp>

#include <type_traits>

static_assert(!std::is_default_constructible_v<armangle::Arm>, "make_arm is the only maker");

double reach_of(const armangle::Arm& arm);
double reach_of(const armangle::Arm& arm) { return arm.reach; }
