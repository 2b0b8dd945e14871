// Reports a campaign that an earlier daemon left unfinished.
//
// Any thread. No exception of the check leaves this function, for example for lack of memory,
// because the daemon holds an exciter. The file then stays unchanged.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "protocol/documents.hpp"
#include "record/recovery.hpp"

namespace shaker::daemon {

// record::recover_one with the current time.
using RecoveryCheck =
    std::function<std::optional<record::Recovered>(const std::filesystem::path& file)>;
// Passes the alarm to the engine.
using RecoveryTell = std::function<void(const protocol::AlarmDocument&)>;

// Reports nothing for a finished file.
void report_recovery(const std::filesystem::path& file, const RecoveryCheck& check,
                     const RecoveryTell& tell) noexcept;

}  // namespace shaker::daemon
