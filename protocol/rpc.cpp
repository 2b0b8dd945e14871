#include "protocol/rpc.hpp"

#include <fmt/format.h>

namespace shaker::protocol {
namespace {

using Json = nlohmann::json;

// Parses without building a tree: checks that the text is JSON and refuses too deep nesting.
// (nlohmann's own parser has no limit, and the destruction of its tree is recursive.)
class DepthCheck final : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool key(string_t&) override { return true; }
  bool start_object(std::size_t) override { return deeper(); }
  bool start_array(std::size_t) override { return deeper(); }
  bool end_object() override { return --depth_ >= 0; }
  bool end_array() override { return --depth_ >= 0; }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    trouble_ = fmt::format("not JSON at byte {} ({})", position, error.what());
    return false;
  }
  const std::string& trouble() const { return trouble_; }

 private:
  bool deeper() {
    if (++depth_ <= kMaxRequestDepth) return true;
    trouble_ = fmt::format("nested deeper than {}", kMaxRequestDepth);
    return false;
  }
  int depth_ = 0;
  std::string trouble_;
};

RpcError invalid(std::string message, Json id = nullptr) {
  return {RpcCode::invalid_request, std::move(message), std::move(id)};
}

bool valid_id(const Json& id) {
  return id.is_string() || id.is_number() || id.is_null();
}

std::string line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::variant<RpcRequest, RpcError> parse_request(std::string_view text) {
  if (text.size() > kMaxRequestLine) {
    return RpcError{
        RpcCode::line_too_long,
        fmt::format("The line has {} bytes; at most {} are read. Send less in one request.",
                    text.size(), kMaxRequestLine),
        nullptr};
  }
  DepthCheck check;
  if (!Json::sax_parse(text.begin(), text.end(), &check)) {
    return RpcError{RpcCode::parse_error, fmt::format("The line is {}.", check.trouble()), nullptr};
  }
  Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_array()) {
    return invalid("Batches are not supported: send one request a line.");
  }
  if (!json.is_object()) return invalid("A request is a JSON object.");

  std::optional<Json> id;
  if (json.contains("id")) {
    if (!valid_id(json["id"])) return invalid("\"id\" is a string, a number or null.");
    id = json["id"];
  }
  const Json echo = id.value_or(nullptr);
  if (!json.contains("jsonrpc") || json["jsonrpc"] != "2.0") {
    return invalid("\"jsonrpc\" must be \"2.0\".", echo);
  }
  if (!json.contains("method") || !json["method"].is_string()) {
    return invalid("\"method\" must be a string.", echo);
  }
  Json params = json.value("params", Json());
  if (!params.is_null() && !params.is_structured()) {
    return invalid("\"params\" is an object or an array.", echo);
  }
  for (const auto& [key, unused] : json.items()) {
    if (key != "jsonrpc" && key != "id" && key != "method" && key != "params") {
      return invalid(fmt::format("\"{}\" is not a member of a request.", key.substr(0, 64)), echo);
    }
  }
  return RpcRequest{json["method"].get<std::string>(), std::move(params), std::move(id)};
}

std::string result_line(const Json& id, const Json& result) {
  return line({{"jsonrpc", "2.0"}, {"id", id}, {"result", result}});
}

std::string error_line(const RpcError& error) {
  return line({{"jsonrpc", "2.0"},
               {"id", error.id},
               {"error", {{"code", static_cast<int>(error.code)}, {"message", error.message}}}});
}

std::string request_line(std::int64_t id, const std::string& method, const Json& params) {
  Json json = {{"jsonrpc", "2.0"}, {"id", id}, {"method", method}};
  if (!params.is_null()) json["params"] = params;
  return line(json);
}

}  // namespace shaker::protocol
