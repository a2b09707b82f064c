// Checks on option values. Each names what it expects in --help and in the generated docs.
//
// CLI11's own numbers accept "nan", "inf", "0x10" and read "010" as octal; these accept plain decimal numbers only, in
// every locale. run() adds number() or whole() to a numeric option that has no check of its own.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::cli {

// The whole of `text` as a finite decimal number ("-1.5", ".5", "1e3"), or nothing.
std::optional<double> parse_number(std::string_view text);
// The whole of `text` as a decimal integer without leading zeros, or nothing.
std::optional<std::int64_t> parse_whole(std::string_view text);

// `unit` is the placeholder shown in --help: "HZ", "SECONDS", "METRES", ...
CLI::Validator number(const std::string& unit = "NUMBER");
CLI::Validator positive(const std::string& unit = "NUMBER");      // > 0
CLI::Validator non_negative(const std::string& unit = "NUMBER");  // >= 0
CLI::Validator between(double low, double high, const std::string& unit = "NUMBER");  // both ends included
CLI::Validator whole(std::int64_t low = std::numeric_limits<std::int64_t>::min(),
                     std::int64_t high = std::numeric_limits<std::int64_t>::max(), const std::string& unit = "N");
CLI::Validator one_of(const std::vector<std::string>& words);  // exact spelling
// A path that is not empty; existence is checked where it is opened (status 3, not 2). `unit`: "FILE", "FILE.tsv", "DIR".
CLI::Validator path(const std::string& unit = "FILE");

}  // namespace mocap::cli
