#include "tools/view_truth.h"

#include <algorithm>

#include "tools/evaluation/alignment.h"
#include "tools/evaluation/read.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;

bool has_truth(const fs::path& recording) {
  const fs::path file = "state_groundtruth_estimate0/data.csv";
  return fs::is_regular_file(recording / "mav0" / file) || fs::is_regular_file(recording / file);
}

}  // namespace

ViewTruth::ViewTruth(const fs::path& recording) {
  if (has_truth(recording)) poses_ = evaluation::read_truth(recording);
}

std::optional<evaluation::Pose> ViewTruth::pose_at(TimeNs t_ns) const {
  constexpr double kLongestGap = 0.25;  // [s] over which it is interpolated
  const auto next = std::lower_bound(poses_.begin(), poses_.end(), t_ns,
                                     [](const evaluation::Pose& pose, TimeNs t) { return pose.t_ns < t; });
  if (next == poses_.end()) return std::nullopt;
  if (next->t_ns == t_ns) return *next;
  if (next == poses_.begin()) return std::nullopt;
  const auto before = std::prev(next);
  const double gap = seconds_between(before->t_ns, next->t_ns);
  if (gap > kLongestGap) return std::nullopt;
  const double share = seconds_between(before->t_ns, t_ns) / gap;
  return evaluation::Pose{t_ns, before->q_WB.slerp(share, next->q_WB),
                          before->p_WB + share * (next->p_WB - before->p_WB)};
}

std::optional<Eigen::Vector3d> ViewTruth::at(const NavState& state) {
  const std::optional<evaluation::Pose> truth = pose_at(state.t_ns);
  if (!truth) return std::nullopt;
  if (!T_ET_) {
    const evaluation::Pose estimate{state.t_ns, state.q_WB, state.p_WB};
    T_ET_ = evaluation::align_pose(evaluation::AlignmentKind::yaw, estimate, *truth).inverse();
  }
  return *T_ET_ * truth->p_WB;
}

}  // namespace ear::tools
