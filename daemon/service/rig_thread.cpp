#include "daemon/service/rig_thread.hpp"

#include <algorithm>
#include <condition_variable>
#include <ctime>
#include <exception>
#include <optional>
#include <tuple>

#include <fmt/format.h>
#include <poll.h>

#include "daemon/service/supervision.hpp"
#include "daemon/workers/thread_name.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kTick = 5ms;
constexpr Nanoseconds kPaused = 100ms;
constexpr Nanoseconds kExcitersTurns = 100ms;
constexpr Nanoseconds kAnswer = 500ms;

}  // namespace

// A task of another thread, and its answer.
struct RigThread::Question {
  Task task, undo;
  std::mutex mutex;
  std::condition_variable answered;
  bool begun = false, given_up = false;
  std::optional<Result<void>> answer;
};

RigThread::RigThread(Engine& engine, Sensors& sensors, ExciterThread& exciter,
                     EstimatorThread& estimator, Clock& clock, Waker& waker)
    : engine_(engine),
      sensors_(sensors),
      exciter_(exciter),
      estimator_(estimator),
      clock_(clock),
      waker_(waker),
      progress_(clock.now().count()),
      heard_(clock.now().count()),
      shown_(std::make_shared<protocol::StateDocument>(engine.state_document())),
      healths_(sensors.size()),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

RigThread::~RigThread() {
  thread_.request_stop();
  waker_.wake();
  thread_.join();
}

Result<void> RigThread::ask(Task task, Task undo) {
  return wait_for_answer(std::move(task), std::move(undo), false);
}

Result<void> RigThread::ask_urgently(Task task) {
  return wait_for_answer(std::move(task), {}, true);
}

Result<void> RigThread::wait_for_answer(Task task, Task undo, bool urgent) {
  auto question = std::make_shared<Question>();
  question->task = std::move(task);
  question->undo = std::move(undo);
  {
    const std::lock_guard lock(mutex_);
    questions_.push_back(question);
  }
  waker_.wake();
  std::unique_lock lock(question->mutex);
  if (question->answered.wait_for(lock, kAnswer, [&] { return question->answer.has_value(); })) {
    return *question->answer;
  }
  const bool cannot_be_taken_back = question->begun && !question->undo;
  question->given_up = !urgent && !cannot_be_taken_back;
  return Error{
      ErrorKind::timeout,
      fmt::format("The engine does not answer within 0.5 s; the exciter is stopped without "
                  "it. {} Use the hardware stop if the table moves.",
                  question->given_up ? "The request is given up and takes no effect later."
                                     : "The request takes effect when it runs again.")};
}

void RigThread::tell(std::function<void(Engine&)> task) {
  auto question = std::make_shared<Question>();
  question->task = [task = std::move(task)](Engine& engine) {
    task(engine);
    return Result<void>();
  };
  {
    const std::lock_guard lock(mutex_);
    questions_.push_back(std::move(question));
  }
  waker_.wake();
}

protocol::StateDocument RigThread::state_document() const {
  std::shared_ptr<const protocol::StateDocument> shown;
  {
    const std::lock_guard lock(mutex_);
    shown = shown_;
  }
  return *shown;
}

std::optional<Engine::DeadmanSeen> RigThread::deadman_seen() const {
  const std::lock_guard lock(mutex_);
  return deadman_seen_;
}

// --- the thread

void RigThread::work(const std::stop_token& stop) {
  name_this_thread("engine");
  Nanoseconds due = clock_.now() + kTick;
  while (!stop.stop_requested()) {
    wait(due);
    // No exception may leave a thread, for example for lack of memory. The engine's work is
    // then incomplete, so motion must not continue.
    try {
      serve(due);
    } catch (const std::exception&) {
      exciter_.emergency_stop();  // allocates nothing
      threw_ = true;
    }
  }
}

void RigThread::serve(Nanoseconds& due) {
  if (threw_) {
    engine_.on_heartbeat_withheld(
        "the engine was interrupted by an error of this program or by want of memory; the exciter "
        "was stopped at once");
    threw_ = false;
  }
  if (clock_.now() - due > kPaused) hear_the_exciter_first();
  drain_sensors();
  drain_workers();
  answer();
  const Nanoseconds now = clock_.now();
  if (now < due) return;
  late_max_ = std::max(late_max_.load(), (now - due).count());
  turn();
  due = std::max(due + kTick, clock_.now());
}

// After a pause of the whole process, the accumulated samples show a table that the dead-man
// has stopped. The exciter's thread reports the reason, so it gets a whole turn first: the one
// that the pause interrupted may have read an older status.
void RigThread::hear_the_exciter_first() {
  const Nanoseconds woken = clock_.now();
  Nanoseconds ended = woken;
  for (int turns = 0; turns < 2 && clock_.now() - woken < kExcitersTurns;) {
    std::this_thread::sleep_for(1ms);
    const Nanoseconds last = exciter_.last_progress();
    turns += last > ended ? 1 : 0;
    ended = std::max(ended, last);
  }
  drain_workers();
}

// Waits until `due` or until a worker wakes this thread.
void RigThread::wait(Nanoseconds due) {
  const Nanoseconds left = std::max(due - clock_.now(), Nanoseconds{0});
  pollfd wakes{waker_.fd(), POLLIN, 0};
  const timespec span{.tv_sec = left / 1s, .tv_nsec = (left % 1s).count()};
  if (::ppoll(&wakes, 1, &span, nullptr) > 0) waker_.clear();
}

void RigThread::turn() {
  watch_the_others();
  engine_.set_client_count(clients_);
  engine_.tick();
  show_state();
  progress_ = clock_.now().count();
}

void RigThread::drain_sensors() {
  bool news = false;
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    AcquisitionThread& sensor = *sensors_[i];
    while (const std::size_t count = sensor.drain(samples_)) {
      engine_.on_samples(std::span(samples_).first(count));
    }
    auto report = sensor.report();
    for (const Error& error : report.errors)
      engine_.on_sensor_error(error);
    if (!report.health) continue;
    healths_[i] = std::move(*report.health);
    news = true;
  }
  if (!news) return;
  drivers::SensorHealth all;  // sum over the rig's sensors
  all.link_up = true;
  for (const auto& health : healths_) {
    all.samples += health.samples;
    all.lost += health.lost;
    all.malformed += health.malformed;
    all.errors += health.errors;
    all.reconnects += health.reconnects;
    all.link_up = all.link_up && health.link_up;
    if (all.trouble.empty()) all.trouble = health.trouble;
  }
  engine_.on_sensor_health(all, sensors_.front()->stamp_source());
}

void RigThread::drain_workers() {
  for (const auto& news : exciter_.take()) {
    if (const auto* status = std::get_if<drivers::ExciterStatus>(&news)) {
      engine_.on_exciter_status(*status);
    } else if (const auto* withheld = std::get_if<ExciterThread::Withheld>(&news)) {
      engine_.on_heartbeat_withheld(withheld->why);
    } else if (const auto* late = std::get_if<ExciterThread::Late>(&news)) {
      engine_.on_late_heartbeat(seconds(late->gap));
    } else {
      engine_.on_exciter_error(std::get<Error>(news));
    }
  }
  for (const auto& outcome : estimator_.take())
    engine_.on_estimate(outcome);
}

void RigThread::watch_the_others() {
  const auto reason =
      must_end({.clients = Nanoseconds(heard_.load()), .estimator_busy = estimator_.busy_since()},
               clock_.now());
  if (reason) engine_.end_motion(reason->code, reason->why);
}

// Takes the questions one by one, so that an exception of one loses no other.
void RigThread::answer() {
  for (std::size_t left = questions(); left > 0; --left) {
    std::shared_ptr<Question> question;
    {
      const std::lock_guard lock(mutex_);
      question = std::move(questions_.front());
      questions_.pop_front();
    }
    {
      const std::lock_guard lock(question->mutex);
      if (question->given_up) continue;
      question->begun = true;
    }
    auto said = question->task(engine_);
    show_state();
    if (!answer(*question, said) && said) {
      std::ignore = question->undo(engine_);
      show_state();
    }
  }
}

// Returns false if nobody waits for the answer any more.
bool RigThread::answer(Question& question, const Result<void>& said) {
  const std::lock_guard lock(question.mutex);
  if (question.given_up) return false;
  question.answer = said;
  question.answered.notify_one();
  return true;
}

std::size_t RigThread::questions() const {
  const std::lock_guard lock(mutex_);
  return questions_.size();
}

void RigThread::show_state() {
  auto shown = std::make_shared<const protocol::StateDocument>(engine_.state_document());
  ramp_s_ = engine_.ramp_s();
  const std::lock_guard lock(mutex_);
  deadman_seen_ = engine_.deadman_seen();
  shown_.swap(shown);
}

}  // namespace shaker::daemon
