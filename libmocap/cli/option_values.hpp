// What CLI11 knows about an option, in the words of this project.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace mocap::cli {

bool is_flag(const CLI::Option& option);
// "true", "false", or how often it was given where that is more than once ("-v -v": "2").
std::string flag_value(const CLI::Option& option);

// The type CLI11 derived from the variable ("FLOAT", "INT", "UINT", "TEXT", ...) without the descriptions of validators.
std::string type_of(const CLI::Option& option);
bool is_numeric(const CLI::Option& option);

// "FILE", "HZ", "auto|m|cm", "N": from the validators, otherwise from the type; "" for flags.
std::string placeholder(const CLI::Option& option);
// "a number above 0" and the like, from the validators; "".
std::string constraint(const CLI::Option& option);

// The given values, otherwise the default; floating-point numbers in their shortest form. Empty where there is neither.
std::vector<std::string> effective_values(const CLI::Option& option);

}  // namespace mocap::cli
