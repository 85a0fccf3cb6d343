#include "calibration/residuals.h"

#include <array>

namespace ear::calibration {

std::vector<Residual> residuals_of(const Batch& batch) {
  std::vector<Residual> residuals;
  std::array<double, 16> whitened{};
  for (const TermBlock& term : batch.terms()) {
    const bool wanted =
        term.kind == Term::pixel || term.kind == Term::roll || term.kind == Term::beam || term.kind == Term::reference;
    if (!wanted) continue;
    batch.problem().EvaluateResidualBlock(term.id, false, nullptr, whitened.data(), nullptr);
    Residual residual;
    residual.kind = term.kind;
    residual.drive = term.segment;
    residual.sensor = term.beam;
    residual.t = seconds_between(batch.segments()[term.segment].keyframes.front().t_ns, term.t_ns);
    residual.at = term.at;
    residual.value = {whitened[0], term.kind == Term::beam ? 0.0 : whitened[1]};
    if (term.kind == Term::pixel) residual.value *= batch.noise().pixel * batch.noise().lasting;
    residuals.push_back(residual);
  }
  return residuals;
}

}  // namespace ear::calibration
