// Pages of HTML by templates (Mustache): the files *.mustache beside this one. Every page has the
// same style and the same title block. The templates escape all texts; only pictures and styles
// are inserted as they are.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace shaker::report {

// The rows of the title block, a label and a text each. A row without a text is left out.
using TitleBlock = std::vector<std::pair<std::string, std::string>>;

// What a template shows: objects, arrays, texts and flags. Texts are written by whoever knows
// their units and digits; a number is a mistake.
using PageValues = nlohmann::ordered_json;

// A cell of a table; `right`: a number, aligned on the right.
PageValues page_cell(const std::string& text, bool right = false);
// The values of the template `table`.
PageValues page_table(PageValues head, PageValues rows);

// The whole page, which loads nothing from elsewhere. `body`: the name of a template. Throws
// std::logic_error for a template that is not there or has a mistake.
std::string render_page(const std::string& title, const std::string& heading,
                        const TitleBlock& block, const std::string& body, const PageValues& values);

}  // namespace shaker::report
