// Multilayer perceptron: fully connected layers with ELU between them (rows of Table 1 of Ghorbani et al. 2020).
#pragma once
#include <torch/torch.h>

#include <string>
#include <utility>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmodels/nn/layers.hpp"

namespace mocap::nn {

// Parameters are named `<layer>.weight`, `<layer>.bias`, so that /weights/<path> of a model file reads
// `encoder/0/weight`.
class Mlp : public torch::nn::Module {
 public:
  // sizes  input, hidden ..., output. activate_last  ELU after the last layer too.
  // Initialisation (He et al. 2015, Kaiming normal, fan in): layers followed by ELU get deviation sqrt(2 / in), a last
  // layer without one 0.5 / sqrt(in), biases 0; drawn from `random` layer by layer.
  Mlp(const std::vector<int>& sizes, bool activate_last, Random& random);

  // x (rows, in), contiguous, float or double as the parameters -> (rows, out). Differentiable once, forward and
  // backward on the caller's thread; the same bits on any x86-64 processor with fused multiply-add, a row's result does
  // not depend on the other rows.
  torch::Tensor forward(const torch::Tensor& x) const;

  int layer_count() const { return static_cast<int>(weights_.size()); }
  const torch::Tensor& weight(int layer) const { return weights_[layer]; }
  const torch::Tensor& bias(int layer) const { return biases_[layer]; }
  bool activate_last() const { return activate_last_; }
  std::vector<torch::Tensor> interleaved_parameters() const;  // weight 0, bias 0, weight 1, ...

  // The layers from `first` on, packed.
  template <class T>
  PackedMlp<T> pack(int first, bool training) const;

 private:
  std::vector<torch::Tensor> weights_, biases_;
  bool activate_last_;
};

// "word_encoder.0.weight" -> "word_encoder/0/weight".
std::string parameter_path(std::string name);
// All parameters of a module by path, in order of registration.
std::vector<std::pair<std::string, torch::Tensor>> parameters_by_path(const torch::nn::Module& module);

// Standard normal numbers from `random` in row-major order, float.
torch::Tensor normal_tensor(at::IntArrayRef sizes, Random& random);
// Uniform on [-bound, bound).
torch::Tensor uniform_tensor(at::IntArrayRef sizes, double bound, Random& random);

// Owner of what a hand-written autograd function keeps for its backward pass.
template <class T>
struct Tape : torch::CustomClassHolder {
  T kept;
};
// Views of the rows of 2-dimensional tensors.
template <class T>
View<T> view(const torch::Tensor& t) {
  return {t.data_ptr<T>(), t.stride(0)};
}
template <class T>
std::vector<View<T>> views(const std::vector<torch::Tensor>& tensors, std::int64_t row = 0) {
  std::vector<View<T>> all;
  for (const auto& t : tensors) all.push_back(view<T>(t).from_row(row));
  return all;
}

// Activations of a PackedMlp over `rows` samples: one uninitialised (rows, out) tensor a layer.
template <class T>
std::vector<torch::Tensor> layer_buffers(const PackedMlp<T>& mlp, std::int64_t rows) {
  std::vector<torch::Tensor> buffers;
  for (const auto& layer : mlp.layers)
    buffers.push_back(at::empty({rows, layer.out()}, at::TensorOptions(c10::CppTypeToScalarType<T>::value)));
  return buffers;
}

// Gradients of the weights and biases (in this order, layer by layer) of layers whose pre-activation gradients are d.
template <class T>
void append_layer_gradients(std::int64_t rows, View<const T> x, const std::vector<torch::Tensor>& y,
                            const std::vector<torch::Tensor>& d, std::int64_t in, std::vector<torch::Tensor>& out);

}  // namespace mocap::nn
