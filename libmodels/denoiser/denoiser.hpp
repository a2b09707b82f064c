// A trained denoiser applied to clips, and what it changed.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::denoiser {

class Denoiser {
 public:
  // `file_sha256`, where given, receives the digest of the file's bytes. Error(data) for another kind, and for a model that is damaged or does not fit itself.
  static std::unique_ptr<Denoiser> load(const std::string& path, std::string* file_sha256 = nullptr);
  ~Denoiser();

  // The clip with other rotations and root positions; names, attributes, contacts, segments, source and path are kept. Any length: the network
  // is convolutional, its first and last frame stand for what is missing, long clips go through it in parts with the context that they reach.
  // Rotations are normalised. Root velocity and yaw rate are denoised and added up again; so that their errors do not add up to a drift, the
  // heading and ground position are drawn to those of the input by the difference between them, smoothed (running median of 0.27 s against
  // spikes, then Gaussian, deviation 0.1 s).
  // Still poses and even travel come back within 2e-5 rad and m from an untrained network (float). Errors: Error(data) naming the clip for another skeleton (1e-5 m) or rate
  // than the training data's, joint translations, 0 frames, numbers that are not finite. Thread-safe; depends on the clip alone.
  // Each calling thread needs nn::initialize_worker_thread().
  Clip apply(const Clip& clip) const;

 private:
  struct State;
  explicit Denoiser(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// What became of one joint of a clip.
struct JointChange {
  double mean_deg = 0, worst_deg = 0;  // angle between the local rotations (root: to the world)
  std::size_t worst_deg_frame = 0;
  double mean_mm = 0, worst_mm = 0;    // distance between the positions in the world
  std::size_t worst_mm_frame = 0;
  double peak_speed_mps = 0, peak_speed_kept = 1;  // of the position before, and the share of it left; 1 where nothing moved
};
// One for each joint. Both clips have the same skeleton and frames. [J]
std::vector<JointChange> changes(const Clip& before, const Clip& after);

}  // namespace mocap::denoiser
