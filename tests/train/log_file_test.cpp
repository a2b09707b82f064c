#include "libmodels/train/log_file.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "tests/base/temporary_folder.hpp"

namespace mocap::train {
namespace {

using testing::slurp;

void write_rows(const std::string& path, std::int64_t keep, std::int64_t first, std::int64_t last) {
  LogFile log(path, keep);
  for (std::int64_t step = first; step <= last; ++step)
    log.write({step, step / 4, 0.001, 0.25, 1.0 / static_cast<double>(step), {{"angle", 2.5}, {"kl", 3}}, step % 4 == 0 ? std::optional(7.5) : std::nullopt});
  log.flush();
}

TEST(LogFile, Columns) {
  const testing::TemporaryFolder folder;
  write_rows(folder / "log.tsv", 0, 3, 4);
  EXPECT_EQ(slurp(folder / "log.tsv"),
            "step\tepoch\tlearning_rate\tgradient_norm\tloss\tangle\tkl\tvalidation_loss\n"
            "3\t0\t0.001\t0.25\t0.333333\t2.5\t3\t\n"
            "4\t1\t0.001\t0.25\t0.25\t2.5\t3\t7.5\n");
}

TEST(LogFile, IsCutBackAndContinued) {
  const testing::TemporaryFolder folder;
  const std::string whole = folder / "whole.tsv", resumed = folder / "resumed.tsv";
  write_rows(whole, 0, 1, 200);
  write_rows(resumed, 0, 1, 137);
  write_rows(resumed, 120, 121, 200);
  EXPECT_EQ(slurp(resumed), slurp(whole));
}

TEST(LogFile, ARowCutOffByAKillIsDropped) {
  const testing::TemporaryFolder folder;
  write_rows(folder / "whole.tsv", 0, 1, 20);
  const std::string whole = slurp(folder / "whole.tsv");
  for (const std::size_t length : {whole.size() - 1, whole.size() - 9, whole.find("\n12\t") + 2, std::size_t{3}, std::size_t{0}}) {
    testing::put(folder / "log.tsv", whole.substr(0, length));
    const std::size_t rows = static_cast<std::size_t>(std::count(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length), '\n'));
    const auto kept = rows > 0 ? static_cast<std::int64_t>(rows) - 1 : 0;
    write_rows(folder / "log.tsv", 20, kept + 1, 20);
    EXPECT_EQ(slurp(folder / "log.tsv"), whole) << length;
  }
}

TEST(LogFile, KeepNoneStartsAnew) {
  const testing::TemporaryFolder folder;
  testing::put(folder / "log.tsv", "another file\n");
  write_rows(folder / "log.tsv", 0, 1, 1);
  EXPECT_EQ(slurp(folder / "log.tsv").substr(0, 5), "step\t");
}

TEST(LogFile, AFileThatCannotBeWrittenIsAnOutputError) {
  const testing::TemporaryFolder folder;
  try {
    LogFile log(folder / "absent/log.tsv", 0);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::io);
  }
}

}  // namespace
}  // namespace mocap::train
