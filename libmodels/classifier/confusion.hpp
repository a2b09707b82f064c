// How often a classifier finds the class that a clip has.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libmodels/classifier/classifier.hpp"

namespace mocap::classifier {

struct Confusion {
  std::vector<std::string> classes;
  std::vector<std::vector<std::size_t>> counts;  // [C][C] true class, found class
  std::size_t unlabelled = 0;                    // clips without the attribute
  std::vector<std::string> unknown;              // names of clips of a class that the classifier does not have

  std::size_t clips() const;                 // with a known label
  double accuracy() const;                   // share of them found right; NaN of none
  double balanced_accuracy() const;          // mean over the classes that occur of the share found right; NaN of none
  nlohmann::ordered_json to_json() const;    // clips, accuracy, balanced_accuracy, classes, confusion (rows: true), unlabelled, unknown
  std::string to_text() const;               // a table
};

// Index of the largest posterior of a row; the first of equal ones.
std::size_t found_class(const Judged& judged, std::size_t row);
Confusion confusion(const Classifier& classifier, const std::vector<Clip>& clips, const Judged& judged);

}  // namespace mocap::classifier
