// Shows what happens: a table that is redrawn on a terminal, a line for each document elsewhere.
#include <chrono>
#include <cstdio>
#include <utility>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/commands/daemon_error.hpp"
#include "cli/live_view.hpp"
#include "cli/terminal.hpp"

namespace shaker::cli {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kRedraw = std::chrono::milliseconds(200);

int terminal_height() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row >= 5 ? size.ws_row - 1 : 23;
}

// The alternate screen, given back in every case.
class Screen {
 public:
  Screen() { fmt::print("\x1b[?1049h\x1b[?25l"); }
  ~Screen() {
    fmt::print("\x1b[?25h\x1b[?1049l");
    std::fflush(stdout);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void draw(const LiveView& view) {
    std::string text = "\x1b[H";
    for (const std::string& line : view.lines(terminal_width(), terminal_height())) {
      text += line + "\x1b[K\r\n";
    }
    fmt::print("{}\x1b[J", text);
    std::fflush(stdout);
  }
};

// Hands every line to `take` until the time is over or Ctrl-C.
template <class Take, class Idle>
Result<void> follow(StreamClient& client, double seconds, Take take, Idle idle) {
  const auto begin = Clock::now();
  const auto limit = std::chrono::duration<double>(seconds);
  while (interrupts() == 0 && (seconds <= 0.0 || Clock::now() - begin < limit)) {
    std::string line;
    const auto wait = client.next(100, line);
    if (!wait) return wait.error();
    if (*wait == StreamClient::Wait::line) take(line);
    idle();
  }
  return {};
}

Result<void> draw(StreamClient& client, double seconds, LiveView& view) {
  Screen screen;
  auto drawn = Clock::now() - kRedraw;
  return follow(
      client, seconds,
      [&](const std::string& line) { view.take(nlohmann::json::parse(line, nullptr, false)); },
      [&] {
        if (Clock::now() - drawn < kRedraw) return;
        drawn = Clock::now();
        screen.draw(view);
      });
}

Result<void> narrate_all(StreamClient& client, double seconds) {
  fmt::print("{}\n", narrate(client.version()));
  std::fflush(stdout);
  std::string state;  // comes every second; told when it is another
  return follow(
      client, seconds,
      [&](const std::string& line) {
        const auto document = nlohmann::json::parse(line, nullptr, false);
        const std::string text = narrate(document);
        if (text.empty()) return;
        if (text_of(document, "type") == "state" && std::exchange(state, text) == text) return;
        fmt::print("{}  {}\n", document.is_object() ? printable(text_of(document, "t_utc")) : "",
                   text);
        std::fflush(stdout);
      },
      [] {});
}

Result<void> copy(StreamClient& client, double seconds) {
  fmt::print("{}\n", client.version_line());
  std::fflush(stdout);
  return follow(
      client, seconds,
      [](const std::string& line) {
        fmt::print("{}\n", line);
        std::fflush(stdout);
      },
      [] {});
}

}  // namespace

int watch(const Common& common, const WatchOptions& options) {
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  count_interrupts();
  Result<void> outcome;
  if (common.json) {
    outcome = copy(*client, options.seconds);
  } else if (stdout_is_terminal()) {
    LiveView view;
    view.take(client->version());
    outcome = draw(*client, options.seconds, view);
    for (const std::string& line : view.lines(terminal_width(), terminal_height())) {
      fmt::print("{}\n", line);
    }
  } else {
    outcome = narrate_all(*client, options.seconds);
  }
  return outcome ? kOk : unreachable(common, outcome.error());
}

}  // namespace shaker::cli
