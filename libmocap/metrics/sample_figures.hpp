// Figures of a set of samples from a classifier's features [N,d] and posteriors [N,C], all in double: how real, how diverse,
// how well each class is met. Draws are Philox (base/random.hpp), so equal seeds give equal figures on any number of threads.
// Every function throws Error(data) for values that are not finite, posteriors that are no distribution (sum off by more
// than 1e-6, a value below 0), and sizes that disagree.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "libmocap/metrics/frechet.hpp"
#include "libmocap/metrics/intervals.hpp"

namespace mocap::metrics {

struct MeanDeviation {
  double mean = 0, deviation = 0;  // over splits or subsets; ddof 0, as is customary for both
};

// Inception score (Salimans et al. 2016; Ghorbani eq. 27): exp(mean_x KL(p(c|x) || p(c))), the mean over `splits` disjoint parts
// of the shuffled rows. Between 1 and inception_bound. Error(data) for fewer rows than splits, and for one class.
MeanDeviation inception_score(const Eigen::MatrixXd& posteriors, int splits = 1, std::uint64_t seed = 1);
// Of torch-fidelity: NumPy's shuffle of seed 2020, 10 splits.
MeanDeviation inception_score_torch_fidelity(const Eigen::MatrixXd& posteriors, int splits = 10, std::uint32_t seed = 2020);
// What it can reach with n rows in one split: all posteriors one-hot and the classes in balance, exp of that entropy; C where C divides n.
double inception_bound(long classes, long n);

// p(a, b, ...|x) = p(a|x) p(b|x) ...: the outer product of the attributes' posteriors, the last attribute's classes fastest. [N, C1 C2 ...]
Eigen::MatrixXd joint_posteriors(const std::vector<Eigen::MatrixXd>& attributes);

// Kernel inception distance (Binkowski et al. 2018): the unbiased squared MMD with the kernel (x.y/d + 1)^3, over `subsets` pairs
// of subsets of min(subset, N of either set) rows drawn without replacement. May be below 0, and is somewhat where both sets hold their classes in the same shares: the
// formula takes rows for independent draws, and leaves a row out within its own set but not its like in the other.
//   MMD^2 = sum_{i!=j} k(x_i,x_j) / (m (m-1)) + sum_{i!=j} k(y_i,y_j) / (m (m-1)) - 2 sum_{i,j} k(x_i,y_j) / m^2
struct KidOptions {
  int subsets = 100, subset = 1000;
  std::uint64_t seed = 1;
  bool numpy_draws = false;  // torch-fidelity's: RandomState(seed), a permutation of each set in turn
  int threads = 1;
};
MeanDeviation kid(const Eigen::MatrixXd& generated, const Eigen::MatrixXd& real, const KidOptions& options);

// Columns less the mean, over the deviation (ddof 1), of the real clips. The kernel above is made for features of about unit size; those of a classifier of motion are not,
// and there its cubic term alone decides. A column that hardly varies in the real clips must not decide either: no divisor is below a tenth of the root mean square of all.
// Where no column varies the divisor is 1. Error(data) for fewer than 2 rows.
struct Standard {
  Eigen::RowVectorXd mean, scale;  // [d]
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& features) const;
};
Standard standard_of(const Eigen::MatrixXd& real);

// Improved precision and recall (Kynkaanniemi et al. 2019): the share of generated rows that lie in the ball of some real row, whose
// radius is its distance to its k-th neighbour (itself left out; the rim counts), and the reverse. Error(data) unless N > k.
// Cost (N + M)^2 d; distances to 1e-7 of the features' size.
struct PrecisionRecall {
  double precision = 0, recall = 0;
};
PrecisionRecall precision_recall(const Eigen::MatrixXd& generated, const Eigen::MatrixXd& real, int k = 3, int threads = 1);

// The share of rows whose largest posterior is that of their label (-1: unlabelled, not counted): trace over what was counted.
// `counted` receives how many. Error(data) where nothing is labelled.
double accuracy(const Eigen::MatrixXd& posteriors, const std::vector<int>& labels, long* counted = nullptr);

// Mean distance of `pairs` random pairs of two different rows. Compared with the real set's: neither larger nor smaller is better.
double diversity(const Eigen::MatrixXd& features, int pairs = 200, std::uint64_t seed = 1);
// Of action-to-motion and ACTOR: pairs with replacement from RandomState(seed), the same row twice included.
double diversity_a2m(const Eigen::MatrixXd& features, int pairs = 200, std::uint32_t seed = 1);

// Total variance of the features within their class, tr S_c (n - 1), averaged over the classes of the label list.
// Error(data) for a class of 0 .. classes-1 with fewer than 2 rows, naming it ("class NAME").
double within_class_variance(const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes);

// Mean distance of `pairs` random pairs of two different rows of one class, averaged over the classes. An empty class, or one of a single
// row, is refused by name: the usual program loops for ever there.
double multimodality(const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, int pairs = 20, std::uint64_t seed = 1);
// Of action-to-motion and ACTOR: rejection sampling from RandomState(seed), the same row twice included.
double multimodality_a2m(const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, int pairs = 20, std::uint32_t seed = 1);

// 95 % intervals about a value of the functions above, for the drawing of the generated clips; real clips and labels are held fixed. All these figures are means over pairs of
// clips, U = sum_{i!=j} h(x_i, x_j) / (n (n-1)) (for KID with - 2 mean k(x_i, y_j) besides), so the variance is that of the delete-one jackknife (Arvesen 1969), in
// closed form by U_-i = (sum - 2 row_i) / ((n-1)(n-2)); where only some pairs or subsets were drawn, the variance of that draw is added. Not the bootstrap: a clip drawn
// twice makes pairs of a clip with itself, which an unbiased MMD, a diversity and a variance leave out, and resampling the pairs alone takes pairs that share a clip for
// independent ones. Interval: value -+ t(0.975, n - classes) s. NaN bounds below 3 clips (in a class).
// Near a KID of 0 the interval is up to about twice as wide as need be (U is then nearly degenerate). Cost n^2 d for all but the variance; any number of threads gives the same.
Interval kid_interval(const Eigen::MatrixXd& generated, const Eigen::MatrixXd& real, const MeanDeviation& found, const KidOptions& options);
Interval diversity_interval(double value, const Eigen::MatrixXd& features, int pairs = 200, int threads = 1);
Interval within_class_variance_interval(double value, const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes);
Interval multimodality_interval(double value, const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, int pairs = 20, int threads = 1);

}  // namespace mocap::metrics
