// The commands about drops, with their options.
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "cli/command_line.hpp"
#include "cli/completion.hpp"

namespace shaker::cli {
namespace {

// "0.9" or "0.9,1.1".
std::vector<double> value_or_range(const std::string& option, const std::string& text) {
  std::vector<double> values;
  const char *at = text.data(), *end = text.data() + text.size();
  for (;;) {
    double value = 0.0;
    const auto read = std::from_chars(at, end, value);
    if (read.ec != std::errc() || !std::isfinite(value)) break;
    values.push_back(value);
    if (read.ptr == end && values.size() <= 2) return values;
    if (read.ptr == end || *read.ptr != ',') break;
    at = read.ptr + 1;
  }
  throw CLI::ValidationError(
      option, fmt::format("\"{}\" is neither one value nor a range of two numbers FROM,TO; say for "
                          "example {}=0.9 or {}=0.9,1.1",
                          text, option, option));
}

void add_servicing(CLI::App* command, DropOptions& o) {
  const auto range = [&](const char* name, std::vector<double>& ends, const char* help) {
    command->add_option_function<std::string>(
        name, [name, &ends](const std::string& text) { ends = value_or_range(name, text); }, help);
  };
  range("--charge", o.charge,
        "Gas pressure of the extended strut in the drop, over that of the campaign: one value, or "
        "the servicing range FROM,TO");
  range("--oil", o.oil,
        "Oil added, over the gas volume of the extended strut: one value, or FROM,TO");
  range("--temperature", o.temperature,
        "Temperature of gas and oil in the drop, degC: one value, or FROM,TO");
  command->add_option("--tested-temperature", o.tested_temperature,
                      "Temperature of the damper in the campaign, degC (default: 20)");
}

void add_measured(CLI::App* command, DropOptions& o) {
  auto* measured = command->add_option(
      "--measured", o.measured,
      "CSV of a measured drop: t from touch-down, and stroke, load or acceleration");
  command
      ->add_flag(
          "--join", o.join,
          "The measured stroke joins the estimate as one more run: the prediction before and "
          "after")
      ->needs(measured);
  const auto own = [&](const char* name, auto& value, const char* help) {
    return command->add_option(name, value, help)->needs(measured);
  };
  own("--measured-sink-speed", o.measured_sink_speed,
      "Sink speed of the measured drop, m/s (default: as predicted)");
  own("--measured-lift", o.measured_lift, "Likewise, share of the weight");
  own("--measured-mass", o.measured_mass, "Likewise, above the damper, kg")
      ->check(CLI::PositiveNumber);
  own("--measured-noise", o.measured_noise,
      "Standard deviation of its stroke with its unit, as 0.1mm (default: from the record)");
}

void add_drop_conditions(CLI::App* command, DropOptions& o) {
  const auto positive = CLI::PositiveNumber;
  command->add_option("--sink-speed", o.sink_speed, "At touch-down, m/s");
  command->add_option(
      "--lift", o.lift,
      "Lift of the wing, share of the weight, 0 to 1 (default: 0; by a rule, the most "
      "that it allows)");
  command->add_option("--mass", o.mass, "Above the damper, kg: loads in N, energy in J")
      ->check(positive);
  command
      ->add_option("--shaker-mass", o.shaker_mass,
                   "Mass above the damper on the shaker, kg (default: the same)")
      ->check(positive);
  command
      ->add_option("--tyre-stiffness", o.tyre_stiffness,
                   "Stiffness of a tyre below the damper, N/m")
      ->check(positive);
  command->add_option("--tyre-damping", o.tyre_damping, "N s/m (default: 0)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--unsprung-mass", o.unsprung_mass, "On the tyre, kg")->check(positive);
  auto* rule = command
                   ->add_option("--rule", o.rule,
                                "Conditions by 14 CFR 25.723, 23.725, 27.725 or 29.725: with "
                                "--weight and --shaker-mass")
                   ->check(CLI::IsMember({"25.723", "23.725", "27.725", "29.725"}));
  command->add_option("--condition", o.condition, "design, take-off or reserve (default: design)")
      ->check(CLI::IsMember({"design", "take-off", "reserve"}))
      ->needs(rule);
  command->add_option("--weight", o.weight,
                      "Static weight on this gear, with its unit: 12kN, 2700lbf");
  command->add_option("--wing-loading", o.wing_loading,
                      "Wing loading for 23.725, with its unit: 18lbf/ft^2");
  command->add_option("--limit", o.limits,
                      "FIGURE=VALUE with its unit, as peak_load=120kN, peak_stroke=350mm or "
                      "load_factor=2.5: with which probability is it met?");
  command->add_option("--stroke-limit", o.stroke_limit,
                      "Greatest stroke of the strut with its unit, as 350mm: the margin to it, and "
                      "with which probability is it used up? (default: what the model knows)");
  command->add_option("--piston-area", o.piston_area, "m^2: the pressure of the gas is said, too")
      ->check(positive);
  command
      ->add_option(
          "--cd-spread", o.discharge_spread,
          "Prior of C_d beyond the tested velocities: relative standard deviation for each "
          "decade of the Reynolds number (default: none)")
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option("--index-spread", o.index_spread,
                   "Prior of the polytropic index in a drop: standard deviation (default: none)")
      ->check(CLI::Range(0.0, 1.0));
  add_servicing(command, o);
  add_measured(command, o);
}

void add_drop(CLI::App& app, Options& o) {
  auto* dropping = add(app, o, "drop", "Predict a drop test from an identified model",
                       [&o] { return drop(o.common, o.drop); });
  auto* campaigns =
      dropping->add_option("campaigns", o.drop.campaigns,
                           "Campaigns of one damper: folders with campaign.json, or FILE.db");
  dropping
      ->add_option("--diagnosis", o.drop.diagnosis,
                   "Folder that `diagnose --out` wrote (default: diagnose now)")
      ->type_name(kFolderType);
  auto* campaign = dropping
                       ->add_option("--campaign", o.drop.campaign,
                                    "Identify from it as its model is, without a diagnosis")
                       ->excludes(campaigns);
  dropping->add_option("--model", o.drop.model, "Model file (default: the campaign's own)");
  dropping->add_option("--estimate", o.drop.estimate, "What `estimate --json` printed")
      ->excludes(campaign);
  dropping->add_option("--duration", o.drop.duration, "Duration of the simulated drop, s")
      ->capture_default_str();
  dropping->add_option("--samples", o.drop.samples, "Number of samples of the band")
      ->capture_default_str();
  dropping->add_option("--identified-speed", o.drop.identified_speed,
                       "Largest speed at which the model was identified, m/s");
  dropping->add_option("--identified-stroke", o.drop.identified_stroke,
                       "Largest stroke at which the model was identified, m");
  dropping->add_option("--truth", o.drop.truth, "Model file whose starts are the truth: compare");
  dropping->add_option("--svg", o.drop.svg, "Draw the load into this file");
  dropping->add_option("--page", o.drop.page, "Write a page (HTML) with all pictures there");
  add_drop_conditions(dropping, o.drop);
  dropping->footer(
      "With CAMPAIGN or --diagnosis the band holds every hypothesis that the campaign does not\n"
      "exclude, and an unnamed force. With --campaign, or --model and --estimate, it is that of\n"
      "the parameters, and knows no effect that the model lacks.");
}

void add_report(CLI::App& app, Options& o) {
  ReportOptions& r = o.report;
  auto* reporting = add(app, o, "report",
                        "Campaign, estimate, diagnosis and drop in one page that can be printed",
                        [&o] { return report_campaign(o.common, o.report); });
  reporting
      ->add_option("campaigns", r.drop.campaigns,
                   "Campaigns of one damper: folders with campaign.json, or FILE.db")
      ->required();
  reporting->add_option("--model", r.drop.model, "Model file (default: the database's own)");
  reporting->add_option("--out", r.out, "The page (.html) or document (.pdf) to write")->required();
  reporting->add_option("--specimen", r.specimen, "The specimen, for the title block");
  reporting->add_option("--serial", r.serial, "Serial number of the specimen");
  reporting->add_option("--rig-name", r.rig, "Name of the rig (default: that of the database)");
  reporting->add_option("--operator", r.operator_name, "Who measured");
  reporting->add_flag("--force", r.force, "Replace the file if it is there");
  add_drop_conditions(reporting, r.drop);
  reporting->add_option("--duration", r.drop.duration, "Duration of the simulated drop, s")
      ->capture_default_str();
  reporting->footer(
      "Without --sink-speed or --rule there is no drop on the page. A PDF needs weasyprint or\n"
      "Chromium.");
}

}  // namespace

void add_drop_commands(CLI::App& app, Options& o) {
  add_drop(app, o);
  add_report(app, o);
}

}  // namespace shaker::cli
