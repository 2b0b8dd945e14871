// A disk for SQLite that can fail, and that remembers every write and flush.
//
// It is a VFS in front of the usual one. It counts the calls that can fail on a real disk; from
// the n-th call on they fail, once or permanently. The files after a power cut at any moment
// can be reconstructed.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace shaker::record::torture {

struct Operation {
  enum class Kind { write, truncate, sync, remove } kind = Kind::write;
  std::string part;  // "", "-wal": the suffix after ".db"
  std::int64_t offset = 0;
  std::string bytes;
};

class FaultyDisk {
 public:
  static FaultyDisk& install();  // once; afterwards it is SQLite's default

  // The n-th call from now on (1: the next one) fails with `code`; 0 stops the failures.
  void fail_at(std::int64_t n, bool for_good, int code);
  std::int64_t calls() const { return calls_; }  // since fail_at
  bool reached() const { return at_ > 0 && calls_ >= at_; }

  void remember(bool on);  // true: discards old operations; false: keeps them
  std::size_t moment() const { return operations_.size(); }
  // The files after a power cut at `moment`. Unflushed data are present, lost, or torn at
  // sectors of 512 bytes. The index of the log is never flushed: it is lost or an older one.
  std::map<std::string, std::string> after_power_cut(std::size_t moment,
                                                     std::mt19937_64& random) const;

  // --- for the VFS
  bool fails();  // counts the call
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
