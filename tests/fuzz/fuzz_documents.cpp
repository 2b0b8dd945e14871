// Lines that a daemon, or whoever has its place, sends to those who look on: the gateway's feed, the
// sentences of the terminal, and the standing alarms.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "cli/documents_in.hpp"
#include "gateway/feed.hpp"
#include "protocol/standing_alarms.hpp"
#include "tests/fuzz/target.hpp"

namespace {

using Json = nlohmann::json;

void require(bool holds) {
  if (!holds) std::abort();
}

// Ends with a blank line and holds no other: the next event is not a part of it.
void expect_event(const shaker::gateway::Event& event) {
  const std::string& text = *event.text;
  require(text.size() > 2 && text.find("\n\n") == text.size() - 2);
}

void expect_line(const std::string& text) {
  require(std::none_of(text.begin(), text.end(),
                       [](unsigned char c) { return c < 0x20 || c == 0x7f; }));
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  shaker::gateway::Feed feed(64 * 1024);
  shaker::protocol::StandingAlarms alarms;
  feed.begin("1");
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty()) {
    const std::string line(rest.substr(0, rest.find('\n')));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    if (const auto event = feed.take(line)) expect_event(*event);
    const Json document = Json::parse(line, nullptr, false);
    if (document.is_discarded()) continue;
    expect_line(shaker::cli::narrate(document));
    (void)shaker::cli::estimate_from(document);
    alarms.take(document, line);
    require(alarms.all().size() <= shaker::protocol::StandingAlarms::kMost);
    require(alarms.by_severity().size() == alarms.all().size());
  }
  for (const auto& event : feed.opening(std::nullopt))
    expect_event(event);
  for (const auto& event : feed.opening(1))
    expect_event(event);
  require(feed.alarms("error") >= 0 && feed.connected());
  expect_event(feed.lose("away"));
  return 0;
}
