#include "filter/ekf/records.h"

namespace ear {

void InnovationLog::start_frame() {
  for (SourceRecord& record : records_) record.used = record.rejected = 0;
}

void InnovationLog::add(Source source, const Innovation& innovation, TimeNs t_ns) {
  add(source, innovation, innovation.fits ? 1 : 0, innovation.fits ? 0 : 1, t_ns);
}

void InnovationLog::add(Source source, const Innovation& typical, int used, int rejected, TimeNs t_ns) {
  SourceRecord& record = records_[index_of(source)];
  record.innovation = typical.value;
  record.variance = typical.variance;
  record.gate_ratio = typical.value * typical.value / (typical.gate * typical.variance);
  record.score = typical.score;
  record.used += used;
  record.rejected += rejected;
  if (used > 0) record.last_used_ns = t_ns;
}

}  // namespace ear
