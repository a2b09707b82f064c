// Log lines on standard error (spdlog behind a small front). Payload never goes through here.
#pragma once
#include <fmt/core.h>

#include <string>

namespace mocap::log {

enum class Level { debug, info, warning, error, off };

// Call once at start: spdlog's own default logger writes to standard output. Lines read "tool: text".
void start(const std::string& tool, Level level);
void set_level(Level level);
Level level();

void write(Level level, const std::string& text);

template <class... A>
void debug(fmt::format_string<A...> f, A&&... a) { write(Level::debug, fmt::format(f, std::forward<A>(a)...)); }
template <class... A>
void info(fmt::format_string<A...> f, A&&... a) { write(Level::info, fmt::format(f, std::forward<A>(a)...)); }
template <class... A>
void warn(fmt::format_string<A...> f, A&&... a) { write(Level::warning, fmt::format(f, std::forward<A>(a)...)); }
template <class... A>
void error(fmt::format_string<A...> f, A&&... a) { write(Level::error, fmt::format(f, std::forward<A>(a)...)); }

}  // namespace mocap::log
