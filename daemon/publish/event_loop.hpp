// Owning pointers for objects of sd-event.
#pragma once

#include <memory>

#include <systemd/sd-event.h>

namespace shaker::daemon {

struct ReleaseEventLoop {
  void operator()(sd_event* loop) const { ::sd_event_unref(loop); }
};
using EventLoop = std::unique_ptr<sd_event, ReleaseEventLoop>;

// A source is disabled before its release, so that it makes no further calls.
struct ReleaseEventSource {
  void operator()(sd_event_source* source) const { ::sd_event_source_disable_unref(source); }
};
using EventSource = std::unique_ptr<sd_event_source, ReleaseEventSource>;

}  // namespace shaker::daemon
