// Messages about the result of a recovery: what was acknowledged, what is there, and what is
// lost, as far as this can be known. Private to record/.
#pragma once

#include "record/recovery.hpp"
#include "record/write_ahead_log.hpp"

namespace shaker::record {

// For a campaign that could be opened in its place; `finished`: only its log is in doubt.
std::string interrupted_sentence(const Recovered& found, const LogReading& log, bool finished);
// For a campaign that was set aside; `read`: a part of it could be read.
std::string damage_sentence(const std::filesystem::path& file, const Recovered& found,
                            const LogReading& log, const Error& why, bool read);
// For a file without a table.
std::string unbegun_sentence(const std::filesystem::path& file, const Recovered& found,
                             const LogReading& log);

}  // namespace shaker::record
