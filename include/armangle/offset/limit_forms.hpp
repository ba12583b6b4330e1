// Every limit of an arm with an offset wrist as a root of F0 + elbow sigma F1 in theta_7: F0 of degree 4 and
// F1 of degree 3 for joints 1, 2, 3, degrees 1 and 0 for joints 5, 6 and the fold. Both wrists and both
// shoulders share the roots.
//
// c, s: cosine and sine of theta_7. w, axis 6 and kappa = cos eta are linear in them, and sigma = sin eta is
// the root of 1 - kappa^2. An element a + b sigma of that ring is multiplied with sigma^2 = 1 - kappa^2. For
// any vector N, z4 . N = m holds for one of the wrist's two signs where
//
//     F = D m^2 - 2 h B m + h^2 (|N|^2 - (y6.N)^2) - C^2 = 0,  B = w.N - t y6.N,  C = (w x y6).N
//
// F is sampled at 16 places of the circle, each with a bound of its rounding; a discrete Fourier
// transform has its coefficients. Derivation: docs/background/other_wrists.md.
#pragma once

#include "offset_motion.hpp"
#include "trig_roots.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

inline constexpr int form_samples = 16;

/// Cosine and sine of the angles 2 pi j / 16, and the matrix from values at these angles (row j) to Fourier
/// coefficients: column k < 9 is that of cos kx, column k > 8 that of sin (k - 8)x.
struct FormTables {
    double c[form_samples], s[form_samples];
    double transform[form_samples][form_samples];

    FormTables() noexcept {
        for (int j = 0; j < form_samples; ++j) {
            c[j] = turn(j);
            s[j] = turn(j + 12);  // cos(x - pi/2)
            for (int k = 0; k < form_samples; ++k) {
                const double weight = (k == 0 || k == 8 ? 1.0 : 2.0) / form_samples;
                transform[j][k] = weight * (k <= 8 ? turn(j * k) : turn(j * (k - 8) + 12));
            }
        }
    }

private:
    /// The value cos(2 pi i / 16) for any integer i, with the same digits in each quadrant.
    static double turn(int i) noexcept {
        constexpr double part[] = {1.0, 0.92387953251128674, 0.70710678118654752, 0.38268343236508977, 0.0};
        i &= 15;
        if (i > 8) i = 16 - i;
        return i <= 4 ? part[i] : -part[8 - i];
    }
};
inline const FormTables form_tables;

}  // namespace detail

/// The limits of one pose as functions of theta_7; each member returns a function that is 0 where a joint has
/// the given angle.
class LimitForms {
public:
    /// Computes what the functions of a pose and branch share: the shoulder in the axes of the flange, with
    /// errors.
    LimitForms(const OffsetArm& arm, const OffsetMotion<>& m) noexcept : arm_(arm.rest), a_6_(arm.a_6) {
        using detail::form_tables;
        const double axis = tolerance::rounding;  // how far the flange's axes may be from a rotation's
        const auto vector = [](const Vec3<double>& v, double within) {
            return Vec{{{v.x, abs(v.x), within}, {v.y, abs(v.y), within}, {v.z, abs(v.z), within}}};
        };
        const Vec S = vector(m.from_shoulder, 0.0), x7 = vector(m.flange.x, axis),
                  y7 = vector(m.flange.y, axis), z7 = vector(m.flange.z, axis);
        const Number upper = given(arm_.upper_arm), fore = given(arm_.forearm);
        along_x_ = dot(S, x7);
        along_y_ = dot(S, y7);
        along_z_ = dot(S, z7);
        const Number fixed = dot(S, S) + Number(a_6_) * a_6_;
        const double bend = 1.0 / (2.0 * arm_.upper_arm * arm_.forearm);
        const Number scale(bend, bend, 4.0 * Number::rounding * bend);
        kappa_[0] = (fixed - upper * upper - fore * fore) * scale;
        kappa_[1] = Number(-2.0 * a_6_) * along_x_ * scale;
        kappa_[2] = Number(2.0 * a_6_) * along_y_ * scale;
        sine_ = given(arm_.delta.sin);
        cosine_ = given(arm_.delta.cos);
        plain_ = abs(arm_.a_3) <= tolerance::rounding * arm_.reach &&
                 abs(arm_.a_4) <= tolerance::rounding * arm_.reach;
        reduced_ = !plain_ && abs(arm_.a_3 + arm_.a_4) <= tolerance::rounding * arm_.reach;
        bends_ = !plain_;

        const Samples c = of(Row::load(form_tables.c)), s = of(Row::load(form_tables.s));
        kappa_at_ = tight(all(kappa_[0]) + all(kappa_[1]) * c + all(kappa_[2]) * s);
        square_ = tight(all(1.0) - kappa_at_ * kappa_at_);
        const Samples across = all(along_x_) * c - all(along_y_) * s;
        length_2_ = tight(all(fixed) - all(2.0 * a_6_) * across);
        t_ = tight(all(along_x_) * s + all(along_y_) * c);
        s4_ = ring(0.0, 1.0, 0.0);
        c4_ = ring(0.0, 0.0, 1.0);
        g_ = ring(arm_.a_4, arm_.d_se, arm_.a_3);
        h_ = ring(arm_.d_ew, -arm_.a_3, arm_.d_se);
        across_2_ = tight(length_2_ - t_ * t_);
        h_square_ = multiply(h_, h_);
        prepare_shoulder();
        up_ = S.of[2];
        up_x_ = x7.of[2];
        up_y_ = y7.of[2];
        const Vec px = cross(S, x7), py = cross(S, y7);
        for (int i = 0; i < 3; ++i) {
            w_[i] = tight(all(S.of[i]) - all(a_6_) * (all(x7.of[i]) * c - all(y7.of[i]) * s));
            y_[i] = tight(all(x7.of[i]) * s + all(y7.of[i]) * c);
            normal_[i] = tight(all(px.of[i]) * s + all(py.of[i]) * c - all(a_6_) * all(z7.of[i]));  // w x y6
        }
    }

    /// The polynomial cos eta, where theta_4 - delta = elbow eta.
    TrigPolynomial kappa() const noexcept { return linear(kappa_[0], kappa_[1], kappa_[2]); }

    /// The function that is 0 where the bend of the elbow has this cosine; 1 and -1 are the ends of the
    /// reach.
    BentForm bend(double cosine) const noexcept {
        return {linear(kappa_[0] - of_angle(cosine), kappa_[1], kappa_[2]), {}, false};
    }

    /// The function |w x y6|^2, which is 0 where axis 5 may have any direction.
    BentForm across() const noexcept { return {transformed(across_2_, 2), {}, false}; }

    /// The function t + g sine, which is 0 where sin theta_5 = sine; 1 and -1 are the folds.
    BentForm theta_5(double sine) const noexcept {
        const Number by = of_angle(sine), straight = in_kappa(arm_.d_se, arm_.a_3) * by;
        const Number odd = in_sigma(arm_.d_se, arm_.a_3) * by;
        return {linear(Number(arm_.a_4) * by + straight * kappa_[0], along_y_ + straight * kappa_[1],
                       along_x_ + straight * kappa_[2]),
                linear(odd, 0.0, 0.0), true};
    }

    /// The function h + sin (w.x6) - cos (w.z7) for theta_6 = at, from z4 = -sin theta_6 x6 + cos theta_6 z7.
    BentForm theta_6(double at) const noexcept {
        const SinCos<Number> angle = direction(at);
        const Number straight = in_kappa(-arm_.a_3, arm_.d_se), odd = in_sigma(-arm_.a_3, arm_.d_se);
        const auto even =
            linear(Number(arm_.d_ew) + straight * kappa_[0] - angle.sin * a_6_ - angle.cos * along_z_,
                   straight * kappa_[1] + angle.sin * along_x_, straight * kappa_[2] - angle.sin * along_y_);
        return {even, linear(odd, 0.0, 0.0), bends_};
    }

    /// The function w.z0 - cosine (d_se + d_ew c4 + a_4 s4), which is 0 wherever theta_2 = 0 (cosine 1) or pi
    /// (-1), of either wrist.
    BentForm straight(double cosine) const noexcept {
        const Number by(-cosine), straight = in_kappa(arm_.a_4, arm_.d_ew) * by;
        const auto even =
            linear(up_ + Number(arm_.d_se) * by + straight * kappa_[0],
                   straight * kappa_[1] - Number(a_6_) * up_x_, straight * kappa_[2] + Number(a_6_) * up_y_);
        return {even, linear(in_sigma(arm_.a_4, arm_.d_ew) * by, 0.0, 0.0), bends_};
    }

    /// The function for theta_1 = at or at + pi: N = k n, m = -s4 w.n, n = (-sin, cos, 0), k = a_3 + a_4 c4 -
    /// d_ew s4.
    BentForm theta_1(double at) const noexcept {
        const SinCos<Number> angle = direction(at);
        const auto along = [&](const Samples(&v)[3]) {
            return all(angle.cos) * v[1] - all(angle.sin) * v[0];
        };
        const Samples w = along(w_), y = along(y_), normal = along(normal_), d_ew = all(arm_.d_ew);
        if (plain_) return unit_form(even(w * w), even(d_ew * w), w - t_ * y, y, normal, 2);
        if (!reduced_) return unit_form(s4_square_ * (w * w), s4_k_ * -w, w - t_ * y, y, normal, 4);
        return unit_form(cc_ * (w * w), s4_k_ * -w, w - t_ * y, y, normal, 3);
    }

    /// The function for theta_2 = at or -at: N = k z0, m = g cos theta_2 - s4 w.z0.
    BentForm theta_2(double at) const noexcept {
        const Samples cosine = all(direction(at).cos), &w = w_[2], &y = y_[2];
        const Samples beside = w - t_ * y, u = all(arm_.d_se) * cosine - w;
        const Samples d_ew = all(arm_.d_ew), a_3 = all(arm_.a_3);
        if (plain_) return unit_form(even(u * u), even(-(d_ew * u)), beside, y, normal_[2], 2);
        if (!reduced_) {
            const Ring m = g_ * cosine - s4_ * w;
            return unit_form(multiply(m, m), multiply(m, k_), beside, y, normal_[2], 4);
        }
        const Samples v = a_3 * cosine;
        const Ring square = cc_ * (u * u) - sc_ * (all(2.0) * u * v) + ss_ * (v * v);
        const Ring mixed = sc_ * (u * a_3 + v * d_ew) - cc_ * (u * d_ew) - ss_ * (v * a_3);
        return unit_form(square, mixed, beside, y, normal_[2], 3);
    }

    /// The function for theta_3 = at or at + pi: N = sin q z0 - cos (w x z0), m = sin c4 w.z0, q = d_se +
    /// d_ew c4 + a_4 s4.
    BentForm theta_3(double at) const noexcept {
        const SinCos<Number> angle = direction(at);
        const Samples sine = all(angle.sin), cosine = all(angle.cos);
        const Samples &w = w_[2], &y = y_[2], &normal = normal_[2];
        const Ring m = c4_ * (sine * w), q = ring(arm_.d_se, arm_.a_4, arm_.d_ew) * sine;
        const auto plus = [](const Ring& x, const Samples& to) { return Ring{x.even + to, x.odd}; };
        const Ring y_n = plus(q * y, cosine * normal);
        const Ring b_n = plus(q * (w - t_ * y), -(cosine * (t_ * normal)));
        const Ring c_n = plus(q * normal, -(cosine * (length_2_ * y - t_ * w)));
        const Ring n_n = plus(multiply(q, q), cosine * cosine * (length_2_ - w * w));
        const Ring f = multiply(m, m) * across_2_ - multiply(multiply(h_, b_n), m) * all(2.0) +
                       multiply(h_square_, n_n - multiply(y_n, y_n)) - multiply(c_n, c_n);
        return form(f, 4);
    }

private:
    using Row = Lane<detail::form_samples>;
    using Samples = Rounded<Row>;
    using Number = Rounded<double>;
    struct Vec {
        Number of[3];
    };
    /// A number even + odd sigma, with sigma = sin eta.
    struct Ring {
        Samples even, odd;
        ARMANGLE_INLINE friend Ring operator+(const Ring& a, const Ring& b) noexcept {
            return {a.even + b.even, a.odd + b.odd};
        }
        ARMANGLE_INLINE friend Ring operator-(const Ring& a, const Ring& b) noexcept {
            return {a.even - b.even, a.odd - b.odd};
        }
        ARMANGLE_INLINE friend Ring operator*(const Ring& a, const Samples& by) noexcept {
            return {a.even * by, a.odd * by};
        }
    };

    /// A parameter of the arm, with an error of some roundings.
    static Number given(double x) noexcept { return {x, abs(x), 2.0 * Number::rounding * abs(x)}; }
    /// A computed sine or cosine, with its error.
    static Number of_angle(double x) noexcept { return {x, abs(x), tolerance::rounding}; }
    /// The sine and cosine of an angle (rad), with their errors.
    static SinCos<Number> direction(double at) noexcept {
        const SinCos<double> angle = sin_cos(at);
        return {of_angle(angle.sin), of_angle(angle.cos)};
    }
    /// The samples x of a cosine or sine, with bounds: of size at most 1, each within a rounding.
    static Samples of(const Row& x) noexcept { return {x, 1.0, Number::rounding}; }
    /// The same number at all samples.
    static Samples all(const Number& x) noexcept { return {Row(x.value), x.size, x.radius}; }
    /// The same exact number at all samples.
    static Samples all(double x) noexcept { return Samples(x); }
    /// Samples x, their bound of size reduced to the largest magnitude among them plus their radius, if that
    /// is less.
    static Samples tight(const Samples& x) noexcept {
        double sample[detail::form_samples];
        abs(x.value).store(sample);
        const Lane<8> most = max(Lane<8>::load(sample), Lane<8>::load(sample + 8));
        return {x.value, min(x.size, x.radius - least(-most)), x.radius};
    }
    /// A function without sigma.
    static Ring even(const Samples& x) noexcept { return {x, Samples(0.0)}; }
    static Number dot(const Vec& a, const Vec& b) noexcept {
        return a.of[0] * b.of[0] + a.of[1] * b.of[1] + a.of[2] * b.of[2];
    }
    static Vec cross(const Vec& a, const Vec& b) noexcept {
        const auto &p = a.of, &q = b.of;
        return {{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]}};
    }

    /// The coefficient of kappa in a sin theta_4 + b cos theta_4.
    Number in_kappa(double a, double b) const noexcept { return sine_ * a + cosine_ * b; }
    /// The coefficient of the elbow's sign times sigma in a sin theta_4 + b cos theta_4.
    Number in_sigma(double a, double b) const noexcept { return cosine_ * a - sine_ * b; }
    /// The number fixed + a sin theta_4 + b cos theta_4.
    Ring ring(double fixed, double a, double b) const noexcept {
        return {all(fixed) + all(in_kappa(a, b)) * kappa_at_, all(in_sigma(a, b))};
    }
    /// The product of two functions even + odd sigma, with sigma^2 replaced by its samples.
    ARMANGLE_INLINE Ring multiply(const Ring& a, const Ring& b) const noexcept {
        return {a.even * b.even + a.odd * b.odd * square_, a.even * b.odd + a.odd * b.even};
    }

    /// Computes what the functions of theta_1 and theta_2 share. If axes 3 and 5 coincide at theta_4 = 0,
    /// they have the factor 4 sin^2(theta_4 / 2), which is left out; without elbow offsets the factor is
    /// sin^2 theta_4.
    void prepare_shoulder() noexcept {
        const Samples a_3 = all(arm_.a_3), d_ew = all(arm_.d_ew), half = all(0.5);
        if (plain_) {
            k_square_ = even(d_ew * d_ew);
        } else if (reduced_) {
            const Ring c = c4_ * half;
            sc_ = s4_ * half;
            cc_ = {half + c.even, c.odd};
            ss_ = {half - c.even, -c.odd};
            s4_k_ = sc_ * a_3 - cc_ * d_ew;
            k_square_ = ss_ * (a_3 * a_3) - sc_ * (all(2.0) * a_3 * d_ew) + cc_ * (d_ew * d_ew);
        } else {
            k_ = ring(arm_.a_3, -arm_.d_ew, arm_.a_4);
            s4_square_ = multiply(s4_, s4_);
            s4_k_ = multiply(s4_, k_);
            k_square_ = multiply(k_, k_);
        }
        k_h_square_ = multiply(k_square_, h_square_);
    }

    /// The function F of N = k n for a unit vector n: D m^2 - 2 h (m k) B + k^2 (h^2 (1 - y^2) - C^2).
    BentForm unit_form(const Ring& m_square, const Ring& m_k, const Samples& b, const Samples& y,
                       const Samples& normal, int degree) const noexcept {
        const Ring first = m_square * across_2_ - multiply(h_, m_k) * (all(2.0) * b);
        const Ring second = k_h_square_ * (all(1.0) - y * y) - k_square_ * (normal * normal);
        return form(first + second, degree);
    }

    /// The coefficients of a sampled function whose even part has this degree, its odd part one less.
    BentForm form(const Ring& f, int degree) const noexcept {
        if (!bends_) return {transformed(f.even, degree), {}, false};
        return {transformed(f.even, degree), transformed(f.odd, degree - 1), true};
    }

    /// The polynomial of this degree through the samples, with its error. An error e of the samples changes a
    /// value by at most (1 + 2 degree) e; the sums of the transform have 16 terms.
    static TrigPolynomial transformed(const Samples& f, int degree) noexcept {
        double sample[detail::form_samples], coefficient[detail::form_samples];
        f.value.store(sample);
        Row sum(0.0);
        for (int j = 0; j < detail::form_samples; ++j)
            sum = mul_add(Row(sample[j]), Row::load(detail::form_tables.transform[j]), sum);
        sum.store(coefficient);
        TrigPolynomial out;
        out.degree = degree;
        out.c[0] = coefficient[0];
        for (int k = 1; k <= degree; ++k) {
            out.c[k] = coefficient[k];
            out.s[k] = coefficient[8 + k];
        }
        out.error = (1 + 2 * degree) * f.bound() + (1 + 4 * degree) * 20.0 * Number::rounding * f.size +
                    evaluation(out);
        return out;
    }

    /// The polynomial c0 + c1 cos x + s1 sin x, with the errors of its coefficients.
    static TrigPolynomial linear(const Number& c0, const Number& c1, const Number& s1) noexcept {
        TrigPolynomial out;
        out.degree = 1;
        out.c[0] = c0.value;
        out.c[1] = c1.value;
        out.s[1] = s1.value;
        out.error = c0.bound() + c1.bound() + s1.bound() + evaluation(out);
        return out;
    }

    /// A bound of the rounding when a polynomial is evaluated. The k-th cosines and sines, each computed from
    /// the one before, are off by 4 k roundings and k times the error of x; two more roundings are added for
    /// each term.
    static double evaluation(const TrigPolynomial& p) noexcept {
        const double first = (2 * p.degree + 1) * Number::rounding * p.slope_bound(0);
        return first + (4.0 * Number::rounding + tolerance::rounding) * p.slope_bound(1);
    }

    const Arm& arm_;
    const double a_6_;
    Number along_x_, along_y_, along_z_, up_, up_x_, up_y_, kappa_[3], sine_, cosine_;
    bool plain_, reduced_, bends_;
    Samples kappa_at_, square_, length_2_, t_, across_2_, w_[3], y_[3], normal_[3];
    Ring s4_, c4_, g_, h_, h_square_;
    Ring k_, k_square_, k_h_square_, s4_k_, s4_square_, sc_, cc_, ss_;  // those that the arm needs
};

}  // namespace armangle

#include "../names/end.hpp"
