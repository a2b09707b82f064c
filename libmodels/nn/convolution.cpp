#include "libmodels/nn/convolution.hpp"

namespace mocap::nn {

using torch::Tensor;

template <class T>
void PackedConvolution<T>::pack(const Tensor& weight, const Tensor& bias, int stride_frames) {
  kernel = static_cast<int>(weight.size(2));
  stride = stride_frames;
  const Tensor matrix = weight.detach().permute({0, 2, 1}).contiguous(), start = bias.defined() ? bias.detach().contiguous() : bias;
  const auto in = static_cast<int>(weight.size(1)) * kernel;
  layer.pack(matrix.data_ptr<T>(), in, static_cast<int>(weight.size(0)), in, start.defined() ? start.data_ptr<T>() : nullptr, false);
}

template <class T>
void PackedConvolution<T>::forward(std::int64_t frames, const T* x, T* y) const {
  layer.forward(static_cast<int>(frames), {x, std::int64_t{stride} * (layer.in() / kernel)}, {y, layer.out()});
}

template struct PackedConvolution<float>;
template struct PackedConvolution<double>;

namespace {

Tensor padded(const Tensor& x, std::int64_t edge) {
  Tensor out = torch::zeros({x.size(0), x.size(1) + 2 * edge, x.size(2)}, x.options());
  out.narrow(1, edge, x.size(1)).copy_(x);
  return out;
}

// x with its edges -> (B, frames, O).
template <class T>
Tensor applied(const PackedConvolution<T>& convolution, const Tensor& x, std::int64_t frames) {
  Tensor y = torch::empty({x.size(0), frames, convolution.layer.out()}, x.options());
  for (std::int64_t b = 0; b < x.size(0); ++b) convolution.forward(frames, x.data_ptr<T>() + b * x.size(1) * x.size(2), y.data_ptr<T>() + b * frames * y.size(2));
  return y;
}

template <class T>
struct Convolution : torch::autograd::Function<Convolution<T>> {
  static Tensor forward(torch::autograd::AutogradContext* context, const Tensor& x, const Tensor& weight, const Tensor& bias, std::int64_t stride) {
    const Tensor rows = padded(x, weight.size(2) / 2);
    context->save_for_backward({rows, weight});
    context->saved_data["stride"] = stride;
    context->saved_data["input"] = x.requires_grad();
    context->saved_data["weight"] = weight.requires_grad();
    PackedConvolution<T> packed;
    packed.pack(weight, bias, static_cast<int>(stride));
    return applied(packed, rows, (x.size(1) + stride - 1) / stride);
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context, const torch::autograd::variable_list& gradients) {
    const auto saved = context->get_saved_variables();
    const Tensor &rows = saved[0], &weight = saved[1], d = gradients[0].contiguous();
    const std::int64_t out = weight.size(0), in = weight.size(1), kernel = weight.size(2), stride = context->saved_data["stride"].toInt(), frames = d.size(1), edge = kernel / 2;
    Tensor dx, dw;
    if (context->saved_data["weight"].toBool()) {
      dw = torch::empty({out, kernel, in}, d.options());
      for (std::int64_t b = 0; b < d.size(0); ++b)
        weight_gradient<T>(static_cast<int>(frames), d.data_ptr<T>() + b * frames * out, out, static_cast<int>(out), rows.data_ptr<T>() + b * rows.size(1) * in, stride * in, static_cast<int>(kernel * in),
                           dw.data_ptr<T>(), kernel * in, b == 0 ? Start::zero : Start::accumulate);
      dw = dw.permute({0, 2, 1});
    }
    if (context->saved_data["input"].toBool()) {
      // Every frame of x is seen through the kernel turned round, from the frames of y that saw it.
      Tensor seen = torch::zeros({d.size(0), rows.size(1), out}, d.options());
      seen.slice(1, edge, rows.size(1) - edge, stride).copy_(d);
      PackedConvolution<T> back;
      back.pack(weight.flip(2).transpose(0, 1), {});
      dx = applied(back, seen, rows.size(1) - 2 * edge);
    }
    return {dx, dw, d.sum(at::IntArrayRef({0, 1})), Tensor()};
  }
};

}  // namespace

Tensor convolution(const Tensor& x, const Tensor& weight, const Tensor& bias, int stride) {
  return x.scalar_type() == torch::kDouble ? Convolution<double>::apply(x, weight, bias, stride) : Convolution<float>::apply(x, weight, bias, stride);
}

}  // namespace mocap::nn
