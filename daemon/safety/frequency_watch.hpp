// Detects that the table moves at another frequency than the setpoint's.
//
// Looks at the last period of the setpoint twice in each period. From one look to the next the phase
// of the fundamental turns by half of the relative difference of the frequencies; where the
// difference is large the fundamental is small. A jump of the phase, as of late samples, is over
// after three looks; four in a row are another frequency. One of more than 2.5 % is found within two
// and a half periods. One thread; add() neither allocates nor blocks.
#pragma once

#include <complex>

#include "daemon/safety/period_watch.hpp"

namespace shaker::daemon {

class FrequencyWatch {
 public:
  struct Sight {
    double least = 0.0;    // a smaller amplitude says nothing
    double noise = 0.0;    // standard deviation of a sample at rest
    double rate_hz = 0.0;  // of the samples
  };

  // The setpoint's frequency from `t` on.
  void restart(double frequency_hz, Nanoseconds t);
  // What has been seen so far counts no more; the grid of the periods stays.
  void forget();
  // Takes one good sample; times ascend.
  void add(Nanoseconds t, double value, const Sight& sight);

  bool differs() const { return in_a_row_ >= kLooks; }
  // The last look spoke for another frequency.
  bool suspects() const { return in_a_row_ > 0; }
  // The frequency of the motion; 0 where it is too far off to be told.
  double frequency_hz() const;

 private:
  static constexpr int kLooks = 4;

  void look(const PeriodFigures& figures, std::complex<double> fundamental, const Sight& sight);

  double frequency_hz_ = 0.0, turn_ = 0.0;
  PeriodWatch whole_, halves_;  // the grid of the second is half a period later
  std::complex<double> last_;
  bool known_ = false, near_ = false;
  int in_a_row_ = 0;
};

}  // namespace shaker::daemon
