// MeanValue (numbers/mean_value.hpp) on formulas of three variables over random boxes, beside samples in
// them. Prints lines "name value":
//
//     samples     values that were computed in double, in boxes over which the formula is known
//     outside     of them those that are not within the range, by more than the rounding of doubles (0)
//     unknown     share of the boxes over which a formula is not known
//     wide        largest ratio of a range's width to that of the samples, over boxes of 1e-3
//     wide_plain  the same of the formula on intervals alone
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include <armangle/circle/elbow.hpp>
#include <armangle/numbers/mean_value.hpp>

namespace armangle {
namespace {

constexpr int formulas = 6;
using Number = MeanValue<3>;
std::mt19937_64 generator(7);
/// A random number in [a, b).
double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(generator); }

/// One of the formulas, which use all operations.
template <class T>
T value(int which, const T& a, const T& b, const T& c) {
    const SinCos<T> turn = sin_cos(a - b), other = sin_cos(c);
    switch (which) {
        case 0: return (a - b) * (a + b) - mul_add(a, a, -(b * b)) + c;
        case 1: return turn.sin * other.cos - turn.cos * other.sin;
        case 2: return a / hypot(a, b) + c / (T(4.0) + b * b);
        case 3: return sqrt(T(2.0) + a * b) * abs(c - T(0.1));
        case 4: return max(a * c, b) - a * c;
        default: return cut_off(a - T(0.5), T(1e-9), (a - T(0.5)) * (b + T(2.0))) / (T(1.5) + turn.cos * c);
    }
}

}  // namespace
}  // namespace armangle

using namespace armangle;

int main() {
    long samples = 0, outside = 0, boxes = 0, unknown = 0;
    double wide = 0, wide_plain = 0;
    for (int k = 0; k < 60000; ++k) {
        const int which = k % formulas;
        const double half = k % 3 == 0 ? 1e-3 : std::pow(10.0, uniform(-6.0, -0.3));
        double about[3];
        for (double& x : about) x = uniform(-1.0, 1.0);
        const Number got =
            value<Number>(which, Number::variable(0, about[0], half), Number::variable(1, about[1], half),
                          Number::variable(2, about[2], half));
        ++boxes;
        if (!got.range.bounded()) {
            ++unknown;
            continue;
        }
        double least = infinity, most = -infinity;
        for (int s = 0; s < 40; ++s) {
            double x[3];
            for (int i = 0; i < 3; ++i)
                x[i] = about[i] + half * (s < 8 ? (s >> i & 1 ? 1.0 : -1.0) : uniform(-1.0, 1.0));
            const double y = value(which, x[0], x[1], x[2]);
            if (is_nan(y)) continue;
            ++samples;
            outside += y < got.range.lo - 1e-14 || y > got.range.hi + 1e-14;
            least = std::min(least, y);
            most = std::max(most, y);
        }
        if (half != 1e-3 || which > 2 || !(most - least > 0.2 * half) ||
            !(std::hypot(about[0], about[1]) > 0.2))
            continue;
        const auto box = [half](double x) { return Interval(x - half, x + half); };
        const Interval plain = value<Interval>(which, box(about[0]), box(about[1]), box(about[2]));
        wide = std::max(wide, (got.range.hi - got.range.lo) / (most - least));
        wide_plain = std::max(wide_plain, (plain.hi - plain.lo) / (most - least));
    }
    std::printf("samples %ld\noutside %ld\nunknown %g\nwide %g\nwide_plain %g\n", samples, outside,
                static_cast<double>(unknown) / static_cast<double>(boxes), wide, wide_plain);
}
