#include "mqtt/broker_link.hpp"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <mosquitto.h>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <netdb.h>
#include <sys/eventfd.h>
#include <system_error>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::mqtt {
namespace {

constexpr int kQos = 1;
constexpr int kPacketsInOneTurn = 20;

const char* remedy_for(int status) {
  switch (status) {
    case MOSQ_ERR_EAI:
      return "check the name in --broker";
    case MOSQ_ERR_TLS:
      return "check --ca-file, and that the certificate is for the name in --broker";
    case MOSQ_ERR_ERRNO:
    case MOSQ_ERR_CONN_LOST:
    case MOSQ_ERR_KEEPALIVE:
      return "check --broker, --port and --ca-file, and that the broker runs";
    default:
      return "look at the broker's log";
  }
}

}  // namespace

// One attempt to connect, and the connection that comes of it. Shared with the attempt's thread,
// which alone uses `client` until `attempted`.
struct BrokerLink::Session {
  struct Destroy {
    void operator()(mosquitto* one) const { mosquitto_destroy(one); }
  };
  std::unique_ptr<mosquitto, Destroy> client;
  UniqueFd wake{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::atomic<bool> attempted = false;
  int status = MOSQ_ERR_SUCCESS, code = 0;  // of the attempt

  // What libmosquitto reported in the last turn.
  std::optional<int> answer;  // to the request to connect; 0: accepted
  std::vector<int> confirmed;
  std::string last_error;

  bool accepted = false;
  std::map<int, std::uint64_t> tickets;  // by libmosquitto's number of a message

  static Session& of(void* self) { return *static_cast<Session*>(self); }
};

BrokerLink::BrokerLink(BrokerOptions options, Outbox& outbox, Clock& clock)
    : options_(std::move(options)), outbox_(outbox), clock_(clock) {
  mosquitto_lib_init();
}

BrokerLink::~BrokerLink() = default;

void BrokerLink::speak_for(std::string base) {
  base_ = std::move(base);
  retry_at_ = clock_.now();
}

pollfd BrokerLink::waits_for() const {
  if (!session_) return {-1, 0, 0};
  if (!session_->attempted) return {session_->wake.get(), POLLIN, 0};
  mosquitto* client = session_->client.get();
  const bool writes = mosquitto_want_write(client);
  return {mosquitto_socket(client), static_cast<short>(writes ? POLLIN | POLLOUT : POLLIN), 0};
}

void BrokerLink::begin_attempt() {
  auto session = std::make_shared<Session>();
  if (!session->wake.valid()) throw std::system_error(errno, std::generic_category(), "eventfd");
  const std::string id = "shakerd-mqtt-" + base_, will = base_ + "/bridge";
  session->client.reset(mosquitto_new(id.c_str(), true, session.get()));
  mosquitto* client = session->client.get();
  if (client == nullptr) throw std::system_error(errno, std::generic_category(), "mosquitto_new");
  mosquitto_connect_callback_set(
      client, [](mosquitto*, void* self, int answer) { Session::of(self).answer = answer; });
  mosquitto_publish_callback_set(client, [](mosquitto*, void* self, int number) {
    Session::of(self).confirmed.push_back(number);
  });
  mosquitto_log_callback_set(client, [](mosquitto*, void* self, int level, const char* text) {
    if (level == MOSQ_LOG_ERR) Session::of(self).last_error = text;
  });
  int status = mosquitto_will_set(client, will.c_str(), 7, "offline", kQos, true);
  if (status == MOSQ_ERR_SUCCESS && !options_.user.empty())
    status =
        mosquitto_username_pw_set(client, options_.user.c_str(),
                                  options_.password.empty() ? nullptr : options_.password.c_str());
  if (status == MOSQ_ERR_SUCCESS && !options_.ca_file.empty())
    status =
        mosquitto_tls_set(client, options_.ca_file.c_str(), nullptr, nullptr, nullptr, nullptr);
  session_ = session;
  if (status != MOSQ_ERR_SUCCESS) return lose(status, errno);
  std::thread([session, host = options_.host, port = options_.port] {
    session->status = mosquitto_connect(session->client.get(), host.c_str(), port, kKeepAliveS);
    session->code = errno;
    session->attempted = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(session->wake.get(), &one, sizeof one);
  }).detach();
}

void BrokerLink::run() {
  if (!speaks()) return;
  if (!session_) {
    if (clock_.now() >= retry_at_) begin_attempt();
    return;
  }
  if (!session_->attempted) return;
  if (session_->status != MOSQ_ERR_SUCCESS) return lose(session_->status, session_->code);
  Session& session = *session_;
  const int status = mosquitto_loop(session.client.get(), 0, kPacketsInOneTurn);
  const int code = errno;
  if (const auto answer = std::exchange(session.answer, std::nullopt)) {
    if (*answer != 0)
      return lose(mosquitto_connack_string(*answer), "check --user and --password-file");
    session.accepted = true;
    pause_ = kMinPause;
    complain(fmt::format("The broker {}:{} answers.", options_.host, options_.port));
    outbox_.begin_connection();
  }
  for (const int number : std::exchange(session.confirmed, {})) {
    if (const auto found = session.tickets.extract(number)) outbox_.confirmed(found.mapped());
  }
  if (status != MOSQ_ERR_SUCCESS) return lose(status, code);
  if (session.accepted) hand_over();
}

void BrokerLink::hand_over() {
  while (auto message = outbox_.next(clock_.now())) {
    const std::string topic = base_ + "/" + kKindNames[index_of(message->kind)];
    int number = 0;
    const int status = mosquitto_publish(session_->client.get(), &number, topic.c_str(),
                                         static_cast<int>(message->payload.size()),
                                         message->payload.data(), kQos, true);
    if (status != MOSQ_ERR_SUCCESS) return lose(status, errno);
    session_->tickets[number] = message->ticket;
  }
}

void BrokerLink::lose(int status, int code) {
  std::string why = mosquitto_strerror(status);
  if (status == MOSQ_ERR_ERRNO) why = std::strerror(code);
  if (status == MOSQ_ERR_EAI) why = ::gai_strerror(code);
  if (status == MOSQ_ERR_KEEPALIVE) why = "it has stopped answering";
  if (why.ends_with('.')) why.pop_back();
  if (!session_->last_error.empty()) why += ": " + session_->last_error;
  lose(why, remedy_for(status));
}

void BrokerLink::lose(std::string why, const char* remedy) {
  if (why.ends_with('.')) why.pop_back();
  complain(
      fmt::format("{}:{}: no connection to the broker ({}); {}. It is tried again, and what "
                  "there is to say is kept.",
                  options_.host, options_.port, why, remedy));
  session_.reset();
  retry_at_ = clock_.now() + pause_;
  pause_ = std::min(2 * pause_, kMaxPause);
}

// Says the same sentence once in a row.
void BrokerLink::complain(const std::string& sentence) {
  if (sentence == complained_) return;
  complained_ = sentence;
  fmt::print(stderr, "{}\n", sentence);
}

void BrokerLink::leave(Nanoseconds within) {
  outbox_.say("offline");
  const Nanoseconds until = clock_.now() + within;
  while (session_ && session_->accepted && !outbox_.delivered(Kind::bridge) &&
         clock_.now() < until) {
    pollfd ready = waits_for();
    ::poll(&ready, 1, 20);
    run();
  }
  if (session_ && session_->accepted && outbox_.delivered(Kind::bridge)) {
    mosquitto_disconnect(session_->client.get());
    while (clock_.now() < until && mosquitto_want_write(session_->client.get()) &&
           mosquitto_loop(session_->client.get(), 20, kPacketsInOneTurn) == MOSQ_ERR_SUCCESS) {
    }
  }
  session_.reset();
  base_.clear();
}

}  // namespace shaker::mqtt
