// MAT files as an import's source, by libmatio: versions 4, 5 and 7.3.
#include <functional>
#include <hdf5.h>
#include <matio.h>
#include <memory>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/csv.hpp"
#include "cli/data/import_data.hpp"

namespace shaker::cli {
namespace {

struct FreeRead {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using ReadVariable = std::unique_ptr<matvar_t, FreeRead>;

// A field of a struct, or a variable of the file; nullptr where there is none.
using Find = std::function<const matvar_t*(const std::string&)>;

struct Matrix {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;  // column by column
};

// The message when what was looked for is not what is there.
struct Place {
  std::string file, variable;
  Error wrong(const std::string& field, const std::string& why) const {
    return {ErrorKind::invalid, fmt::format("{}: {}{}{}{}{}", file, variable,
                                            variable.empty() || field.empty() ? "" : ".", field,
                                            variable.empty() && field.empty() ? "" : " ", why)};
  }
};

std::size_t elements_of(const matvar_t& v) {
  if (v.rank < 1 || v.dims == nullptr) return 0;
  return std::accumulate(v.dims, v.dims + v.rank, std::size_t{1}, std::multiplies<>());
}

bool is_empty(const matvar_t& v) {
  if (v.dims == nullptr) return true;
  for (int d = 0; d < v.rank; ++d)
    if (v.dims[d] == 0) return true;
  return v.rank < 1 || v.data == nullptr;
}

template <class Number>
void append(const matvar_t& v, std::size_t count, std::vector<double>& values) {
  const auto* from = static_cast<const Number*>(v.data);
  values.assign(from, from + count);
}

Result<Matrix> matrix_of(const matvar_t& v, const Place& place, const std::string& field) {
  Matrix matrix;
  if (is_empty(v)) return matrix;
  if (v.rank != 2 || v.isComplex != 0) return place.wrong(field, "is no matrix of real numbers");
  matrix.rows = v.dims[0];
  matrix.columns = v.dims[1];
  if (matrix.rows > kMaxCsvRows || matrix.columns > kMaxCsvRows / matrix.rows)
    return place.wrong(field, fmt::format("has more than {} numbers; cut it", kMaxCsvRows));
  const std::size_t count = matrix.rows * matrix.columns;
  const bool single = v.class_type == MAT_C_SINGLE;
  if (!single && v.class_type != MAT_C_DOUBLE)
    return place.wrong(field, "holds no numbers of class double or single; convert it");
  if (count * (single ? sizeof(float) : sizeof(double)) > v.nbytes)
    return place.wrong(field, "is not complete");
  if (single)
    append<float>(v, count, matrix.values);
  else
    append<double>(v, count, matrix.values);
  return matrix;
}

std::string text_of(const matvar_t* v) {
  if (v == nullptr || v->class_type != MAT_C_CHAR || is_empty(*v)) return "";
  const std::size_t count = elements_of(*v);
  std::string text;
  const bool wide = v->data_type == MAT_T_UINT16 || v->data_type == MAT_T_UTF16;
  for (std::size_t i = 0; i < count && (i + 1) * (wide ? 2 : 1) <= v->nbytes; ++i) {
    const unsigned letter = wide ? static_cast<const std::uint16_t*>(v->data)[i]
                                 : static_cast<const std::uint8_t*>(v->data)[i];
    if (!wide || letter < 0x80) {
      text += static_cast<char>(letter);
    } else {  // UTF-8 of two bytes: enough for ² and µ
      text += static_cast<char>(0xC0 | ((letter >> 6) & 0x1F));
      text += static_cast<char>(0x80 | (letter & 0x3F));
    }
  }
  return text;
}

// The lookup of the fields of an element. libmatio's own one fails on a damaged struct, whose
// names or values are missing.
Find fields_of(const matvar_t& v, std::size_t index) {
  return [&v, index](const std::string& name) -> const matvar_t* {
    const std::size_t count = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&v));
    char* const* names = Mat_VarGetStructFieldnames(&v);
    if (names == nullptr || v.data == nullptr) return nullptr;
    const auto* const* fields = static_cast<const matvar_t* const*>(v.data);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = index * count + k;
      if (names[k] != nullptr && name == names[k] && (at + 1) * sizeof(*fields) <= v.nbytes)
        return fields[at];
    }
    return nullptr;
  };
}

class RunReader {
 public:
  RunReader(Find find, Place place, const ByChannel& columns)
      : find_(std::move(find)), place_(std::move(place)), columns_(columns) {}

  bool is_run() const { return find_(field("displacement")) != nullptr; }

  Result<ImportRun> read() {
    run_.name = text_of(find_("name"));
    if (run_.name.empty()) run_.name = place_.variable;
    for (const auto& [name, number] : {std::pair{"frequency_hz", &ImportRun::frequency_hz},
                                       std::pair{"amplitude", &ImportRun::amplitude}}) {
      const auto found = column(name);
      if (!found) return found.error();
      if (found->size() == 1) run_.*number = found->front();
    }
    auto done = find_(field("t")) != nullptr ? read_columns() : read_cycles();
    if (!done) return done.error();
    return std::move(run_);
  }

 private:
  std::string field(const std::string& channel) const {
    const auto given = columns_.find(channel);
    return given == columns_.end() ? channel : given->second;
  }
  Result<Matrix> matrix(const std::string& name) const {
    const matvar_t* found = find_(name);
    return found == nullptr ? Matrix{} : matrix_of(*found, place_, name);
  }
  Result<std::vector<double>> column(const std::string& name) const {
    auto found = matrix(name);
    if (!found) return found.error();
    if (found->rows > 1 && found->columns > 1)
      return place_.wrong(name, fmt::format("is a matrix of {} x {}, and \"{}\" has one column",
                                            found->rows, found->columns, field("t")));
    return std::move(found->values);
  }
  void keep(const std::string& channel, std::vector<double> values) {
    if (!values.empty())
      run_.columns[channel] = {std::move(values), text_of(find_(field(channel) + "_unit"))};
  }

  Result<void> read_columns() {
    for (const char* channel : kImportChannels) {
      auto found = column(field(channel));
      if (!found) return found.error();
      keep(channel, std::move(*found));
    }
    return {};
  }

  // A cycle in each column, as `shakerctl export --format mat` writes it.
  Result<void> read_cycles() {
    const auto stroke = matrix(field("displacement"));
    const auto accepted = column("accepted"), number = column("cycle"),
               frequency = column("cycle_frequency_hz"), amplitude = column("cycle_amplitude");
    for (const auto* each : {&accepted, &number, &frequency, &amplitude})
      if (!*each) return each->error();
    if (!stroke) return stroke.error();
    if (!frequency->empty())
      run_.frequency_hz = std::accumulate(frequency->begin(), frequency->end(), 0.0) /
                          static_cast<double>(frequency->size());
    if (!run_.frequency_hz || !(*run_.frequency_hz > 0.0))
      return place_.wrong("", "has neither t nor frequency_hz, so that its times are not known");
    std::vector<std::size_t> kept;
    std::vector<double> t;
    for (std::size_t c = 0; c < stroke->columns; ++c) {
      if (c < accepted->size() && (*accepted)[c] == 0.0) continue;
      kept.push_back(c);
      const double cycle = c < number->size() ? (*number)[c] : static_cast<double>(c);
      for (std::size_t i = 0; i < stroke->rows; ++i)
        t.push_back((cycle + static_cast<double>(i) / static_cast<double>(stroke->rows)) /
                    *run_.frequency_hz);
    }
    keep("t", std::move(t));
    for (const char* channel : {"displacement", "excitation", "acceleration", "force"}) {
      const auto found = matrix(field(channel));
      if (!found) return found.error();
      if (found->values.empty()) continue;
      if (found->rows != stroke->rows || found->columns != stroke->columns)
        return place_.wrong(field(channel), "has another size than the displacement");
      std::vector<double> values;
      for (const std::size_t c : kept)
        values.insert(values.end(), &found->values[c * found->rows],
                      &found->values[c * found->rows] + found->rows);
      keep(channel, std::move(values));
    }
    if (!run_.columns.contains("excitation") && !amplitude->empty())
      run_.amplitude = std::accumulate(amplitude->begin(), amplitude->end(), 0.0) /
                       static_cast<double>(amplitude->size());
    return {};
  }

  Find find_;
  Place place_;
  const ByChannel& columns_;
  ImportRun run_;
};

void take_facts(const matvar_t& campaign, ImportData& data) {
  const Find find = fields_of(campaign, 0);
  if (auto name = text_of(find("name")); !name.empty()) data.name = std::move(name);
  for (const char* key : {"rig", "started_utc", "finished_utc", "status"})
    if (auto said = text_of(find(key)); !said.empty())
      data.facts.emplace_back(key, std::move(said));
  data.model_json = text_of(find("model_json"));
}

// Damaged files are told in our own words.
void silence_hdf5() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Result<std::vector<ReadVariable>> variables_of(const std::filesystem::path& file) {
  silence_hdf5();
  using Handle = std::unique_ptr<mat_t, int (*)(mat_t*)>;
  const Handle mat(Mat_Open(file.c_str(), MAT_ACC_RDONLY), &Mat_Close);
  if (!mat)
    return Error{ErrorKind::invalid, fmt::format("{}: is no MAT file, or cannot be read; MATLAB's "
                                                 "save and Octave's save -v7 write one",
                                                 file.string())};
  std::size_t count = 0;
  Mat_GetDir(mat.get(), &count);
  std::vector<ReadVariable> variables;
  while (matvar_t* next = Mat_VarReadNext(mat.get()))
    variables.emplace_back(next);
  if (variables.size() == count) return variables;
  return Error{ErrorKind::invalid,
               fmt::format("{}: {} of its {} variables can be read; is the file complete?",
                           file.string(), variables.size(), count)};
}

}  // namespace

Result<ImportData> read_mat(const std::filesystem::path& file, const ByChannel& columns) {
  const auto variables = variables_of(file);
  if (!variables) return variables.error();
  ImportData data;
  data.name = file.stem().string();
  std::vector<std::string> names;
  const auto add = [&](const Find& find, const std::string& variable) -> Result<void> {
    RunReader reader(find, {file.string(), variable}, columns);
    if (!reader.is_run()) return {};
    auto run = reader.read();
    if (!run) return run.error();
    if (run->name.empty()) run->name = data.name;
    data.runs.push_back(std::move(*run));
    return {};
  };
  for (const ReadVariable& v : *variables) {
    const std::string name = v->name == nullptr ? "" : v->name;
    names.push_back(name);
    if (v->class_type != MAT_C_STRUCT) continue;
    if (name == "campaign") take_facts(*v, data);
    const std::size_t count = elements_of(*v);
    if (count > kMaxCsvRows) continue;
    for (std::size_t i = 0; i < count; ++i) {
      auto done = add(fields_of(*v, i), count == 1 ? name : fmt::format("{}({})", name, i + 1));
      if (!done) return done.error();
    }
  }
  const Find flat = [&](const std::string& wanted) -> const matvar_t* {
    for (const ReadVariable& v : *variables)
      if (v->name != nullptr && wanted == v->name && v->class_type != MAT_C_STRUCT) return v.get();
    return nullptr;
  };
  if (auto done = add(flat, ""); !done) return done.error();
  if (data.runs.empty())
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: holds no run: none of its variables ({}) is \"displacement\", or a "
                    "struct with that field; name the fields with --column CHANNEL=NAME",
                    file.string(), fmt::join(names, ", "))};
  return data;
}

}  // namespace shaker::cli
