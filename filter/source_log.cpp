#include "filter/source_log.h"

namespace ear {

void SourceLog::start_frame() {
  for (SourceRecord& record : records_) record.used = record.rejected = 0;
}

void SourceLog::add(Source source, double innovation, double variance, double gate, TimeNs t_ns) {
  SourceRecord& record = records_[index_of(source)];
  record.innovation = innovation;
  record.variance = variance;
  record.gate_ratio = innovation * innovation / (gate * variance);
  count(source, record.gate_ratio <= 1.0, t_ns);
}

void SourceLog::add(Source source, const Features& features, double gate, TimeNs t_ns) {
  SourceRecord& record = records_[index_of(source)];
  record.innovation = features.rms_px;
  record.variance = features.variance_px2;
  record.gate_ratio = features.rms_px * features.rms_px / (gate * features.variance_px2);
  record.used += features.used;
  record.rejected += features.rejected;
  if (features.used > 0) record.last_used_ns = t_ns;
}

void SourceLog::count(Source source, bool fits, TimeNs t_ns) {
  SourceRecord& record = records_[index_of(source)];
  ++(fits ? record.used : record.rejected);
  if (fits) record.last_used_ns = t_ns;
}

}  // namespace ear
