// Names the calling thread for `ps -L`, `top -H` and a debugger. `name` has at most 15
// characters.
#pragma once

#include <pthread.h>

namespace shaker::daemon {

inline void name_this_thread(const char* name) {
  ::pthread_setname_np(::pthread_self(), name);
}

}  // namespace shaker::daemon
