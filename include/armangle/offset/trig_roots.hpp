// Roots of F0(x) + elbow sigma(x) F1(x) on a piece of the circle: F0, F1 trigonometric polynomials, sigma the
// sine of the elbow's bend. Every root in the piece lies in one of the enclosures that are given.
//
//     sigma = sqrt(1 - kappa^2) >= 0,   kappa = k0 + kc cos x + ks sin x,   |kappa| <= 1 on the piece
//
// G is the whole function. A cell of half width h about m holds no root if |G(m)| > |G'(m)| h + B h^2/2, and
// one at most if |G'(m)| > B h, where B bounds |G''| on the cell. Beside sigma = 0, where G has no second
// derivative, the slope of sigma itself is bounded from below. All else is halved, down to `undecided`
// enclosures: tangencies. RootLanes cells are looked at together.
#pragma once

#include <algorithm>

#include "../numbers/rounded.hpp"
#include "../numbers/lane.hpp"
#include "../numbers/angles.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of trig_roots.
struct TrigRootsTuning {
    /// Pieces are cut into cells of at most 2 pi divided by this and by the degree.
    int cells = 8;
    /// Cells narrower than this half width (rad) are left undecided; two limits so near are one place.
    double narrowest = 2.5e-10;
    /// The largest number of rounds of eight cells for one function on one piece; remaining cells are
    /// undecided.
    int rounds = 256;
    /// The largest number of Newton steps to a single root.
    int newton = 8;
};

/// A trigonometric polynomial c[0] + sum c[k] cos kx + s[k] sin kx. Its value is computed within `error`,
/// which includes an error of x of 1e-15 rad.
struct TrigPolynomial {
    static constexpr int most = 4;
    int degree = 0;
    double c[most + 1] = {}, s[most + 1] = {};
    double error = 0;

    /// An upper bound of the absolute value of its derivative of this order (0: of its value).
    double slope_bound(int order) const noexcept {
        double sum = order == 0 ? abs(c[0]) : 0.0;
        for (int k = 1; k <= degree; ++k) {
            double power = 1;
            for (int i = 0; i < order; ++i) power *= k;
            sum += power * (abs(c[k]) + abs(s[k]));
        }
        return sum;
    }
};

/// The function F0 + elbow sigma F1.
struct BentForm {
    TrigPolynomial even, odd;  // F0, F1
    bool bent = true;          // whether there is an F1
};

/// A piece of the circle that may contain roots; exactly one if it is settled.
struct RootEnclosure {
    double lower, upper;
    bool settled;
};

namespace detail {

using RootLanes = Lane<8>;

/// The values and derivatives of a trigonometric polynomial at eight places.
template <int Order>
struct TrigDerivatives {
    RootLanes of[Order + 1];
};

/// Computes the values and derivatives of several polynomials at x (rad), which share cosines and sines;
/// `degree` is the largest of theirs.
template <int Order, int Count>
ARMANGLE_INLINE void derivatives(const TrigPolynomial* const (&p)[Count], int degree, const RootLanes& x,
                                 TrigDerivatives<Order> (&out)[Count]) noexcept {
    const SinCos<RootLanes> one = sin_cos(x);
    for (int i = 0; i < Count; ++i) {
        out[i].of[0] = RootLanes(p[i]->c[0]);
        for (int order = 1; order <= Order; ++order) out[i].of[order] = RootLanes(0.0);
    }
    RootLanes c = one.cos, s = one.sin;
    for (int k = 1; k <= degree; ++k) {
        const double times = k;
        for (int i = 0; i < Count; ++i) {
            if (k > p[i]->degree) continue;
            const RootLanes a(p[i]->c[k]), b(p[i]->s[k]);
            const RootLanes here = mul_add(a, c, b * s);
            out[i].of[0] = out[i].of[0] + here;
            if constexpr (Order >= 1)
                out[i].of[1] = mul_add(RootLanes(times), mul_add(b, c, -(a * s)), out[i].of[1]);
            if constexpr (Order >= 2) out[i].of[2] = mul_add(RootLanes(-times * times), here, out[i].of[2]);
        }
        if (k == degree) break;
        const RootLanes next = mul_add(c, one.cos, -(s * one.sin));
        s = mul_add(s, one.cos, c * one.sin);
        c = next;
    }
}

/// Searches the roots of one function.
class TrigRoots {
public:
    /// Computes the bounds of derivatives that the search for the roots of `form` needs. The function depends
    /// on the elbow angle, whose cosine is the polynomial `kappa` and whose sine has the sign `elbow`.
    TrigRoots(const BentForm& form, const TrigPolynomial& kappa, double elbow,
              const TrigRootsTuning& tuning) noexcept
        : form_(form),
          kappa_(kappa),
          elbow_(elbow),
          tuning_(tuning),
          degree_(form.bent ? std::max({form.even.degree, form.odd.degree, 1}) : form.even.degree),
          even_2_(form.even.slope_bound(2)),
          even_3_(form.even.slope_bound(3)),
          odd_1_(form.odd.slope_bound(1)),
          odd_2_(form.odd.slope_bound(2)),
          kappa_1_(kappa.slope_bound(1)),
          square_2_(2.0 * kappa_1_ * (kappa_1_ + 1.0)) {}

    /// Calls give(enclosure) for everything that may be a root in [lower, upper], unsorted.
    template <class Give>
    void run(double lower, double upper, const Give& give) noexcept {
        const double widest = two_pi / (tuning_.cells * std::max(degree_, 1));
        const int n = static_cast<int>(min(std::ceil((upper - lower) / widest), 64.0));
        for (int i = n - 1; i >= 0; --i)
            cell_[count_++] = {lower + (upper - lower) * i / n, lower + (upper - lower) * (i + 1) / n};
        for (int round = 0; count_ > 0;) {
            for (; count_ > 0; ++round) {
                if (round >= tuning_.rounds || count_ > capacity - 16) {
                    while (count_ > 0) give(undecided(cell_[--count_]));
                    break;
                }
                look(give);
            }
            for (int i = 0; i < alone_count_; i += 8) refine(i, give);
            alone_count_ = 0;
        }
    }

private:
    struct Cell {
        double lower, upper;
    };
    /// A cell on which the function is monotonic, with a lower bound of its slope and an upper bound of its
    /// second derivative.
    struct Alone {
        double lower, upper, start, slope, bend;
    };
    /// A cell as a possible root: it is neither proven nor excluded there.
    static RootEnclosure undecided(const Cell& cell) noexcept { return {cell.lower, cell.upper, false}; }

    /// An upper bound of the error of the function's value, if |F1| is at most `odd` and sigma lies between
    /// `least` and `most`.
    ARMANGLE_INLINE RootLanes error(const RootLanes& odd, const RootLanes& least,
                                    const RootLanes& most) const noexcept {
        if (!form_.bent) return RootLanes(form_.even.error);
        // of sigma = sqrt(1 - kappa^2): e / sigma, and never more than sqrt(2 e)
        const double e = 1.5 * kappa_.error + 1e-15;
        const RootLanes of_sigma =
            min(RootLanes(e) / max(least, RootLanes(1e-30)), RootLanes(std::sqrt(2.0 * e))) +
            RootLanes(1e-15) * most;
        return RootLanes(form_.even.error) + most * RootLanes(form_.odd.error) + odd * of_sigma;
    }

    /// Examines eight cells: drops them, halves them, or keeps them for refinement.
    template <class Give>
    void look(const Give& give) noexcept {
        const int n = count_ < 8 ? count_ : 8;
        double from[8], to[8];
        count_ -= n;
        for (int i = 0; i < 8; ++i) {
            const Cell& one = cell_[count_ + (i < n ? i : 0)];
            from[i] = one.lower;
            to[i] = one.upper;
        }
        const RootLanes a = RootLanes::load(from), b = RootLanes::load(to);
        const RootLanes m = RootLanes(0.5) * (a + b), h = RootLanes(0.5 + 1e-9) * (b - a) + RootLanes(1e-15);
        const TrigPolynomial* const of[] = {&form_.even, &form_.odd, &kappa_};
        const RootLanes zero(0.0), half(0.5);
        RootLanes g0, g1, curve, wrong, least_slope;
        LaneMask<8> none, alone, flat;
        unsigned straight = 255u;
        if (!form_.bent) {
            TrigDerivatives<2> d[1];
            const TrigPolynomial* const even[] = {&form_.even};
            derivatives<2>(even, degree_, m, d);
            g0 = d[0].of[0];
            g1 = d[0].of[1];
            curve = abs(d[0].of[2]) + RootLanes(even_3_) * h;
            wrong = RootLanes(form_.even.error);
            none = abs(g0) > abs(g1) * h + half * curve * h * h + wrong;
            least_slope = abs(g1) - curve * h - RootLanes(degree_) * wrong;
            alone = least_slope > zero;
            flat = abs(g0) + abs(g1) * h + half * curve * h * h <= wrong + wrong;
        } else {
            TrigDerivatives<2> d[3];
            derivatives<2>(of, degree_, m, d);
            const RootLanes *f = d[0].of, *g = d[1].of, *k = d[2].of;
            const RootLanes odd_0 = abs(g[0]) + (abs(g[1]) + half * RootLanes(odd_2_) * h) * h;
            const RootLanes odd_1 = min(abs(g[1]) + RootLanes(odd_2_) * h, RootLanes(odd_1_));
            const RootLanes square = (RootLanes(1.0) - k[0]) * (RootLanes(1.0) + k[0]);  // sigma^2
            const RootLanes square_1 = RootLanes(-2.0) * k[0] * k[1];
            const RootLanes bend = abs(square_1) * h + RootLanes(0.5 * square_2_) * h * h;
            const RootLanes low = square - bend, sure = RootLanes(4.0 * kappa_.error + 1e-14);
            const auto smooth = low > sure;
            const RootLanes most = sqrt(max(square + bend, zero) + sure);
            const RootLanes least = sqrt(select(smooth, low - sure, RootLanes(1.0)));
            const RootLanes sigma = sqrt(max(square, zero));
            const RootLanes sigma_1 = square_1 / (RootLanes(2.0) * select(smooth, sigma, RootLanes(1.0)));
            const RootLanes slope = (abs(square_1) + RootLanes(square_2_) * h) / (RootLanes(2.0) * least);
            const RootLanes turn = (RootLanes(0.5 * square_2_) + slope * slope) / least;
            const RootLanes side(elbow_);
            const RootLanes even_1 = abs(f[1]) + RootLanes(even_2_) * h;
            // smooth: by the second derivative
            g0 = f[0] + side * sigma * g[0];
            g1 = f[1] + side * (sigma_1 * g[0] + sigma * g[1]);
            curve = abs(f[2]) + RootLanes(even_3_) * h + turn * odd_0 + RootLanes(2.0) * slope * odd_1 +
                    most * RootLanes(odd_2_);
            wrong = error(odd_0, select(smooth, least, zero), most);
            const RootLanes rise = abs(g1) * h + half * curve * h * h;
            const RootLanes wrong_1 =
                RootLanes(degree_) * wrong + slope * (RootLanes(form_.odd.error) + wrong / least);
            // beside sigma = 0: by the values of sigma alone, and by its slope
            const RootLanes rough = even_1 * h + most * odd_0;
            const RootLanes odd_least = abs(g[0]) - (abs(g[1]) + half * RootLanes(odd_2_) * h) * h;
            const RootLanes steep = abs(square_1) - RootLanes(square_2_) * h;
            const RootLanes steepest = max(steep, zero) * max(odd_least, zero) / (RootLanes(2.0) * most) -
                                       even_1 - most * odd_1 - RootLanes(degree_) * wrong;
            none =
                (smooth & (abs(g0) > rise + wrong)) | (abs(f[0]) > rough + wrong) | (square + bend < -sure);
            least_slope = select(smooth, abs(g1) - curve * h - wrong_1, steepest);
            alone = least_slope > zero;
            flat = (smooth & (abs(g0) + rise <= wrong + wrong)) | (abs(f[0]) + rough <= wrong + wrong);
            g1 = select(smooth, g1, zero);
            straight = bits(smooth);
        }
        const unsigned dropped = bits(none), single = bits(alone), level = bits(flat);
        for (int i = 0; i < n; ++i) {
            if (dropped >> i & 1u) continue;
            const Cell cell{from[i], to[i]};
            const double middle = 0.5 * (cell.lower + cell.upper);
            if (single >> i & 1u && alone_count_ < most_alone) {
                const double step = g1[i] != 0 ? -g0[i] / g1[i] : 0.0;
                alone_[alone_count_++] = {cell.lower, cell.upper,
                                          min(max(middle + step, cell.lower), cell.upper), least_slope[i],
                                          straight >> i & 1u ? curve[i] : infinity};
                continue;
            }
            if (level >> i & 1u || 0.5 * (cell.upper - cell.lower) < tuning_.narrowest) {
                give(undecided(cell));
                continue;
            }
            halve(cell);
        }
    }

    /// Puts both halves of a cell on the stack.
    void halve(const Cell& cell) noexcept {
        const double middle = 0.5 * (cell.lower + cell.upper);
        cell_[count_++] = {middle, cell.upper};
        cell_[count_++] = {cell.lower, middle};
    }

    /// Value and slope of the function, and an upper bound of the value's error.
    struct Value {
        RootLanes g, slope, wrong;
    };
    /// The function, its slope and its error bound at several x.
    Value value(const RootLanes& x) const noexcept {
        if (!form_.bent) {
            TrigDerivatives<1> d[1];
            const TrigPolynomial* const even[] = {&form_.even};
            derivatives<1>(even, degree_, x, d);
            return {d[0].of[0], d[0].of[1], RootLanes(form_.even.error)};
        }
        const TrigPolynomial* const of[] = {&form_.even, &form_.odd, &kappa_};
        TrigDerivatives<1> d[3];
        derivatives<1>(of, degree_, x, d);
        const RootLanes *f = d[0].of, *g = d[1].of, *k = d[2].of;
        const RootLanes square = max((RootLanes(1.0) - k[0]) * (RootLanes(1.0) + k[0]), RootLanes(0.0));
        const RootLanes sigma = sqrt(square), side(elbow_);
        const RootLanes sigma_1 = -(k[0] * k[1]) / max(sigma, RootLanes(1e-12));
        return {f[0] + side * sigma * g[0], f[1] + side * (sigma_1 * g[0] + sigma * g[1]),
                error(abs(g[0]), sigma, sigma)};
    }

    /// Refines the roots of eight cells that contain at most one each, by Newton's method within the brackets
    /// that the signs give.
    template <class Give>
    void refine(int first, const Give& give) noexcept {
        const int n = alone_count_ - first < 8 ? alone_count_ - first : 8;
        double lower[8], upper[8], start[8], slope[8], bend[8];
        for (int i = 0; i < 8; ++i) {
            const Alone& one = alone_[first + (i < n ? i : 0)];
            lower[i] = one.lower;
            upper[i] = one.upper;
            start[i] = one.start;
            slope[i] = one.slope;
            bend[i] = one.bend;
        }
        RootLanes a = RootLanes::load(lower), b = RootLanes::load(upper), x = RootLanes::load(start);
        const RootLanes least = RootLanes::load(slope), most = RootLanes::load(bend);
        const Value at_a = value(a), at_b = value(b);
        const auto sure_a = abs(at_a.g) > at_a.wrong, sure_b = abs(at_b.g) > at_b.wrong;
        const auto negative_a = at_a.g < RootLanes(0.0), negative_b = at_b.g < RootLanes(0.0);
        const unsigned at_end = bits(!(sure_a & sure_b)) & ((1u << n) - 1u);
        const unsigned unlike = (bits(negative_a) ^ bits(negative_b)) & ((1u << n) - 1u) & ~at_end;
        for_each_bit(at_end, [&](int i) {  // beside an end of its cell, where the sign is not certain
            const double reach_a = sure_a[i] ? 0.0 : near(at_a, least, most)[i],
                         reach_b = sure_b[i] ? 0.0 : near(at_b, least, most)[i];
            if (is_rough(lower[i], upper[i], bend[i], max(reach_a, reach_b)))
                return halve({lower[i], upper[i]});
            if (!sure_a[i]) give_root(lower[i], min(lower[i] + reach_a, upper[i]), give);
            if (!sure_b[i]) give_root(max(upper[i] - reach_b, lower[i]), upper[i], give);
        });
        if (unlike == 0) return;
        const RootLanes sign = select(negative_a, RootLanes(-1.0), RootLanes(1.0));
        Value now = value(x);
        for (int pass = 0; pass < tuning_.newton; ++pass) {
            const auto going = abs(now.g) > now.wrong;
            if ((bits(going) & unlike) == 0) break;
            const auto lower_side = now.g * sign > RootLanes(0.0);
            a = select(lower_side, x, a);
            b = select(lower_side, b, x);
            const RootLanes to = x - now.g / now.slope;
            const auto kept = (to > a) & (to < b);
            x = select(going, select(kept, to, RootLanes(0.5) * (a + b)), x);
            now = value(x);
        }
        const RootLanes wide = near(now, least, most);
        const RootLanes from = max(x - wide, RootLanes::load(lower)),
                        to = min(x + wide, RootLanes::load(upper));
        for_each_bit(unlike, [&](int i) {
            if (is_rough(lower[i], upper[i], bend[i], wide[i])) return halve({lower[i], upper[i]});
            give_root(from[i], to[i], give);
        });
    }

    /// Whether halving the cell would locate its root better: near sigma = 0, where the slope varies fast.
    bool is_rough(double lower, double upper, double bend, double reach) const noexcept {
        return bend == infinity && min(reach, 0.25 * (upper - lower)) > tuning_.narrowest;
    }

    /// An upper bound of the distance of a root from a place, by the slope there while it cannot halve on the
    /// way, or by the least slope of the cell.
    static RootLanes near(const Value& at, const RootLanes& least, const RootLanes& bend) noexcept {
        const RootLanes size = abs(at.g) + at.wrong, half = RootLanes(0.5) * abs(at.slope), by = size / half;
        return select(bend * by <= half, by, size / least) + RootLanes(1e-15);
    }

    /// Calls give() with a proven single root between lower and upper, widened by rounding.
    template <class Give>
    void give_root(double lower, double upper, const Give& give) const noexcept {
        give({lower - 1e-15, upper + 1e-15, true});
    }

    static constexpr int capacity = 512, most_alone = 128;
    const BentForm& form_;
    const TrigPolynomial& kappa_;
    const double elbow_;
    const TrigRootsTuning& tuning_;
    const int degree_;
    const double even_2_, even_3_, odd_1_, odd_2_, kappa_1_, square_2_;
    int count_ = 0, alone_count_ = 0;
    Cell cell_[capacity];
    Alone alone_[most_alone];
};

}  // namespace detail

/// Calls give(enclosure) for all roots of `form` in [lower, upper], on which |kappa| <= 1 up to rounding;
/// `elbow` is 1 or -1.
template <class Give>
void trig_roots(const BentForm& form, const TrigPolynomial& kappa, double elbow, double lower, double upper,
                const TrigRootsTuning& tuning, const Give& give) noexcept {
    detail::TrigRoots(form, kappa, elbow, tuning).run(lower, upper, give);
}

}  // namespace armangle

#include "../names/end.hpp"
