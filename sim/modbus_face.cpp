#include "sim/modbus_face.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <termios.h>

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "sim/modbus_desk.hpp"

namespace shaker::sim {
namespace {

using Context = std::unique_ptr<modbus_t, ModbusRelease>;

// A client that stops in the middle of a message must not delay the rig.
constexpr std::uint32_t kPatienceUs = 20'000;

Error trouble(const std::string& what) {
  return Error{ErrorKind::io, fmt::format("{}: {}", what, modbus_strerror(errno))};
}

bool set_patience(modbus_t* context) {
  return modbus_set_byte_timeout(context, 0, kPatienceUs) == 0 &&
         modbus_set_indication_timeout(context, 0, kPatienceUs) == 0;
}

class TcpFace final : public ModbusFace {
 public:
  TcpFace(RegisterMap& map, VirtualRig& rig, Context context, UniqueFd listener, std::string place,
          int port)
      : desk_(map, rig, false),
        context_(std::move(context)),
        listener_(std::move(listener)),
        place_(std::move(place)),
        port_(port) {}

  void watch(std::vector<pollfd>& wanted) const override {
    wanted.push_back({listener_.get(), POLLIN, 0});
    for (const auto& client : clients_)
      wanted.push_back({client.get(), POLLIN, 0});
  }

  void serve(const pollfd& ready) override {
    if (ready.fd == listener_.get()) {
      admit();
      return;
    }
    const auto client = std::ranges::find(clients_, ready.fd, &UniqueFd::get);
    if (client == clients_.end()) return;
    modbus_set_socket(context_.get(), ready.fd);
    if (!desk_.answer(context_.get())) clients_.erase(client);
    modbus_set_socket(context_.get(), -1);
  }

  std::string place() const override { return place_; }
  int port() const override { return port_; }

 private:
  void admit() {
    UniqueFd client(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!client.valid() || clients_.size() >= kMostClients) return;
    const int on = 1;
    setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    clients_.push_back(std::move(client));
  }

  ModbusDesk desk_;
  Context context_;
  UniqueFd listener_;
  std::vector<UniqueFd> clients_;
  std::string place_;
  int port_;
};

class PtyFace final : public ModbusFace {
 public:
  PtyFace(RegisterMap& map, VirtualRig& rig, Context context, UniqueFd master, UniqueFd keeper,
          std::string link)
      : desk_(map, rig, true),
        context_(std::move(context)),
        master_(std::move(master)),
        keeper_(std::move(keeper)),
        link_(std::move(link)) {}
  ~PtyFace() override { unlink(link_.c_str()); }

  void watch(std::vector<pollfd>& wanted) const override {
    wanted.push_back({master_.get(), POLLIN, 0});
  }
  void serve(const pollfd& ready) override {
    if (ready.fd != master_.get()) return;
    // After an invalid message the line is flushed, so that the next request starts at a frame
    // boundary.
    if (!desk_.answer(context_.get())) modbus_flush(context_.get());
  }
  std::string place() const override { return link_; }

 private:
  ModbusDesk desk_;
  Context context_;
  UniqueFd master_;
  UniqueFd keeper_;  // kept open: otherwise the master reads an error when a client closes the line
  std::string link_;
};

int bound_port(int fd) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

bool make_raw(int fd) {
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) return false;
  cfmakeraw(&settings);
  return tcsetattr(fd, TCSANOW, &settings) == 0;
}

bool is_link(const std::string& path) {
  char target[1];
  return readlink(path.c_str(), target, sizeof target) >= 0;
}

}  // namespace

Result<std::unique_ptr<ModbusFace>> ModbusFace::tcp(RegisterMap& map, VirtualRig& rig,
                                                    const std::string& address, int port) {
  const auto where = fmt::format("Modbus TCP on {}:{}", address, port);
  Context context(modbus_new_tcp(address.c_str(), port));
  if (!context || !set_patience(context.get())) return trouble(where);
  UniqueFd listener(modbus_tcp_listen(context.get(), static_cast<int>(kMostClients)));
  if (!listener.valid()) return trouble(where);
  modbus_set_socket(context.get(), -1);
  const int bound = bound_port(listener.get());
  return std::unique_ptr<ModbusFace>(
      std::make_unique<TcpFace>(map, rig, std::move(context), std::move(listener),
                                fmt::format("{}:{}", address, bound), bound));
}

Result<std::unique_ptr<ModbusFace>> ModbusFace::pty(RegisterMap& map, VirtualRig& rig,
                                                    const std::string& link) {
  const auto where = fmt::format("Modbus RTU on {}", link);
  UniqueFd master(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  char name[64];
  if (!master.valid() || grantpt(master.get()) != 0 || unlockpt(master.get()) != 0 ||
      ptsname_r(master.get(), name, sizeof name) != 0) {
    return trouble(where);
  }
  UniqueFd keeper(open(name, O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!keeper.valid() || !make_raw(keeper.get())) return trouble(where);
  if (is_link(link))
    unlink(link.c_str());  // a link of an earlier run; any other file stays and is an error
  if (symlink(name, link.c_str()) != 0) return trouble(where);
  Context context(modbus_new_rtu(name, 115200, 'N', 8, 1));
  if (!context || modbus_set_slave(context.get(), 1) != 0 || !set_patience(context.get())) {
    return trouble(where);
  }
  modbus_set_socket(context.get(), master.get());
  return std::unique_ptr<ModbusFace>(std::make_unique<PtyFace>(
      map, rig, std::move(context), std::move(master), std::move(keeper), link));
}

}  // namespace shaker::sim
