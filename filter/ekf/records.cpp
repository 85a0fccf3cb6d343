#include "filter/ekf/records.h"

namespace ear {

void InnovationLog::start_frame() {
  for (SourceRecord& record : records_) record.used = record.rejected = 0;
}

void InnovationLog::add(Source source, const Innovation& innovation, TimeNs t_ns) {
  SourceRecord& record = records_[index_of(source)];
  record.innovation = innovation.value;
  record.variance = innovation.variance;
  record.gate_ratio = innovation.value * innovation.value / (innovation.gate * innovation.variance);
  record.score = innovation.score;
  ++(innovation.fits ? record.used : record.rejected);
  if (innovation.fits) record.last_used_ns = t_ns;
}

void InnovationLog::add(Source source, const Features& features, TimeNs t_ns) {
  SourceRecord& record = records_[index_of(source)];
  record.innovation = features.rms_px;
  record.variance = features.variance_px2;
  record.gate_ratio = features.rms_px * features.rms_px / (features.gate * features.variance_px2);
  record.score = features.score;
  record.used += features.used;
  record.rejected += features.rejected;
  if (features.used > 0) record.last_used_ns = t_ns;
}

}  // namespace ear
