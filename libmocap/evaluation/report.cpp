#include "libmocap/evaluation/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"

namespace mocap::evaluation {
namespace {

std::string text(double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : std::string("-"); }
std::array<std::string, 5> columns(const Row& r) { return {r.name, text(r.interval.value), text(r.interval.low), text(r.interval.high), std::to_string(r.interval.n)}; }

std::string json(const Report& report) {
  nlohmann::ordered_json document;
  const auto number = [](double v) { return std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json(nullptr); };
  document["compat"] = report.compat;
  for (const Row& r : report.rows) {
    document[r.name + ".value"] = number(r.interval.value);
    document[r.name + ".low"] = number(r.interval.low);
    document[r.name + ".high"] = number(r.interval.high);
    document[r.name + ".n"] = r.interval.n;
  }
  document["frozen"] = report.frozen;
  document["exploding"] = report.exploding;
  return document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string latex(const Report& report) {
  std::string out = "\\begin{tabular}{lrrrr}\n\\hline\nfigure & value & low & high & n \\\\\n\\hline\n";
  for (const Row& r : report.rows) {
    std::string line = fmt::format("{} \\\\\n", fmt::join(columns(r), " & "));
    for (std::size_t at = 0; (at = line.find('_', at)) != std::string::npos; at += 2) line.insert(at, "\\");
    out += line;
  }
  return out + "\\hline\n\\end{tabular}\n";
}

std::string tsv(const Report& report) {
  std::string out = "figure\tvalue\tlow\thigh\tn\n";
  for (const Row& r : report.rows) out += fmt::format("{}\n", fmt::join(columns(r), "\t"));
  return out;
}

std::string table(const Report& report) {
  std::string out = fmt::format("{:<28}{:>13}{:>13}{:>13}{:>8}\n", "figure", "value", "low", "high", "n");
  for (const Row& r : report.rows) {
    const auto c = columns(r);
    out += fmt::format("{:<28}{:>13}{:>13}{:>13}{:>8}\n", c[0], c[1], c[2], c[3], c[4]);
  }
  for (const auto& [what, names] : {std::pair{"frozen", &report.frozen}, {"exploding", &report.exploding}})
    if (!names->empty()) {
      const std::size_t shown = std::min<std::size_t>(names->size(), 20);
      out += fmt::format("{}: {}{}\n", what, fmt::join(names->begin(), names->begin() + static_cast<std::ptrdiff_t>(shown), " "), shown < names->size() ? fmt::format(" and {} more", names->size() - shown) : std::string());
    }
  return out;
}

}  // namespace

const metrics::Interval* Report::find(const std::string& name) const {
  const auto at = std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return r.name == name; });
  return at == rows.end() ? nullptr : &at->interval;
}

Format parse_format(const std::string& name) {
  if (name == "text") return Format::text;
  if (name == "tsv") return Format::tsv;
  if (name == "json") return Format::json;
  if (name == "latex") return Format::latex;
  refuse_usage("--format '" + name + "', expected text, tsv, json or latex");
}

std::string format_report(const Report& report, Format format) {
  switch (format) {
    case Format::tsv: return tsv(report);
    case Format::json: return json(report);
    case Format::latex: return latex(report);
    case Format::text: break;
  }
  return table(report);
}

}  // namespace mocap::evaluation
