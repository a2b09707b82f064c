#include "libmodels/control/solve.hpp"

#include <cmath>
#include <limits>

#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

using torch::Tensor;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Problem {
  lstm_gmm::Model generator = tiny_generator();
  refiner::Model refiner = tiny_refiner();
  lstm_gmm::Sampler sampler{*generator.network};
  MotionModel model{generator, nullptr}, refined{generator, &refiner};
  Carried before = model.start(generator.starts[0]);
  Terms terms = {prior(), noise_prior(0.05), curve_term(std::make_shared<GroundCurve>(std::vector<Vector2>{{0, 0}, {2, 0.5}}), 0, 3, 0.05), contact_term(0.05, 0.05, 0.03)};

  Motion swarm_of(int particles, int rounds, std::uint64_t stream = 5, int threads = 1, const Tensor& given = {}) const { return swarm_of(terms, particles, rounds, stream, threads, given); }
  Motion swarm_of(const Terms& these, int particles, int rounds, std::uint64_t stream = 5, int threads = 1, const Tensor& given = {}) const {
    return swarm(model, sampler, before, 6, given, these, {particles, rounds, 1, threads}, 9, stream);
  }
  double value(const Motion& m) const { return objective(model, before, m, terms).item<double>(); }
};
const Problem& problem() {
  static const Problem p;
  return p;
}

bool same(const Motion& a, const Motion& b) { return torch::equal(a.states, b.states) && torch::equal(a.noise, b.noise) && torch::equal(a.contacts, b.contacts); }

// Minus the distance: who stays away from `rows` is the better.
std::shared_ptr<const Term> away_from(const Tensor& rows) {
  return term_of([rows](const Seen& seen) { return -(seen.rows.narrow(0, 0, rows.size(0)) - rows.unsqueeze(1)).abs().sum(2).sum(0); });
}

TEST(Swarm, BeginsWithTheBestOfTheParticles) {
  const torch::NoGradGuard no_grad;
  const Problem& p = problem();
  const auto values = [](const Tensor& t) { return std::vector<float>(t.data_ptr<float>(), t.data_ptr<float>() + t.numel()); };
  double least = 1e300;
  for (std::uint64_t i = 0; i < 7; ++i) {
    Random random(9, stream_of(5, i));
    lstm_gmm::ClipRequest r{0, 0, 7, values(p.before.frame), values(p.before.state)};
    for (int k = 0; k < 6 * 70; ++k) r.draws.push_back(static_cast<float>(random.normal()));
    const auto rows = p.sampler.sample({r})[0];
    const Tensor motion = torch::tensor(rows).view({7, 1, 71}).narrow(0, 1, 6);
    least = std::min(least, p.value({motion.narrow(2, 0, 69), torch::zeros({6, 1, 69}), motion.narrow(2, 69, 2)}));
  }
  const Motion found = p.swarm_of(7, 0);
  EXPECT_EQ(found.states.sizes(), at::IntArrayRef({6, 1, 69}));
  EXPECT_EQ(found.contacts.sizes(), at::IntArrayRef({6, 1, 2}));
  EXPECT_EQ(found.noise.abs().max().item<double>(), 0);
  EXPECT_NEAR(p.value(found), least, 1e-5 * std::abs(least));
}

TEST(Swarm, MoreRoundsDoNotRaiseTheObjective) {
  double before = std::numeric_limits<double>::infinity();
  const double first = problem().value(problem().swarm_of(7, 0));
  for (int rounds = 0; rounds < 12; ++rounds) {
    const double now = problem().value(problem().swarm_of(7, rounds));
    EXPECT_LE(now, before + 1e-4 * std::abs(before)) << rounds;
    before = now;
  }
  EXPECT_LT(before, first - 1);  // they do move
}

TEST(Swarm, DependsOnItsStreamAlone) {
  const Motion one = problem().swarm_of(7, 3);
  for (const int threads : {1, 2, 5}) EXPECT_TRUE(same(one, problem().swarm_of(7, 3, 5, threads))) << threads;
  EXPECT_FALSE(same(one, problem().swarm_of(7, 3, 6)));
}

TEST(Swarm, HalfOfItBeginsWithWhatIsGiven) {
  const Problem& p = problem();
  Tensor given = normal({4, 71}, 3).to(torch::kFloat);
  given.narrow(1, 69, 2).copy_((given.narrow(1, 69, 2) > 0).to(torch::kFloat));
  const auto begins = [&](const Motion& m) { return torch::equal(torch::cat({m.states, m.contacts}, 2).select(1, 0).narrow(0, 0, 4), given); };
  EXPECT_TRUE(begins(p.swarm_of(1, 3, 5, 1, given)));
  const Terms near = {term_of([given](const Seen& seen) { return (seen.rows.narrow(0, 0, 4) - given.unsqueeze(1)).abs().sum(2).sum(0); })};
  EXPECT_TRUE(begins(p.swarm_of(near, 6, 2, 5, 2, given)));
  EXPECT_FALSE(begins(p.swarm_of({away_from(given)}, 6, 2, 5, 2, given)));  // the others draw theirs
  // More than a window's.
  const Motion all = p.swarm_of(1, 0, 5, 1, torch::cat({given, given}));
  EXPECT_TRUE(torch::equal(all.states.select(1, 0), torch::cat({given, given}).narrow(0, 0, 6).narrow(1, 0, 69)));
}

TEST(Swarm, WhatHasNoValueIsPassedOver) {
  const Problem& p = problem();
  // Half of the particles, by a sign that the network does not decide.
  const auto some = [](double no_value) { return term_of([no_value](const Seen& seen) { return torch::where(seen.rows.select(0, 5).select(1, 30) > seen.rows.select(0, 5).select(1, 31), torch::full({seen.rows.size(1)}, no_value), seen.nats.sum(0)); }); };
  for (const double no_value : {kNan, std::numeric_limits<double>::infinity()}) {
    const Terms terms = {some(no_value)};
    const Motion found = p.swarm_of(terms, 9, 3);
    EXPECT_TRUE(std::isfinite(objective(p.model, p.before, found, terms).item<double>()));
    // Nothing that has a value: the frame before, held.
    const Terms none = {term_of([no_value](const Seen& seen) { return torch::full({seen.rows.size(1)}, no_value); })};
    const Motion still = p.swarm_of(none, 4, 2);
    ASSERT_EQ(still.states.sizes(), at::IntArrayRef({6, 1, 69}));
    EXPECT_EQ((still.states - p.before.frame.narrow(0, 0, 69)).abs().max().item<double>(), 0);
    EXPECT_TRUE(torch::equal(still.contacts[3][0], p.before.frame.narrow(0, 69, 2)));
  }
}

TEST(Minimise, NeverRaisesTheObjective) {
  const Problem& p = problem();
  for (const MotionModel* model : {&p.model, &p.refined}) {
    const Carried before = model->start(p.generator.starts[1]);
    for (const std::uint64_t stream : {1, 4, 7}) {
      const Motion start = random_motion(6, 1, stream, torch::kFloat);
      double last = std::numeric_limits<double>::infinity();
      for (const int rereads : {1, 2, 4}) {
        const Minimised found = minimise(*model, before, start, p.terms, {8, rereads, 0.05});
        EXPECT_NEAR(found.before, objective(*model, before, start, p.terms).item<double>(), 1e-6 * std::abs(found.before));
        EXPECT_NEAR(found.after, objective(*model, before, found.motion, p.terms).item<double>(), 1e-6 * std::abs(found.after));
        EXPECT_LT(found.after, found.before);
        EXPECT_LE(found.after, last);
        last = found.after;
        EXPECT_TRUE(((found.motion.contacts == 0) | (found.motion.contacts == 1)).all().item<bool>());
      }
    }
  }
}

TEST(Minimise, ContactsAreReadAgainWhereThatIsBetter) {
  const Problem& p = problem();
  Motion start = random_motion(6, 1, 1, torch::kFloat);
  start.contacts = torch::ones_like(start.contacts);
  const auto contacts = [&](double sign, int rereads) {
    const Terms terms = {prior(), term_of([sign](const Seen& seen) { return sign * seen.contacts.sum(2).sum(0); })};
    return minimise(p.model, p.before, start, terms, {5, rereads, 0.05}).motion.contacts.sum().item<double>();
  };
  ASSERT_LT(p.model.contacts_of(p.model(p.before, start)).sum().item<double>(), 12);
  EXPECT_EQ(contacts(1000, 1), 12);  // one run holds them
  EXPECT_LT(contacts(1000, 2), 12);
  EXPECT_EQ(contacts(-1000, 4), 12);  // they would raise it
}

// Heights, tilts and joint angles as wished, and nothing else: a quadratic in the states, whose end is the wish.
TEST(Minimise, ReachesTheEndThatIsKnown) {
  const Problem& p = problem();
  for (const torch::Dtype number : {torch::kFloat, torch::kDouble}) {
    const MotionModel model(p.generator, nullptr, -1, number);
    const Carried before = model.start(p.generator.starts[0]);
    const Motion wished = random_motion(6, 1, 30, number), start = random_motion(6, 1, 40, number);
    const Seen seen = model(before, wished);
    Measured m{torch::zeros({6, 3}), seen.heading.select(1, 0), seen.features.select(1, 0).narrow(1, 4, 65), torch::ones({6, 69})};
    m.root.select(1, 2).copy_(seen.features.select(1, 0).select(1, 3));
    m.trust.narrow(1, 0, 2).zero_();
    const Minimised found = minimise(model, before, start, {observation_term(m, 0.05, 0.05)}, {400, 3, 0.05});
    EXPECT_LT(found.after, 1e-3 * found.before);
    const Seen end = model(before, found.motion);
    EXPECT_LT((end.features - seen.features).narrow(2, 2, 67).abs().max().item<double>(), 1e-3);
    EXPECT_LT((found.motion.noise - start.noise).abs().max().item<double>(), 1e-6);  // has no say in it
    EXPECT_LT((found.motion.states - start.states).narrow(2, 0, 2).abs().max().item<double>(), 1e-6);
  }
}

// Noise alone has its least at 0.
TEST(Minimise, TakesTheNoiseAway) {
  const Problem& p = problem();
  const Minimised found = minimise(p.model, p.before, random_motion(6, 1, 40, torch::kFloat), {noise_prior(0.05)}, {20, 1, 0.05});
  EXPECT_GT(found.before, 100);
  EXPECT_NEAR(found.after, 0, 1e-6);
}

TEST(Minimise, WithoutAValueTheMotionStays) {
  const Problem& p = problem();
  const Motion start = random_motion(6, 1, 1, torch::kFloat);
  for (const double no_value : {kNan, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    const Minimised found = minimise(p.model, p.before, start, {prior(), term_of([no_value](const Seen& seen) { return no_value * (1 + seen.nats.square().sum(0)); })}, {5, 2, 0.05});
    EXPECT_TRUE(same(found.motion, start)) << no_value;
  }
  Motion broken = start;
  broken.states = start.states.clone();
  broken.states[2][0][10] = static_cast<float>(kNan);
  const Minimised found = minimise(p.model, p.before, broken, p.terms, {5, 2, 0.05});
  EXPECT_TRUE(std::isnan(found.before) && std::isnan(found.after));
  EXPECT_TRUE(torch::equal(found.motion.contacts, broken.contacts));
  // A value that breaks off where the search goes.
  const Terms cliff = {term_of([](const Seen& seen) { return torch::where(seen.nats.sum(0) > 0, seen.nats.sum(0), torch::full({1}, kNan)); })};
  const Minimised beside = minimise(p.model, p.before, start, cliff, {20, 2, 0.05});
  EXPECT_LE(beside.after, beside.before);
  EXPECT_TRUE(std::isfinite(beside.after));
  // Nowhere to go: a start that is the end.
  const Minimised still = minimise(p.model, p.before, start, {term_of([](const Seen& seen) { return 0 * seen.nats.sum(0); })}, {5, 2, 0.05});
  EXPECT_TRUE(same(still.motion, start));
}

}  // namespace
}  // namespace mocap::control
