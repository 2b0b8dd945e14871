#include "daemon/service/deadman_file.hpp"

#include <cstdint>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "config/json_tree.hpp"

namespace shaker::daemon {
namespace {

// FNV-1a: detects a changed text; it does not protect against a deliberate collision.
std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text)
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

}  // namespace

DeadmanFile::DeadmanFile(const std::filesystem::path& directory, const std::filesystem::path& rig)
    : file_(directory / "deadman-proof.json") {
  if (const auto text = config::read_text(rig)) rig_text_hash_ = hash_of(*text);
}

std::optional<Engine::DeadmanSeen> DeadmanFile::load() const {
  const auto text = config::read_text(file_, 4096);
  if (!text || rig_text_hash_.empty()) return std::nullopt;
  const auto kept = nlohmann::json::parse(*text, nullptr, false);
  if (!kept.is_object() || kept.value("rig_file", nlohmann::json()) != rig_text_hash_ ||
      !kept.contains("seconds") || !kept["seconds"].is_number()) {
    return std::nullopt;
  }
  return Engine::DeadmanSeen{kept["seconds"].get<double>(),
                             kept.value("how", nlohmann::json()) == "in motion"};
}

Result<void> DeadmanFile::save(const Engine::DeadmanSeen& seen, const std::string& user,
                               Nanoseconds utc) const {
  const nlohmann::ordered_json kept = {{"seconds", seen.seconds},
                                       {"how", seen.in_motion ? "in motion" : "at rest"},
                                       {"date", format_utc(utc)},
                                       {"user", user},
                                       {"rig_file", rig_text_hash_}};
  const std::filesystem::path fresh = file_.string() + ".new";
  {
    std::ofstream out(fresh, std::ios::trunc);
    out << kept.dump(2) << '\n';
    if (!out.flush()) {
      return Error{ErrorKind::io, fmt::format("{}: cannot be written; the proof of the dead-man is "
                                              "asked for again after a restart.",
                                              fresh.string())};
    }
  }
  std::error_code trouble;
  std::filesystem::rename(fresh, file_, trouble);
  if (trouble)
    return Error{ErrorKind::io, fmt::format("{}: {}", file_.string(), trouble.message())};
  return {};
}

}  // namespace shaker::daemon
