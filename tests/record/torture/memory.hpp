// Simulates a lack of memory: the n-th allocation fails, of operator new or of SQLite.
#pragma once

#include <cstdint>

namespace shaker::record::torture {

struct Memory {
  static void install();  // before SQLite is used, or it closes SQLite
  // The n-th allocation from now on fails; with `for_good` all later ones fail too. 0 stops
  // this.
  static void fail_at(std::int64_t n, bool for_good);
  static bool reached();
};

}  // namespace shaker::record::torture
