// Inserts rows between the rows of a followed path, so that limits hold between them too.
//
//     q |----------- limit    Rows respect their limits, and the arm angle is straight between two of them.
//       |    ' o '            If a path follows a limit that bends, the straight line violates it: a row
//       |  o       o          is inserted in the middle (x), with its arm angle moved until the joint is
//       |      x              as far inside as it was outside, and so on.
//       +----------- s
//
// The space between rows is sampled, not proven. There are so many samples that an unnoticed violation is
// below 1e-8 rad on the paths of the tests.
#pragma once

#include <cmath>
#include <vector>

#include "../arm/limits.hpp"
#include "../numbers/scalar.hpp"
#include "path_rows.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The largest limit violation after a row, in spite of inserted rows.
struct PassedLimit {
    double excess = 0;    // rad; 0: none
    int joint = 0;        // 1..7
    std::size_t row = 0;  // among the given rows
};

/// Parameters of rows between the rows of a followed path.
struct RowsWithinTuning {
    static constexpr int places = 24;        // between two rows, denser near these
    static constexpr double kept = 2e-10;    // rad: a smaller violation counts as none
    static constexpr double inside = 1.1;    // of the violation at the middle: distance inside of the new row
    static constexpr int levels = 14;        // rows between rows
    static constexpr int rounds = 6;         // of Newton's method for an arm angle
    static constexpr double probe = 1e-6;    // rad, of psi: for a joint's slope ...
    static constexpr double still = 1e-6;    // ... below which psi does not move the joint
    static constexpr double step = 0.2;      // rad, of psi
    static constexpr double near = 1e-3;     // rad: motion of joints between rows beyond the direct move
    static constexpr int more_rows = 20000;  // at most
};

namespace detail {

/// Finds rows to insert. draw(rows) returns a function of s: the configuration there. solve(s, psi, gc, near,
/// q) writes the joints of an arm angle in the revolutions nearest to `near`; false if there are none.
template <class Draw, class Solve>
class RowsWithin {
public:
    /// Keeps references to its arguments; run() inserts rows into `rows`, whose joints may exceed the limits.
    RowsWithin(const Limits& limits, const Draw& draw, const Solve& solve, PathRows& rows)
        : limits_(limits), draw_(draw), solve_(solve), given_(rows.q), rows_(rows) {}

    /// Inserts rows until no joint passes a limit between two of them, beyond the violation of the given
    /// rows; returns the largest such violation that is left.
    PassedLimit run() {
        const std::size_t n = rows_.size();
        for (std::size_t k = 0; k + 1 < n; ++k) gaps_.push_back({k, is_near(k)});
        int left = RowsWithinTuning::more_rows;
        PassedLimit worst;
        for (int level = 0; level <= RowsWithinTuning::levels; ++level) {
            const auto at = draw_(rows_);
            std::vector<Between> found;
            for (std::size_t k = 0; k < gaps_.size(); ++k) {
                if (!gaps_[k].open) continue;
                Between passed = look(at, k);
                gaps_[k].open = passed.excess > RowsWithinTuning::kept;
                if (!gaps_[k].open) continue;
                if (level < RowsWithinTuning::levels && left > 0 && put_between(at, passed)) {
                    --left;
                    found.push_back(passed);
                } else {
                    gaps_[k].open = false;
                    if (passed.excess > worst.excess) worst = {passed.excess, passed.joint + 1, gaps_[k].row};
                }
            }
            if (found.empty()) break;
            insert(found);
        }
        return worst;
    }

private:
    struct Gap {          // from a row to the next
        std::size_t row;  // among the given rows
        bool open;        // whether it must be checked
    };
    struct Between {
        std::size_t gap;
        double excess = 0;
        int joint = 0;
        double s = 0, psi = 0, q[joint_slots] = {};  // a row in its middle ...
        int gc = 0;                                  // ... and its branch
    };

    /// The violation (rad) of the limits of joint j; negative within.
    double beyond(const double* q, int j) const noexcept {
        return max(limits_.lower[j] - q[j], q[j] - limits_.upper[j]);
    }
    /// The seven joints (rad) of a row.
    const double* joints_of(std::size_t row) const noexcept { return rows_.q.data() + joints * row; }

    /// Whether a joint may reach a limit between row k and the next.
    bool is_near(std::size_t k) const noexcept {
        const double *a = joints_of(k), *b = joints_of(k + 1);
        double move = RowsWithinTuning::near;
        for (int j = 0; j < joints; ++j) move = max(move, abs(b[j] - a[j]));
        for (int j = 0; j < joints; ++j)
            if (max(beyond(a, j), beyond(b, j)) > -move) return true;
        return false;
    }

    /// Finds the largest limit violation between row k and the next, beyond that of the given rows around it;
    /// excess 0 if none.
    template <class At>
    Between look(const At& at, std::size_t k) const {
        Between out{k};
        const double *a = given_.data() + joints * gaps_[k].row, *b = a + joints;
        const double from = rows_.s[k], to = rows_.s[k + 1];
        for (int i = 1; i <= RowsWithinTuning::places; ++i) {
            const double share = 0.5 * (1.0 - std::cos(pi * i / (RowsWithinTuning::places + 1)));
            const auto here = at(from + (to - from) * share);
            for (int j = 0; j < joints; ++j) {
                const double excess = beyond(here.q, j) - max(0.0, max(beyond(a, j), beyond(b, j)));
                if (excess > out.excess) {
                    out.excess = excess;
                    out.joint = j;
                }
            }
        }
        return out;
    }

    /// Computes a row in the middle of the gap of x and stores it in x, with psi moved such that the joint of
    /// x is within its limits; false if psi cannot do that, or the gap is too narrow.
    template <class At>
    bool put_between(const At& at, Between& x) const {
        const double from = rows_.s[x.gap], to = rows_.s[x.gap + 1];
        x.s = from + 0.5 * (to - from);
        if (!(x.s > from && x.s < to)) return false;
        const auto middle = at(x.s);
        std::copy(middle.q, middle.q + joints, x.q);
        x.psi = middle.psi;
        x.gc = middle.gc;
        const int j = x.joint;
        const bool above = x.q[j] - limits_.upper[j] > limits_.lower[j] - x.q[j];
        const double middle_of_range = 0.5 * (limits_.lower[j] + limits_.upper[j]);
        const double inside = RowsWithinTuning::inside * x.excess;
        const double wanted =
            above ? limits_.upper[j] - min(inside, max(limits_.upper[j] - middle_of_range, 0.0))
                  : limits_.lower[j] + min(inside, max(middle_of_range - limits_.lower[j], 0.0));
        for (int round = 0; round < RowsWithinTuning::rounds; ++round) {
            const double off = wanted - x.q[j];
            if (above ? off >= 0 : off <= 0) return true;
            double beside[joint_slots];
            if (!solve_(x.s, x.psi + RowsWithinTuning::probe, x.gc, x.q, beside)) return false;
            const double slope = (beside[j] - x.q[j]) / RowsWithinTuning::probe;
            if (!(abs(slope) > RowsWithinTuning::still)) return false;
            const double by = off / slope,
                         psi = x.psi + min(max(by, -RowsWithinTuning::step), RowsWithinTuning::step);
            if (!solve_(x.s, psi, x.gc, x.q, beside)) return false;
            x.psi = psi;
            std::copy(beside, beside + joints, x.q);
        }
        return beyond(x.q, j) <= RowsWithinTuning::kept;
    }

    /// Inserts the found rows into the gaps that they belong to.
    void insert(const std::vector<Between>& found) {
        PathRows rows;
        std::vector<Gap> gaps;
        const auto take = [&rows](double s, double psi, int gc, const double* q) {
            rows.s.push_back(s);
            rows.psi.push_back(psi);
            rows.gc.push_back(gc);
            rows.q.insert(rows.q.end(), q, q + joints);
        };
        std::size_t next = 0;
        for (std::size_t k = 0; k < rows_.size(); ++k) {
            take(rows_.s[k], rows_.psi[k], rows_.gc[k], joints_of(k));
            if (k == gaps_.size()) break;
            gaps.push_back(gaps_[k]);
            if (next == found.size() || found[next].gap != k) continue;
            take(found[next].s, found[next].psi, found[next].gc, found[next].q);
            gaps.push_back(gaps_[k]);
            ++next;
        }
        rows_ = std::move(rows);
        gaps_ = std::move(gaps);
    }

    const Limits& limits_;
    const Draw& draw_;
    const Solve& solve_;
    const std::vector<double> given_;  // joints of the given rows
    PathRows& rows_;
    std::vector<Gap> gaps_;
};

}  // namespace detail

/// Inserts rows where a limit is violated between rows, beyond the violation of the given rows; returns the
/// largest that remains, with excess 0 if none does. draw, solve: see RowsWithin.
template <class Draw, class Solve>
PassedLimit keep_within(const Limits& limits, const Draw& draw, const Solve& solve, PathRows& rows) {
    return detail::RowsWithin<Draw, Solve>(limits, draw, solve, rows).run();
}

}  // namespace armangle

#include "../names/end.hpp"
