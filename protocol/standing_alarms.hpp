// The alarms that nobody has acknowledged yet, from the documents of the stream: what every view
// shows until then. The daemon repeats them to each new client.
//
// An alarm of severity "info" is not kept. Its code says where others end: "acknowledged" ends
// all, "warnings_set_aside" (a campaign begins) ends the warnings. One thread; pure.
#pragma once

#include <deque>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace shaker::protocol {

inline constexpr std::string_view kAcknowledged = "acknowledged";
inline constexpr std::string_view kWarningsSetAside = "warnings_set_aside";

struct StandingAlarm {
  std::string code, text;  // the newest text
  std::string since_utc;   // of the first one
  bool error = false;      // otherwise a warning
  int times = 1;
  std::string line = {};  // the first document, as it was given
};

class StandingAlarms {
 public:
  static constexpr std::size_t kMost = 16;  // beyond, the oldest warning is dropped, then errors

  // Takes any document; `line` is its text. Returns true if it is an alarm of severity "error".
  // Alarms of one code count as one, except those about files.
  bool take(const nlohmann::json& document, std::string_view line = {});
  const std::deque<StandingAlarm>& all() const { return all_; }  // the oldest first
  std::deque<StandingAlarm> by_severity() const;                 // errors, then warnings

 private:
  void make_room();
  std::deque<StandingAlarm> all_;
};

}  // namespace shaker::protocol
