// What the gateway knows of the rig: the daemon's documents that a browser needs to draw the
// page, as server-sent events.
//
// Kept are the newest document of each kind, and the cycles, estimates, runs and alarms of the
// current campaign. Alarms go when they are acknowledged (FAULT to IDLE) or when a campaign
// begins, as on the terminal (cli/live_view.hpp). Of an estimate that is not the newest, the
// matrices go. What is kept has a bound: the oldest cycles and estimates make room.
//
// Each connection to a daemon is a "life" of the feed: the sequence numbers of one say nothing
// of another. Pure: no sockets, no clocks. One thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace shaker::gateway {

using Text = std::shared_ptr<const std::string>;

// One server-sent event, as its bytes.
struct Event {
  Text text;
  bool droppable = false;  // a browser that lags can do without it
};

// "id: 7\ndata: {...}\n\n"; no id for 0, no name for an empty one.
Text event_text(const std::string& data, std::uint64_t id = 0, const std::string& name = "");

class Feed {
 public:
  explicit Feed(std::size_t max_bytes = 2 * 1024 * 1024) : max_bytes_(max_bytes) {}

  // The daemon answers. `life` is new for each connection. Forgets everything.
  void begin(const std::string& life);
  // A line of the daemon. Returns the event for every browser, or nothing if the line is not for
  // them (an answer, not JSON).
  std::optional<Event> take(const std::string& line);
  // The daemon is away; `why` is a sentence for people.
  Event lose(const std::string& why);

  // For a browser that comes: "daemon", "reset" where it has to forget what it has, what is kept,
  // and "ready" with the newest number. `last_id`: it has seen the documents up to this number; what it
  // needs is then only what is newer, if it belongs to the same life, as far as that can be told.
  std::vector<Event> opening(std::optional<std::uint64_t> last_id) const;

  bool connected() const { return lost_.empty(); }
  const std::string& lost() const { return lost_; }
  // The last document of a type in this life; null if there is none.
  const nlohmann::json* last(const std::string& type) const;
  int alarms(const std::string& severity) const;  // not yet acknowledged

 private:
  struct Kept {
    std::uint64_t seq = 0;
    std::string type, severity;
    Text text;
  };
  void take_state(const nlohmann::json& state);
  void take_alarm(const nlohmann::json& alarm);
  void forget(const std::function<bool(const Kept&)>& which);
  void keep(const nlohmann::json& document, const std::string& type, std::uint64_t seq, Text text);
  void slim_last_estimate();
  void trim();
  Event greeting() const;

  std::size_t max_bytes_, bytes_ = 0;
  std::string life_ = "0";
  std::string lost_ = "The gateway has not reached the daemon yet.";
  std::map<std::string, nlohmann::json> last_;
  std::map<std::string, Text> newest_;  // events of documents of which only the newest counts
  std::deque<Kept> history_;
  std::uint64_t seq_ = 0;     // of the newest numbered document
  std::uint64_t forgot_ = 0;  // documents up to this number may be missing
};

}  // namespace shaker::gateway
