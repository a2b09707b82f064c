#include "libmodels/cae_vae/reconstruction.hpp"

#include <numeric>

namespace mocap::cae_vae {
namespace {

using features::FeatureMatrix;
constexpr int kJoints = features::kMotegiJoints;
constexpr std::size_t kPiece = 100;

double joint_distances(const FeatureMatrix& a, const FeatureMatrix& b) {
  double sum = 0;
  for (Eigen::Index t = 0; t < a.rows(); ++t)
    for (int j = 0; j < kJoints; ++j) sum += (a.row(t).segment<3>(3 * j) - b.row(t).segment<3>(3 * j)).norm();
  return sum;
}

// Height of the root, then the joints around it.
double pose_distances(const FeatureMatrix& a, const FeatureMatrix& b) {
  double sum = 0;
  for (Eigen::Index t = 0; t < a.rows(); ++t) {
    sum += std::abs(a(t, 0) - b(t, 0));
    for (int j = 0; j + 1 < kJoints; ++j) sum += (a.row(t).segment<3>(1 + 3 * j) - b.row(t).segment<3>(1 + 3 * j)).norm();
  }
  return sum;
}

}  // namespace

ReconstructionError reconstruction_error(const Network& network, const WindowDataset& data) {
  const torch::NoGradGuard no_grad;
  const Reference& reference = data.reference();
  const std::int64_t window = data.length();
  ReconstructionError e;
  e.windows = data.windows().size();
  const std::vector<float> nothing(static_cast<std::size_t>(window * features::kMotegiColumns), 0.0F);
  const FeatureMatrix mean = restored(nothing.data(), window, reference);
  for (std::size_t begin = 0; begin < e.windows; begin += kPiece) {
    std::vector<std::size_t> piece(std::min(kPiece, e.windows - begin));
    std::iota(piece.begin(), piece.end(), begin);
    const torch::Tensor x = data.batch(piece), y = network.cae->encode(x);
    const torch::Tensor through = network.restored(network.vae->mean(network.vae->posterior(network.standardised(y)).mean));
    const torch::Tensor first = network.cae->decode(y).contiguous(), both = network.cae->decode(through).contiguous();
    for (std::int64_t i = 0; i < x.size(0); ++i) {
      const FeatureMatrix truth = restored(x[i].data_ptr<float>(), window, reference), places = features::decode_motegi(truth, reference.frame_rate_hz);
      const auto add = [&](StageError& stage, const torch::Tensor& rows) {
        const FeatureMatrix given = restored(rows[i].data_ptr<float>(), window, reference);
        stage.pose_mm += pose_distances(given, truth);
        stage.world_mm += joint_distances(features::decode_motegi(given, reference.frame_rate_hz), places);
      };
      add(e.autoencoder, first);
      add(e.both, both);
      e.mean_pose_mm += pose_distances(mean, truth);
    }
  }
  const double mm = 1000 / (static_cast<double>(e.windows) * static_cast<double>(window) * kJoints);
  for (double* sum : {&e.autoencoder.pose_mm, &e.autoencoder.world_mm, &e.both.pose_mm, &e.both.world_mm, &e.mean_pose_mm}) *sum *= mm;
  return e;
}

}  // namespace mocap::cae_vae
