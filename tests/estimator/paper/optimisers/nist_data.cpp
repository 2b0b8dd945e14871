#include "tests/estimator/paper/optimisers/nist_data.hpp"

#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

namespace shaker::estimator::optimisers::testing {
NistSet read_nist(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot read " + file.string());
  NistSet set;
  set.name = file.stem().string();
  bool in_data = false;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    if (in_data) {
      std::vector<Extended> row;
      for (std::string word; words >> word;)
        row.emplace_back(word);
      if (row.empty()) continue;
      set.data.predictors = static_cast<int>(row.size()) - 1;
      set.data.y.push_back(row.front());
      set.data.x.insert(set.data.x.end(), row.begin() + 1, row.end());
      continue;
    }
    std::string first, equals;
    words >> first >> equals;
    double value[4];
    if (first.size() == 2 && first[0] == 'b' && equals == "=" &&
        (words >> value[0] >> value[1] >> value[2] >> value[3])) {
      set.start[0].push_back(value[0]);
      set.start[1].push_back(value[1]);
      set.certified.push_back(value[2]);
      set.deviation.push_back(value[3]);
    }
    const auto number_after = [&](const char* title, auto& to) {
      if (line.rfind(title, 0) == 0) std::istringstream(line.substr(line.find(':') + 1)) >> to;
    };
    number_after("Residual Sum of Squares", set.residual_sum);
    // "Data:" is also in the header, where words follow it.
    if (first == "Data:" && equals == "y" && !set.certified.empty()) in_data = true;
  }
  if (set.data.y.size() <= set.certified.size() || set.certified.empty())
    throw std::runtime_error("not a set of NIST's: " + file.string());
  // Counted, not read: Rat43.dat says 9, but its residual standard deviation is that of 11.
  set.degrees_of_freedom = static_cast<int>(set.data.y.size() - set.certified.size());
  // The file has the misprint 1.20196866396E-0; its deviation, residual sum and digits are
  // right.
  if (set.name == "Roszman1" && set.certified[0] == 1.20196866396)
    set.certified[0] = 2.0196866396E-01;
  return set;
}

std::vector<NistSet> nist_sets() {
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(SHAKER_TEST_DATA "/nist"))
    if (entry.path().extension() == ".dat") files.insert(entry.path());
  std::vector<NistSet> sets;
  for (const auto& file : files)
    sets.push_back(read_nist(file));
  return sets;
}

}  // namespace shaker::estimator::optimisers::testing
