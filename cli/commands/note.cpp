// note: adds a sentence to what a campaign database says of itself.
#include <chrono>
#include <pwd.h>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "base/clock.hpp"
#include "cli/campaign_place.hpp"
#include "cli/commands.hpp"
#include "record/provenance.hpp"

namespace shaker::cli {
namespace {

constexpr std::size_t kNoteMax = 10'000;  // bytes
// The recorder closes a campaign's file a moment after the table has come to rest.
constexpr std::chrono::seconds kUntilClosed{5};
constexpr std::chrono::milliseconds kLookAgain{100};

std::string user_of_this_process() {
  const passwd* user = ::getpwuid(::getuid());
  return user == nullptr ? fmt::format("uid {}", ::getuid()) : user->pw_name;
}

}  // namespace

int note(const Common& common, const NoteOptions& options) {
  if (auto good = expect_file(options.file); !good)
    return fail(common, kBadInput, good.error().what);
  if (options.text.empty() || options.text.size() > kNoteMax)
    return fail(
        common, kBadInput,
        fmt::format("a note has 1 to {} bytes; this one has {}", kNoteMax, options.text.size()));
  const std::string utc = format_utc(RealClock().utc());
  const auto add = [&] {
    return record::add_note(options.file, {"note", user_of_this_process(), options.text, utc});
  };
  const auto end = std::chrono::steady_clock::now() + kUntilClosed;
  auto added = add();
  while (!added && added.error().kind == ErrorKind::refused &&
         std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(kLookAgain);
    added = add();
  }
  if (!added) return fail(common, kBadInput, added.error().what);
  if (common.json)
    fmt::print("{}\n",
               nlohmann::ordered_json{{"file", options.file.string()}, {"utc", utc}}.dump());
  else
    fmt::print("The note is in {}.\n", options.file.string());
  return kOk;
}

}  // namespace shaker::cli
