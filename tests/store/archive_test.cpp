#include "libmocap/store/archive.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "libmocap/base/error.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap {
namespace {

using store::ArchiveReader;
using store::ArchiveWriter;
using testing::header_for;
using testing::one_joint;
using testing::refusal;
using testing::sample_clip;
using testing::slurp;
using testing::TemporaryFolder;
using testing::with_contacts;
using testing::write_archive;

const TemporaryFolder& folder() {
  static const TemporaryFolder f;
  return f;
}

void expect_same_motion(const Clip& a, const Clip& b) {
  ASSERT_EQ(a.frames(), b.frames());
  ASSERT_EQ(a.rotations.size(), b.rotations.size());
  for (std::size_t k = 0; k < a.rotations.size(); ++k) ASSERT_LT(geodesic_distance(a.rotations[k], b.rotations[k]), 3e-7) << k;
  for (std::size_t t = 0; t < a.frames(); ++t) ASSERT_LT((a.root_position[t] - b.root_position[t]).norm(), 1e-7 * (1 + a.root_position[t].norm())) << t;
  EXPECT_EQ(a.contacts, b.contacts);
}

TEST(Archive, GivesBackWhatWasWritten) {
  Clip walk = with_contacts(sample_clip("walk 01", 40, 1)), run = with_contacts(sample_clip("run", 1, 2));
  walk.attributes = {{"action", "walking"}, {"gender", "female"}};
  walk.source = {"sub/walk.bvh", std::string(64, 'b'), 0.5, 1.75, 120, 3, true, "cm", "y"};
  walk.segments = {{0, 10, {{"action", "walking"}}}, {10, 30, {{"action", "jogging"}, {"speed", "fast"}}}};
  walk.path = {{0, 0}, {1, 0.5}, {2, 0.25}};
  run.attributes = {{"action", ""}};
  const std::string path = folder() / "both.h5";
  write_archive(path, {walk, run}, "preset:default");

  const ArchiveReader reader(path);
  EXPECT_EQ(reader.name(), path);
  ASSERT_EQ(reader.size(), 2u);
  EXPECT_EQ(reader.header().contacts_rule, "preset:default");
  EXPECT_EQ(reader.header().frame_rate_hz, 30);
  EXPECT_TRUE(reader.header().skeleton->same_as(*walk.skeleton));
  EXPECT_EQ(reader.header().skeleton->roles, walk.skeleton->roles);
  ASSERT_EQ(reader.header().history.size(), 1u);
  EXPECT_EQ(reader.header().history[0].argv, (std::vector<std::string>{"make", "--fps=30"}));
  EXPECT_EQ(reader.header().history[0].inputs[0].path, "a.bvh");
  EXPECT_EQ(reader.info(0).path_points, 3u);
  EXPECT_EQ(reader.info(1).start, 40);

  const Clip back = reader.read(0);
  expect_same_motion(walk, back);
  EXPECT_EQ(back.name, "walk 01");
  EXPECT_EQ(back.attributes, walk.attributes);
  EXPECT_EQ(back.source.path, "sub/walk.bvh");
  EXPECT_EQ(back.source.sha256, walk.source.sha256);
  EXPECT_EQ(back.source.start_s, 0.5);
  EXPECT_EQ(back.source.end_s, 1.75);
  EXPECT_EQ(back.source.frame_rate_hz, 120);
  EXPECT_EQ(back.source.phase, 3);
  EXPECT_TRUE(back.source.mirrored);
  ASSERT_EQ(back.segments.size(), 2u);
  EXPECT_EQ(back.segments[1].start, 10);
  EXPECT_EQ(back.segments[1].attributes, walk.segments[1].attributes);
  ASSERT_EQ(back.path.size(), 3u);
  EXPECT_EQ(back.path[1], Vector2(1, 0.5));

  const Clip single = reader.read(1);
  expect_same_motion(run, single);
  EXPECT_TRUE(single.attributes.empty()) << "an empty value is unlabelled";
  EXPECT_TRUE(single.segments.empty());
  EXPECT_FALSE(single.source.mirrored);
  EXPECT_EQ(reader.check(true), std::vector<std::string>{});
}

TEST(Archive, GoesWithoutContacts) {
  const std::string path = folder() / "no-contacts.h5";
  write_archive(path, {sample_clip("a", 3, 1)});
  const ArchiveReader reader(path);
  EXPECT_EQ(reader.header().contacts_rule, "");
  EXPECT_TRUE(reader.read(0).contacts.empty());
  EXPECT_EQ(reader.check(true), std::vector<std::string>{});
}

TEST(Archive, KeepsAwkwardNames) {
  std::vector<Clip> clips;
  for (const char* name : {"two words", "line\nbreak", "-o", "läufer ☺", "a/b%2F", ".", "..", "%", " "}) {
    clips.push_back(sample_clip(name, 2, clips.size()));
    clips.back().path = {{static_cast<double>(clips.size()), 0}};
    clips.back().attributes = {{"kind/of", "v" + std::string(name)}, {".", "dot"}};
    clips.back().source.path = name;
  }
  const std::string path = folder() / "names.h5";
  write_archive(path, clips);
  const ArchiveReader reader(path);
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const Clip back = reader.read(i);
    EXPECT_EQ(back.name, clips[i].name);
    EXPECT_EQ(back.source.path, clips[i].name);
    EXPECT_EQ(back.attributes, clips[i].attributes);
    ASSERT_EQ(back.path.size(), 1u);
    EXPECT_EQ(back.path[0].x(), static_cast<double>(i + 1));
  }
  EXPECT_EQ(reader.check(true), std::vector<std::string>{});
}

TEST(Archive, StoresUnitSignContinuousRotationsOnce) {
  Clip clip = sample_clip("a", 50, 3);
  for (std::size_t k = 0; k < clip.rotations.size(); k += 3) clip.rotations[k].coeffs() *= -1;
  for (std::size_t k = 1; k < clip.rotations.size(); k += 5) clip.rotations[k].coeffs() *= 1.0005;
  const std::string path = folder() / "signs.h5", again = folder() / "signs-again.h5";
  write_archive(path, {clip});
  const ArchiveReader reader(path);
  const Clip back = reader.read(0);
  const auto joints = static_cast<std::size_t>(back.joints());
  for (std::size_t k = 0; k < back.rotations.size(); ++k) {
    ASSERT_NEAR(back.rotations[k].norm(), 1, 2e-7);
    if (k >= joints) ASSERT_GE(back.rotations[k].dot(back.rotations[k - joints]), 0);
    else ASSERT_GE(back.rotations[k].w(), 0);
  }
  EXPECT_EQ(reader.check(true), std::vector<std::string>{});
  // The digest is of the stored values: the same before, after, and after another round.
  EXPECT_EQ(to_hex(store::clip_digest(clip)), reader.info(0).digest);
  EXPECT_EQ(to_hex(store::clip_digest(back)), reader.info(0).digest);
  write_archive(again, {back});
  EXPECT_EQ(slurp(path), slurp(again));
}

TEST(Archive, EqualContentGivesEqualBytes) {
  const std::vector<Clip> clips = {with_contacts(sample_clip("a", 30, 1)), with_contacts(sample_clip("b", 8, 2))};
  const std::string one = folder() / "one.h5", two = folder() / "two.h5";
  write_archive(one, clips, "preset:x");
  ::sleep(1);  // a time stamp would show
  write_archive(two, clips, "preset:x");
  EXPECT_EQ(slurp(one), slurp(two));
  EXPECT_EQ(ArchiveReader(one).file_sha256(), to_hex(sha256(slurp(one))));
}

TEST(Archive, DigestDependsOnMotionNotOnOrderOrPacking) {
  std::vector<Clip> clips;
  for (std::uint64_t i = 0; i < 5; ++i) clips.push_back(sample_clip("c" + std::to_string(i), 20 + i, i));
  const std::string path = folder() / "order.h5", reversed = folder() / "reversed.h5";
  write_archive(path, clips);
  write_archive(reversed, {clips.rbegin(), clips.rend()}, "", 9);
  const std::string digest = ArchiveReader(path).digest();
  EXPECT_EQ(digest, ArchiveReader(reversed).digest());
  EXPECT_LT(slurp(reversed).size(), slurp(path).size());
  clips[2].root_position[7].z() += 1e-3;
  write_archive(path, clips);
  EXPECT_NE(digest, ArchiveReader(path).digest());
}

TEST(Archive, ClipsSpanChunks) {
  // 700 frames of a chunk are about 22 joints x 16 bytes x 1489 rows: several chunks, cut anywhere.
  std::vector<Clip> clips;
  for (std::uint64_t i = 0; i < 9; ++i) clips.push_back(with_contacts(sample_clip("c" + std::to_string(i), 333 + 97 * i, i)));
  const std::string path = folder() / "chunks.h5";
  write_archive(path, clips, "preset:x");
  const ArchiveReader reader(path);
  for (const std::size_t i : {8u, 0u, 4u, 5u, 1u, 7u, 2u, 6u, 3u}) {
    expect_same_motion(clips[i], reader.read(i));
    EXPECT_EQ(to_hex(store::clip_digest(clips[i])), reader.info(i).digest);
  }
  EXPECT_EQ(reader.check(true), std::vector<std::string>{});
}

TEST(Archive, RefusesWhatItCannotKeep) {
  const Clip good = sample_clip("a", 4, 1);
  const auto attempt = [&](const Clip& clip, const std::string& rule = {}) {
    return refusal([&] {
      ArchiveWriter writer(folder() / "never.h5", Overwrite::refuse, header_for(good, rule));
      writer.add(good.contacts.empty() && !rule.empty() ? with_contacts(sample_clip("first", 2, 9)) : sample_clip("first", 2, 9));
      writer.add(clip);
    });
  };
  EXPECT_EQ(attempt(good), "");
  Clip clip = good;
  clip.name = "first";
  EXPECT_NE(attempt(clip).find("never.h5:clip first: the name occurs twice"), std::string::npos);
  clip.name = "";
  EXPECT_NE(attempt(clip).find("without a name"), std::string::npos);
  clip.name = "l\xe4ufer";
  EXPECT_NE(attempt(clip).find("not UTF-8"), std::string::npos);
  EXPECT_NE(attempt(sample_clip("b", 2, 1, one_joint())).find("another skeleton"), std::string::npos);
  clip = good;
  clip.frame_rate_hz = 60;
  EXPECT_NE(attempt(clip).find("60.000000 Hz, expected the archive's 30.000000 Hz"), std::string::npos);
  clip = good;
  clip.translations.assign(clip.rotations.size(), Vector3::Zero());
  EXPECT_NE(attempt(clip).find("joint translations"), std::string::npos);
  clip = good;
  clip.root_position[1].x() = 1e39;
  EXPECT_NE(attempt(clip).find("float32"), std::string::npos);
  clip = good;
  clip.rotations[3].coeffs().setZero();
  EXPECT_NE(attempt(clip).find("norm"), std::string::npos);
  EXPECT_NE(attempt(good, "preset:x").find("no contacts, expected contacts by rule preset:x"), std::string::npos);
  EXPECT_NE(attempt(with_contacts(good)).find("contacts, expected none"), std::string::npos);
  clip = good;
  clip.segments = {{2, 3, {}}};
  EXPECT_NE(attempt(clip).find("segment"), std::string::npos);
  clip = good;
  clip.source.sha256 = "abc";
  EXPECT_NE(attempt(clip).find("SHA-256"), std::string::npos);
  EXPECT_NE(refusal([&] { ArchiveWriter(folder() / "never.h5", Overwrite::refuse, header_for(good)).finish(); }).find("no clips"), std::string::npos);
  for (const auto& name : folder().names()) EXPECT_EQ(name.find("never.h5"), std::string::npos) << name;
}

TEST(Archive, AppearsOnlyWhenFinished) {
  const TemporaryFolder place;
  const std::string path = place / "out.h5";
  {
    ArchiveWriter writer(path, Overwrite::refuse, header_for(sample_clip("a", 2, 1)));
    writer.add(sample_clip("a", 2, 1));
    EXPECT_NE(::access(path.c_str(), F_OK), 0);
  }
  EXPECT_TRUE(place.names().empty());
  write_archive(path, {sample_clip("a", 2, 1)});
  EXPECT_EQ(place.names(), std::vector<std::string>{"out.h5"});
  EXPECT_NE(refusal([&] { ArchiveWriter(path, Overwrite::refuse, header_for(sample_clip("a", 2, 1))); }).find("exists already"), std::string::npos);
}

TEST(Archive, ReadsWhatIsNoRegularFile) {
  const std::string path = folder() / "piped.h5", pipe = folder() / "pipe";
  write_archive(path, {sample_clip("a", 6, 1)});
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::thread feeder([&] {
    const std::string bytes = slurp(path);
    const int fd = ::open(pipe.c_str(), O_WRONLY);
    EXPECT_EQ(::write(fd, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    ::close(fd);
  });
  const ArchiveReader reader(pipe);
  feeder.join();
  EXPECT_EQ(reader.digest(), ArchiveReader(path).digest());
  EXPECT_EQ(reader.file_sha256(), to_hex(sha256(slurp(path))));
  EXPECT_EQ(reader.read(0).frames(), 6u);
}

TEST(Archive, IsReadableWhenItsFolderIsNot) {
  const std::string path = folder() / "readonly.h5";
  write_archive(path, {sample_clip("a", 6, 1)});
  ASSERT_EQ(::chmod(path.c_str(), 0400), 0);
  const ArchiveReader one(path), two(path);  // no locks: any number at a time
  EXPECT_EQ(one.read(0).frames(), two.read(0).frames());
}

TEST(Archive, ThreadsShareAReader) {
  std::vector<Clip> clips;
  for (std::uint64_t i = 0; i < 8; ++i) clips.push_back(sample_clip("c" + std::to_string(i), 50, i));
  const std::string path = folder() / "threads.h5";
  write_archive(path, clips);
  const ArchiveReader reader(path);
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  for (std::size_t n = 0; n < 4; ++n)
    threads.emplace_back([&, n] {
      for (std::size_t i = 0; i < 40; ++i)
        if (to_hex(store::clip_digest(reader.read((i + n) % 8))) != reader.info((i + n) % 8).digest) ++wrong[n];
    });
  for (auto& t : threads) t.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

TEST(Archive, ProbeTellsTheFormats) {
  const std::string path = folder() / "probe.h5", text = folder() / "probe.txt";
  write_archive(path, {sample_clip("a", 2, 1)});
  testing::put(text, "HIERARCHY\n");
  EXPECT_EQ(store::probe(path), "mocap-motion");
  EXPECT_EQ(store::probe(text), "");
  EXPECT_EQ(store::probe(folder() / "missing"), "");
  EXPECT_EQ(store::probe(folder().path()), "");
}

// The contract through other eyes: names, types, filters, attributes and digests as h5py, NumPy and hashlib see them.
TEST(Archive, H5pySeesTheContract) {
  Clip walk = with_contacts(sample_clip("walk", 40, 1)), run = with_contacts(sample_clip("run/fast", 25, 2));
  walk.attributes = {{"action", "walking"}};
  run.segments = {{0, 25, {{"action", "jogging"}}}};
  run.path = {{0, 0}, {3, 1}};
  const std::string path = folder() / "contract.h5", packed = folder() / "contract-packed.h5";
  write_archive(path, {walk, run}, "preset:default");
  write_archive(packed, {walk, run}, "preset:default", 4);
  const int status = testing::python("check_contract.py", "archive " + path);
  if (status < 0) GTEST_SKIP() << "python3-h5py is not installed";
  EXPECT_EQ(status, 0);
  EXPECT_EQ(testing::python("check_contract.py", "archive " + packed), 0);
}

}  // namespace
}  // namespace mocap
