#include "record/findings.hpp"

#include <fmt/format.h>

namespace shaker::record {
namespace {

std::string holdings(const Recovered& found) {
  std::string text = fmt::format("{} runs, {} samples, {} cycles and {} documents", found.runs,
                                 found.samples, found.cycles, found.documents);
  if (found.documents > 0) text += fmt::format(" (up to number {})", found.last_document);
  return text;
}

std::string gaps(const Recovered& found) {
  std::string text;
  if (found.unsound_rows > 0)
    text =
        fmt::format(" {} rows that do not fit their checksums were left out.", found.unsound_rows);
  if (found.missing_documents > 0)
    text += fmt::format(" {} documents below number {} are missing.", found.missing_documents,
                        found.last_document);
  return text;
}

std::string frames(const LogReading& log) {
  return fmt::format("{} of its log's {} frames can be read ({} commits)", log.readable,
                     std::max(log.frames, log.indexed.value_or(0)), log.readable_commits);
}

// Only the index shows how far the log went: a log that was cut at a commit looks complete.
std::string beyond(const LogReading& log) {
  if (log.indexed) return "";
  return " The log's index is gone, so a missing end would not show.";
}

// States what is known of the end of the log.
std::string certainty(const Recovered& found, const LogReading& log) {
  const std::string kept = found.aside.filename().string();
  switch (log.state) {
    case LogState::whole:
      return found.whole ? ", all whole." : "; all that its log says was committed can be read.";
    case LogState::none:
      return "; no log lies beside it, so what only a log held would be missing.";
    case LogState::no_index:
      return "; all that its log holds can be read." + beyond(log);
    case LogState::doubtful:
    case LogState::damaged:
      break;
  }
  const std::string text = fmt::format(
      "; {}. The rest is a write that was under way, or the last that was "
      "acknowledged: up to {} commits may be lost. The log as it was found is {}.",
      frames(log), log.lost_commits, kept);
  return text + beyond(log);
}

}  // namespace

std::string interrupted_sentence(const Recovered& found, const LogReading& log, bool finished) {
  return fmt::format("Campaign {} {}; {} holds {}{}{}{}", found.campaign,
                     finished ? "had ended" : "was interrupted", found.file.string(),
                     holdings(found), certainty(found, log), gaps(found),
                     finished ? ""
                              : fmt::format(" `shakerctl run --resume {}` measures the rest.",
                                            found.file.string()));
}

std::string damage_sentence(const std::filesystem::path& file, const Recovered& found,
                            const LogReading& log, const Error& why, bool read) {
  std::string text = why.what;
  if (log.bytes > 0 || log.indexed) {
    text += fmt::format(" Of what was acknowledged, {}", frames(log));
    text +=
        log.lost_commits > 0 ? fmt::format("; up to {} commits are lost.", log.lost_commits) : ".";
    text += beyond(log);
  } else {
    text += " How much was acknowledged is not known.";
  }
  if (read)
    text += fmt::format(" What could be read of campaign {} is in {}: {}.{}", found.campaign,
                        found.file == found.aside ? file.string() : found.file.string(),
                        holdings(found), gaps(found));
  else
    text += " Nothing of it could be read.";
  if (found.aside.empty() || found.file == file) {
    if (!read) return text;
  }
  return text + fmt::format(" It was set aside as {}, with its log and index beside it.",
                            found.aside.filename().string());
}

std::string unbegun_sentence(const std::filesystem::path& file, const Recovered& found,
                             const LogReading& log) {
  std::string why = "its writer ended before the first commit, or its log was removed";
  if (log.indexed && *log.indexed == 0)
    why = "its writer ended before the first commit, nothing of it was acknowledged";
  else if (log.frames > 0)
    why = fmt::format(
        "its writer ended before the first commit, or its log was damaged: {}, and "
        "up to {} commits may be lost",
        frames(log), log.lost_commits);
  return fmt::format("{}: holds no campaign: {}.{} It was set aside as {}.", file.string(), why,
                     log.frames > 0 ? beyond(log) : "", found.aside.filename().string());
}

}  // namespace shaker::record
