/// \file
/// A value, or the reason why there is none.
///
/// Failures of the outside world (a rig that does not answer, a malformed file) are returned,
/// never thrown across threads. Programming and configuration errors throw at start-up. An
/// Error's text is a sentence for the operator: it names the place and the remedy.
#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace shaker {

/// Class of an error, for code that must decide; `what` is for people.
enum class ErrorKind {
  invalid,       ///< bad input: configuration, file, argument
  unavailable,   ///< not there (yet): no connection, link down
  timeout,       ///< no answer in time
  refused,       ///< the other side refused (Modbus exception, interlock)
  io,            ///< the operating system failed a call
  exhausted,     ///< out of space, queue full
  not_converged  ///< a numerical method gave up
};

/// Why something failed.
struct Error {
  ErrorKind kind = ErrorKind::invalid;  ///< what a program decides by
  std::string what;                     ///< a sentence for the operator: the place and the remedy
};

/// A value of type T, or an Error. One thread at a time may use it.
template <class T>
class [[nodiscard]] Result {
 public:
  /// \param value the result
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT: implicit
  /// \param error why there is no value
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  /// \return true if there is a value
  bool ok() const { return state_.index() == 0; }
  /// \return true if there is a value
  explicit operator bool() const { return ok(); }

  /// Precondition: ok().
  /// \return the value
  T& value() & { return std::get<0>(state_); }
  /// \return the value. Precondition: ok().
  const T& value() const& { return std::get<0>(state_); }
  /// \return the value. Precondition: ok().
  T&& value() && { return std::get<0>(std::move(state_)); }
  /// \return the value. Precondition: ok().
  T& operator*() & { return value(); }
  /// \return the value. Precondition: ok().
  const T& operator*() const& { return value(); }
  /// \return the value. Precondition: ok().
  T&& operator*() && { return std::move(*this).value(); }
  /// \return the value's address. Precondition: ok().
  T* operator->() { return &value(); }
  /// \return the value's address. Precondition: ok().
  const T* operator->() const { return &value(); }

  /// Precondition: !ok().
  /// \return the error
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// Success, or an Error. One thread at a time may use it.
template <>
class [[nodiscard]] Result<void> {
 public:
  /// Success.
  Result() = default;
  /// \param error why it failed
  Result(Error error) : error_(std::move(error)), ok_(false) {}  // NOLINT: implicit

  /// \return true after success
  bool ok() const { return ok_; }
  /// \return true after success
  explicit operator bool() const { return ok_; }
  /// \return the error; an empty one after success
  const Error& error() const { return error_; }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace shaker
