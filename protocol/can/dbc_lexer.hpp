// Splits a DBC file into tokens with their line numbers. Used by the parser only.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace shaker::protocol::can {

struct DbcToken {
  enum class Kind { word, number, text, mark, end };
  Kind kind = Kind::end;
  std::string_view text;  // of a text: between the quotes, with its escapes unchanged
  int line = 0;
  bool first_on_line = false;
  bool unterminated = false;  // a text cut off by the end of the file
};

// Converts to UTF-8. DBC files use the code page of their tool: text that is not valid UTF-8 is
// read as Latin-1, so that "°C" is preserved in both cases. A byte order mark is removed.
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
