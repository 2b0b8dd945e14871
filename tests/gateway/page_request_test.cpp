#include "gateway/page_request.hpp"

#include <gmock/gmock.h>

#include "gateway/web_files.hpp"

namespace shaker::gateway {
namespace {

using ::testing::HasSubstr;

Reply ask(std::string_view path, std::string_view method = "GET",
          std::string_view host = "127.0.0.1:8420") {
  static const Rigs one = [] {
    Rigs rigs;
    rigs.add("shakerd", {});
    return rigs;
  }();
  return answer_to({method, path, host}, one, {});
}

TEST(PageRequest, ServesEveryFileOfThePageByItsName) {
  EXPECT_GE(web_files.size(), 10U);
  for (const WebFile& file : web_files) {
    const Reply reply = ask(file.path);
    EXPECT_EQ(reply.status, 200U);
    EXPECT_EQ(reply.shared.data(), file.content.data());
    EXPECT_NE(reply.type, "application/octet-stream") << file.path;
  }
  EXPECT_EQ(ask("/").shared.data(), ask("/index.html").shared.data());
  EXPECT_THAT(std::string(ask("/vendor/uplot/uPlot.iife.min.js").shared), HasSubstr("v1.6.32"));
}

TEST(PageRequest, AnswersRubbishWithASentence) {
  const std::string deep(5000, '/');
  for (const std::string& path :
       {std::string("/../etc/passwd"), std::string("../"), std::string("/./page.js"),
        std::string("/campaigns/../../x.db"), std::string("/reports/"), std::string(),
        std::string("/page.js/"), std::string("/\x01\xff"), deep}) {
    const Reply reply = ask(path);
    EXPECT_EQ(reply.status, 404U) << path;
    EXPECT_THAT(reply.body, HasSubstr("There is no"));
    EXPECT_LT(reply.body.size(), 300U);
    for (const char c : reply.body)
      EXPECT_TRUE(c == '\n' || (c >= ' ' && c < 127));
  }
}

TEST(PageRequest, OnlyShows) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "get"}) {
    EXPECT_EQ(ask("/", method).status, 405U);
    EXPECT_EQ(ask("/events", method).status, 405U);
  }
  EXPECT_EQ(ask("/", "HEAD").status, 200U);
  EXPECT_TRUE(ask("/events").events);
}

TEST(PageRequest, RefusesThePageOfAnotherName) {
  for (const char* host : {"localhost", "localhost:8420", "127.0.0.1", "[::1]:80", "[::1]", ""})
    EXPECT_EQ(ask("/", "GET", host).status, 200U) << host;
  for (const char* host :
       {"evil.example", "localhost.evil.example:8420", "127.0.0.1.evil:80", ":80"})
    EXPECT_EQ(ask("/", "GET", host).status, 421U) << host;
}

}  // namespace
}  // namespace shaker::gateway
