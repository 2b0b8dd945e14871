// Writes campaigns of the dirty world: tests/dirty/README.md.
//
//   dirty_campaigns FOLDER SEED INDEX...
#include <cstdio>
#include <exception>
#include <string>

#include "tests/dirty/write.hpp"

int main(int count, char** words) {
  if (count < 4) {
    std::fputs("Usage: dirty_campaigns FOLDER SEED INDEX...\n", stderr);
    return 2;
  }
  try {
    const std::uint64_t seed = std::stoull(words[2]);
    for (int i = 3; i < count; ++i)
      shaker::dirty::write_campaign(shaker::dirty::drawn(seed, std::stol(words[i])), words[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dirty_campaigns: %s\n", error.what());
    return 1;
  }
  return 0;
}
