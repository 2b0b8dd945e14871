// Words of a DBC file, with the line on which each stands. Used by the parser only.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace shaker::protocol::can {

struct DbcToken {
  enum class Kind { word, number, text, mark, end };
  Kind kind = Kind::end;
  std::string_view text;  // of a text: what is between the quotes, escapes as they stand
  int line = 0;
  bool first_on_line = false;
  bool unterminated = false;  // a text that the end of the file cut off
};

// DBC files are written in whatever the tool's code page was: what is not valid UTF-8 is taken as
// Latin-1, so that "°C" survives either way. A byte order mark is dropped.
std::string to_utf8(std::string_view text);

// `text` must outlive the lexer and its tokens, and be valid UTF-8.
class DbcLexer {
 public:
  explicit DbcLexer(std::string_view text) : text_(text) {}
  DbcToken next();

 private:
  void skip_blanks();
  DbcToken take(DbcToken::Kind kind, std::size_t length);
  DbcToken quoted();

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  int last_token_line_ = 0;
};

}  // namespace shaker::protocol::can
