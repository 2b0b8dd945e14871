#include "daemon/service/engine_control.hpp"

namespace shaker::daemon {

Result<void> EngineControl::start(const std::string& text, const std::string& origin,
                                  const std::string& directory) {
  if (closed_) {
    return Error{ErrorKind::refused, "The daemon is about to end; start it again first."};
  }
  auto campaign = config::parse_campaign(text, origin, directory);
  if (!campaign) return campaign.error();
  return engine_.start(*campaign);
}

}  // namespace shaker::daemon
