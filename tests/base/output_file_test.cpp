#include "libmocap/base/output_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <barrier>
#include <csignal>
#include <thread>

#include "libmocap/base/error.hpp"
#include "tests/base/temporary_folder.hpp"

namespace mocap {
namespace {

using testing::put;
using testing::slurp;
using testing::TemporaryFolder;

// Runs `body` in a child process and returns its exit status (what body returns).
template <class F>
int in_child(F body) {
  const pid_t child = ::fork();
  if (child == 0) {
    int status = 99;
    try {
      status = body();
    } catch (...) {
    }
    ::_exit(status);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

template <class F>
int status_of(F body) {
  try {
    body();
    return 0;
  } catch (const Error& e) {
    return static_cast<int>(e.status());
  }
}

constexpr int kIo = static_cast<int>(Exit::io);

TEST(OutputFile, AppearsWholeOnCommitAndLeavesNoPart) {
  TemporaryFolder folder;
  OutputFile out(folder / "a", Overwrite::refuse);
  out.write("one ");
  out.write(std::string("t\0o", 3));
  EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  EXPECT_EQ(folder.names().size(), 1u);
  EXPECT_EQ(out.part_path().rfind(folder / "a.part-", 0), 0u);
  out.commit();
  EXPECT_EQ(slurp(folder / "a"), std::string("one t\0o", 7));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a"});
}

TEST(OutputFile, DroppedWithoutCommitLeavesNothing) {
  TemporaryFolder folder;
  put(folder / "old", "old");
  {
    OutputFile fresh(folder / "fresh", Overwrite::refuse), old(folder / "old", Overwrite::allow);
    fresh.write("x");
    old.write("x");
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"old"});
  EXPECT_EQ(slurp(folder / "old"), "old");
}

TEST(OutputFile, RefusesOrReplacesWhatExists) {
  TemporaryFolder folder;
  write_file(folder / "a", "first", Overwrite::refuse);
  EXPECT_EQ(status_of([&] { write_file(folder / "a", "second", Overwrite::refuse); }), kIo);
  EXPECT_EQ(slurp(folder / "a"), "first");
  write_file(folder / "a", "second", Overwrite::allow);
  EXPECT_EQ(slurp(folder / "a"), "second");
  EXPECT_EQ(folder.names().size(), 1u);
}

TEST(OutputFile, AFileThatAppearedMeanwhileIsNotReplaced) {
  TemporaryFolder folder;
  OutputFile out(folder / "a", Overwrite::refuse);
  out.write("mine");
  put(folder / "a", "theirs");
  EXPECT_EQ(status_of([&] { out.commit(); }), kIo);
  EXPECT_EQ(slurp(folder / "a"), "theirs");
}

TEST(OutputFile, OfTwentyRacingWritersOneWins) {
  for (int round = 0; round < 5; ++round) {
    TemporaryFolder folder;
    std::barrier start(20);
    std::atomic<int> won{0}, refused{0};
    std::atomic<int> winner{-1};
    {
      std::vector<std::jthread> writers;
      for (int n = 0; n < 20; ++n)
        writers.emplace_back([&, n] {
          try {
            OutputFile out(folder / "a", Overwrite::refuse);
            out.write(std::string(1000, static_cast<char>('a' + n)));
            start.arrive_and_wait();
            out.commit();
            ++won;
            winner = n;
          } catch (const Error& e) {
            if (e.status() == Exit::io) ++refused;
          }
        });
    }
    EXPECT_EQ(won, 1);
    EXPECT_EQ(refused, 19);
    EXPECT_EQ(slurp(folder / "a"), std::string(1000, static_cast<char>('a' + winner)));
    EXPECT_EQ(folder.names().size(), 1u);
  }
}

// In a child: the umask belongs to the whole process.
TEST(OutputFile, HonoursAndKeepsTheUmaskAlsoWithManyThreads) {
  TemporaryFolder folder;
  const int status = in_child([&] {
    ::umask(027);
    {
      std::vector<std::jthread> writers;
      for (int n = 0; n < 8; ++n)
        writers.emplace_back([&, n] {
          for (int i = 0; i < 20; ++i) write_file(folder / ("f" + std::to_string(n)), "x", Overwrite::allow);
        });
    }
    return ::umask(0) == 027 ? 0 : 1;
  });
  EXPECT_EQ(status, 0);
  struct stat info {};
  ASSERT_EQ(::stat((folder / "f0").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0640u);
}

TEST(OutputFile, RefusesPlacesThatCannotHoldAFile) {
  TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const auto mode : {Overwrite::refuse, Overwrite::allow}) {
    EXPECT_EQ(status_of([&] { check_output(folder.path(), mode); }), kIo);
    EXPECT_EQ(status_of([&] { check_output(folder / "no/such", mode); }), kIo);
    EXPECT_EQ(status_of([&] { check_output("/dev/full", mode); }), kIo);
    EXPECT_EQ(status_of([&] { write_file(folder / "pipe", "x", mode); }), kIo);
    EXPECT_EQ(status_of([&] { check_output("", mode); }), static_cast<int>(Exit::usage));
  }
  // Renaming over it would destroy it: no test may try that on a real device.
  EXPECT_EQ(std::filesystem::status(folder / "pipe").type(), std::filesystem::file_type::fifo);
}

TEST(OutputFile, RefusesAFolderThatMayNotBeWritten) {
  TemporaryFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0555));
  const int status = in_child([&] {
    // Root may write anywhere; somebody else may not.
    if (::geteuid() == 0 && ::setuid(65534) != 0) return 98;
    return status_of([&] { check_output(folder / "a", Overwrite::refuse); });
  });
  EXPECT_EQ(status, kIo);
}

TEST(OutputFile, ADiskThatIsFullLeavesNothing) {
  TemporaryFolder folder;
  put(folder / "old", "old");
  for (const char* name : {"new", "old"}) {
    const int status = in_child([&] {
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{1000, 1000};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      return status_of([&] { write_file(folder / name, std::string(5000, 'x'), Overwrite::allow); });
    });
    EXPECT_EQ(status, kIo);
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"old"});
  EXPECT_EQ(slurp(folder / "old"), "old");
}

TEST(OutputFile, StandardOutputReceivesAllOrNothing) {
  TemporaryFolder folder;
  const auto child = [&](const char* target, bool commit) {
    return in_child([&] {
      ::setenv("TMPDIR", folder.path().c_str(), 1);
      ::dup2(::open(target, O_WRONLY), STDOUT_FILENO);
      return status_of([&] {
        OutputFile out("-", Overwrite::refuse);
        out.write(std::string(700000, 'y'));
        if (commit) out.commit();
      });
    });
  };
  put(folder / "stdout", "");
  EXPECT_EQ(child((folder / "stdout").c_str(), false), 0);
  EXPECT_EQ(slurp(folder / "stdout"), "");
  EXPECT_EQ(child((folder / "stdout").c_str(), true), 0);
  EXPECT_EQ(slurp(folder / "stdout"), std::string(700000, 'y'));
  EXPECT_EQ(child("/dev/full", true), kIo);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"stdout"});
}

TEST(OutputFile, RefusesATerminal) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (terminal < 0 || ::grantpt(terminal) != 0 || ::unlockpt(terminal) != 0) GTEST_SKIP() << "no pseudo-terminals here";
  const int status = in_child([&] {
    ::dup2(::open(::ptsname(terminal), O_RDWR | O_NOCTTY), STDOUT_FILENO);
    return status_of([&] { check_output("-", Overwrite::allow); });
  });
  EXPECT_EQ(status, static_cast<int>(Exit::usage));
}

}  // namespace
}  // namespace mocap
