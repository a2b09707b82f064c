// A simulated AMASS: an archive of many clips written, its index opened, its clips read in random order.
//
// usage: bench_archive [FOLDER [CLIPS [HOURS [SHARDS]]]]    default: a temporary folder, 2000 clips, 4 hours, no shards
//
// Clips of the canonical body at 30 Hz with contacts and attributes, as canonicalize gives them: 1 s and exponentially distributed lengths beyond
// that, none over a minute, scaled to the hours asked for. FOLDER keeps whole.h5 and shard-K.h5, which motion-merge makes one again
// (scripts/bench-archive.sh). The page cache is warm: what is timed is the program, not the disk.
#include <benchmark/benchmark.h>
#include <fmt/core.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numeric>

#include "libmocap/base/random.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/store/archive.hpp"

namespace mocap {
namespace {

double wall() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double processor() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

constexpr std::size_t kRate = 30, kLongest = 60 * kRate;

// The motion that all clips are pieces of: making a new one for each would take longer than writing it.
Clip long_motion() {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = kRate;
  const auto joints = static_cast<std::size_t>(clip.joints());
  Random random(1, 0);
  std::vector<Vector3> axis(joints);
  for (auto& a : axis) a = 0.4 * Vector3(random.normal(), random.normal(), random.normal());
  for (std::size_t t = 0; t < 4 * kLongest; ++t) {
    const double phase = 0.13 * static_cast<double>(t);
    for (std::size_t j = 0; j < joints; ++j) clip.rotations.push_back(exp_map(axis[j] * std::sin(phase * (1 + 0.01 * static_cast<double>(j)))));
    clip.root_position.emplace_back(0.03 * static_cast<double>(t), 0.02 * std::sin(phase), 0.93 + 0.02 * std::cos(2 * phase));
    clip.contacts.push_back({static_cast<std::uint8_t>(t / 15 % 2), static_cast<std::uint8_t>((t + 7) / 15 % 2)});
  }
  return clip;
}

std::vector<std::size_t> lengths(std::size_t clips, double hours) {
  const double mean = hours * 3600 * kRate / static_cast<double>(clips);
  Random random(2, 0);
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < clips; ++i) {
    const double extra = std::max(mean - kRate, 1.0) * -std::log(1 - random.uniform());
    out.push_back(std::min<std::size_t>(kRate + static_cast<std::size_t>(extra), kLongest));
  }
  return out;
}

Clip clip_of(const Clip& motion, std::size_t i, std::size_t frames) {
  Random random(3, i);
  Clip clip = cut(motion, static_cast<std::size_t>(random.below(motion.frames() - frames + 1)), frames);
  const Vector3 start = clip.root_position[0];
  for (auto& p : clip.root_position) p -= Vector3(start.x(), start.y(), 1e-7 * static_cast<double>(i % 1000));
  clip.name = fmt::format("set{:02}/subject{:03}/take{:05}", i / 1000, i / 50, i);
  clip.attributes = {{"action", i % 3 ? "walking" : "jogging"}, {"subject", fmt::format("subject{:03}", i / 50)}, {"dataset", fmt::format("set{:02}", i / 1000)}};
  clip.source.path = clip.name + ".npz";
  clip.source.sha256 = to_hex(sha256(clip.name));
  clip.source.start_s = 0;
  clip.source.end_s = clip.seconds();
  clip.source.frame_rate_hz = 120;
  clip.source.unit = "m";
  clip.source.up_axis = "z";
  return clip;
}

// Clips first, first + step, ...: with step > 1 one shard of the whole.
double write(const std::string& path, const Clip& motion, const std::vector<std::size_t>& frames, std::size_t first, std::size_t step) {
  HistoryEntry command{"canonicalize", "0", "bench", {"canonicalize"}, std::nullopt, {}};
  for (std::size_t i = first; i < frames.size(); i += step) {
    const std::string name = fmt::format("set{:02}/subject{:03}/take{:05}", i / 1000, i / 50, i);
    command.inputs.push_back({name + ".npz", to_hex(sha256(name))});
  }
  sort_inputs(command.inputs);
  double seconds = -wall();
  store::ArchiveWriter writer(path, Overwrite::allow, {motion.skeleton, motion.frame_rate_hz, "preset:default", {command}});
  for (std::size_t i = first; i < frames.size(); i += step) {
    seconds += wall();
    const Clip clip = clip_of(motion, i, frames[i]);
    seconds -= wall();
    writer.add(clip);
  }
  writer.finish();
  return seconds + wall();
}

void print_times(const char* what, std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  fmt::print("  {:<22} median {:.3f} ms, 99 % {:.3f} ms, 99.9 % {:.3f} ms, worst {:.3f} ms\n", what, ms[ms.size() / 2], ms[ms.size() * 99 / 100], ms[ms.size() * 999 / 1000], ms.back());
}

void run(const std::string& folder, std::size_t clips, double hours, std::size_t shards) {
  const std::string whole = folder + "/whole.h5";
  const Clip motion = long_motion();
  const auto frames = lengths(clips, hours);
  const auto total = std::accumulate(frames.begin(), frames.end(), std::size_t{0});
  fmt::print("{} clips, {:.1f} hours at {} Hz, {} frames of {} joints, {:.0f} MB\n", clips, static_cast<double>(total) / kRate / 3600, kRate, total, motion.joints(),
             static_cast<double>(total * (static_cast<std::size_t>(motion.joints()) * 16 + 14)) / 1e6);
  const double t = write(whole, motion, frames, 0, 1);
  fmt::print("  written in             {:.1f} s, {:.2f} M frames/s (wall clock, fsync included)\n", t, static_cast<double>(total) / t / 1e6);
  for (std::size_t k = 0; k < shards; ++k) write(fmt::format("{}/shard-{}.h5", folder, k + 1), motion, frames, k, shards);

  std::vector<double> opened, opened_cpu;
  for (int k = 0; k < 15; ++k) {
    const double a = wall(), b = processor();
    const store::ArchiveReader reader(whole);
    benchmark::DoNotOptimize(reader.size());
    opened.push_back(1e3 * (wall() - a)), opened_cpu.push_back(1e3 * (processor() - b));
  }
  print_times("index opened", opened);
  print_times("  processor time", opened_cpu);

  const store::ArchiveReader reader(whole);
  std::vector<std::size_t> order(reader.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Random random(4, 0);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(i))]);
  std::vector<double> read(reader.size()), read_cpu(reader.size());
  for (int round = 0; round < 2; ++round)  // the first warms the page cache
    for (const std::size_t i : order) {
      const double a = wall(), b = processor();
      const Clip clip = reader.read(i);
      benchmark::DoNotOptimize(clip.rotations.data());
      read[i] = 1e3 * (wall() - a), read_cpu[i] = 1e3 * (processor() - b);
    }
  print_times("a clip, random order", read);
  print_times("  processor time", read_cpu);
  const auto slow = static_cast<std::size_t>(std::count_if(read_cpu.begin(), read_cpu.end(), [](double ms) { return ms >= 1; }));
  const auto worst = static_cast<std::size_t>(std::max_element(read_cpu.begin(), read_cpu.end()) - read_cpu.begin());
  fmt::print("  over 1 ms of processor time: {} clips of {}; the worst has {} frames\n", slow, read.size(), frames[worst]);
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  fmt::print("  peak memory            {} MB\n", usage.ru_maxrss / 1024);
}

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  const bool temporary = argc < 2;
  const std::string folder = temporary ? std::string(std::filesystem::temp_directory_path() / "bench-archive") : argv[1];
  std::filesystem::create_directories(folder);
  const auto number = [&](int i, double missing) { return argc > i ? std::atof(argv[i]) : missing; };
  mocap::run(folder, static_cast<std::size_t>(number(2, 2000)), number(3, 4), static_cast<std::size_t>(number(4, 0)));
  if (temporary) std::filesystem::remove_all(folder);
}
