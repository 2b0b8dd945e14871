#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/config_check.hpp"

namespace shaker::cli {

int check(const Common& common, const CheckOptions& options) {
  const CheckReport report = check_file(options.file, options.rig);
  const bool good = report.errors.empty();
  if (common.json) {
    const nlohmann::ordered_json body = {
        {"file", options.file.string()}, {"kind", report.kind},         {"good", good},
        {"facts", report.facts},         {"warnings", report.warnings}, {"errors", report.errors}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    return good ? kOk : kBadInput;
  }
  for (const std::string& line : report.facts)
    fmt::print("{}\n", line);
  for (const std::string& line : report.warnings)
    fmt::print("warning: {}\n", line);
  std::fflush(stdout);
  for (const std::string& line : report.errors)
    fmt::print(stderr, "{}\n", line);
  if (good) {
    fmt::print("{}: a good {} file\n", options.file.string(), report.kind);
    return kOk;
  }
  if (!report.bad_rig.empty()) {
    fmt::print(stderr, "shakerctl: {}: not a good rig file; {} was not checked against it\n",
               report.bad_rig, options.file.string());
    return kBadInput;
  }
  fmt::print(stderr, "shakerctl: {}: not a good {} file\n", options.file.string(),
             report.kind.empty() ? "configuration" : report.kind);
  return kBadInput;
}

}  // namespace shaker::cli
