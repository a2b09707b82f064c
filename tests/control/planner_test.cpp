#include "libmodels/control/planner.hpp"

#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

using mocap::testing::refusal;
using torch::Tensor;

PlanOptions small(std::int64_t window = 8, std::int64_t overlap = 4) {
  PlanOptions o;
  o.window = window;
  o.overlap = overlap;
  o.swarm = {3, 1, 1, 1};
  o.lbfgs = {3, 1, 0.05};
  return o;
}

struct Problem {
  lstm_gmm::Model generator = tiny_generator();
  refiner::Model refiner = tiny_refiner();
  lstm_gmm::Sampler sampler{*generator.network};
  MotionModel model{generator, nullptr}, refined{generator, &refiner};
  Terms terms = {prior(), noise_prior(0.05), curve_term(std::make_shared<GroundCurve>(std::vector<Vector2>{{0, 0}, {2, 0.5}}), 0, 3, 0.05)};
};
const Problem& problem() {
  static const Problem p;
  return p;
}
// Nothing to minimise.
const Terms kNothing = {term_of([](const Seen& seen) { return 0 * seen.nats.sum(0); })};

TEST(Planner, WindowsAreJoined) {
  const Problem& p = problem();
  for (const MotionModel* model : {&p.model, &p.refined})
    for (const auto& [window, overlap] : {std::pair<std::int64_t, std::int64_t>{8, 4}, {8, 0}, {8, 7}, {2, 0}, {2, 1}}) {
      const Carried start = placed(model->start(p.generator.starts[3]), 1, -2, 3);
      Planner planner(*model, p.sampler, start, small(window, overlap));
      Shown together(model->reference(), start), parts(model->reference(), start);
      std::vector<Vector2> points;
      std::vector<Clip> pieces = {parts.piece()};
      for (int i = 0; i < 4; ++i) {
        const Planned planned = planner.next(p.terms);
        ASSERT_EQ(planned.rows.sizes(), at::IntArrayRef({window - overlap, 71}));
        EXPECT_EQ(planned.window, window);
        EXPECT_LE(planned.after_lbfgs, planned.after_swarm);
        double sum = 0;
        for (const auto& [name, value] : planned.terms) sum += value;
        EXPECT_NEAR(sum, planned.after_lbfgs, 1e-4 * std::abs(sum) + 1e-4);
        ASSERT_EQ(planned.terms.size(), 3u);
        EXPECT_EQ(planned.terms[2].first, "curve");
        together.add(planned.rows);
        parts.add(planned.rows);
        pieces.push_back(parts.piece());
        for (std::int64_t t = 0; t < planned.point.size(0); ++t) points.emplace_back(planned.point[t][0].item<double>(), planned.point[t][1].item<double>());
        // What is carried is where the last of them is.
        EXPECT_TRUE(torch::equal(planner.now().shown, planned.rows[window - overlap - 1]));
        EXPECT_NEAR(planner.now().x, points.back().x(), 1e-6);
        EXPECT_NEAR(planner.now().y, points.back().y(), 1e-6);
      }
      const Clip clip = together.piece();
      ASSERT_EQ(clip.frames(), points.size() + 1);
      EXPECT_EQ(clip.root_position[0].head<2>(), Vector2(1, -2));
      EXPECT_NEAR(yaw_of(clip.frame(0)[0]), 3, 1e-6);
      std::size_t t = 0;
      for (const Clip& piece : pieces)
        for (std::size_t k = 0; k < piece.frames(); ++k, ++t) {
          EXPECT_EQ(piece.root_position[k], clip.root_position[t]);  // piece by piece it is the same clip
          EXPECT_EQ(piece.contacts[k], clip.contacts[t]);
          EXPECT_LT((clip.root_position[t].head<2>() - (t > 0 ? points[t - 1] : Vector2(1, -2))).norm(), 1e-4) << t;  // where planned, behind joins too
        }
      EXPECT_EQ(t, clip.frames());
    }
}

// The next window's first particle begins with what the one before planned further.
TEST(Planner, TheOverlapIsGivenToTheNextWindow) {
  const Problem& p = problem();
  const Carried start = p.model.start(p.generator.starts[3]);
  PlanOptions one = small(8, 3), whole = small(8, 0);
  one.swarm = whole.swarm = {1, 0, 1, 1};
  Planner planner(p.model, p.sampler, start, one), other(p.model, p.sampler, start, whole);
  const Tensor all = other.next(kNothing).rows;
  EXPECT_TRUE(torch::equal(planner.next(kNothing).rows, all.narrow(0, 0, 5)));
  const Tensor second = planner.next(kNothing).rows;
  EXPECT_TRUE(torch::equal(second.narrow(0, 0, 3), all.narrow(0, 5, 3)));
  EXPECT_FALSE(torch::equal(other.next(kNothing).rows.narrow(0, 0, 3), all.narrow(0, 5, 3)));
}

TEST(Planner, EqualSeedsPlanTheSame) {
  const Problem& p = problem();
  const auto planned = [&](std::uint64_t seed, int threads) {
    PlanOptions o = small();
    o.seed = seed;
    o.swarm.threads = threads;
    Planner planner(p.model, p.sampler, p.model.start(p.generator.starts[3]), o);
    const Tensor first = planner.next(p.terms).rows;
    return torch::cat({first, planner.next(p.terms).rows});
  };
  EXPECT_TRUE(torch::equal(planned(1, 1), planned(1, 3)));
  EXPECT_FALSE(torch::equal(planned(1, 1), planned(2, 1)));
}

TEST(Planner, SettingsThatCannotBeAreRefused) {
  const auto message = [](const std::function<void(PlanOptions&)>& change) {
    PlanOptions o;
    change(o);
    try {
      o.validate();
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::usage);
    }
    return refusal([&] { o.validate(); });
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_EQ(message([](auto& o) { o.window = 2, o.overlap = 1; }), "");
  EXPECT_EQ(message([](auto& o) { o.overlap = 0; }), "");
  EXPECT_NE(message([](auto& o) { o.window = 1, o.overlap = 0; }).find("a window of 1 frames"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.overlap = 34; }).find("an overlap of 34 frames of a window of 34"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.overlap = -1; }).find("an overlap of -1"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.swarm.particles = 0; }).find("0 particles"), std::string::npos);
  const Problem& p = problem();
  EXPECT_NE(refusal([&] { Planner(p.model, p.sampler, p.model.start(p.generator.starts[0]), small(4, 4)); }).find("overlap"), std::string::npos);
}

// The objective says the height of the first frame (column 3), which the walker keeps nine tenths of.
struct Heights {
  lstm_gmm::Model generator = walker(0.04, -6);
  Heights() { generator.starts.select(2, 3).copy_(torch::linspace(3, -2, generator.starts.size(0)).unsqueeze(1)); }
  lstm_gmm::Sampler sampler{*generator.network};
  MotionModel model{generator, nullptr};
  double chosen(const std::shared_ptr<const Term>& term, std::int64_t most = 100) const {
    const Carried start = best_start(model, sampler, generator.starts, 4, 5, 0.6, {term}, small(), most);
    EXPECT_EQ(start.x, 4);
    EXPECT_EQ(start.y, 5);
    EXPECT_EQ(start.heading, 0.6);
    return start.frame[3].item<double>();
  }
};

TEST(BestStart, IsThatOfTheLowestObjective) {
  const Heights h;
  EXPECT_NEAR(h.chosen(term_of([](const Seen& seen) { return seen.rows[0].select(1, 3); })), -2, 1e-6);
  EXPECT_NEAR(h.chosen(term_of([](const Seen& seen) { return -seen.rows[0].select(1, 3); })), 3, 1e-6);
  EXPECT_NEAR(h.chosen(term_of([](const Seen& seen) { return seen.rows[0].select(1, 3); }), 1), 3, 1e-6);  // one is tried: the first
  EXPECT_NEAR(h.chosen(term_of([](const Seen& seen) { return seen.rows[0].select(1, 3); }), 3), 3 - 5.0 * 8 / 11, 1e-6);  // 0, 4, 8 of 12
}

TEST(BestStart, OneWithoutAValueIsPassedOver) {
  const Heights h;
  for (const double no_value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto above = [no_value](double limit) {
      return term_of([=](const Seen& seen) {
        const Tensor height = seen.rows[0].select(1, 3);
        return torch::where(height > limit, torch::full_like(height, no_value), -height);
      });
    };
    EXPECT_NEAR(h.chosen(above(2.0)), 3 - 5.0 * 2 / 11, 1e-6);  // the first two have none
    EXPECT_NEAR(h.chosen(above(-9.0)), 3, 1e-6);                // none has: the first
  }
}

}  // namespace
}  // namespace mocap::control
