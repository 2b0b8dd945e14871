#include "report/diagnosis_files.hpp"

#include <fstream>
#include <iterator>
#include <string>

#include <fmt/format.h>
#include <system_error>

#include "config/model.hpp"
#include "report/damper_document.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::report {
namespace {

constexpr const char* kFiles[] = {"diagnosis.json", "model.json", kDamperFile, "report.html"};

Error cannot(const std::filesystem::path& file) {
  return {ErrorKind::io, fmt::format("{}: cannot be written; check the folder's permissions and "
                                     "the disk's space",
                                     file.string())};
}

Error said_by_system(const std::filesystem::path& file, const std::error_code& trouble) {
  return {ErrorKind::io, fmt::format("{}: {}", file.string(), trouble.message())};
}

std::filesystem::path unfinished(const std::filesystem::path& file) {
  return file.string() + ".unfinished";
}

Result<void> write_unfinished(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(unfinished(file), std::ios::binary);
  out << text << '\n';
  out.close();
  if (out) return {};
  std::error_code ignored;
  std::filesystem::remove(unfinished(file), ignored);
  return cannot(file);
}

Result<void> write_file(const std::filesystem::path& file, const std::string& text) {
  if (auto written = write_unfinished(file, text); !written) return written;
  std::error_code trouble;
  std::filesystem::rename(unfinished(file), file, trouble);
  if (trouble) return said_by_system(file, trouble);
  return {};
}

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code trouble;
  std::filesystem::create_directories(folder, trouble);
  if (trouble) return said_by_system(folder, trouble);
  return {};
}

}  // namespace

Result<void> prepare_diagnosis(const std::filesystem::path& folder,
                               const std::filesystem::path& model) {
  if (auto made = make_folder(folder); !made) return made;
  for (const char* name : kFiles) {
    const auto file = folder / name;
    std::error_code none;  // files that do not exist yet are no error
    if (std::filesystem::equivalent(file, model, none) ||
        std::filesystem::equivalent(unfinished(file), model, none))
      return Error{ErrorKind::invalid,
                   fmt::format("{} is the model that is diagnosed, and the answer would replace "
                               "it; name another folder for the answer",
                               file.string())};
    if (std::filesystem::is_directory(file, none))
      return Error{ErrorKind::io, fmt::format("{}: is a directory, not a file", file.string())};
    if (auto written = write_unfinished(file, ""); !written) return written;
    std::filesystem::remove(unfinished(file), none);
  }
  return {};
}

std::vector<std::filesystem::path> earlier_diagnosis(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  for (const char* name : kFiles) {
    std::error_code none;
    if (std::filesystem::is_regular_file(folder / name, none)) found.push_back(folder / name);
  }
  return found;
}

Result<void> write_diagnosis(const std::filesystem::path& folder,
                             const estimator::diagnosis::Diagnosis& diagnosis,
                             const TitleBlock& title) {
  if (auto made = make_folder(folder); !made) return made;
  const std::string texts[] = {diagnosis_json(diagnosis), config::to_json_text(diagnosis.improved),
                               damper_json(diagnosis.damper), diagnosis_page(diagnosis, title)};
  for (std::size_t i = 0; i < std::size(kFiles); ++i) {
    if (auto done = write_file(folder / kFiles[i], texts[i]); !done) return done;
  }
  return {};
}

}  // namespace shaker::report
