// A baseline's weights laid out for the hand-written recurrent passes (scan.hpp, sampler.hpp), and one frame of them.
#pragma once
#include <memory>
#include <type_traits>
#include <vector>

#include "libmodels/baselines/network.hpp"

namespace mocap::baselines {

// Where one frame of `rows` clips reads and writes; the recurrent layers may write the state over the one they read.
template <class T>
struct FrameBuffers {
  nn::View<T> input;                  // (rows, D + A): u and the one-hots
  std::vector<nn::View<T>> encoded;   // erd: outputs of the encoder's layers
  nn::View<const T> state;            // s_{t-1}
  nn::View<T> next;                   // s_t
  T *gates_1 = nullptr, *gates_2 = nullptr;  // (rows, 4 hidden) each, or null for quaternet without a backward pass
  T* scratch = nullptr;               // quaternet: 6 hidden a row
  std::vector<nn::View<T>> decoded;   // outputs of the decoder's layers; the last is o
  nn::View<T> y;
};

template <class T>
struct NetworkWeights {
  Arch arch;
  int features, joints, hidden, state, input;
  nn::PackedMlp<T> encoder, decoder, start;
  nn::PackedGru<T> gru_1, gru_2;
  nn::PackedLstm<T> lstm_1, lstm_2;
  std::vector<T> mean, deviation;

  NetworkWeights(const Network& network, bool training);

  // y and the next state from u (network.hpp).
  void frame(int rows, const FrameBuffers<T>& b) const;
  // u from the frame before: quaternions normalised.
  void feed_back(int rows, nn::View<const T> y, nn::View<T> u) const;
  // From du: dy is added to.
  void feed_back_backward(int rows, nn::View<const T> y, nn::View<const T> du, nn::View<T> dy) const;
  // From dy: d_o and du are written; du without what came through the layers.
  void head_backward(int rows, nn::View<const T> u, nn::View<const T> o, nn::View<const T> dy, nn::View<T> d_o, nn::View<T> du) const;

 private:
  void head(int rows, nn::View<const T> u, nn::View<const T> o, nn::View<T> y) const;
};

class PackedNetwork {
 public:
  std::unique_ptr<const NetworkWeights<float>> single;  // one of the two, by the parameters' type
  std::unique_ptr<const NetworkWeights<double>> double_;
  template <class T>
  const NetworkWeights<T>& as() const {
    if constexpr (std::is_same_v<T, float>)
      return *single;
    else
      return *double_;
  }
};

}  // namespace mocap::baselines
