#include "cli/data/out_file.hpp"

#include <cerrno>
#include <cstring>

namespace shaker::cli {

OutFile::OutFile(std::filesystem::path name)
    : name_(std::move(name)),
      part_(name_.string() + ".part"),
      file_(std::fopen(part_.c_str(), "wbe"), &std::fclose) {}

OutFile::~OutFile() {
  file_.reset();
  if (!finished_) std::remove(part_.c_str());
}

Result<void> OutFile::finish() {
  if (file_) {
    if (std::fflush(file_.get()) != 0 || std::ferror(file_.get()) != 0) return trouble();
    if (std::fclose(file_.release()) != 0) return trouble();
  }
  if (std::rename(part_.c_str(), name_.c_str()) != 0) return trouble();
  finished_ = true;
  return {};
}

Error OutFile::trouble() const {
  return {ErrorKind::io,
          fmt::format("{}: cannot be written: {}", name_.string(), std::strerror(errno))};
}

}  // namespace shaker::cli
