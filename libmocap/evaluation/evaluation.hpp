// The figures of one evaluation: generated against real clips, and perhaps training clips, as one report. A comparison of generators calls it once for each, with the same
// options and (sets.hpp) its own copies of the real and training sets; equal seeds draw the same halves and pairs of the real clips for each.
#pragma once
#include <cstdint>
#include <string>

#include "libmocap/evaluation/report.hpp"
#include "libmocap/evaluation/sets.hpp"
#include "libmocap/metrics/clip_figures.hpp"
#include "libmocap/metrics/frechet.hpp"

namespace mocap::evaluation {

struct Options {
  metrics::Compat compat = metrics::Compat::none;
  int repeats = 1;      // parts that the generated clips are dealt into, class by class; each is a repeat, and intervals are Student's t over them
  int resamples = 200;  // of the bootstrap, with one repeat; below 2: none
  int splits = 1;       // of the inception score
  std::uint64_t seed = 1;
  int threads = 1;      // no figure depends on it
  std::string by;       // attribute whose values each get rows of their own ("energy.walking"): figures of clips, and the variance within its classes
  bool each_view = true;  // the Frechet distance of each of several views beside that of all; off where features were reduced
  metrics::NeighbourOptions neighbours;  // its threads are those above
};

// Figures of features where the sets have features (FID, KID, precision and recall, diversity; by class, those within a class; of posteriors, IS and accuracy), and figures
// of clips where they have clips. Views of all sets are in the same order. What would give a figure that lies is refused (Error(data), with the set's file); a floor that
// takes more clips is NaN, with a warning; Options::by that is no view is refused (Error(usage)). Intervals of rows, at one repeat: the bootstrap over generated clips (FID, IS, figures of clips), the jackknife (KID and the figures of
// pairs, with Compat::none), Wilson's (shares); real clips are held fixed. KID is of features standardised by the real clips, as published with another compat.
// Report::compat stays "none": its name is the caller's to fill in.
Report evaluate(const Sets& sets, const Options& options);

}  // namespace mocap::evaluation
