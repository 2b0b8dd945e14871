// The content of the screen of `watch` on a terminal: first the alarms, then the state and the
// motion of the rig, the measurements and the estimate. Does no input or output.
//
// An alarm stays on the screen, with the time since when it stands, until it is acknowledged; at
// most five are shown. A campaign that begins clears the estimate, cycle and events of the last
// one. On 24 lines the parameter that is known least stands above the estimate.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "protocol/standing_alarms.hpp"

namespace shaker::cli {

class LiveView {
 public:
  enum class Style { plain, alarm, warning };
  struct Line {
    std::string text;
    Style style = Style::plain;
  };

  // Returns true when the document is an alarm of severity "error": the caller rings the bell.
  bool take(const nlohmann::json& document);
  // `why` is shown on top until the next document comes; empty: the daemon answers.
  void set_lost(std::string why) { lost_ = std::move(why); }
  // At most `width` characters and `height` lines. What is longer is wrapped where there is room.
  // The lines at the end are dropped when there is none: past events first, then the estimate.
  std::vector<Line> lines(int width, int height) const;

 private:
  void add_event(const nlohmann::json& document);
  void take_state(const nlohmann::json& document);
  void add_alarms(std::vector<Line>& out) const;
  void add_run(std::vector<Line>& out, const nlohmann::json& state) const;
  void add_motion(std::vector<Line>& out, const nlohmann::json& state) const;
  void add_limits(std::vector<Line>& out) const;
  const nlohmann::json* last(const char* type) const;

  std::map<std::string, nlohmann::json> last_;  // the last document of each type
  std::deque<std::string> events_;              // runs and diagnoses, newest last
  protocol::StandingAlarms alarms_;
  std::string now_utc_;               // of the newest document
  long accepted_ = 0, rejected_ = 0;  // cycles of the current run
  std::string lost_;
};

}  // namespace shaker::cli
