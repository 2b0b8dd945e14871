#include "daemon/service/supervision.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

// A read waits 50 ms and a device at most its response timeout; a connection may take a few of
// these.
constexpr auto kDevice = 5s;
constexpr auto kEngine = 2s;      // its ticks are 5 ms; the heartbeat has been withheld by then
constexpr auto kEstimator = 60s;  // a fit takes milliseconds; the rig has ramped down by then
constexpr auto kDisk = 20s;       // a failing disk retries for long; the rig has stopped by then

constexpr auto kHeard = 1s;           // clients that cannot be heard cannot stop the rig
constexpr auto kEstimatorSlow = 10s;  // the watchdog waits longer, so that the ramp comes first

}  // namespace

std::string stuck(const Progress& progress, Nanoseconds now) {
  if (now - progress.acquisition > kDevice) return "The acquisition has not advanced for 5 s.";
  if (now - progress.engine > kEngine) return "The engine has not advanced for 2 s.";
  if (now - progress.exciter > kDevice) return "The exciter's thread has not advanced for 5 s.";
  if (progress.estimator_busy && now - *progress.estimator_busy > kEstimator) {
    return "The estimator has been busy with one cycle for 60 s.";
  }
  if (!progress.recorder_idle && now - progress.recorder > kDisk) {
    return "The recorder has been writing for 20 s.";
  }
  return {};
}

std::optional<EndOfMotion> must_end(const Helpers& helpers, Nanoseconds now) {
  if (now - helpers.clients > kHeard) {
    return EndOfMotion{"clients_unheard",
                       "no client can be heard: the thread that listens to them has not advanced "
                       "for 1 s, so nobody could stop the rig"};
  }
  if (helpers.estimator_busy && now - *helpers.estimator_busy > kEstimatorSlow) {
    return EndOfMotion{"estimator_stuck",
                       "the estimator has been busy with one cycle for 10 s; the cycles are on "
                       "disk, estimate them with shakerctl"};
  }
  return std::nullopt;
}

}  // namespace shaker::daemon
