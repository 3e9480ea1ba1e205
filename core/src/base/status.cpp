#include "consac/base/status.h"

#include "consac/base/names.h"

namespace consac {
namespace {

constexpr std::size_t kLongestMessage = 4096;  // bytes: a screen of text, not a flood

std::string CutMessage(std::string message) {
  if (message.size() <= kLongestMessage) return message;
  const std::string whole = std::to_string(message.size());
  message.resize(CutAtCharacter(message, kLongestMessage).size());
  return message + "... (" + whole + " bytes)";
}

}  // namespace

Status::Status(StatusCode code, std::string message)
    : code_(code), message_(PrintableLine(CutMessage(std::move(message)))) {}

}  // namespace consac
