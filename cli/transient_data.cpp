#include "cli/transient_data.hpp"

#include <fmt/format.h>

#include "cli/csv.hpp"
#include "cli/model_units.hpp"

namespace shaker::cli {
namespace {

constexpr std::size_t kFewest = 4;

}  // namespace

Result<estimator::TransientRecord> transient_from_csv(const std::filesystem::path& file,
                                                      const std::string& length_unit) {
  auto table =
      read_csv(file, {{"t", "excitation", "displacement"}, {"t", "displacement"}, {"t", "y"}});
  if (!table) return table.error();
  if (auto good = to_model_units(*table, file.string(), {length_unit}); !good) return good.error();
  estimator::TransientRecord record;
  record.name = file.string();
  record.t = table->columns.at("t");
  if (record.t.size() < kFewest) {
    return Error{ErrorKind::invalid, fmt::format("{}: {} rows; at least {} are needed",
                                                 file.string(), record.t.size(), kFewest)};
  }
  for (std::size_t i = 1; i < record.t.size(); ++i) {
    if (record.t[i] > record.t[i - 1]) continue;
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: time does not increase: t = {:.9g} is followed by {:.9g} (row {})",
                    file.string(), record.t[i - 1], record.t[i], i + 1)};
  }
  const auto found = table->columns.find("displacement");
  record.displacement = found != table->columns.end() ? found->second : table->columns.at("y");
  if (const auto x = table->columns.find("excitation"); x != table->columns.end())
    record.excitation = estimator::Excitation::sampled(record.t, x->second);
  return record;
}

}  // namespace shaker::cli
