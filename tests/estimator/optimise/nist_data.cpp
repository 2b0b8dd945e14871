#include "tests/estimator/optimise/nist_data.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace shaker::estimator::optimise::testing {
namespace {

// Source: NIST StRD, files of these names. Public domain.
struct Row {
  const char *y, *x;
};
struct Embedded {
  const char* name;
  std::vector<double> first, second, certified, deviation;
  double residual_sum;
  std::vector<Row> rows;
};

const std::vector<Embedded>& embedded() {
  static const std::vector<Embedded> all = {
      {"Misra1a",
       {500, 0.0001},
       {250, 0.0005},
       {2.3894212918E+02, 5.5015643181E-04},
       {2.7070075241E+00, 7.2668688436E-06},
       1.2455138894E-01,
       {{"10.07E0", "77.6E0"},
        {"14.73E0", "114.9E0"},
        {"17.94E0", "141.1E0"},
        {"23.93E0", "190.8E0"},
        {"29.61E0", "239.9E0"},
        {"35.18E0", "289.0E0"},
        {"40.02E0", "332.8E0"},
        {"44.82E0", "378.4E0"},
        {"50.76E0", "434.8E0"},
        {"55.05E0", "477.3E0"},
        {"61.01E0", "536.8E0"},
        {"66.40E0", "593.1E0"},
        {"75.47E0", "689.1E0"},
        {"81.78E0", "760.0E0"}}},
      {"Lanczos3",
       {1.2, 0.3, 5.6, 5.5, 6.5, 7.6},
       {0.5, 0.7, 3.6, 4.2, 4, 6.3},
       {8.6816414977E-02, 9.5498101505E-01, 8.4400777463E-01, 2.9515951832E+00, 1.5825685901E+00,
        4.9863565084E+00},
       {1.7197908859E-02, 9.7041624475E-02, 4.1488663282E-02, 1.0766312506E-01, 5.8371576281E-02,
        3.4436403035E-02},
       1.6117193594E-08,
       {{"2.5134E+00", "0.00000E+00"}, {"2.0443E+00", "5.00000E-02"},
        {"1.6684E+00", "1.00000E-01"}, {"1.3664E+00", "1.50000E-01"},
        {"1.1232E+00", "2.00000E-01"}, {"0.9269E+00", "2.50000E-01"},
        {"0.7679E+00", "3.00000E-01"}, {"0.6389E+00", "3.50000E-01"},
        {"0.5338E+00", "4.00000E-01"}, {"0.4479E+00", "4.50000E-01"},
        {"0.3776E+00", "5.00000E-01"}, {"0.3197E+00", "5.50000E-01"},
        {"0.2720E+00", "6.00000E-01"}, {"0.2325E+00", "6.50000E-01"},
        {"0.1997E+00", "7.00000E-01"}, {"0.1723E+00", "7.50000E-01"},
        {"0.1493E+00", "8.00000E-01"}, {"0.1301E+00", "8.50000E-01"},
        {"0.1138E+00", "9.00000E-01"}, {"0.1000E+00", "9.50000E-01"},
        {"0.0883E+00", "1.00000E+00"}, {"0.0783E+00", "1.05000E+00"},
        {"0.0698E+00", "1.10000E+00"}, {"0.0624E+00", "1.15000E+00"}}},
      {"MGH09",
       {25, 39, 41.5, 39},
       {0.25, 0.39, 0.415, 0.39},
       {1.9280693458E-01, 1.9128232873E-01, 1.2305650693E-01, 1.3606233068E-01},
       {1.1435312227E-02, 1.9633220911E-01, 8.0842031232E-02, 9.0025542308E-02},
       3.0750560385E-04,
       {{"1.957000E-01", "4.000000E+00"},
        {"1.947000E-01", "2.000000E+00"},
        {"1.735000E-01", "1.000000E+00"},
        {"1.600000E-01", "5.000000E-01"},
        {"8.440000E-02", "2.500000E-01"},
        {"6.270000E-02", "1.670000E-01"},
        {"4.560000E-02", "1.250000E-01"},
        {"3.420000E-02", "1.000000E-01"},
        {"3.230000E-02", "8.330000E-02"},
        {"2.350000E-02", "7.140000E-02"},
        {"2.460000E-02", "6.250000E-02"}}},
      {"Eckerle4",
       {1, 10, 500},
       {1.5, 5, 450},
       {1.5543827178E+00, 4.0888321754E+00, 4.5154121844E+02},
       {1.5408051163E-02, 4.6803020753E-02, 4.6800518816E-02},
       1.4635887487E-03,
       {{"0.0001575E0", "400.000000E0"}, {"0.0001699E0", "405.000000E0"},
        {"0.0002350E0", "410.000000E0"}, {"0.0003102E0", "415.000000E0"},
        {"0.0004917E0", "420.000000E0"}, {"0.0008710E0", "425.000000E0"},
        {"0.0017418E0", "430.000000E0"}, {"0.0046400E0", "435.000000E0"},
        {"0.0065895E0", "436.500000E0"}, {"0.0097302E0", "438.000000E0"},
        {"0.0149002E0", "439.500000E0"}, {"0.0237310E0", "441.000000E0"},
        {"0.0401683E0", "442.500000E0"}, {"0.0712559E0", "444.000000E0"},
        {"0.1264458E0", "445.500000E0"}, {"0.2073413E0", "447.000000E0"},
        {"0.2902366E0", "448.500000E0"}, {"0.3445623E0", "450.000000E0"},
        {"0.3698049E0", "451.500000E0"}, {"0.3668534E0", "453.000000E0"},
        {"0.3106727E0", "454.500000E0"}, {"0.2078154E0", "456.000000E0"},
        {"0.1164354E0", "457.500000E0"}, {"0.0616764E0", "459.000000E0"},
        {"0.0337200E0", "460.500000E0"}, {"0.0194023E0", "462.000000E0"},
        {"0.0117831E0", "463.500000E0"}, {"0.0074357E0", "465.000000E0"},
        {"0.0022732E0", "470.000000E0"}, {"0.0008800E0", "475.000000E0"},
        {"0.0004579E0", "480.000000E0"}, {"0.0002345E0", "485.000000E0"},
        {"0.0001586E0", "490.000000E0"}, {"0.0001143E0", "495.000000E0"},
        {"0.0000710E0", "500.000000E0"}}},
  };
  return all;
}

}  // namespace

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
    // "Data:" also stands in the head, there followed by words.
    if (first == "Data:" && equals == "y" && !set.certified.empty()) in_data = true;
  }
  if (set.data.y.size() <= set.certified.size() || set.certified.empty())
    throw std::runtime_error("not a set of NIST's: " + file.string());
  // Counted, not read: Rat43.dat says 9 where its own residual standard deviation is of 11.
  set.degrees_of_freedom = static_cast<int>(set.data.y.size() - set.certified.size());
  // Misprinted in the file as 1.20196866396E-0; its deviation, residual sum and digits are right.
  if (set.name == "Roszman1" && set.certified[0] == 1.20196866396)
    set.certified[0] = 2.0196866396E-01;
  return set;
}

std::optional<std::filesystem::path> nist_folder() {
  const char* folder = std::getenv("SHAKER_REAL_DATA");
  if (folder == nullptr) return std::nullopt;
  return std::filesystem::path(folder) / "nist";
}

std::vector<NistSet> embedded_nist() {
  std::vector<NistSet> sets;
  for (const Embedded& from : embedded()) {
    NistSet set;
    set.name = from.name;
    set.start[0] = from.first;
    set.start[1] = from.second;
    set.certified = from.certified;
    set.deviation = from.deviation;
    set.residual_sum = from.residual_sum;
    set.degrees_of_freedom = static_cast<int>(from.rows.size() - from.certified.size());
    for (const Row& row : from.rows) {
      set.data.y.emplace_back(row.y);
      set.data.x.emplace_back(row.x);
    }
    sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace shaker::estimator::optimise::testing
