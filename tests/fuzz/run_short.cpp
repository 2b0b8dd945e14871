// Runs a fuzz target for a short time, always in the same way: every seed file unchanged, then
// mutated.
//
// Usage: TARGET MUTATIONS SEED_FILE...    For long runs build with -DSHAKER_FUZZ=ON (README.md).
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "tests/fuzz/target.hpp"

namespace {

using Bytes = std::vector<std::uint8_t>;

class Mutator {
 public:
  Bytes mutate(Bytes bytes, const Bytes& other) {
    for (auto count = 1 + below(6); count > 0; --count)
      step(bytes, other);
    return bytes;
  }

 private:
  std::size_t below(std::size_t bound) { return bound == 0 ? 0 : draw_() % bound; }
  Bytes::iterator somewhere(Bytes& bytes) {
    return bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() + 1));
  }
  void step(Bytes& bytes, const Bytes& other) {
    const auto length = static_cast<std::ptrdiff_t>(below(40));
    const auto at = somewhere(bytes);
    const auto left = std::min<std::ptrdiff_t>(length, bytes.end() - at);
    switch (below(6)) {
      case 0:  // flip a bit
        if (at != bytes.end()) *at ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 1:  // set any byte
        if (at != bytes.end()) *at = static_cast<std::uint8_t>(below(256));
        break;
      case 2:
        bytes.erase(at, at + left);
        break;
      case 3: {  // repeat a piece
        const Bytes piece(at, at + left);
        bytes.insert(somewhere(bytes), piece.begin(), piece.end());
        break;
      }
      case 4: {  // insert a piece of another seed
        const auto from = below(other.size() + 1);
        const auto size = std::min(static_cast<std::size_t>(length), other.size() - from);
        const auto begin = other.begin() + static_cast<std::ptrdiff_t>(from);
        bytes.insert(at, begin, begin + static_cast<std::ptrdiff_t>(size));
        break;
      }
      default:  // truncate, rarely
        if (below(8) == 0) bytes.erase(at, bytes.end());
    }
  }
  std::mt19937_64 draw_{1991};
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const int mutations = std::atoi(argv[1]);
  std::vector<Bytes> seeds;
  for (int i = 2; i < argc; ++i) {
    std::ifstream file(argv[i], std::ios::binary);
    if (!file) {
      std::fprintf(stderr, "cannot read the seed %s\n", argv[i]);
      return 2;
    }
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  for (const Bytes& seed : seeds)
    LLVMFuzzerTestOneInput(seed.data(), seed.size());
  Mutator mutator;
  for (int i = 0; i < mutations; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const Bytes bytes = mutator.mutate(seeds[n % seeds.size()], seeds[n / 7 % seeds.size()]);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::printf("%zu seeds, %d mutations\n", seeds.size(), mutations);
}
