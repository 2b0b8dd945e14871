// Reads the small number tables of tests/data: '#' comments, one line of names, numbers.
#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace shaker::sim::testing {

using Row = std::map<std::string, double>;

inline std::vector<Row> read_csv(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<std::string> names;
  std::vector<Row> rows;
  std::string line, cell;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    if (names.empty()) {
      while (std::getline(cells, cell, ','))
        names.push_back(cell);
      continue;
    }
    Row& row = rows.emplace_back();
    for (const auto& name : names) {
      std::getline(cells, cell, ',');
      row[name] = std::stod(cell);
    }
  }
  return rows;
}

}  // namespace shaker::sim::testing
