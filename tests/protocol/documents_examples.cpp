#include "tests/protocol/documents_examples.hpp"

#include <iostream>

int main() {
  using namespace shaker::protocol;
  std::uint64_t seq = 0;
  for (const Document& document : testing::nasty_documents()) {
    std::cout << to_json_line(document, {++seq, "2026-03-01T12:00:00.123Z", 123456789}) << '\n';
  }
}
