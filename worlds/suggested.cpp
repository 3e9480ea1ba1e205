// Reads a world's suggestion text, "ppo2: key=value key=value; ppo: key=value".
#include "worlds/registry.h"

namespace consac::worlds {
namespace {

/// Cuts `text` at the first `separator`, returning what stood before it.
std::string_view TakeUntil(std::string_view& text, char separator) {
  const std::size_t end = text.find(separator);
  const std::string_view piece = text.substr(0, end);
  text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  return piece;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> SuggestedSettings(const World& world, std::string_view algorithm) {
  std::vector<std::pair<std::string, std::string>> settings;
  std::string_view text = world.suggested;
  while (!text.empty()) {
    std::string_view entry = TakeUntil(text, ';');
    std::string_view name = TakeUntil(entry, ':');
    while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
    if (name != algorithm) continue;
    while (!entry.empty()) {
      std::string_view value = TakeUntil(entry, ' ');
      if (value.empty()) continue;
      const std::string_view key = TakeUntil(value, '=');
      settings.emplace_back(key, value);
    }
  }
  return settings;
}

}  // namespace consac::worlds
