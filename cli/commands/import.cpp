// Imports measurements of other programs into a campaign's folder.
#include <algorithm>
#include <cctype>
#include <cstdio>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cli/campaign_place.hpp"
#include "cli/commands.hpp"
#include "cli/data/import_data.hpp"

namespace shaker::cli {
namespace {

// "displacement=mm" for every channel that the option names.
Result<ByChannel> pairs_of(const std::vector<std::string>& words, const char* option) {
  ByChannel pairs;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    const std::string channel = word.substr(0, equals);
    if (equals == word.npos || equals + 1 == word.size() ||
        std::ranges::find(kImportChannels, channel) == std::end(kImportChannels))
      return Error{ErrorKind::invalid,
                   fmt::format("{} {}: CHANNEL=NAME is wanted, with one of the channels {}", option,
                               word, fmt::join(kImportChannels, ", "))};
    pairs[channel] = word.substr(equals + 1);
  }
  return pairs;
}

Result<ImportData> read_source(const std::filesystem::path& source, const ByChannel& columns) {
  std::error_code none;
  if (!std::filesystem::exists(source, none))
    return Error{ErrorKind::io, fmt::format("{}: there is no such file", source.string())};
  std::string extension = source.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (std::filesystem::is_directory(source, none) || extension == ".csv")
    return read_csv_folder(source, columns);
  if (extension == ".mat") return read_mat(source, columns);
  if (extension == ".uff" || extension == ".unv") return read_uff(source, columns);
  if (is_database(source))
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: is a campaign database, which `estimate` and `diagnose` read as it "
                    "is",
                    source.string())};
  return Error{
      ErrorKind::invalid,
      fmt::format("{}: a folder of CSV files, or a file .csv, .mat, .uff or .unv is wanted",
                  source.string())};
}

}  // namespace

int import_campaign(const Common& common, const ImportOptions& options) {
  const auto units = pairs_of(options.units, "--unit");
  if (!units) return fail(common, kBadInput, units.error().what);
  const auto columns = pairs_of(options.columns, "--column");
  if (!columns) return fail(common, kBadInput, columns.error().what);
  const ImportWanted wanted = {*units,
                               *columns,
                               options.frequencies_hz,
                               options.amplitudes,
                               options.kind,
                               options.reference_mass};
  auto data = read_source(options.source, wanted.columns);
  if (!data) return fail(common, kBadInput, data.error().what);
  data->facts.emplace_back("imported_from", options.source.filename().string());
  if (auto good = complete(*data, wanted); !good)
    return fail(common, kBadInput,
                fmt::format("{}: {}", options.source.string(), good.error().what));
  if (auto done = write_campaign_folder(options.out, *data, wanted); !done)
    return fail(common, kBadInput, done.error().what);
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (const ImportRun& run : data->runs) {
    std::vector<std::string> channels;
    for (const char* channel : kImportChannels)
      if (run.columns.contains(channel)) channels.emplace_back(channel);
    const std::size_t points = run.columns.at("t").values.size();
    runs.push_back({{"name", run.name}, {"points", points}, {"channels", channels}});
    if (!common.json)
      fmt::print("{}: {} points of {}\n", run.name, points, fmt::join(channels, ", "));
  }
  for (const std::string& title : data->left_out)
    fmt::print(stderr, "left out, since a campaign has no such channel: {}\n", title);
  if (common.json) {
    const nlohmann::ordered_json body = {{"folder", options.out.string()}, {"runs", runs}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    fmt::print("{}\n", (options.out / "campaign.json").string());
  }
  return kOk;
}

}  // namespace shaker::cli
