#include "daemon/service/service.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <optional>
#include <thread>

#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <system_error>
#include <systemd/sd-daemon.h>
#include <systemd/sd-event.h>

#include "base/program_places.hpp"
#include "daemon/engine.hpp"
#include "daemon/publish/commands.hpp"
#include "daemon/publish/event_loop.hpp"
#include "daemon/publish/listener.hpp"
#include "daemon/publish/recorder.hpp"
#include "daemon/publish/stream_server.hpp"
#include "daemon/service/deadman_file.hpp"
#include "daemon/service/engine_control.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/onlookers.hpp"
#include "daemon/service/provenance.hpp"
#include "daemon/service/recovery_report.hpp"
#include "daemon/service/rig_thread.hpp"
#include "daemon/service/supervision.hpp"
#include "daemon/workers/diagnosis_thread.hpp"
#include "daemon/workers/estimator_thread.hpp"
#include "daemon/workers/exciter_thread.hpp"
#include "daemon/workers/thread_name.hpp"
#include "record/recovery.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kServiceTick = 5ms;
constexpr int kClientsNice = 5;              // lower priority than all other threads
constexpr Nanoseconds kRampDownMargin = 5s;  // beyond the ramp, at the end of the process

void must(int code, const char* what) {
  if (code < 0) throw std::system_error(-code, std::generic_category(), what);
}

std::uint64_t microseconds(Nanoseconds t) {
  return static_cast<std::uint64_t>(t.count() / 1000);
}

ExciterOptions exciter_options(const config::RigConfig& rig) {
  ExciterOptions options;
  options.heartbeat_period = from_seconds(rig.exciter.heartbeat_period_s);
  return options;
}

}  // namespace

// Members in order of construction: the stream is destroyed early; the recorder writes its last
// documents after the exciter has been stopped.
struct Service::Parts {
  Parts(const Options& options, const config::RigConfig& config, drivers::Devices devices,
        Clock& the_clock);
  ~Parts() { exciter.watch({}); }  // it outlives the watched threads

  Result<void> listen(const Options& options);
  void recover();
  void attach();
  void watch();
  void publish();
  void tick();
  void keep_deadman_proof();
  void ping_watchdog(Nanoseconds now);
  void end(int signal);
  void end_when_quiet(Nanoseconds now);
  void complete(protocol::HealthDocument& health);

  config::RigConfig rig;
  Clock& clock;
  EventLoop loop;
  Waker waker;       // of the engine's thread
  Waker lines_wait;  // of this one
  WaveBox waves;
  Recorder recorder;
  ExciterThread exciter;
  EstimatorThread estimator;
  DiagnosisThread diagnosis;
  Sensors sensors;
  Engine engine;
  RigThread rig_thread;
  DiagnosisDesk desk;
  EngineControl control;
  Commands commands;
  StreamServer server;
  Onlookers onlookers;

  DeadmanFile deadman_file;
  bool deadman_kept = false;
  Nanoseconds next_ping{}, ping_period{};
  bool was_stuck = false;
  std::optional<Nanoseconds> give_up_at;  // ending
  std::atomic<bool> checking{false};
  std::jthread checker;  // last member: ends before the objects that it uses
};

Service::Parts::Parts(const Options& options, const config::RigConfig& config,
                      drivers::Devices devices, Clock& the_clock)
    : rig(config),
      clock(the_clock),
      loop([] {
        sd_event* made = nullptr;
        must(::sd_event_new(&made), "sd_event_new");
        return made;
      }()),
      recorder(
          {.directory = options.data,
           .rig = rig.name,
           .auxiliary = rig.auxiliary,
           .facts = facts_of_rig(rig, options.rig),
           .stall = from_seconds(rig.limits.recorder_stall_s) / 2,
           .waves = &waves},
          clock, [this] { lines_wait.wake(); },
          [this](protocol::HealthDocument& health) { complete(health); }),
      exciter(std::move(devices.exciter), clock, waker, exciter_options(rig)),
      estimator(clock, waker, &waves),
      diagnosis(lines_wait, program_places("shakerctl-diagnosis")),
      sensors([&] {
        Sensors made;
        for (auto& sensor : devices.sensors)
          made.push_back(std::make_unique<AcquisitionThread>(std::move(sensor), clock, waker));
        return made;
      }()),
      engine(rig, clock, exciter, estimator, recorder),
      rig_thread(engine, sensors, exciter, estimator, clock, waker),
      desk(diagnosis, recorder.directory(), checking),
      control(rig_thread, exciter, recorder, desk, rig.limits.excitation_max_m_s2),
      commands(control, clock, from_seconds(rig.client_lease_s)),
      server(loop.get(), clock, commands,
             protocol::VersionDocument{
                 "shakerd", program_version(), 1, rig.name,
                 protocol::LimitsEntry{rig.limits.stroke_min_m, rig.limits.stroke_max_m,
                                       rig.limits.stroke_rate_max_m_s,
                                       rig.limits.excitation_max_m_s2}}),
      onlookers(rig, sensors, waves, commands, control, server),
      deadman_file(recorder.directory(), options.rig) {
  if (const auto kept = deadman_file.load()) {
    deadman_kept = true;
    rig_thread.tell([seen = *kept](Engine& told) { told.trust_deadman(seen); });
  }
  watch();
  recover();
  std::uint64_t watchdog_us = 0;
  if (::sd_watchdog_enabled(0, &watchdog_us) > 0) {
    ping_period = std::chrono::microseconds(watchdog_us / 2);
  }
}

// The socket that commands comes last: whoever reaches it finds the others too.
Result<void> Service::Parts::listen(const Options& options) {
  auto inherited = inherited_sockets();
  for (InheritedSocket& socket : inherited)
    server.add_listener(std::move(socket.fd), socket.read_only);
  if (options.view_socket) {
    auto made = listen_unix(*options.view_socket, "--view-socket", "shaker-view");
    if (!made) return made.error();
    server.add_listener(std::move(*made), true);
  }
  if (options.tcp) {
    auto made = listen_tcp(*options.tcp);
    if (!made) return made.error();
    spdlog::info("Clients listen on 127.0.0.1:{}.", bound_port(*made));
    server.add_listener(std::move(*made), true);
  }
  if (inherited.empty()) {
    auto made = listen_unix(options.socket);
    if (!made) return made.error();
    server.add_listener(std::move(*made), false);
    spdlog::info("Clients connect to {}.", options.socket.string());
  }
  return {};
}

// Lists the unfinished files of an earlier daemon before anything is recorded, and checks them
// on a thread of its own (a second for each gigabyte).
void Service::Parts::recover() {
  auto files = record::interrupted(recorder.directory());
  if (files.empty()) return;
  checking = true;
  checker = std::jthread([this, files = std::move(files)] {
    name_this_thread("recovery");
    const auto check = [this](const std::filesystem::path& file) {
      return record::recover_one(file, format_utc(clock.utc()));
    };
    const auto tell = [this](const protocol::AlarmDocument& alarm) {
      rig_thread.tell([alarm](Engine& told) { told.publish(alarm); });
    };
    for (const auto& file : files)
      report_recovery(file, check, tell);
    checking = false;
  });
}

// Without these three the motion of the table would be unobserved or unrecorded.
void Service::Parts::watch() {
  std::vector<Watched> watched;
  watched.push_back({"the engine", from_seconds(rig.limits.engine_stall_s),
                     [this] { return rig_thread.last_progress(); }});
  for (const auto& sensor : sensors) {
    watched.push_back({"the acquisition", from_seconds(rig.limits.acquisition_stall_s),
                       [&sensor] { return sensor->last_progress(); }});
  }
  watched.push_back({"the recorder", from_seconds(rig.limits.recorder_stall_s),
                     [this] { return recorder.last_progress(); }});
  exciter.watch(std::move(watched));
}

void Service::Parts::attach() {
  must(::sd_event_add_io(
           loop.get(), nullptr, lines_wait.fd(), EPOLLIN,
           [](sd_event_source*, int, std::uint32_t, void* self) {
             auto& parts = *static_cast<Parts*>(self);
             parts.lines_wait.clear();
             parts.publish();
             return 0;
           },
           this),
       "sd_event_add_io");
  // Accuracy 1 us: by default the kernel may be late by 250 ms.
  must(::sd_event_add_time(
           loop.get(), nullptr, CLOCK_MONOTONIC, microseconds(clock.now() + kServiceTick), 1,
           [](sd_event_source* source, std::uint64_t due_us, void* self) {
             auto& parts = *static_cast<Parts*>(self);
             parts.tick();
             const std::uint64_t next =
                 std::max(due_us + microseconds(kServiceTick), microseconds(parts.clock.now()));
             ::sd_event_source_set_time(source, next);
             ::sd_event_source_set_enabled(source, SD_EVENT_ONESHOT);
             return 0;
           },
           this),
       "sd_event_add_time");
  for (const int signal : {SIGTERM, SIGINT}) {
    must(::sd_event_add_signal(
             loop.get(), nullptr, signal,
             [](sd_event_source*, const signalfd_siginfo* info, void* self) {
               static_cast<Parts*>(self)->end(static_cast<int>(info->ssi_signo));
               return 0;
             },
             this),
         "sd_event_add_signal");
  }
}

void Service::Parts::publish() {
  for (const auto& document : diagnosis.take()) {
    // These documents need not be kept: the files of the diagnosis are its record.
    rig_thread.tell([document](Engine& told) { told.publish(document); });
  }
  for (const auto& line : recorder.take())
    server.publish(line);
}

void Service::Parts::tick() {
  rig_thread.clients_are_heard();
  publish();
  commands.tick();
  rig_thread.set_client_count(server.client_count());
  onlookers.tick(clock.now());
  desk.watch(rig_thread.state());
  server.tick();
  keep_deadman_proof();
  ping_watchdog(clock.now());
  end_when_quiet(clock.now());
}

void Service::Parts::keep_deadman_proof() {
  const auto seen = rig_thread.deadman_seen();
  if (deadman_kept || !seen) return;
  deadman_kept = true;
  if (const auto saved = deadman_file.save(*seen, control.starter(), clock.utc()); !saved)
    spdlog::warn("{}", saved.error().what);
}

void Service::Parts::ping_watchdog(Nanoseconds now) {
  if (ping_period == 0ns || now < next_ping) return;
  Progress progress;
  progress.acquisition = now;
  for (const auto& sensor : sensors) {
    progress.acquisition = std::min(progress.acquisition, sensor->last_progress());
  }
  progress.engine = rig_thread.last_progress();
  progress.exciter = exciter.last_progress();
  progress.estimator_busy = estimator.busy_since();
  progress.recorder = recorder.last_progress();
  progress.recorder_idle = recorder.idle();
  const std::string trouble = stuck(progress, now);
  if (!trouble.empty()) {
    if (!was_stuck) spdlog::critical("{} The watchdog is not pinged.", trouble);
    was_stuck = true;
    return;
  }
  was_stuck = false;
  next_ping = now + ping_period;
  ::sd_notify(0, "WATCHDOG=1");
}

void Service::Parts::end(int signal) {
  if (give_up_at) {
    spdlog::warn("Asked to end a second time: the exciter is stopped at once.");
    exciter.emergency_stop();
    ::sd_event_exit(loop.get(), kGood);
    return;
  }
  ::sd_notify(0, "STOPPING=1\nSTATUS=Ramping down");
  spdlog::info("Asked to end (signal {}): ramping down.", signal);
  const Nanoseconds way_down = from_seconds(rig_thread.ramp_s()) + kRampDownMargin;
  give_up_at = clock.now() + way_down;
  // A campaign's ramp may be longer than systemd's default time limit.
  ::sd_notifyf(0, "EXTEND_TIMEOUT_USEC=%llu",
               static_cast<unsigned long long>(microseconds(way_down + kRampDownMargin)));
  control.close();
  diagnosis.cancel("The daemon ends.");
  if (const auto stopped = control.stop("the daemon's end"); !stopped) {
    spdlog::error("{}", stopped.error().what);
    exciter.emergency_stop();
  }
}

void Service::Parts::end_when_quiet(Nanoseconds now) {
  if (!give_up_at) return;
  const State state = rig_thread.state();
  const bool quiet = state == State::idle || state == State::fault;
  if (!quiet && now < *give_up_at) return;
  if (!quiet) spdlog::error("The rig did not ramp down in time; the exciter is stopped at once.");
  if (quiet && !recorder.idle() && now < *give_up_at) return;
  publish();
  ::sd_event_exit(loop.get(), kGood);
}

// Fills in the values that only the service knows. Called on the engine's thread.
void Service::Parts::complete(protocol::HealthDocument& health) {
  for (const auto& sensor : sensors)
    health.ring_overflows += sensor->overflows();
  health.log_drops = dropped_log_lines();
  health.exciter_connected = exciter.connected();
  health.loop_late_max_s = seconds(rig_thread.take_latest());
  health.disk_free_bytes = recorder.disk_free_bytes();
}

void Service::block_signals() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  sigaddset(&ends, SIGINT);
  ::pthread_sigmask(SIG_BLOCK, &ends, nullptr);
}

Service::Service(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Service::~Service() = default;

Result<std::unique_ptr<Service>> Service::make(const Options& options, const config::RigConfig& rig,
                                               drivers::Devices devices, Clock& clock) {
  auto parts = std::make_unique<Parts>(options, rig, std::move(devices), clock);
  if (auto listening = parts->listen(options); !listening) return listening.error();
  parts->attach();
  // Gives every client's snapshot a state, even before the first transition.
  parts->rig_thread.tell([](Engine& told) { told.publish(told.state_document()); });
  return std::unique_ptr<Service>(new Service(std::move(parts)));
}

int Service::run() {
  ::setpriority(PRIO_PROCESS, 0, kClientsNice);  // of this thread alone, on Linux
  ::sd_notifyf(0, "READY=1\nSTATUS=Rig %s is idle", parts_->rig.name.c_str());
  spdlog::info("shakerd {} is ready; rig {}.", program_version(), parts_->rig.name);
  const int status = ::sd_event_loop(parts_->loop.get());
  parts_->recorder.close_campaign();  // no effect if the engine has closed it
  spdlog::info("Ended.");
  return status < 0 ? kTrouble : status;
}

}  // namespace shaker::daemon
