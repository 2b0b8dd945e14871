#include "estimator/diagnosis/score/calibration_cache.hpp"

#include <cstdlib>
#include <fstream>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "config/model.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"

namespace shaker::estimator::diagnosis {
namespace {

namespace fs = std::filesystem;

Design design(double scale) {
  std::mt19937_64 source(4);
  std::normal_distribution<double> normal;
  Design d;
  d.jacobian = scale * Eigen::MatrixXd::NullaryExpr(20, 3, [&] { return normal(source); });
  d.freedom = Eigen::VectorXd::Constant(20, 30.0);
  d.signatures.push_back({Eigen::VectorXd::Unit(20, 7), 1.0, 0.0, 0});
  return d;
}

class Cache : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "calibrations.XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(Cache, DrawsOnceForOneDesign) {
  CalibrationCache cache;
  const auto first = cache.get(design(1.0), 500, 1);
  EXPECT_EQ(cache.get(design(1.0), 500, 1), first);
  EXPECT_EQ(cache.drawn(), 1);
}

TEST_F(Cache, TellsApartAllThatACalibrationDependsOn) {
  CalibrationCache cache(folder_);
  cache.get(design(1.0), 500, 1);
  cache.get(design(2.0), 500, 1);
  cache.get(design(1.0), 501, 1);
  cache.get(design(1.0), 500, 2);
  Design other = design(1.0);
  other.freedom[3] = 29.0;
  cache.get(other, 500, 1);
  other = design(1.0);
  other.signatures[0].sign = 1;
  cache.get(other, 500, 1);
  EXPECT_EQ(cache.drawn(), 6);
}

TEST_F(Cache, ReadsFromItsFolderWhatAnotherDrew) {
  const Calibration drawn(design(1.0), 500, 1);
  CalibrationCache(folder_ / "new").get(design(1.0), 500, 1);
  CalibrationCache second(folder_ / "new");
  const auto read = second.get(design(1.0), 500, 1);
  EXPECT_EQ(second.drawn(), 0);
  EXPECT_EQ(read->lengths(), drawn.lengths());
  EXPECT_EQ(read->gains(), drawn.gains());
  EXPECT_EQ(read->smaller(), drawn.smaller());
}

TEST_F(Cache, DrawsAnewWhereAFileIsBroken) {
  CalibrationCache(folder_).get(design(1.0), 500, 1);
  for (const auto& entry : fs::directory_iterator(folder_))
    fs::resize_file(entry.path(), fs::file_size(entry.path()) - 8);
  CalibrationCache second(folder_);
  const auto calibration = second.get(design(1.0), 500, 1);
  EXPECT_EQ(second.drawn(), 1);
  EXPECT_EQ(calibration->lengths(), Calibration(design(1.0), 500, 1).lengths());
}

// A disk that was full or lost its power leaves files of the right length.
TEST_F(Cache, DrawsAnewWhereAFilesNumbersAreNotThoseThatWereDrawn) {
  const Calibration drawn(design(1.0), 500, 1);
  CalibrationCache(folder_).get(design(1.0), 500, 1);
  const fs::path file = *fs::directory_iterator(folder_);
  const auto size = static_cast<std::streamoff>(fs::file_size(file));
  const auto numbers = static_cast<std::streamoff>(3 * 500 * sizeof(double));
  const auto overwritten = [&](std::streamoff at, std::streamoff count) {
    std::fstream(file).seekp(at) << std::string(static_cast<std::size_t>(count), '\0');
    CalibrationCache cache(folder_);
    const auto calibration = cache.get(design(1.0), 500, 1);
    return calibration->lengths() == drawn.lengths() && calibration->gains() == drawn.gains() &&
           calibration->smaller() == drawn.smaller() && cache.drawn() == 1;
  };
  EXPECT_TRUE(overwritten(size - numbers, numbers));
  EXPECT_TRUE(overwritten(size - numbers, 8));  // the smallest number: the numbers still ascend
  EXPECT_TRUE(overwritten(0, size));
}

TEST_F(Cache, TakesNoFileOfAnotherDesign) {
  CalibrationCache(folder_).get(design(1.0), 500, 1);
  const fs::path first = *fs::directory_iterator(folder_);
  fs::rename(first, folder_ / "first");
  CalibrationCache(folder_).get(design(2.0), 500, 1);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (entry.path().filename() == "first") continue;
    fs::copy_file(folder_ / "first", entry.path(), fs::copy_options::overwrite_existing);
  }
  CalibrationCache cache(folder_);
  EXPECT_EQ(cache.get(design(2.0), 500, 1)->lengths(), Calibration(design(2.0), 500, 1).lengths());
  EXPECT_EQ(cache.drawn(), 1);
}

TEST_F(Cache, NeedsNoFolderThatCanBeWritten) {
  std::ofstream(folder_ / "file") << "no folder";
  CalibrationCache cache(folder_ / "file" / "within");
  EXPECT_EQ(cache.get(design(1.0), 500, 1)->lengths().size(), 500U);
}

TEST_F(Cache, MakesNoDiagnosisDifferent) {
  const Campaign campaign = testing::recorded({}, {{1.2, 2.0}, {2.0, 3.0}, {3.0, 6.0}}, 3);
  const auto model = config::load_model(SHAKER_SOURCE_DIR "/config/examples/model-oleo.json");
  DiagnoseOptions options;
  const auto without = diagnose(campaign, model.value(), options);
  ASSERT_TRUE(without) << without.error().what;
  for (int time = 0; time < 2; ++time) {
    CalibrationCache cache(folder_);
    options.calibrations = &cache;
    const auto with = diagnose(campaign, model.value(), options);
    ASSERT_TRUE(with) << with.error().what;
    EXPECT_EQ(cache.drawn() > 0, time == 0);
    EXPECT_EQ(with->verdict, without->verdict);
    EXPECT_EQ(with->probability_before, without->probability_before);
    EXPECT_EQ(with->probability_after, without->probability_after);
    EXPECT_EQ(with->chi_squared_after, without->chi_squared_after);
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
