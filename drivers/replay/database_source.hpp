// A recorded campaign as a source: the raw samples of all its runs, one after the other.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.hpp"
#include "drivers/replay/source.hpp"

namespace shaker::drivers::replay {

// Reads all samples into memory (24 bytes each). An Error states whether the file is missing,
// damaged or empty.
Result<std::unique_ptr<Source>> open_campaign(const std::filesystem::path& file);

}  // namespace shaker::drivers::replay
