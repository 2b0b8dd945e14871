#include "report/page/page.hpp"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

PageValues plan_values() {
  return {{"sentence", "a < b & {{c}}"},
          {"map", "<svg>&amp;</svg>"},
          {"intervals", ""},
          {"sets", page_table({page_cell("<run>"), page_cell("spread", true)},
                              {{page_cell("r\"1\""), page_cell("3 %", true)}})},
          {"has_remarks", false},
          {"has_refused", false}};
}

TEST(Page, EscapesTextsAndInsertsPicturesAsTheyAre) {
  const std::string page =
      render_page("<t>", "h & h", {{"rig", "a>b"}, {"specimen", ""}}, "plan", plan_values());
  EXPECT_THAT(page, HasSubstr("<title>&lt;t&gt;</title>"));
  EXPECT_THAT(page, HasSubstr("<h1>h &amp; h</h1>"));
  EXPECT_THAT(page, HasSubstr("<tr><th>rig</th><td>a&gt;b</td></tr>"));
  EXPECT_THAT(page, Not(HasSubstr("specimen")));
  EXPECT_THAT(page, HasSubstr("<p>a &lt; b &amp; {{c}}</p>"));
  EXPECT_THAT(page, HasSubstr("<svg>&amp;</svg>"));
  EXPECT_THAT(page, HasSubstr("<tr><th>&lt;run&gt;</th><th class=\"n\">spread</th></tr>"));
  EXPECT_THAT(page, HasSubstr("<tr><td>r&quot;1&quot;</td><td class=\"n\">3 %</td></tr>"));
  EXPECT_THAT(page, Not(HasSubstr("What a set does not determine")));
}

TEST(Page, RefusesWhatNoTemplateShows) {
  EXPECT_THROW(render_page("", "", {}, "no such template", plan_values()), std::logic_error);
  PageValues values = plan_values();
  values["sentence"] = 3.0;
  EXPECT_THROW(render_page("", "", {}, "plan", values), std::logic_error);
}

}  // namespace
}  // namespace shaker::report
