// Archives that are damaged, foreign or made to do harm.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "libmocap/base/error.hpp"
#include "libmocap/store/model_file.hpp"
#include "tests/store/sample_clips.hpp"

// HDF5 1.10.8 itself loses the 424 bytes of an object header whose checksum does not fit.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\n"; }

namespace mocap {
namespace {

using store::ArchiveReader;
using testing::one_joint;
using testing::refusal;
using testing::sample_clip;
using testing::slurp;
using testing::TemporaryFolder;
using testing::with_contacts;
using testing::write_archive;

std::shared_ptr<const Skeleton> two_joints() {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->joint_names = {"root", "tip"};
  skeleton->parents = {-1, 0};
  skeleton->rest_offsets = {Vector3::Zero(), Vector3(0, 0, 1)};
  skeleton->end_sites = {{1, Vector3(0, 0, 0.5)}};
  skeleton->roles = {{"head", "tip"}};
  return skeleton;
}

void write_base(const std::string& path) {
  const auto skeleton = two_joints();
  Clip first = with_contacts(sample_clip("first", 4, 1, skeleton)), second = with_contacts(sample_clip("second", 3, 2, skeleton));
  first.attributes = {{"action", "walking"}};
  first.segments = {{1, 2, {{"action", "jogging"}}}};
  first.path = {{0, 0}, {1, 0}};
  write_archive(path, {first, second}, "preset:x");
}

void write_tiny(const std::string& path) {
  Clip clip = with_contacts(sample_clip("c", 1, 1, one_joint()));
  clip.source = {};
  store::ArchiveWriter writer(path, Overwrite::allow, {clip.skeleton, 30, "preset:x", {}});
  writer.add(clip);
  writer.finish();
}

store::ModelFile tiny_model() {
  store::ModelFile model;
  model.kind = "motion-cell";
  model.config = "{}";
  model.weights = {{"w", {{2}, {1, 2}}}};
  return model;
}

// Peak resident memory of this process since the last reset, in bytes; 0 where the system does not tell. After a reset it
// is what is resident now.
std::size_t peak_memory(bool reset) {
  if (reset) {
    const int fd = ::open("/proc/self/clear_refs", O_WRONLY);
    const bool done = fd >= 0 && ::write(fd, "5", 1) == 1;
    if (fd >= 0) ::close(fd);
    if (!done) return 0;
  }
  const std::string status = slurp("/proc/self/status");
  const auto at = status.find("VmHWM:");
  return at == std::string::npos ? 0 : std::stoul(status.substr(at + 6)) * 1024;
}

TEST(Hostile, EachDefectIsFoundAndNamed) {
  const TemporaryFolder folder;
  const std::string base = folder / "base.h5", table = folder / "table.tsv";
  write_base(base);
  ASSERT_EQ(ArchiveReader(base).check(true), std::vector<std::string>{});
  const std::string digest = ArchiveReader(base).digest();
  const int status = testing::python("make_defects.py", base + " " + folder.path() + " > " + table);
  if (status < 0) GTEST_SKIP() << "python3-h5py is not installed";
  ASSERT_EQ(status, 0);
  std::istringstream lines(slurp(table));
  std::string line;
  std::size_t count = 0;
  while (std::getline(lines, line)) {
    const auto a = line.find('\t'), b = line.find('\t', a + 1);
    const std::string file = line.substr(0, a), found = line.substr(a + 1, b - a - 1), message = line.substr(b + 1), path = folder / file;
    SCOPED_TRACE(file);
    const std::size_t before = peak_memory(true);
    const std::string opening = refusal([&] { ArchiveReader reader(path); });
    if (found == "open") {
      EXPECT_EQ(opening.find(path), 0u) << opening;
      EXPECT_NE(opening.find(message), std::string::npos) << opening << "\nexpected: " << message;
    } else {
      ASSERT_EQ(opening, "");
      const ArchiveReader reader(path);
      std::string reading;
      for (std::size_t i = 0; i < reader.size() && reading.empty(); ++i) reading = refusal([&] { reader.read(i); });
      EXPECT_EQ(reading.find(message) != std::string::npos && !reading.empty(), found == "read") << reading;
      const auto defects = reader.check(true);
      EXPECT_EQ(defects.empty(), found == "fine") << (defects.empty() ? "" : defects[0]);
      if (found == "fine") EXPECT_EQ(reader.digest(), digest);
      else EXPECT_TRUE(std::any_of(defects.begin(), defects.end(), [&](const std::string& d) { return d.find(message) != std::string::npos; })) << (defects.empty() ? "" : defects[0]);
    }
    if (before > 0) {
      EXPECT_LT(peak_memory(false) - before, std::size_t{64} << 20);
    }
    ++count;
  }
  EXPECT_GE(count, 90u);
}

TEST(Hostile, WhatIsNoHdf5IsNamed) {
  const TemporaryFolder folder;
  const auto opening = [&](const std::string& bytes) {
    testing::put(folder / "x.h5", bytes);
    return refusal([&] { ArchiveReader reader(folder / "x.h5"); });
  };
  EXPECT_NE(opening("").find("an empty file, expected a motion archive"), std::string::npos);
  EXPECT_NE(opening("HIERARCHY\nROOT Hips\n").find("not an HDF5 file, expected a motion archive"), std::string::npos);
  EXPECT_NE(opening(std::string(5000, '\0')).find("not an HDF5 file"), std::string::npos);
  EXPECT_NE(opening("\x89HDF\r\n\x1a\n").find("truncated: 8 bytes"), std::string::npos);
  EXPECT_NE(refusal([&] { ArchiveReader reader(folder.path()); }).find("is a folder"), std::string::npos);
  EXPECT_NE(refusal([&] { ArchiveReader reader(folder / "absent"); }).find("cannot be opened"), std::string::npos);
  EXPECT_NE(refusal([&] { ArchiveReader reader("/dev/null"); }).find("an empty file"), std::string::npos);

  write_tiny(folder / "good.h5");
  const std::string good = slurp(folder / "good.h5");
  EXPECT_NE(opening(good + "x").find("something follows the motion archive"), std::string::npos);
  EXPECT_NE(opening(std::string(512, '\0') + good).find("not an HDF5 file"), std::string::npos) << "HDF5 itself would find it at 512";
  std::string open_flag = good;
  open_flag[11] = 1;
  EXPECT_NE(opening(open_flag).find("unfinished"), std::string::npos);
}

TEST(Hostile, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  const std::string archive = folder / "a.h5", model = folder / "m.h5";
  write_base(archive);
  store::write_model(model, Overwrite::allow, tiny_model());
  for (std::size_t size = slurp(archive).size(); size-- > 0;) {
    ASSERT_EQ(::truncate(archive.c_str(), static_cast<off_t>(size)), 0);
    ASSERT_NE(refusal([&] { ArchiveReader reader(archive); }), "") << size;
  }
  for (std::size_t size = slurp(model).size(); size-- > 0;) {
    ASSERT_EQ(::truncate(model.c_str(), static_cast<off_t>(size)), 0);
    ASSERT_NE(refusal([&] { store::read_model(model); }), "") << size;
  }
}

// Flips bits in place; `judge` says what a file's content is, or throws. In the test run one bit of every byte is flipped;
// with MOCAPKIT_EXHAUSTIVE=1 every bit.
template <class Judge>
void flip_bits(const std::string& path, const Judge& judge) {
  const bool all = std::getenv("MOCAPKIT_EXHAUSTIVE") != nullptr;
  const std::string good = slurp(path), content = judge();
  const int fd = ::open(path.c_str(), O_WRONLY);
  ASSERT_GE(fd, 0);
  std::size_t refused = 0, unchanged = 0, wrong = 0;
  for (std::size_t at = 0; at < good.size(); ++at)
    for (std::size_t bit = 0; bit < 8; ++bit) {
      if (!all && bit != (at * 5 + 3) % 8) continue;
      const char flipped = static_cast<char>(good[at] ^ (1 << bit));
      ASSERT_EQ(::pwrite(fd, &flipped, 1, static_cast<off_t>(at)), 1);
      try {
        if (judge() == content) {
          ++unchanged;
        } else {
          ++wrong;
          ADD_FAILURE() << "byte " << at << " bit " << bit << " changes the content unnoticed";
        }
      } catch (const Error& e) {
        if (e.status() == Exit::data) ++refused;
        else ADD_FAILURE() << "byte " << at << ": " << e.what();
      }
      ASSERT_EQ(::pwrite(fd, &good[at], 1, static_cast<off_t>(at)), 1);
    }
  ::close(fd);
  EXPECT_EQ(judge(), content);
  EXPECT_GT(refused, unchanged);  // most of the file is covered by checksums
  std::cout << good.size() << " bytes: " << refused << " flips refused, " << unchanged << " without effect\n";
}

TEST(Hostile, EveryBitFlipOfAnArchiveIsRefusedOrHarmless) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.h5";
  write_tiny(path);
  flip_bits(path, [&] {
    const ArchiveReader reader(path);
    const auto defects = reader.check(true);
    if (!defects.empty()) refuse({}, defects[0]);
    const auto& info = reader.info(0);
    return reader.digest() + info.name + info.source.path + std::to_string(info.source.phase) + reader.header().contacts_rule;
  });
}

TEST(Hostile, EveryBitFlipOfAModelIsRefusedOrHarmless) {
  const TemporaryFolder folder;
  const std::string path = folder / "m.h5";
  store::write_model(path, Overwrite::allow, tiny_model());
  flip_bits(path, [&] {
    const auto defects = store::check_model(path, true);
    if (!defects.empty()) refuse({}, defects[0]);
    const store::ModelFile model = store::read_model(path);
    std::string content = model.kind + model.config;
    for (const auto& [name, tensor] : model.weights) {
      content += name;
      for (const float v : tensor.values) content += " " + std::to_string(v);
    }
    return content;
  });
}

}  // namespace
}  // namespace mocap
