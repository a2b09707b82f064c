// Runs a fuzz target without libFuzzer: fuzz_NAME [--runs N] [--seed N] [FILE|FOLDER ...]
//
// The files, and those of the folders, are run as they are (past finds); then N mutations of the seeds (20,000), the same for the same seed on every machine. An input that makes the
// target end otherwise than with success or Error(data) is left as find-NAME in the current folder.
//   fuzz_NAME --write-seeds FOLDER     the seeds as files, and FOLDER.dict with the words: what libFuzzer starts from
#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/random.hpp"
#include "tests/fuzz/target.hpp"

namespace {

using namespace mocap;

constexpr std::size_t kLongest = 1 << 15;
std::string g_input, g_find;

void leave_find(const char* why) {
  const int file = ::open(g_find.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0) {
    for (std::size_t done = 0; done < g_input.size();) {
      const ssize_t n = ::write(file, g_input.data() + done, g_input.size() - done);
      if (n <= 0) break;
      done += static_cast<std::size_t>(n);
    }
    ::close(file);
  }
  for (const char* text : {"find: ", why, ", the input is in ", g_find.c_str(), "\n"}) (void)!::write(2, text, std::strlen(text));
}

void on_signal(int number) {
  leave_find(::strsignal(number));
  ::signal(number, SIG_DFL);
  ::raise(number);
}

void run(std::string_view bytes) {
  g_input = bytes;
  try {
    fuzz::one(bytes);
  } catch (const Error& e) {
    if (e.status() == Exit::data) return;
    leave_find(fmt::format("status {}: {}", static_cast<int>(e.status()), e.what()).c_str());
    std::_Exit(1);
  } catch (const std::exception& e) {
    leave_find(e.what());
    std::_Exit(1);
  }
}

class Mutator {
 public:
  Mutator(std::uint64_t seed) : random_(seed, 0x66757a7a), seeds_(fuzz::seeds()), words_(fuzz::words()) {
    for (const char* number : {"0", "-1", "1", "2147483648", "4294967295", "9223372036854775808", "1e400", "-1e-400", "nan", "inf", "0x10", "1,5", "010", "1e30", "99999999999999999999999", "+1", "-0", "."})
      words_.emplace_back(number);
  }
  std::string next() {
    std::string s = seeds_[below(seeds_.size())];
    for (std::size_t changes = 1 + below(6); changes > 0; --changes) change(s);
    if (s.size() > kLongest) s.resize(kLongest);
    return s;
  }

 private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random_.below(n)); }
  void change(std::string& s) {
    const std::size_t at = below(s.size() + 1), length = std::min(s.size() - at, std::size_t{1} << below(8));
    switch (below(11)) {
      case 0:  // a bit
        if (at < s.size()) s[at] = static_cast<char>(s[at] ^ (1 << below(8)));
        break;
      case 1:  // a byte
        if (at < s.size()) s[at] = static_cast<char>(below(256));
        break;
      case 2: s.erase(at, length); break;
      case 3: s.resize(at); break;
      case 4: s.insert(at, s.substr(below(s.size() + 1), length)); break;
      case 5: s.insert(at, words_[below(words_.size())]); break;
      case 6: s.insert(at, std::string(1 + below(64), static_cast<char>(below(256)))); break;
      case 7: {  // another seed's end
        const std::string& other = seeds_[below(seeds_.size())];
        s = s.substr(0, at) + other.substr(below(other.size() + 1));
        break;
      }
      case 8: {  // a number in place of one
        const std::size_t first = s.find_first_of("0123456789", at);
        if (first == std::string::npos) break;
        s.replace(first, s.find_first_not_of("0123456789.-+eE", first) == std::string::npos ? s.size() - first : s.find_first_not_of("0123456789.-+eE", first) - first, words_[below(words_.size())]);
        break;
      }
      case 9: {  // a line twice, or without one
        const std::size_t begin = s.rfind('\n', at) == std::string::npos ? 0 : s.rfind('\n', at) + 1, end = std::min(s.find('\n', begin), s.size() - 1) + 1;
        if (s.empty() || begin >= s.size()) break;
        if (below(2) == 0)
          s.insert(begin, s.substr(begin, end - begin));
        else
          s.erase(begin, end - begin);
        break;
      }
      default:  // four bytes, little-endian: a count, an offset
        if (at + 4 <= s.size()) {
          constexpr std::uint32_t kNumbers[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0x10000, 255};
          std::uint32_t n = kNumbers[below(7)];
          std::memcpy(s.data() + at, &n, 4);
        }
    }
  }

  Random random_;
  std::vector<std::string> seeds_, words_;
};

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = std::filesystem::path(argv[0]).filename().string();
  g_find = "find-" + name;
  log::start(name, log::Level::error);
  std::uint64_t runs = 20000, seed = 1;
  std::vector<std::filesystem::path> files;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (i + 1 < argc && argument == "--runs")
      runs = std::stoull(argv[++i]);
    else if (i + 1 < argc && argument == "--seed")
      seed = std::stoull(argv[++i]);
    else if (i + 1 < argc && argument == "--write-seeds") {
      fuzz::write_seeds(argv[++i]);
      return 0;
    } else if (std::filesystem::is_directory(argument)) {
      for (const auto& entry : std::filesystem::directory_iterator(argument)) files.push_back(entry.path());
    } else {
      files.emplace_back(argument);
    }
  }
  for (const int number : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) ::signal(number, on_signal);
  std::sort(files.begin(), files.end());
  for (const auto& file : files) run(contents(file));
  for (const auto& s : fuzz::seeds()) run(s);
  Mutator mutator(seed);
  for (std::uint64_t i = 0; i < runs; ++i) run(mutator.next());
  fmt::print("{}: {} files, {} mutations\n", name, files.size(), runs);
}
