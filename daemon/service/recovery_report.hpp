// What is said of a campaign that an earlier daemon left unfinished.
//
// Any thread. Nothing that checking a file throws, want of memory for one, gets out of here: the
// daemon holds an exciter, and the file is left as it was.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "protocol/documents.hpp"
#include "record/recovery.hpp"

namespace shaker::daemon {

// record::recover_one with its time.
using RecoveryCheck =
    std::function<std::optional<record::Recovered>(const std::filesystem::path& file)>;
// Hands the alarm on to the engine.
using RecoveryTell = std::function<void(const protocol::AlarmDocument&)>;

// Says nothing of a file that is finished.
void report_recovery(const std::filesystem::path& file, const RecoveryCheck& check,
                     const RecoveryTell& tell) noexcept;

}  // namespace shaker::daemon
