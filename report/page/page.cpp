#include "report/page/page.hpp"

#include <algorithm>
#include <kainjow/mustache.hpp>
#include <stdexcept>

#include "report/page/templates.hpp"
#include "report/plot/plot.hpp"

namespace shaker::report {
namespace {

namespace mustache = kainjow::mustache;

mustache::data data_of(const PageValues& values) {
  if (values.is_object()) {
    mustache::data object(mustache::data::type::object);
    for (const auto& [key, value] : values.items())
      object.set(key, data_of(value));
    return object;
  }
  if (values.is_array()) {
    mustache::data list(mustache::data::type::list);
    for (const PageValues& value : values)
      list.push_back(data_of(value));
    return list;
  }
  if (values.is_boolean()) return mustache::data(values.get<bool>());
  if (values.is_string()) return mustache::data(values.get<std::string>());
  throw std::logic_error("a page shows texts and flags only, not " + values.dump());
}

}  // namespace

PageValues page_cell(const std::string& text, bool right) {
  return {{"text", text}, {"right", right}};
}

PageValues page_table(PageValues head, PageValues rows) {
  PageValues lines = PageValues::array();
  for (PageValues& cells : rows)
    lines.push_back({{"cells", std::move(cells)}});
  return {{"head", std::move(head)}, {"rows", std::move(lines)}};
}

std::string render_page(const std::string& title, const std::string& heading,
                        const TitleBlock& block, const std::string& body,
                        const PageValues& values) {
  mustache::data page = data_of(values);
  page.set("page_title", title);
  page.set("page_heading", heading);
  page.set("style", mustache::data(page_style + plot_style()));
  mustache::data rows(mustache::data::type::list);
  for (const auto& [label, text] : block) {
    if (text.empty()) continue;
    mustache::data row;
    row.set("label", label);
    row.set("said", text);
    rows.push_back(row);
  }
  page.set("title_rows", rows);
  for (const PageTemplate& each : page_templates) {
    const std::string text = each.text;
    page.set(each.name, mustache::data(mustache::partial([text] { return text; })));
    if (each.name == body)
      page.set("page_body", mustache::data(mustache::partial([text] { return text; })));
  }
  if (page.get("page_body") == nullptr) throw std::logic_error("there is no template " + body);
  mustache::mustache frame("{{>page}}");
  std::string text = frame.render(page);
  if (!frame.error_message().empty()) throw std::logic_error(frame.error_message());
  return text;
}

}  // namespace shaker::report
