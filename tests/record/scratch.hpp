// A temporary directory for one test, and a campaign to write into it.
#pragma once

#include <filesystem>
#include <stdlib.h>
#include <string>

#include "record/campaign_database.hpp"

namespace shaker::record::testing {

class Scratch {
 public:
  // In memory if possible, where a flush takes no time, for tests with thousands of flushes.
  struct InMemory {};
  static constexpr InMemory in_memory{};

  Scratch() : Scratch(std::filesystem::temp_directory_path()) {}
  explicit Scratch(InMemory)
      : Scratch(std::filesystem::is_directory("/dev/shm")
                    ? "/dev/shm"
                    : std::filesystem::temp_directory_path()) {}
  explicit Scratch(const std::filesystem::path& where) {
    std::string pattern = (where / "record.XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline CampaignRow example_campaign() {
  return {"first light",
          "2026-03-01T12:00:00.123Z",
          "rig A",
          R"({"runs": []})",
          R"({"name": "oleo"})",
          "",
          "",
          {{protocol::Channel::aux2, {"oil_temperature", "degC"}}}};
}

// A sample that differs from the others in every field and has no round numbers.
inline SampleRow example_sample(int i) {
  return {1'000'000'000LL * i + 17, 0.001 * i + 1.0 / 3.0,
          static_cast<protocol::Channel>(i % protocol::kChannelCount),
          static_cast<std::uint8_t>(i % 3)};
}

}  // namespace shaker::record::testing
