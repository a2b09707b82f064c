#include "libmodels/nn/mlp.hpp"

#include <algorithm>
#include <cmath>

#include "libmodels/nn/pointwise.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

template <class T>
PackedMlp<T> packed(at::TensorList parameters, bool activate_last, std::size_t first, bool training) {
  PackedMlp<T> mlp;
  mlp.activate_last = activate_last;
  for (std::size_t i = 2 * first; i < parameters.size(); i += 2) {
    const Tensor w = parameters[i].contiguous(), b = parameters[i + 1].contiguous();
    mlp.layers.emplace_back().pack(w.data_ptr<T>(), w.size(1), static_cast<int>(w.size(0)), static_cast<int>(w.size(1)),
                                   b.data_ptr<T>(), training);
  }
  return mlp;
}

template <class T>
struct Kept {
  PackedMlp<T> mlp;
  Tensor x;
  std::vector<Tensor> y;
};

struct MlpFunction : torch::autograd::Function<MlpFunction> {
  static Tensor forward(AutogradContext* ctx, const Tensor& x, at::TensorList parameters, bool activate_last) {
    return x.scalar_type() == torch::kDouble ? run<double>(ctx, x, parameters, activate_last)
                                             : run<float>(ctx, x, parameters, activate_last);
  }

  template <class T>
  static Tensor run(AutogradContext* ctx, const Tensor& x, at::TensorList parameters, bool activate_last) {
    auto tape = c10::make_intrusive<Tape<Kept<T>>>();
    Kept<T>& k = tape->kept;
    k.mlp = packed<T>(parameters, activate_last, 0, true);
    k.x = x.detach().contiguous();
    k.y = layer_buffers(k.mlp, x.size(0));
    k.mlp.forward(static_cast<int>(x.size(0)), view<T>(k.x), views<T>(k.y));
    ctx->saved_data["tape"] = c10::IValue::make_capsule(tape);
    ctx->saved_data["double"] = std::is_same_v<T, double>;
    return k.y.back().variable_data();  // a handle of its own: the tape must not own the graph that owns it
  }

  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    return ctx->saved_data["double"].toBool() ? back<double>(ctx, grads[0]) : back<float>(ctx, grads[0]);
  }

  template <class T>
  static variable_list back(AutogradContext* ctx, const Tensor& dy) {
    const auto holder = ctx->saved_data["tape"].toCapsule();
    const Kept<T>& k = static_cast<const Tape<Kept<T>>&>(*holder).kept;
    const std::int64_t rows = k.x.size(0);
    std::vector<Tensor> d = layer_buffers(k.mlp, rows);
    d.back().copy_(dy);
    const Tensor dx = at::empty_like(k.x);
    k.mlp.backward(static_cast<int>(rows), views<T>(k.y), views<T>(d), view<T>(dx));
    variable_list out{dx};
    const std::size_t parameters = 2 * d.size();
    if (ctx->needs_input_grad({torch::autograd::IndexRange{1, 1 + parameters}}))
      append_layer_gradients<T>(rows, view<T>(k.x), k.y, d, k.x.size(1), out);
    else
      out.resize(1 + parameters);  // a network that is held fixed and only looked through
    out.emplace_back();
    return out;
  }
};

}  // namespace

Mlp::Mlp(const std::vector<int>& sizes, bool activate_last, Random& random) : activate_last_(activate_last) {
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
    const int in = sizes[i], out = sizes[i + 1];
    const bool activated = activate_last || i + 2 < sizes.size();
    auto layer = std::make_shared<torch::nn::Module>();
    const double deviation = activated ? std::sqrt(2.0 / in) : 0.5 / std::sqrt(static_cast<double>(in));
    weights_.push_back(layer->register_parameter("weight", normal_tensor({out, in}, random).mul_(deviation)));
    biases_.push_back(layer->register_parameter("bias", torch::zeros({out})));
    register_module(std::to_string(i), layer);
  }
}

std::vector<Tensor> Mlp::interleaved_parameters() const {
  std::vector<Tensor> all;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    all.push_back(weights_[i]);
    all.push_back(biases_[i]);
  }
  return all;
}

Tensor Mlp::forward(const Tensor& x) const {
  const std::vector<Tensor> parameters = interleaved_parameters();
  return MlpFunction::apply(x, at::TensorList(parameters), activate_last_);
}

template <class T>
PackedMlp<T> Mlp::pack(int first, bool training) const {
  return packed<T>(interleaved_parameters(), activate_last_, static_cast<std::size_t>(first), training);
}
template PackedMlp<float> Mlp::pack(int, bool) const;
template PackedMlp<double> Mlp::pack(int, bool) const;

std::string parameter_path(std::string name) {
  std::replace(name.begin(), name.end(), '.', '/');
  return name;
}

std::vector<std::pair<std::string, Tensor>> parameters_by_path(const torch::nn::Module& module) {
  std::vector<std::pair<std::string, Tensor>> all;
  for (const auto& item : module.named_parameters()) all.emplace_back(parameter_path(item.key()), item.value());
  return all;
}

Tensor normal_tensor(at::IntArrayRef sizes, Random& random) {
  Tensor t = torch::empty(sizes);
  float* values = t.data_ptr<float>();
  for (std::int64_t i = 0; i < t.numel(); ++i) values[i] = static_cast<float>(random.normal());
  return t;
}

Tensor uniform_tensor(at::IntArrayRef sizes, double bound, Random& random) {
  Tensor t = torch::empty(sizes);
  float* values = t.data_ptr<float>();
  for (std::int64_t i = 0; i < t.numel(); ++i) values[i] = static_cast<float>(random.uniform(-bound, bound));
  return t;
}

template <class T>
void append_layer_gradients(std::int64_t rows, View<const T> x, const std::vector<Tensor>& y,
                            const std::vector<Tensor>& d, std::int64_t in, std::vector<Tensor>& out) {
  for (std::size_t i = 0; i < d.size(); ++i) {
    const std::int64_t width = d[i].size(1);
    const Tensor dw = at::empty({width, in}, d[i].options()), db = at::empty({width}, d[i].options());
    const int r = static_cast<int>(rows), w = static_cast<int>(width);
    weight_gradient<T>(r, d[i].data_ptr<T>(), d[i].stride(0), w, x.data, x.ld, static_cast<int>(in), dw.data_ptr<T>(),
                       in);
    column_sum<T>(r, w, d[i].data_ptr<T>(), d[i].stride(0), db.data_ptr<T>());
    out.push_back(dw);
    out.push_back(db);
    x = view<T>(y[i]);
    in = width;
  }
}
template void append_layer_gradients(std::int64_t, View<const float>, const std::vector<Tensor>&,
                                     const std::vector<Tensor>&, std::int64_t, std::vector<Tensor>&);
template void append_layer_gradients(std::int64_t, View<const double>, const std::vector<Tensor>&,
                                     const std::vector<Tensor>&, std::int64_t, std::vector<Tensor>&);

}  // namespace mocap::nn
