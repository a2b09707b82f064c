#include "libmocap/base/text_lines.hpp"

#include <algorithm>

#include "libmocap/base/output_file.hpp"

namespace mocap {

std::vector<TextLine> read_lines(const std::string& path, Digest* digest) {
  const std::string text = read_file(path, std::size_t{1} << 30, digest);
  std::vector<TextLine> lines;
  long number = 0;
  for (std::size_t at = text.starts_with("\xef\xbb\xbf") ? 3 : 0; at < text.size();) {
    const std::size_t stop = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, stop - at);
    at = stop + 1;
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (!line.empty()) lines.push_back({number, std::move(line)});
  }
  return lines;
}

}  // namespace mocap
