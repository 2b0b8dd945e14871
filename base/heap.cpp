#include "base/heap.hpp"

#include <malloc.h>

namespace shaker {

void keep_freed_memory() {
  constexpr int kKept = 64 << 20,
                kApart = 32 << 20;  // larger blocks are returned to the system
  mallopt(M_TRIM_THRESHOLD, kKept);
  mallopt(M_MMAP_THRESHOLD, kApart);
}

}  // namespace shaker
