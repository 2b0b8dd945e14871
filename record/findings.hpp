// The sentences for what recovery found: what was acknowledged, what is there, what is lost, as far
// as that can be known. Private to record/.
#pragma once

#include "record/recovery.hpp"
#include "record/write_ahead_log.hpp"

namespace shaker::record {

// Of a campaign that could be opened in its place; `finished`: only its log is in doubt.
std::string interrupted_sentence(const Recovered& found, const LogReading& log, bool finished);
// Of one that was set aside; `read`: something of it could be read.
std::string damage_sentence(const std::filesystem::path& file, const Recovered& found,
                            const LogReading& log, const Error& why, bool read);
// Of one without a table.
std::string unbegun_sentence(const std::filesystem::path& file, const Recovered& found,
                             const LogReading& log);

}  // namespace shaker::record
