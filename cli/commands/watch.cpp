// Shows the stream of documents: a table on a terminal, otherwise one line for each document.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/commands/daemon_error.hpp"
#include "cli/live_view.hpp"
#include "cli/terminal.hpp"
#include "cli/watched_socket.hpp"

namespace shaker::cli {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kRedraw = std::chrono::milliseconds(200);
constexpr auto kReconnect = std::chrono::milliseconds(250);

int terminal_height() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row >= 5 ? size.ws_row - 1 : 23;
}

// The alternate screen of the terminal; the destructor restores the normal screen.
class Screen {
 public:
  Screen() { fmt::print("\x1b[?1049h\x1b[?25l"); }
  ~Screen() {
    fmt::print("\x1b[?25h\x1b[?1049l");
    std::fflush(stdout);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  // An alarm is visible without colour too: by reverse video and its word.
  static std::string styled(const LiveView::Line& line) {
    switch (line.style) {
      case LiveView::Style::alarm:
        return "\x1b[1;7;31m" + line.text + "\x1b[0m";
      case LiveView::Style::warning:
        return "\x1b[1m" + line.text + "\x1b[0m";
      case LiveView::Style::plain:
        break;
    }
    return line.text;
  }

  static void bell() { fmt::print("\a"); }

  void draw(const LiveView& view) {
    std::string text = "\x1b[H";
    for (const LiveView::Line& line : view.lines(terminal_width(), terminal_height()))
      text += styled(line) + "\x1b[K\r\n";
    fmt::print("{}\x1b[J", text);
    std::fflush(stdout);
  }
};

// Passes every line to `take` until the time is over or Ctrl-C comes.
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

// When the connection is lost, tries to connect again and shows this on the screen.
Result<void> draw(StreamClient& first, const Common& common, double seconds, LiveView& view) {
  Screen screen;
  auto drawn = Clock::now() - kRedraw;
  const auto begin = Clock::now();
  const auto left = [&] {
    return seconds <= 0.0
               ? 0.0
               : std::max(1e-3,
                          seconds - std::chrono::duration<double>(Clock::now() - begin).count());
  };
  const auto redraw = [&] {
    if (Clock::now() - drawn < kRedraw) return;
    drawn = Clock::now();
    screen.draw(view);
  };
  std::optional<StreamClient> again;
  for (StreamClient* client = &first;;) {
    const auto outcome = follow(
        *client, left(),
        [&](const std::string& line) {
          if (view.take(nlohmann::json::parse(line, nullptr, false))) Screen::bell();
        },
        redraw);
    if (outcome) return {};  // the time is over, or Ctrl-C
    view.set_lost(outcome.error().what);
    for (again.reset(); !again && interrupts() == 0;) {
      if (seconds > 0.0 && Clock::now() - begin > std::chrono::duration<double>(seconds)) return {};
      redraw();
      std::this_thread::sleep_for(kReconnect);
      if (auto found = connect_to_watch(common.socket)) again = std::move(*found);
    }
    if (!again) return {};
    client = &*again;
    view.take(client->version());
  }
}

Result<void> narrate_all(StreamClient& client, double seconds) {
  fmt::print("{}\n", narrate(client.version()));
  std::fflush(stdout);
  std::string state;  // published every second; printed only when it has changed
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
  auto client = connect_to_watch(common.socket);
  if (!client) return unreachable(common, client.error());
  count_interrupts();
  Result<void> outcome;
  if (common.json) {
    outcome = copy(*client, options.seconds);
  } else if (stdout_is_terminal()) {
    LiveView view;
    view.take(client->version());
    outcome = draw(*client, common, options.seconds, view);
    for (const LiveView::Line& line : view.lines(terminal_width(), terminal_height()))
      fmt::print("{}\n", line.text);
  } else {
    outcome = narrate_all(*client, options.seconds);
  }
  return outcome ? kOk : unreachable(common, outcome.error());
}

}  // namespace shaker::cli
