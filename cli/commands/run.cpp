// Runs a campaign: takes control, renews the lease, shows the progress, and waits until the rig
// is at rest again. To leave early is safe: the lease expires and the daemon ramps down.
#include <chrono>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "cli/campaign_progress.hpp"
#include "cli/commands/daemon_error.hpp"
#include "cli/missing_runs.hpp"
#include "cli/terminal.hpp"
#include "config/campaign.hpp"
#include "estimator/model/model.hpp"
#include "report/estimate_table.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;
constexpr double kLastEstimateS = 2.0;  // how long to wait at rest for the last estimate

// " A.db B.db last", for a command line in a message.
std::string all_files(const std::vector<std::filesystem::path>& files, const std::string& last) {
  std::string text;
  for (const auto& file : files)
    text += " " + file.string();
  return last.empty() ? text : text + " " + last;
}

class Campaign {
 public:
  // `quiet`: no bar, and no line for a cycle or an estimate.
  Campaign(const Common& common, StreamClient& client, const config::CampaignSpec& spec, bool quiet)
      : common_(common),
        client_(client),
        progress_(spec),
        bar_wanted_(!quiet && !common.json && stdout_is_terminal()),
        steps_wanted_(!quiet && !stdout_is_terminal()) {}

  // `method` starts the motion. `estimates`: the campaign must end with a usable estimate.
  // `earlier`: databases of the same campaign.
  int run(const char* method, const Json& params, bool estimates,
          const std::vector<std::filesystem::path>& earlier = {});

 private:
  std::optional<int> begin(const char* method, const Json& params);
  Result<void> follow();
  Result<void> keep_lease();
  Result<void> heed_interrupts();
  Result<void> heed_keys();
  void take(const std::string& line);
  void show(const Json& document);
  void draw_bar();
  void clear_bar();
  int finish(bool estimates, const std::vector<std::filesystem::path>& earlier);
  std::string way_to_the_rest(const std::vector<std::filesystem::path>& earlier) const;
  double now() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  const Common& common_;
  StreamClient& client_;
  CampaignProgress progress_;
  bool bar_wanted_, steps_wanted_, bar_drawn_ = false, lease_lost_ = false;
  int interrupts_heeded_ = 0;
  std::int64_t keyed_ = -1;  // the request of the last key
  std::string state_told_, database_;
  double lease_s_ = 2.0, renewed_ = 0.0, drawn_ = -1.0;
  Clock::time_point start_ = Clock::now();
  Keys keys_{stdout_is_terminal()};
};

std::optional<int> Campaign::begin(const char* method, const Json& params) {
  // Documents from before the start are shown but do not belong to this campaign.
  const auto before = [&](const std::string& line) {
    if (common_.json) fmt::print("{}\n", line);
  };
  if (common_.json) fmt::print("{}\n", client_.version_line());
  const auto control = client_.ask("control.acquire", nullptr, before);
  if (!control) return unreachable(common_, control.error());
  if (control->refused) return refused(common_, *control);
  if (control->result.is_object()) {
    lease_s_ = number_of(control->result, "lease_s").value_or(lease_s_);
  }
  renewed_ = now();
  const auto started = client_.ask(method, params, [&](const std::string& line) { take(line); });
  if (!started) return unreachable(common_, started.error());
  if (started->refused) return refused(common_, *started);
  database_ = printable(text_of(started->result, "database"));
  return std::nullopt;
}

Result<void> Campaign::keep_lease() {
  if (lease_lost_ || now() - renewed_ < lease_s_ / 4.0) return {};
  renewed_ = now();
  const auto sent = client_.send("lease.renew");
  return sent ? Result<void>() : sent.error();
}

Result<void> Campaign::heed_interrupts() {
  if (interrupts_heeded_ >= std::min(interrupts(), 2)) return {};
  ++interrupts_heeded_;
  clear_bar();
  if (interrupts_heeded_ == 2) return Error{ErrorKind::refused, "interrupted twice"};
  fmt::print(stderr, "Stopping: the rig ramps down. Ctrl-C again leaves without waiting for it.\n");
  const auto sent = client_.send("stop");
  return sent ? Result<void>() : sent.error();
}

// p pauses, r resumes. A refusal is printed by take().
Result<void> Campaign::heed_keys() {
  const char key = keys_.pressed();
  if (key != 'p' && key != 'r') return {};
  const auto sent = client_.send(key == 'p' ? "pause" : "resume");
  if (!sent) return sent.error();
  keyed_ = *sent;
  return {};
}

void Campaign::take(const std::string& line) {
  const Json document = Json::parse(line, nullptr, false);
  Answer answer;
  if (StreamClient::is_answer(document, answer)) {
    if (!answer.refused || lease_lost_) return;
    lease_lost_ = answer.id != keyed_;
    clear_bar();
    fmt::print(stderr, "shakerctl: {}\n", printable(answer.message));
    return;
  }
  if (!document.is_object()) return;
  progress_.take(document, now());
  if (common_.json) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
  } else {
    show(document);
  }
}

// On a terminal the bar shows state, cycles and estimates; otherwise each has a line.
void Campaign::show(const Json& document) {
  const std::string type = text_of(document, "type");
  if (!steps_wanted_ && (type == "cycle" || type == "estimate")) return;
  if (bar_wanted_ && type == "state") return;
  const std::string text = narrate(document);
  if (text.empty()) return;
  // The state is published every second; it is printed only when it has changed.
  if (type == "state" && std::exchange(state_told_, text) == text) return;
  clear_bar();
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

void Campaign::clear_bar() {
  if (bar_drawn_) fmt::print("\r\x1b[K");
  bar_drawn_ = false;
  drawn_ = -1.0;
}

void Campaign::draw_bar() {
  if (!bar_wanted_ || now() - drawn_ < 0.2) return;
  const int width = terminal_width() - 1;
  const std::string estimate =
      progress_.last_estimate().is_null()
          ? ""
          : report::estimate_line(estimate_from(progress_.last_estimate()));
  const std::string text =
      fmt::format("{}  ETA {}  {}  {}", progress_bar(progress_.fraction(), width / 8),
                  report::duration(progress_.eta_s(now())), progress_.status_line(), estimate);
  fmt::print("\r{}\x1b[K", fitted(printable(text), width));
  std::fflush(stdout);
  drawn_ = now();
  bar_drawn_ = true;
}

Result<void> Campaign::follow() {
  double over_since = -1.0;
  for (;;) {
    if (auto heeded = heed_interrupts(); !heeded) return heeded;
    if (auto heeded = heed_keys(); !heeded) return heeded;
    if (auto kept = keep_lease(); !kept) return kept;
    if (lease_lost_ && progress_.state() == "PAUSE") {
      return Error{ErrorKind::refused,
                   "control was lost, and the campaign is paused; `shakerctl resume` goes on"};
    }
    if (progress_.over()) {
      if (over_since < 0.0) over_since = now();
      if (progress_.estimate_is_in() || now() - over_since > kLastEstimateS) return {};
    }
    std::string line;
    const auto wait = client_.next(100, line);
    if (!wait) return wait.error();
    if (*wait == StreamClient::Wait::line) take(line);
    draw_bar();
  }
}

std::string Campaign::way_to_the_rest(const std::vector<std::filesystem::path>& earlier) const {
  if (database_.empty()) return "";
  return fmt::format("; measure the rest with `shakerctl run --resume{}`",
                     all_files(earlier, database_));
}

int Campaign::finish(bool estimates, const std::vector<std::filesystem::path>& earlier) {
  clear_bar();
  const Json& last = progress_.last_estimate();
  const auto estimate = last.is_null() ? protocol::EstimateDocument{} : estimate_from(last);
  if (!common_.json && !last.is_null()) fmt::print("\n{}", report::estimate_table(estimate));
  if (!progress_.success()) {
    return fail(common_, kNegative,
                fmt::format("the campaign did not succeed: {}{}",
                            progress_.reason().empty() ? "the rig is in " + progress_.state()
                                                       : printable(progress_.reason()),
                            estimates ? way_to_the_rest(earlier) : ""));
  }
  if (!estimates) {
    if (!common_.json) fmt::print("{}.\n", printable(progress_.reason()));
    return kOk;
  }
  if (last.is_null() || !estimate.usable) {
    return fail(common_, kNotUsable, "the campaign is measured, but its estimate is not usable");
  }
  if (!common_.json && !earlier.empty())
    fmt::print("All of it: `shakerctl estimate{}`.\n", all_files(earlier, database_));
  if (!common_.json) fmt::print("The campaign is done.\n");
  return kOk;
}

int Campaign::run(const char* method, const Json& params, bool estimates,
                  const std::vector<std::filesystem::path>& earlier) {
  if (const auto trouble = begin(method, params)) return *trouble;
  const auto followed = follow();
  clear_bar();
  if (!followed) {
    if (interrupts_heeded_ >= 2) {
      return fail(common_, kNegative, "left before the rig was at rest; the daemon ramps it down");
    }
    return fail(common_, kUnreachable,
                printable(followed.error().what) + (estimates ? way_to_the_rest(earlier) : ""));
  }
  // The end of this process closes the connection, so a lost release has no effect.
  if (const auto released = client_.send("control.release"); !released) clear_bar();
  return finish(estimates, earlier);
}

// Of --resume, with the rig that measured the rest; of a campaign file, without a rig.
Result<MissingRuns> campaign_to_run(const RunOptions& options) {
  if (options.campaign.empty() == options.resume.empty())
    return Error{ErrorKind::invalid, "give a campaign file, or --resume FILE.db"};
  if (!options.resume.empty()) return missing_runs(options.resume);
  auto campaign = config::load_campaign(options.campaign);
  if (!campaign) return campaign.error();
  return MissingRuns{std::move(*campaign), {}};
}

Result<MissingRuns> wanted_campaign(const RunOptions& options) {
  auto wanted = campaign_to_run(options);
  if (!wanted) return wanted;
  for (const std::string& entry : options.specimen) {
    const auto equals = entry.find('=');
    if (equals == std::string::npos)
      return Error{ErrorKind::invalid, fmt::format("--specimen {}: give KEY=TEXT", entry)};
    if (auto set = config::set_entry(wanted->campaign.specimen, entry.substr(0, equals),
                                     entry.substr(equals + 1));
        !set)
      return set.error();
  }
  return wanted;
}

// The rest of a campaign belongs to the rig that measured its beginning.
Result<void> expect_rig(const StreamClient& client, const Common& common, const std::string& rig) {
  const std::string here = text_of(client.version(), "rig");
  if (rig.empty() || here == rig) return {};
  return Error{
      ErrorKind::invalid,
      fmt::format("the campaign was measured on the rig \"{}\", and the daemon at {} moves "
                  "\"{}\"; give that rig's --socket, or start the campaign anew",
                  printable(rig), common.socket.string(), printable(here))};
}

int nothing_missing(const Common& common, const RunOptions& options) {
  const std::string files = all_files(options.resume, "");
  if (common.json)
    fmt::print("{}\n", Json{{"missing_runs", 0}}.dump());
  else
    fmt::print(
        "Nothing is missing: every run has its cycles. Estimate them with `shakerctl "
        "estimate{}`.\n",
        files);
  return kOk;
}

}  // namespace

int run(const Common& common, const RunOptions& options) {
  const auto wanted = wanted_campaign(options);
  if (!wanted) return fail(common, kBadInput, wanted.error().what);
  const config::CampaignSpec& campaign = wanted->campaign;
  if (campaign.runs.empty()) return nothing_missing(common, options);
  try {
    const estimator::Model model(campaign.model);
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  if (auto same = expect_rig(*client, common, wanted->rig); !same)
    return fail(common, kBadInput, same.error().what);
  count_interrupts();
  const Json spec = Json::parse(config::to_json_text(campaign));
  return Campaign(common, *client, campaign, options.quiet)
      .run("campaign.start", {{"campaign", spec}}, true, options.resume);
}

int prove_deadman(const Common& common, const ProveOptions& options) {
  config::CampaignSpec proof;
  proof.name = "deadman-proof";
  proof.runs.push_back({"proof", options.frequency_hz, options.amplitude, 1});
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  count_interrupts();
  return Campaign(common, *client, proof, false)
      .run("deadman.prove",
           {{"frequency_hz", options.frequency_hz}, {"amplitude", options.amplitude}}, false);
}

}  // namespace shaker::cli
