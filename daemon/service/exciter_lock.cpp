#include "daemon/service/exciter_lock.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <system_error>
#include <unistd.h>

#include "base/unique_fd.hpp"
#include "daemon/publish/user_name.hpp"

namespace shaker::daemon {
namespace {

constexpr Nanoseconds kLookAgain = std::chrono::milliseconds(50);
constexpr int kLockBacklog = 8;

struct SocketAddress {
  sockaddr_un address{};
  socklen_t size = 0;
  const sockaddr* get() const {
    const void* generic = &address;
    return static_cast<const sockaddr*>(generic);
  }
};

// An abstract name begins with a null byte; only its size ends it.
std::optional<SocketAddress> socket_address(const std::string& name) {
  SocketAddress made;
  if (name.size() >= sizeof made.address.sun_path) return std::nullopt;
  made.address.sun_family = AF_UNIX;
  std::memcpy(made.address.sun_path, name.data(), name.size());
  const bool abstract = name[0] == '\0';
  made.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size() + !abstract);
  return made;
}

Error no_lock(const std::string& place) {
  return Error{ErrorKind::io, fmt::format("{}: the exciter's lock cannot be made ({}); check that "
                                          "the folder is there and that this user may write in it.",
                                          place, std::generic_category().message(errno))};
}

UniqueFd unix_socket() {
  return UniqueFd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

std::optional<ucred> other_side(int fd) {
  ucred who{};
  socklen_t size = sizeof who;
  if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) return std::nullopt;
  return who;
}

std::string describe(const std::optional<ucred>& who) {
  return who ? fmt::format("{} (pid {})", user_name(who->uid), who->pid) : "somebody";
}

std::optional<uid_t> owner(const std::filesystem::path& folder) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return std::nullopt;
  return status.st_uid;
}

constexpr char kLetGo = 'g';   // message of the service to a plain daemon
constexpr int kWordMs = 1000;  // limit for this message

// Connects to a socket that a daemon holds. If its queue is full, it is alive without a
// connection.
struct Knock {
  explicit Knock(const SocketAddress& where) : line(unix_socket()) {
    const bool connected = line.valid() && ::connect(line.get(), where.get(), where.size) == 0;
    alive = connected || errno == EAGAIN || errno == EACCES;
    if (connected) who = other_side(line.get());
  }
  UniqueFd line;
  bool alive = false;
  std::optional<ucred> who;
};

// Writes to stderr: the log does not run yet, and fmt throws if the output is closed.
void say(const std::string& sentence) {
  std::fputs(("shakerd: " + sentence + "\n").c_str(), stderr);
}

Error taken(const std::string& address, const std::string& who) {
  return Error{ErrorKind::refused,
               fmt::format("{}: another shakerd, of {}, drives this exciter; stop that one first, "
                           "there can be only one.",
                           address, who)};
}

// Thread of a plain daemon that waits for the service to request the exciter, once.
class Doorkeeper {
 public:
  Doorkeeper(int name, std::filesystem::path folder, ExciterLock::LetGo let_go)
      : name_(name),
        folder_(std::move(folder)),
        let_go_(std::move(let_go)),
        end_(::eventfd(0, EFD_CLOEXEC)),
        thread_([this] { keep(); }) {}
  ~Doorkeeper() {
    const std::uint64_t one = 1;
    if (::write(end_.get(), &one, sizeof one) != sizeof one) std::terminate();
    thread_.join();
  }

 private:
  void keep() {
    UniqueFd service;  // the connection tells the service when this process ends
    while (true) {
      pollfd events[] = {{end_.get(), POLLIN, 0}, {name_, POLLIN, 0}};
      const nfds_t watched = service.valid() ? 1 : 2;
      if (::poll(events, watched, -1) < 0 && errno != EINTR) return;
      if (events[0].revents != 0) return;
      if (watched < 2 || events[1].revents == 0) continue;
      UniqueFd caller(::accept4(name_, nullptr, nullptr, SOCK_CLOEXEC));
      if (!caller.valid()) continue;
      const auto who = other_side(caller.get());
      if (!who || (who->uid != 0 && owner(folder_) != who->uid)) continue;
      // A process that only checks who holds the name sends nothing.
      pollfd says{caller.get(), POLLIN, 0};
      char word = 0;
      if (::poll(&says, 1, kWordMs) <= 0 ||
          ::recv(caller.get(), &word, sizeof word, MSG_DONTWAIT) != 1 || word != kLetGo) {
        continue;
      }
      service = std::move(caller);
      let_go_(describe(who));
    }
  }

  int name_;
  std::filesystem::path folder_;
  ExciterLock::LetGo let_go_;
  UniqueFd end_;
  std::thread thread_;
};

class HeldExciter final : public ExciterLock {
 public:
  Result<void> take_as_service(const std::string& address, const LockPlace& place);
  Result<void> take_as_plain(const std::string& address, const LockPlace& place, LetGo let_go);

 private:
  Result<void> lock_file(const std::string& address, const std::filesystem::path& folder);
  Result<void> be_seen(const std::filesystem::path& path);
  Result<void> claim_name(const std::string& address, const LockPlace& place);
  bool bind_name(const SocketAddress& name);

  UniqueFd file_, seen_, name_;
  std::optional<Doorkeeper> doorkeeper_;
};

std::filesystem::path seen_at(const LockPlace& place, const std::string& address) {
  return place.folder / ("exciter-" + address);
}

std::optional<SocketAddress> name_of(const std::string& address) {
  return socket_address(std::string(1, '\0') + "shakerd/exciter/" + address);
}

Result<void> HeldExciter::lock_file(const std::string& address,
                                    const std::filesystem::path& folder) {
  const auto path = folder / ("exciter-" + address + ".lock");
  file_.reset(::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!file_.valid()) return no_lock(path.string());
  if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0) return taken(address, "the service");
  return {};
}

// An existing socket belongs to a dead service, because this process holds the file's lock.
Result<void> HeldExciter::be_seen(const std::filesystem::path& path) {
  const auto where = socket_address(path.string());
  if (!where) {
    errno = ENAMETOOLONG;
    return no_lock(path.string());
  }
  ::unlink(path.c_str());
  seen_ = unix_socket();
  if (::bind(seen_.get(), where->get(), where->size) != 0 ||
      ::chmod(path.c_str(), 0666) != 0 ||  // anybody may connect to see it
      ::listen(seen_.get(), kLockBacklog) != 0) {
    return no_lock(path.string());
  }
  return {};
}

bool HeldExciter::bind_name(const SocketAddress& name) {
  name_ = unix_socket();
  return ::bind(name_.get(), name.get(), name.size) == 0 &&
         ::listen(name_.get(), kLockBacklog) == 0;
}

Result<void> HeldExciter::claim_name(const std::string& address, const LockPlace& place) {
  const auto name = name_of(address);
  if (!name) return {};  // no plain daemon can have it either
  RealClock clock;
  const Nanoseconds latest = clock.now() + place.patience;
  std::optional<Knock> asked;  // kept open: it ends with the holder
  while (!bind_name(*name)) {
    if (errno != EADDRINUSE) return no_lock(address);
    if (!asked || !asked->who) {
      asked.emplace(*name);
      if (asked->who && (asked->who->uid == 0 || asked->who->uid == ::geteuid()))
        return taken(address, describe(asked->who));
      if (asked->who) {
        ::send(asked->line.get(), &kLetGo, sizeof kLetGo, MSG_DONTWAIT | MSG_NOSIGNAL);
        say(fmt::format("{} has the exciter {}; asked to ramp down and end.", describe(asked->who),
                        address));
      }
    }
    if (clock.now() >= latest) {
      say(
          fmt::format("{} does not let go of the exciter {} and may be moving it. This service "
                      "starts all the same. Find out what that program is and end it.",
                      describe(asked->who), address));
      name_.reset();
      return {};
    }
    pollfd gone{asked->who ? asked->line.get() : -1, 0, 0};
    ::poll(&gone, 1, static_cast<int>(kLookAgain / std::chrono::milliseconds(1)));
    if (gone.revents != 0) clock.sleep_until(clock.now() + kLookAgain);
    if (gone.revents != 0) asked.reset();
  }
  return {};
}

// The service creates its socket first and binds the name then. A plain daemon uses the
// opposite order, so that of two that start together one detects the other.
Result<void> HeldExciter::take_as_service(const std::string& address, const LockPlace& place) {
  if (auto locked = lock_file(address, place.folder); !locked) return locked;
  if (auto seen = be_seen(seen_at(place, address)); !seen) return seen;
  return claim_name(address, place);
}

Result<void> HeldExciter::take_as_plain(const std::string& address, const LockPlace& place,
                                        LetGo let_go) {
  const auto name = name_of(address);
  if (!name) {
    errno = ENAMETOOLONG;
    return no_lock(address);
  }
  if (!bind_name(*name)) {
    if (errno != EADDRINUSE) return no_lock(address);
    return taken(address, describe(Knock(*name).who));
  }
  const auto seen = socket_address(seen_at(place, address).string());
  if (const Knock service(seen.value_or(SocketAddress{})); service.alive)
    return taken(address, "the service, " + describe(service.who));
  doorkeeper_.emplace(name_.get(), place.folder, std::move(let_go));
  return {};
}

}  // namespace

LockPlace lock_place_of_this_process() {
  LockPlace place;
  place.service = owner(place.folder) == ::geteuid();
  return place;
}

Result<std::unique_ptr<ExciterLock>> ExciterLock::take(const std::string& address,
                                                       const LockPlace& place, LetGo let_go) {
  auto held = std::make_unique<HeldExciter>();
  const auto outcome = place.service ? held->take_as_service(address, place)
                                     : held->take_as_plain(address, place, std::move(let_go));
  if (!outcome) return outcome.error();
  return std::unique_ptr<ExciterLock>(std::move(held));
}

}  // namespace shaker::daemon
