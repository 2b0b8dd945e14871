// Any line from a client: the result is a request whose answer is one line of JSON, or an error
// that can be sent as one line.
#include <algorithm>
#include <cstdlib>
#include <string_view>

#include <nlohmann/json.hpp>

#include "protocol/rpc.hpp"
#include "tests/fuzz/target.hpp"

namespace protocol = shaker::protocol;
using Json = nlohmann::json;

namespace {

Json expect_line(const std::string& text) {
  if (text.find('\n') != std::string::npos) std::abort();
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || json["jsonrpc"] != "2.0" || !json.contains("id")) std::abort();
  return json;
}

int depth(const Json& json) {
  int most = 0;
  if (json.is_structured()) {
    for (const Json& each : json)
      most = std::max(most, depth(each));
    ++most;
  }
  return most;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = protocol::parse_request({reinterpret_cast<const char*>(data), size});
  if (const auto* error = std::get_if<protocol::RpcError>(&parsed)) {
    const Json line = expect_line(protocol::error_line(*error));
    const std::string message = line["error"]["message"];
    if (message.empty() || line["error"]["code"] >= 0) std::abort();
    return 0;
  }
  const auto& request = std::get<protocol::RpcRequest>(parsed);
  if (size > protocol::kMaxRequestLine || depth(request.params) >= protocol::kMaxRequestDepth) {
    std::abort();
  }
  if (!request.params.is_null() && !request.params.is_structured()) std::abort();
  expect_line(protocol::result_line(request.id.value_or(nullptr), request.params));
  return 0;
}
