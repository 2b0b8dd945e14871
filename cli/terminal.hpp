// Properties of the output terminal, and the counting of interrupts.
#pragma once

#include <string>
#include <termios.h>
#include <vector>

namespace shaker::cli {

bool stdout_is_terminal();
int terminal_width();  // 80 when unknown

// The first `width` characters of UTF-8 text.
std::string clipped(const std::string& text, int width);

// The text in lines of at most `width` characters, broken at spaces; all but the first are
// indented. A word that is longer than a line is cut.
std::vector<std::string> wrapped(const std::string& text, int width);

// The text, or as many of its entries (", ") as fit into `width`, and "...".
std::string fitted(const std::string& text, int width);

// "[#########.......]  56 %"
std::string progress_bar(double fraction, int width);

// Reads single keys while it lives, without Enter, if standard input is a terminal and this program
// is in its foreground; Ctrl-C still is a signal. The destructor restores the terminal.
class Keys {
 public:
  explicit Keys(bool wanted);
  ~Keys();
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  char pressed() const;  // 0: none. Never waits.

 private:
  termios before_{};
  bool on_ = false;
};

// SIGINT (Ctrl-C) and SIGTERM are counted and do not end the program; they interrupt a wait
// (EINTR). SIGPIPE ends the program, as is usual for a filter.
void count_interrupts();
int interrupts();

}  // namespace shaker::cli
