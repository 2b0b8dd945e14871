#include "cli/repetition.hpp"

#include <numbers>

#include <fmt/format.h>

namespace shaker::cli {
namespace {

using estimator::Repetition;
using estimator::RepetitionFinding;

std::string remedy(int periods, const std::string& run) {
  if (periods > kMostPeriods)
    return fmt::format("no more than {} periods can be fitted", kMostPeriods);
  if (run.empty() && periods == 1) return "leave --periods out";
  return fmt::format("say --periods {}{}", run.empty() ? "" : run + "=", periods);
}

std::string no_repetition(const RepetitionFinding& found, int periods) {
  const std::string how = fmt::format(
      "it does not repeat after {} periods: cycles so far apart differ by {:.3g}, {:.0f} "
      "times the noise",
      periods, found.scatter * std::numbers::sqrt2, found.scatter / found.noise);
  if (found.kind == Repetition::settles)
    return how + "; it still settles: leave its first cycles out";
  return how + fmt::format(
                   "; nor does it after 1 to {} others. What never repeats can be followed "
                   "in time, a piece of it, with --transient",
                   estimator::kLongestRepetition);
}

std::string other_period(const RepetitionFinding& found, int periods, const std::string& run) {
  return fmt::format(
      "it does not repeat after {} periods but after {}: cycles {} apart differ {:.1f} times as "
      "much as cycles {} apart; {}",
      periods, found.best, periods, found.scatter / found.best_scatter, found.best,
      remedy(found.best, run));
}

}  // namespace

Result<void> check_repetition(const Cycles& cycles, int periods, const std::string& place,
                              const std::string& run) {
  const auto bad = [&](const std::string& why) {
    return Error{ErrorKind::invalid, fmt::format("{}: {}", place, why)};
  };
  const RepetitionFinding found = find_repetition(cycles, periods);
  const std::size_t count = cycles.count();
  switch (found.kind) {
    case Repetition::repeats:
      return {};
    case Repetition::too_few:
      return bad(
          fmt::format("{} whole cycle{}; with --periods {} at least {} are needed, so that it "
                      "can be seen to repeat",
                      count, count == 1 ? "" : "s", periods, 2 * periods));
    case Repetition::other_period:
      return bad(other_period(found, periods, run));
    case Repetition::settles:
    case Repetition::never:
      return bad(no_repetition(found, periods));
    case Repetition::every_period:
      break;
  }
  return bad(
      fmt::format("it repeats after every period: cycles next to each other do not differ "
                  "by more than noise; {}",
                  remedy(1, run)));
}

RepetitionDoubt doubt_of_repetition(const Cycles& cycles, const std::string& place,
                                    const std::string& run) {
  const estimator::Alternation found = find_alternation(cycles);
  if (found.periods == 1) return {};
  const std::string how =
      found.periods == 2
          ? fmt::format("its cycles alternate: odd and even ones differ by {:.0f} times the noise",
                        found.difference)
          : fmt::format(
                "its cycles repeat only after {} periods of the excitation: those in "
                "between differ by {:.0f} times the noise",
                found.periods, found.difference);
  return {fmt::format("{}: {}, so that their mean is no motion of the damper; {}", place, how,
                      remedy(found.periods, run)),
          found.spoils};
}

}  // namespace shaker::cli
