// First pass over a DBC file: reads its sections in order, without connecting them. Used by
// parse_dbc only.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/can/database.hpp"
#include "protocol/can/dbc_lexer.hpp"

namespace shaker::protocol::can {

// Thrown within parse_dbc, which converts it to an Error.
struct DbcSyntaxError {
  int line;
  std::string what;
};

// A statement of a section about a message that may not have been read yet.
struct About {
  int line = 0;
  std::uint64_t id = 0;  // as written, with bit 31
  std::string signal;
};
struct ValueType : About {
  NumberFormat format = NumberFormat::float32;
};
struct MultiplexedBy : About {
  std::string multiplexor;
  std::vector<Multiplexing::Range> ranges;
};
struct CycleTime : About {
  double milliseconds = 0.0;
};
struct SignalSource {
  int line = 0;
  std::optional<std::uint64_t> selected_by;  // N of "mN"
};
struct MessageSource {
  int line = 0;
  std::vector<SignalSource> signals;
};

// `text` must be valid UTF-8 and outlive the reader.
class DbcReader {
 public:
  explicit DbcReader(std::string_view text) : lexer_(text), token_(lexer_.next()) {}

  void read_all() {
    while (token_.kind != DbcToken::Kind::end)
      read_section();
  }

  std::vector<Message> messages;
  std::vector<MessageSource> sources;  // for each of `messages`
  std::map<std::uint64_t, std::size_t> by_id;
  std::map<std::string, int, std::less<>> line_of_name;
  std::vector<ValueType> value_types;
  std::vector<MultiplexedBy> multiplexed_by;
  std::vector<CycleTime> cycle_times;
  double default_cycle_ms = 0.0;

 private:
  void read_section();
  void read_message();
  void check_message(Message& message, std::uint64_t id, std::uint64_t size, int line);
  void read_signal(Message* message, MessageSource* source);
  void read_multiplexor_mark(Signal& signal, SignalSource& source);
  void skip_receivers();
  void read_bits(Signal& signal, int line, const Message* message);
  void read_scaling(Signal& signal);
  void read_value_type();
  void read_multiplexed_by();
  void read_attribute();
  void read_attribute_default();
  void skip_new_symbols();
  void skip_section();

  std::string found() const;
  [[noreturn]] void expected(const std::string& what) const;
  DbcToken take();
  bool at_mark(char c) const { return token_.kind == DbcToken::Kind::mark && token_.text[0] == c; }
  void mark(char c, const char* where);
  std::string word(const char* what);
  std::uint64_t whole(const char* what);
  double number(const char* what);

  DbcLexer lexer_;
  DbcToken token_;
};

}  // namespace shaker::protocol::can
