#include "libmodels/train/dataset.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/base/sha256.hpp"

namespace mocap::train {

namespace {

using Probabilities = std::map<std::string, std::map<std::string, float>>;  // of a clip: attribute -> class -> probability

// Where an attribute's value holds from; "" for no label.
using ValueSpans = std::vector<std::pair<std::int64_t, std::string>>;

ValueSpans values_over_time(const store::ClipInfo& info, const std::string& attribute) {
  const auto value = [&](const Attributes& a) {
    const auto at = a.find(attribute);
    return at == a.end() ? std::string() : at->second;
  };
  const std::string own = value(info.attributes);
  const bool overridden = std::any_of(info.segments.begin(), info.segments.end(), [&](const Segment& s) { return !value(s.attributes).empty() && s.length > 0; });
  if (!overridden || info.length == 0) return {{0, own}};
  std::vector<std::string> frames(static_cast<std::size_t>(info.length), own);
  for (const Segment& s : info.segments)
    if (const std::string v = value(s.attributes); !v.empty())
      std::fill_n(frames.begin() + static_cast<std::ptrdiff_t>(s.start), s.length, v);
  ValueSpans spans;
  for (std::size_t t = 0; t < frames.size(); ++t)
    if (t == 0 || frames[t] != frames[t - 1]) spans.emplace_back(static_cast<std::int64_t>(t), frames[t]);
  return spans;
}

bool labelled_throughout(const ValueSpans& spans) {
  return std::none_of(spans.begin(), spans.end(), [](const auto& s) { return s.second.empty(); });
}

// The most probable class, the first of equals; "" where there are no probabilities.
std::string most_probable(const Probabilities& probabilities, const std::string& attribute) {
  const auto of = probabilities.find(attribute);
  std::string best;
  float most = 0;
  if (of != probabilities.end())
    for (const auto& [value, p] : of->second)
      if (p > most) most = p, best = value;
  return best;
}

Classes fill_in(const Classes& classes, const Classes& fill) {
  Classes out = classes;
  for (std::size_t a = 0; a < out.size(); ++a)
    if (out[a] == kFilled) out[a] = fill[a];
  return out;
}

}  // namespace

MotionDataset::MotionDataset(const std::string& path, features::RotationRepresentation representation, std::vector<std::string> attributes, const MotionDataset* like, Unlabelled unlabelled) {
  const store::ArchiveReader reader(path);
  header_ = reader.header();
  layout_ = {header_.skeleton->joint_count() - 1, representation};
  file_sha256_ = reader.file_sha256();
  const std::string& name = reader.name();
  if (reader.size() == 0) refuse({name, 0, {}}, "0 clips, expected at least one");
  if (layout_.joints < 1) refuse({name, 0, "skeleton"}, "1 joint, expected a root and at least one more");

  // What classifiers found, of clips that lack a label; nothing is read where no classifier was there.
  std::vector<Probabilities> probabilities(reader.size());
  const auto found = [&](std::size_t i) -> const Probabilities& {
    if (probabilities[i].empty() && !header_.attribute_classes.empty()) probabilities[i] = reader.read(i).attribute_probability;
    return probabilities[i];
  };
  const auto fillable = [&](std::size_t i, const std::string& key) { return header_.attribute_classes.contains(key) && !most_probable(found(i), key).empty(); };

  if (like) {
    if (!header_.skeleton->same_as(*like->header_.skeleton, 1e-5)) refuse({name, 0, "skeleton"}, "another skeleton than the training data's");
    if (header_.frame_rate_hz != like->header_.frame_rate_hz)
      refuse({name, 0, {}}, std::to_string(header_.frame_rate_hz) + " Hz, expected " + std::to_string(like->header_.frame_rate_hz) + " Hz as in the training data");
    vocabulary_ = like->vocabulary_;
  } else {
    std::map<std::string, std::set<std::string>> values;  // attribute -> values of clips or of parts of them
    std::map<std::string, std::size_t> known;             // attribute -> clips that have one, or probabilities that stand for it
    for (std::size_t i = 0; i < reader.size(); ++i) {
      std::set<std::string> of_clip;
      const auto add = [&](const Attributes& a) {
        for (const auto& [key, value] : a)
          if (!value.empty()) values[key].insert(value), of_clip.insert(key);
      };
      add(reader.info(i).attributes);
      for (const Segment& s : reader.info(i).segments) add(s.attributes);
      if (unlabelled == Unlabelled::fill)
        for (const auto& [key, classes] : header_.attribute_classes)
          if (!of_clip.contains(key) && fillable(i, key)) values[key].insert(most_probable(found(i), key)), of_clip.insert(key);
      for (const auto& key : of_clip) ++known[key];
    }
    if (attributes.empty())
      for (const auto& [key, seen] : values)
        // A subject's or file's name is no class to generate from: with hundreds of values it is an identifier.
        if (2 * known.at(key) >= reader.size() && seen.size() <= 32 && key != "subject") attributes.push_back(key);
    for (const auto& key : attributes) {
      if (!values.contains(key)) refuse({name, 0, {}}, "no clip has an attribute '" + key + "', expected labels to condition on");
      vocabulary_[key];
    }
  }
  std::vector<std::size_t> used;                 // clips that have every attribute of the vocabulary, or can be filled
  std::vector<std::vector<ValueSpans>> over_time;  // of these, per attribute
  for (std::size_t i = 0; i < reader.size(); ++i) {
    std::vector<ValueSpans> spans;
    bool labelled = true, can_fill = true;
    for (const auto& [key, values] : vocabulary_) {
      spans.push_back(values_over_time(reader.info(i), key));
      if (labelled_throughout(spans.back())) continue;
      labelled = false;
      can_fill = can_fill && fillable(i, key);
    }
    if (!labelled && !(can_fill && unlabelled == Unlabelled::fill)) {
      fillable_ += can_fill;
      continue;
    }
    filled_ += !labelled;
    used.push_back(i);
    over_time.push_back(std::move(spans));
  }
  left_out_ = reader.size() - used.size();
  if (used.empty()) refuse({name, 0, {}}, "no clip has all the attributes asked for, expected at least one");
  if (!like) {
    std::size_t a = 0;
    for (auto& [key, values] : vocabulary_) {
      std::set<std::string> seen;
      for (std::size_t k = 0; k < used.size(); ++k)
        for (const auto& [first, value] : over_time[k][a]) seen.insert(value.empty() ? most_probable(found(used[k]), key) : value);
      values.assign(seen.begin(), seen.end());
      ++a;
    }
  }

  features::FeatureStatistics statistics(layout_);
  std::vector<features::FeatureMatrix> raw;
  std::set<std::string> sources;
  std::vector<std::vector<std::vector<double>>> fills;  // clip, attribute, class: probabilities where frames have no label, else empty
  for (std::size_t k = 0; k < used.size(); ++k) {
    const auto& info = reader.info(used[k]);
    LabelledFeatures clip;
    clip.name = info.name;
    std::set<std::int64_t> changes = {0};  // also where there is no attribute
    for (const auto& spans : over_time[k])
      for (const auto& [first, value] : spans) changes.insert(first);
    bool gaps = false;
    for (const std::int64_t first : changes) clip.spans.push_back({first, {}});
    fills.emplace_back();
    Classes best;
    std::size_t a = 0;
    for (const auto& [key, values] : vocabulary_) {
      const ValueSpans& spans = over_time[k][a++];
      std::vector<double> p;
      if (!labelled_throughout(spans)) {
        gaps = true;
        double sum = 0;
        for (const auto& value : values) {
          const auto& of = found(used[k]).at(key);
          const auto at = of.find(value);
          p.push_back(at == of.end() ? 0 : static_cast<double>(at->second));
          sum += p.back();
        }
        if (!(sum > 0)) refuse({name, 0, "clip " + info.name}, "its probabilities of " + key + " are all of classes that the training data does not know");
        for (double& v : p) v /= sum;
      }
      best.push_back(p.empty() ? kFilled : std::max_element(p.begin(), p.end()) - p.begin());
      fills.back().push_back(std::move(p));
      std::size_t at_span = 0;
      for (ClassSpan& span : clip.spans) {
        while (at_span + 1 < spans.size() && spans[at_span + 1].first <= span.first) ++at_span;
        const std::string& value = spans[at_span].second;
        const auto at = std::find(values.begin(), values.end(), value);
        if (at == values.end() && !value.empty()) refuse({name, 0, "clip " + info.name}, "attribute " + key + " is '" + value + "', which the training data does not know");
        span.classes.push_back(value.empty() ? kFilled : at - values.begin());
      }
    }
    clip.classes = fill_in(clip.spans[0].classes, best);
    if (clip.spans.size() == 1 && !gaps) clip.spans.clear();
    if (!info.source.sha256.empty()) sources.insert(info.source.sha256);
    raw.push_back(features::encode_motion_cell(reader.read(used[k]), representation));
    statistics.add(raw.back());
    clips_.push_back(std::move(clip));
  }
  group(fills);
  // The archive's own digest knows neither labels nor the order of the clips; both decide the batches.
  Sha256 digest;
  digest.update(reader.digest());
  for (const auto& [key, values] : vocabulary_) {
    digest.update("\n" + key);
    for (const auto& value : values) digest.update("\t" + value);
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    digest.update("\n" + reader.info(used[i]).digest);
    for (const auto c : clips_[i].classes) digest.update(std::to_string(c) + "\t");
    for (const ClassSpan& span : clips_[i].spans) {
      digest.update("\nfrom " + std::to_string(span.first) + ":");
      for (const auto c : span.classes) digest.update(std::to_string(c) + "\t");
    }
    for (const auto& p : fills[i])
      for (const double v : p) digest.update(fmt::format(" {:.9g}", v));
  }
  digest_ = to_hex(digest.finish());
  sources_.assign(sources.begin(), sources.end());
  mean_ = like ? like->mean_ : statistics.mean();
  deviation_ = like ? like->deviation_ : statistics.deviation();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    torch::Tensor x = torch::empty({raw[i].rows(), raw[i].cols()}, torch::kFloat32);
    float* out = x.data_ptr<float>();
    for (Eigen::Index t = 0; t < raw[i].rows(); ++t)
      for (Eigen::Index c = 0; c < raw[i].cols(); ++c)
        *out++ = static_cast<float>((raw[i](t, c) - mean_[static_cast<std::size_t>(c)]) / deviation_[static_cast<std::size_t>(c)]);
    clips_[i].features = x;
  }
}

// Puts the clips into the groups of the combinations that they have in some frame.
void MotionDataset::group(const std::vector<std::vector<std::vector<double>>>& probabilities) {
  const auto add = [&](std::size_t i, const Member& member) {
    const LabelledFeatures& clip = clips_[i];
    std::set<Classes> of_clip;
    if (clip.spans.empty()) of_clip.insert(clip.classes);
    for (const ClassSpan& span : clip.spans) of_clip.insert(fill_in(span.classes, member.fill));
    for (const auto& classes : of_clip) {
      members_[classes].push_back(member);
      auto& clips = combinations_[classes];
      if (clips.empty() || clips.back() != i) clips.push_back(i);
    }
  };
  // Labelled clips, and the most probable filling of the others, say which combinations occur: what is only barely probable would else be a
  // combination of its own and drawn as often as any other.
  std::set<Classes> occurring;
  const auto best_of = [&](std::size_t i) {
    Classes fill;
    for (const auto& p : probabilities[i]) fill.push_back(p.empty() ? kFilled : std::max_element(p.begin(), p.end()) - p.begin());
    return fill;
  };
  for (std::size_t i = 0; i < clips_.size(); ++i) {
    const Classes best = best_of(i);
    if (clips_[i].spans.empty()) occurring.insert(clips_[i].classes);
    for (const ClassSpan& span : clips_[i].spans) occurring.insert(fill_in(span.classes, best));
  }
  for (std::size_t i = 0; i < clips_.size(); ++i) {
    if (std::all_of(probabilities[i].begin(), probabilities[i].end(), [](const auto& p) { return p.empty(); })) {
      add(i, {i, 1, {}});
      continue;
    }
    std::vector<Member> ways = {{i, 1, {}}};
    for (const auto& p : probabilities[i]) {
      std::vector<Member> longer;
      for (const Member& way : ways)
        for (std::size_t c = 0; c < std::max<std::size_t>(1, p.size()); ++c) {
          if (!p.empty() && p[c] <= 0) continue;
          Member next = way;
          next.weight *= p.empty() ? 1 : p[c];
          next.fill.push_back(p.empty() ? kFilled : static_cast<std::int64_t>(c));
          longer.push_back(std::move(next));
        }
      ways = std::move(longer);
    }
    double sum = 0;
    std::erase_if(ways, [&](const Member& way) {
      return !std::all_of(clips_[i].spans.begin(), clips_[i].spans.end(), [&](const ClassSpan& span) { return occurring.contains(fill_in(span.classes, way.fill)); });
    });
    for (const Member& way : ways) sum += way.weight;
    for (Member& way : ways) {
      way.weight /= sum;
      add(i, way);
    }
  }
}

std::size_t MotionDataset::changing() const {
  return static_cast<std::size_t>(std::count_if(clips_.begin(), clips_.end(), [](const LabelledFeatures& c) { return c.spans.size() > 1; }));
}

std::size_t MotionDataset::frames() const {
  std::size_t n = 0;
  for (const auto& c : clips_) n += static_cast<std::size_t>(c.features.size(0));
  return n;
}

torch::Tensor identity_padding(const features::MotionCellLayout& layout, const std::vector<float>& mean, const std::vector<float>& deviation) {
  torch::Tensor x = torch::zeros({layout.columns()}, torch::kFloat32);
  float* p = x.data_ptr<float>();
  const int k = layout.rotation_values();
  for (int j = 0; j < layout.joints; ++j) {
    if (layout.representation == features::RotationRepresentation::quaternion) p[j * k] = 1;
    if (layout.representation == features::RotationRepresentation::rotation_matrix) p[j * k] = p[j * k + 4] = p[j * k + 8] = 1;
  }
  for (int c = 0; c < layout.columns(); ++c) {
    const auto i = static_cast<std::size_t>(c);
    // Root values of the padding are the data's mean, so that no frame lies far from the rest.
    p[c] = c < layout.rotation_columns() ? (p[c] - mean[i]) / deviation[i] : 0.0f;
  }
  return x;
}

namespace {

// The most probable filling of a clip; empty where all of it is labelled.
Classes usual_fill(const MotionDataset& data, std::size_t clip) {
  const Member* best = nullptr;
  const auto& spans = data.clips()[clip].spans;
  if (std::none_of(spans.begin(), spans.end(), [](const ClassSpan& s) { return std::find(s.classes.begin(), s.classes.end(), kFilled) != s.classes.end(); })) return {};
  for (const auto& [classes, members] : data.members())
    for (const Member& m : members)
      if (m.clip == clip && (!best || m.weight > best->weight)) best = &m;
  return best->fill;
}

// Windows put side by side.
class BatchMaker {
 public:
  BatchMaker(const MotionDataset& data, std::int64_t count, std::int64_t frames, const torch::Tensor& padding)
      : batch_{torch::empty({count, frames, data.layout().columns()}, torch::kFloat32), torch::zeros({count, frames}, torch::kFloat32),
               torch::zeros({count, static_cast<std::int64_t>(data.vocabulary().size())}, torch::kInt64), {}},
        frames_(frames),
        padding_(padding) {}

  void add(const LabelledFeatures& clip, std::int64_t first, const Classes& fill) {
    const std::int64_t row = row_++, real = std::min(frames_, clip.features.size(0) - first);
    batch_.features[row].narrow(0, 0, real).copy_(clip.features.narrow(0, first, real));
    if (real < frames_) batch_.features[row].narrow(0, real, frames_ - real).copy_(padding_.expand({frames_ - real, -1}));
    batch_.mask[row].narrow(0, 0, real).fill_(1);
    std::vector<ClassSpan> window;  // in frames of the window, the first at 0
    if (clip.spans.empty()) window.push_back({0, clip.classes});
    for (std::size_t s = 0; s < clip.spans.size(); ++s) {
      const std::int64_t from = std::max<std::int64_t>(0, clip.spans[s].first - first);
      const bool over = s + 1 < clip.spans.size() && clip.spans[s + 1].first <= first;
      if (!over && from < real) window.push_back({from, fill_in(clip.spans[s].classes, fill)});
    }
    for (std::size_t a = 0; a < window[0].classes.size(); ++a) batch_.classes[row][static_cast<std::int64_t>(a)] = window[0].classes[a];
    changes_ = changes_ || window.size() > 1;
    windows_.push_back(std::move(window));
  }

  Batch take() {
    if (changes_) {
      batch_.frame_classes = batch_.classes.unsqueeze(1).repeat({1, frames_, 1});
      const std::int64_t attributes = batch_.classes.size(1);
      auto* out = batch_.frame_classes.data_ptr<std::int64_t>();
      for (const auto& window : windows_) {
        for (const ClassSpan& span : window)
          for (std::int64_t t = span.first; t < frames_; ++t) std::copy_n(span.classes.begin(), attributes, out + t * attributes);
        out += frames_ * attributes;
      }
    }
    return std::move(batch_);
  }

 private:
  Batch batch_;
  std::int64_t frames_, row_ = 0;
  const torch::Tensor& padding_;
  std::vector<std::vector<ClassSpan>> windows_;
  bool changes_ = false;
};

// A member of a group, by weight. Groups of labelled clips alone take one number, as they always did.
const Member& draw_member(const std::vector<Member>& members, Random& random) {
  double sum = 0;
  bool weighted = false;
  for (const Member& m : members) {
    sum += m.weight;
    weighted = weighted || !m.fill.empty();
  }
  if (!weighted) return members[random.below(members.size())];
  double left = random.uniform() * sum;
  for (const Member& m : members) {
    left -= m.weight;
    if (left < 0) return m;
  }
  return members.back();
}

// A place for a window with `spare` frames around it, where the clip has these classes.
std::int64_t draw_place(const LabelledFeatures& clip, const Member& member, const Classes& classes, std::int64_t spare, Random& random) {
  if (spare <= 0) return 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> parts;  // first place, places
  std::int64_t places = 0;
  for (std::size_t s = 0; s < clip.spans.size(); ++s) {
    if (fill_in(clip.spans[s].classes, member.fill) != classes) continue;
    const std::int64_t begin = clip.spans[s].first, end = std::min(spare + 1, s + 1 < clip.spans.size() ? clip.spans[s + 1].first : spare + 1);
    if (begin >= end) continue;
    parts.emplace_back(begin, end - begin);
    places += end - begin;
  }
  if (places == 0) return static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(spare) + 1));
  auto at = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(places)));
  for (const auto& [begin, count] : parts) {
    if (at < count) return begin + at;
    at -= count;
  }
  throw Error(Exit::internal, {}, "draw_place: out of range");
}

}  // namespace

Batch rows(const Batch& batch, std::int64_t first, std::int64_t count) {
  Batch part{batch.features.narrow(0, first, count), batch.mask.narrow(0, first, count), batch.classes.narrow(0, first, count), {}};
  if (batch.frame_classes.defined()) part.frame_classes = batch.frame_classes.narrow(0, first, count);
  return part;
}

torch::Tensor word_classes(const Batch& batch, std::int64_t word_length) {
  if (!batch.frame_classes.defined()) return batch.classes;
  const std::int64_t words = batch.frame_classes.size(1) / word_length;
  return batch.frame_classes.narrow(1, 0, words * word_length).unflatten(1, {words, word_length}).select(2, word_length / 2).contiguous();
}

Batch draw_batch(const MotionDataset& data, std::int64_t count, std::int64_t frames, const torch::Tensor& padding, std::uint64_t seed, std::uint64_t stream) {
  Random random(seed, stream);
  std::vector<const std::pair<const Classes, std::vector<Member>>*> groups;
  for (const auto& group : data.members()) groups.push_back(&group);
  BatchMaker batch(data, count, frames, padding);
  for (std::int64_t row = 0; row < count; ++row) {
    const auto& [classes, members] = *groups[random.below(groups.size())];
    const Member& member = draw_member(members, random);
    const LabelledFeatures& clip = data.clips()[member.clip];
    batch.add(clip, draw_place(clip, member, classes, clip.features.size(0) - frames, random), member.fill);
  }
  return batch.take();
}

Batch fixed_batch(const MotionDataset& data, const std::vector<std::size_t>& indices, std::int64_t frames, const torch::Tensor& padding) {
  BatchMaker batch(data, static_cast<std::int64_t>(indices.size()), frames, padding);
  for (const std::size_t i : indices) batch.add(data.clips()[i], 0, usual_fill(data, i));
  return batch.take();
}

}  // namespace mocap::train
