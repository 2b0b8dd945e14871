#include "cli/push/layout.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace shaker::cli {
namespace {

constexpr const char* kPushTables = R"sql(
CREATE TABLE layout(version integer NOT NULL);
CREATE TABLE campaign(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  host text NOT NULL, rig text NOT NULL, name text NOT NULL, started_utc timestamptz NOT NULL,
  finished_utc timestamptz, status text NOT NULL, complete boolean NOT NULL DEFAULT false,
  file text NOT NULL, model text NOT NULL, campaign_file json, model_file json,
  UNIQUE(host, rig, name, started_utc));
CREATE TABLE run(
  campaign bigint NOT NULL REFERENCES campaign ON DELETE CASCADE, run integer NOT NULL,
  name text NOT NULL, frequency_hz double precision NOT NULL, amplitude double precision NOT NULL,
  cycles_wanted integer NOT NULL, PRIMARY KEY(campaign, run));
CREATE TABLE cycle(
  campaign bigint NOT NULL, run integer NOT NULL, cycle bigint NOT NULL,
  accepted boolean NOT NULL, frequency_hz double precision NOT NULL,
  amplitude double precision NOT NULL, excitation_error double precision NOT NULL,
  displacement double precision[] NOT NULL, excitation double precision[] NOT NULL,
  PRIMARY KEY(campaign, run, cycle), FOREIGN KEY(campaign, run) REFERENCES run ON DELETE CASCADE);
CREATE TABLE estimate(
  campaign bigint NOT NULL REFERENCES campaign ON DELETE CASCADE, seq bigint NOT NULL,
  utc timestamptz, run text, cycle bigint, cycles_used bigint NOT NULL,
  usable boolean NOT NULL, intervals_hold boolean NOT NULL,
  gap double precision, noise_floor double precision, document json NOT NULL,
  PRIMARY KEY(campaign, seq));
CREATE TABLE parameter(
  campaign bigint NOT NULL, seq bigint NOT NULL, name text NOT NULL, unit text NOT NULL,
  value double precision, standard_error double precision,
  lower double precision, upper double precision, fixed boolean NOT NULL,
  PRIMARY KEY(campaign, seq, name),
  FOREIGN KEY(campaign, seq) REFERENCES estimate ON DELETE CASCADE);
CREATE TABLE alarm(
  campaign bigint NOT NULL REFERENCES campaign ON DELETE CASCADE, seq bigint NOT NULL,
  utc timestamptz, severity text NOT NULL, code text NOT NULL, text text NOT NULL,
  document json NOT NULL, PRIMARY KEY(campaign, seq));
CREATE TABLE fact(
  campaign bigint NOT NULL REFERENCES campaign ON DELETE CASCADE, fact integer NOT NULL,
  kind text NOT NULL, name text NOT NULL, value text NOT NULL, utc text NOT NULL,
  sha256 text NOT NULL, PRIMARY KEY(campaign, fact));
COMMENT ON TABLE campaign IS 'One campaign database of shakerd; raw samples stay in its file';
COMMENT ON COLUMN campaign.complete IS 'The campaign has ended, and all of it is here';
COMMENT ON COLUMN run.amplitude IS 'Asked of the table, m/s^2';
COMMENT ON COLUMN cycle.amplitude IS 'Measured at the table, m/s^2';
COMMENT ON COLUMN cycle.excitation_error IS 'Standard error of its harmonics, m/s^2';
COMMENT ON COLUMN cycle.displacement IS 'Stroke on equal steps of phase, m';
COMMENT ON COLUMN cycle.excitation IS 'Acceleration of the table on the same steps, m/s^2';
COMMENT ON COLUMN estimate.gap IS 'Measurement minus model, root mean square, in the unit of the model';
COMMENT ON COLUMN estimate.noise_floor IS 'What noise explains of the gap';
COMMENT ON COLUMN parameter.lower IS 'Of the 95 % interval';
)sql";

}  // namespace

bool is_schema_name(const std::string& name) {
  const auto good = [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; };
  const auto later = [&](char c) { return good(c) || (c >= '0' && c <= '9'); };
  return !name.empty() && name.size() <= 63 && good(name[0]) && std::ranges::all_of(name, later);
}

std::string layout_sql(const std::string& schema) {
  return fmt::format(
      "CREATE SCHEMA IF NOT EXISTS \"{0}\";\nSET search_path = \"{0}\";{1}"
      "INSERT INTO layout VALUES ({2});\n",
      schema, kPushTables, kPushLayout);
}

}  // namespace shaker::cli
