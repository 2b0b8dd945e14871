#include "cli/campaign_progress.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "cli/documents_in.hpp"

namespace shaker::cli {
namespace {

// The estimate until a run has shown the true value: two ramps (2 s by default) and ten cycles
// to settle.
double guessed_overhead(const config::CampaignSpec& campaign, const config::RunSpec& run) {
  return 2.0 * (campaign.ramp_s > 0.0 ? campaign.ramp_s : 2.0) + 10.0 / run.frequency_hz;
}

}  // namespace

void CampaignProgress::take(const nlohmann::json& document, double now) {
  const std::string type = text_of(document, "type");
  last_ = now;
  if (type == "state") {
    const bool moved = !at_rest();
    state_ = text_of(document, "state");
    if (moved && at_rest()) rest_since_ = now;
    reason_ = text_of(document, "reason");
    begun_ = begun_ || (state_ != "IDLE" && state_ != "FAULT");
  } else if (type == "run_start") {
    run_ = static_cast<int>(number_of(document, "run_index").value_or(run_ + 1));
    accepted_ = 0;
    run_began_ = now;
    run_open_ = true;
  } else if (type == "cycle" && flag_of(document, "accepted")) {
    if (accepted_ == 0) overhead_ = now - run_began_;
    ++accepted_;
    ++accepted_total_;
  } else if (type == "estimate") {
    ++estimates_;
    estimate_ = document;
  } else if (type == "run_stop") {
    run_open_ = false;
    // A status other than "fail", such as an abort, names no cause; the state of the rig does.
    if (text_of(document, "status") == "fail" && failure_.empty())
      failure_ = text_of(document, "reason");
    successes_ += text_of(document, "status") == "success" ? 1 : 0;
  }
}

bool CampaignProgress::success() const {
  return over() && state_ != "FAULT" && successes_ == static_cast<int>(campaign_.runs.size());
}

double CampaignProgress::fraction() const {
  double wanted = 0.0;
  for (const config::RunSpec& run : campaign_.runs)
    wanted += run.cycles;
  return std::min(1.0, accepted_total_ / wanted);
}

double CampaignProgress::eta_s(double now) const {
  double left = 0.0;
  for (int i = std::max(0, run_); i < static_cast<int>(campaign_.runs.size()); ++i) {
    const config::RunSpec& run = campaign_.runs[static_cast<std::size_t>(i)];
    const double overhead = overhead_ >= 0.0 ? overhead_ : guessed_overhead(campaign_, run);
    const bool current = i == run_;
    const int cycles = current ? std::max(0, run.cycles - accepted_) : run.cycles;
    left += cycles / run.frequency_hz;
    if (!current) left += overhead;
    if (current && accepted_ == 0) left += std::max(0.0, overhead - (now - run_began_));
  }
  return left;
}

std::string CampaignProgress::status_line() const {
  if (run_ < 0 || run_ >= static_cast<int>(campaign_.runs.size())) return state_;
  const config::RunSpec& run = campaign_.runs[static_cast<std::size_t>(run_)];
  return fmt::format("{} {:.4g} Hz  {}  {}/{} cycles", run.name, run.frequency_hz, state_,
                     accepted_, run.cycles);
}

}  // namespace shaker::cli
