#include "sim/rig_server.hpp"

#include <algorithm>
#include <ctime>

namespace shaker::sim {
namespace {

constexpr std::uint32_t kAuxiliaryEvery = 10;  // samples; a bus of 1 Mbit/s has no capacity for all
constexpr Nanoseconds kStatusPeriod = std::chrono::milliseconds(20);

timespec until(Nanoseconds event, Nanoseconds now) {
  const auto wait = std::max(event - now, Nanoseconds(0)).count();
  return {static_cast<time_t>(wait / 1'000'000'000), static_cast<long>(wait % 1'000'000'000)};
}

}  // namespace

RigServer::RigServer(const RigOptions& options, std::vector<ScriptedFault> script)
    : start_(clock_.now()), rig_(options, start_), map_(rig_), script_(std::move(script)) {
  std::ranges::stable_sort(script_, {}, &ScriptedFault::at_s);
}

Result<void> RigServer::open_tcp(const std::string& address, int port) {
  auto face = ModbusFace::tcp(map_, rig_, address, port);
  if (!face) return face.error();
  modbus_.push_back(std::move(*face));
  return {};
}

Result<void> RigServer::open_pty(const std::string& link) {
  auto face = ModbusFace::pty(map_, rig_, link);
  if (!face) return face.error();
  modbus_.push_back(std::move(*face));
  return {};
}

Result<void> RigServer::open_can(const std::string& interface, bool auxiliary) {
  send_auxiliary_ = auxiliary;
  auto face = CanFace::open(interface);
  if (!face) return face.error();
  can_.emplace(std::move(*face));
  return {};
}

void RigServer::play_script(Nanoseconds now) {
  while (played_ < script_.size() && now >= start_ + from_seconds(script_[played_].at_s)) {
    rig_.inject(script_[played_++].fault);
  }
}

// Advances the rig to the present time and passes the new samples to Modbus and CAN.
void RigServer::catch_up() {
  const Nanoseconds now = clock_.now();
  samples_.clear();
  rig_.advance(now, samples_);
  play_script(now);
  for (const auto& sample : samples_) {
    if (sample.dropped) continue;
    map_.show(sample);
    if (can_) {
      can_->send(stroke_frame(sample), now);
      can_->send(table_frame(sample), now);
      if (send_auxiliary_ && sample.counter % kAuxiliaryEvery == 0) {
        for (std::size_t pair = 0; pair < kAuxiliaryMost / 2; ++pair)
          can_->send(auxiliary_frame(sample, pair), now);
      }
    }
  }
  if (can_ && now >= next_status_) {
    next_status_ = now + kStatusPeriod;
    if (rig_.injected() != Fault::exciter_silent) can_->send(status_frame(rig_.status()), now);
  }
}

Nanoseconds RigServer::next_event() const {
  Nanoseconds next = rig_.next_sample();
  if (played_ < script_.size()) {
    next = std::min(next, start_ + from_seconds(script_[played_].at_s));
  }
  return next;
}

void RigServer::run(int stop_fd) {
  std::vector<pollfd> wanted;
  while (true) {
    catch_up();
    wanted.assign(1, {stop_fd, POLLIN, 0});
    for (const auto& face : modbus_)
      face->watch(wanted);
    if (can_ && can_->descriptor() >= 0) wanted.push_back({can_->descriptor(), POLLIN, 0});
    const timespec wait = until(next_event(), clock_.now());
    if (ppoll(wanted.data(), wanted.size(), &wait, nullptr) <= 0) continue;
    if (wanted[0].revents != 0) return;
    for (const pollfd& ready : wanted) {
      if (ready.revents == 0) continue;
      catch_up();  // so that every answer uses the newest sample
      for (const auto& face : modbus_)
        face->serve(ready);
      if (can_ && ready.fd == can_->descriptor()) can_->receive(rig_, clock_.now());
    }
  }
}

}  // namespace shaker::sim
