#include "tests/record/torture/recording.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include "tests/record/scratch.hpp"

namespace shaker::record::torture {
namespace {

namespace fs = std::filesystem;

std::string line_of(int i) {
  return fmt::format(R"({{"seq":{},"text":"{}"}})", i + 1,
                     std::string(20 + (i * 37) % 400, static_cast<char>('a' + i % 26)));
}

std::vector<double> wave_of(int i) {
  return std::vector<double>(48, 0.25 * i + 1.0 / 3.0);
}

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Returns the first thing in the file that was never written, or an incomplete commit.
std::string foreign(const CampaignReader& reader, std::int64_t& documents, bool whole) {
  const auto lines = reader.documents();
  const auto samples = reader.samples(0);
  const auto cycles = reader.cycles(0);
  if (!lines || !samples || !cycles) return "what recovery left cannot be read";
  std::set<std::string> seen(lines->begin(), lines->end());
  documents = static_cast<std::int64_t>(lines->size());
  for (const std::string& line : *lines) {
    const int i = std::stoi(line.substr(7)) - 1;
    if (line != line_of(i)) return "a document was never written: " + line;
  }
  for (const SampleRow& row : *samples) {
    const auto i = static_cast<int>(row.t_ns / 1'000'000'000);
    if (row.t_ns != testing::example_sample(i).t_ns ||
        row.value != testing::example_sample(i).value)
      return "a sample was never written";
  }
  for (const CycleRow& cycle : *cycles) {
    if (cycle.displacement != wave_of(static_cast<int>(cycle.index)))
      return "a cycle was never written";
  }
  if (!whole) return "";
  const auto commits = lines->size();
  if (samples->size() != commits * kSamples || cycles->size() != commits)
    return "a commit that is called whole is there in part";
  return "";
}

// Checks that every byte of the damaged files is kept under another name.
std::string removed(const Recovered& found, const Remains& before) {
  for (const auto& [part, bytes] : before) {
    if (!bytes.empty() && content_of(found.aside.string() + part) != bytes)
      return "not as it was found: " + found.aside.filename().string() + part;
  }
  return "";
}

}  // namespace

Result<void> add_commit(CampaignWriter& writer, int i) {
  std::vector<SampleRow> samples;
  for (int k = 0; k < kSamples; ++k)
    samples.push_back(testing::example_sample(i * kSamples + k));
  auto done = writer.add_samples(0, samples);
  if (done) done = writer.add_cycle({0, i, true, 2.0, 3.0, wave_of(i), wave_of(i), 0.0});
  if (done) done = writer.add_document(static_cast<std::uint64_t>(i) + 1, line_of(i));
  if (done) done = writer.commit();
  return done;
}

Remains remains_of(const fs::path& file) {
  Remains remains;
  for (const char* part : {"", "-wal", "-shm"}) {
    if (fs::exists(file.string() + part)) remains[part] = content_of(file.string() + part);
  }
  return remains;
}

fs::path lay(const Remains& remains, const fs::path& directory) {
  const fs::path file = directory / "c.db";
  for (const auto& [part, bytes] : remains)
    std::ofstream(file.string() + part, std::ios::binary) << bytes;
  return file;
}

Remains left_behind(int commits, int folded) {
  const testing::Scratch scratch(testing::Scratch::in_memory);
  auto writer = CampaignWriter::create(scratch.path(), testing::example_campaign());
  for (int i = 0; writer && i < commits; ++i) {
    if (!add_commit(*writer, i)) return {};
    if (i + 1 == folded)
      SQLite::Database(writer->file().string(), SQLite::OPEN_READWRITE)
          .exec("PRAGMA wal_checkpoint(PASSIVE)");
  }
  return writer ? remains_of(writer->file()) : Remains{};
}

Verdict judge(const fs::path& file, const Remains& before, int acknowledged, End end) {
  Verdict verdict;
  const auto found = recover(file.parent_path(), kNow);
  const auto fail = [&](const std::string& why) {
    verdict.violation = why + (found.empty() ? "" : " | " + found[0].what);
    return verdict;
  };
  if (found.size() > 1) return fail("more than one finding");
  const bool told = found.size() == 1;
  verdict.told = told;
  const Recovered one = told ? found[0] : Recovered{};
  verdict.damaged = one.damaged;
  verdict.whole = one.whole;
  // It may be newer, or its version is damaged. Recovery reports this and does not change the
  // file.
  if (one.what.find("newer shakerd") != std::string::npos)
    return content_of(file) == before.at("") ? verdict : fail("a newer file was changed");
  const bool nothing_read = one.damaged && one.file == one.aside;
  if (nothing_read && one.documents > 0) return fail("documents are counted that are not there");
  const auto readable = told ? one.file : file;
  if (!nothing_read && acknowledged > 0) {
    const auto reader = CampaignReader::open(readable);
    if (!reader && !one.damaged && one.campaign.empty() && told)
      verdict.read = 0;  // reported: the file has no campaign
    else if (!reader)
      return fail("what recovery left cannot be opened: " + reader.error().what);
    else if (auto what = foreign(*reader, verdict.read, one.whole); !what.empty())
      return fail(what);
    if (reader && told && verdict.read != one.documents) return fail("documents are miscounted");
  }
  if (one.damaged) {
    if (auto what = removed(one, before); !what.empty()) return fail(what);
  }
  const bool doubts =
      end == End::missing && (one.what.find("would not show") != std::string::npos ||
                              one.what.find("would be missing") != std::string::npos ||
                              one.what.find("or its log was removed") != std::string::npos);
  const auto counted = verdict.read + one.lost_commits + one.missing_documents + one.unsound_rows;
  if (counted < acknowledged && !nothing_read && !doubts)
    return fail(fmt::format("{} documents were acknowledged, {} are read or counted as lost",
                            acknowledged, counted));
  if (one.whole && verdict.read < acknowledged) return fail("called whole, and is not");
  return verdict;
}

}  // namespace shaker::record::torture
