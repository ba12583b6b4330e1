// The headers in a second translation unit: no definition may be there twice.
#include <armangle/armangle.hpp>

double reach_of(const armangle::Arm& arm);
double reach_of(const armangle::Arm& arm) { return arm.reach; }
