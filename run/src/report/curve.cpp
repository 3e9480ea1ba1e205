#include "report/curve.h"

#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace consac::run {
namespace {

constexpr double kWidth = 800, kHeight = 450;                                    // px
constexpr double kLeft = 80, kRight = 24, kTop = 44, kBottom = 56;               // px around the plot

/// Colours as red, green, blue in [0, 1].
struct Colour {
  double red, green, blue, alpha;
};
constexpr Colour kInk{0.13, 0.16, 0.20, 1}, kGrid{0.87, 0.89, 0.91, 1}, kLight{0.20, 0.47, 0.75, 0.25}, kBold{0.11, 0.35, 0.66, 1};

struct SurfaceFree {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct ContextFree {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceFree>;
using Context = std::unique_ptr<cairo_t, ContextFree>;

/// A range of numbers with round ticks.
struct Axis {
  double low, high, step;
  Axis(double smallest, double largest) {
    if (largest - smallest < 1e-9) {
      largest += 0.5;
      smallest -= 0.5;
    }
    const double rough = (largest - smallest) / 5.0, power = std::pow(10.0, std::floor(std::log10(rough)));
    step = power * (rough / power < 1.5 ? 1 : rough / power < 3.5 ? 2 : rough / power < 7.5 ? 5 : 10);
    low = std::floor(smallest / step) * step;
    high = std::ceil(largest / step) * step;
  }
};

std::string TickText(double value) {
  if (std::fabs(value) >= 1e6) return fmt::format("{:g}M", value / 1e6);
  if (std::fabs(value) >= 1e4) return fmt::format("{:g}k", value / 1e3);
  return fmt::format("{:g}", std::fabs(value) < 1e-12 ? 0.0 : value);
}

class Plot {
 public:
  Plot(cairo_t* context, Axis x, Axis y) : context_(context), x_(x), y_(y) {}

  void Draw(const CurveLabels& labels, const std::vector<std::pair<double, double>>& points) {
    cairo_set_source_rgb(context_, 1, 1, 1);
    cairo_paint(context_);
    cairo_select_font_face(context_, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    DrawTicks();
    DrawLine(points, kLight, 1.2);
    DrawLine(MovingMean(points), kBold, 2.4);
    DrawText(labels.title, kWidth / 2, 26, 16);
    DrawText("agent steps", (kLeft + kWidth - kRight) / 2, kHeight - 14, 13);
    cairo_save(context_);
    cairo_translate(context_, 20, (kTop + kHeight - kBottom) / 2);
    cairo_rotate(context_, -1.5707963);
    DrawText(labels.y_axis, 0, 0, 13);
    cairo_restore(context_);
  }

 private:
  double X(double value) const { return kLeft + (value - x_.low) / (x_.high - x_.low) * (kWidth - kLeft - kRight); }
  double Y(double value) const { return kHeight - kBottom - (value - y_.low) / (y_.high - y_.low) * (kHeight - kTop - kBottom); }

  void SetColour(const Colour& colour) { cairo_set_source_rgba(context_, colour.red, colour.green, colour.blue, colour.alpha); }

  void DrawText(const std::string& text, double x, double y, double size) {
    cairo_text_extents_t extents;
    cairo_set_font_size(context_, size);
    cairo_text_extents(context_, text.c_str(), &extents);
    SetColour(kInk);
    cairo_move_to(context_, x - extents.width / 2, y);
    cairo_show_text(context_, text.c_str());
  }

  void DrawTicks() {
    cairo_set_line_width(context_, 1);
    for (double value = x_.low; value <= x_.high + x_.step / 2; value += x_.step) {
      GridLine(X(value), kTop, X(value), kHeight - kBottom);
      DrawText(TickText(value), X(value), kHeight - kBottom + 20, 12);
    }
    for (double value = y_.low; value <= y_.high + y_.step / 2; value += y_.step) {
      GridLine(kLeft, Y(value), kWidth - kRight, Y(value));
      DrawText(TickText(value), kLeft - 28, Y(value) + 4, 12);
    }
  }

  void GridLine(double x0, double y0, double x1, double y1) {
    SetColour(kGrid);
    cairo_move_to(context_, x0, y0);
    cairo_line_to(context_, x1, y1);
    cairo_stroke(context_);
  }

  void DrawLine(const std::vector<std::pair<double, double>>& points, const Colour& colour, double width) {
    SetColour(colour);
    cairo_set_line_width(context_, width);
    cairo_set_line_join(context_, CAIRO_LINE_JOIN_ROUND);
    for (const auto& [x, y] : points) cairo_line_to(context_, X(x), Y(y));
    cairo_stroke(context_);
  }

  // Over a twentieth of the curve, looking back only, as the mean of the last episodes does.
  static std::vector<std::pair<double, double>> MovingMean(const std::vector<std::pair<double, double>>& points) {
    const std::size_t window = std::max<std::size_t>(1, points.size() / 20);
    std::vector<std::pair<double, double>> means;
    double sum = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += points[i].second - (i >= window ? points[i - window].second : 0.0);
      means.emplace_back(points[i].first, sum / static_cast<double>(std::min(i + 1, window)));
    }
    return means;
  }

  cairo_t* context_;
  Axis x_, y_;
};

}  // namespace

CurvePoints::CurvePoints(std::size_t pieces) : sums_(pieces), weights_(pieces) {}

void CurvePoints::Add(std::int64_t step, double sum, double weight) {
  const std::size_t pieces = sums_.size();
  while (step / width_ >= static_cast<std::int64_t>(pieces)) {
    for (std::size_t i = 0; i < pieces / 2; ++i) {
      sums_[i] = sums_[2 * i] + sums_[2 * i + 1];
      weights_[i] = weights_[2 * i] + weights_[2 * i + 1];
    }
    std::fill(sums_.begin() + static_cast<std::ptrdiff_t>(pieces / 2), sums_.end(), 0.0);
    std::fill(weights_.begin() + static_cast<std::ptrdiff_t>(pieces / 2), weights_.end(), 0.0);
    width_ *= 2;
  }
  const auto piece = static_cast<std::size_t>(step / width_);
  sums_[piece] += sum;
  weights_[piece] += weight;
}

std::vector<std::pair<double, double>> CurvePoints::Points() const {
  std::vector<std::pair<double, double>> points;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    if (weights_[i] > 0.0) points.emplace_back((static_cast<double>(i) + 0.5) * static_cast<double>(width_), sums_[i] / weights_[i]);
  }
  return points;
}

void CurvePoints::Visit(Archive& archive) {
  archive("width", width_);
  archive("sums", std::span<double>(sums_));
  archive("weights", std::span<double>(weights_));
}

Status DrawCurve(const std::string& path, const CurveLabels& labels, const std::vector<std::pair<double, double>>& points) {
  if (points.empty()) return Status::Ok();
  double low = points[0].second, high = low;
  for (const auto& point : points) {
    low = std::min(low, point.second);
    high = std::max(high, point.second);
  }
  const Axis x(0.0, points.back().first), y(low, high);
  const Surface svg(cairo_svg_surface_create((path + ".svg").c_str(), kWidth, kHeight));
  const Surface png(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kWidth), static_cast<int>(kHeight)));
  for (const Surface* surface : {&svg, &png}) {
    const Context context(cairo_create(surface->get()));
    Plot(context.get(), x, y).Draw(labels, points);
  }
  cairo_surface_finish(svg.get());
  const cairo_status_t svg_status = cairo_surface_status(svg.get());
  const cairo_status_t png_status = cairo_surface_write_to_png(png.get(), (path + ".png").c_str());
  if (svg_status == CAIRO_STATUS_SUCCESS && png_status == CAIRO_STATUS_SUCCESS) return Status::Ok();
  return {StatusCode::kResourceExhausted, "cannot draw '" + path + "': " + cairo_status_to_string(svg_status != CAIRO_STATUS_SUCCESS ? svg_status : png_status)};
}

}  // namespace consac::run
