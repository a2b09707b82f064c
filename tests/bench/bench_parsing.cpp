// Parsing of BVH and AMC against a bare loop of fast_float::from_chars over the same bytes, paired in one run.
//
// usage: bench_parsing [FOLDER...]    every .bvh and .amc below (AMC with its ASF); default: a walk of 60 s written as BVH
//
// The floor touches every byte once and turns every word that is a number into a double; parsing also checks each row, makes unit
// quaternions of the angles and keeps them sign-continuous. One core; median and range of 9 rounds.
#include <benchmark/benchmark.h>
#include <fast_float/fast_float.h>
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "libmocap/base/output_file.hpp"
#include "libmocap/io/asf.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

double bare_loop(const std::string& text) {
  double sum = 0;
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end) {
    while (p != end && (*p == ' ' || *p == '\n' || *p == '\r' || *p == '\t')) ++p;
    double v = 0;
    const auto r = fast_float::from_chars(p, end, v);
    if (r.ec == std::errc{}) sum += v, p = r.ptr;
    else
      while (p != end && *p != ' ' && *p != '\n' && *p != '\t') ++p;
  }
  return sum;
}

double seconds(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string walk() {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 120;
  for (int t = 0; t < 7200; ++t) {
    for (int j = 0; j < clip.joints(); ++j) clip.rotations.push_back(exp_map(Vector3(0.3 * std::sin(0.05 * t + j), 0.2 * std::cos(0.07 * t), 0.1 * std::sin(0.03 * t))));
    clip.root_position.emplace_back(0.01 * t, 0, 0.9);
  }
  make_sign_continuous(clip);
  return io::format_bvh(clip);
}

void compare(const char* what, const std::vector<std::string>& texts, const std::function<void(std::size_t)>& parse) {
  if (texts.empty()) return;
  std::size_t bytes = 0;
  for (const auto& t : texts) bytes += t.size();
  std::vector<double> ratios, speeds;
  for (int round = 0; round < 9; ++round) {
    const double floor = seconds([&] {
      for (const auto& t : texts) benchmark::DoNotOptimize(bare_loop(t));
    });
    const double ours = seconds([&] {
      for (std::size_t i = 0; i < texts.size(); ++i) parse(i);
    });
    ratios.push_back(floor / ours);
    speeds.push_back(static_cast<double>(bytes) / ours / 1e6);
  }
  std::sort(ratios.begin(), ratios.end());
  std::sort(speeds.begin(), speeds.end());
  fmt::print("{}: {:.1f} MB in {} files: {:.2f} of a bare fast_float loop (median of 9; {:.2f} .. {:.2f}), {:.0f} MB/s\n", what, static_cast<double>(bytes) / 1e6, texts.size(), ratios[4], ratios.front(),
             ratios.back(), speeds[4]);
}

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  using namespace mocap;
  namespace fs = std::filesystem;
  std::vector<std::string> bvh, amc;
  std::vector<io::Asf> asf;
  for (int a = 1; a < argc; ++a) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(argv[a])) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
      if (file.extension() == ".bvh") bvh.push_back(read_file(file.string()));
      if (file.extension() != ".amc") continue;
      const std::string stem = file.stem().string();
      amc.push_back(read_file(file.string()));
      asf.push_back(io::parse_asf(read_file((file.parent_path() / (stem.substr(0, stem.find('_')) + ".asf")).string())));
    }
  }
  if (bvh.empty() && amc.empty()) bvh.push_back(walk());
  compare("BVH", bvh, [&](std::size_t i) { benchmark::DoNotOptimize(io::parse_bvh(bvh[i])); });
  compare("AMC", amc, [&](std::size_t i) { benchmark::DoNotOptimize(io::parse_amc(amc[i], asf[i])); });
}
