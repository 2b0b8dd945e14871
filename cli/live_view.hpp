// What `watch` shows on a terminal: alarms first, then what the rig does, what it measures, and what was
// estimated. Pure.
//
// An alarm stays on the screen, with the time since when, until somebody acknowledges it (the rig leaves
// FAULT) or the next campaign begins. A campaign that begins also clears what belongs to the one before.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace shaker::cli {

class LiveView {
 public:
  enum class Style { plain, alarm, warning };
  struct Line {
    std::string text;
    Style style = Style::plain;
  };

  // True where the document is an error alarm that was not on the screen: ring the bell.
  bool take(const nlohmann::json& document);
  // `why`: over everything, until the next document; empty: the daemon answers.
  void set_lost(std::string why) { lost_ = std::move(why); }
  // Clipped to `width` characters, at most `height` lines. Where there is no room, the estimate's
  // parameters and past events give way; state and alarms never do.
  std::vector<Line> lines(int width, int height) const;

 private:
  struct Alarm {
    std::string since, code, text;
    bool error = false;
    int times = 1;
  };
  bool take_alarm(const nlohmann::json& document);
  void add_event(const nlohmann::json& document);
  void take_state(const nlohmann::json& document);
  void add_alarms(std::vector<Line>& out) const;
  void add_motion(std::vector<Line>& out, const nlohmann::json& state) const;
  const nlohmann::json* last(const char* type) const;

  std::map<std::string, nlohmann::json> last_;  // by type
  std::deque<std::string> events_;              // runs and diagnoses, newest last
  std::deque<Alarm> alarms_;                    // newest last
  long accepted_ = 0, rejected_ = 0;            // cycles of the run
  std::string lost_;
};

}  // namespace shaker::cli
