#include "libmocap/skeleton/skeleton.hpp"

#include <algorithm>
#include <set>

#include "libmocap/base/error.hpp"

namespace mocap {

int Skeleton::find(std::string_view name) const {
  const auto it = std::find(joint_names.begin(), joint_names.end(), name);
  return it == joint_names.end() ? -1 : static_cast<int>(it - joint_names.begin());
}

int Skeleton::find_role(std::string_view role) const {
  const auto it = roles.find(std::string(role));
  return it == roles.end() ? -1 : find(it->second);
}

std::vector<std::vector<int>> Skeleton::children() const {
  std::vector<std::vector<int>> out(parents.size());
  for (int j = 0; j < joint_count(); ++j)
    if (parents[static_cast<std::size_t>(j)] >= 0) out[static_cast<std::size_t>(parents[static_cast<std::size_t>(j)])].push_back(j);
  return out;
}

void Skeleton::validate(const std::string& file) const {
  const auto fail = [&](const std::string& object, const std::string& what) { refuse({file, 0, object}, what); };
  const std::size_t n = parents.size();
  if (n == 0) fail("skeleton", "no joints, expected at least one");
  if (joint_names.size() != n || rest_offsets.size() != n)
    fail("skeleton", std::to_string(joint_names.size()) + " names, " + std::to_string(n) + " parents and " +
                         std::to_string(rest_offsets.size()) + " offsets, expected equal numbers");
  std::set<std::string_view> seen;
  for (std::size_t j = 0; j < n; ++j) {
    if (joint_names[j].empty()) fail("joint " + std::to_string(j), "an empty name");
    if (!seen.insert(joint_names[j]).second) fail("joint " + joint_names[j], "the name occurs twice, expected unique names");
    if (j == 0 ? parents[j] != -1 : (parents[j] < 0 || parents[j] >= static_cast<int>(j)))
      fail("joint " + joint_names[j], "parent " + std::to_string(parents[j]) + ", expected " + (j == 0 ? "-1" : "a joint before it"));
    if (!rest_offsets[j].allFinite()) fail("joint " + joint_names[j], "an offset that is not finite");
  }
  for (const EndSite& e : end_sites)
    if (e.parent < 0 || e.parent >= static_cast<int>(n) || !e.offset.allFinite()) fail("end site", "a parent or offset out of range");
  for (const auto& [role, joint] : roles)
    if (find(joint) < 0) fail("role " + role, "joint " + joint + " does not exist");
}

bool Skeleton::same_as(const Skeleton& o, double tolerance) const {
  if (joint_names != o.joint_names || parents != o.parents || end_sites.size() != o.end_sites.size()) return false;
  for (std::size_t j = 0; j < parents.size(); ++j)
    if ((rest_offsets[j] - o.rest_offsets[j]).norm() > tolerance) return false;
  for (std::size_t e = 0; e < end_sites.size(); ++e)
    if (end_sites[e].parent != o.end_sites[e].parent || (end_sites[e].offset - o.end_sites[e].offset).norm() > tolerance) return false;
  return true;
}

std::vector<Vector3> rest_positions(const Skeleton& s) {
  std::vector<Vector3> p(s.parents.size(), Vector3::Zero());
  for (std::size_t j = 1; j < p.size(); ++j) p[j] = p[static_cast<std::size_t>(s.parents[j])] + s.rest_offsets[j];
  return p;
}

std::vector<double> impact_factors(const Skeleton& s, double floor) {
  std::vector<double> alpha(s.parents.size(), 0.0);
  for (const auto& e : s.end_sites) {
    double& a = alpha[static_cast<std::size_t>(e.parent)];
    a = std::max(a, e.offset.norm());
  }
  for (std::size_t j = alpha.size(); j-- > 1;) {
    double& a = alpha[static_cast<std::size_t>(s.parents[j])];
    a = std::max(a, alpha[j] + s.rest_offsets[j].norm());
  }
  for (double& a : alpha) a = std::max(a, floor);
  return alpha;
}

}  // namespace mocap
