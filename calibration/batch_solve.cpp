// The minimum of a batch, and the order in which its unknowns are eliminated.
#include <ceres/ordered_groups.h>
#include <ceres/solver.h>

#include <cmath>

#include "calibration/batch.h"

namespace ear::calibration {
namespace {

constexpr double kConverged = 1e-8;
constexpr double kRegion =
    1e14;  // nearly Gauss-Newton: damping would hold the scale, which is shown weakly, where it is

class ProgressCallback final : public ceres::IterationCallback {
 public:
  explicit ProgressCallback(const Batch::Progress& progress) : progress_(progress) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (progress_) progress_(summary.iteration, summary.cost);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const Batch::Progress& progress_;
};

}  // namespace

bool Batch::solve(int iterations, int threads, const Progress& progress) {
  ceres::Solver::Options options;
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  bool points = false;
  for (double* block : elimination_order()) order->AddElementToGroup(block, 1);
  for (Segment& segment : segments_) {
    for (Point& point : segment.points) {
      if (point.used) order->AddElementToGroup(point.block.data(), 0);
      points = points || point.used;
    }
  }
  options.linear_solver_type = points ? ceres::SPARSE_SCHUR : ceres::SPARSE_NORMAL_CHOLESKY;
  if (points) options.linear_solver_ordering = order;
  options.max_num_iterations = iterations;
  options.function_tolerance = kConverged;
  options.initial_trust_region_radius = kRegion;
  options.max_trust_region_radius = 1e6 * kRegion;
  options.num_threads = threads;
  options.logging_type = ceres::SILENT;
  ProgressCallback callback(progress);
  options.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem_.get(), &summary);
  return summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
}

std::vector<double*> Batch::elimination_order() {
  std::vector<double*> order;
  for (Segment& segment : segments_) {
    for (Point& point : segment.points) {
      if (point.used) order.push_back(point.block.data());
    }
  }
  for (Segment& segment : segments_) {
    for (Keyframe& keyframe : segment.keyframes) {
      order.push_back(keyframe.pose.data());
      order.push_back(keyframe.motion.data());
      if (given_.encoder) order.push_back(keyframe.ground.data());
    }
    if (!segment.drive->reference.empty()) order.push_back(segment.reference.data());
  }
  for (const CalibrationBlock& block : blocks_) order.push_back(block.data);
  return order;
}

}  // namespace ear::calibration
