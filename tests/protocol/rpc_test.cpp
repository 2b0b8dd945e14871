#include "protocol/rpc.hpp"

namespace shaker::protocol {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

RpcError refused(std::string_view line) {
  auto outcome = parse_request(line);
  EXPECT_TRUE(std::holds_alternative<RpcError>(outcome)) << line.substr(0, 100);
  if (auto* error = std::get_if<RpcError>(&outcome)) return *error;
  return {};
}

RpcRequest understood(std::string_view line) {
  auto outcome = parse_request(line);
  if (auto* error = std::get_if<RpcError>(&outcome)) {
    ADD_FAILURE() << error->message;
    return {};
  }
  return std::get<RpcRequest>(outcome);
}

std::string nested(int depth) {
  return R"({"jsonrpc":"2.0","method":"m","params":)" +
         std::string(static_cast<std::size_t>(depth), '[') +
         std::string(static_cast<std::size_t>(depth), ']') + "}";
}

TEST(Request, IsReadWithItsIdOfAnyKind) {
  const auto request = understood(R"({"jsonrpc":"2.0","id":7,"method":"ping","params":{"a":[1]}})");
  EXPECT_EQ(request.method, "ping");
  EXPECT_EQ(request.params, json::parse(R"({"a":[1]})"));
  EXPECT_EQ(request.id, json(7));
  EXPECT_EQ(understood(R"({"jsonrpc":"2.0","id":"x","method":"m"})").id, json("x"));
  EXPECT_EQ(understood(R"({"jsonrpc":"2.0","id":null,"method":"m"})").id, json(nullptr));
}

TEST(Request, WithoutAnIdIsANotification) {
  EXPECT_FALSE(understood(R"({"jsonrpc":"2.0","method":"lease.renew"})").id.has_value());
}

TEST(Request, ThatIsNotJsonIsAParseError) {
  for (const char* line :
       {"", "nonsense", "{", R"({"jsonrpc":"2.0",})", "\xff\xfe", "{\"a\":\"\xc3(\"}",
        R"({"jsonrpc":"2.0","id":1,"method":"m"} trailing)", "[1,2"}) {
    const auto error = refused(line);
    EXPECT_EQ(error.code, RpcCode::parse_error) << line;
    EXPECT_THAT(error.message, HasSubstr("not JSON at byte"));
    EXPECT_TRUE(error.id.is_null());
  }
}

TEST(Request, ThatIsJsonButNoRequestSaysWhatIsWrongAndEchoesTheId) {
  EXPECT_THAT(refused("3").message, HasSubstr("JSON object"));
  EXPECT_THAT(refused(R"([{"jsonrpc":"2.0","id":1,"method":"m"}])").message,
              HasSubstr("Batches are not supported"));
  EXPECT_THAT(refused(R"({"jsonrpc":"2.0","id":[1],"method":"m"})").message, HasSubstr("\"id\""));
  const auto old = refused(R"({"id":5,"method":"m"})");
  EXPECT_EQ(old.code, RpcCode::invalid_request);
  EXPECT_EQ(old.id, json(5));
  EXPECT_THAT(refused(R"({"jsonrpc":"2.0","id":5,"method":3})").message, HasSubstr("\"method\""));
  EXPECT_THAT(refused(R"({"jsonrpc":"2.0","method":"m","params":3})").message,
              HasSubstr("\"params\""));
  EXPECT_THAT(refused(R"({"jsonrpc":"2.0","method":"m","parms":{}})").message,
              HasSubstr("\"parms\""));
}

TEST(Request, IsBoundedInDepthWhileItIsParsed) {
  EXPECT_EQ(understood(nested(kMaxRequestDepth - 1)).method, "m");
  const auto error = refused(nested(kMaxRequestDepth));
  EXPECT_EQ(error.code, RpcCode::parse_error);
  EXPECT_THAT(error.message, HasSubstr("nested deeper than 32"));
  EXPECT_THAT(refused(std::string(60'000, '[')).message, HasSubstr("nested deeper than 32"));
}

TEST(Request, IsBoundedInLength) {
  std::string line = R"({"jsonrpc":"2.0","method":"m","params":[")";
  line += std::string(kMaxRequestLine - line.size() - 3, 'x') + "\"]}";
  ASSERT_EQ(line.size(), kMaxRequestLine);
  EXPECT_EQ(understood(line).method, "m");
  EXPECT_EQ(refused(line + " ").code, RpcCode::line_too_long);
}

TEST(Answer, EchoesTheIdAndIsOneLine) {
  EXPECT_EQ(json::parse(result_line("x", {{"a", 1}})),
            json::parse(R"({"jsonrpc":"2.0","id":"x","result":{"a":1}})"));
  const auto line = error_line({RpcCode::not_in_control, "first\nsecond \xff", 4});
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_EQ(json::parse(line)["error"]["code"], -32001);
}

TEST(Answer, ToARequestOfOursCanBeAskedFor) {
  const auto request = understood(request_line(9, "campaign.start", {{"file", "c.json"}}));
  EXPECT_EQ(request.method, "campaign.start");
  EXPECT_EQ(request.id, json(9));
  EXPECT_EQ(request.params["file"], "c.json");
}

}  // namespace
}  // namespace shaker::protocol
