#include "daemon/publish/commands.hpp"

#include <filesystem>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "config/json_tree.hpp"

namespace shaker::daemon {
namespace {

using Json = nlohmann::json;
using protocol::RpcCode;
using protocol::RpcError;

constexpr std::size_t kMaxCampaignFile = 1024 * 1024;  // bytes

Result<std::string> read_campaign_file(const std::filesystem::path& file) {
  if (!file.is_absolute()) {
    return Error{ErrorKind::invalid, fmt::format("{}: the daemon's directory is not yours; give an "
                                                 "absolute path, or send the campaign itself.",
                                                 file.string())};
  }
  auto text = config::read_text(file, kMaxCampaignFile);
  if (text) return text;
  return Error{
      text.error().kind,
      text.error().what + "; see that the user shakerd may read it, or send the campaign itself."};
}

RpcError bad_params(std::string message) {
  return {RpcCode::invalid_params, std::move(message), nullptr};
}

Result<DiagnosisRequest> diagnosis_request(const Json& params) {
  DiagnosisRequest request;
  const auto bad = [](const std::string& why) { return Error{ErrorKind::invalid, why}; };
  if (params.is_null()) return request;
  if (!params.is_object())
    return bad(
        "\"params\" is {\"campaign\", \"model\", \"false_alarm_rate\", \"thorough\", "
        "\"out\"}, all optional.");
  for (const auto& [key, value] : params.items()) {
    if (key == "campaign" && value.is_string()) {
      request.campaign = value.get<std::string>();
    } else if (key == "model" && value.is_object()) {
      request.model = value.dump();
    } else if (key == "out" && value.is_string()) {
      request.out = value.get<std::string>();
    } else if (key == "false_alarm_rate" && value.is_number()) {
      request.false_alarm_rate = value.get<double>();
    } else if (key == "thorough" && value.is_boolean()) {
      request.thorough = value.get<bool>();
    } else {
      return bad(
          fmt::format("\"{}\": diagnose takes \"campaign\" (a name), \"model\" (an object), "
                      "\"false_alarm_rate\" (a number), \"thorough\" (true or false) and "
                      "\"out\" (a folder's name).",
                      key.substr(0, 64)));
    }
  }
  if (!(request.false_alarm_rate >= 1e-6 && request.false_alarm_rate < 0.5))
    return bad(fmt::format("\"false_alarm_rate\" is {:g}; it is from 1e-6 to less than 0.5.",
                           request.false_alarm_rate));
  return request;
}

// The stream's server subscribes the connection to what the answer names.
Answer subscribe(const Json& params) {
  const RpcError usage = bad_params(
      "\"params\" is {\"documents\": [...]}, a list of \"wave\", \"scope\" and \"rig\"; an empty "
      "one ends the subscription.");
  if (!params.is_object() || params.size() != 1 || !params.contains("documents")) return usage;
  const Json& wanted = params["documents"];
  if (!wanted.is_array() || wanted.size() > 16) return usage;
  for (const Json& one : wanted) {
    if (!one.is_string() || extra_bit(one.get<std::string>()) == 0) return usage;
  }
  return params;
}

RpcCode code_of(ErrorKind kind) {
  return kind == ErrorKind::invalid ? RpcCode::invalid_params : RpcCode::refused;
}

}  // namespace

// The table of methods. Only campaign.start, deadman.prove, diagnose and subscribe take
// parameters.
struct Commands::Method {
  const char* name;
  bool changes_something;  // refused on a read-only connection
  Answer (*call)(Commands&, const Json& params, const Peer&);
};

Commands::Commands(RigControl& rig, Clock& clock, Nanoseconds lease)
    : rig_(rig), clock_(clock), lease_(lease) {}

Answer Commands::handle(const protocol::RpcRequest& request, const Peer& peer) {
  static constexpr Method kMethods[] = {
      {"ping", false, [](Commands&, const Json&, const Peer&) -> Answer { return Json::object(); }},
      {"status", false, [](Commands& c, const Json&, const Peer& p) { return c.status(p); }},
      {"subscribe", false,
       [](Commands&, const Json& params, const Peer&) { return subscribe(params); }},
      {"control.acquire", true,
       [](Commands& c, const Json&, const Peer& p) { return c.acquire(p); }},
      {"control.release", true,
       [](Commands& c, const Json&, const Peer& p) { return c.release(p); }},
      {"lease.renew", true, [](Commands& c, const Json&, const Peer& p) { return c.renew(p); }},
      {"campaign.start", true,
       [](Commands& c, const Json& params, const Peer& p) { return c.start(params, p); }},
      {"deadman.prove", true,
       [](Commands& c, const Json& params, const Peer& p) { return c.prove_deadman(params, p); }},
      {"stop", true,
       [](Commands& c, const Json&, const Peer& p) { return c.done(c.rig_.stop(p.who)); }},
      {"pause", true,
       [](Commands& c, const Json&, const Peer& p) { return c.done(c.rig_.pause(p.who)); }},
      {"resume", true, [](Commands& c, const Json&, const Peer& p) { return c.resume(p); }},
      {"estop", true,
       [](Commands& c, const Json&, const Peer& p) {
         return c.done(c.rig_.emergency_stop(p.who));
       }},
      {"ack", true,
       [](Commands& c, const Json&, const Peer& p) { return c.done(c.rig_.acknowledge(p.who)); }},
      {"diagnose", true,
       [](Commands& c, const Json& params, const Peer&) { return c.diagnose(params); }},
      {"diagnose.cancel", true, [](Commands& c, const Json&, const Peer& p) {
         return c.done(c.rig_.cancel_diagnosis(p.who));
       }}};

  lease_.renew(peer.client, clock_.now());
  for (const Method& method : kMethods) {
    if (request.method != method.name) continue;
    if (method.changes_something && peer.read_only) {
      return RpcError{RpcCode::read_only,
                      "This connection may only listen; use the Unix socket of the group shaker to "
                      "command.",
                      nullptr};
    }
    // The controlling client renews its lease several times a second; this is not logged.
    if (method.changes_something && request.method != "lease.renew")
      spdlog::info("{} asks for {}.", peer.who, method.name);
    return method.call(*this, request.params, peer);
  }
  std::string known;
  for (const Method& method : kMethods)
    known += (known.empty() ? "" : ", ") + std::string(method.name);
  return RpcError{
      RpcCode::method_not_found,
      fmt::format("There is no method \"{}\"; there are {}.", request.method.substr(0, 64), known),
      nullptr};
}

void Commands::gone(const Peer& peer) {
  if (!lease_.release(peer.client)) return;
  spdlog::warn("The controlling client, {}, is gone.", peer.who);
  rig_.set_controlled(false);
  rig_.lease_lost();
}

void Commands::tick() {
  if (const auto lost = lease_.expire(clock_.now())) {
    spdlog::warn("The lease of client {} ran out.", *lost);
    rig_.set_controlled(false);
    rig_.lease_lost();
  }
}

std::optional<std::string> Commands::in_control() const {
  if (!lease_.holder()) return std::nullopt;
  return holder_;
}

Answer Commands::acquire(const Peer& peer) {
  const bool again = lease_.held_by(peer.client);
  if (!lease_.acquire(peer.client, clock_.now())) {
    return RpcError{RpcCode::control_taken,
                    fmt::format("{} has been in control for {:.0f} s; wait until it releases, or "
                                "stop the rig.",
                                holder_, seconds(clock_.now() - held_since_)),
                    nullptr};
  }
  if (!again) {
    holder_ = peer.who;
    held_since_ = clock_.now();
  }
  rig_.set_controlled(true);
  return Json{{"lease_s", seconds(lease_.duration())}};
}

// Releasing control during a run is like losing it, because nobody would supervise the motion.
Answer Commands::release(const Peer& peer) {
  if (!lease_.release(peer.client)) {
    return RpcError{RpcCode::not_in_control, "This client is not in control.", nullptr};
  }
  rig_.set_controlled(false);
  rig_.lease_lost();
  return Json::object();
}

Answer Commands::renew(const Peer& peer) {
  if (!lease_.held_by(peer.client)) {
    return RpcError{RpcCode::not_in_control,
                    "This client is not in control (its lease may have run out); ask for "
                    "control.acquire.",
                    nullptr};
  }
  return Json{{"lease_s", seconds(lease_.duration())}};
}

Answer Commands::start(const Json& params, const Peer& peer) {
  if (!lease_.held_by(peer.client)) {
    return RpcError{RpcCode::not_in_control,
                    "Starting needs control: ask for control.acquire first, and renew the lease.",
                    nullptr};
  }
  if (!params.is_object() || params.size() != 1) {
    return bad_params(
        "\"params\" is {\"campaign\": {...}} or {\"file\": \"/path/of/campaign.json\"}.");
  }
  if (params.contains("campaign") && params["campaign"].is_object()) {
    return started(rig_.start(peer.who, params["campaign"].dump(), "campaign.start", "/"));
  }
  if (params.contains("file") && params["file"].is_string()) {
    if (const auto may = rig_.may_start(); !may) return done(may);
    const std::filesystem::path file = params["file"].get<std::string>();
    const auto text = read_campaign_file(file);
    if (!text) return done(text.error());
    return started(rig_.start(peer.who, *text, file.string(), file.parent_path().string()));
  }
  return bad_params("\"campaign\" is a campaign as an object, \"file\" the path of one.");
}

Answer Commands::resume(const Peer& peer) {
  if (!lease_.held_by(peer.client)) {
    return RpcError{RpcCode::not_in_control,
                    "Motion needs control: ask for control.acquire first, and renew the lease.",
                    nullptr};
  }
  return done(rig_.resume(peer.who));
}

Answer Commands::prove_deadman(const Json& params, const Peer& peer) {
  if (!lease_.held_by(peer.client)) {
    return RpcError{RpcCode::not_in_control,
                    "Motion needs control: ask for control.acquire first, and renew the lease.",
                    nullptr};
  }
  const bool good = params.is_object() && params.size() == 2 && params.contains("frequency_hz") &&
                    params["frequency_hz"].is_number() && params.contains("amplitude") &&
                    params["amplitude"].is_number();
  if (!good)
    return bad_params("\"params\" is {\"frequency_hz\": 5, \"amplitude\": 0.5}, in Hz and m/s^2.");
  return done(rig_.prove_deadman(peer.who, params["frequency_hz"].get<double>(),
                                 params["amplitude"].get<double>()));
}

Answer Commands::status(const Peer& peer) const {
  Json state = Json::parse(protocol::to_json_text(rig_.state()));
  Json answer = {{"state", std::move(state)}, {"in_control", lease_.held_by(peer.client)}};
  if (lease_.holder()) {
    answer["controller"] = holder_;
    answer["controlled_for_s"] = seconds(clock_.now() - held_since_);
  }
  return answer;
}

Answer Commands::diagnose(const Json& params) {
  const auto request = diagnosis_request(params);
  if (!request) return done(request.error());
  const auto place = rig_.diagnose(*request);
  if (!place) return done(place.error());
  return Json{{"database", place->database}, {"folder", place->folder}};
}

Answer Commands::done(const Result<void>& outcome) const {
  if (!outcome) return RpcError{code_of(outcome.error().kind), outcome.error().what, nullptr};
  return Json{{"state", rig_.state().state}};
}

Answer Commands::started(const Result<void>& outcome) const {
  Answer answer = done(outcome);
  if (auto* result = std::get_if<Json>(&answer)) {
    (*result)["database"] = rig_.database();
    if (auto remark = rig_.remark(); !remark.empty()) (*result)["warning"] = std::move(remark);
  }
  return answer;
}

}  // namespace shaker::daemon
