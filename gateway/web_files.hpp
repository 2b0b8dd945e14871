// The files of web/, as they were when the program was built (CMakeLists.txt).
#pragma once

#include <span>
#include <string_view>

namespace shaker::gateway {

struct WebFile {
  std::string_view path, content;  // "/app.js"
};
extern const std::span<const WebFile> web_files;

}  // namespace shaker::gateway
