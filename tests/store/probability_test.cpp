#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/store/archive_set.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::store {
namespace {

using mocap::testing::header_for;
using mocap::testing::refusal;
using mocap::testing::sample_clip;
using mocap::testing::TemporaryFolder;

void write(const std::string& path, const std::vector<Clip>& clips, const std::vector<std::string>& classes) {
  ArchiveHeader header = header_for(clips.at(0));
  header.attribute_classes["act/ion"] = classes;
  ArchiveWriter writer(path, Overwrite::allow, header);
  for (const Clip& clip : clips) writer.add(clip);
  writer.finish();
}

Clip judged(const std::string& name, std::uint64_t seed, const std::map<std::string, float>& probability) {
  Clip clip = sample_clip(name, 5, seed);
  if (!probability.empty()) clip.attribute_probability["act/ion"] = probability;
  return clip;
}

TEST(Probabilities, ComeBackAsTheyWere) {
  const TemporaryFolder folder;
  const std::map<std::string, float> p{{"run", 0.25f}, {"walk", 0.75f}};
  write(folder / "a.h5", {judged("a", 1, p), judged("b", 2, {})}, {"run", "walk"});
  const ArchiveReader in(folder / "a.h5");
  EXPECT_EQ(in.header().attribute_classes.at("act/ion"), (std::vector<std::string>{"run", "walk"}));
  EXPECT_EQ(in.read(0).attribute_probability.at("act/ion"), p);
  EXPECT_TRUE(in.read(1).attribute_probability.empty());  // no classifier saw it
  EXPECT_TRUE(in.check(true).empty());
  // What a cut keeps, and what the header does not name is left out.
  EXPECT_EQ(cut(in.read(0), 1, 3).attribute_probability.at("act/ion"), p);
  write(folder / "b.h5", {judged("a", 1, p)}, {"walk"});
  EXPECT_EQ(ArchiveReader(folder / "b.h5").read(0).attribute_probability.at("act/ion"), (std::map<std::string, float>{{"walk", 0.75f}}));
  EXPECT_EQ(ArchiveReader(folder / "b.h5").info(0).digest, in.info(0).digest);
}

TEST(Probabilities, OfSeveralArchivesHaveTheColumnsOfAll) {
  const TemporaryFolder folder;
  write(folder / "a.h5", {judged("a", 1, {{"run", 0.25f}, {"walk", 0.75f}})}, {"run", "walk"});
  write(folder / "b.h5", {judged("b", 2, {{"jump", 1.0f}, {"walk", 0.0f}})}, {"jump", "walk"});
  const ArchiveSet set({folder / "a.h5", folder / "b.h5"});
  EXPECT_EQ(set.header().attribute_classes.at("act/ion"), (std::vector<std::string>{"run", "walk", "jump"}));
  ArchiveWriter writer(folder / "c.h5", Overwrite::refuse, set.header());
  for (const auto& item : set.items()) writer.add(set.read(item));
  writer.finish();
  const ArchiveReader in(folder / "c.h5");
  EXPECT_EQ(in.read(0).attribute_probability.at("act/ion"), (std::map<std::string, float>{{"jump", 0.0f}, {"run", 0.25f}, {"walk", 0.75f}}));
  EXPECT_EQ(in.read(1).attribute_probability.at("act/ion").at("jump"), 1.0f);
}

TEST(Probabilities, OutOfRangeOrWithoutClassesAreRefused) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::map<std::string, float>& p, const std::vector<std::string>& classes) { return refusal([&] { write(folder / "x.h5", {judged("a", 1, p)}, classes); }); };
  EXPECT_NE(refused({{"run", 1.5f}}, {"run"}).find("expected a number in 0..1"), std::string::npos);
  EXPECT_NE(refused({{"run", NAN}}, {"run"}).find("expected a number in 0..1"), std::string::npos);
  EXPECT_NE(refused({}, {}).find("expected at least one"), std::string::npos);
  EXPECT_NE(refused({}, {"run", "run"}).find("occurs twice"), std::string::npos);
  EXPECT_NE(refused({}, {""}).find("without a name"), std::string::npos);
}

}  // namespace
}  // namespace mocap::store
