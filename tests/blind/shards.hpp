// A blind suite in parts: each part keeps one line of JSON a case, and the lines of all parts give
// the same tables as one run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/shard.hpp"
#include "tests/blind/suite.hpp"

namespace shaker::blind {

// The cases of a part: every count-th one, so that parts take about the same time.
std::vector<Case> cases_of(const std::vector<Case>& all, const Shard& shard);

// Writes a line for each scored case of a part. Throws std::runtime_error if the file cannot be
// written.
void keep(const std::vector<Scored>& part, const Shard& shard, const std::filesystem::path& file);

// The scores of `all`, in their order, from the files of the parts. Throws std::runtime_error with
// the place for a line that cannot be read, a case that is missing, there twice, or not in `all`.
std::vector<Scored> merge(const std::vector<Case>& all,
                          const std::vector<std::filesystem::path>& files);

}  // namespace shaker::blind
