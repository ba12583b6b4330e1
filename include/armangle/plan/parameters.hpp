// Which parameters of a path become sections of its tubes, and which of those become knots of its curve.
#pragma once

#include <algorithm>
#include <vector>

#include "tube.hpp"

namespace armangle {

namespace parameter_rule {
inline constexpr int least_steps = 32;      // of s, between sections that are there in any case
inline constexpr double turn = 0.5;         // of a segment between two of them (rad)
inline constexpr double knot_share = 0.24;  // of a step: knots lie no closer
inline constexpr double same = 1e-12;       // parameters closer than this are one
}  // namespace parameter_rule

/// Rising parameters: the rows asked, the joints of segments, and even steps between them: enough, and enough a turn.
inline std::vector<double> base_parameters(const Segment* segments, std::size_t n, const double* rows, std::size_t row_count) {
    std::vector<double> all(rows, rows + row_count), given, out;
    for (std::size_t i = 0; i < n; ++i) all.push_back(segments[i].start), all.push_back(segments[i].end);
    std::sort(all.begin(), all.end());
    for (const double s : all)
        if (given.empty() || s - given.back() > parameter_rule::same) given.push_back(s);
    given.back() = 1.0;
    for (std::size_t i = 0; i + 1 < given.size(); ++i) {
        const double gap = given[i + 1] - given[i];
        const Segment& g = segments[segment_index(segments, n, given[i] + 0.5 * gap)];
        const double turn = max(abs(g.alpha), abs(g.beta)) * gap / (g.end - g.start);
        const int steps = std::max(
            1, static_cast<int>(std::ceil(max(gap * parameter_rule::least_steps, turn / parameter_rule::turn) - parameter_rule::same)));
        for (int k = 0; k < steps; ++k) out.push_back(given[i] + gap * k / steps);
    }
    out.push_back(1.0);
    return out;
}

/// The sections that become knots of the curve: all of `base`, and of those between only such as lie no closer than a share
/// of their step. Knots much closer than that would carry the noise of a search into the curvature.
inline std::vector<std::size_t> knots(const Tube& t, const std::vector<double>& base, std::size_t count) {
    std::vector<std::size_t> out{0};
    for (std::size_t k = 1, b = 1; k + 1 < count; ++k) {
        const double s = t.layers[k].s;
        while (b + 1 < base.size() && base[b] < s) ++b;
        const double room = parameter_rule::knot_share * (base[b] - base[b - 1]);
        if (s == base[b] || (s - t.layers[out.back()].s >= room && base[b] - s >= room)) out.push_back(k);
    }
    if (count > 1) out.push_back(count - 1);
    return out;
}

}  // namespace armangle
