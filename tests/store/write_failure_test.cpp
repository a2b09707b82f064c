// The disk refuses: one line, status 4, no .part left. A limit on the size of files stands in for a full disk.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/store/model_file.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap {
namespace {

using testing::sample_clip;
using testing::slurp;
using testing::TemporaryFolder;

struct Outcome {
  int status = -1;
  std::string log;
};

// Runs `body` in a child that may write files of at most `limit` bytes. Leaving normally gives status 0, Error(io) 104.
template <class F>
Outcome limited(const TemporaryFolder& folder, rlim_t limit, const F& body) {
  const std::string log = folder.path() + ".log";
  const pid_t child = ::fork();
  if (child == 0) {
    if (!std::freopen(log.c_str(), "w", stderr)) ::_exit(99);
    log::start("writer", log::Level::info);
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit size{limit, limit};
    ::setrlimit(RLIMIT_FSIZE, &size);
    try {
      body();
    } catch (const Error& e) {
      ::_exit(100 + static_cast<int>(e.status()));
    }
    std::exit(0);  // with exit handlers, as a tool leaves
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  Outcome out{WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), slurp(log)};
  ::unlink(log.c_str());
  return out;
}

TEST(WriteFailure, LeavesNothingBehindWhereverItHappens) {
  const TemporaryFolder folder;
  const std::string path = folder / "out.h5";
  std::vector<Clip> clips;
  for (std::uint64_t i = 0; i < 4; ++i) clips.push_back(sample_clip("c" + std::to_string(i), 2000, i));
  std::size_t failures = 0;
  for (rlim_t limit = 0;; limit += 150000) {
    const Outcome out = limited(folder, limit, [&] { testing::write_archive(path, clips); });
    if (out.status == 0) break;
    ++failures;
    if (limit == 0) {
      EXPECT_EQ(out.status, 104) << "HDF5 could not even create the file: an ordinary Error";
    } else {
      EXPECT_EQ(out.status, 4) << limit;
      EXPECT_EQ(out.log, "writer: " + path + ": write failed: File too large\n") << limit;
    }
    EXPECT_TRUE(folder.names().empty()) << limit;
    ASSERT_LT(failures, 100u);
  }
  EXPECT_GE(failures, 10u);
  EXPECT_EQ(store::ArchiveReader(path).check(true), std::vector<std::string>{});
}

TEST(WriteFailure, RemovesEveryUnfinishedOutput) {
  const TemporaryFolder folder;
  const Outcome out = limited(folder, 100000, [&] {
    store::ArchiveWriter other(folder / "other.h5", Overwrite::refuse, testing::header_for(sample_clip("a", 2, 1)));
    testing::write_archive(folder / "out.h5", {sample_clip("a", 2000, 1)});
  });
  EXPECT_EQ(out.status, 4);
  EXPECT_TRUE(folder.names().empty());
}

TEST(WriteFailure, KeepsTheOldFile) {
  const TemporaryFolder folder;
  const std::string path = folder / "out.h5";
  testing::write_archive(path, {sample_clip("old", 2, 1)});
  const std::string old = slurp(path);
  EXPECT_EQ(limited(folder, 100000, [&] { testing::write_archive(path, {sample_clip("new", 2000, 1)}); }).status, 4);
  EXPECT_EQ(slurp(path), old);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"out.h5"});
}

TEST(WriteFailure, OfAModel) {
  const TemporaryFolder folder;
  store::ModelFile model;
  model.kind = "motion-cell";
  model.config = "{}";
  model.weights["w"] = {{100000}, std::vector<float>(100000, 1)};
  const std::string path = folder / "m.h5";
  const Outcome out = limited(folder, 100000, [&] { store::write_model(path, Overwrite::refuse, model); });
  EXPECT_EQ(out.status, 4);
  EXPECT_EQ(out.log, "writer: " + path + ": write failed: File too large\n");
  EXPECT_TRUE(folder.names().empty());
}

TEST(WriteFailure, BeforeTheFirstByteIsAnOrdinaryError) {
  const TemporaryFolder folder;
  EXPECT_EQ(limited(folder, RLIM_INFINITY, [&] { testing::write_archive(folder / "nowhere/out.h5", {sample_clip("a", 2, 1)}); }).status, 104);
}

}  // namespace
}  // namespace mocap
