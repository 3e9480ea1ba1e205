#pragma once
// Draws a learning curve as a picture: points as they came, light; their running mean, bold. Uses cairo, which draws
// SVG and PNG alike.

#include <string>
#include <vector>

#include "consac/base/file.h"
#include "consac/base/status.h"
#include "report/curve.h"

namespace consac::run {

/// What stands around a curve.
struct CurveLabels {
  double last_step = 1.0;  ///< where the axis of steps ends
  std::string title;       ///< large, above: "ppo2 on road-v0"
  std::string subtitle;    ///< below the title: what came of it
  std::string y_axis;      ///< "episode reward"
  std::string points;      ///< in the legend: what a point is
  std::string mean;        ///< in the legend: what the line is
};

/// Writes `path`.svg and `path`.png (1600 x 900 pixels), each as WriteFileAtomically does, which asks `may_write`.
/// Without points it draws empty axes that say so.
Status DrawCurve(const std::string& path, const CurveLabels& labels, const std::vector<CurvePoint>& points,
                 const FolderCheck& may_write);

}  // namespace consac::run
