// A value, or the reason why there is none.
//
// Failures of the outside world (a rig that does not answer, a malformed file) are returned,
// never thrown across threads. Programming and configuration errors throw at start-up. An
// Error's text is a sentence for the operator: it names the place and the remedy.
#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace shaker {

// Class of an error, for code that must decide; `what` is for people.
enum class ErrorKind {
  invalid,       // bad input: configuration, file, argument
  unavailable,   // not there (yet): no connection, link down
  timeout,       // no answer in time
  refused,       // the other side refused (Modbus exception, interlock)
  io,            // the operating system failed a call
  exhausted,     // out of space, queue full
  not_converged  // a numerical method gave up
};

struct Error {
  ErrorKind kind = ErrorKind::invalid;
  std::string what;
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT: implicit
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  // Precondition: ok().
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  // Precondition: !ok().
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)), ok_(false) {}  // NOLINT: implicit

  bool ok() const { return ok_; }
  explicit operator bool() const { return ok_; }
  const Error& error() const { return error_; }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace shaker
