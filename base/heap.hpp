// Settings of the process's heap.
#pragma once

namespace shaker {

// Keeps up to 64 MB of freed memory instead of returning it to the system each time. If large
// arrays are allocated and freed often, new pages cost more than filling them. Affects the
// whole process: call it in a program's main path only, before there are threads.
void keep_freed_memory();

}  // namespace shaker
