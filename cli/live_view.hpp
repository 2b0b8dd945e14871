// What `watch` shows on a terminal: the newest of each kind of document, as lines. Pure.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace shaker::cli {

class LiveView {
 public:
  void take(const nlohmann::json& document);
  // Clipped to `width` characters, at most `height` lines.
  std::vector<std::string> lines(int width, int height) const;

 private:
  std::map<std::string, nlohmann::json> last_;  // by type
  std::deque<std::string> events_;              // runs and alarms, newest last
  long accepted_ = 0, rejected_ = 0;            // cycles of the run
};

}  // namespace shaker::cli
