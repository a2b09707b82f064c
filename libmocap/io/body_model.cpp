#include "libmocap/io/body_model.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/io/npy_header.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::io {
namespace {

constexpr std::size_t kMostShapes = 400;  // SMPL-X has 300 of the body and 100 of the face

const NpyArray& member(const Npz& npz, const std::string& name) {
  const auto it = npz.find(name);
  if (it == npz.end()) refuse({}, "no " + name + ", expected a body model with J_regressor, v_template and kintree_table");
  return it->second;
}

std::vector<double> finite(const NpyArray& a, const std::string& name) {
  const auto* d = std::get_if<std::vector<double>>(&a.data);
  if (!d) refuse({{}, 0, name}, "an array that is not of floats, expected metres and weights");
  for (const double v : *d)
    if (!std::isfinite(v)) refuse({{}, 0, name}, "a value that is not finite, expected finite numbers");
  return *d;
}

[[noreturn]] void wrong_shape(const NpyArray& a, const std::string& name, const std::string& expected) {
  refuse({{}, 0, name}, "shape " + shape_text(a.shape) + ", expected " + expected);
}

}  // namespace

BodyModel BodyModel::parse(std::string_view bytes) {
  const Npz npz = parse_npz(bytes, {"J_regressor", "v_template", "shapedirs", "kintree_table"});
  const NpyArray& regressor = member(npz, "J_regressor");
  if (regressor.shape.size() != 2 || regressor.shape[0] < kJoints) wrong_shape(regressor, "J_regressor", "(joints, vertices) with at least 22 joints");
  const std::size_t joints = regressor.shape[0], vertices = regressor.shape[1];
  const NpyArray& rest = member(npz, "v_template");
  if (rest.shape != std::vector{vertices, std::size_t{3}}) wrong_shape(rest, "v_template", fmt::format("({}, 3)", vertices));
  const NpyArray& tree = member(npz, "kintree_table");
  if (tree.shape != std::vector{std::size_t{2}, joints}) wrong_shape(tree, "kintree_table", fmt::format("(2, {})", joints));
  const auto* parents = std::get_if<std::vector<std::int64_t>>(&tree.data);
  if (!parents) refuse({{}, 0, "kintree_table"}, "an array that is not of whole numbers, expected joint numbers");
  const auto body = canonical_body();
  for (std::size_t j = 1; j < kJoints; ++j)  // of the root it holds -1 or 2^32 - 1
    if ((*parents)[j] != body->parents[j])
      refuse({{}, 0, "kintree_table"}, fmt::format("joint {} has the parent {}, expected {} as in SMPL's body", j, (*parents)[j], body->parents[j]));

  const auto r = finite(regressor, "J_regressor"), v = finite(rest, "v_template");
  BodyModel model;
  for (std::size_t j = 0; j < kJoints; ++j) {
    model.template_[j] = Vector3::Zero();
    for (std::size_t i = 0; i < vertices; ++i) model.template_[j] += r[j * vertices + i] * Vector3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
  }
  const auto it = npz.find("shapedirs");
  if (it == npz.end()) return model;
  const NpyArray& dirs = it->second;
  if (dirs.shape.size() != 3 || dirs.shape[0] != vertices || dirs.shape[1] != 3 || dirs.shape[2] > kMostShapes)
    wrong_shape(dirs, "shapedirs", fmt::format("({}, 3, shapes) with at most {} shapes", vertices, kMostShapes));
  const auto d = finite(dirs, "shapedirs");
  const std::size_t shapes = dirs.shape[2];
  model.shapes_.resize(shapes);
  for (auto& s : model.shapes_) s.fill(Vector3::Zero());
  for (std::size_t j = 0; j < kJoints; ++j)
    for (std::size_t i = 0; i < vertices; ++i) {
      const double weight = r[j * vertices + i];
      if (weight == 0) continue;  // nearly all are
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t b = 0; b < shapes; ++b) model.shapes_[b][j][static_cast<Eigen::Index>(axis)] += weight * d[(3 * i + axis) * shapes + b];
    }
  return model;
}

std::shared_ptr<const BodyModel> BodyModel::read(const std::string& path) {
  try {
    Digest digest{};
    const std::string bytes = read_file(path, std::size_t{1} << 36, &digest);
    auto model = std::make_shared<BodyModel>(parse(bytes));
    model->path_ = path;
    model->sha256_ = to_hex(digest);
    return model;
  } catch (const Error& e) {
    throw e.where().file.empty() ? e.in_file(path) : e;
  }
}

BodyModel::Joints BodyModel::joints(std::span<const double> betas) const {
  Joints out = template_;
  for (std::size_t b = 0; b < std::min(betas.size(), shapes_.size()); ++b)
    for (std::size_t j = 0; j < kJoints; ++j) out[j] += betas[b] * shapes_[b][j];
  return out;
}

std::shared_ptr<const Skeleton> skeleton_of(const BodyModel::Joints& joints) {
  const auto body = canonical_body();
  auto s = std::make_shared<Skeleton>();
  s->joint_names = body->joint_names;
  s->parents = body->parents;
  s->roles = body->roles;
  s->rest_offsets.assign(BodyModel::kJoints, Vector3::Zero());
  for (std::size_t j = 1; j < BodyModel::kJoints; ++j) {
    const Vector3 d = joints[j] - joints[static_cast<std::size_t>(s->parents[j])];
    s->rest_offsets[j] = Vector3(d.z(), d.x(), d.y());
  }
  s->validate();
  return s;
}

}  // namespace mocap::io
