// What the listing of a node in docs/guides/ros_cpp.md uses of rclcpp: names only, for tests without ROS.
#pragma once

#include <cstdio>
#include <memory>
#include <string>

namespace rclcpp {

struct Logger {};
struct Clock {};

class Node {
public:
    explicit Node(const std::string& name) : name_(name) {}
    Logger get_logger() const { return {}; }
    std::shared_ptr<Clock> get_clock() const { return std::make_shared<Clock>(); }

private:
    std::string name_;
};

}  // namespace rclcpp

#define RCLCPP_WARN_THROTTLE(logger, clock, period, ...) \
    (static_cast<void>(logger), static_cast<void>(clock), static_cast<void>(period), std::printf(__VA_ARGS__))
