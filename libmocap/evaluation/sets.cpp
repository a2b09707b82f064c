#include "libmocap/evaluation/sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/metrics/clip_figures.hpp"

namespace mocap::evaluation {
namespace {

Eigen::MatrixXd matrix(const io::Npz& npz, const std::string& name, const std::string& path) {
  const auto& array = npz.at(name);
  if (array.shape.size() != 2) refuse({path, 0, name}, fmt::format("an array of {} dimensions, expected [N,d]", array.shape.size()));
  Eigen::MatrixXd out(static_cast<Eigen::Index>(array.shape[0]), static_cast<Eigen::Index>(array.shape[1]));
  const auto fill = [&](const auto& values) {
    for (Eigen::Index i = 0; i < out.rows(); ++i)
      for (Eigen::Index j = 0; j < out.cols(); ++j) out(i, j) = static_cast<double>(values[static_cast<std::size_t>(i * out.cols() + j)]);
  };
  if (const auto* d = std::get_if<std::vector<double>>(&array.data)) fill(*d);
  else if (const auto* k = std::get_if<std::vector<std::int64_t>>(&array.data)) fill(*k);
  else refuse({path, 0, name}, "an array of texts, expected numbers");
  return out;
}

std::optional<double> finite_number(const std::string& cell) {
  double value = 0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data() + (cell.starts_with('+') && !cell.starts_with("+-") ? 1 : 0), last, value);
  return error == std::errc() && end == last && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

// A table as embed writes it: columns f0, f1, ... are the features, the others are passed over.
io::Npz read_table(const std::string& text) {
  std::vector<std::size_t> columns;
  std::vector<double> values;
  std::size_t rows = 0;
  long number = 0;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::vector<std::string> cells(1);
    for (const char c : text.substr(begin, end - begin))
      if (c == '\t') cells.emplace_back();
      else if (c != '\r') cells.back() += c;
    begin = end + 1;
    if (number == 0) {
      for (std::size_t i = 0; i < cells.size(); ++i)
        if (cells[i] == "f" + std::to_string(columns.size())) columns.push_back(i);
      if (columns.empty()) refuse({{}, 1, {}}, "neither an npz file nor a table with the columns f0, f1, ..., expected one of them");
      continue;
    }
    if (cells.size() == 1 && cells[0].empty()) continue;
    for (const std::size_t i : columns) {
      const auto value = i < cells.size() ? finite_number(cells[i]) : std::nullopt;
      if (!value) refuse({{}, number + 1, {}}, fmt::format("'{}' in column {}, expected a number", i < cells.size() ? cells[i] : "", i + 1));
      values.push_back(*value);
    }
    ++rows;
  }
  return {{"features", {{rows, columns.size()}, values}}};
}

Set read(const std::string& path, bool statistics) {
  Set set;
  set.path = path == "-" ? "<stdin>" : path;
  io::Npz npz;
  try {
    const std::string bytes = read_file(path);
    npz = bytes.starts_with("PK") ? io::parse_npz(bytes) : read_table(bytes);
  } catch (const Error& e) {
    throw e.in_file(set.path);
  }
  if (!npz.contains("features") && npz.contains("mu") && npz.contains("sigma")) {
    if (!statistics) refuse({set.path, 0, {}}, "statistics (mu, sigma), expected features", "statistics can stand for the real clips only");
    auto& mu = npz["mu"];
    mu.shape = {1, std::accumulate(mu.shape.begin(), mu.shape.end(), std::size_t{1}, std::multiplies<>())};
    set.given = metrics::Gaussian{matrix(npz, "mu", set.path).row(0).transpose(), matrix(npz, "sigma", set.path), 0};
    return set;
  }
  if (!npz.contains("features")) refuse({set.path, 0, {}}, "no array 'features', expected features [N,d]");
  View view;
  view.attribute = "class";
  view.features = matrix(npz, "features", set.path);
  const auto n = static_cast<std::size_t>(view.features.rows());
  if (npz.contains("classes")) {
    if (const auto* names = std::get_if<std::vector<std::string>>(&npz["classes"].data)) view.classes = *names;
    else refuse({set.path, 0, "classes"}, "an array of numbers, expected names");
  }
  if (npz.contains("posteriors")) {
    view.posteriors = matrix(npz, "posteriors", set.path);
    if (static_cast<std::size_t>(view.posteriors.rows()) != n) refuse({set.path, 0, "posteriors"}, fmt::format("{} rows, expected {} as in features", view.posteriors.rows(), n));
    for (auto c = view.classes.size(); c < static_cast<std::size_t>(view.posteriors.cols()); ++c) view.classes.push_back(std::to_string(c));
  }
  if (npz.contains("labels")) {
    const auto& data = npz["labels"].data;
    if (const auto* names = std::get_if<std::vector<std::string>>(&data)) {
      if (view.classes.empty()) view.classes = [&] { const std::set<std::string> unique(names->begin(), names->end()); return std::vector<std::string>(unique.begin(), unique.end()); }();
      for (const auto& name : *names) {
        const auto at = std::find(view.classes.begin(), view.classes.end(), name);
        if (at == view.classes.end() && !name.empty()) refuse({set.path, 0, "labels"}, "class '" + name + "', expected one of " + fmt::format("{}", fmt::join(view.classes, ", ")));
        view.labels.push_back(name.empty() ? -1 : static_cast<int>(at - view.classes.begin()));
      }
    } else if (const auto* numbers = std::get_if<std::vector<std::int64_t>>(&data)) {
      const std::int64_t most = numbers->empty() ? 0 : *std::max_element(numbers->begin(), numbers->end());
      if (!view.classes.empty() ? most >= static_cast<std::int64_t>(view.classes.size()) : most > 100000)
        refuse({set.path, 0, "labels"}, fmt::format("class {}, expected one of {} classes", most, view.classes.size()));
      for (auto c = static_cast<std::int64_t>(view.classes.size()); c <= most; ++c) view.classes.push_back(std::to_string(c));
      for (const auto v : *numbers) view.labels.push_back(v < 0 ? -1 : static_cast<int>(v));
    } else {
      refuse({set.path, 0, "labels"}, "fractions, expected whole numbers or names");
    }
    if (view.labels.size() != n) refuse({set.path, 0, "labels"}, fmt::format("{} labels, expected {} as features has rows", view.labels.size(), n));
  }
  set.views.push_back(std::move(view));
  return set;
}

}  // namespace

std::vector<Set*> Sets::all() {
  std::vector<Set*> out = {&generated, &real};
  if (train) out.push_back(&*train);
  if (mean_pose) out.push_back(&*mean_pose);
  return out;
}
std::vector<const Set*> Sets::all() const {
  std::vector<const Set*> out = {&generated, &real};
  if (train) out.push_back(&*train);
  if (mean_pose) out.push_back(&*mean_pose);
  return out;
}

Eigen::MatrixXd take(const Eigen::MatrixXd& x, const Rows& rows) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), x.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = x.row(static_cast<Eigen::Index>(rows[i]));
  return out;
}
Rows all_rows(std::size_t n) {
  Rows rows(n);
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  return rows;
}
Rows shuffled(std::size_t n, std::uint64_t seed, std::uint64_t stream) {
  Rows rows = all_rows(n);
  Random random(seed, stream);
  for (std::size_t i = n; i-- > 1;) std::swap(rows[i], rows[random.below(i + 1)]);
  return rows;
}

Set read_features(const std::string& path) { return read(path, false); }
Set read_features_or_statistics(const std::string& path) { return read(path, true); }

Set read_clips(const std::string& path, const std::string& label) {
  Set set;
  set.path = path == "-" ? "<stdin>" : path;
  const auto input = formats::open_motion(path, label);
  for (std::size_t i = 0; i < input->size(); ++i) set.clips.push_back(input->read(i));
  if (set.clips.empty()) refuse({set.path, 0, {}}, "0 clips, expected at least one");
  set.history = input->history();
  set.sha256 = input->sha256();
  return set;
}

void keep_statistics(const Set& set, const std::string& path) {
  const metrics::Gaussian g = metrics::gaussian(set.features, set.path);
  const auto d = static_cast<std::size_t>(g.mean.size());
  if (std::filesystem::exists(path)) {
    const Set there = read_features_or_statistics(path);
    const bool same = there.given && there.given->mean.size() == g.mean.size() && there.given->covariance.rows() == g.covariance.rows() &&
                      (there.given->mean - g.mean).norm() <= 1e-9 * (1 + g.mean.norm()) && (there.given->covariance - g.covariance).norm() <= 1e-9 * (1 + g.covariance.norm());
    if (!same) refuse({path, 0, {}}, "statistics of other clips, expected those of " + set.path, "remove the file to have it written again");
    return;
  }
  io::Npz npz;
  npz["mu"] = {{d}, std::vector<double>(g.mean.data(), g.mean.data() + d)};
  npz["sigma"] = {{d, d}, std::vector<double>(g.covariance.data(), g.covariance.data() + d * d)};
  write_file(path, io::format_npz(npz), Overwrite::refuse);
}

void check_alike(const Sets& sets) {
  const Clip& like = sets.real.clips.at(0);
  for (const Set* set : sets.all())
    for (const Clip& c : set->clips) {
      if (std::abs(c.frame_rate_hz - like.frame_rate_hz) > 1e-6 * like.frame_rate_hz)
        refuse({set->path, 0, "clip " + c.name}, fmt::format("{} Hz, expected {} Hz as in {}", c.frame_rate_hz, like.frame_rate_hz, sets.real.path), "canonicalize brings clips to one rate (--fps)");
      if (!c.skeleton->same_as(*like.skeleton, 1e-5)) refuse({set->path, 0, "clip " + c.name}, "another skeleton, expected that of " + sets.real.path, "canonicalize brings clips onto one body");
    }
  if (!sets.train) return;
  std::set<std::string> real_sources;
  for (const Clip& c : sets.real.clips)
    if (!c.source.sha256.empty()) real_sources.insert(c.source.sha256);
  for (const Clip& c : sets.train->clips)
    if (real_sources.contains(c.source.sha256))
      refuse({sets.train->path, 0, "clip " + c.name}, "made of " + c.source.path + ", of which there are clips in " + sets.real.path + " too, expected no source in both", "motion-split keeps sources apart");
}

void add_labels(Set& set, const std::string& attribute, const std::vector<std::string>& classes) {
  if (classes.size() < 2) refuse({set.path, 0, {}}, fmt::format("a classifier of {} class of {}, expected at least two", classes.size(), attribute));
  View view;
  view.attribute = attribute;
  view.classes = classes;
  for (const Clip& c : set.clips) {
    const auto label = c.attributes.find(attribute);
    if (label == c.attributes.end() || label->second.empty()) {
      view.labels.push_back(-1);
      continue;
    }
    const auto at = std::find(classes.begin(), classes.end(), label->second);
    if (at == classes.end())
      refuse({set.path, 0, "clip " + c.name}, fmt::format("{} '{}', expected one of the classifier's: {}", attribute, label->second, fmt::join(classes, ", ")));
    view.labels.push_back(static_cast<int>(at - classes.begin()));
  }
  set.views.push_back(std::move(view));
}

namespace {

std::map<std::string, Rows> rows_by_label(const Set& set) {
  std::map<std::string, Rows> out;
  const std::size_t n = !set.clips.empty() || set.views.empty() ? set.clips.size() : static_cast<std::size_t>(set.views[0].features.rows());
  for (std::size_t i = 0; i < n; ++i) out[label_of(set, i)].push_back(i);
  return out;
}

double share(const Rows& rows, std::size_t of) { return static_cast<double>(rows.size()) / static_cast<double>(of); }

std::size_t count(const std::map<std::string, Rows>& classes) {
  std::size_t n = 0;
  for (const auto& [label, rows] : classes) n += rows.size();
  return n;
}

}  // namespace

std::size_t match_classes(Set& set, const Set& like, std::uint64_t seed) {
  const auto mine = rows_by_label(set), theirs = rows_by_label(like);
  for (const auto& [one, classes, other, others] : {std::tuple{&std::as_const(set), &mine, &like, &theirs}, {&like, &theirs, &std::as_const(set), &mine}}) {
    if (classes->empty() || classes->contains("")) refuse({one->path, 0, {}}, "clips without a label, expected one for each clip to match the classes by");
    for (const auto& [label, rows] : *classes)
      if (!others->contains(label)) refuse({other->path, 0, {}}, "no clips of " + label + ", expected those classes that " + one->path + " has", "motion-select takes the classes that both have");
  }
  double scale = std::numeric_limits<double>::infinity();  // clips kept for each of the other set's
  for (const auto& [label, rows] : theirs) scale = std::min(scale, share(mine.at(label), rows.size()));
  Rows kept;
  std::uint64_t stream = 0;
  for (const auto& [label, rows] : mine) {
    const auto n = static_cast<std::size_t>(std::lround(scale * static_cast<double>(theirs.at(label).size())));
    const Rows order = shuffled(rows.size(), seed, 0xc1a5500 + stream++);
    for (std::size_t k = 0; k < std::min(n, rows.size()); ++k) kept.push_back(rows[order[k]]);
  }
  std::sort(kept.begin(), kept.end());
  const std::size_t before = count(mine);
  if (!set.clips.empty()) {
    std::vector<Clip> clips;
    for (const std::size_t i : kept) clips.push_back(std::move(set.clips[i]));
    set.clips = std::move(clips);
  }
  for (View& v : set.views) {
    if (v.features.size() > 0) v.features = take(v.features, kept);
    if (v.posteriors.size() > 0) v.posteriors = take(v.posteriors, kept);
    v.labels = take(v.labels, kept);
  }
  return before - kept.size();
}

std::string difference_of_mix(const Sets& sets) {
  auto mine = rows_by_label(sets.generated), theirs = rows_by_label(sets.real);
  if (mine.empty() || theirs.empty() || mine.contains("") || theirs.contains("")) return {};
  const std::size_t n = count(mine), m = count(theirs);
  std::string out;
  double most = 0.05;
  for (const auto* classes : {&mine, &theirs})
    for (const auto& [label, rows] : std::map<std::string, Rows>(*classes)) {
      const double a = share(mine[label], n), b = share(theirs[label], m);
      if (std::abs(a - b) <= most) continue;
      most = std::abs(a - b);
      out = fmt::format("{}: {:.0f} % of the generated clips, {:.0f} % of the real ones", label, 100 * a, 100 * b);
    }
  return out;
}

void cut_to_same_lengths(Sets& sets, std::size_t limit, std::optional<std::uint64_t> anywhere) {
  const auto lengths = [](const Set& set, const Rows& rows) {
    std::vector<std::size_t> out;
    for (const std::size_t i : rows) out.push_back(set.clips[i].frames());
    return out;
  };
  const auto shorten = [&](Set& set, const Rows& rows, const std::vector<std::size_t>& to) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      Clip& clip = set.clips[rows[k]];
      if (to[k] >= clip.frames()) continue;
      std::size_t first = 0;
      // A stream for each clip of a set: where one is cut does not depend on the others.
      if (anywhere && &set != &sets.generated) first = Random(*anywhere, 0xc0700000 + (&set == &sets.real ? 0 : 0x80000) + rows[k]).below(clip.frames() - to[k] + 1);
      clip = cut(clip, first, to[k]);
    }
  };
  const auto g = rows_by_label(sets.generated), r = rows_by_label(sets.real), t = sets.train ? rows_by_label(*sets.train) : std::map<std::string, Rows>{};
  for (const auto& [label, rows] : r) {
    const Rows other = g.contains(label) ? g.at(label) : Rows{};
    const auto [mine, theirs] = metrics::common_lengths(lengths(sets.generated, other), lengths(sets.real, rows), limit);
    shorten(sets.generated, other, mine);
    shorten(sets.real, rows, theirs);
    if (t.contains(label)) shorten(*sets.train, t.at(label), metrics::common_lengths(lengths(*sets.train, t.at(label)), lengths(sets.real, rows), limit).first);
  }
}

Set mean_poses(const Set& train) {
  Set out;
  out.path = train.path + " frozen in mean poses";
  out.clips = train.clips;
  for (const View& v : train.views) out.views.push_back({v.attribute, v.classes, {}, {}, v.labels});
  for (const auto& [label, rows] : rows_by_label(train)) {
    const auto joints = static_cast<std::size_t>(out.clips[rows[0]].joints());
    std::vector<Eigen::Vector4d> sums(joints, Eigen::Vector4d::Zero());
    double height = 0, frames = 0;
    for (const std::size_t i : rows) {
      const Clip& clip = train.clips[i];
      for (std::size_t t = 0; t < clip.frames(); ++t) {
        for (std::size_t j = 0; j < joints; ++j) {
          Quaternion q = clip.frame(t)[j];
          if (j == 0) q = yaw_rotation(yaw_of(q)).conjugate() * q;
          sums[j] += q.coeffs().dot(sums[j]) < 0 ? -q.coeffs() : q.coeffs();  // of q and -q, one rotation, the one on the sum's side
        }
        height += clip.root_position[t].z();
      }
      frames += static_cast<double>(clip.frames());
    }
    for (const std::size_t i : rows) {
      Clip& clip = out.clips[i];
      for (std::size_t t = 0; t < clip.frames(); ++t) {
        for (std::size_t j = 0; j < joints; ++j) clip.frame(t)[j] = Quaternion(sums[j].normalized());
        clip.root_position[t] = {0, 0, height / frames};
      }
      clip.translations.clear();
      clip.contacts.clear();
    }
  }
  return out;
}

void join_views(Set& set) {
  if (set.views.empty()) return;
  Eigen::Index columns = 0;
  for (const View& v : set.views) columns += v.features.cols();
  set.features.resize(set.views[0].features.rows(), columns);
  Eigen::Index at = 0;
  for (const View& v : set.views) {
    set.features.middleCols(at, v.features.cols()) = v.features;
    at += v.features.cols();
  }
  for (Eigen::Index j = 0; j < columns; ++j)
    for (Eigen::Index i = 0; i < set.features.rows(); ++i)
      if (!std::isfinite(set.features(i, j))) refuse({set.path, 0, "features"}, fmt::format("row {}, column {} is not finite, expected finite numbers", i + 1, j + 1));
}

double reduce(Sets& sets, int axes) {
  const auto pca = metrics::fit_pca(sets.train.value().features, axes);
  if (sets.real.given) refuse({sets.real.path, 0, {}}, "statistics (mu, sigma) with --pca, expected features");
  for (Set* set : sets.all()) set->features = metrics::project(pca, set->features);
  return pca.kept;
}

std::string label_of(const Set& set, std::size_t i) {
  std::string out;
  for (const View& v : set.views) {
    const int label = v.labels.empty() ? -1 : v.labels[i];
    if (label < 0) return {};
    out += (out.empty() ? "" : " ") + v.classes[static_cast<std::size_t>(label)];
  }
  return out;
}

Groups group_by_labels(const Sets& sets) {
  Groups out;
  const auto groups = [](const Set& set) {
    std::vector<std::string> names(set.size());
    if (!set.views.empty())
      for (std::size_t i = 0; i < set.size(); ++i) names[i] = label_of(set, i);
    return names;
  };
  const auto mine = groups(sets.generated), theirs = groups(sets.real);
  std::set<std::string> names(mine.begin(), mine.end());
  names.insert(theirs.begin(), theirs.end());
  names.erase("");
  out.classes.assign(names.begin(), names.end());
  const auto places = [&](const std::vector<std::string>& of) {
    std::vector<int> labels;
    for (const auto& g : of) labels.push_back(g.empty() ? -1 : static_cast<int>(std::lower_bound(out.classes.begin(), out.classes.end(), g) - out.classes.begin()));
    return labels;
  };
  out.generated = places(mine);
  out.real = places(theirs);
  const auto labelled = [](const std::vector<int>& labels) { return std::any_of(labels.begin(), labels.end(), [](int l) { return l >= 0; }); };
  out.by_class = !out.classes.empty() && labelled(out.generated);
  out.real_by_class = out.by_class && labelled(out.real);
  if (out.real_by_class)
    for (const auto& [set, labels] : {std::pair{&sets.generated, &out.generated}, {&sets.real, &out.real}})
      for (std::size_t c = 0; c < out.classes.size(); ++c)
        if (const auto n = std::count(labels->begin(), labels->end(), static_cast<int>(c)); n < 2)
          refuse({set->path, 0, {}}, fmt::format("class {} has {} clips, expected at least two in the generated and the real ones", out.classes[c], n), "motion-select takes the classes that both have");
  return out;
}

}  // namespace mocap::evaluation
