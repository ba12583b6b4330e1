// A scene prepared for one arm: the arrays to which the core's view points.
#pragma once

#include <vector>

#include "buffers.hpp"

namespace binding {

struct SceneHandle {
    std::vector<armangle::BallBlock> blocks;
    std::vector<armangle::BallGroup> groups, clusters;
    std::vector<std::uint16_t> ball_id, solid_id;
    std::vector<armangle::Solid> solids, held;
    std::vector<armangle::Vec3<double>> corners;
    std::vector<float> distances;
    std::vector<armangle::Field> fields;
    std::vector<armangle::Part> parts;
    std::vector<armangle::SwingingPart> swings;
    std::vector<armangle::OwnPair> own;
    std::vector<std::uint8_t> ignored;
    std::vector<double> apart;
    armangle::Scene view;

    SceneHandle() = default;
    SceneHandle(const SceneHandle&) = delete;  // the view points into the vectors
    SceneHandle& operator=(const SceneHandle&) = delete;
};

/// A pair as a number for Python: obstacle * 256 + link; -1: none.
inline long long pair_number(armangle::Tag pair) noexcept {
    return pair ? 256LL * armangle::tag_obstacle(pair) + armangle::tag_link(pair) : -1;
}

}  // namespace binding
