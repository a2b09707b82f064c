#include "libmocap/io/asf.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;

std::string asf_text(const std::string& name) { return data("asf/" + name + ".asf"); }
std::string amc_text(const std::string& name) { return data("asf/" + name + ".amc"); }
AmcFile read(const std::string& name, const std::string& skeleton, bool lenient = false) {
  return parse_amc(amc_text(name), parse_asf(asf_text(skeleton)), {lenient});
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  EXPECT_NE(text.find(what), std::string::npos) << what;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size()) text.replace(at, what.size(), by);
  return text;
}

double largest_difference(const Clip& a, const Clip& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.rotations.size(); ++i) worst = std::max(worst, (a.rotations[i].coeffs() - b.rotations[i].coeffs()).norm());
  for (std::size_t t = 0; t < a.frames(); ++t) worst = std::max(worst, (a.root_position[t] - b.root_position[t]).norm());
  return worst;
}

TEST(Asf, PlainSkeleton) {
  const Asf asf = parse_asf(asf_text("plain"));
  const Skeleton& s = *asf.skeleton;
  EXPECT_EQ(s.joint_names, (std::vector<std::string>{"root", "hip", "thigh", "shin"}));
  EXPECT_EQ(s.parents, (std::vector<int>{-1, 0, 1, 2}));
  // A joint sits at the base of its bone, the tip of its parent's.
  EXPECT_EQ(s.rest_offsets, (std::vector<Vector3>{Vector3(0, 0, 0), Vector3(0, 0, 0), Vector3(0, 2, 0), Vector3(3, 0, 0)}));
  ASSERT_EQ(s.end_sites.size(), 1u);
  EXPECT_EQ(s.end_sites[0].parent, 3);
  EXPECT_EQ(s.end_sites[0].offset, Vector3(0, 0, 4));
  EXPECT_NEAR(asf.metres_per_unit, 0.0564444444, 1e-10);
  EXPECT_FALSE(asf.radians);
  EXPECT_TRUE(asf.notes.empty() && asf.outside.empty());
}

TEST(Amc, PlainMotion) {
  const AmcFile f = read("plain", "plain");
  ASSERT_EQ(f.clip.frames(), 3u);
  EXPECT_EQ(f.clip.frame_rate_hz, 120);
  EXPECT_FALSE(f.rate_known);
  EXPECT_EQ(f.notes, (std::vector<std::string>{"no frame rate in the file: 120 Hz assumed"}));
  EXPECT_EQ(f.clip.root_position[1], Vector3(1.5, 2.5, 3.5));
  EXPECT_TRUE(f.clip.translations.empty() && f.clip.name.empty() && f.clip.source.path.empty());
  const double deg = std::numbers::pi / 180;
  EXPECT_LT(geodesic_distance(f.clip.rotations[0], from_euler(Vector3(30, 20, 10) * deg, EulerOrder::parse("ZYX"))), 4e-15);
  EXPECT_EQ(f.clip.rotations[1].coeffs(), Quaternion::Identity().coeffs());
  const Quaternion c = from_euler(Vector3(20 * deg, 0, 0), EulerOrder::parse("ZYX"));
  EXPECT_LT(geodesic_distance(f.clip.rotations[3], c * from_euler(Vector3(70 * deg, 0, 0), EulerOrder::parse("XYZ")) * c.conjugate()), 4e-15);
}

// World positions in metres and world rotations, computed by tests/data/asf/reference.py.
class AgreesWithNumPy : public testing::TestWithParam<const char*> {};
TEST_P(AgreesWithNumPy, WorldPositionsAndRotations) {
  const Asf asf = parse_asf(asf_text(GetParam()));
  const AmcFile f = parse_amc(amc_text(GetParam()), asf);
  std::istringstream rows(data(std::string("asf/") + GetParam() + ".tsv"));
  const Skeleton& s = *f.clip.skeleton;
  Pose pose;
  std::size_t checked = 0;
  for (std::size_t t = 0; t < f.clip.frames(); ++t) {
    world_pose(f.clip, t, pose);
    const auto expect_row = [&](const std::string& name, const Vector3& position, const Quaternion& rotation) {
      int frame = 0;
      std::string bone;
      Vector3 p;
      RotationMatrix r;
      ASSERT_TRUE(rows >> frame >> bone >> p[0] >> p[1] >> p[2]);
      for (int i = 0; i < 9; ++i) ASSERT_TRUE(rows >> r(i / 3, i % 3));
      EXPECT_EQ(bone, name);
      EXPECT_LT((position * asf.metres_per_unit - p).norm(), 1e-12) << name << " in frame " << t;
      EXPECT_LT((to_matrix(rotation) - r).norm(), 1e-13) << name << " in frame " << t;
      ++checked;
    };
    for (std::size_t j = 0; j < s.joint_names.size(); ++j) {
      expect_row(s.joint_names[j], pose.positions[j], pose.rotations[j]);
      for (const auto& e : s.end_sites)
        if (static_cast<std::size_t>(e.parent) == j) expect_row("tip", pose.positions[j] + pose.rotations[j] * e.offset, pose.rotations[j]);
    }
  }
  std::string rest;
  EXPECT_FALSE(rows >> rest);
  EXPECT_GE(checked, 8u);
}
INSTANTIATE_TEST_SUITE_P(Fixtures, AgreesWithNumPy, testing::Values("tiny", "radians", "moving"), [](const auto& info) { return std::string(info.param); });

TEST(Asf, NumPyFixturesAreUpToDate) {
  for (const std::string name : {"tiny", "radians", "moving"}) {
    test::TemporaryFolder folder;
    const std::string out = (folder.path / "out").string();
    if (test::python(std::string(TEST_DATA) + "/asf/reference.py " + name + " > " + out) < 0) GTEST_SKIP() << "no NumPy";
    std::istringstream now(read_file(out)), then(data("asf/" + name + ".tsv"));
    std::string a, b;
    while (now >> a) {
      ASSERT_TRUE(then >> b);
      if (a == b) continue;
      EXPECT_NEAR(std::stod(a), std::stod(b), 1e-12);
    }
    EXPECT_FALSE(then >> b);
  }
}

TEST(Amc, TranslationsOfBones) {
  const AmcFile f = read("moving", "moving");
  ASSERT_EQ(f.clip.translations.size(), 6u);
  // C t with C a quarter turn about Z: x becomes y; `slide` hangs at the root, where there is no parent's length.
  EXPECT_LT((f.clip.translations[1] - Vector3(0, 0.5, 0.25)).norm(), 1e-15);
  EXPECT_LT((f.clip.translations[4] - Vector3(0, -0.5, 0.125)).norm(), 1e-15);
  EXPECT_EQ(f.clip.translations[2], f.clip.skeleton->rest_offsets[2]);
  EXPECT_EQ(f.notes[1], "positions that do not vary became offsets: still");
  EXPECT_EQ(f.notes[2], "positions that vary are kept as translations: slide");
}

TEST(Asf, UnitsAndAnglesThatTheFilesLeaveOpen) {
  const std::string text = asf_text("plain"), motion = amc_text("plain");
  const Asf without = parse_asf(replaced(replaced(text, "  length 0.45\n", ""), "  angle deg\n", ""));
  EXPECT_EQ(without.metres_per_unit, 0);
  EXPECT_EQ(without.notes, (std::vector<std::string>{"no length in :units: the unit goes by the length of the legs"}));
  EXPECT_EQ(parse_asf(replaced(text, "length 0.45", "length 1")).metres_per_unit, 0.0254);
  EXPECT_NEAR(parse_asf(replaced(text, "length 0.45", "length 2.54")).metres_per_unit, 0.01, 1e-17);
  // Neither :DEGREES nor :RADIANS: as the skeleton has it.
  const std::string silent = replaced(motion, ":DEGREES\n", "");
  const AmcFile as_deg = parse_amc(silent, without);
  EXPECT_EQ(largest_difference(as_deg.clip, read("plain", "plain").clip), 0);
  EXPECT_EQ(as_deg.notes[0], "neither :DEGREES nor :RADIANS: degrees taken from the skeleton");
  const Asf rad = parse_asf(replaced(text, "angle deg", "angle rad"));
  EXPECT_TRUE(rad.radians);
  EXPECT_EQ(largest_difference(parse_amc(silent, rad).clip, parse_amc(replaced(motion, ":DEGREES", ":RADIANS"), rad).clip), 0);
  EXPECT_GT(largest_difference(parse_amc(silent, rad).clip, parse_amc(motion, rad).clip), 0.1);
  const AmcFile rate = parse_amc(":SAMPLES-PER-SECOND 60\n:ASF-FILE /etc/passwd\n:NEWS 1\n" + motion, without);
  EXPECT_EQ(rate.clip.frame_rate_hz, 60);
  EXPECT_TRUE(rate.rate_known);
  EXPECT_EQ(rate.notes, (std::vector<std::string>{"line 3: ':NEWS' is not known and skipped"}));
}

// Each says what plain.asf and plain.amc say.
TEST(Asf, DialectsReadTheSame) {
  const std::string skeleton = asf_text("plain"), motion = amc_text("plain");
  const Clip plain = parse_amc(motion, parse_asf(skeleton)).clip;
  const auto same = [&](const std::string& asf, const std::string& amc, const char* what) {
    const AmcFile other = parse_amc(amc, parse_asf(asf));
    EXPECT_TRUE(other.clip.skeleton->same_as(*plain.skeleton, 0)) << what;
    ASSERT_EQ(other.clip.frames(), plain.frames()) << what;
    EXPECT_EQ(largest_difference(other.clip, plain), 0) << what;
    EXPECT_EQ(other.notes.size(), 1u) << what;
  };
  same(replaced(skeleton, "\n", "\r\n"), replaced(motion, "\n", "\r\n"), "CR-LF");
  same(replaced(skeleton, "\n", "\r"), replaced(motion, "\n", "\r"), "CR");
  same(replaced(skeleton, "     ", "\t"), replaced(motion, " ", "\t"), "tabs");
  same(replaced(skeleton, "\n", "\n \n"), replaced(motion, "\n", "\n\n"), "blank lines");
  same(replaced(skeleton, "\n", "  \n"), replaced(motion, "\n", "  \n"), "trailing blanks");
  same("\xef\xbb\xbf" + skeleton, "\xef\xbb\xbf" + motion, "byte-order mark");
  same("# one\n" + replaced(skeleton, "XYZ\n", "XYZ # axes\n"), replaced(motion, "shin", "# two\nshin"), "comments");
  same(skeleton, replaced(motion, "shin 75", "shin 75 # behind"), "a comment behind values");
  same(skeleton.substr(0, skeleton.size() - 1), motion.substr(0, motion.size() - 1), "no newline at the end");
  same(replaced(replaced(skeleton, "begin", "Begin"), "dof rx", "DOF RX"), replaced(motion, ":DEGREES", ":degrees"), "case");
  same(replaced(skeleton, "     id 2\n", ""), replaced(motion, ":FULLY-SPECIFIED\n", ""), "without ids, not fully specified");
  same(replaced(skeleton, "XYZ\n  end", "XYZ\n    limits (0 0),\n (-inf inf)\n    bodymass 1 cofmass 2\n  end"), motion, "limits and masses");
  same(replaced(skeleton, "    limits (-10.0 170.0)\n", ""), motion, "no limits");
  same(replaced(skeleton, "     axis 0 0 0 XYZ\n", ""), motion, "no axis");
  same(replaced(skeleton, "axis 0 0 0 XYZ", "axis 0 0 0"), motion, "an axis without an order");
  same(replaced(skeleton, "  begin\n    root hip", "    root hip").substr(0, skeleton.size() - 14), motion, "a hierarchy without begin and end");
  const std::size_t bones = skeleton.find(":bonedata"), tree = skeleton.find(":hierarchy");
  same(skeleton.substr(tree) + skeleton.substr(bones, tree - bones) + skeleton.substr(0, bones), motion, "sections the other way round");
  same(skeleton.substr(bones, tree - bones) + skeleton.substr(tree) + skeleton.substr(0, bones), motion, "sections in another order");
  same(skeleton, replaced(motion, "thigh 45 55 65\nshin 75", "shin 75\nthigh 45 55 65"), "bones in another order");
  same(skeleton, replaced(motion, "shin", "hip\nshin"), "a bone without dof listed");
  same(skeleton, replaced(replaced(replaced(motion, "\n3\n", "\n103\n"), "\n2\n", "\n102\n"), "\n1\n", "\n101\n"), "a part of a take");
  const auto notes = [](const std::string& text) { return parse_asf(text).notes; };
  const auto one = [](const char* note) { return std::vector<std::string>{note}; };
  EXPECT_EQ(notes(skeleton + ":skin a.skn\nanything\n:muscles\nbegin\n"), one("line 47: section ':muscles' is not known and skipped"));
  EXPECT_EQ(notes(replaced(skeleton, "   order TX TY TZ RX RY RZ\n", "")), one("no order of the root's values: TX TY TZ RX RY RZ assumed"));
  EXPECT_EQ(notes(replaced(skeleton, "direction 0 1 0", "direction 0 2 0")), one("bone hip: a direction of length 2 where 1 is usual"));
}

TEST(Asf, Names) {
  const std::string latin = replaced(replaced(replaced(asf_text("plain"), "name hip", "name h\xfc" "fte"), "root hip", "root h\xfc" "fte"), "hip thigh", "h\xfc" "fte thigh");
  const Asf asf = parse_asf(latin);
  EXPECT_EQ(asf.skeleton->joint_names[1], "hüfte");
  EXPECT_EQ(asf.notes, (std::vector<std::string>{"line 12: bone name 'hüfte' is not UTF-8, read as Latin-1"}));
  EXPECT_EQ(parse_amc(replaced(amc_text("plain"), "shin", "h\xfc" "fte\nshin"), asf).clip.frames(), 3u);
}

TEST(Asf, BonesOutsideOfTheHierarchyAreLeftOut) {
  const Asf asf = parse_asf(replaced(asf_text("plain"), "    thigh shin\n", ""));
  EXPECT_EQ(asf.skeleton->joint_names, (std::vector<std::string>{"root", "hip", "thigh"}));
  EXPECT_EQ(asf.notes, (std::vector<std::string>{"bones outside of the hierarchy are left out: shin"}));
  const Clip clip = parse_amc(amc_text("plain"), asf).clip, whole = read("plain", "plain").clip;
  ASSERT_EQ(clip.frames(), 3u);
  for (std::size_t t = 0; t < 3; ++t)
    for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ(clip.rotations[3 * t + j].coeffs(), whole.rotations[4 * t + j].coeffs());
  // Their lines are still read.
  EXPECT_EQ(error_of([&] { parse_amc(amc_text("bad_many_values"), asf); }).message(), "bone shin has 2 values, expected 1 (rx)");
}

TEST(Amc, RotationsAreUnitExactAndContinuous) {
  const Asf asf = parse_asf(asf_text("plain"));
  std::string text = ":DEGREES\n";
  std::vector<Vector3> angles;
  for (const double v : {0.0, 1e-12, 1e-5, 45.0, 90.0, 179.999999, 180.0, 181.0, 359.9, 360.0, 539.0, 720.0, 721.0, 123456789.0, 1e15, 1e18})
    angles.emplace_back(v, 10 - v, -v / 3);
  for (std::size_t t = 0; t < angles.size(); ++t) {
    std::ostringstream row;
    row.precision(17);
    row << t << "\nroot 0 0 0 0 0 0\nshin 0\nthigh " << angles[t][0] << ' ' << angles[t][1] << ' ' << angles[t][2] << '\n';
    text += row.str();
  }
  const Clip clip = parse_amc(text, asf).clip;
  const Quaternion c = yaw_rotation(20 * std::numbers::pi / 180);
  for (std::size_t t = 0; t < angles.size(); ++t) {
    Vector3 reduced;
    for (int k = 0; k < 3; ++k) reduced[k] = std::remainder(angles[t][2 - k], 360.0) * std::numbers::pi / 180;
    const Quaternion& q = clip.rotations[4 * t + 2];
    EXPECT_LT(geodesic_distance(q, c * from_euler(reduced, EulerOrder::parse("ZYX")) * c.conjugate()), 4e-15) << angles[t].transpose();
    EXPECT_NEAR(q.norm(), 1, 2e-15);
    EXPECT_GE(q.dot(clip.rotations[4 * (t == 0 ? 0 : t - 1) + 2]), 0);
  }
}

struct Defect {
  const char* file;
  long line;
  const char* object;
  const char* message;
};
void PrintTo(const Defect& d, std::ostream* out) { *out << d.file; }

class AsfRefused : public testing::TestWithParam<Defect> {};
TEST_P(AsfRefused, WithLineObjectAndBothSides) {
  const Defect& d = GetParam();
  const Error e = error_of([&] { parse_asf(asf_text(d.file)); });
  EXPECT_EQ(e.status(), Exit::data);
  EXPECT_EQ(e.where().line, d.line);
  EXPECT_EQ(e.where().object, d.object);
  EXPECT_EQ(e.message(), d.message);
  EXPECT_TRUE(e.where().file.empty());
}
INSTANTIATE_TEST_SUITE_P(
    Defects, AsfRefused,
    testing::Values(
        Defect{"bad_empty", 1, "", "no :bonedata, expected a skeleton"},
        Defect{"bad_not_asf", 1, "", "'PK', expected a section such as :units, :root, :bonedata or :hierarchy"},
        Defect{"bad_text_before", 1, "", "'hello', expected a section such as :units, :root, :bonedata or :hierarchy"},
        Defect{"bad_no_bonedata", 11, "", "no :bonedata, expected a skeleton"},
        Defect{"bad_no_bones", 18, "", ":bonedata without a bone, expected at least one"},
        Defect{"bad_second_hierarchy", 45, "", "a second :hierarchy, expected one"},
        Defect{"bad_no_hierarchy", 39, "", "no :hierarchy, expected one"},
        Defect{"bad_empty_hierarchy", 42, "", "a :hierarchy without a bone below root, expected a skeleton"},
        Defect{"bad_cut_in_bone", 25, "bone thigh", "the file ends inside a bone, expected 'end'"},
        Defect{"bad_cut_in_hierarchy", 43, "", "the file ends inside :hierarchy, expected 'end'"},
        Defect{"bad_bone_not_closed", 18, "bone hip", "'begin' in a bone, expected id, name, direction, length, axis, dof, limits, bodymass, cofmass or 'end'"},
        Defect{"bad_section_in_bone", 17, "bone hip", "':hierarchy' inside a bone, expected 'end'"},
        Defect{"bad_bone_outside_block", 12, "", "'name' in :bonedata, expected 'begin'"},
        Defect{"bad_no_name", 17, "bone 1", "'end' before a name, expected one"},
        Defect{"bad_name_empty", 14, "bone 1", "name without a value, expected a word"},
        Defect{"bad_name_digits", 14, "bone 12", "a name of digits only, expected a word: an AMC could not tell it from the number of a frame"},
        Defect{"bad_name_twice", 29, "bone hip", "another bone of this name, expected unique names"},
        Defect{"bad_second_name", 17, "bone hip", "a second name, expected one"},
        Defect{"bad_no_direction", 17, "bone hip", "'end' before a direction, expected one"},
        Defect{"bad_direction_short", 15, "bone hip", "direction followed by 2 numbers, expected 3"},
        Defect{"bad_direction_nan", 15, "bone hip", "direction with 'nan', expected 3 finite numbers"},
        Defect{"bad_direction_twice", 17, "bone hip", "a second direction, expected one"},
        Defect{"bad_no_length", 17, "bone hip", "'end' before a length, expected one"},
        Defect{"bad_length_negative", 16, "bone hip", "length -2, expected a number of at least 0"},
        Defect{"bad_length_comma", 16, "bone hip", "length '2,5', expected a finite number"},
        Defect{"bad_length_infinite", 16, "bone hip", "length 'inf', expected a finite number"},
        Defect{"bad_length_absent", 16, "bone hip", "length without a value, expected a number"},
        Defect{"bad_length_twice", 17, "bone hip", "a second length, expected one"},
        Defect{"bad_axis_order", 17, "bone hip", "axis order 'XYX', expected X, Y and Z in some order"},
        Defect{"bad_axis_short", 17, "bone hip", "axis with 'XYZ', expected 3 finite numbers"},
        Defect{"bad_axis_twice", 18, "bone hip", "a second axis, expected one"},
        Defect{"bad_dof", 25, "bone thigh", "dof 'rw', expected tx, ty, tz, rx, ry or rz"},
        Defect{"bad_dof_length", 25, "bone thigh", "dof 'l', a bone that stretches, expected tx, ty, tz, rx, ry or rz"},
        Defect{"bad_dof_repeated", 25, "bone thigh", "dof 'rx' twice, expected each at most once"},
        Defect{"bad_dof_twice", 26, "bone thigh", "a second dof, expected one"},
        Defect{"bad_property", 13, "bone 1", "'colour' in a bone, expected id, name, direction, length, axis, dof, limits, bodymass, cofmass or 'end'"},
        Defect{"bad_unit_zero", 4, "", "length 0, expected a number above 0"},
        Defect{"bad_unit_text", 4, "", "length 'long', expected a finite number"},
        Defect{"bad_unit_twice", 5, "", "a second length, expected one"},
        Defect{"bad_angle", 5, "", "angle 'grad', expected deg or rad"},
        Defect{"bad_root_order", 7, "root", "order 'RW', expected tx, ty, tz, rx, ry or rz"},
        Defect{"bad_root_order_twice", 8, "root", "a second order, expected one"},
        Defect{"bad_root_axis", 8, "root", "axis order 'XY', expected X, Y and Z in some order"},
        Defect{"bad_root_position", 9, "root", "position followed by 2 numbers, expected 3"},
        Defect{"bad_root_orientation_twice", 11, "root", "a second orientation, expected one"},
        Defect{"bad_root_property", 9, "root", "'place' in :root, expected order, axis, position or orientation"},
        Defect{"bad_parent_unknown", 43, "", "parent 'knee' is no bone of :bonedata"},
        Defect{"bad_child_unknown", 43, "", "child 'foot' is no bone of :bonedata"},
        Defect{"bad_two_parents", 43, "", "bone shin below thigh and hip, expected one parent"},
        Defect{"bad_root_below", 43, "", "the root below thigh, expected it on top"},
        Defect{"bad_loop", 19, "bone thigh", "the hierarchy makes it its own ancestor, expected a tree"}),
    [](const auto& info) { return std::string(info.param.file); });

class AmcRefused : public testing::TestWithParam<Defect> {};
TEST_P(AmcRefused, WithLineObjectAndBothSides) {
  const Defect& d = GetParam();
  const Error e = error_of([&] { read(d.file, "plain"); });
  EXPECT_EQ(e.status(), Exit::data);
  EXPECT_EQ(e.where().line, d.line);
  EXPECT_EQ(e.where().object, d.object);
  EXPECT_EQ(e.message(), d.message);
  EXPECT_TRUE(e.where().file.empty());
}
INSTANTIATE_TEST_SUITE_P(
    Defects, AmcRefused,
    testing::Values(
        Defect{"bad_empty", 1, "", "no frames, expected at least one"},
        Defect{"bad_no_frames", 3, "", "no frames, expected at least one"},
        Defect{"bad_before_first", 4, "", "'root' before the first frame, expected its number"},
        Defect{"bad_unknown_bone", 11, "frame 2", "bone 'toes' is not in the skeleton, expected one of its 4 names"},
        Defect{"bad_few_values", 10, "frame 2", "bone thigh has 2 values, expected 3 (rx ry rz)"},
        Defect{"bad_many_values", 11, "frame 2", "bone shin has 2 values, expected 1 (rx)"},
        Defect{"bad_values_of_none", 12, "frame 2", "bone hip has 1 value, expected 0"},
        Defect{"bad_root_values", 9, "frame 2", "bone root has 3 values, expected 6 (tx ty tz rx ry rz)"},
        Defect{"bad_bone_missing", 8, "frame 2", "2 bones, expected 3: without thigh"},
        Defect{"bad_always_missing", 4, "frame 1", "2 bones, expected 3: without shin"},
        Defect{"bad_bone_twice", 12, "frame 2", "bone shin a second time, expected it once in a frame"},
        Defect{"bad_number_skipped", 8, "", "frame 4 follows frame 1, expected 2"},
        Defect{"bad_number_repeated", 8, "", "frame 1 follows frame 1, expected 2"},
        Defect{"bad_nan", 11, "frame 2", "bone shin has 'nan' as value 1, expected a finite number"},
        Defect{"bad_infinity", 11, "frame 2", "bone shin has '-inf' as value 1, expected a finite number"},
        Defect{"bad_overflow", 11, "frame 2", "bone shin has '1e400' as value 1, expected a finite number"},
        Defect{"bad_decimal_comma", 11, "frame 2", "bone shin has '7,5' as value 1, expected a finite number"},
        Defect{"bad_hexadecimal", 11, "frame 2", "bone shin has '0x10' as value 1, expected a finite number"},
        Defect{"bad_rate", 1, "", "':SAMPLES-PER-SECOND' '0', expected a finite number above 0"},
        Defect{"bad_truncated", 14, "frame 3", "bone thigh has 2 values, expected 3 (rx ry rz)"},
        Defect{"bad_cut_in_number", 14, "frame 3", "bone thigh has '-' as value 3, expected a finite number"},
        Defect{"bad_cut_after_number", 12, "frame 3", "0 bones, expected 3: without root, thigh, shin"}),
    [](const auto& info) { return std::string(info.param.file); });

TEST(Amc, LenientKeepsWholeFrames) {
  const Clip plain = read("plain", "plain").clip;
  const auto check = [&](const char* name, std::size_t frames, const std::string& note) {
    const AmcFile f = read(name, "plain", true);
    EXPECT_EQ(f.clip.frames(), frames) << name;
    EXPECT_EQ(f.clip.rotations.size(), 4 * frames) << name;
    EXPECT_EQ(f.repairs.back(), note);
    EXPECT_EQ(f.clip.root_position[0], plain.root_position[0]);
    for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(f.clip.rotations[j].coeffs(), plain.rotations[j].coeffs()) << name;
  };
  check("bad_truncated", 2, "line 14: frame 3: bone thigh has 2 values, expected 3 (rx ry rz); frames left out: 1, kept: 2");
  check("bad_cut_in_number", 2, "line 14: frame 3: bone thigh has '-' as value 3, expected a finite number; frames left out: 1, kept: 2");
  check("bad_cut_after_number", 2, "line 12: frame 3: 0 bones, expected 3: without root, thigh, shin; frames left out: 1, kept: 2");
  check("bad_few_values", 2, "line 10: frame 2: bone thigh has 2 values, expected 3 (rx ry rz); frames left out: 1, kept: 2");
  check("bad_bone_missing", 2, "line 8: frame 2: 2 bones, expected 3: without thigh; frames left out: 1, kept: 2");
  check("bad_bone_twice", 2, "line 12: frame 2: bone shin a second time, expected it once in a frame; frames left out: 1, kept: 2");
  check("bad_unknown_bone", 3, "line 11: bone 'toes' is not in the skeleton, expected one of its 4 names; lines left out: 1");
  check("bad_number_skipped", 3, "line 8: frame 4 follows frame 1, expected 2; jumps kept as they are: 2");
  const AmcFile without = read("bad_always_missing", "plain", true);
  EXPECT_EQ(without.clip.frames(), 3u);
  EXPECT_EQ(without.repairs.back(), "bones that the first frame lacks are held at 0: shin");
  for (std::size_t t = 0; t < 3; ++t) EXPECT_EQ(without.clip.rotations[4 * t + 3].coeffs(), Quaternion::Identity().coeffs());
  // Damaged numbers stay refused, and so does a file without one whole frame.
  for (const char* name : {"bad_nan", "bad_decimal_comma", "bad_empty", "bad_rate"})
    EXPECT_EQ(error_of([&] { read(name, "plain", true); }).status(), Exit::data) << name;
  const std::string text = amc_text("plain");
  const Asf asf = parse_asf(asf_text("plain"));
  EXPECT_EQ(error_of([&] { parse_amc(text.substr(0, text.find("shin")), asf, {true}); }).message(), "no whole frame: frame 1: 2 bones, expected 3: without shin");
  EXPECT_EQ(error_of([&] { parse_amc("1\nthigh 1 2 3\nshin 1\n2\n", asf, {true}); }).message(), "no whole frame: frame 1: 2 bones, expected 3: without root");
}

TEST(Amc, CutAnywhereIsRefused) {
  const Asf asf = parse_asf(asf_text("plain"));
  const std::string text = amc_text("plain");
  // A file cut between two frames looks whole, and so does one that lost digits of a last number: everywhere else the cut shows.
  const auto looks_whole = [](const std::string& start) {
    for (const char* last : {"shin 7", "shin 70", "shin 70\n", "shin 75", "shin 75\n", "shin 8", "shin 80"})
      if (start.ends_with(last)) return true;
    return false;
  };
  for (std::size_t n = 0; n < text.size(); ++n) {
    if (looks_whole(text.substr(0, n))) continue;
    EXPECT_EQ(error_of([&] { parse_amc(text.substr(0, n), asf); }).status(), Exit::data) << n;
  }
}

// Damaged at random: read as a whole clip, or refused with a line.
TEST(Amc, MutationsAreReadOrRefused) {
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const std::vector<std::string> words = {"begin", "end", ":hierarchy", "root", " ", "\n", "\r", "1e400", "nan", "-", "dof tx ty tz", "#",
                                          ":", "(", "0", "thigh", "l", "XYZ", "\xff", ":RADIANS", "2\n"};
  const auto damaged = [&](std::string s) {
    for (std::size_t k = 1 + below(4); k > 0; --k) {
      const std::size_t at = below(s.size() + 1);
      switch (below(5)) {
        case 0: s.erase(at, below(20)); break;
        case 1: s.insert(at, words[below(words.size())]); break;
        case 2: if (at < s.size()) s[at] = static_cast<char>(random()); break;
        case 3: s.resize(at); break;
        default: s.insert(at, s.substr(below(s.size() + 1), below(60)));
      }
    }
    return s;
  };
  std::vector<std::pair<std::string, std::string>> files;
  for (const char* name : {"plain", "tiny", "radians", "moving"}) files.emplace_back(asf_text(name), amc_text(name));
  std::size_t whole = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto& [asf, amc] = files[below(files.size())];
    try {
      const AmcFile f = parse_amc(below(3) ? damaged(amc) : amc, parse_asf(below(2) ? damaged(asf) : asf), {below(2) == 0});
      f.clip.skeleton->validate();
      f.clip.validate();
      ++whole;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data) << e.what();
      EXPECT_GE(e.where().line, 1) << e.what();
      ++refused;
    }
  }
  EXPECT_GT(whole, 2000u);
  EXPECT_GT(refused, 2000u);
}

TEST(Asf, DepthIsNotLimitedByTheStack) {
  constexpr int kDepth = 100000;
  std::string bones = ":bonedata\n", tree = ":hierarchy\nbegin\nroot b0\n";
  for (int i = 0; i < kDepth; ++i) {
    bones += "begin\nname b" + std::to_string(i) + "\ndirection 0 1 0\nlength 1\nend\n";
    if (i > 0) tree += "b" + std::to_string(i - 1) + " b" + std::to_string(i) + "\n";
  }
  const Asf asf = parse_asf(bones + tree + "end\n");
  EXPECT_EQ(asf.skeleton->joint_count(), kDepth + 1);
  EXPECT_EQ(parse_amc("1\nroot 0 0 0 0 0 0\n", asf).clip.frames(), 1u);
  // 100,000 rotations a frame for twenty bytes of text.
  std::string text;
  for (int i = 0; i < 20000; ++i) text += std::to_string(i) + "\nroot 0 0 0 0 0 0\n";
  EXPECT_NE(error_of([&] { parse_amc(text, asf); }).message().find("expected dof on most bones"), std::string::npos);
  // A ring of that size beside the tree.
  std::string ring = bones + ":hierarchy\nroot b0\n";
  for (int i = 1; i < kDepth; ++i) ring += "b" + std::to_string(i) + " b" + std::to_string(i + 1 < kDepth ? i + 1 : 1) + "\n";
  EXPECT_EQ(error_of([&] { parse_asf(ring); }).message(), "the hierarchy makes it its own ancestor, expected a tree");
}

}  // namespace
}  // namespace mocap::io
