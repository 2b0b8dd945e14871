/// \file
/// What a campaign's file says of a run beside its motion: its group, and conditions as the gas
/// temperature, the charge or the mass. Parameters that are not the same in all runs go with them.
///
///   {"name": "r02", "group": "warm", "conditions": {"gas_temperature": "35 degC", "charge": 1.02}}
#pragma once

#include <map>
#include <string>
#include <vector>

namespace shaker::config {

class Findings;
class ObjectReader;

/// The group and the conditions of a run.
struct RunCondition {
  std::string run;                       ///< the run's name
  std::string group;                     ///< empty: none is given
  std::map<std::string, double> values;  ///< by name; SI where the file gives a unit

  bool operator==(const RunCondition&) const = default;  ///< \return true: all of it is the same
};

/// Reads "group" and "conditions" of a run. A condition is a number, or a text with a known unit.
/// \param run reader of the run's object
/// \param findings receives what is wrong, with its place
/// \param condition receives group and conditions
void read_condition(ObjectReader& run, Findings& findings, RunCondition& condition);

/// Reads the conditions of the runs in a campaign's text. Runs that say nothing and whatever else
/// it contains are left out.
/// \param campaign the text of a campaign's file
/// \return the conditions, by the runs' names
std::vector<RunCondition> run_conditions(const std::string& campaign);

}  // namespace shaker::config
