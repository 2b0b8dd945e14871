#include "report/diagnosis_files.hpp"

#include <fstream>

#include <fmt/format.h>

#include "config/model.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::report {
namespace {

Result<void> write_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path fresh = file.string() + ".new";
  std::ofstream out(fresh, std::ios::binary);
  out << text << '\n';
  out.close();
  std::error_code trouble;
  if (!out) {
    std::filesystem::remove(fresh, trouble);
    return Error{ErrorKind::io, fmt::format("{}: cannot be written; check the folder's permissions "
                                            "and the disk's space",
                                            file.string())};
  }
  std::filesystem::rename(fresh, file, trouble);
  if (trouble) return Error{ErrorKind::io, fmt::format("{}: {}", file.string(), trouble.message())};
  return {};
}

}  // namespace

Result<void> write_diagnosis(const std::filesystem::path& folder,
                             const estimator::discrepancy::Diagnosis& diagnosis) {
  std::error_code trouble;
  std::filesystem::create_directories(folder, trouble);
  if (trouble)
    return Error{ErrorKind::io, fmt::format("{}: {}", folder.string(), trouble.message())};
  if (auto done = write_file(folder / "diagnosis.json", diagnosis_json(diagnosis)); !done)
    return done;
  if (auto done = write_file(folder / "model.json", config::to_json_text(diagnosis.improved));
      !done)
    return done;
  return write_file(folder / "report.html", diagnosis_page(diagnosis));
}

}  // namespace shaker::report
