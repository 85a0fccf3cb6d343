#include "filter/ingest/imu_buffer.h"

#include <cmath>

namespace ear {

void ImuBuffer::push(const ImuSample& sample, const ImuNoiseFactors& noise) {
  if (entries_.full()) entries_.pop();
  entries_.push({sample, noise});
}

std::size_t ImuBuffer::first_after(TimeNs t_ns) const {
  std::size_t low = 0;
  std::size_t high = size();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if ((*this)[middle].t_ns > t_ns) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

ImuSample ImuBuffer::interpolate(std::size_t next, TimeNs t_ns) const {
  ImuSample result;
  if (next == 0) {
    result = (*this)[0];
  } else if (next >= size()) {
    result = newest();
  } else {
    const ImuSample& a = (*this)[next - 1];
    const ImuSample& b = (*this)[next];
    const double share = seconds_between(a.t_ns, t_ns) / seconds_between(a.t_ns, b.t_ns);
    result.gyro_B = a.gyro_B + share * (b.gyro_B - a.gyro_B);
    result.accel_B = a.accel_B + share * (b.accel_B - a.accel_B);
  }
  result.t_ns = t_ns;
  return result;
}

ImuNoiseFactors ImuBuffer::noise_around(std::size_t next, TimeNs to_ns) const {
  const ImuNoiseFactors& a = entries_[next == 0 ? 0 : std::min(next, size()) - 1].noise;
  if (next >= size()) {
    const double held = seconds_between(newest().t_ns, to_ns);
    return {std::max(a.gyro, walk_.gyro * held), std::max(a.accel, walk_.accel * held)};
  }
  const ImuNoiseFactors& b = entries_[next].noise;
  return {std::max(a.gyro, b.gyro), std::max(a.accel, b.accel)};
}

MeanRate ImuBuffer::mean_rate(TimeNs from_ns, TimeNs to_ns) const {
  MeanRate rate;
  for_each_piece(from_ns, to_ns,
                 [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt, const ImuNoiseFactors& noise) {
                   rate.gyro_B += gyro_B * dt;
                   rate.noise_factor = std::max(rate.noise_factor, noise.gyro);
                 });
  rate.gyro_B /= seconds_between(from_ns, to_ns);
  return rate;
}

ImuStatistics ImuBuffer::statistics(TimeNs from_ns, TimeNs to_ns) const {
  ImuStatistics s;
  const std::size_t begin = first_after(from_ns - 1);
  const std::size_t end = first_after(to_ns);
  if (begin >= end) return s;
  Eigen::Vector3d gyro_squares = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_squares = Eigen::Vector3d::Zero();
  double gyro_steps = 0.0, accel_steps = 0.0;
  Eigen::Vector3d gyro_first = Eigen::Vector3d::Zero(), accel_first = Eigen::Vector3d::Zero();  // of the first half
  const std::size_t middle = begin + (end - begin) / 2;
  const ImuSample& reference = (*this)[begin];  // differences to it keep the sum of squares exact
  for (std::size_t i = begin; i < end; ++i) {
    const Eigen::Vector3d gyro = (*this)[i].gyro_B - reference.gyro_B;
    const Eigen::Vector3d accel = (*this)[i].accel_B - reference.accel_B;
    s.gyro_mean += gyro;
    s.accel_mean += accel;
    if (i < middle) {
      gyro_first += gyro;
      accel_first += accel;
    }
    gyro_squares += gyro.cwiseAbs2();
    accel_squares += accel.cwiseAbs2();
    if (i == begin) continue;
    gyro_steps += ((*this)[i].gyro_B - (*this)[i - 1].gyro_B).squaredNorm();
    accel_steps += ((*this)[i].accel_B - (*this)[i - 1].accel_B).squaredNorm();
  }
  const auto n = static_cast<double>(end - begin);
  s.count = static_cast<int>(end - begin);
  s.duration = seconds_between(reference.t_ns, (*this)[end - 1].t_ns);
  s.gyro_mean /= n;
  s.accel_mean /= n;
  s.gyro_spread = std::sqrt(std::max(0.0, (gyro_squares / n - s.gyro_mean.cwiseAbs2()).maxCoeff()));
  s.accel_spread = std::sqrt(std::max(0.0, (accel_squares / n - s.accel_mean.cwiseAbs2()).maxCoeff()));
  const auto first = static_cast<double>(middle - begin);
  if (first > 0.0) {  // the first half is off by as much as the second is to the other side
    s.gyro_error = (gyro_first / first - s.gyro_mean).cwiseAbs().maxCoeff();
    s.accel_error = (accel_first / first - s.accel_mean).cwiseAbs().maxCoeff();
  }
  s.gyro_mean += reference.gyro_B;
  s.accel_mean += reference.accel_B;
  if (s.count < 2) return s;
  // The variance of a step is twice that of a sample, which is the density squared over the interval.
  const double scale = s.duration / (6.0 * (n - 1.0) * (n - 1.0));
  s.gyro_density = std::sqrt(scale * gyro_steps);
  s.accel_density = std::sqrt(scale * accel_steps);
  return s;
}

}  // namespace ear
