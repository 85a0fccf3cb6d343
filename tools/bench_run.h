// What the pipeline costs for each stereo frame of a recording, beside the floor measured on the same images in the
// same run (tools/floor.h). One thread. Floor, pipeline, read and samples are processor time; the stages within the
// pipeline are wall time, so that they mean something on a machine that is otherwise idle.
#pragma once

#include <cstddef>
#include <string>

#include "ear/config.h"
#include "src/recording/recording.h"
#include "tools/bench_figures.h"

namespace ear::tools {

constexpr std::size_t kWarmUp = 5;  ///< frames in which memory is allocated and caches fill

/// Runs `recording`, called `name`; the first `left_out` frames do not count. Throws std::runtime_error where it has no
/// stereo pair.
[[nodiscard]] BenchFigures run_bench(const Config& config, Recording& recording, const std::string& name,
                                     std::size_t left_out = kWarmUp);

}  // namespace ear::tools
