// The commands that need most of the estimator are in a separate program, shakerctl-analysis,
// so that the operator's program stays small and builds quickly.
#include "cli/commands/hand_over.hpp"

namespace shaker::cli {

int estimate(const Common& common, const EstimateOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int estimate_channels(const Common& common, const EstimateOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int estimate_transient(const Common& common, const EstimateOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int compare(const Common& common, const CompareOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int export_runs(const Common& common, const ExportOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int import_campaign(const Common& common, const ImportOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int drop(const Common& common, const DropOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int report_campaign(const Common& common, const ReportOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int response(const Common& common, const ResponseOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int reproduce(const Common& common, const ReproduceOptions&) {
  return hand_over(common, "shakerctl-analysis");
}
int plan(const Common& common, const PlanCommand&) {
  return hand_over(common, "shakerctl-analysis");
}
int monte_carlo(const Common& common, const MonteCarloCommand&) {
  return hand_over(common, "shakerctl-analysis");
}

}  // namespace shaker::cli
