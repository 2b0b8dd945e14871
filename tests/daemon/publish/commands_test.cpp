#include "daemon/publish/commands.hpp"

#include <filesystem>
#include <fstream>
#include <stdlib.h>

#include "tests/daemon/publish/fake_rig.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using protocol::RpcCode;
using protocol::RpcError;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CommandsTest : public ::testing::Test {
 protected:
  Answer ask(const Peer& peer, const std::string& method, json params = nullptr) {
    return commands.handle({method, std::move(params), 1}, peer);
  }
  RpcError refused(const Answer& answer) {
    const auto* error = std::get_if<RpcError>(&answer);
    EXPECT_NE(error, nullptr);
    return error ? *error : RpcError{};
  }
  static bool good(const Answer& answer) { return std::holds_alternative<json>(answer); }

  SimulatedClock clock;
  testing::FakeRig rig;
  Commands commands{rig, clock, 2s};
  Peer anna{1, "anna (pid 1)", false}, otto{2, "otto (pid 2)", false}, tcp{3, "a TCP client", true};
};

TEST_F(CommandsTest, StartNeedsTheLease) {
  const json params = {{"campaign", {{"name", "c"}}}};
  EXPECT_EQ(refused(ask(anna, "campaign.start", params)).code, RpcCode::not_in_control);
  EXPECT_THAT(rig.asked, IsEmpty());
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  EXPECT_TRUE(rig.controlled);
  const Answer started = ask(anna, "campaign.start", params);
  ASSERT_TRUE(good(started));
  EXPECT_EQ(std::get<json>(started)["database"], "/data/c.db");
  EXPECT_FALSE(std::get<json>(started).contains("warning"));
  EXPECT_THAT(rig.asked, ElementsAre(R"(start {"name":"c"} from campaign.start in /)"));
  EXPECT_EQ(refused(ask(otto, "campaign.start", params)).code, RpcCode::not_in_control);
  clock.advance(1s);
  ASSERT_TRUE(good(ask(anna, "control.acquire"))) << "again";
  clock.advance(1s);
  const RpcError taken = refused(ask(otto, "control.acquire"));
  EXPECT_EQ(taken.code, RpcCode::control_taken);
  EXPECT_THAT(taken.message, ::testing::StartsWith("anna (pid 1) has been in control for 2 s"));
}

TEST_F(CommandsTest, AStartIsAnsweredWithWhatTheOperatorShouldKnow) {
  rig.remarked = "the daemon takes theta1 as the same in all runs";
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  const Answer started = ask(anna, "campaign.start", {{"campaign", {{"name", "c"}}}});
  ASSERT_TRUE(good(started));
  EXPECT_EQ(std::get<json>(started)["warning"], rig.remarked);
}

TEST_F(CommandsTest, ADiagnosisNeedsNoLeaseAndSaysWhereItGoes) {
  const Answer plain = ask(otto, "diagnose");
  ASSERT_TRUE(good(plain));
  EXPECT_EQ(std::get<json>(plain),
            json::parse(R"({"database": "c.db", "folder": "/data/c.diagnosis"})"));
  EXPECT_TRUE(
      good(ask(otto, "diagnose", {{"campaign", "x"}, {"model", {{"name", "m"}}}, {"out", "o"}})));
  EXPECT_TRUE(good(ask(otto, "diagnose.cancel")));
  EXPECT_TRUE(good(ask(otto, "diagnose", {{"thorough", true}})));
  EXPECT_THAT(rig.asked,
              ElementsAre(R"(diagnose "" with its own model into "")",
                          R"(diagnose "x" with {"name":"m"} into "o")", "cancel by otto (pid 2)",
                          R"(diagnose "" with its own model into "", thoroughly)"));
  EXPECT_EQ(refused(ask(tcp, "diagnose")).code, RpcCode::read_only);
}

TEST_F(CommandsTest, ADiagnosisWithOtherParametersIsRefused) {
  for (const json& params :
       {json::array({1}), json{{"surprise", 1}}, json{{"campaign", 1}}, json{{"model", "file"}},
        json{{"false_alarm_rate", 0.5}}, json{{"false_alarm_rate", 0.0}}, json{{"thorough", 1}}}) {
    EXPECT_EQ(refused(ask(anna, "diagnose", params)).code, RpcCode::invalid_params) << params;
  }
  EXPECT_THAT(rig.asked, IsEmpty());
  rig.outcome = Error{ErrorKind::refused, "The rig is in MEASURE."};
  EXPECT_EQ(refused(ask(anna, "diagnose")).code, RpcCode::refused);
}

TEST_F(CommandsTest, StoppingIsAnyones) {
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  EXPECT_TRUE(good(ask(otto, "stop")));
  EXPECT_TRUE(good(ask(otto, "estop")));
  EXPECT_TRUE(good(ask(otto, "ack")));
  EXPECT_THAT(rig.asked,
              ElementsAre("stop by otto (pid 2)", "estop by otto (pid 2)", "ack by otto (pid 2)"));
}

TEST_F(CommandsTest, PausingIsAnyonesAndResumingNeedsTheLease) {
  EXPECT_TRUE(good(ask(otto, "pause")));
  EXPECT_EQ(refused(ask(otto, "resume")).code, RpcCode::not_in_control);
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  EXPECT_EQ(refused(ask(otto, "resume")).code, RpcCode::not_in_control);
  EXPECT_TRUE(good(ask(anna, "resume")));
  clock.advance(3s);
  commands.tick();
  EXPECT_EQ(refused(ask(anna, "resume")).code, RpcCode::not_in_control) << "the lease ran out";
  EXPECT_THAT(rig.asked,
              ElementsAre("pause by otto (pid 2)", "resume by anna (pid 1)", "lease lost"));
}

TEST_F(CommandsTest, AnyRequestOfTheHolderRenewsTheLease) {
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  for (int i = 0; i < 5; ++i) {
    clock.advance(1500ms);
    ASSERT_TRUE(good(ask(anna, i % 2 != 0 ? "ping" : "lease.renew")));
    ask(otto, "ping");
    commands.tick();
  }
  EXPECT_THAT(rig.asked, IsEmpty());
  clock.advance(2s);
  commands.tick();
  EXPECT_THAT(rig.asked, ElementsAre("lease lost"));
  EXPECT_FALSE(rig.controlled);
  EXPECT_EQ(refused(ask(anna, "lease.renew")).code, RpcCode::not_in_control);
}

TEST_F(CommandsTest, AHolderThatGoesOrReleasesLosesTheLeaseAtOnce) {
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  commands.gone(otto);
  EXPECT_THAT(rig.asked, IsEmpty());
  commands.gone(anna);
  EXPECT_THAT(rig.asked, ElementsAre("lease lost"));
  ASSERT_TRUE(good(ask(otto, "control.acquire")));
  ASSERT_TRUE(good(ask(otto, "control.release")));
  EXPECT_THAT(rig.asked, ElementsAre("lease lost", "lease lost"));
  EXPECT_EQ(refused(ask(otto, "control.release")).code, RpcCode::not_in_control);
}

TEST_F(CommandsTest, TheStatusSaysWhoIsInControlAndForHowLong) {
  EXPECT_FALSE(std::get<json>(ask(otto, "status")).contains("controller"));
  clock.advance(5s);  // counts from here
  ASSERT_TRUE(good(ask(anna, "control.acquire")));
  clock.advance(1s);
  const json status = std::get<json>(ask(otto, "status"));
  EXPECT_EQ(status["controller"], "anna (pid 1)");
  EXPECT_EQ(status["controlled_for_s"], 1.0);
}

TEST_F(CommandsTest, AReadOnlyConnectionMayOnlyAsk) {
  EXPECT_TRUE(good(ask(tcp, "ping")));
  EXPECT_TRUE(good(ask(tcp, "status")));
  for (const char* method : {"control.acquire", "campaign.start", "stop", "estop", "ack"}) {
    EXPECT_EQ(refused(ask(tcp, method)).code, RpcCode::read_only) << method;
  }
  EXPECT_THAT(rig.asked, IsEmpty());
}

TEST_F(CommandsTest, StatusSaysStateAndWhoIsInControl) {
  ask(anna, "control.acquire");
  const auto answer = std::get<json>(ask(anna, "status"));
  EXPECT_EQ(answer["state"]["state"], "IDLE");
  EXPECT_EQ(answer["state"]["controlled"], true);
  EXPECT_EQ(answer["in_control"], true);
  EXPECT_EQ(std::get<json>(ask(otto, "status"))["in_control"], false);
}

TEST_F(CommandsTest, WhatTheRigRefusesComesBackAsItsSentence) {
  rig.outcome = Error{ErrorKind::refused, "The rig is in FAULT; acknowledge it first."};
  ask(anna, "control.acquire");
  const auto error = refused(ask(anna, "campaign.start", {{"campaign", json::object()}}));
  EXPECT_EQ(error.code, RpcCode::refused);
  EXPECT_EQ(error.message, "The rig is in FAULT; acknowledge it first.");
  rig.outcome = Error{ErrorKind::invalid, "/runs: missing"};
  EXPECT_EQ(refused(ask(anna, "campaign.start", {{"campaign", json::object()}})).code,
            RpcCode::invalid_params);
}

TEST_F(CommandsTest, StartFromAFileReadsItAndRefusesWhatIsNone) {
  std::string directory = (std::filesystem::temp_directory_path() / "commands.XXXXXX").string();
  ASSERT_NE(::mkdtemp(directory.data()), nullptr);
  const std::string file = directory + "/c.json";
  std::ofstream(file) << "{}";
  ask(anna, "control.acquire");
  EXPECT_TRUE(good(ask(anna, "campaign.start", {{"file", file}})));
  EXPECT_THAT(rig.asked, ElementsAre("start {} from " + file + " in " + directory));
  EXPECT_THAT(refused(ask(anna, "campaign.start", {{"file", "c.json"}})).message,
              HasSubstr("absolute path"));
  EXPECT_THAT(refused(ask(anna, "campaign.start", {{"file", directory}})).message,
              HasSubstr("is a directory"));
  EXPECT_THAT(refused(ask(anna, "campaign.start", {{"file", "/dev/zero"}})).message,
              HasSubstr("not a regular file"));
  rig.outcome = Error{ErrorKind::refused, "the rig is in MEASURE"};  // then no file is read
  EXPECT_THAT(refused(ask(anna, "campaign.start", {{"file", "/no/such/file"}})).message,
              HasSubstr("MEASURE"));
  rig.outcome = {};
  for (const json& params :
       {json(nullptr), json::array(), json{{"campaign", 3}}, json{{"other", 3}}}) {
    EXPECT_EQ(refused(ask(anna, "campaign.start", params)).code, RpcCode::invalid_params) << params;
  }
  EXPECT_EQ(rig.asked.size(), 1U);
  std::filesystem::remove_all(directory);
}

TEST_F(CommandsTest, AnUnknownMethodNamesThoseThereAre) {
  const auto error = refused(ask(anna, "campaign.begin"));
  EXPECT_EQ(error.code, RpcCode::method_not_found);
  EXPECT_THAT(error.message, ::testing::AllOf(HasSubstr("campaign.begin"), HasSubstr("estop")));
}

}  // namespace
}  // namespace shaker::daemon
