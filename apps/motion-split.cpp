// motion-split - training, validation and test archives without leaks.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "libmocap/base/log.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/store/archive.hpp"

namespace {

using namespace mocap;

constexpr std::size_t kSplits = 3;
constexpr std::array<const char*, kSplits> kNames = {"train", "val", "test"};

// Clips that must stay together, and the labels to balance.
struct Group {
  std::vector<std::size_t> clips;
  std::map<std::string, std::size_t> labels;  // "action=walking", "action=walking gender=female" -> clips
};

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t find(std::size_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::size_t a, std::size_t b) {  // the smaller index leads
    a = find(a), b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

// What tells two sources apart: the bytes of the file; where they are not known its path; generated clips stand alone.
std::string source_key(const store::ClipInfo& clip) {
  if (!clip.source.sha256.empty()) return "s" + clip.source.sha256;
  return clip.source.path.empty() ? "n" + clip.name : "p" + clip.source.path;
}

// Parts of each group in the splits: `total` cut by the ratios, largest remainders first, at least one each.
std::array<std::size_t, kSplits> shares(std::size_t total, const std::array<double, kSplits>& ratios) {
  const double sum = ratios[0] + ratios[1] + ratios[2];
  std::array<std::size_t, kSplits> n{};
  std::array<double, kSplits> rest{};
  for (std::size_t s = 0; s < kSplits; ++s) {
    const double exact = static_cast<double>(total) * ratios[s] / sum;
    n[s] = static_cast<std::size_t>(std::floor(exact + 1e-9));
    rest[s] = exact - static_cast<double>(n[s]);
  }
  while (n[0] + n[1] + n[2] < total) {
    const auto s = static_cast<std::size_t>(std::max_element(rest.begin(), rest.end()) - rest.begin());
    ++n[s];
    rest[s] = -1;
  }
  for (std::size_t& one : n)
    if (one == 0) {
      --*std::max_element(n.begin(), n.end());
      one = 1;
    }
  return n;
}

// Groups to splits: exact numbers of groups, and each label as near to the ratios as these allow. Iterative stratification
// (Sechidis, Tsoumakas & Vlahavas 2011): the label with the fewest clips left is dealt out first, each of its groups to the
// split that lacks most of it; ties by what is lacking of the group's other labels, then by room left, then by the seed.
std::vector<std::size_t> stratify(const std::vector<Group>& groups, const std::array<double, kSplits>& ratios, std::uint64_t seed) {
  struct Label {
    double total = 0;
    std::size_t left = 0;  // clips of groups not yet dealt
    std::array<double, kSplits> lacking{};
    std::vector<std::size_t> groups;  // in random order
  };
  std::vector<std::size_t> order(groups.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Random random(seed, 0);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(i))]);
  std::map<std::string, Label> labels;
  for (const std::size_t g : order)
    for (const auto& [name, n] : groups[g].labels) {
      labels[name].left += n;
      labels[name].groups.push_back(g);
    }
  for (auto& [name, label] : labels) {
    label.total = static_cast<double>(label.left);
    for (std::size_t s = 0; s < kSplits; ++s) label.lacking[s] = label.total * ratios[s] / (ratios[0] + ratios[1] + ratios[2]);
  }

  auto room = shares(groups.size(), ratios);
  std::vector<std::size_t> split(groups.size(), kSplits);
  const auto deal = [&](std::size_t g, const Label& label) {
    std::array<double, kSplits> others{};
    for (const auto& [name, n] : groups[g].labels)
      for (std::size_t s = 0; s < kSplits; ++s) others[s] += labels[name].lacking[s] / labels[name].total;
    const auto better = [&](std::size_t a, std::size_t b) {
      for (const double difference : {label.lacking[a] - label.lacking[b], others[a] - others[b]})
        if (std::abs(difference) > 1e-9) return difference > 0;
      return room[a] > room[b];
    };
    std::size_t best = kSplits;
    const auto first = static_cast<std::size_t>(random.below(kSplits));
    for (std::size_t k = 0; k < kSplits; ++k) {
      const std::size_t s = (first + k) % kSplits;
      if (room[s] > 0 && (best == kSplits || better(s, best))) best = s;
    }
    split[g] = best;
    --room[best];
    for (const auto& [name, n] : groups[g].labels) {
      labels[name].lacking[best] -= static_cast<double>(n);
      labels[name].left -= n;
    }
  };
  while (true) {
    const Label* rarest = nullptr;
    for (const auto& [name, label] : labels)
      if (label.left > 0 && (!rarest || label.left < rarest->left)) rarest = &label;
    if (!rarest) return split;
    for (const std::size_t g : rarest->groups)
      if (split[g] == kSplits) deal(g, *rarest);
  }
}

class MotionSplit final : public cli::Tool {
 public:
  std::string name() const override { return "motion-split"; }
  std::string synopsis() const override { return "Split an archive into train.h5, val.h5 and test.h5 without leaks"; }
  std::string description() const override {
    return "Whole subjects, source files or clips go to one of three archives. Whatever --by says, all phases and mirrored copies of a part of a source "
           "stay together, and files of the same bytes count as one. The numbers of subjects, sources or clips follow --ratios exactly; within them "
           "attributes and their combinations are spread as evenly as that allows.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"motion-split all.h5 -o split/", "by source file, 6 : 1 : 1"},
            {"motion-split all.h5 --by subject --ratios 150,25,25 -o split/", "no subject in two of them"},
            {"motion-split all.h5 --balance action --seed 7 -o split7/", "another split, balanced by action alone"}};
  }
  std::vector<std::string> references() const override {
    return {"Ghorbani et al. 2020, section 4.1 (150, 25 and 25 subjects)", "Sechidis, Tsoumakas & Vlahavas 2011, On the stratification of multi-label data"};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::folder;
    t.random = true;
    t.threads = false;
    t.report = true;
    t.input_help = "motion archive; '-' for standard input";
    t.output_help = "folder for train.h5, val.h5 and test.h5";
    return t;
  }
  void options(CLI::App& app) override {
    app.add_option("--by", by_, "what stays together: an attribute 'subject', a source file, or a part of one")->check(cli::one_of({"subject", "source", "clip"}));
    app.add_option("--ratios", ratios_text_, "parts for train, val and test, divided by commas")->check(cli::path("A,B,C"));
    app.add_option("--balance", balance_, "attribute to spread evenly (repeatable); without it every one but 'subject' whose values occur in three subjects, sources or clips on average");
  }

  Exit run(cli::Context& context) override {
    const auto ratios = parse_ratios();
    const std::filesystem::path folder = context.common().output;
    std::error_code error;
    if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error)) throw Error(Exit::io, {folder.string(), 0, {}}, "a file, expected a folder");
    std::array<std::string, kSplits> paths;
    for (std::size_t s = 0; s < kSplits; ++s) {
      paths[s] = (folder / (std::string(kNames[s]) + ".h5")).string();
      if (std::filesystem::exists(folder, error)) check_output(paths[s], context.overwrite());
    }

    const cli::InputFile& input = context.inputs().at(0);
    const store::ArchiveReader in(input.path);
    std::vector<Group> groups = group(in);
    if (groups.size() < kSplits) refuse({in.name(), 0, {}}, fmt::format("{} {}{} to split, expected at least {}", groups.size(), by_, groups.size() == 1 ? "" : "s", kSplits));
    const auto combination = label(in, groups);
    const auto split = stratify(groups, ratios, context.seed());

    std::vector<std::size_t> split_of(in.size());
    for (std::size_t g = 0; g < groups.size(); ++g)
      for (const std::size_t i : groups[g].clips) split_of[i] = split[g];

    std::filesystem::create_directories(folder, error);
    if (error) throw Error(Exit::io, {folder.string(), 0, {}}, "the folder cannot be made: " + error.message());
    store::ArchiveHeader header = in.header();
    header.history.push_back(context.history_entry({{input.label, in.file_sha256()}}));
    std::array<std::unique_ptr<store::ArchiveWriter>, kSplits> writers;
    for (std::size_t s = 0; s < kSplits; ++s) writers[s] = std::make_unique<store::ArchiveWriter>(paths[s], context.overwrite(), header);
    for (std::size_t i = 0; i < in.size(); ++i) {
      writers[split_of[i]]->add(in.read(i));
      context.progress(i + 1, in.size(), "clips");
    }
    for (auto& writer : writers) writer->finish();
    report(context, groups, split, combination, split_of, paths);
    return Exit::ok;
  }

 private:
  std::array<double, kSplits> parse_ratios() const {
    std::array<double, kSplits> ratios{};
    std::size_t count = 0;
    for (const auto& part : CLI::detail::split(ratios_text_, ',')) {
      const auto value = cli::parse_number(part);
      if (!value || *value <= 0 || *value > 1e9 || count == kSplits) refuse_usage("--ratios " + ratios_text_ + ": expected three numbers above 0, divided by commas");
      ratios[count++] = *value;
    }
    if (count != kSplits) refuse_usage("--ratios " + ratios_text_ + ": expected three numbers above 0, divided by commas");
    return ratios;
  }

  std::vector<Group> group(const store::ArchiveReader& in) const {
    DisjointSets sets(in.size());
    std::map<std::string, std::vector<std::size_t>> by_source;
    std::map<std::string, std::size_t> by_subject;
    for (std::size_t i = 0; i < in.size(); ++i) by_source[source_key(in.info(i))].push_back(i);
    for (auto& [key, clips] : by_source) {
      if (by_ != "clip") {
        for (const std::size_t i : clips) sets.join(clips.front(), i);
        continue;
      }
      // Phases and mirrored copies are clips of the same stretch of the source: they overlap by more than half.
      std::stable_sort(clips.begin(), clips.end(), [&](std::size_t a, std::size_t b) { return in.info(a).source.start_s < in.info(b).source.start_s; });
      const double frame = 1 / in.header().frame_rate_hz;
      const auto span = [&](std::size_t i) { return std::pair{in.info(i).source.start_s, std::max(in.info(i).source.end_s, in.info(i).source.start_s) + frame}; };
      auto [start, end] = span(clips.front());
      std::size_t leader = clips.front();
      for (const std::size_t i : clips) {
        const auto [a, b] = span(i);
        if (std::min(end, b) - a > 0.5 * std::min(end - start, b - a)) {
          sets.join(leader, i);
          end = std::max(end, b);
        } else {
          leader = i;
          start = a, end = b;
        }
      }
    }
    if (by_ == "subject")
      for (std::size_t i = 0; i < in.size(); ++i) {
        const auto& attributes = in.info(i).attributes;
        const auto subject = attributes.find("subject");
        if (subject == attributes.end() || subject->second.empty())
          refuse({in.name(), 0, "clip " + in.info(i).name}, "no attribute subject, expected one for --by subject", "use --by source");
        sets.join(by_subject.emplace(subject->second, i).first->second, i);
      }
    std::map<std::size_t, Group> found;
    for (std::size_t i = 0; i < in.size(); ++i) found[sets.find(i)].clips.push_back(i);
    std::vector<Group> groups;
    for (auto& [leader, g] : found) groups.push_back(std::move(g));
    return groups;
  }

  // Labels of the groups: the values of the attributes to balance by, and their combinations, where they occur in enough
  // groups to be in every split. Returns each clip's combination.
  std::vector<std::string> label(const store::ArchiveReader& in, std::vector<Group>& groups) const {
    std::set<std::string> all;
    for (std::size_t i = 0; i < in.size(); ++i)
      for (const auto& [name, value] : in.info(i).attributes) all.insert(name);
    for (const auto& name : balance_)
      if (!all.contains(name)) refuse({in.name(), 0, {}}, "no clip has the attribute " + name + ", expected one to balance by");
    const auto value_of = [&](std::size_t i, const std::string& name) {
      const auto it = in.info(i).attributes.find(name);
      return name + "=" + (it == in.info(i).attributes.end() ? std::string() : it->second);
    };
    const auto is_spread = [&](const std::string& name) {
      std::set<std::string> values;
      std::size_t occurrences = 0;
      for (const Group& g : groups) {
        std::set<std::string> here;
        for (const std::size_t i : g.clips) here.insert(value_of(i, name));
        occurrences += here.size();
        values.insert(here.begin(), here.end());
      }
      return occurrences >= kSplits * values.size();
    };
    std::set<std::string> chosen(balance_.begin(), balance_.end());
    for (const auto& name : all)
      if (balance_.empty() && name != "subject" && is_spread(name)) chosen.insert(name);

    std::vector<std::string> combination(in.size());
    std::map<std::string, std::size_t> groups_with;
    for (Group& g : groups) {
      for (const std::size_t i : g.clips) {
        for (const auto& name : chosen) combination[i] += (combination[i].empty() ? "" : " ") + value_of(i, name);
        ++g.labels[combination[i]];
        if (chosen.size() > 1)
          for (const auto& name : chosen) ++g.labels[value_of(i, name)];
      }
      for (const auto& [name, n] : g.labels) ++groups_with[name];
    }
    for (Group& g : groups) {
      std::erase_if(g.labels, [&](const auto& one) { return groups_with[one.first] < kSplits; });
      g.labels["every clip"] = g.clips.size();  // every group has a label, and the lengths of the splits count too
    }
    return combination;
  }

  void report(cli::Context& context, const std::vector<Group>& groups, const std::vector<std::size_t>& split, const std::vector<std::string>& combination,
              const std::vector<std::size_t>& split_of, const std::array<std::string, kSplits>& paths) const {
    nlohmann::ordered_json document;
    std::set<std::string> scarce;
    for (std::size_t s = 0; s < kSplits; ++s) {
      const auto members = std::count(split.begin(), split.end(), s);
      const auto clips = std::count(split_of.begin(), split_of.end(), s);
      std::map<std::string, std::size_t> counts;
      for (std::size_t i = 0; i < combination.size(); ++i) counts[combination[i]] += split_of[i] == s;
      log::info("{}: {} {}{}, {} clips", paths[s], members, by_, members == 1 ? "" : "s", clips);
      for (const auto& [name, n] : counts) {
        if (n > 0) continue;
        if (std::any_of(groups.begin(), groups.end(), [&](const Group& g) { return g.labels.contains(name); })) log::warn("{}: no clip of {}", paths[s], name);
        else scarce.insert(name);
      }
      document[kNames[s]] = {{"groups", members}, {"clips", clips}, {"classes", counts}};
    }
    if (!scarce.empty()) log::warn("{} combinations of attributes occur in fewer than {} {}s: they are not in every archive", scarce.size(), kSplits, by_);
    if (context.common().json) context.print(document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  }

  std::string by_ = "source", ratios_text_ = "150,25,25";
  std::vector<std::string> balance_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<MotionSplit>(argc, argv); }
