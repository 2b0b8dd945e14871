// What a command knows about where its output goes.
#pragma once

#include <string>

namespace shaker::cli {

bool stdout_is_terminal();
int terminal_width();  // 80 when unknown

// At most `width` characters of UTF-8 text.
std::string clipped(const std::string& text, int width);

// "[#########.......]  56 %"
std::string progress_bar(double fraction, int width);

// Ctrl-C and SIGTERM are counted instead of killing; they interrupt waiting (EINTR). SIGPIPE kills,
// as people expect of a filter.
void count_interrupts();
int interrupts();

}  // namespace shaker::cli
