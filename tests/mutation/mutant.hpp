// What together.py writes into source files: of all mutations in a program, the one that SHAKER_MUTANT
// names is done. SHAKER_MUTANTS_REACHED names a file that gets the number of each one that is reached.
#pragma once

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#pragma GCC diagnostic ignored "-Wparentheses"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wnarrowing"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wunused"

namespace shaker::mutation {

inline int chosen() {
  static const int number = [] {
    const char* text = std::getenv("SHAKER_MUTANT");
    return text == nullptr ? 0 : std::atoi(text);
  }();
  return number;
}

// Allocates nothing.
inline void note(int number) {
  static const int file = [] {
    const char* path = std::getenv("SHAKER_MUTANTS_REACHED");
    return path == nullptr ? -1 : ::open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  }();
  static std::atomic<bool> noted[10000];
  if (file < 0 || noted[number].exchange(true)) return;
  char line[16];
  const int length = std::snprintf(line, sizeof line, "%d\n", number);
  if (::write(file, line, static_cast<std::size_t>(length)) != length) std::abort();
}

inline bool is(int number) {
  note(number);
  return number == chosen();
}

// `x < y` is written as `x < less<7, ...>{} < y`: both operators bind alike, from the left.
#define SHAKER_MUTANT_OPERATOR(NAME, SIGN)                                         \
  template <int number, class Other>                                               \
  struct NAME {};                                                                  \
  template <class X, int number, class Other>                                      \
  struct NAME##_left {                                                             \
    X&& x;                                                                         \
  };                                                                               \
  template <class X, int number, class Other>                                      \
  NAME##_left<X, number, Other> operator SIGN(X&& x, NAME<number, Other>) {        \
    return {std::forward<X>(x)};                                                   \
  }                                                                                \
  template <class X, int number, class Other, class Y>                             \
  auto operator SIGN(NAME##_left<X, number, Other> left, Y&& y)                    \
      ->decltype(std::forward<X>(left.x) SIGN std::forward<Y>(y)) {                \
    if (is(number)) return Other::of(std::forward<X>(left.x), std::forward<Y>(y)); \
    return std::forward<X>(left.x) SIGN std::forward<Y>(y);                        \
  }

#define SHAKER_MUTANT_OTHER(NAME, SIGN)                  \
  struct NAME {                                          \
    template <class X, class Y>                          \
    static auto of(X&& x, Y&& y) {                       \
      return std::forward<X>(x) SIGN std::forward<Y>(y); \
    }                                                    \
  };

SHAKER_MUTANT_OTHER(OtherLess, <)
SHAKER_MUTANT_OTHER(OtherLessEqual, <=)
SHAKER_MUTANT_OTHER(OtherGreaterEqual, >=)
SHAKER_MUTANT_OTHER(OtherEqual, ==)
SHAKER_MUTANT_OTHER(OtherUnequal, !=)
SHAKER_MUTANT_OTHER(OtherPlus, +)
SHAKER_MUTANT_OTHER(OtherMinus, -)
SHAKER_MUTANT_OTHER(OtherGreater, >)

SHAKER_MUTANT_OPERATOR(Less, <)
SHAKER_MUTANT_OPERATOR(LessEqual, <=)
SHAKER_MUTANT_OPERATOR(Greater, >)
SHAKER_MUTANT_OPERATOR(GreaterEqual, >=)
SHAKER_MUTANT_OPERATOR(Equal, ==)
SHAKER_MUTANT_OPERATOR(Unequal, !=)
SHAKER_MUTANT_OPERATOR(Plus, +)
SHAKER_MUTANT_OPERATOR(Minus, -)

}  // namespace shaker::mutation
