#include "libmocap/draw/film_strip.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "tests/base/temporary_folder.hpp"
#include "tests/draw/picture.hpp"

namespace mocap::draw {
namespace {

using testing::Picture;

constexpr Color kWhite{1, 1, 1};

// The canonical body slides along its facing with its left leg forward and its arms a little out.
Clip sliding(int frames = 31, double speed_mps = 1, double yaw = 0) {
  const Skeleton& s = *canonical_body();
  Clip c;
  c.name = "slide";
  c.skeleton = canonical_body();
  const auto joint = [&](const char* name) { return static_cast<std::size_t>(s.find(name)); };
  for (int t = 0; t < frames; ++t) {
    const double way = speed_mps * t / c.frame_rate_hz;
    c.root_position.emplace_back(way * std::cos(yaw), way * std::sin(yaw), canonical_pelvis_height());
    std::vector<Quaternion> pose(22, Quaternion::Identity());
    pose[0] = yaw_rotation(yaw);
    pose[joint("left_hip")] = exp_map({0, -0.5, 0});
    pose[joint("right_hip")] = exp_map({0, 0.4, 0});
    pose[joint("left_shoulder")] = exp_map({-1.2, 0, 0});
    pose[joint("right_shoulder")] = exp_map({1.2, 0, 0});
    c.rotations.insert(c.rotations.end(), pose.begin(), pose.end());
    c.contacts.push_back({static_cast<std::uint8_t>(t < frames / 2), static_cast<std::uint8_t>(t >= frames / 2)});
  }
  c.attributes = {{"action", "sliding"}, {"gender", ""}};
  return c;
}

std::vector<StripRow> one(Clip clip) {
  std::vector<StripRow> rows(1);
  rows[0].title = "title";
  rows[0].clip = std::move(clip);
  return rows;
}

Vector2 joint(const StripPlan::Row& row, std::size_t figure, const char* name) {
  return row.figures.at(figure).joints.at(static_cast<std::size_t>(row.source->clip.skeleton->find(name)));
}

TEST(Spread, ParsesItsNames) {
  EXPECT_EQ(parse_spread("auto"), Spread::automatic);
  EXPECT_EQ(parse_spread("time"), Spread::time);
  EXPECT_EQ(parse_spread("path"), Spread::path);
  EXPECT_THROW(parse_spread("x"), Error);
}

TEST(Describe, NamesAttributesAndLength) { EXPECT_EQ(describe(sliding()), "action sliding  \xc2\xb7  1.0 s"); }

TEST(StripPlan, FiguresAreEvenlySpacedInTime) {
  const auto rows = one(sliding());
  StripOptions o;
  o.figures = 4;
  const StripPlan plan = plan_strip(rows, o);
  ASSERT_EQ(plan.rows.size(), 1u);
  ASSERT_EQ(plan.rows[0].figures.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(plan.rows[0].figures[k].frame, 10 * k);
    EXPECT_DOUBLE_EQ(plan.rows[0].figures[k].time_s, static_cast<double>(k) / 3);
  }
}

TEST(StripPlan, AFigureStandsUprightOnTheGroundAtItsScale) {
  for (const double yaw : {0.0, 2.0}) {
    const auto rows = one(sliding(31, 1, yaw));
    const StripPlan plan = plan_strip(rows, {});
    const auto& row = plan.rows[0];
    for (std::size_t k = 0; k < row.figures.size(); ++k) {
      EXPECT_LT(joint(row, k, "head").y(), joint(row, k, "pelvis").y());
      EXPECT_LT(joint(row, k, "pelvis").y(), joint(row, k, "left_foot").y());
      EXPECT_LT(joint(row, k, "left_foot").y(), row.ground);
      EXPECT_GT(joint(row, k, "head").y(), row.top);
      EXPECT_NEAR(row.ground - joint(row, k, "pelvis").y(), canonical_pelvis_height() * plan.pixels_per_metre, 1e-9);
      EXPECT_GT(joint(row, k, "left_foot").x(), joint(row, k, "right_foot").x());  // the left leg is forward: to the right
    }
  }
}

TEST(StripPlan, EverythingIsOnThePage) {
  for (const View view : {View::side, View::front, View::top, View::oblique})
    for (const Spread spread : {Spread::time, Spread::path})
      for (const double speed : {0.0, 1.0, 30.0}) {
        const auto rows = one(sliding(31, speed));
        StripOptions o;
        o.view = view;
        o.spread = spread;
        o.trajectory = o.contacts = true;
        o.width = 900;
        const StripPlan plan = plan_strip(rows, o);
        for (const auto& f : plan.rows[0].figures)
          for (const auto* list : {&f.joints, &f.end_sites, &f.shadow})
            for (const Vector2& p : *list) {
              ASSERT_GT(p.x(), 0);
              ASSERT_LT(p.x(), 900);
              if (list == &f.shadow && view != View::top && view != View::oblique) continue;
              ASSERT_GT(p.y(), plan.rows[0].top);
              ASSERT_LT(p.y(), plan.height);
            }
      }
}

TEST(StripPlan, SpreadChoosesWhereFiguresStand) {
  const auto still = one(sliding(31, 0)), fast = one(sliding(31, 12));
  StripOptions o;
  EXPECT_FALSE(plan_strip(still, o).along_path);
  EXPECT_TRUE(plan_strip(fast, o).along_path);
  const StripPlan path = plan_strip(fast, o);
  for (std::size_t k = 1; k < 12; ++k) {
    const auto &a = path.rows[0].figures[k - 1], &b = path.rows[0].figures[k];
    EXPECT_NEAR(b.anchor - a.anchor, 12 * (b.time_s - a.time_s) * path.pixels_per_metre, 1e-9);
  }
  o.spread = Spread::time;
  const StripPlan time = plan_strip(fast, o);
  EXPECT_FALSE(time.along_path);
  for (std::size_t k = 2; k < 12; ++k)
    EXPECT_NEAR(time.rows[0].figures[k].anchor - time.rows[0].figures[k - 1].anchor, time.rows[0].figures[1].anchor - time.rows[0].figures[0].anchor, 1e-9);
  o.spread = Spread::path;
  EXPECT_TRUE(plan_strip(still, o).along_path);
}

TEST(StripPlan, FiguresInTimeDoNotTouch) {
  const auto rows = one(sliding());
  StripOptions o;
  o.spread = Spread::time;
  for (const double width : {400.0, 1600.0, 5000.0}) {
    o.width = width;
    const StripPlan plan = plan_strip(rows, o);
    for (const auto& f : plan.rows[0].figures)
      for (const auto* list : {&f.joints, &f.end_sites})
        for (const Vector2& p : *list) {
          EXPECT_GT(p.x(), f.slot[0]);
          EXPECT_LT(p.x(), f.slot[1]);
        }
  }
}

TEST(StripPlan, AllRowsShareOneScale) {
  auto rows = one(sliding());
  rows.push_back(rows[0]);
  for (auto& p : rows[1].clip.root_position) p.z() += 3;  // a very high jump
  const StripPlan plan = plan_strip(rows, {});
  EXPECT_LT(plan.pixels_per_metre, plan_strip(one(sliding()), {}).pixels_per_metre);
  EXPECT_GT(plan.rows[1].top, plan.rows[0].bottom);
  const auto leg = [&](std::size_t r) { return (joint(plan.rows[r], 0, "left_knee") - joint(plan.rows[r], 0, "left_hip")).norm(); };
  EXPECT_NEAR(leg(0), leg(1), 1e-9);
}

// Pixels in the middle of each bone: the limb's colour, the nearer right side in front.
TEST(FilmStrip, LimbsHaveTheColoursOfTheirSides) {
  const auto rows = one(sliding());
  StripOptions o;
  o.figures = 3;
  for (const View view : {View::side, View::front}) {
    o.view = view;
    const StripPlan plan = plan_strip(rows, o);
    const Picture picture(film_strip(rows, o, ImageFormat::png));
    ASSERT_TRUE(picture.valid());
    EXPECT_EQ(picture.width(), 1600);
    EXPECT_EQ(picture.height(), std::ceil(plan.height));
    const auto& row = plan.rows[0];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto middle = [&](const char* a, const char* b) { return Vector2((joint(row, k, a) + joint(row, k, b)) / 2); };
      EXPECT_TRUE(picture.is(middle("left_knee", "left_ankle"), kLeftColor));
      EXPECT_TRUE(picture.is(middle("right_knee", "right_ankle"), kRightColor));
      EXPECT_TRUE(picture.is(middle("right_elbow", "right_wrist"), kRightColor));
      EXPECT_TRUE(picture.is(middle("neck", "head"), kTrunkColor));
      EXPECT_TRUE(picture.is(joint(row, k, "head") - Vector2(0, 0.08 * plan.pixels_per_metre), kTrunkColor));
      EXPECT_TRUE(picture.is(joint(row, k, "left_ankle") + Vector2(0.2 * plan.pixels_per_metre, -20), kWhite));
    }
    if (view == View::front)
      EXPECT_GT(joint(row, 0, "left_wrist").x(), joint(row, 0, "right_wrist").x());
    else
      EXPECT_TRUE(picture.is((joint(row, 0, "right_shoulder") + joint(row, 0, "right_elbow")) / 2, kRightColor));  // hides the left arm
  }
}

TEST(FilmStrip, ContactsAreMarkedUnderTheFeetThatAreDown) {
  const auto rows = one(sliding());
  StripOptions o;
  o.figures = 3;
  const StripPlan plan = plan_strip(rows, o);
  const Picture picture(film_strip(rows, o, ImageFormat::png));
  const auto& row = plan.rows[0];
  const auto left_mark = [&](std::size_t k) { return Vector2(joint(row, k, "left_foot").x(), row.ground + 5); };
  const auto right_mark = [&](std::size_t k) { return Vector2(joint(row, k, "right_foot").x(), row.ground + 11); };
  EXPECT_TRUE(picture.is(left_mark(0), kLeftColor));
  EXPECT_FALSE(picture.is(right_mark(0), kRightColor));
  EXPECT_TRUE(picture.is(right_mark(2), kRightColor));
  EXPECT_FALSE(picture.is(left_mark(2), kLeftColor));
  auto bare = rows;
  bare[0].clip.contacts.clear();
  EXPECT_FALSE(plan_strip(bare, o).rows[0].has_contacts);
}

TEST(FilmStrip, ChartAndTrackAddToThePage) {
  const auto rows = one(sliding());
  StripOptions plain, chart, track;
  chart.contacts = true;
  track.trajectory = true;
  const auto count = [&](const StripOptions& o, const Color& c) { return Picture(film_strip(rows, o, ImageFormat::png)).count(c); };
  EXPECT_GT(count(chart, kLeftColor), count(plain, kLeftColor) + 1000);
  EXPECT_GT(plan_strip(rows, chart).height, plan_strip(rows, plain).height);
  EXPECT_LT(plan_strip(rows, track).rows[0].figures.back().slot[1], plan_strip(rows, plain).rows[0].figures.back().slot[1] - 100);
  auto asked = rows;
  asked[0].clip.path = {{0, 0}, {1, 1}, {2, 0}};
  EXPECT_NE(film_strip(asked, track, ImageFormat::png), film_strip(rows, track, ImageFormat::png));
}

TEST(FilmStrip, ObliqueAndTopViewsThrowShadows) {
  const auto rows = one(sliding());
  StripOptions o;
  o.view = View::oblique;
  const StripPlan plan = plan_strip(rows, o);
  for (const auto& f : plan.rows[0].figures)
    for (std::size_t j = 0; j < f.joints.size(); ++j) {
      EXPECT_NEAR(f.shadow[j].x(), f.joints[j].x(), 1e-9);
      EXPECT_GT(f.shadow[j].y(), f.joints[j].y());
    }
}

TEST(FilmStrip, OneFrameOneJointAndOneFigureWork) {
  EXPECT_EQ(plan_strip(one(sliding(1)), {}).rows[0].figures.size(), 1u);
  StripOptions o;
  o.contacts = o.trajectory = true;
  EXPECT_TRUE(Picture(film_strip(one(sliding(1)), o, ImageFormat::png)).valid());
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"point"};
  s->parents = {-1};
  s->rest_offsets = {{0, 0, 0}};
  Clip point;
  point.skeleton = s;
  point.root_position = {{0, 0, 0}, {0, 0, 0}};
  point.rotations.assign(2, Quaternion::Identity());
  for (const View view : {View::side, View::top}) {
    o.view = view;
    const auto rows = one(point);
    const Picture p(film_strip(rows, o, ImageFormat::png));
    ASSERT_TRUE(p.valid());
    EXPECT_TRUE(p.is(plan_strip(rows, o).rows[0].figures[0].joints[0], kTrunkColor));
  }
}

TEST(FilmStrip, RefusesClipsThatCannotBeDrawn) {
  const auto refused = [](const std::function<void(Clip&)>& damage) {
    Clip c = sliding();
    damage(c);
    try {
      film_strip(one(c), {}, ImageFormat::png);
      return false;
    } catch (const Error& e) {
      return e.status() == Exit::data;
    }
  };
  EXPECT_TRUE(refused([](Clip& c) { c = cut(c, 0, 0); }));
  EXPECT_TRUE(refused([](Clip& c) { c.root_position[3].x() = std::nan(""); }));
  EXPECT_TRUE(refused([](Clip& c) { c.rotations[40].z() = std::nan(""); }));
  EXPECT_TRUE(refused([](Clip& c) { c.skeleton = nullptr; }));
  EXPECT_TRUE(refused([](Clip& c) { c.root_position[0].x() = 1e300; }));
  EXPECT_TRUE(refused([](Clip& c) { c.root_position[0].z() = -1e5; }));
  EXPECT_TRUE(refused([](Clip& c) {
    auto s = std::make_shared<Skeleton>(*c.skeleton);
    s->rest_offsets[4].x() = 1e200;
    c.skeleton = s;
  }));
  EXPECT_FALSE(refused([](Clip&) {}));
}

TEST(FilmStrip, RefusesOptionsOutOfRange) {
  const auto rows = one(sliding());
  EXPECT_THROW(plan_strip({}, {}), Error);
  for (const auto& spoil : std::vector<std::function<void(StripOptions&)>>{[](auto& o) { o.figures = 0; }, [](auto& o) { o.figures = 1001; },
                                                                           [](auto& o) { o.width = 199; }, [](auto& o) { o.width = std::nan(""); },
                                                                           [](auto& o) { o.row_height = 0; }, [](auto& o) { o.row_height = 1e9; }}) {
    StripOptions o;
    spoil(o);
    EXPECT_THROW(plan_strip(rows, o), Error);
  }
  EXPECT_THROW(film_strip(std::vector<StripRow>(300, rows[0]), {}, ImageFormat::png), Error);  // higher than a page can be
}

TEST(FilmStrip, SameBytesTwice) {
  auto rows = one(sliding());
  rows.push_back(rows[0]);
  StripOptions o;
  o.trajectory = o.contacts = true;
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::svg}) EXPECT_EQ(film_strip(rows, o, format, "x"), film_strip(rows, o, format, "x"));
}

TEST(FilmStrip, SvgIsWellFormed) {
  auto rows = one(sliding());
  rows[0].title = "<walk> & \xff \"run\"";
  testing::TemporaryFolder folder;
  testing::put(folder / "f.svg", film_strip(rows, {}, ImageFormat::svg, "<history>"));
  EXPECT_EQ(std::system(("/usr/bin/python3 -c \"import sys, xml.dom.minidom as x; d = x.parse(sys.argv[1]); sys.exit(len(d.getElementsByTagName('path')) < 100)\" " +
                         (folder / "f.svg")).c_str()), 0);
}

}  // namespace
}  // namespace mocap::draw
