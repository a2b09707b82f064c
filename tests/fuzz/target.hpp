// What a fuzz target is. One file <name>_fuzz.cpp each; tests/CMakeLists.txt builds it as fuzz_<name>, with driver.cpp in ordinary builds and with libFuzzer in the preset `fuzz`.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::fuzz {

// Small inputs that are read without an error, or nearly: what mutations start from.
std::vector<std::string> seeds();
// Words that mean something to the parser.
std::vector<std::string> words();
// One run. Error(data) is how input is refused; whatever else leaves - another status, another exception, a signal, require() - is a find.
void one(std::string_view bytes);

// A property that holds for everything that is read.
inline void require(bool holds, const char* property) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", property);
  std::abort();
}

// The bytes as a file, for parsers that open one; rewritten with every call, gone with the process.
const std::string& as_file(std::string_view bytes);
// A path in a folder of this process, for what is written.
std::string scratch(const std::string& name);

// The seeds as files of a folder, the words as FOLDER.dict: what libFuzzer starts from.
void write_seeds(const std::string& folder);

}  // namespace mocap::fuzz
