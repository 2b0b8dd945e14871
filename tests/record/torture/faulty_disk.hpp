// SQLite's view of a disk that fails, and one that remembers every write and flush.
//
// A VFS in front of the usual one. Calls that fail on a real disk are counted; from the n-th on
// they fail, once or for good. What was written can be played back up to any moment of a power cut.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace shaker::record::torture {

struct Operation {
  enum class Kind { write, truncate, sync, remove } kind = Kind::write;
  std::string part;  // "", "-wal": what follows ".db"
  std::int64_t offset = 0;
  std::string bytes;
};

class FaultyDisk {
 public:
  static FaultyDisk& install();  // once; it is SQLite's default from then on

  // The n-th call from now on (1: the next) fails with `code`; 0: none.
  void fail_at(std::int64_t n, bool for_good, int code);
  std::int64_t calls() const { return calls_; }  // since fail_at
  bool reached() const { return at_ > 0 && calls_ >= at_; }

  void remember(bool on);  // on: forgets what it remembered before; off: keeps it
  std::size_t moment() const { return operations_.size(); }
  // The files after a power cut at that moment: what had not been flushed is there, gone, or torn
  // at sectors of 512 bytes. The index of the log, which nobody flushes, is gone or an older one.
  std::map<std::string, std::string> after_power_cut(std::size_t moment,
                                                     std::mt19937_64& random) const;

  // --- of the VFS
  bool fails();  // counts
  int code() const { return code_; }
  void note(Operation operation);
  void index_mapped(const volatile void* region) { index_ = region; }

 private:
  std::int64_t calls_ = 0, at_ = 0;
  bool for_good_ = false, remembering_ = false;
  int code_ = 0;
  std::vector<Operation> operations_;
  const volatile void* index_ = nullptr;
  std::vector<std::pair<std::size_t, std::string>> indexes_;  // with the moment
};

}  // namespace shaker::record::torture
