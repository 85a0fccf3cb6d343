// Without cpp-httplib there is no view; only its options say so.
#include "src/recording/input_error.h"
#include "tools/live_view.h"
#include "tools/run_view.h"

namespace ear::tools {
namespace {

[[noreturn]] void refuse() { throw InputError("--view: this program was built without libcpp-httplib-dev"); }

}  // namespace

class RunView::Impl {};

RunView::RunView(const RunViewArguments&, const std::filesystem::path&, const Recording&) { refuse(); }
RunView::~RunView() = default;
MakeEstimator RunView::tapped(MakeEstimator make) const { return make; }
void RunView::before_sample(const Sample&) {}
void RunView::after_frame(const ReplayedFrame&, const Odometry&) {}
std::string RunView::finish() { return ""; }

class LiveView::Impl {};

LiveView::LiveView(const ViewArguments&, const std::string&, const Calibration&) { refuse(); }
LiveView::~LiveView() = default;
live::Onlooker LiveView::onlooker() { return {}; }
std::string LiveView::finish() { return ""; }

}  // namespace ear::tools
