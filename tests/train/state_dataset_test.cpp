#include "libmodels/train/state_dataset.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/features/state.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::train {
namespace {

using mocap::testing::refusal;
using mocap::testing::TemporaryFolder;
using mocap::testing::write_archive;

struct Motions {
  TemporaryFolder folder;
  std::string path = folder / "train.h5";
  std::vector<Clip> clips;
  Motions() {
    for (std::size_t i = 0; i < 5; ++i) clips.push_back(mocap::testing::with_contacts(mocap::testing::sample_clip("clip" + std::to_string(i), 20 + 9 * i, i)));
    clips.push_back(mocap::testing::with_contacts(mocap::testing::sample_clip("single", 1, 9)));
    write_archive(path, clips, "preset:default");
  }
};
const Motions& motions() {
  static const Motions m;
  return m;
}

TEST(StateDataset, RowsAreStandardisedFeaturesAndContacts) {
  const StateDataset data(motions().path);
  ASSERT_EQ(data.clips().size(), 5u);
  EXPECT_EQ(data.left_out(), 1u);
  EXPECT_EQ(data.frames(), 20 + 29 + 38 + 47 + 56);
  EXPECT_EQ(data.columns(), 69);
  torch::Tensor all;
  for (const auto& c : data.clips()) all = all.defined() ? torch::cat({all, c.rows}) : c.rows;
  EXPECT_LT(all.narrow(1, 0, 69).mean(0).abs().max().item<double>(), 1e-4);
  EXPECT_LT(all.narrow(1, 0, 69).std(0, false).max().item<double>(), 1.001);
  const store::ArchiveReader reader(motions().path);
  const Clip third = reader.read(2);
  const auto x = features::encode_state(third);
  for (Eigen::Index t = 0; t < x.rows(); ++t) {
    for (Eigen::Index c = 0; c < 69; ++c) {
      const auto k = static_cast<std::size_t>(c);
      EXPECT_NEAR(data.clips()[2].rows[t][c].item<double>() * data.deviation()[k] + data.mean()[k], x(t, c), 1e-5);
    }
    for (std::size_t f = 0; f < 2; ++f) EXPECT_EQ(data.clips()[2].rows[t][static_cast<std::int64_t>(69 + f)].item<float>(), static_cast<float>(third.contacts[static_cast<std::size_t>(t)][f]));
  }
}

TEST(StateDataset, ClipsWithoutContactsAreLabelled) {
  TemporaryFolder folder;
  const Clip clip = mocap::testing::sample_clip("bare", 40, 3);
  write_archive(folder / "bare.h5", {clip});
  const StateDataset data(folder / "bare.h5");
  EXPECT_TRUE(data.labelled_here());
  EXPECT_EQ(data.contacts_rule(), "preset:default");
  const auto expected = label_contacts(store::ArchiveReader(folder / "bare.h5").read(0), contact_preset("default"));
  for (std::size_t t = 0; t < 40; ++t)
    for (std::size_t f = 0; f < 2; ++f) EXPECT_EQ(data.clips()[0].rows[static_cast<std::int64_t>(t)][static_cast<std::int64_t>(69 + f)].item<float>(), static_cast<float>(expected[t][f]));
}

TEST(StateDataset, WindowsComeFromAnywhereAndShortClipsAreMasked) {
  const StateDataset data(motions().path);
  const StateBatch batch = draw_states(data, 400, 30, 1, 2);
  ASSERT_EQ(batch.rows.sizes(), at::IntArrayRef({30, 400, 71}));
  std::vector<int> places(5 * 64);
  for (std::int64_t b = 0; b < 400; ++b) {
    const auto real = static_cast<std::int64_t>(batch.mask.select(1, b).sum().item<double>());
    bool found = false;
    for (std::size_t i = 0; i < 5 && !found; ++i) {
      const auto& rows = data.clips()[i].rows;
      for (std::int64_t at = 0; at + real <= rows.size(0) && !found; ++at)
        if (torch::equal(batch.rows.select(1, b).narrow(0, 0, real), rows.narrow(0, at, real))) {
          found = true;
          ++places[i * 64 + static_cast<std::size_t>(at)];
          EXPECT_EQ(real, std::min<std::int64_t>(30, rows.size(0)));
        }
    }
    EXPECT_TRUE(found);
    if (real < 30) {
      EXPECT_TRUE(torch::equal(batch.rows[29][b], batch.rows[real - 1][b]));
    }
  }
  // 1 + 1 + 9 + 18 + 27 places, each drawn about 7 times.
  int used = 0;
  for (const int n : places) {
    used += n > 0;
    EXPECT_LT(n, 24);
  }
  EXPECT_GE(used, 54);
  EXPECT_TRUE(torch::equal(draw_states(data, 400, 30, 1, 2).rows, batch.rows));
  EXPECT_FALSE(torch::equal(draw_states(data, 400, 30, 1, 3).rows, batch.rows));
}

TEST(StateDataset, OtherSplitsShareTheStatistics) {
  TemporaryFolder folder;
  write_archive(folder / "val.h5", {mocap::testing::sample_clip("v", 33, 77)});
  const StateDataset train(motions().path), val(folder / "val.h5", train.reference());
  EXPECT_EQ(val.mean(), train.mean());
  EXPECT_EQ(val.deviation(), train.deviation());
  const auto x = features::encode_state(store::ArchiveReader(folder / "val.h5").read(0));
  EXPECT_NEAR(val.clips()[0].rows[5][10].item<double>() * train.deviation()[10] + train.mean()[10], x(5, 10), 1e-5);
}

TEST(StateDataset, Refusals) {
  TemporaryFolder folder;
  write_archive(folder / "short.h5", {mocap::testing::sample_clip("s", 1, 1)});
  EXPECT_NE(refusal([&] { StateDataset(folder / "short.h5"); }).find("no clip of 2 frames"), std::string::npos);
  Clip fast = mocap::testing::sample_clip("f", 30, 1);
  fast.frame_rate_hz = 60;
  write_archive(folder / "fast.h5", {fast});
  const StateDataset train(motions().path);
  EXPECT_NE(refusal([&] { StateDataset(folder / "fast.h5", train.reference()); }).find("60 Hz, expected the training data's 30 Hz"), std::string::npos);
}

}  // namespace
}  // namespace mocap::train
