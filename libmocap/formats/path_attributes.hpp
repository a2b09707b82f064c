// Attributes that stand in a file's path: --attr-from-path, and the folders of AMASS.
#pragma once
#include <memory>
#include <string>

#include "libmocap/clip/clip.hpp"

namespace mocap::formats {

// A Perl-compatible regular expression (PCRE2) whose named groups are attributes: (?<subject>[^/]+)/(?<action>[a-z]+)_.
class PathAttributes {
 public:
  // Error(usage) where it does not compile (with the place) or has no named group.
  explicit PathAttributes(const std::string& regex);

  // The groups of the first match anywhere in `label`, otherwise in `path`, as attributes of those names, over what is
  // there; a group that took no part or matched nothing leaves its attribute alone. Whether it matched. Thread-safe.
  // Error(usage) where the match was given up (an expression that backtracks without end).
  bool apply(Attributes& attributes, const std::string& path, const std::string& label) const;

 private:
  struct Compiled;
  std::shared_ptr<const Compiled> compiled_;
};

// AMASS keeps DATASET/SUBJECT/NAME_poses.npz (SMPL+H) and DATASET/SUBJECT/NAME_stageii.npz (SMPL-X): `dataset` and `subject`
// from the last two folders of `label`, or of `path` as typed where the label has fewer. What is not there, and files of
// other names, stay without; attributes already set stay.
void amass_attributes(Attributes& attributes, const std::string& path, const std::string& label);

}  // namespace mocap::formats
