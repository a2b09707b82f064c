// The rows of an evaluation, and the forms they are written in.
#pragma once
#include <string>
#include <vector>

#include "libmocap/metrics/intervals.hpp"

namespace mocap::evaluation {

struct Row {
  std::string name;            // "fid", "fid.floor_halves", "accuracy.action.real"
  metrics::Interval interval;  // value, low and high are NaN where there is none
};

struct Report {
  std::string compat = "none";
  std::vector<Row> rows;
  std::vector<std::string> frozen, exploding;  // names of generated clips
  const metrics::Interval* find(const std::string& name) const;  // nullptr: no such row
};

enum class Format { text, tsv, json, latex };
Format parse_format(const std::string& name);  // Error(usage)

// text: a table, and at most 20 names each of clips that freeze or explode. tsv: figure, value, low, high, n. json: one object, NAME.value, NAME.low, NAME.high, NAME.n,
// compat, frozen, exploding. latex: a tabular. Six digits (json: all); "-" (json: null) where there is no value.
std::string format_report(const Report& report, Format format);

}  // namespace mocap::evaluation
