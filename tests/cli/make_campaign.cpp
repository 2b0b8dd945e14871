// make_campaign DIRECTORY TABLE.csv MODEL.json [RAW.csv | CYCLES]: writes a campaign database and
// prints its path.
//
// A line of TABLE.csv is a run: frequency,amplitude,u0,u1,... without a header. Every run gets
// three accepted cycles (the displacement of the table with +1e-5, -1e-5 and 0 added at every
// other point) and one cycle that was left out; with CYCLES, other than 3, so many accepted cycles
// with noise at every point. It also gets three raw samples, or those of RAW.csv, which has a column
// t and one for each channel, with its name.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "config/model.hpp"
#include "record/campaign_database.hpp"

namespace {

using namespace shaker;

record::CycleRow cycle_of(const std::vector<double>& row, int run, int index, int accepted) {
  record::CycleRow cycle;
  cycle.run = run;
  cycle.index = index + 5;  // settling took five cycles
  cycle.accepted = index < accepted;
  cycle.frequency_hz = row[0];
  cycle.amplitude = row[1];
  cycle.displacement.assign(row.begin() + 2, row.end());
  if (accepted != 3) {
    for (std::size_t i = 0; i < cycle.displacement.size(); ++i)
      cycle.displacement[i] +=
          1e-5 * std::sin(12345.678 * std::pow(97.0 * index + static_cast<double>(i), 2));
    return cycle;
  }
  const double shift = index == 0 ? 1e-5 : index == 1 ? -1e-5 : index == 2 ? 0.0 : 1.0;
  for (std::size_t i = 0; i < cycle.displacement.size(); i += 2)
    cycle.displacement[i] += shift;
  return cycle;
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');)
    fields.push_back(field);
  return fields;
}

std::vector<record::SampleRow> samples_of(const char* file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  const auto names = fields_of(line);
  std::vector<record::SampleRow> samples;
  while (std::getline(in, line)) {
    const auto fields = fields_of(line);
    for (std::size_t b = 1; b < fields.size(); ++b)
      samples.push_back({static_cast<std::int64_t>(1e9 * std::stod(fields[0]) + 0.5),
                         std::stod(fields[b]), *protocol::channel_from_name(names[b]), 0});
  }
  return samples;
}

int trouble(const Error& error) {
  std::fprintf(stderr, "%s\n", error.what.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) return 2;
  const auto model = config::load_model(argv[3]);
  if (!model) return trouble(model.error());
  record::CampaignRow campaign;
  campaign.name = "known";
  campaign.started_utc = "2026-03-01T12:00:00.000Z";
  campaign.rig = "none";
  campaign.spec_json = R"({"reference_mass": 1})";
  campaign.model_json = config::to_json_text(*model);
  campaign.auxiliary = {{protocol::Channel::aux1, {"gas_pressure", "Pa"}}};
  auto writer = record::CampaignWriter::create(argv[1], campaign);
  if (!writer) return trouble(writer.error());
  const std::string more = argc == 5 ? argv[4] : "";
  const bool raw = more.ends_with(".csv");
  const int accepted = raw || more.empty() ? 3 : std::stoi(more);
  std::ifstream table(argv[2]);
  int run = 0;
  for (std::string line; std::getline(table, line); ++run) {
    std::vector<double> row;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');)
      row.push_back(std::stod(field));
    auto done = writer->add_run({run, "r0" + std::to_string(run + 1), row[0], row[1], accepted});
    for (int index = 0; done && index <= accepted; ++index) {
      done = writer->add_cycle(cycle_of(row, run, index, accepted));
    }
    const record::SampleRow samples[] = {{1'000'000'000, 0.125, protocol::Channel::displacement, 0},
                                         {1'001'000'000, -2.5, protocol::Channel::excitation, 1},
                                         {1'002'000'000, 1e6, protocol::Channel::aux1, 0}};
    if (done)
      done =
          raw ? writer->add_samples(run, samples_of(argv[4])) : writer->add_samples(run, samples);
    if (!done) return trouble(done.error());
  }
  if (auto done = writer->finish("success", "2026-03-01T12:01:00.000Z"); !done) {
    return trouble(done.error());
  }
  std::printf("%s\n", writer->file().c_str());
  return 0;
}
