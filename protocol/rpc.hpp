// Commands on the stream: JSON-RPC 2.0, one request on each line, answered on the same stream.
//
// Source: JSON-RPC 2.0 specification (jsonrpc.org), with two limits: no batches, and a line has
// at most 64 KiB and 32 levels of nesting (checked while it is parsed, so that a hostile line
// needs no stack). Codes from -32000 downwards are specific to this protocol. Pure: text in,
// text out.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <nlohmann/json.hpp>

namespace shaker::protocol {

inline constexpr std::size_t kMaxRequestLine = 64 * 1024;  // bytes, without the newline
inline constexpr int kMaxRequestDepth = 32;

enum class RpcCode : int {
  parse_error = -32700,
  invalid_request = -32600,
  method_not_found = -32601,
  invalid_params = -32602,
  internal = -32603,
  refused = -32000,         // the rig's state does not permit it; the message gives the reason
  not_in_control = -32001,  // starting requires the lease: control.acquire first
  control_taken = -32002,   // another client holds the lease
  line_too_long = -32003,
  read_only = -32004,  // this connection may only listen
  too_many_clients = -32005
};

struct RpcRequest {
  std::string method;
  nlohmann::json params;             // an object, an array, or null without params
  std::optional<nlohmann::json> id;  // empty: a notification, which is never answered
};

struct RpcError {
  RpcCode code = RpcCode::internal;
  std::string message;  // a sentence
  nlohmann::json id;    // null if it could not be read
};

// Parses a request. An error can be sent back as it is.
std::variant<RpcRequest, RpcError> parse_request(std::string_view line);

// Lines without the newline, valid UTF-8.
std::string result_line(const nlohmann::json& id, const nlohmann::json& result);
std::string error_line(const RpcError& error);
// For clients. Null `params` are omitted.
std::string request_line(std::int64_t id, const std::string& method, const nlohmann::json& params);

}  // namespace shaker::protocol
