#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "folder.hpp"
#include "libmocap/cli/clip_outputs.hpp"
#include "libmocap/cli/tool.hpp"

namespace mocap::cli {
namespace {

bool is_motion(const std::string& path) { return path.ends_with(".bvh"); }

std::vector<std::string> labels(const std::vector<InputFile>& files) {
  std::vector<std::string> out;
  for (const auto& f : files) out.push_back(f.label);
  return out;
}
std::vector<std::string> stems(const std::vector<InputFile>& files) {
  std::vector<std::string> out;
  for (const auto& f : files) out.push_back(f.stem);
  return out;
}
using Strings = std::vector<std::string>;

TEST(Inputs, FoldersAreSearchedAndSortedBytewise) {
  const Folder folder;
  for (const char* name : {"in/b.bvh", "in/B.bvh", "in/a/z.bvh", "in/a.bvh", "in/notes.txt", "in/.git/x.bvh", "in/._a.bvh", "in/c.npz.part-Ab12.bvh"}) folder.file(name, "x");
  const auto files = expand_inputs({"in"}, is_motion);
  EXPECT_EQ(labels(files), (Strings{"B.bvh", "a.bvh", "a/z.bvh", "b.bvh"}));
  EXPECT_EQ(files[2].path, "in/a/z.bvh");
  EXPECT_EQ(stems(files), (Strings{"B", "a", "a/z", "b"}));
  EXPECT_EQ(labels(expand_inputs({"in/"}, is_motion)), labels(files));
}

TEST(Inputs, ALinkToAFolderIsNotFollowedButALinkToAFileIs) {
  const Folder folder;
  folder.file("real/a.bvh", "x");
  std::filesystem::create_directories("in");
  std::filesystem::create_directory_symlink("..", "in/loop");
  std::filesystem::create_symlink("../real/a.bvh", "in/link.bvh");
  EXPECT_EQ(labels(expand_inputs({"in"}, is_motion)), (Strings{"link.bvh"}));
}

TEST(Inputs, TheOutputIsNoInput) {
  const Folder folder;
  for (const char* name : {"in/a.bvh", "in/out/a.bvh", "in/all.bvh"}) folder.file(name, "x");
  EXPECT_EQ(labels(expand_inputs({"in"}, is_motion, "in/out")), (Strings{"a.bvh", "all.bvh"}));
  EXPECT_EQ(labels(expand_inputs({"in"}, is_motion, "./in/all.bvh")), (Strings{"a.bvh", "out/a.bvh"}));
}

TEST(Inputs, LabelsThatMeetBecomePathsAsTyped) {
  const Folder folder;
  for (const char* name : {"x/w.bvh", "y/w.bvh", "y/v.bvh"}) folder.file(name, "x");
  EXPECT_EQ(labels(expand_inputs({"x", "y"}, is_motion)), (Strings{"x/w.bvh", "v.bvh", "y/w.bvh"}));
  EXPECT_EQ(labels(expand_inputs({"./x/w.bvh", "y//w.bvh"}, is_motion)), (Strings{"x/w.bvh", "y/w.bvh"}));
  EXPECT_EQ(labels(expand_inputs({"y/v.bvh"}, is_motion)), (Strings{"v.bvh"}));
  EXPECT_EQ(labels(expand_inputs({"-"}, is_motion)), (Strings{"-"}));
}

TEST(Inputs, StemsThatMeetKeepTheExtensionAndStayBelowTheOutput) {
  const Folder folder;
  for (const char* name : {"in/w.bvh", "in/w.npz", "in/v.tar.bvh.gz"}) folder.file(name, "x");
  const auto all = [](const std::string&) { return true; };
  EXPECT_EQ(stems(expand_inputs({"in"}, all)), (Strings{"v.tar", "w.bvh", "w.npz"}));
  EXPECT_EQ(stems(expand_inputs({"in", "-"}, all)).back(), "stdin");
  folder.file("w.bvh", "x");
  std::filesystem::current_path("in");
  EXPECT_EQ(stems(expand_inputs({"w.bvh", "../w.bvh"}, all)), (Strings{"w.bvh", "w.bvh-2"}));
  std::filesystem::current_path("..");
}

TEST(Inputs, AListNamesPathsRelativeToTheCurrentFolder) {
  const Folder folder;
  for (const char* name : {"in/a.bvh", "in/b.bvh"}) folder.file(name, "x");
  folder.file("lists/l.txt", "in/b.bvh\r\n\nin/a.bvh");
  EXPECT_EQ(labels(expand_inputs({"@lists/l.txt"}, is_motion)), (Strings{"b.bvh", "a.bvh"}));
  folder.file("lists/empty.txt", "\n\n");
  EXPECT_THROW(expand_inputs({"@lists/empty.txt"}, is_motion), Error);
  EXPECT_THROW(expand_inputs({"@lists/absent.txt"}, is_motion), Error);
}

TEST(Inputs, RepeatedPathsAreReadOnceAndStandardInputIsGivenOnce) {
  const Folder folder;
  folder.file("in/a.bvh", "x");
  EXPECT_EQ(labels(expand_inputs({"in/a.bvh", "./in//a.bvh", "in"}, is_motion)), (Strings{"a.bvh"}));
  try {
    expand_inputs({"-", "in", "-"}, is_motion);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::usage);
  }
}

TEST(Inputs, AFolderWithoutMotionIsAFailedInput) {
  const Folder folder;
  folder.file("in/a.bvh", "x");
  folder.file("none/a.txt", "x");
  const auto files = expand_inputs({"none", "in"}, is_motion);
  ASSERT_EQ(files.size(), 2u);
  ASSERT_TRUE(files[0].failure);
  EXPECT_EQ(files[0].failure->status(), Exit::data);
  EXPECT_FALSE(files[1].failure);
}

TEST(Shards, CoverEachInputOnceInWhateverOrderTheTasksWereGiven) {
  std::vector<InputFile> files;
  for (int i = 0; i < 23; ++i) files.push_back({"f" + std::to_string(i), "", "", {}});
  for (const int n : {1, 2, 5, 23, 40}) {
    std::set<std::string> seen;
    std::size_t count = 0;
    for (int i = 1; i <= n; ++i) {
      std::rotate(files.begin(), files.begin() + 7, files.end());
      for (const auto& f : take_shard(files, std::to_string(i) + "/" + std::to_string(n))) {
        seen.insert(f.path);
        ++count;
      }
    }
    EXPECT_EQ(count, files.size()) << n;
    EXPECT_EQ(seen.size(), files.size()) << n;
  }
  for (const char* bad : {"", "1", "0/2", "3/2", "1/0", "a/b", "1/2/3", "-1/2", "1/", "/2", "01/2"}) EXPECT_THROW(take_shard(files, bad), Error) << bad;
}

TEST(FileNames, AreSafeForAnyClipName) {
  EXPECT_EQ(safe_file_name("walk 01"), "walk 01");
  EXPECT_EQ(safe_file_name("a/b\\c:d\n"), "a_b_c_d_");
  EXPECT_EQ(safe_file_name("../x"), "_.._x");
  EXPECT_EQ(safe_file_name("-f"), "_-f");
  EXPECT_EQ(safe_file_name(""), "clip");
  EXPECT_EQ(safe_file_name("\xc3\xa4"), "\xc3\xa4");
  EXPECT_EQ(safe_file_name(std::string(199, 'x') + "\xc3\xa4").size(), 199u);
}

}  // namespace
}  // namespace mocap::cli
