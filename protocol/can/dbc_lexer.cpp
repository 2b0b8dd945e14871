#include "protocol/can/dbc_lexer.hpp"

#include <algorithm>

namespace shaker::protocol::can {
namespace {

bool digit(char c) {
  return c >= '0' && c <= '9';
}
bool letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

// Length of the UTF-8 sequence at the front of `text`; 0 if it is invalid (also for overlong
// forms, which strict readers of a quoting document would refuse).
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto follows = [&](std::size_t count) {
    if (text.size() <= count) return false;
    for (std::size_t i = 1; i <= count; ++i) {
      if ((byte(i) & 0xC0) != 0x80) return false;
    }
    return true;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    if (!follows(2) || (first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) > 0x9F)) {
      return 0;
    }
    return 3;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    if (!follows(3) || (first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) > 0x8F)) {
      return 0;
    }
    return 4;
  }
  return 0;
}

bool valid_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

// A sign belongs to a number only if a digit follows at once: not in "@1+ (0.1,0)".
std::size_t number_length(std::string_view text) {
  std::size_t i = text[0] == '+' || text[0] == '-' ? 1 : 0;
  const std::size_t first = i;
  bool digits = false;
  for (; i < text.size() && (digit(text[i]) || text[i] == '.'); ++i)
    digits |= digit(text[i]);
  if (!digits || i == first) return 0;
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    std::size_t j = i + 1;
    if (j < text.size() && (text[j] == '+' || text[j] == '-')) ++j;
    if (j < text.size() && digit(text[j])) {
      for (i = j; i < text.size() && digit(text[i]);)
        ++i;
    }
  }
  return i;
}

}  // namespace

std::string to_utf8(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (valid_utf8(text)) return std::string(text);
  std::string utf8;
  utf8.reserve(text.size() + text.size() / 8);
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      utf8 += c;
    } else {
      utf8 += static_cast<char>(0xC0 | byte >> 6);
      utf8 += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return utf8;
}

void DbcLexer::skip_blanks() {
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '\n') {
      ++line_;
    } else if (c == '/' && text_.substr(at_).starts_with("//")) {
      at_ = std::min(text_.find('\n', at_), text_.size());
      continue;
    } else if (c != ' ' && c != '\t' && c != '\r' && c != '\v' && c != '\f') {
      return;
    }
    ++at_;
  }
}

DbcToken DbcLexer::take(DbcToken::Kind kind, std::size_t length) {
  DbcToken token{kind, text_.substr(at_, length), line_, line_ != last_token_line_, false};
  last_token_line_ = line_;
  at_ += length;
  return token;
}

// A quote after a backslash does not end a text; a text may contain line ends.
DbcToken DbcLexer::quoted() {
  std::size_t end = at_ + 1;
  while (end < text_.size() && text_[end] != '"')
    end += text_[end] == '\\' ? 2 : 1;
  const bool unterminated = end >= text_.size();
  end = std::min(end, text_.size());
  DbcToken token = take(DbcToken::Kind::text, end - at_ + (unterminated ? 0 : 1));
  token.unterminated = unterminated;
  for (const char c : token.text)
    line_ += c == '\n' ? 1 : 0;
  last_token_line_ = line_;
  token.text.remove_prefix(1);
  if (!unterminated) token.text.remove_suffix(1);
  return token;
}

DbcToken DbcLexer::next() {
  skip_blanks();
  if (at_ >= text_.size()) return take(DbcToken::Kind::end, 0);
  const char c = text_[at_];
  if (c == '"') return quoted();
  if (letter(c)) {
    std::size_t end = at_;
    while (end < text_.size() && (letter(text_[end]) || digit(text_[end])))
      ++end;
    return take(DbcToken::Kind::word, end - at_);
  }
  if (const std::size_t length = number_length(text_.substr(at_)); length > 0) {
    return take(DbcToken::Kind::number, length);
  }
  return take(DbcToken::Kind::mark, std::max<std::size_t>(1, utf8_length(text_.substr(at_))));
}

}  // namespace shaker::protocol::can
