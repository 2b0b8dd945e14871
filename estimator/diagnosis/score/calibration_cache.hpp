/// \file
/// Calibrations that were drawn before: a second diagnosis of the same campaign, or of one that
/// only its report was wanted of, need not draw again.
///
/// Kept in memory for as long as the cache lives and, given a folder, in a file each. The key is
/// all that a calibration depends on, to the last bit: the whitened Jacobian and the signatures (so
/// runs, cycles, harmonics, model and catalogue), the degrees of freedom, draws, seed, and the
/// version of the drawing itself; a file holds a sum over the key and its numbers, so that one
/// whose contents were lost or changed is not taken for it. So a hit is what drawing would have
/// given. A folder that cannot be read or written, or a file that is broken, costs the time of
/// drawing and nothing else.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "estimator/diagnosis/score/calibration.hpp"

namespace shaker::estimator::diagnosis {

/// For several threads at once.
class CalibrationCache {
 public:
  /// Without a folder: in memory only.
  /// \param folder for the files; it is made where it does not exist
  explicit CalibrationCache(std::optional<std::filesystem::path> folder = std::nullopt);

  /// Looks a calibration up, and draws it where none was found.
  /// \param design what was measured
  /// \param draws number of draws
  /// \param seed of the random numbers
  /// \return the calibration
  std::shared_ptr<const Calibration> get(const Design& design, int draws, std::uint64_t seed);

  /// \return how many times nothing was found
  int drawn() const;  ///< how many times nothing was found

  /// $XDG_CACHE_HOME/shakerd/calibration, or ~/.cache/shakerd/calibration; nothing where neither
  /// variable holds an absolute path.
  /// \return the folder
  static std::optional<std::filesystem::path> user_folder();

 private:
  std::optional<std::filesystem::path> folder_;
  mutable std::mutex guard_;
  std::map<std::string, std::shared_ptr<const Calibration>> known_;
  int drawn_ = 0;
};

}  // namespace shaker::estimator::diagnosis
