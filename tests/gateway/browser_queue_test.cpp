#include <gmock/gmock.h>

#include "gateway/browser.hpp"

namespace shaker::gateway {
namespace {

Event bytes(std::size_t count, bool droppable = false) {
  return {std::make_shared<const std::string>(count, 'x'), droppable};
}

TEST(BrowserQueue, GivesWhatWasOfferedInPieces) {
  Browser browser(1000, {{std::make_shared<const std::string>("first ")}});
  EXPECT_TRUE(browser.offer({std::make_shared<const std::string>("second")}));
  std::string got;
  char piece[5];
  while (!browser.empty())
    got.append(piece, browser.read(piece, sizeof piece));
  EXPECT_EQ(got, "first second");
  EXPECT_EQ(browser.waiting(), 0U);
  EXPECT_EQ(browser.read(piece, sizeof piece), 0U);
}

TEST(BrowserQueue, GivesUpABrowserThatDoesNotReadButNotForItsOpening) {
  Browser browser(1000, {bytes(50'000)});
  EXPECT_TRUE(browser.offer(bytes(600)));
  EXPECT_TRUE(browser.offer(bytes(400)));
  EXPECT_FALSE(browser.offer(bytes(1)));
}

TEST(BrowserQueue, DropsWhatABrowserCanDoWithout) {
  Browser browser(1000, {});
  EXPECT_TRUE(browser.offer(bytes(80, true)));
  EXPECT_TRUE(browser.offer(bytes(80, true)));
  for (int i = 0; i < 1000; ++i)
    EXPECT_TRUE(browser.offer(bytes(80, true)));
  EXPECT_EQ(browser.waiting(), 160U);
}

TEST(BrowserQueue, CountsOnlyWhatIsUnread) {
  Browser browser(1000, {bytes(5000)});
  char all[8192];
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(browser.offer(bytes(900)));
    browser.read(all, sizeof all);
  }
}

}  // namespace
}  // namespace shaker::gateway
