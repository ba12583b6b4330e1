// The inverse on a CUDA device, one pose a thread: what the headers must compile to there.
#include "armangle/circle/inverse.hpp"

/// Theta (rad, of the DH table) into q, 7 a thread, of `count` poses at `pose`, each the upper three rows.
__global__ void inverse_on_device(const armangle::Arm* arm, const double* pose, const double* psi,
                                  const int* gc, double* q, int count) {
    using namespace armangle;
    const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (i >= count) return;
    const double* m = pose + 12 * i;  // the rows of a 4x4 pose but the last
    const Pose<double> at{{{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}}, {m[3], m[7], m[11]}};
    const SelfMotion<double> motion = self_motion(*arm, at, gc[i]);
    const Directions<double> d = directions(motion, sin_cos(psi[i]));
    for (int j = 0; j < joints; ++j) q[joints * i + j] = armangle::atan2(d.y[j], d.x[j]);
}
