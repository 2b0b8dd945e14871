// Any content of a campaign's files. The first byte gives the kind of the rest: 's' a block of
// samples, 'l' a write-ahead log, 'd' a database, which is also recovered.
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <unistd.h>

#include "record/accepted_cycles.hpp"
#include "record/database.hpp"
#include "record/recovery.hpp"
#include "record/write_ahead_log.hpp"
#include "tests/fuzz/target.hpp"

namespace record = shaker::record;
namespace fs = std::filesystem;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

struct Folder {
  Folder() {
    std::error_code ignored;
    const fs::path memory = "/dev/shm";
    std::string name = ((fs::is_directory(memory, ignored) ? memory : fs::temp_directory_path()) /
                        "fuzz_record.XXXXXX")
                           .string();
    require(::mkdtemp(name.data()) != nullptr);
    path = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  void empty() const {
    for (const auto& entry : fs::directory_iterator(path))
      fs::remove_all(entry.path());
  }
  fs::path path;
};

void write(const fs::path& file, std::span<const std::uint8_t> bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

// Samples that can be read are written back unchanged.
void try_samples(std::span<const std::uint8_t> bytes) {
  std::vector<record::SampleRow> rows;
  if (!record::unpack(std::as_bytes(bytes), rows)) return;
  std::string packed;
  record::pack(rows, packed);
  require(packed.size() == bytes.size() &&
          (bytes.empty() || std::memcmp(packed.data(), bytes.data(), bytes.size()) == 0));
}

void try_log(const Folder& folder, std::span<const std::uint8_t> bytes) {
  folder.empty();
  write(folder.path / "c.db-wal", bytes);
  const record::LogReading log = record::read_log(folder.path / "c.db");
  require(log.bytes == static_cast<std::int64_t>(bytes.size()));
  require(0 <= log.readable && log.readable <= log.sound && log.sound <= log.frames);
  require(log.readable_commits <= log.readable && log.lost_commits >= 0);
  require(log.header_fits || log.sound == 0);
  require((log.state != record::LogState::whole && log.state != record::LogState::no_index) ||
          log.frames == log.readable);
  require(log.state != record::LogState::damaged || log.lost_commits > 0);
}

// Unless the campaign could be read, every byte is still present under some name.
void try_database(const Folder& folder, std::span<const std::uint8_t> bytes) {
  folder.empty();
  const fs::path file = folder.path / "c.db";
  write(file, bytes);
  if (const auto reader = record::CampaignReader::open(file)) {
    (void)reader->campaign();
    (void)reader->runs();
    (void)reader->documents();
    (void)reader->last_samples(0, 1.0);
    (void)record::accepted_cycles(*reader);
  }
  const auto found = record::recover(folder.path, "2026-03-01T12:01:00.000Z");
  require(found.size() <= 1 && (found.empty() || !found[0].what.empty()));
  if (found.size() == 1 && found[0].damaged)
    require(fs::file_size(found[0].aside) == bytes.size());
  else if (!bytes.empty())
    require(fs::exists(found.empty() ? file : found[0].file));
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const Folder folder;
  const std::span rest(data + 1, size - 1);
  if (data[0] == 's') try_samples(rest);
  if (data[0] == 'l') try_log(folder, rest);
  if (data[0] == 'd') try_database(folder, rest);
  return 0;
}
