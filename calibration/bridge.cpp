#include "calibration/bridge.h"

#include <cmath>

#include "calibration/inertial_path.h"

namespace ear::calibration {
namespace {

constexpr double kNotBelieved = 1.0;  // [s] before a gap

/// A world's place in another: a turn about the vertical, and a shift.
struct Move {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
};

NavState moved(const Move& move, NavState state) {
  state.q_WB = Eigen::Quaterniond(move.R * state.q_WB.toRotationMatrix());
  state.p_WB = move.R * state.p_WB + move.p;
  state.v_W = move.R * state.v_W;
  return state;
}

/// Where the inertial samples lead, at a node of the path from a state.
NavState state_at(const NavState& from, const PathNode& node) {
  const Eigen::Matrix3d R_Wk = from.q_WB.toRotationMatrix();
  NavState state = from;
  state.t_ns = node.t_ns;
  state.q_WB = Eigen::Quaterniond(R_Wk * node.R_kt);
  state.p_WB = from.p_WB + R_Wk * node.p_kt;
  state.v_W = R_Wk * node.v_kt;
  return state;
}

double yaw_of(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1)); }

/// From the last state of `bridged` to `next`, which comes in the world of its piece. Returns where that world is.
Move bridge(std::vector<GuessedState>& bridged, const NavState& next, const std::vector<InertialPiece>& pieces,
            double interval) {
  const NavState from = bridged.back().state;
  const std::vector<PathNode> path = path_along(pieces, from);
  const NavState reached = state_at(from, path.back());
  const Eigen::Matrix3d turn = reached.q_WB.toRotationMatrix() * next.q_WB.toRotationMatrix().transpose();
  Move move;
  move.R = Eigen::AngleAxisd(yaw_of(turn), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const double length = seconds_between(from.t_ns, next.t_ns);
  const Eigen::Vector3d too_fast = reached.v_W - move.R * next.v_W;
  Eigen::Vector3d too_far = 0.5 * length * too_fast;
  const double too_high = reached.p_WB.z() - too_far.z() - from.p_WB.z();
  too_far.z() += too_high;
  move.p = reached.p_WB - too_far - move.R * next.p_WB;

  for (const PathNode& node : path) {
    const double t = seconds_between(from.t_ns, node.t_ns);
    const double since = seconds_between(bridged.back().state.t_ns, node.t_ns);
    if (since < interval || length - t < 0.5 * interval) continue;
    NavState state = state_at(from, node);
    const double share = t / length;
    state.v_W -= share * too_fast;
    state.v_W.z() -= too_high / length;
    state.p_WB -= 0.5 * t * share * too_fast;
    state.p_WB.z() -= share * too_high;
    bridged.push_back({state, node.t_ns, {}});
  }
  return move;
}

}  // namespace

std::vector<GuessedState> bridge_gaps(const std::vector<GuessedState>& states, const std::vector<ImuSample>& imu,
                                      double interval, double gap, double longest) {
  std::vector<GuessedState> bridged;
  Move move;
  for (const GuessedState& state : states) {
    const TimeNs t_ns = state.state.t_ns;
    if (!bridged.empty() && seconds_between(bridged.back().state.t_ns, t_ns) > gap) {
      const TimeNs lost_ns = bridged.back().state.t_ns;
      while (bridged.size() > 1 && seconds_between(bridged.back().state.t_ns, lost_ns) < kNotBelieved) {
        bridged.pop_back();
      }
      const auto pieces = pieces_between(imu, bridged.back().state.t_ns, t_ns);
      const bool spanned = !pieces.empty() && seconds_between(lost_ns, t_ns) < longest;
      move = spanned ? bridge(bridged, state.state, pieces, interval) : Move{};
    }
    bridged.push_back({moved(move, state.state), state.stamp_ns, state.features});
  }
  return bridged;
}

}  // namespace ear::calibration
