// `shakerctl-diagnosis diagnose --job`: a diagnosis that the daemon starts. It reads the job as
// JSON from standard input and writes lines of JSON to standard output: the progress and, last,
// the result. daemon/workers/diagnosis_child.hpp describes the lines.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <iterator>
#include <sched.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/heap.hpp"
#include "base/sanitizer.hpp"
#include "cli/campaign_title.hpp"
#include "cli/commands.hpp"
#include "config/campaign.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "record/accepted_cycles.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_files.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::ordered_json;
using namespace estimator::diagnosis;

constexpr int kJobNice = 10;
// Bytes. The largest diagnosis of the tests takes 120 MB. A diagnosis that needs far more has
// gone wrong and must not take the memory of the other programs.
constexpr rlim_t kJobMemory = rlim_t{2} << 30U;

// Lowers the priority and limits the memory. An error here does not stop the diagnosis.
void step_back() {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const sched_param none{};
  ::sched_setscheduler(0, SCHED_BATCH, &none);
  ::setpriority(PRIO_PROCESS, 0, kJobNice);
  if (kSanitized) return;  // sanitizers reserve terabytes
  const rlimit memory{kJobMemory, kJobMemory};
  ::setrlimit(RLIMIT_AS, &memory);
}

// When the daemon has gone and reads no more, SIGPIPE ends this process.
void put(const Json& line) {
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
}

void tell(const std::string& campaign, std::string_view stage, double share) {
  put({{"type", "progress"}, {"campaign", campaign}, {"stage", stage}, {"share", share}});
}

std::optional<std::filesystem::path> calibration_folder() {
  const char* folder = std::getenv("CACHE_DIRECTORY");  // set by systemd
  if (folder != nullptr && *folder == '/') return std::filesystem::path(folder) / "calibration";
  return CalibrationCache::user_folder();
}

Result<Campaign> campaign_of(const record::CampaignReader& reader, const record::CampaignRow& row) {
  auto runs = record::accepted_cycles(reader);
  if (!runs) return runs.error();
  Campaign campaign;
  campaign.name = row.name;
  const double mass = config::reference_mass(row.spec_json);
  for (record::AcceptedCycles& run : *runs)
    add_cycles(campaign, recording_of(std::move(run)), mass);
  if (campaign.runs.empty())
    return Error{ErrorKind::invalid,
                 fmt::format("The campaign {} holds no accepted cycle: there is nothing to "
                             "diagnose; run it again.",
                             row.name)};
  return campaign;
}

Result<config::ModelSpec> model_of(const Json& job, const record::CampaignRow& row,
                                   const std::string& file) {
  auto model = job.contains("model")
                   ? config::parse_model(job["model"].get<std::string>(), "diagnose: /params/model")
                   : config::parse_model(row.model_json, file);
  if (model && model->length_unit != "m")
    return Error{
        ErrorKind::invalid,
        fmt::format("The model counts in \"{}\" and the campaign in m: these do not match; "
                    "give a model in metres.",
                    model->length_unit)};
  return model;
}

Result<Diagnosis> find(const Json& job, std::string& name, report::TitleBlock& title) {
  const std::filesystem::path database = job.at("database").get<std::string>();
  name = database.stem().string();  // until it is read from the database
  tell(name, "reading", 0.0);
  const auto reader = record::CampaignReader::open(database);
  if (!reader) return reader.error();
  const auto row = reader->campaign();
  if (!row) return row.error();
  name = row->name;
  title = campaign_title({database}, *row, "diagnosed");
  const auto model = model_of(job, *row, database.filename().string());
  if (!model) return model.error();
  const auto campaign = campaign_of(*reader, *row);
  if (!campaign) return campaign.error();
  DiagnoseOptions options;
  options.false_alarm_rate = job.at("false_alarm_rate").get<double>();
  if (job.at("thorough").get<bool>()) options.evaluation_budget = kThorough;
  CalibrationCache calibrations(calibration_folder());
  options.calibrations = &calibrations;
  return estimator::diagnosis::diagnose(
      *campaign, *model, options,
      [&](std::string_view stage, double share) { tell(name, stage, share); });
}

void work(const Json& job, Json& result) {
  std::string name;
  report::TitleBlock title;
  const auto found = find(job, name, title);
  result["campaign"] = name;
  if (!found) {
    result["reason"] = found.error().what;
    return;
  }
  const std::filesystem::path folder = job.at("folder").get<std::string>();
  if (auto written = report::write_diagnosis(folder, *found, title); !written) {
    result["reason"] = written.error().what;
    return;
  }
  result["status"] = "done";
  result["reason"] = report::diagnosis_sentence(*found);
  result["folder"] = std::filesystem::absolute(folder).string();
  result["diagnosis"] = report::diagnosis_json(*found);
}

}  // namespace

int diagnose_job() {
  step_back();
  keep_freed_memory();
  Json result = {{"type", "result"}, {"campaign", ""}, {"status", "failed"}, {"reason", ""}};
  try {
    const Json job = Json::parse(std::cin);
    // The daemon may have ended before PR_SET_PDEATHSIG took effect.
    if (::getppid() != job.at("parent").get<pid_t>()) return kNegative;
    work(job, result);
  } catch (const std::bad_alloc&) {
    result["reason"] = "The diagnosis failed: it needs more memory than it is given.";
  } catch (const std::exception& trouble) {
    result["reason"] = fmt::format("The diagnosis failed: {}.", trouble.what());
  }
  put(result);
  return kOk;
}

}  // namespace shaker::cli
