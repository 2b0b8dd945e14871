// The process's heap.
#pragma once

namespace shaker {

// Keeps up to 64 MB of freed memory instead of giving it back to the system each time: where large
// arrays come and go, taking their pages anew costs more than filling them. Of the whole process,
// so for a program's main path only, before it has threads.
void keep_freed_memory();

}  // namespace shaker
