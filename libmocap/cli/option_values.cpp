#include "libmocap/cli/option_values.hpp"

#include <fmt/format.h>

#include "libmocap/cli/validators.hpp"

namespace mocap::cli {
namespace {

// Descriptions of our validators read "UNIT: expectation"; others have no ": ".
std::vector<std::pair<std::string, std::string>> validator_descriptions(const CLI::Option& option) {
  std::vector<std::pair<std::string, std::string>> out;
  // CLI11 hands validators out only by index, only through a mutable option, and ends the list with an exception.
  auto& mutable_option = const_cast<CLI::Option&>(option);
  for (int i = 0;; ++i) {
    try {
      const std::string text = mutable_option.get_validator(i)->get_description();
      const auto colon = text.find(": ");
      if (colon != std::string::npos) out.emplace_back(text.substr(0, colon), text.substr(colon + 2));
    } catch (const CLI::OptionNotFound&) {
      return out;
    }
  }
}

}  // namespace

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

std::string flag_value(const CLI::Option& option) {
  if (option.count() > 1) return std::to_string(option.count());
  if (option.count() == 1) return option.results().front() == "false" ? "false" : "true";
  return option.get_default_str() == "true" ? "true" : "false";
}

std::string type_of(const CLI::Option& option) {
  const std::string full = option.get_type_name();
  return full.substr(0, full.find(':'));
}

bool is_numeric(const CLI::Option& option) {
  const std::string type = type_of(option);
  return type == "FLOAT" || type == "INT" || type == "UINT";
}

std::string placeholder(const CLI::Option& option) {
  if (is_flag(option)) return {};
  for (const auto& [unit, expectation] : validator_descriptions(option)) return unit;
  const std::string type = type_of(option);
  return type == "FLOAT" ? "NUMBER" : type == "INT" || type == "UINT" ? "N" : type;
}

std::string constraint(const CLI::Option& option) {
  std::string text;
  for (const auto& [unit, expectation] : validator_descriptions(option))
    if (!expectation.empty()) text += (text.empty() ? "" : ", ") + expectation;
  return text;
}

std::vector<std::string> effective_values(const CLI::Option& option) {
  std::vector<std::string> values;
  if (option.count() > 0) {
    values = option.results();
  } else {
    std::string text = option.get_default_str();
    if (option.get_items_expected_max() > 1) {
      // A vector's default reads "[a,b]".
      if (text.size() >= 2 && text.front() == '[' && text.back() == ']') text = text.substr(1, text.size() - 2);
      values = text.empty() || text == "\"\"" ? std::vector<std::string>{} : CLI::detail::split(text, ',');
    } else if (!text.empty() && text != "\"\"") {
      values = {text};
    }
  }
  if (type_of(option) == "FLOAT")
    for (auto& v : values)
      if (const auto number = parse_number(v)) v = fmt::format("{}", *number);
  return values;
}

}  // namespace mocap::cli
