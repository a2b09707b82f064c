// What an evaluation compares: sets of clips or of features, cut to the same lengths and grouped by their labels.
//
// The order for clips, once for each generator (real and training clips are cut by the generated ones' lengths, so every generator starts from its own copy of them):
//   check_alike, add_labels (each attribute), perhaps match_classes, cut_to_same_lengths, features and posteriors of each view filled in, join_views, perhaps reduce,
//   evaluate (evaluation.hpp).
// For features read from files: perhaps match_classes, join_views, perhaps reduce, evaluate.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/base/history.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/metrics/frechet.hpp"

namespace mocap::evaluation {

using Rows = std::vector<std::size_t>;

// What one classifier says of a set, or what a file of features holds.
struct View {
  std::string attribute;
  std::vector<std::string> classes;
  Eigen::MatrixXd features, posteriors;  // [N,d], [N,C]; posteriors may be empty
  std::vector<int> labels;               // index into classes, -1: unlabelled; empty: none is labelled
};

struct Set {
  std::string path;  // as messages name it
  std::vector<View> views;
  Eigen::MatrixXd features;                // [N,d] of all views, side by side (join_views)
  std::optional<metrics::Gaussian> given;  // statistics read in place of features
  std::vector<Clip> clips;                 // empty where features were read
  History history;
  std::string sha256;
  std::size_t size() const { return static_cast<std::size_t>(features.rows()); }
};

struct Sets {
  Set generated, real;
  std::optional<Set> train;
  std::optional<Set> mean_pose = {};  // what mean_poses makes of the training clips
  std::vector<Set*> all();
  std::vector<const Set*> all() const;
};

// An npz file with features [N,d] and, as far as they are there, posteriors [N,C], labels [N] (numbers, or names out of classes [C]), classes [C]; or a table as
// embed writes it, of whose columns f0, f1, ... are taken. One view, "class". "-" is standard input. Error(data) with file and array or line for what does not fit.
Set read_features(const std::string& path);
// The same, or the statistics mu [d] and sigma [d,d] that pytorch-fid writes (Set::given).
Set read_features_or_statistics(const std::string& path);
// Motion of any kind. Error(data) for a file without clips.
Set read_clips(const std::string& path, const std::string& label);

// Writes mean and covariance of features (after reduce) as mu and sigma. A file that is there must hold the same within 1e-9, else Error(data).
void keep_statistics(const Set& set, const std::string& path);

// Error(data) unless all clips have the first real clip's rate (1e-6) and skeleton (1e-5), and no source file is in real and training clips both.
void check_alike(const Sets& sets);
// A view more, with the labels that the clips have for the attribute. Error(data) for fewer than two classes and a label that is none of them.
void add_labels(Set& set, const std::string& attribute, const std::vector<std::string>& classes);
// Thins a set out, at random within a class (all views' labels together), until classes are as frequent as in the other (within one clip a class), and returns how many
// clips were left out. The Frechet distance takes a difference of mix for one of motion: a generator that makes all classes equally often, held against real clips that
// do not, pays for it. Error(data) where a clip of either set lacks a label or either set a class of the other.
std::size_t match_classes(Set& set, const Set& like, std::uint64_t seed);
// The class whose share differs most between generated and real clips, in words, where that is more than five in a hundred; "" otherwise, and where labels lack.
std::string difference_of_mix(const Sets& sets);
// Class by class (all views' labels together), so that a class of short clips is not compared with its long ones; training clips take the real clips' lengths.
// No clip keeps more than `limit` frames (0: no limit). Clips are cut behind; with a seed real and training clips at a random place, which is how the windows lie that a
// generator of motion without a beginning was trained on: an action whose clips begin and end at rest is not the same in its first seconds and in any.
void cut_to_same_lengths(Sets& sets, std::size_t limit = 0, std::optional<std::uint64_t> anywhere = {});
// The clips, each frozen in the mean pose of its class (rotations averaged over the class's frames, the root's without its turn about the vertical; root height), labels kept. A generator
// that learned nothing but what each class looks like makes these: where the scale of a Frechet distance ends, as a floor is where it begins.
Set mean_poses(const Set& train);
// Puts the views' features side by side. Error(data) for a value that is not finite, naming its row and column.
void join_views(Set& set);
// Principal axes fitted on the training clips' features in place of the features of all sets. Returns the share of variance kept. Error(data) where the real
// set is only statistics; a call without training clips is a mistake of the program.
double reduce(Sets& sets, int axes);

// Labels of all views of clip i, joined by blanks; "" where one lacks.
std::string label_of(const Set& set, std::size_t i);

struct Groups {
  std::vector<std::string> classes;   // combinations of labels among generated and real clips, sorted
  std::vector<int> generated, real;   // index into classes, -1: none
  bool by_class = false, real_by_class = false;
};
// Error(data) for a class with fewer than two clips where both sets are labelled, naming it.
Groups group_by_labels(const Sets& sets);

Eigen::MatrixXd take(const Eigen::MatrixXd& x, const Rows& rows);
template <class T>
std::vector<T> take(const std::vector<T>& x, const Rows& rows) {
  std::vector<T> out;
  for (const std::size_t i : rows) out.push_back(x[i]);
  return out;
}
Rows all_rows(std::size_t n);
Rows shuffled(std::size_t n, std::uint64_t seed, std::uint64_t stream);

}  // namespace mocap::evaluation
