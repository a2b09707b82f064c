#include "libmocap/base/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace mocap::log {
namespace {

spdlog::level::level_enum to_spdlog(Level level) {
  switch (level) {
    case Level::debug: return spdlog::level::debug;
    case Level::info: return spdlog::level::info;
    case Level::warning: return spdlog::level::warn;
    case Level::error: return spdlog::level::err;
    case Level::off: return spdlog::level::off;
  }
  return spdlog::level::info;
}

Level current = Level::info;

}  // namespace

void start(const std::string& tool, Level level) {
  auto logger = std::make_shared<spdlog::logger>(tool, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_pattern("%n: %v");
  spdlog::set_default_logger(logger);
  set_level(level);
}

void set_level(Level level) {
  current = level;
  spdlog::default_logger_raw()->set_level(to_spdlog(level));
}

Level level() { return current; }

void write(Level level, const std::string& text) {
  const char* tag = level == Level::warning ? "warning: " : "";
  spdlog::default_logger_raw()->log(to_spdlog(level), "{}{}", tag, text);
}

}  // namespace mocap::log
