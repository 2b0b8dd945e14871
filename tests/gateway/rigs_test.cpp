#include "gateway/rigs.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/unique_fd.hpp"
#include "gateway/page_request.hpp"
#include "tests/gateway/documents.hpp"

namespace shaker::gateway {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

Rigs two_rigs() {
  Rigs rigs;
  ShownRig& right = rigs.add("right", {});
  right.feed.begin("1");
  right.feed.take(testing::state(1, "MEASURE"));
  right.feed.take(testing::alarm(2, "error", "stroke_limit"));
  rigs.add("left", {});
  return rigs;
}

TEST(Rigs, AreListedByNameWithWhatEachSaysOfItself) {
  const Rigs rigs = two_rigs();
  const auto list = rigs.overview().at("rigs");
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0].at("name"), "left");
  EXPECT_EQ(list[0].at("connected"), false);
  EXPECT_THAT(list[0].at("why").get<std::string>(), HasSubstr("not reached"));
  EXPECT_FALSE(list[0].contains("state"));
  EXPECT_EQ(list[1].at("state"), "MEASURE");
  EXPECT_EQ(list[1].at("errors"), 1);
  EXPECT_EQ(list[1].at("progress"), 0.25);
  EXPECT_EQ(list[1].at("unprotected"), true);
}

TEST(Rigs, HaveEachItsPageAndTheRootItsList) {
  const Rigs rigs = two_rigs();
  const auto ask = [&](std::string_view path) {
    return answer_to({"GET", path, "localhost"}, rigs, {});
  };
  EXPECT_EQ(ask("/rig/left/").shared.data(), ask("/index.html").shared.data());
  EXPECT_EQ(ask("/").shared.data(), ask("/rigs.html").shared.data());
  EXPECT_NE(ask("/").shared.data(), ask("/index.html").shared.data());
  EXPECT_EQ(ask("/rig/right/events").rig, rigs.find("right"));
  EXPECT_TRUE(ask("/events").events);
  EXPECT_EQ(ask("/events").rig, nullptr);
  EXPECT_EQ(ask("/rig/left").status, 308U);
  EXPECT_EQ(ask("/rig/left").location, "left/");
  EXPECT_THAT(ask("/metrics").body, HasSubstr("shaker_up{rig=\"left\"} 0\n"
                                              "shaker_up{rig=\"right\"} 1\n"));
  EXPECT_THAT(ask("/rig/right/metrics").body, HasSubstr("\nshaker_up 1\n"));
  EXPECT_THAT(ask("/rig/right/metrics").body, HasSubstr("\nshaker_unprotected 1\n"));
  for (const char* path : {"/rig/", "/rig/none/", "/rig/left/../right/", "/rig//", "/rig/left//"})
    EXPECT_EQ(ask(path).status, 404U) << path;
}

TEST(Rigs, ComeFromAFolderOfSockets) {
  const fs::path folder = fs::temp_directory_path() / ("rigs." + std::to_string(::getpid()));
  std::vector<UniqueFd> kept;
  const auto listen_at = [&](const fs::path& socket) {
    fs::create_directories(socket.parent_path());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket.string().copy(address.sun_path, sizeof address.sun_path - 1);
    kept.emplace_back(::socket(AF_UNIX, SOCK_STREAM, 0));
    const auto* raw = reinterpret_cast<const sockaddr*>(&address);
    ASSERT_EQ(::bind(kept.back().get(), raw, sizeof address), 0);
  };
  listen_at(folder / "view.sock");
  listen_at(folder / "left" / "view.sock");
  listen_at(folder / "bad name" / "view.sock");
  fs::create_directories(folder / "empty");
  std::vector<std::string> names;
  for (const RigSocket& rig : rig_sockets_in(folder))
    names.push_back(rig.name);
  fs::remove_all(folder);
  EXPECT_THAT(names, ElementsAre("left", "shakerd"));
  EXPECT_TRUE(rig_sockets_in(folder).empty());
}

}  // namespace
}  // namespace shaker::gateway
