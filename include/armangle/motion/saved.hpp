// The numbers that save the state of a running loop, in the order in which its members are visited.
//
// A class has `each_number(visit)`, which calls visit(member) for all that one control cycle passes to the
// next. One list therefore serves both writing and reading.
#pragma once

#include <cstddef>
#include <cstdint>

#include "../circle/towards.hpp"
#include "../circle/inverse.hpp"
#include "../numbers/twist.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Passes members to one(double&), number by number, and stores what it leaves there: it may read or replace
/// each number.
template <class One>
class EachNumber {
public:
    /// Calls `one` for each number of the values that it is given.
    explicit EachNumber(const One& one) noexcept : one_(one) {}

    /// Saves or restores a number.
    void operator()(double& x) { one_(x); }
    /// Saves or restores a truth value, as 1 or 0.
    void operator()(bool& x) {
        double value = x ? 1.0 : 0.0;
        one_(value);
        x = value == 1.0;
    }
    /// Saves or restores any integer.
    void operator()(int& x) { within(x, -largest, largest); }
    /// Saves or restores an integer; a restored value outside [least, most] leaves x unchanged.
    void within(int& x, int least, int most) {
        double value = x;
        one_(value);
        if (value >= least && value <= most) x = static_cast<int>(value);
    }
    /// Saves or restores an unsigned integer; a restored value that is none leaves x unchanged.
    void operator()(std::uint32_t& x) {
        double value = x;
        one_(value);
        if (value >= 0 && value <= UINT32_MAX) x = static_cast<std::uint32_t>(value);
    }
    /// Saves or restores the coordinates of a vector.
    void operator()(Vec3<double>& v) { all(v.x, v.y, v.z); }
    /// Saves or restores a pose: position, then the three axes.
    void operator()(Pose<double>& p) { all(p.position, p.rotation.x, p.rotation.y, p.rotation.z); }
    /// Saves or restores a twist: linear, then angular velocity.
    void operator()(Twist& t) { all(t.linear, t.angular); }
    /// Saves or restores joint values.
    void operator()(Joints& q) { (*this)(q.q); }
    /// Saves or restores a target of the elbow; an unknown kind is restored as a psi.
    void operator()(Towards& hint) {
        int wish = static_cast<int>(hint.wish);
        all(wish, hint.psi, hint.target);
        hint.wish = Wish::psi;
        for (const Wish named : {Wish::point, Wish::direction})
            if (wish == static_cast<int>(named)) hint.wish = named;
    }
    /// Each element of an array, in order.
    template <class T, std::size_t n>
    void operator()(T (&values)[n]) {
        for (T& value : values) (*this)(value);
    }

    /// Visits each of the members, in order.
    template <class... T>
    void all(T&... members) {
        ((*this)(members), ...);
    }

private:
    static constexpr int largest = 2147483647;
    One one_;
};

/// The number of values that save the state of a loop.
template <class Loop>
int saved_size(Loop loop) noexcept {
    int n = 0;
    EachNumber visit([&n](double&) { ++n; });
    loop.each_number(visit);
    return n;
}

/// Writes the state of a loop to `numbers`, which must have room for saved_size(loop).
template <class Loop>
void save(Loop loop, double* numbers) noexcept {
    EachNumber visit([&numbers](double& x) { *numbers++ = x; });
    loop.each_number(visit);
}

/// Restores the state that save() wrote, into a loop with the same arm and options.
template <class Loop>
void restore(Loop& loop, const double* numbers) noexcept {
    EachNumber visit([&numbers](double& x) { x = *numbers++; });
    loop.each_number(visit);
}

}  // namespace armangle

#include "../names/end.hpp"
