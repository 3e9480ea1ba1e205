#include "looks.h"

#include <algorithm>
#include <cmath>

namespace consac::twin {

std::array<double, 3> LinearOf(const Colour& colour) {
  const auto linear = [](double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  };
  return {linear(colour[0]), linear(colour[1]), linear(colour[2])};
}

std::size_t Palette::Of(const Shape& shape, const MeshPart& part) {
  const bool own = !shape.has_colour && part.colour.has_value();
  const Colour colour = own ? *part.colour : shape.colour;
  const auto known =
      std::find_if(materials_.begin(), materials_.end(), [&](const Material& each) { return each.colour == colour; });
  const auto number = static_cast<std::size_t>(known - materials_.begin());
  if (known != materials_.end()) return number;
  const bool named = shape.has_colour && !shape.material.empty();
  materials_.push_back({named ? shape.material : "colour " + std::to_string(number + 1), colour});
  return number;
}

}  // namespace consac::twin
