// Tables and figures as one HTML page that needs nothing else: no network, no other file.
#pragma once

#include <string>
#include <vector>

#include "tools/paper/tables.h"

namespace ear::paper {

/// The page: all tables, then for each sequence measured its path, height, error and NEES, as in the paper's figures 6
/// to 11. `setups` are those that `results` knows.
[[nodiscard]] std::string to_html(const std::vector<Table>& tables, const Origin& origin,
                                  const std::vector<Setup>& setups, const Lookup& results);

}  // namespace ear::paper
