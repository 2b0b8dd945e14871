#include "tests/record/torture/faulty_disk.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include <sqlite3.h>

namespace shaker::record::torture {
namespace {

constexpr std::size_t kSector = 512, kIndex = 32768;
constexpr const char* kDirectory = "/";

FaultyDisk disk;
sqlite3_vfs* usual = nullptr;
sqlite3_vfs faulty;

struct OpenFile {
  sqlite3_file base;  // the part that SQLite sees
  bool named;         // the directory was flushed after it was opened
  char part[16];      // "", "-wal"
  sqlite3_file real;  // of usual->szOsFile bytes
};

OpenFile* opened(sqlite3_file* file) {
  return reinterpret_cast<OpenFile*>(file);
}
sqlite3_file* real(sqlite3_file* file) {
  return &opened(file)->real;
}

const char* part_of_name(const char* name) {
  const char* at = name == nullptr ? nullptr : std::strstr(name, ".db");
  return at == nullptr ? "?" : at + 3;
}

int close(sqlite3_file* file) {
  return real(file)->pMethods->xClose(real(file));
}
int read(sqlite3_file* file, void* bytes, int count, sqlite3_int64 offset) {
  if (disk.fails()) return SQLITE_IOERR_READ;
  return real(file)->pMethods->xRead(real(file), bytes, count, offset);
}
int write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 offset) {
  if (disk.fails()) return disk.code();
  const int outcome = real(file)->pMethods->xWrite(real(file), bytes, count, offset);
  if (outcome == SQLITE_OK)
    disk.note({Operation::Kind::write,
               opened(file)->part,
               offset,
               {static_cast<const char*>(bytes), static_cast<std::size_t>(count)}});
  return outcome;
}
int truncate(sqlite3_file* file, sqlite3_int64 size) {
  if (disk.fails()) return SQLITE_IOERR_TRUNCATE;
  disk.note({Operation::Kind::truncate, opened(file)->part, size, {}});
  return real(file)->pMethods->xTruncate(real(file), size);
}
// Only recorded, not executed: the playback applies it.
int sync(sqlite3_file* file, int) {
  if (disk.fails()) return SQLITE_IOERR_FSYNC;
  disk.note({Operation::Kind::sync, opened(file)->part, 0, {}});
  // As SQLite does: the first flush of a journal or log also flushes the directory.
  if (!opened(file)->named && opened(file)->part[0] == '-')
    disk.note({Operation::Kind::sync, kDirectory, 0, {}});
  opened(file)->named = true;
  return SQLITE_OK;
}
int file_size(sqlite3_file* file, sqlite3_int64* size) {
  if (disk.fails()) return SQLITE_IOERR_FSTAT;
  return real(file)->pMethods->xFileSize(real(file), size);
}
int lock(sqlite3_file* file, int level) {
  return real(file)->pMethods->xLock(real(file), level);
}
int unlock(sqlite3_file* file, int level) {
  return real(file)->pMethods->xUnlock(real(file), level);
}
int check_lock(sqlite3_file* file, int* held) {
  return real(file)->pMethods->xCheckReservedLock(real(file), held);
}
int control(sqlite3_file* file, int what, void* argument) {
  return real(file)->pMethods->xFileControl(real(file), what, argument);
}
int sector_size(sqlite3_file* file) {
  return real(file)->pMethods->xSectorSize(real(file));
}
int traits(sqlite3_file* file) {
  return real(file)->pMethods->xDeviceCharacteristics(real(file));
}
int index_map(sqlite3_file* file, int region, int size, int extend, void volatile** where) {
  if (disk.fails()) return SQLITE_IOERR_SHMMAP;
  const int outcome = real(file)->pMethods->xShmMap(real(file), region, size, extend, where);
  if (region == 0 && outcome == SQLITE_OK) disk.index_mapped(*where);
  return outcome;
}
int index_lock(sqlite3_file* file, int offset, int count, int flags) {
  return real(file)->pMethods->xShmLock(real(file), offset, count, flags);
}
void index_barrier(sqlite3_file* file) {
  real(file)->pMethods->xShmBarrier(real(file));
}
int index_unmap(sqlite3_file* file, int remove) {
  disk.index_mapped(nullptr);
  return real(file)->pMethods->xShmUnmap(real(file), remove);
}

const sqlite3_io_methods kMethods = {
    2,          close,         read,        write,   truncate,    sync,   file_size,
    lock,       unlock,        check_lock,  control, sector_size, traits, index_map,
    index_lock, index_barrier, index_unmap, nullptr, nullptr};

int open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  file->pMethods = nullptr;
  if (disk.fails()) return SQLITE_CANTOPEN;
  real(file)->pMethods = nullptr;
  const int outcome = usual->xOpen(usual, name, real(file), flags, out_flags);
  if (outcome != SQLITE_OK) {
    if (real(file)->pMethods != nullptr) real(file)->pMethods->xClose(real(file));
    return outcome;
  }
  const char* part = part_of_name(name);
  opened(file)->named = false;
  std::snprintf(opened(file)->part, sizeof opened(file)->part, "%s", part);
  file->pMethods = &kMethods;
  return SQLITE_OK;
}

int remove(sqlite3_vfs*, const char* name, int sync_directory) {
  if (disk.fails()) return SQLITE_IOERR_DELETE;
  disk.note({Operation::Kind::remove, part_of_name(name), sync_directory, {}});
  return usual->xDelete(usual, name, sync_directory);
}

void put(std::string& file, std::int64_t offset, const char* bytes, std::size_t count) {
  const auto at = static_cast<std::size_t>(offset);
  if (file.size() < at + count) file.resize(at + count, '\0');
  std::memcpy(file.data() + at, bytes, count);
}

// Each touched sector of the file is either written or not.
void put_torn(std::string& file, const Operation& operation, std::mt19937_64& random) {
  std::size_t done = 0;
  while (done < operation.bytes.size()) {
    const auto at = static_cast<std::size_t>(operation.offset) + done;
    const std::size_t count = std::min(kSector - at % kSector, operation.bytes.size() - done);
    if (random() % 2 == 0)
      put(file, static_cast<std::int64_t>(at), operation.bytes.data() + done, count);
    done += count;
  }
}

}  // namespace

FaultyDisk& FaultyDisk::install() {
  if (usual != nullptr) return disk;
  usual = sqlite3_vfs_find(nullptr);
  faulty = *usual;
  faulty.szOsFile = static_cast<int>(sizeof(OpenFile)) + usual->szOsFile;
  faulty.zName = "faulty";
  faulty.pNext = nullptr;
  faulty.xOpen = open;
  faulty.xDelete = remove;
  sqlite3_vfs_register(&faulty, 1);
  return disk;
}

void FaultyDisk::fail_at(std::int64_t n, bool for_good, int code) {
  calls_ = 0;
  at_ = n;
  for_good_ = for_good;
  code_ = code;
}

bool FaultyDisk::fails() {
  ++calls_;
  return at_ > 0 && (calls_ == at_ || (for_good_ && calls_ > at_));
}

void FaultyDisk::remember(bool on) {
  remembering_ = on;
  if (!on) return;
  operations_.clear();
  indexes_.clear();
}

void FaultyDisk::note(Operation operation) {
  if (!remembering_) return;
  if (operation.kind == Operation::Kind::sync && index_ != nullptr)
    indexes_.emplace_back(
        operations_.size(),
        std::string(const_cast<const char*>(static_cast<const volatile char*>(index_)), kIndex));
  operations_.push_back(std::move(operation));
}

std::map<std::string, std::string> FaultyDisk::after_power_cut(std::size_t moment,
                                                               std::mt19937_64& random) const {
  std::map<std::string, std::string> files{{"", ""}};
  std::map<std::string, std::size_t> flushed;
  for (std::size_t i = 0; i < moment; ++i) {
    if (operations_[i].kind == Operation::Kind::sync) flushed[operations_[i].part] = i;
  }
  for (std::size_t i = 0; i < moment; ++i) {
    const Operation& one = operations_[i];
    const bool removes = one.kind == Operation::Kind::remove;
    const bool safe = i < flushed[removes ? kDirectory : one.part];
    const auto luck = random() % 3;
    const bool kept = safe || luck == 0;
    if (one.kind == Operation::Kind::write) {
      std::string& file = files[one.part];
      if (kept)
        put(file, one.offset, one.bytes.data(), one.bytes.size());
      else if (luck == 1)
        put_torn(file, one, random);
    } else if (one.kind == Operation::Kind::truncate && kept) {
      files[one.part].resize(static_cast<std::size_t>(one.offset));
    } else if (removes && (kept || one.offset != 0)) {
      files.erase(one.part);
    }
  }
  const auto older =
      std::ranges::count_if(indexes_, [moment](const auto& index) { return index.first < moment; });
  if (older > 0 && random() % 2 == 0)
    files["-shm"] = indexes_[random() % static_cast<std::uint64_t>(older)].second;
  return files;
}

}  // namespace shaker::record::torture
