#include "libmodels/classifier/confusion.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace mocap::classifier {

std::size_t Confusion::clips() const {
  std::size_t n = 0;
  for (const auto& row : counts) n = std::accumulate(row.begin(), row.end(), n);
  return n;
}

double Confusion::accuracy() const {
  std::size_t right = 0;
  for (std::size_t c = 0; c < counts.size(); ++c) right += counts[c][c];
  return clips() > 0 ? static_cast<double>(right) / static_cast<double>(clips()) : std::numeric_limits<double>::quiet_NaN();
}

double Confusion::balanced_accuracy() const {
  double sum = 0, occur = 0;
  for (std::size_t c = 0; c < counts.size(); ++c) {
    const auto n = std::accumulate(counts[c].begin(), counts[c].end(), std::size_t{0});
    if (n == 0) continue;
    sum += static_cast<double>(counts[c][c]) / static_cast<double>(n);
    ++occur;
  }
  return occur > 0 ? sum / occur : std::numeric_limits<double>::quiet_NaN();
}

nlohmann::ordered_json Confusion::to_json() const {
  return {{"clips", clips()}, {"accuracy", accuracy()}, {"balanced_accuracy", balanced_accuracy()}, {"classes", classes}, {"confusion", counts}, {"unlabelled", unlabelled}, {"unknown", unknown}};
}

std::string Confusion::to_text() const {
  if (clips() == 0) return fmt::format("no clip has a class that the classifier knows; {} unlabelled\n", unlabelled);
  std::string out = fmt::format("accuracy {:.4f}, mean over classes {:.4f}, {} clips, {} unlabelled\n", accuracy(), balanced_accuracy(), clips(), unlabelled);
  std::size_t width = 4;
  for (const auto& name : classes) width = std::max(width, name.size());
  out += fmt::format("{:<{}}", "true", width);
  for (const auto& name : classes) out += fmt::format("  {:>{}}", name, width);
  out += "\n";
  for (std::size_t c = 0; c < classes.size(); ++c) {
    out += fmt::format("{:<{}}", classes[c], width);
    for (const std::size_t n : counts[c]) out += fmt::format("  {:>{}}", n, width);
    out += "\n";
  }
  return out;
}

std::size_t found_class(const Judged& judged, std::size_t row) {
  const auto i = static_cast<Eigen::Index>(row);
  Eigen::Index best = 0;
  for (Eigen::Index c = 1; c < judged.posteriors.cols(); ++c)
    if (judged.posteriors(i, c) > judged.posteriors(i, best)) best = c;
  return static_cast<std::size_t>(best);
}

Confusion confusion(const Classifier& classifier, const std::vector<Clip>& clips, const Judged& judged) {
  Confusion out;
  out.classes = classifier.classes();
  out.counts.assign(out.classes.size(), std::vector<std::size_t>(out.classes.size(), 0));
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const auto label = clips[i].attributes.find(classifier.attribute());
    if (label == clips[i].attributes.end() || label->second.empty()) {
      ++out.unlabelled;
      continue;
    }
    const auto at = std::find(out.classes.begin(), out.classes.end(), label->second);
    if (at == out.classes.end())
      out.unknown.push_back(clips[i].name);
    else
      ++out.counts[static_cast<std::size_t>(at - out.classes.begin())][found_class(judged, i)];
  }
  return out;
}

}  // namespace mocap::classifier
