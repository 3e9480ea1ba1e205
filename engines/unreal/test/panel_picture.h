#pragma once
// The Consac panel as a picture for its page: a drawing of the widgets that the plugin puts together, with their own
// words and lines. Fonts, colours and sizes are not the editor's.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "Rendering/DrawElements.h"
#include "Shim/Slate.h"

namespace consac::testing {

/// A tree of widgets as SVG.
class PanelPicture {
 public:
  /// `caption` says what the picture is, below it.
  static std::string Of(const SWidget& panel, const std::string& caption) {
    PanelPicture picture;
    const double below = picture.Draw(panel, kEdge, kEdge);
    picture.Write(caption, kEdge, below + kLine, "#8a8a8a");
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + Number(kWidth) + "\" height=\"" +
           Number(below + kLine + kEdge) + "\" font-family=\"Roboto, 'DejaVu Sans', sans-serif\" font-size=\"12\">\n" +
           "<title>" + Escaped(caption) + "</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#1f1f1f\"/>\n" +
           picture.svg_ + "</svg>\n";
  }

 private:
  static constexpr double kWidth = 640.0, kEdge = 12.0, kRoom = 8.0, kLine = 17.0, kButton = 24.0;
  static constexpr std::size_t kMostCharacters = 98;  // of a line that a text is wrapped to

  /// Draws a widget and what is in it; where it ends below.
  double Draw(const SWidget& widget, double x, double y) {
    if (widget.ShimIsButton()) return Button(widget.ShimText(), x, y);
    if (!widget.ShimText().empty()) return Words(widget.ShimText(), x, y);
    double below = y + Lines(widget, x, y);
    for (const TSharedRef<SWidget>& child : widget.shim_children_) {
      const double ends = Draw(*child, x, widget.shim_across_ ? y : below);
      if (widget.shim_across_) x += child->ComputeDesiredSize(1.0f).X + kRoom;
      const bool drew = ends > (widget.shim_across_ ? y : below);
      below = drew ? std::max(below, ends + (child->shim_children_.empty() ? kRoom : 0.0)) : below;
    }
    return below;
  }
  double Button(const std::string& text, double x, double y) {
    const double width = 16.0 + 7.0 * static_cast<double>(text.size());
    svg_ += "<rect x=\"" + Number(x) + "\" y=\"" + Number(y) + "\" width=\"" + Number(width) + "\" height=\"" +
            Number(kButton) + "\" rx=\"4\" fill=\"#383838\"/>\n";
    Write(text, x + 8.0, y + 16.0, "#e0e0e0");
    return y + kButton;
  }
  /// Wrapped between words.
  double Words(const std::string& text, double x, double y) {
    for (std::size_t begin = 0; begin <= text.size();) {
      std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::size_t space = end - begin > kMostCharacters ? text.rfind(' ', begin + kMostCharacters) : end;
      end = space != std::string::npos && space > begin ? space : end;  // a word that is longer stays whole
      Write(text.substr(begin, end - begin), x, y += kLine, "#c8c8c8");
      begin = end + 1;
    }
    return y + 4.0;
  }
  /// What it paints itself, in as much room as it asks for; how high that is.
  double Lines(const SWidget& widget, double x, double y) {
    if (!widget.shim_children_.empty()) return 0.0;
    const FVector2D size = widget.ComputeDesiredSize(1.0f);
    FSlateWindowElementList drawn;
    widget.OnPaint(FPaintArgs(), FGeometry{{size.X, size.Y}}, FSlateRect(), drawn, 0, FWidgetStyle(), true);
    for (const auto& line : drawn.shim_lines_) {
      svg_ += "<polyline fill=\"none\" stroke=\"" + Colour(line.colour) + "\" stroke-width=\"1.5\" points=\"";
      for (const FVector2f& point : line.points)
        svg_ += Number(x + static_cast<double>(point.X)) + "," + Number(y + static_cast<double>(point.Y)) + " ";
      svg_.back() = '"';
      svg_ += "/>\n";
    }
    return drawn.shim_lines_.empty() ? 0.0 : size.Y;
  }
  void Write(const std::string& text, double x, double y, const char* colour) {
    svg_ +=
        "<text x=\"" + Number(x) + "\" y=\"" + Number(y) + "\" fill=\"" + colour + "\">" + Escaped(text) + "</text>\n";
  }

  static std::string Number(double value) { return std::to_string(std::lround(value)); }
  /// Of light that adds up, as the screen shows it.
  static std::string Colour(const FLinearColor& colour) {
    const auto part = [](float light) { return static_cast<int>(std::lround(255.0f * std::pow(light, 1.0f / 2.2f))); };
    char text[8];
    std::snprintf(text, sizeof(text), "#%02x%02x%02x", part(colour.R) & 255, part(colour.G) & 255,
                  part(colour.B) & 255);
    return text;
  }
  static std::string Escaped(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
  }

  std::string svg_;
};

}  // namespace consac::testing
