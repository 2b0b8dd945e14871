// A write-ahead log with big-endian checksums, as a big-endian machine writes it.
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include "record/write_ahead_log.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using testing::example_campaign;
using testing::Scratch;

constexpr std::size_t kHead = 32, kFrameHead = 24;  // sqlite.org/fileformat2.html, 4.1

std::uint32_t word_at(const std::string& log, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i)
    word = word << 8 | static_cast<unsigned char>(log[at + i]);
  return word;
}
void put_word(std::string& log, std::size_t at, std::uint32_t word) {
  for (std::size_t i = 4; i-- > 0; word >>= 8)
    log[at + i] = static_cast<char>(word & 0xFF);
}

struct Sum {
  std::uint32_t first = 0, second = 0;
  void add(const std::string& log, std::size_t at, std::size_t size) {
    for (const std::size_t end = at + size; at < end; at += 8) {
      first += word_at(log, at) + second;
      second += word_at(log, at + 4) + first;
    }
  }
  void put(std::string& log, std::size_t at) const {
    put_word(log, at, first);
    put_word(log, at + 4, second);
  }
};

std::string with_big_endian_words(std::string log) {
  put_word(log, 0, 0x377f0683);
  Sum sum;
  sum.add(log, 0, 24);
  sum.put(log, 24);
  const std::size_t page = word_at(log, 8);
  for (std::size_t at = kHead; at + kFrameHead + page <= log.size(); at += kFrameHead + page) {
    sum.add(log, at, 8);
    sum.add(log, at + kFrameHead, page);
    sum.put(log, at + 16);
  }
  return log;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(WriteAheadLog, OfBigEndianWordsIsReadAsSqliteReadsIt) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  for (std::uint64_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(writer->add_document(i, std::string(500, 'd')));
    ASSERT_TRUE(writer->commit());
  }
  const auto copy = scratch.path() / "copy.db";
  std::filesystem::copy_file(writer->file(), copy);
  const std::string log = text_of(writer->file().string() + "-wal");
  std::ofstream(copy.string() + "-wal", std::ios::binary) << log;
  const LogReading native = read_log(copy);
  ASSERT_GT(native.sound, 50);
  std::ofstream(copy.string() + "-wal", std::ios::binary) << with_big_endian_words(log);
  const LogReading big = read_log(copy);
  EXPECT_TRUE(big.header_fits);
  EXPECT_EQ(big.sound, native.sound);
  EXPECT_EQ(big.readable_commits, native.readable_commits);
  EXPECT_EQ(big.state, LogState::no_index);
  SQLite::Database opened(copy.string(), SQLite::OPEN_READWRITE);
  EXPECT_EQ(opened.execAndGet("SELECT count(*) FROM document").getInt(), 50);
}

}  // namespace
}  // namespace shaker::record
