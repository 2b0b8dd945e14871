#include "cli/opened_campaign.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "cli/campaign_folder.hpp"
#include "cli/campaign_place.hpp"
#include "estimator/model/run_models.hpp"
#include "record/campaign_files.hpp"

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;
using estimator::diagnosis::Campaign;
using estimator::diagnosis::Recording;

Error not_opened(const fs::path& path, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("{}: {}", path.string(), why)};
}

Result<record::CampaignRow> row_in(const fs::path& database) {
  const auto reader = record::CampaignReader::open(database);
  if (!reader) return reader.error();
  return reader->campaign();
}

std::string own_name(const fs::path& place) {
  const fs::path whole = place.filename().empty() ? place.parent_path() : place;
  return whole.stem().string();
}

// Adds the runs of `next`. Runs of one name in two campaigns are told apart by the campaign's.
Result<void> join(Campaign& all, Campaign next, const fs::path& place) {
  for (const Recording& run : next.runs) {
    for (const Recording& other : all.runs) {
      if (!run.displacement.empty() && run.displacement == other.displacement &&
          run.force == other.force)
        return held_twice(place, run.name, other.name);
    }
  }
  const std::string name = own_name(place);
  std::set<std::string> taken;
  for (const Recording& run : all.runs)
    taken.insert(run.name);
  for (Recording& run : next.runs) {
    if (taken.contains(run.name)) run.name = fmt::format("{}/{}", name, run.name);
    for (int copy = 2; taken.contains(run.name); ++copy)
      run.name = fmt::format("{}/{}#{}", name, run.name, copy);
    taken.insert(run.name);
    all.runs.push_back(std::move(run));
  }
  all.warnings.insert(all.warnings.end(), next.warnings.begin(), next.warnings.end());
  for (std::string& input : next.inputs) {
    if (std::find(all.inputs.begin(), all.inputs.end(), input) == all.inputs.end())
      all.inputs.push_back(std::move(input));
  }
  return {};
}

bool all_state(const Campaign& campaign, const std::string& condition) {
  return std::all_of(campaign.runs.begin(), campaign.runs.end(), [&](const Recording& run) {
    return run.condition.values.contains(condition);
  });
}

// Parameters that the diagnosis takes as the same in all runs although they differ: what goes with
// a condition of every run it does not.
std::string taken_as_one(config::ModelSpec model, const Campaign& campaign) {
  for (config::EffectSpec& line : model.effects) {
    const config::Driven parts = config::driven(line.effect);
    if (all_state(campaign, std::string(parts.input))) line.effect = std::string(parts.effect);
    for (auto& [symbol, parameter] : line.parameters) {
      const config::RunVariation& v = parameter.variation;
      if (v.over.empty() || all_state(campaign, v.condition())) parameter.variation = {};
    }
  }
  return estimator::taken_as_one(model, "a diagnosis");
}

}  // namespace

Place place_of(const fs::path& path) {
  std::error_code none;
  if (fs::is_directory(path, none))
    return fs::exists(path / "campaign.json", none) ? Place::folder : Place::other;
  return is_database(path) ? Place::database : Place::other;
}

Result<void> expect_campaign(const fs::path& path) {
  std::error_code none;
  if (!fs::exists(path, none))
    return not_opened(path,
                      "there is no such campaign; give a campaign database (.db), or a "
                      "folder with campaign.json and a CSV file for each run");
  if (place_of(path) != Place::other) return {};
  if (!fs::is_directory(path, none))
    return not_opened(path, "is neither a campaign's folder nor a campaign database (.db)");
  if (const auto newest = record::find_campaign(path, ""))
    return not_opened(path, fmt::format("is a folder without campaign.json; give one of its "
                                        "campaign databases, the newest is {}",
                                        newest->string()));
  return not_opened(path,
                    "is a folder without a campaign; give a campaign database (.db), or a "
                    "folder with campaign.json and a CSV file for each run");
}

Error held_twice(const fs::path& place, const std::string& run, const std::string& before) {
  return not_opened(place,
                    fmt::format("its run {} has the samples of run {} of a campaign before "
                                "it, whose noise would count twice; leave one of the two out",
                                run, before));
}

Result<config::ModelSpec> model_of_campaigns(const std::vector<fs::path>& places,
                                             const fs::path& model) {
  if (!model.empty()) return config::load_model(model);
  std::string first_text;
  fs::path first;
  for (const fs::path& place : places) {
    if (place_of(place) != Place::database) continue;
    const auto row = row_in(place);
    if (!row) return row.error();
    if (!first.empty() && row->model_json != first_text)
      return not_opened(place, fmt::format("holds another model than {}; say with --model "
                                           "MODEL.json which one to take",
                                           first.string()));
    if (first.empty()) first_text = row->model_json;
    if (first.empty()) first = place;
  }
  if (first.empty())
    return not_opened(places.front(),
                      "only a campaign database (.db) knows its model; give --model MODEL.json");
  return config::parse_model(first_text, first.string() + " (its model)");
}

Result<OpenedCampaign> open_campaigns(const std::vector<fs::path>& places, const fs::path& model) {
  for (const fs::path& place : places) {
    if (auto good = expect_campaign(place); !good) return good.error();
  }
  auto spec = model_of_campaigns(places, model);
  if (!spec) return spec.error();
  OpenedCampaign opened;
  opened.model = std::move(*spec);
  for (const fs::path& place : places) {
    if (!opened.row && place_of(place) == Place::database) {
      auto row = row_in(place);
      if (!row) return row.error();
      opened.row = std::move(*row);
    }
    const double gravity = opened.model.gravity;
    auto next = read_campaign(place, opened.model);
    if (!next) return next.error();
    if (&place != &places.front() && opened.model.gravity != gravity)
      return not_opened(place, fmt::format("has a gravity of {:.6g}, the campaign before it one of "
                                           "{:.6g}; diagnose them apart",
                                           opened.model.gravity, gravity));
    if (&place == &places.front())
      opened.campaign = std::move(*next);
    else if (auto joined = join(opened.campaign, std::move(*next), place); !joined)
      return joined.error();
  }
  if (auto why = taken_as_one(opened.model, opened.campaign); !why.empty())
    opened.campaign.warnings.push_back(std::move(why));
  return opened;
}

}  // namespace shaker::cli
