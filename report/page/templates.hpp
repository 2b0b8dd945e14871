// The templates of this folder, as they were when the program was built (CMakeLists.txt).
#pragma once

#include <span>
#include <string>

namespace shaker::report {

struct PageTemplate {
  const char *name, *text;
};
extern const std::span<const PageTemplate> page_templates;
extern const std::string page_style;  // page.css

}  // namespace shaker::report
