// Small text files by lines: tables, lists.
#pragma once
#include <string>
#include <vector>

#include "libmocap/base/sha256.hpp"

namespace mocap {

struct TextLine {
  long number;  // from 1, blank ones counted
  std::string text;
};

// The lines of a file ("-": standard input) that are not blank, without their ends (LF or CRLF) and without a byte-order mark. Error(data) where it
// cannot be read. `digest`, where given, receives the SHA-256 of the file's bytes.
std::vector<TextLine> read_lines(const std::string& path, Digest* digest = nullptr);

}  // namespace mocap
