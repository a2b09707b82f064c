#include "libmodels/nn/convolution.hpp"

#include "libmodels/nn/layers.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;

Tensor padded(const Tensor& x, std::int64_t edge) {
  Tensor out = torch::zeros({x.size(0), x.size(1) + 2 * edge, x.size(2)}, x.options());
  out.narrow(1, edge, x.size(1)).copy_(x);
  return out;
}

// (B, T + K - 1, C) by (O, K C), frames of each window overlapping -> (B, T, O).
Tensor products(const Tensor& x, const Tensor& matrix, const float* bias, std::int64_t kernel) {
  const std::int64_t frames = x.size(1) - kernel + 1, in = x.size(2), out = matrix.size(0);
  PackedLinear<float> layer;
  layer.pack(matrix.data_ptr<float>(), kernel * in, static_cast<int>(out), static_cast<int>(kernel * in), bias, false);
  Tensor y = torch::empty({x.size(0), frames, out}, x.options());
  for (std::int64_t b = 0; b < x.size(0); ++b)
    layer.forward(static_cast<int>(frames), {x.data_ptr<float>() + b * x.size(1) * in, in}, {y.data_ptr<float>() + b * frames * out, out});
  return y;
}

struct Convolution : torch::autograd::Function<Convolution> {
  static Tensor forward(torch::autograd::AutogradContext* context, const Tensor& x, const Tensor& weight, const Tensor& bias) {
    const std::int64_t kernel = weight.size(2);
    const Tensor rows = padded(x, kernel / 2);
    context->save_for_backward({rows, weight});
    context->saved_data["input"] = x.requires_grad();
    return products(rows, weight.permute({0, 2, 1}).contiguous().view({weight.size(0), -1}), bias.contiguous().data_ptr<float>(), kernel);
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context, const torch::autograd::variable_list& gradients) {
    const auto saved = context->get_saved_variables();
    const Tensor &rows = saved[0], &weight = saved[1], d = gradients[0].contiguous();
    const std::int64_t out = weight.size(0), in = weight.size(1), kernel = weight.size(2), frames = d.size(1);
    Tensor dw = torch::empty({out, kernel, in}, d.options());
    for (std::int64_t b = 0; b < d.size(0); ++b)
      weight_gradient<float>(static_cast<int>(frames), d.data_ptr<float>() + b * frames * out, out, static_cast<int>(out), rows.data_ptr<float>() + b * rows.size(1) * in, in, static_cast<int>(kernel * in),
                             dw.data_ptr<float>(), kernel * in, b == 0 ? Start::zero : Start::accumulate);
    Tensor dx;
    if (context->saved_data["input"].toBool()) dx = products(padded(d, kernel / 2), weight.flip(2).permute({1, 2, 0}).contiguous().view({in, -1}), nullptr, kernel);
    return {dx, dw.permute({0, 2, 1}), d.sum(at::IntArrayRef({0, 1}))};
  }
};

}  // namespace

Tensor convolution(const Tensor& x, const Tensor& weight, const Tensor& bias) { return Convolution::apply(x, weight, bias); }

}  // namespace mocap::nn
