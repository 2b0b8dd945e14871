// Any text as a configuration file: the result is a struct that is unchanged after writing and
// reading, or sentences that each name the file.
#include <cstdlib>
#include <sstream>
#include <string>

#include "config/campaign.hpp"
#include "config/rig.hpp"
#include "tests/fuzz/target.hpp"

namespace config = shaker::config;

namespace {

void expect_places(const shaker::Error& error) {
  if (!error.what.starts_with("fuzz.json:")) std::abort();
}

template <class Spec, class Parse>
void expect_round_trip(const Spec& spec, Parse parse) {
  const std::string text = config::to_json_text(spec);
  const auto again = parse(text);
  if (!again || config::to_json_text(*again) != text) std::abort();
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto parse_model = [](const std::string& t) { return config::parse_model(t, "fuzz.json"); };
  const auto parse_campaign = [](const std::string& t) {
    return config::parse_campaign(t, "fuzz.json", "no-such-folder");
  };
  if (const auto model = parse_model(text)) {
    expect_round_trip(*model, parse_model);
  } else {
    expect_places(model.error());
  }
  if (const auto campaign = parse_campaign(text)) {
    expect_round_trip(*campaign, parse_campaign);
  } else {
    expect_places(campaign.error());
  }
  if (const auto rig = config::parse_rig(text, "fuzz.json"); !rig) expect_places(rig.error());
  return 0;
}
