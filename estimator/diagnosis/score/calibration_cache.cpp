#include "estimator/diagnosis/score/calibration_cache.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

namespace shaker::estimator::diagnosis {
namespace {

namespace fs = std::filesystem;

// Another number for every change of how a calibration is drawn or written.
constexpr std::string_view kVersion = "shaker-calibration/2\n";
constexpr std::size_t kMostInMemory = 64;
constexpr std::size_t kMostFiles = 256;  // of about 64 kB each

// Two 64-bit FNV-1a sums, the second over the bytes mixed with where they stand.
class Digest {
 public:
  void add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) {
      first_ = (first_ ^ bytes[i]) * kPrime;
      second_ = (second_ ^ (bytes[i] + (++place_ << 8))) * kPrime;
    }
  }
  void add(double value) { add(&value, sizeof value); }
  void add(std::int64_t value) { add(&value, sizeof value); }
  template <typename Matrix>
  void add_matrix(const Matrix& m) {
    add(static_cast<std::int64_t>(m.rows()));
    add(static_cast<std::int64_t>(m.cols()));
    add(m.data(), static_cast<std::size_t>(m.size()) * sizeof(double));
  }
  std::string text() const { return fmt::format("{:016x}{:016x}", first_, second_); }

 private:
  static constexpr std::uint64_t kPrime = 1099511628211U;
  std::uint64_t first_ = 14695981039346656037U, second_ = 7809847782465536322U, place_ = 0;
};

std::string key_of(const Design& design, int draws, std::uint64_t seed) {
  Digest digest;
  digest.add(kVersion.data(), kVersion.size());
  digest.add(static_cast<std::int64_t>(draws));
  digest.add(static_cast<std::int64_t>(seed));
  digest.add_matrix(design.jacobian);
  digest.add_matrix(design.freedom);
  for (const Signature& s : design.signatures) {
    digest.add_matrix(s.direction);
    digest.add(s.visible > 0.0 ? 1.0 : 0.0);
    digest.add(static_cast<std::int64_t>(s.sign));
  }
  return digest.text();
}

// Of the numbers that a file holds, and of what they are the calibration of.
std::string digest_of(const std::string& key, const std::vector<double>& lengths,
                      const std::vector<double>& gains, const std::vector<double>& smaller) {
  Digest digest;
  digest.add(key.data(), key.size());
  for (const auto* values : {&lengths, &gains, &smaller})
    digest.add(values->data(), values->size() * sizeof(double));
  return digest.text();
}

void read(std::istream& in, std::vector<double>& values) {
  in.read(reinterpret_cast<char*>(values.data()),
          static_cast<std::streamsize>(values.size() * sizeof(double)));
}

void write(std::ostream& out, const std::vector<double>& values) {
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(double)));
}

std::shared_ptr<const Calibration> read(const fs::path& folder, const std::string& key, int draws) {
  std::ifstream in(folder / key, std::ios::binary);
  std::string version(kVersion.size(), ' '), digest(Digest().text().size(), ' ');
  in.read(version.data(), static_cast<std::streamsize>(version.size()));
  in.read(digest.data(), static_cast<std::streamsize>(digest.size()));
  if (!in || version != kVersion) return nullptr;
  std::vector<double> lengths(static_cast<std::size_t>(draws)), gains(lengths), smaller(lengths);
  for (auto* values : {&lengths, &gains, &smaller})
    read(in, *values);
  if (!in || in.peek() != std::char_traits<char>::eof() ||
      digest != digest_of(key, lengths, gains, smaller))
    return nullptr;
  return std::make_shared<const Calibration>(std::move(lengths), std::move(gains),
                                             std::move(smaller));
}

void forget_oldest(const fs::path& folder) {
  std::error_code ignored;
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    files.emplace_back(entry.last_write_time(ignored), entry.path());
  if (files.size() <= kMostFiles) return;
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size() - kMostFiles / 2; ++i)
    fs::remove(files[i].second, ignored);
}

// Under another name first: who reads at this moment sees all of it or nothing.
void write(const fs::path& folder, const std::string& key, const Calibration& calibration) {
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  const fs::path draft = folder / fmt::format("{}.{}", key, ::getpid());
  {
    std::ofstream out(draft, std::ios::binary);
    out.write(kVersion.data(), static_cast<std::streamsize>(kVersion.size()));
    out << digest_of(key, calibration.lengths(), calibration.gains(), calibration.smaller());
    write(out, calibration.lengths());
    write(out, calibration.gains());
    write(out, calibration.smaller());
    out.close();
    if (!out) {
      fs::remove(draft, ignored);
      return;
    }
  }
  fs::rename(draft, folder / key, ignored);
  if (ignored) fs::remove(draft, ignored);
  forget_oldest(folder);
}

}  // namespace

CalibrationCache::CalibrationCache(std::optional<fs::path> folder) : folder_(std::move(folder)) {}

std::shared_ptr<const Calibration> CalibrationCache::get(const Design& design, int draws,
                                                         std::uint64_t seed) {
  const std::string key = key_of(design, draws, seed);
  const std::scoped_lock lock(guard_);
  if (const auto found = known_.find(key); found != known_.end()) return found->second;
  std::shared_ptr<const Calibration> calibration;
  if (folder_) calibration = read(*folder_, key, draws);
  if (!calibration) {
    ++drawn_;
    calibration = std::make_shared<const Calibration>(design, draws, seed);
    if (folder_) write(*folder_, key, *calibration);
  }
  if (known_.size() >= kMostInMemory) known_.clear();
  known_.emplace(key, calibration);
  return calibration;
}

int CalibrationCache::drawn() const {
  const std::scoped_lock lock(guard_);
  return drawn_;
}

std::optional<fs::path> CalibrationCache::user_folder() {
  const auto absolute = [](const char* name) -> std::optional<fs::path> {
    const char* value = std::getenv(name);
    if (value == nullptr || *value != '/') return std::nullopt;
    return fs::path(value);
  };
  if (const auto cache = absolute("XDG_CACHE_HOME")) return *cache / "shakerd/calibration";
  if (const auto home = absolute("HOME")) return *home / ".cache/shakerd/calibration";
  return std::nullopt;
}

}  // namespace shaker::estimator::diagnosis
