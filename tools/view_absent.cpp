// Without cpp-httplib there is no view; only its options say so.
#include "src/recording/input_error.h"
#include "tools/run_view.h"

namespace ear::tools {

class RunView::Impl {};

RunView::RunView(const RunViewArguments&, const std::filesystem::path&, const Recording&) {
  throw InputError("--view: this program was built without libcpp-httplib-dev");
}
RunView::~RunView() = default;
MakeEstimator RunView::tapped(MakeEstimator make) const { return make; }
void RunView::before_sample(const Sample&) {}
void RunView::after_frame(const ReplayedFrame&, const Odometry&) {}
std::string RunView::finish() { return ""; }

}  // namespace ear::tools
