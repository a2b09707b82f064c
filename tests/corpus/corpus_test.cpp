#include "libmocap/corpus/corpus.hpp"

#include <gtest/gtest.h>

#include <ctime>
#include <set>
#include <sstream>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/skeleton/forward_kinematics.hpp"
#include "motion.hpp"

namespace mocap::corpus {
namespace {

bool same_bits(const Clip& a, const Clip& b) {
  if (a.frames() != b.frames() || !a.skeleton->same_as(*b.skeleton, 0)) return false;
  for (std::size_t i = 0; i < a.rotations.size(); ++i)
    if (a.rotations[i].coeffs() != b.rotations[i].coeffs()) return false;
  return a.root_position == b.root_position && a.contacts == b.contacts && a.attributes == b.attributes;
}

TEST(Subject, DependsOnSeedGenderAndNumberAlone) {
  const Subject a = draw_subject(1, Gender::female, 3), b = draw_subject(1, Gender::female, 3);
  EXPECT_EQ(a.style, b.style);
  EXPECT_TRUE(a.body.skeleton->same_as(*b.body.skeleton, 0));
  EXPECT_EQ(a.name, "f003");
  EXPECT_NE(a.style, draw_subject(1, Gender::female, 4).style);
  EXPECT_NE(a.style, draw_subject(1, Gender::male, 3).style);
  EXPECT_NE(a.style, draw_subject(2, Gender::female, 3).style);
}

TEST(Subject, BodiesVaryAroundTheCanonicalOneAndStaySymmetric) {
  std::vector<double> stature, hips;
  for (int n = 1; n <= 200; ++n) {
    const Subject s = draw_subject(1, n % 2 ? Gender::female : Gender::male, n);
    const Skeleton& k = *s.body.skeleton;
    EXPECT_NO_THROW(k.validate());
    for (const int left :
         {kLeftHip, kLeftKnee, kLeftAnkle, kLeftFoot, kLeftCollar, kLeftShoulder, kLeftElbow, kLeftWrist}) {
      const Vector3 &l = k.rest_offsets[static_cast<std::size_t>(left)],
                    &r = k.rest_offsets[static_cast<std::size_t>(left) + 1];
      EXPECT_EQ(l, Vector3(r.x(), -r.y(), r.z()));
    }
    // All of a leg has one scale, so that a retarget by leg length keeps the feet on the ground.
    EXPECT_NEAR(s.body.thigh / s.body.shank,
                canonical_body()->rest_offsets[kLeftKnee].norm() / canonical_body()->rest_offsets[kLeftAnkle].norm(),
                1e-12);
    EXPECT_NEAR(s.body.ankle_height, kAnkleSoleHeight * s.body.leg_scale, 1e-12);
    stature.push_back(s.body.stature);
    hips.push_back(s.body.hip_half_width / s.body.leg_scale);
  }
  EXPECT_NEAR(mean(stature), 1.70, 0.03);
  EXPECT_GT(deviation(stature), 0.04);
  EXPECT_GT(deviation(hips) / mean(hips), 0.03);
}

TEST(Corpus, ListsEveryCombinationOnce) {
  CorpusPlan plan;
  plan.subjects = 3, plan.takes = 2, plan.transitions = 1;
  const auto ids = list_clips(plan);
  std::set<std::string> stems;
  for (const ClipId& id : ids) stems.insert(id.stem());
  EXPECT_EQ(ids.size(), 2u * 3 * (4 * 2 + 1));
  EXPECT_EQ(stems.size(), ids.size());
  EXPECT_TRUE(stems.contains("lifting_m003_2"));
  EXPECT_TRUE(stems.contains("transition_f001_1"));
  EXPECT_THROW(parse_action("running"), Error);
}

TEST(Corpus, EqualAddressesGiveEqualClipsWhateverElseIsMade) {
  CorpusPlan large, small;
  large.subjects = 30, large.takes = 3;
  small.subjects = 2, small.transitions = 0, small.actions = {Action::jumping};
  const ClipId id{Action::jumping, Gender::male, 2, 1};
  EXPECT_TRUE(same_bits(make_clip(large, id), make_clip(small, id)));
  ClipId other = id;
  other.take = 2;
  EXPECT_FALSE(same_bits(make_clip(large, id), make_clip(large, other)));
  CorpusPlan seeded = large;
  seeded.seed = 2;
  EXPECT_FALSE(same_bits(make_clip(large, id), make_clip(seeded, id)));
  // On threads, in any order.
  const auto ids = list_clips(small);
  std::vector<Clip> serial(ids.size()), threaded(ids.size());
  for (std::size_t i = ids.size(); i-- > 0;) serial[i] = make_clip(small, ids[i]);
  parallel_for(ids.size(), 4, [&](std::size_t i) { threaded[i] = make_clip(small, ids[i]); });
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_TRUE(same_bits(serial[i], threaded[i])) << ids[i].stem();
}

TEST(Corpus, YUpCentimetresIsTheSameMotionInOtherAxes) {
  const CorpusPlan plan;
  const Clip clip = make_clip(plan, {Action::walking, Gender::female, 1, 1}), file = to_y_up_centimetres(clip);
  Pose ours, theirs;
  for (const std::size_t t : {std::size_t{0}, clip.frames() / 2, clip.frames() - 1}) {
    world_pose(clip, t, ours);
    world_pose(file, t, theirs);
    for (std::size_t j = 0; j < kJoints; ++j) {
      const Vector3 &a = ours.positions[j], &b = theirs.positions[j];
      EXPECT_LT((Vector3(b.z(), b.x(), b.y()) / 100 - a).norm(), 1e-12) << "joint " << j;
    }
    EXPECT_GT(theirs.positions[kHead].y(), 120);
  }
}

TEST(Corpus, LabelsNameEveryClipAndSegment) {
  CorpusPlan plan;
  plan.subjects = 1, plan.seconds = 6, plan.actions = {Action::walking};
  std::vector<Clip> clips;
  for (const ClipId& id : list_clips(plan)) clips.push_back(make_clip(plan, id));
  const std::string table = labels_table(clips);
  std::istringstream lines(table);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "file\taction\tgender\tsubject\tstart\tend");
  std::getline(lines, line);
  EXPECT_EQ(line, "walking_f001_1.bvh\twalking\tfemale\tf001\t\t");
  int segments = 0;
  double end_before = 0;
  while (std::getline(lines, line)) {
    if (!line.starts_with("transition_f001")) continue;
    ++segments;
    std::istringstream cells(line);
    std::string file, action, gender, subject;
    double start = -1, end = -1;
    cells >> file >> action >> gender >> subject >> start >> end;
    EXPECT_EQ(action, segments == 2 ? "jogging" : "walking");
    EXPECT_EQ(start, end_before);
    EXPECT_GT(end, start);
    end_before = end;
  }
  EXPECT_EQ(segments, 3);
  EXPECT_NEAR(end_before, 6, 1e-9);
  clips.resize(1);
  EXPECT_EQ(labels_table(clips), "file\taction\tgender\tsubject\nwalking_f001_1.bvh\twalking\tfemale\tf001\n");
}

TEST(Corpus, IsMadeFiftyTimesFasterThanRealTime) {
  CorpusPlan plan;
  plan.subjects = 2;
  const std::clock_t start = std::clock();  // of the processor: other work on the machine does not count
  double seconds = 0;
  for (const ClipId& id : list_clips(plan)) seconds += make_clip(plan, id).seconds();
  const double spent = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_GT(seconds / spent, 50);
  RecordProperty("times_real_time", std::to_string(seconds / spent));
}

TEST(Corpus, ShortAndLongClipsWork) {
  for (const double seconds : {0.1, 1.0, 40.0}) {
    CorpusPlan plan;
    plan.subjects = 1, plan.seconds = seconds;
    for (const ClipId& id : list_clips(plan)) {
      const Clip clip = make_clip(plan, id);
      EXPECT_EQ(clip.frames(), static_cast<std::size_t>(std::lround(seconds * 120))) << id.stem();
      EXPECT_NO_THROW(clip.validate(id.stem()));
    }
  }
}

class Noise : public testing::Test {
 protected:
  CorpusPlan plan;
  ClipId id{Action::walking, Gender::male, 4, 1};
  Clip clean = make_clip(plan, id);
  std::vector<NoiseEvent> events;
  double error_deg(const Clip& noisy, std::size_t t, int j) const {
    return geodesic_distance(noisy.frame(t)[static_cast<std::size_t>(j)], clean.frame(t)[static_cast<std::size_t>(j)]) *
           180 / 3.14159265358979;
  }
};

TEST_F(Noise, IsRepeatableAndLeavesTheRestAlone) {
  std::vector<NoiseEvent> again;
  const Clip a = make_noisy(plan, id, clean, 1, events), b = make_noisy(plan, id, clean, 1, again);
  EXPECT_TRUE(same_bits(a, b));
  EXPECT_FALSE(same_bits(a, clean));
  EXPECT_EQ(a.contacts, clean.contacts);
  EXPECT_NO_THROW(a.validate("noisy"));
  EXPECT_EQ(manifest_rows(a, events), manifest_rows(b, again));
}

TEST_F(Noise, LevelZeroIsClean) {
  EXPECT_TRUE(same_bits(make_noisy(plan, id, clean, 0, events), clean));
  EXPECT_TRUE(events.empty());
}

TEST_F(Noise, JitterIsAsLargeAsStated) {
  const Clip noisy = make_noisy(plan, id, clean, 1, events);
  std::vector<double> errors;
  for (std::size_t t = 0; t < clean.frames(); ++t)
    for (int j = 0; j < kJoints; ++j) errors.push_back(error_deg(noisy, t, j));
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  const double median = errors[errors.size() / 2];
  EXPECT_GT(median, 0.3);
  EXPECT_LT(median, 0.9);
}

TEST_F(Noise, EveryEventOfTheManifestIsInTheClip) {
  const Clip noisy = make_noisy(plan, id, clean, 1, events);
  int spikes = 0, dropouts = 0;
  for (const NoiseEvent& e : events) {
    EXPECT_GT(e.count, 0u);
    EXPECT_LE(e.first + e.count, clean.frames());
    const int joint = clean.skeleton->find(e.joint);
    if (e.kind == "spike" && joint >= 0) {
      // Jitter, and rarely another spike, lies on top.
      EXPECT_GT(error_deg(noisy, e.first, joint), 0.5 * e.size) << e.joint;
      ++spikes;
    } else if (e.kind == "spike") {
      EXPECT_GT((noisy.root_position[e.first] - clean.root_position[e.first]).norm(), 0.5 * e.size);
      ++spikes;
    } else if (e.kind == "dropout") {
      ++dropouts;
      if (joint < 0 || e.count < 12) continue;
      std::vector<double> moved;
      for (std::size_t t = e.first + 1; t < e.first + e.count; ++t)
        moved.push_back(geodesic_distance(noisy.frame(t)[static_cast<std::size_t>(joint)],
                                          clean.frame(e.first)[static_cast<std::size_t>(joint)]));
      std::nth_element(moved.begin(), moved.begin() + static_cast<std::ptrdiff_t>(moved.size() / 2), moved.end());
      EXPECT_LT(moved[moved.size() / 2], 0.05) << e.joint << " is not held";
    }
  }
  EXPECT_GE(spikes, 4);
  EXPECT_GE(dropouts, 2);
  const std::string rows = manifest_rows(noisy, events);
  EXPECT_EQ(static_cast<std::size_t>(std::count(rows.begin(), rows.end(), '\n')), events.size());
}

}  // namespace
}  // namespace mocap::corpus
