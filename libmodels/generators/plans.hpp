// Which motions `sample` makes: combinations of attributes, schedules, and places in a latent space.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "libmocap/formats/attribute_schedule.hpp"
#include "libmodels/generators/generator.hpp"

namespace mocap::generators {

struct Plan {  // what every so many motions are made by
  std::string name;  // of the schedule; "" without one
  Attributes attributes;
  std::vector<AttributeChange> changes;
  std::int64_t frames = 0;
};

// `attributes`: NAME=VALUE, several values of a name are alternatives. Every combination that was trained on, or those of them that have these values. Error(usage) for what the model does not know.
std::vector<Plan> attribute_plans(const Generator& generator, const std::vector<std::string>& attributes, std::int64_t frames);

// The schedules in turn, each with the first choice of what it leaves open, then each with the second, and so on. `frames`: of schedules whose last row has no end (the model's default).
// Error(data) with file and line for what the model does not know and for times that fall on one word of it; combinations never trained on are warned about.
std::vector<Plan> scheduled_plans(const Generator& generator, const std::vector<std::string>& attributes, std::optional<std::int64_t> frames, const formats::AttributeSchedules& schedules, const std::string& file);

// "0.1:0.9:0.1" (first, last, step) or one number: quantiles above 0 and below 1, at most 10,000. Error(usage).
std::vector<double> parse_quantiles(const std::string& text);

}  // namespace mocap::generators
