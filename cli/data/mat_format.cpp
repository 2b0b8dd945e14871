// MAT files of version 7.3 by libmatio: MATLAB, Octave and h5py read them.
#include <array>
#include <cctype>
#include <matio.h>
#include <memory>

#include <fmt/format.h>

#include "cli/data/formats.hpp"
#include "cli/data/out_file.hpp"

namespace shaker::cli {
namespace {

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

// libmatio copies the values that it gets.
Variable numbers(const std::string& name, const std::vector<double>& values, std::size_t rows,
                 std::size_t columns) {
  std::array<std::size_t, 2> size = {rows, columns};
  return Variable(Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size.data(),
                                const_cast<double*>(values.data()), 0));
}
Variable column(const std::string& name, const std::vector<double>& values) {
  return numbers(name, values, values.size(), 1);
}
Variable number(const std::string& name, double value) {
  return numbers(name, {value}, 1, 1);
}
Variable text(const std::string& name, const std::string& value) {
  std::array<std::size_t, 2> size = {value.empty() ? 0U : 1U, value.size()};
  return Variable(Mat_VarCreate(name.c_str(), MAT_C_CHAR, MAT_T_UTF8, 2, size.data(),
                                const_cast<char*>(value.data()), 0));
}

// A valid field name in MATLAB: a letter, then letters, digits and '_'.
std::string field_name(const std::string& wanted) {
  std::string name;
  for (const char c : wanted)
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name.empty() || std::isalpha(static_cast<unsigned char>(name[0])) == 0 ? "x" + name : name;
}

Variable structure(const std::string& name, std::vector<Variable> fields) {
  std::vector<const char*> names;
  for (const Variable& field : fields)
    names.push_back(field->name);
  std::array<std::size_t, 2> size = {1, 1};
  Variable made(Mat_VarCreateStruct(name.c_str(), 2, size.data(), names.data(),
                                    static_cast<unsigned>(names.size())));
  for (Variable& field : fields) {
    const std::string key = field->name;
    Mat_VarSetStructFieldByName(made.get(), key.c_str(), 0, field.release());  // the struct owns it
  }
  return made;
}

// One cycle in each column. Cycles whose length differs from the first one are left out.
Variable matrix(const std::string& name, const ExportRun& run,
                std::vector<double> record::CycleRow::*channel) {
  const std::size_t points = run.cycles.empty() ? 0 : (run.cycles.front().*channel).size();
  std::vector<double> values;
  for (const record::CycleRow& cycle : run.cycles) {
    if ((cycle.*channel).size() == points)
      values.insert(values.end(), (cycle.*channel).begin(), (cycle.*channel).end());
  }
  return numbers(name, values, points, points == 0 ? 0 : values.size() / points);
}

Variable samples(const ExportRun& run) {
  std::vector<Variable> channels;
  for (const ExportChannel& channel : run.channels) {
    std::vector<Variable> fields;
    fields.push_back(column("t", channel.t));
    fields.push_back(column("value", channel.value));
    fields.push_back(column("quality", {channel.quality.begin(), channel.quality.end()}));
    fields.push_back(text("unit", channel.unit));
    channels.push_back(structure(field_name(channel.name), std::move(fields)));
  }
  return structure("samples", std::move(channels));
}

Variable run_variable(const ExportRun& run, std::size_t index) {
  std::vector<double> accepted, frequency, amplitude, number_of;
  for (const record::CycleRow& cycle : run.cycles) {
    accepted.push_back(cycle.accepted ? 1.0 : 0.0);
    frequency.push_back(cycle.frequency_hz);
    amplitude.push_back(cycle.amplitude);
    number_of.push_back(static_cast<double>(cycle.index));
  }
  std::vector<Variable> fields;
  fields.push_back(text("name", run.row.name));
  fields.push_back(number("frequency_hz", run.row.frequency_hz));
  fields.push_back(number("amplitude", run.row.amplitude));
  fields.push_back(matrix("displacement", run, &record::CycleRow::displacement));
  fields.push_back(text("displacement_unit", "m"));
  fields.push_back(matrix("excitation", run, &record::CycleRow::excitation));
  fields.push_back(text("excitation_unit", "m/s^2"));
  fields.push_back(column("cycle", number_of));
  fields.push_back(column("accepted", accepted));
  fields.push_back(column("cycle_frequency_hz", frequency));
  fields.push_back(column("cycle_amplitude", amplitude));
  if (!run.channels.empty()) fields.push_back(samples(run));
  return structure(fmt::format("run{}", index + 1), std::move(fields));
}

Variable campaign_variable(const ExportData& data) {
  const record::CampaignRow& c = data.campaign;
  std::vector<Variable> fields;
  for (const auto& [name, value] :
       {std::pair{"name", &c.name}, std::pair{"rig", &c.rig},
        std::pair{"started_utc", &c.started_utc}, std::pair{"finished_utc", &c.finished_utc},
        std::pair{"status", &c.status}, std::pair{"specification_json", &c.spec_json},
        std::pair{"model_json", &c.model_json}})
    fields.push_back(text(name, *value));
  fields.push_back(number("runs", static_cast<double>(data.runs.size())));
  return structure("campaign", std::move(fields));
}

}  // namespace

Result<std::vector<Written>> write_mat(const ExportData& data,
                                       const std::filesystem::path& folder) {
  Written file{"", folder / (export_name(data, "export") + ".mat"), 0};
  OutFile out(file.file);
  out.close();
  const auto trouble = [&] {
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot be written as a MAT file; check free space and "
                             "that this user may write there",
                             file.file.string())};
  };
  using Handle = std::unique_ptr<mat_t, int (*)(mat_t*)>;
  Handle mat(Mat_CreateVer(out.part().c_str(), nullptr, MAT_FT_MAT73), &Mat_Close);
  if (!mat) return trouble();
  const auto write = [&](const Variable& variable) {
    return Mat_VarWrite(mat.get(), variable.get(), MAT_COMPRESSION_ZLIB) == 0;
  };
  bool good = write(campaign_variable(data));
  for (std::size_t i = 0; i < data.runs.size(); ++i) {
    good = good && write(run_variable(data.runs[i], i));
    file.count += data.runs[i].cycles.size();
  }
  if (Mat_Close(mat.release()) != 0 || !good) return trouble();
  if (auto done = out.finish(); !done) return done.error();
  return std::vector{file};
}

}  // namespace shaker::cli
