// A mixture generator, with a refiner behind it or without, as something to look for motion with (Wang, Chai, Xia 2018, sections 5.2 to 5.4).
//
// A window of T frames is looked for behind a frame that stands fast. Unknown are its standardised states s_1 .. s_T and the noise d_0 .. d_(T-1) on the network's input (5.1); the hidden states follow
// from running the network on s_(t-1) + d_(t-1), and where the body is from the placement of the frame before. The contact bits are read from the network and held fixed while s and d are varied.
// With a refiner, what is seen is R(s): all that is asked of the motion is asked of the refined one, the prior alone of the generator's.
#pragma once
#include <torch/torch.h>

#include <memory>
#include <optional>
#include <vector>

#include "libmodels/lstm_gmm/model.hpp"
#include "libmodels/refiner/model.hpp"

namespace mocap::control {

// What is carried from frame to frame: everything that the frames to come depend on.
struct Carried {
  torch::Tensor frame;               // (input) state and contacts of the last frame, standardised
  torch::Tensor state;               // (state) of the network before that frame
  double x = 0, y = 0, heading = 0;  // of the root in that frame as it is shown, m and rad, world
  torch::Tensor shown;               // (D + 2) the last frame as it is shown: refined, or as it is
  double speed = 0;                  // of the root over the ground to this frame, at a start to the next, m/s
  torch::Tensor feet;                // (3 E) the followed joints' positions in its ground frame, as shown
  torch::Tensor refiner_state;       // (2 H) after it; with a refiner
  torch::Tensor refiner_before;      // (3 E') end effectors of the generator's frame, which the refiner reads velocities from
};

// B candidates for the T frames of a window.
struct Motion {
  torch::Tensor states;    // (T, B, D)
  torch::Tensor noise;     // (T, B, D), d_0 first
  torch::Tensor contacts;  // (T, B, 2), 0 or 1

  std::int64_t frames() const { return states.size(0); }
  std::int64_t candidates() const { return states.size(1); }
  Motion candidate(std::int64_t b) const { return {states.narrow(1, b, 1), noise.narrow(1, b, 1), contacts.narrow(1, b, 1)}; }
};

// What follows from a motion. All differentiable with respect to its states and noise.
struct Seen {
  torch::Tensor nats;             // (T, B) -log p(s_t | s_0 .. s_(t-1), d), eq. 8
  torch::Tensor contact_logits;   // (T, B, 2) of the network
  torch::Tensor rows;             // (T, B, D + 2) as shown: refined, or as it is
  torch::Tensor features;         // (T, B, D) the same in radians and metres
  torch::Tensor contacts;         // (T, B, 2) 0 or 1, as shown
  torch::Tensor root;             // (T, B, 2) on the ground, m, world
  torch::Tensor steps;            // (T, B) m that the root moves from the frame before
  torch::Tensor heading;          // (T, B) rad, continuous
  torch::Tensor feet;             // (T, B, 2, 3) toe bases in the ground frame of their frame, m
  torch::Tensor foot_velocities;  // (T, B, 2, 3) m/s
  torch::Tensor feet_on_ground;   // (T, B, 2, 2) the same places in the world, m
  torch::Tensor point;            // (T, B, 2) the followed joint on the ground, world; the root's where none is named
  torch::Tensor noise;            // (T, B, D)
  double frame_rate_hz = 30;
};

class MotionModel {
 public:
  // Both models are kept by reference; `refiner` null: none. `point`: joint to follow, -1 the root. Error(data) where the refiner's skeleton or rate are others, and for a body without feet. `number`: kFloat, or kDouble for checks.
  MotionModel(const lstm_gmm::Model& generator, const refiner::Model* refiner, int point = -1, torch::Dtype number = torch::kFloat);

  const train::Reference& reference() const { return generator_.reference; }
  const lstm_gmm::Model& generator() const { return generator_; }
  torch::Dtype number() const { return number_; }
  int columns() const { return static_cast<int>(generator_.reference.mean.size()); }

  // Mean height of the toe bases where the frames that the generator starts from have them down, m; 0.03 where none is.
  double rest_height() const { return rest_height_; }

  // Carried behind the first of two frames (2, input), whose hidden state is found by eq. 26, placed above the origin with heading 0.
  Carried start(const torch::Tensor& pair) const;
  // Of several pairs (K, 2, input) at once: the same, in a fraction of the time.
  std::vector<Carried> starts(const torch::Tensor& pairs) const;
  // Carried behind a frame (input) before which the network was in `state`, placed likewise; its speed is left at 0. Differentiable with respect to both, for who looks for the start as well.
  Carried behind(const torch::Tensor& frame, const torch::Tensor& state) const;
  Seen operator()(const Carried& before, const Motion& motion) const { return see(before, motion, nullptr); }
  // Carried behind frame `frames` of a motion of one candidate.
  Carried advance(const Carried& before, const Motion& motion, std::int64_t frames) const;
  // Contacts by what the network says of them where it sees this motion, (T, B, 2).
  torch::Tensor contacts_of(const Seen& seen) const { return (seen.contact_logits > 0).to(seen.contact_logits.scalar_type()); }
  // The most probable component of what comes next: mean and deviation of the states (D), contacts (2).
  struct Expected {
    torch::Tensor mean, deviation, contacts;
  };
  Expected next(const Carried& before) const;
  // Deviation of every value of a motion's states under the component that explains it best, (T, B, D): what a natural step is.
  torch::Tensor scale(const Carried& before, const Motion& motion) const;

 private:
  struct Run;
  // As operator(), and into `after`, where given, what the last frame leaves behind: the states of both networks and the generator's end effectors.
  Seen see(const Carried& before, const Motion& motion, Carried* after) const;
  Run run(const Carried& before, const Motion& motion) const;
  struct Refined {
    torch::Tensor rows;       // (T, B, D + 2) standardised as the generator's
    torch::Tensor effectors;  // (T, B, 3 E') places of the end effectors of what went in
    torch::Tensor state;      // (B, 2 H)
  };
  // `rows` (T, B, D + 2) as the generator standardises them, whatever the refiner's own mean and deviation are.
  Refined refined(const torch::Tensor& rows, const torch::Tensor& before, const torch::Tensor& state) const;
  torch::Tensor of(const torch::Tensor& t) const { return t.to(number_); }

  const lstm_gmm::Model& generator_;
  const refiner::Model* refiner_;
  torch::Dtype number_;
  std::shared_ptr<lstm_gmm::Network> network_;            // a copy of its own, without gradients
  std::shared_ptr<refiner::RefinerNetwork> refining_;
  std::unique_ptr<lstm_gmm::PackedNetwork> packed_;
  std::shared_ptr<const nn::PackedLstmCell> packed_refiner_;
  refiner::EndEffectors followed_;                        // toe bases, then the followed joint
  std::optional<refiner::EndEffectors> refiner_effectors_;
  bool follows_joint_;
  double rest_height_ = 0.03;
  torch::Tensor mean_, deviation_, effector_mean_, effector_deviation_;
  torch::Tensor to_refiner_scale_, to_refiner_shift_;  // (D + 2): states in the refiner's units
};

}  // namespace mocap::control
