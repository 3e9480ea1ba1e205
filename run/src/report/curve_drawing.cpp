#include "report/curve_drawing.h"

#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "consac/base/file.h"
#include "consac/base/memory.h"
#include "report/axis.h"
#include "system/system.h"

namespace consac::run {
namespace {

constexpr double kWidth = 800.0, kHeight = 450.0, kPngScale = 2.0;
constexpr double kLeft = 78.0, kRight = 776.0, kTop = 74.0, kBottom = 394.0;  // of the plot
// Pixels, both files and the system's fonts: 8 MiB where there are few fonts, and room for many. Asked for beforehand:
// the libraries that draw do not all say what they lacked.
constexpr std::size_t kDrawingBytes = std::size_t{32} << 20;
constexpr double kQuarterTurn = -1.5707963267948966;

struct Colour {
  double red, green, blue;
};
constexpr Colour kInk{0.13, 0.16, 0.20}, kFaint{0.42, 0.46, 0.52}, kGrid{0.90, 0.915, 0.93}, kPoint{0.66, 0.80, 0.94},
    kLine{0.05, 0.34, 0.68};

struct SurfaceFree {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct ContextFree {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceFree>;
using Context = std::unique_ptr<cairo_t, ContextFree>;

enum class Align { kStart, kCentre, kEnd };

struct TextStyle {
  double size = 12.0;
  Colour colour = kFaint;
  Align align = Align::kCentre;
  bool bold = false;
};

// One picture on one surface.
class Plot {
 public:
  Plot(cairo_t* context, const std::vector<CurvePoint>& points, double last_step) : context_(context), points_(points) {
    double low = 0.0, high = 1.0;
    if (!points.empty()) {
      const auto [smallest, largest] = std::minmax_element(
          points.begin(), points.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
      low = smallest->value;
      high = largest->value;
      last_step = std::max(last_step, points.back().step);
    }
    const double margin = 0.05 * (high - low);
    x_ = MakeAxis(0.0, std::max(last_step, 1.0), 8);
    y_ = MakeAxis(low - margin, high + margin, 6);
  }

  void Draw(const CurveLabels& labels) {
    SetColour({1.0, 1.0, 1.0});
    cairo_paint(context_);
    DrawAxes(labels);
    if (points_.empty()) Text("nothing to show yet", (kLeft + kRight) / 2, (kTop + kBottom) / 2, {14.0, kFaint});
    DrawPoints();
    DrawMean();
    Text(labels.title, kLeft, 32.0, {17.0, kInk, Align::kStart, true});
    Text(labels.subtitle, kLeft, 53.0, {12.5, kFaint, Align::kStart});
    if (!points_.empty()) DrawLegend(labels);
  }

 private:
  double X(double step) const { return kLeft + (step - x_.low) / (x_.high - x_.low) * (kRight - kLeft); }
  double Y(double value) const { return kBottom - (value - y_.low) / (y_.high - y_.low) * (kBottom - kTop); }
  void SetColour(const Colour& colour) { cairo_set_source_rgb(context_, colour.red, colour.green, colour.blue); }

  // Returns the text's width.
  double Text(const std::string& text, double x, double y, const TextStyle& style) {
    // No name: the system's own without serifs. Windows has no font "sans-serif".
    cairo_select_font_face(context_, "", CAIRO_FONT_SLANT_NORMAL,
                           style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(context_, style.size);
    cairo_text_extents_t extents;
    cairo_text_extents(context_, text.c_str(), &extents);
    const double shift = style.align == Align::kStart    ? 0.0
                         : style.align == Align::kCentre ? extents.x_advance / 2
                                                         : extents.x_advance;
    SetColour(style.colour);
    cairo_move_to(context_, x - shift, y);
    cairo_show_text(context_, text.c_str());
    return extents.x_advance;
  }

  void Segment(double x0, double y0, double x1, double y1, const Colour& colour, double width) {
    SetColour(colour);
    cairo_set_line_width(context_, width);
    cairo_move_to(context_, x0, y0);
    cairo_line_to(context_, x1, y1);
    cairo_stroke(context_);
  }

  void DrawAxes(const CurveLabels& labels) {
    for (const double tick : y_.ticks) {
      Segment(kLeft, Y(tick), kRight, Y(tick), kGrid, 1.0);
      Text(TickText(tick, y_), kLeft - 9.0, Y(tick) + 4.0, {.size = 12.0, .align = Align::kEnd});
    }
    for (const double tick : x_.ticks) {
      Segment(X(tick), kBottom, X(tick), kBottom + 5.0, kFaint, 1.0);
      Text(TickText(tick, x_), X(tick), kBottom + 20.0, {});
    }
    Segment(kLeft, kBottom, kRight, kBottom, kFaint, 1.0);
    Text("agent steps", (kLeft + kRight) / 2, kHeight - 16.0, {13.0, kInk});
    cairo_save(context_);
    cairo_translate(context_, 22.0, (kTop + kBottom) / 2);
    cairo_rotate(context_, kQuarterTurn);
    Text(labels.y_axis, 0.0, 0.0, {13.0, kInk});
    cairo_restore(context_);
  }

  // All dots in one path, as lines without length and with round ends: a small SVG.
  void DrawPoints() {
    SetColour(kPoint);
    cairo_set_line_cap(context_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_width(context_, points_.size() < 300 ? 4.0 : 2.6);
    for (const CurvePoint& point : points_) {
      cairo_move_to(context_, X(point.step), Y(point.value));
      cairo_close_path(context_);
    }
    cairo_stroke(context_);
  }

  // Of episodes that ended in the same step, the last one's mean counts for all.
  void DrawMean() {
    SetColour(kLine);
    cairo_set_line_join(context_, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(context_, 2.4);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (i + 1 < points_.size() && points_[i + 1].step == points_[i].step) continue;
      cairo_line_to(context_, X(points_[i].step), Y(points_[i].mean));
    }
    cairo_stroke(context_);
  }

  // From the right edge, on the line of the subtitle.
  void DrawLegend(const CurveLabels& labels) {
    const double y = 53.0;
    double x = kRight - Text(labels.mean, kRight, y, {.size = 12.0, .align = Align::kEnd});
    Segment(x - 30.0, y - 4.0, x - 8.0, y - 4.0, kLine, 2.4);
    x -= 46.0;
    x -= Text(labels.points, x, y, {.size = 12.0, .align = Align::kEnd});
    Segment(x - 9.0, y - 4.0, x - 9.0, y - 4.0, kPoint, 5.0);
  }

  cairo_t* context_;
  const std::vector<CurvePoint>& points_;
  Axis x_, y_;
};

cairo_status_t AppendBytes(void* bytes, const unsigned char* data, unsigned int count) {
  const auto* first = reinterpret_cast<const std::byte*>(data);
  static_cast<std::vector<std::byte>*>(bytes)->insert(static_cast<std::vector<std::byte>*>(bytes)->end(), first,
                                                      first + count);
  return CAIRO_STATUS_SUCCESS;
}

Status Save(const std::string& path, cairo_status_t drawn, const std::vector<std::byte>& bytes,
            const FolderCheck& may_write) {
  const bool shortage = drawn == CAIRO_STATUS_NO_MEMORY;
  if (drawn != CAIRO_STATUS_SUCCESS)
    return {shortage ? StatusCode::kResourceExhausted : StatusCode::kInternal,
            "cannot draw '" + path + "': " + cairo_status_to_string(drawn)};
  return WriteFileAtomically(path, bytes, may_write);
}

}  // namespace

Status DrawCurve(const std::string& path, const CurveLabels& labels, const std::vector<CurvePoint>& points,
                 const FolderCheck& may_write) {
  CONSAC_RETURN_IF_ERROR(CheckMemory(kDrawingBytes, "drawing '" + path + "'"));
  // fontconfig says there what it has not: a configuration, a folder for its cache. It draws all the same.
  const StandardErrorAside quiet;
  std::vector<std::byte> svg_bytes, png_bytes;
  const Surface svg(cairo_svg_surface_create_for_stream(AppendBytes, &svg_bytes, kWidth, kHeight));
  const Surface png(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kWidth * kPngScale),
                                               static_cast<int>(kHeight * kPngScale)));
  cairo_surface_set_device_scale(png.get(), kPngScale, kPngScale);
  for (const Surface* surface : {&svg, &png}) {
    const Context context(cairo_create(surface->get()));
    Plot(context.get(), points, labels.last_step).Draw(labels);
  }
  cairo_surface_finish(svg.get());
  CONSAC_RETURN_IF_ERROR(Save(path + ".svg", cairo_surface_status(svg.get()), svg_bytes, may_write));
  const cairo_status_t encoded = cairo_surface_write_to_png_stream(png.get(), AppendBytes, &png_bytes);
  return Save(path + ".png", encoded, png_bytes, may_write);
}

}  // namespace consac::run

// fontconfig keeps what it knows of fonts until the process ends and stores its pointers as offsets, which
// LeakSanitizer cannot follow: it would call them leaks of whoever drew a text.
#if defined(__has_feature)
#define CONSAC_HAS_ASAN __has_feature(address_sanitizer)
#elif defined(__SANITIZE_ADDRESS__)
#define CONSAC_HAS_ASAN 1
#else
#define CONSAC_HAS_ASAN 0
#endif
#if CONSAC_HAS_ASAN
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libfontconfig\n";
}
extern "C" const char* __lsan_default_options() {
  return "print_suppressions=0";
}
#endif
