// Memory that runs out: the n-th allocation fails, of operator new or of SQLite.
#pragma once

#include <cstdint>

namespace shaker::record::torture {

struct Memory {
  static void install();  // before SQLite is used: closes it when it was
  // The n-th allocation from now on fails, and all that follow when it is for good; 0: none.
  static void fail_at(std::int64_t n, bool for_good);
  static bool reached();
};

}  // namespace shaker::record::torture
