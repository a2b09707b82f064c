#include "libmodels/control/motion_model.hpp"

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/blas.hpp"
#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

using mocap::testing::refusal;
using torch::Tensor;

struct OneThread : ::testing::Environment {
  void SetUp() override { nn::use_one_blas_thread(); }
};
const auto* const kEnvironment = ::testing::AddGlobalTestEnvironment(new OneThread);

TEST(MotionModel, PriorIsTheNetworksOwnFrameByFrame) {
  const torch::NoGradGuard no_grad;
  const auto generator = tiny_generator();
  lstm_gmm::Network network(tiny(), 3);
  network.to(torch::kDouble);
  const auto refining = tiny_refiner();
  const Motion m = random_motion(7, 3, 5);
  for (const refiner::Model* r : {static_cast<const refiner::Model*>(nullptr), &refining}) {  // a refiner has no say in it
    const MotionModel model(generator, r, -1, torch::kDouble);
    const Carried before = model.start(generator.starts[4]);
    const Seen seen = model(before, m);
    for (std::int64_t b = 0; b < 3; ++b) {
      Tensor x = before.frame.view({1, 71}), state = before.state.view({1, 24});
      for (std::int64_t t = 0; t < 7; ++t) {
        x = torch::cat({x.narrow(1, 0, 69) + m.noise[t].narrow(0, b, 1), x.narrow(1, 69, 2)}, 1);
        const auto out = network.forward(x, state);
        const auto mixture = network.mixture(out.y, x);
        state = out.state;
        EXPECT_NEAR(seen.nats[t][b].item<double>(), lstm_gmm::feature_loss(mixture, m.states[t].narrow(0, b, 1)).item<double>(), 1e-9);
        EXPECT_LT((seen.contact_logits[t][b] - mixture.contact_logits[0]).abs().max().item<double>(), 1e-12);
        x = torch::cat({m.states[t].narrow(0, b, 1), m.contacts[t].narrow(0, b, 1)}, 1);
      }
    }
    EXPECT_TRUE(torch::equal(model.contacts_of(seen), (seen.contact_logits > 0).to(torch::kDouble)));
  }
}

TEST(MotionModel, StartsAreFoundTogetherAsAlone) {
  const auto generator = tiny_generator();
  const auto refining = tiny_refiner();
  const MotionModel model(generator, &refining);
  const auto together = model.starts(generator.starts);
  ASSERT_EQ(together.size(), 12u);
  for (const std::int64_t i : {0, 5, 11}) {
    const Carried alone = model.start(generator.starts[i]), &other = together[static_cast<std::size_t>(i)];
    for (const auto& [a, b] : {std::pair<Tensor, Tensor>{alone.frame, other.frame}, {alone.state, other.state}, {alone.shown, other.shown}, {alone.feet, other.feet}, {alone.refiner_state, other.refiner_state}, {alone.refiner_before, other.refiner_before}})
      EXPECT_TRUE(torch::equal(a, b)) << i;
    EXPECT_EQ(alone.speed, other.speed);
    // The way to the second of the two.
    const Clip clip = gentle_motions(4, 1)[static_cast<std::size_t>(i / 3)];
    const std::size_t first = i % 3 == 0 ? 0 : 23;
    EXPECT_NEAR(alone.speed, 30 * (clip.root_position[first + 1] - clip.root_position[first]).head<2>().norm(), 1e-3);
  }
}

TEST(MotionModel, ScaleIsThatOfTheComponentThatExplainsAFrameBest) {
  const torch::NoGradGuard no_grad;
  const auto generator = tiny_generator();
  const MotionModel model(generator, nullptr, -1, torch::kDouble);
  lstm_gmm::Network network(tiny(), 3);
  network.to(torch::kDouble);
  const Carried before = model.start(generator.starts[0]);
  const Motion m = random_motion(1, 2, 5);
  const Tensor scale = model.scale(before, m);
  for (std::int64_t b = 0; b < 2; ++b) {
    Tensor x = before.frame.view({1, 71}).clone();
    x.narrow(1, 0, 69) += m.noise[0].narrow(0, b, 1);
    const auto mixture = network.mixture(network.forward(x, before.state.view({1, 24})).y, x);
    double most = -1e300;
    Tensor best;
    for (std::int64_t i = 0; i < 2; ++i) {
      double log_p = mixture.log_weights[0][i].item<double>();
      for (std::int64_t k = 0; k < 69; ++k) {
        const double s = mixture.log_sigmas[0][i][k].item<double>(), z = (m.states[0][b][k].item<double>() - mixture.means[0][i][k].item<double>()) / std::exp(s);
        log_p -= 0.5 * z * z + s;
      }
      if (log_p <= most) continue;
      most = log_p;
      best = mixture.log_sigmas[0][i].exp();
    }
    EXPECT_LT((scale[0][b] - best).abs().max().item<double>(), 1e-12);
  }
}

TEST(MotionModel, InPartsItIsTheWhole) {
  const torch::NoGradGuard no_grad;
  const auto generator = tiny_generator();
  const auto refining = tiny_refiner();
  const Motion m = random_motion(9, 1, 8);
  for (const refiner::Model* r : {static_cast<const refiner::Model*>(nullptr), &refining}) {
    const MotionModel model(generator, r, generator.reference.skeleton->find_role("head"), torch::kDouble);
    const Carried start = placed(model.start(generator.starts[2]), 2, -1, 2.9);
    const Seen whole = model(start, m);
    for (const std::int64_t first : {1, 2, 4, 8}) {
      const Carried now = model.advance(start, m, first);
      const Motion rest{m.states.narrow(0, first, 9 - first), m.noise.narrow(0, first, 9 - first), m.contacts.narrow(0, first, 9 - first)};
      const Seen seen = model(now, rest);
      const auto expect = [&](const char* name, const Tensor& part, const Tensor& all) { EXPECT_LT((part - all.narrow(0, first, 9 - first)).abs().max().item<double>(), 1e-9) << name << " from " << first; };
      expect("nats", seen.nats, whole.nats);
      expect("rows", seen.rows, whole.rows);
      expect("root", seen.root, whole.root);
      expect("heading", seen.heading, whole.heading);
      expect("feet", seen.feet, whole.feet);
      expect("velocities", seen.foot_velocities, whole.foot_velocities);
      expect("feet on the ground", seen.feet_on_ground, whole.feet_on_ground);
      expect("point", seen.point, whole.point);
      expect("contacts", seen.contacts, whole.contacts);
      EXPECT_NEAR(now.x, whole.root[first - 1][0][0].item<double>(), 1e-12);
      EXPECT_NEAR(now.heading, whole.heading[first - 1][0].item<double>(), 1e-12);
    }
    EXPECT_THROW((void)model.advance(start, random_motion(4, 2, 1), 2), Error);
  }
}

// The first frame has no step of its own in a clip, so the start is given that of the frame behind it, as the encoder does.
// A generator that was fine-tuned is standardised by other data than its refiner.
void shows_what_refining_shows(bool units_of_its_own) {
  const torch::NoGradGuard no_grad;
  const auto generator = tiny_generator();
  auto refining = tiny_refiner();
  for (std::size_t c = 0; units_of_its_own && c < refining.reference.mean.size(); ++c) {
    refining.reference.mean[c] += 0.02F * static_cast<float>(c % 5);
    refining.reference.deviation[c] *= 1 + 0.1F * static_cast<float>(c % 7);
  }
  const MotionModel model(generator, &refining);
  const Motion m = random_motion(12, 1, 8, torch::kFloat);
  Tensor pair = generator.starts[2].clone();
  pair[0].narrow(0, 0, 3).copy_(m.states[0][0].narrow(0, 0, 3));
  const Carried start = placed(model.start(pair), 1, 2, -2);
  const Seen seen = model(start, m);
  Shown shown(model.reference(), start);
  shown.add(seen.rows.select(1, 0));
  const Clip ours = shown.piece();

  const Tensor rows = torch::cat({pair.narrow(0, 0, 1), torch::cat({m.states, m.contacts}, 2).select(1, 0)}).contiguous();
  auto [features, contacts] = train::raw_states(rows.data_ptr<float>(), 13, generator.reference);
  Clip clip = features::decode_state(features, generator.reference.skeleton, 30, {-2, {1, 2}});
  clip.contacts = std::move(contacts);
  const Clip theirs = refiner::Refining(refining)(clip);
  ASSERT_EQ(ours.frames(), theirs.frames());
  EXPECT_EQ(ours.contacts, theirs.contacts);
  double changed = 0;
  for (std::size_t t = 0; t < 13; ++t) {
    EXPECT_LT((ours.root_position[t] - theirs.root_position[t]).norm(), 2e-4) << t;
    for (std::size_t j = 0; j < 22; ++j) {
      EXPECT_LT(geodesic_distance(ours.frame(t)[j], theirs.frame(t)[j]), 2e-4) << t << " " << j;
      changed = std::max(changed, geodesic_distance(ours.frame(t)[j], clip.frame(t)[j]));
    }
  }
  EXPECT_GT(changed, 0.01);
}

TEST(MotionModel, WithARefinerItShowsWhatRefiningShows) {
  shows_what_refining_shows(false);
  shows_what_refining_shows(true);
}

TEST(MotionModel, FeetRestWhereTheyAreDown) {
  auto generator = tiny_generator();
  const Clip clip = gentle_motions(1, 1)[0];
  // By forward kinematics of the clip's own frames; starts are its frames 0 and 1.
  generator.starts = generator.starts.narrow(0, 0, 1).clone();
  generator.starts.narrow(2, 69, 2).copy_(torch::tensor({1.0f, 0.0f, 1.0f, 1.0f}).view({2, 2}));
  double sum = 0;
  for (const std::size_t t : {0, 1}) {
    Pose pose;
    world_pose(clip, t, pose);
    sum += pose.positions[static_cast<std::size_t>(clip.skeleton->find_role("left_foot"))].z();
    if (t == 1) sum += pose.positions[static_cast<std::size_t>(clip.skeleton->find_role("right_foot"))].z();
  }
  EXPECT_NEAR(MotionModel(generator, nullptr).rest_height(), sum / 3, 1e-5);
  generator.starts.narrow(2, 69, 2).zero_();
  EXPECT_EQ(MotionModel(generator, nullptr).rest_height(), 0.03);
}

TEST(MotionModel, WhatDoesNotFitIsRefused) {
  const auto generator = tiny_generator();
  const auto refused = [&](const std::function<void(refiner::Model&)>& change) {
    auto r = tiny_refiner();
    change(r);
    return refusal([&] { MotionModel(generator, &r); });
  };
  EXPECT_EQ(refused([](auto&) {}), "");
  EXPECT_NE(refused([](auto& r) { r.reference.frame_rate_hz = 60; }).find("60 Hz, expected the generator's 30 Hz"), std::string::npos);
  EXPECT_NE(refused([](auto& r) {
              auto s = std::make_shared<Skeleton>(*r.reference.skeleton);
              s->rest_offsets[3] *= 1.5;
              r.reference.skeleton = s;
            }).find("another skeleton than the generator's"),
            std::string::npos);
  auto footless = tiny_generator();
  auto s = std::make_shared<Skeleton>(*footless.reference.skeleton);
  s->roles.erase("right_foot");
  footless.reference.skeleton = s;
  EXPECT_NE(refusal([&] { MotionModel(footless, nullptr); }).find("skeleton/roles: no right_foot"), std::string::npos);
}

}  // namespace
}  // namespace mocap::control
