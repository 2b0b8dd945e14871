// Records the polls of a Modbus sensor in the format of protocol/modbus/register_log.hpp, so
// that they can be replayed later. Recording never stops the measurement: if the disk refuses a
// write, recording ends and `trouble` gives the reason.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "drivers/modbus/register_set.hpp"

namespace shaker::drivers::modbus {

class PollRecorder {
 public:
  // An empty `file` records nothing. Otherwise appends to it, relative to `directory`.
  static Result<PollRecorder> open(const std::filesystem::path& file,
                                   const std::filesystem::path& directory);

  void connected(Nanoseconds t);
  void poll(Nanoseconds asked, Nanoseconds received, const RegisterSet& registers);
  void failed(Nanoseconds asked, Nanoseconds received);
  const std::string& trouble() const { return trouble_; }  // empty: no error

 private:
  using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
  PollRecorder(std::string name, File file) : name_(std::move(name)), file_(std::move(file)) {}
  void write(Nanoseconds asked, Nanoseconds received, const char* word,
             const RegisterSet* registers);

  std::string name_;
  File file_;
  std::string line_, trouble_;
};

}  // namespace shaker::drivers::modbus
