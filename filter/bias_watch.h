// Did the bias of the gyroscope or of the accelerometer jump? Sound biases walk slowly, and each update corrects them
// about as much as it lowers their variance. Corrections that add up to more than these variances allow tell of a bias
// that is elsewhere. docs/filter.md, section 15.
#pragma once

#include <Eigen/Core>

namespace ear {

class BiasWatch {
 public:
  using Vector6 = Eigen::Matrix<double, 6, 1>;  ///< gyroscope [rad/s], accelerometer [m/s^2]

  /// One update: what it added to the biases, and by how much it lowered their variances. Those by images are believed
  /// sooner: wheels that leave the ground unnoticed mislead.
  void add(const Vector6& correction, const Vector6& variance_lowered, bool by_image);

  struct Verdict {
    bool gyro = false;
    bool accel = false;
  };
  /// After all updates of the last `dt` seconds: who jumped? What speaks for it is forgotten when it was said.
  Verdict judge(double dt);

  void clear();

 private:
  struct Sum {
    Vector6 correction = Vector6::Zero();
    Vector6 variance = Vector6::Zero();
  };
  Sum all_, images_;
};

}  // namespace ear
