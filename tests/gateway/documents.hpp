// Lines of a stream, for the tests of this folder.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

namespace shaker::gateway::testing {

inline std::string line(const std::string& type, std::uint64_t seq,
                        nlohmann::json more = nlohmann::json::object()) {
  more["type"] = type;
  more["seq"] = seq;
  return more.dump();
}
inline std::string state(std::uint64_t seq, const std::string& name) {
  return line("state", seq,
              {{"state", name}, {"controlled", true}, {"progress", 0.25}, {"unprotected", true}});
}
inline std::string alarm(std::uint64_t seq, const std::string& severity, const std::string& code) {
  return line("alarm", seq, {{"severity", severity}, {"code", code}, {"text", "A sentence."}});
}

}  // namespace shaker::gateway::testing
