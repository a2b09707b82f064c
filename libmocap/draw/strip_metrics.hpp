// Sizes shared by the layout of a film strip and its drawing. Pixels unless said otherwise.
#pragma once

namespace mocap::draw {

inline constexpr double kMargin = 18;        // left and right of the page
inline constexpr double kHeader = 34;        // legend and scale bar
inline constexpr double kCaption = 24;       // above the figures of a row
inline constexpr double kContactMarks = 16;  // below the ground line
inline constexpr double kTimes = 18;
inline constexpr double kChart = 34;         // foot-fall chart
inline constexpr double kRowGap = 14;
inline constexpr double kInset = 150;        // side of the ground track
inline constexpr double kGap = 12;
inline constexpr double kFigureGap = 0.12;   // metres between figures

}  // namespace mocap::draw
