// What tests/data/metrics/make_fixtures.py wrote.
#pragma once
#include <Eigen/Core>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace mocap::test {

inline const Eigen::MatrixXd& fixture(const std::string& name) {
  static const auto all = [] {
    std::map<std::string, Eigen::MatrixXd> out;
    std::ifstream in(TEST_DATA "/metrics/features.txt");
    std::string key;
    Eigen::Index rows = 0, columns = 0;
    while (in >> key >> rows >> columns) {
      Eigen::MatrixXd& x = out[key] = Eigen::MatrixXd(rows, columns);
      for (Eigen::Index i = 0; i < rows; ++i)
        for (Eigen::Index j = 0; j < columns; ++j) in >> x(i, j);
      // Of float32 values the text has 9 digits: enough to name the float, not its double.
      if (key == "a" || key == "b" || key.starts_with("few")) x = x.cast<float>().cast<double>();
    }
    return out;
  }();
  return all.at(name);
}

inline double expected(const std::string& name) {
  static const auto all = [] {
    std::map<std::string, double> out;
    std::ifstream in(TEST_DATA "/metrics/expected.tsv");
    std::string key;
    double value = 0;
    while (in >> key >> value) out[key] = value;
    return out;
  }();
  return all.at(name);
}

inline std::vector<int> fixture_labels() {
  std::vector<int> out;
  for (const double v : fixture("labels").reshaped()) out.push_back(static_cast<int>(v));
  return out;
}

}  // namespace mocap::test
