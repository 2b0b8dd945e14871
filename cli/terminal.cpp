#include "cli/terminal.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <string_view>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace shaker::cli {
namespace {

// A global, because a signal handler can reach nothing else.
volatile std::sig_atomic_t g_interrupts = 0;

void on_interrupt(int) {
  g_interrupts = g_interrupts + 1;
}

}  // namespace

bool stdout_is_terminal() {
  return ::isatty(STDOUT_FILENO) == 1;
}

int terminal_width() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col >= 20) return size.ws_col;
  return 80;
}

std::string clipped(const std::string& text, int width) {
  int seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool starts = (static_cast<unsigned char>(text[i]) & 0xC0U) != 0x80U;
    if (starts && seen++ == width) return text.substr(0, i);
  }
  return text;
}

std::vector<std::string> wrapped(const std::string& text, int width) {
  constexpr int kLeastWidth = 10;
  const std::string indent = "  ";
  std::vector<std::string> lines;
  std::string rest = text;
  for (;;) {
    const std::string part = clipped(rest, std::max(width, kLeastWidth));
    if (part == rest) break;
    const std::size_t begins = lines.empty() ? 0 : indent.size();
    // A space right behind the part ends it as well.
    const auto space = rest.rfind(' ', part.size());
    const bool at_space = space != std::string::npos && space > begins;
    lines.push_back(rest.substr(0, at_space ? space : part.size()));
    rest = indent + rest.substr(at_space ? space + 1 : part.size());
  }
  lines.push_back(rest);
  return lines;
}

std::string fitted(const std::string& text, int width) {
  if (clipped(text, width) == text) return text;
  constexpr std::string_view kMore = ", ...";
  std::string part = clipped(text, width - static_cast<int>(kMore.size()) + 2);
  const auto comma = part.rfind(", ");
  if (comma == std::string::npos) return clipped(text, width);
  return part.substr(0, comma).append(kMore);
}

std::string progress_bar(double fraction, int width) {
  const double share = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  const int inner = std::max(4, width);
  const auto full = static_cast<std::size_t>(std::lround(share * inner));
  return fmt::format("[{}{}] {:3.0f} %", std::string(full, '#'),
                     std::string(static_cast<std::size_t>(inner) - full, '.'),
                     std::floor(100.0 * share));
}

namespace {

// A program in the background that reads or changes the terminal would be suspended.
bool stdin_is_ours() {
  return ::isatty(STDIN_FILENO) == 1 && ::tcgetpgrp(STDIN_FILENO) == ::getpgrp();
}

}  // namespace

Keys::Keys(bool wanted) {
  if (!wanted || !stdin_is_ours() || ::tcgetattr(STDIN_FILENO, &before_) != 0) return;
  termios single = before_;
  single.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  single.c_cc[VMIN] = 0;
  single.c_cc[VTIME] = 0;
  on_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &single) == 0;
}

Keys::~Keys() {
  if (on_ && stdin_is_ours()) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

char Keys::pressed() const {
  char key = 0;
  if (!on_ || !stdin_is_ours() || ::read(STDIN_FILENO, &key, 1) != 1) return 0;
  return key;
}

void count_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags =
      SA_RESTART;  // a line that is being printed goes on; poll returns with EINTR all the same
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

int interrupts() {
  return g_interrupts;
}

}  // namespace shaker::cli
