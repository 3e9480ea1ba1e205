#pragma once
// Who has connected to an engine and has not been given a place, and how it is sent away. Private to core/server.

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "consac/base/hooks.h"
#include "consac/protocol/protocol2.h"
#include "consac/transport/transport.h"
#include "server/farewells.h"

namespace consac {

inline constexpr std::string_view kBusyLine =
    "busy: another trainer is connected to this engine; try again when it has left\n";
inline constexpr std::string_view kNoMemoryLine =
    "busy: this engine has no memory for a further trainer; try again later\n";

/// A connection that has not said enough yet.
struct Undecided {
  std::unique_ptr<Transport> transport;
  double since = 0.0;
  protocol2::FrameReader reader;
  std::optional<protocol2::Hello> hello = std::nullopt;  // that was good
  std::uint64_t request = 0;                             // in the header of its latest frame
  bool speaks_2 = false;                                 // a frame has come that is skipped
  bool looked_for_room = false;  // every session there is was asked whether its trainer has left

  /// 2: a HELLO; 1: something; 0: nothing.
  int said() const { return hello.has_value() ? 2 : speaks_2 || !reader.pending().empty() ? 1 : 0; }
};

/// A line, and the end.
inline void Dismiss(Undecided& one, std::string_view line) {
  (void)one.transport->Write(std::as_bytes(std::span(line)), 0.0);
  one.transport->Close();
}

/// An ERROR, and the end once it is read.
inline void DismissWithError(Undecided& one, const Status& why, Farewells& farewells) {
  const bool later = protocol2::FaultName(why) == "CAPACITY";
  const std::string json = protocol2::EncodeError(
      {std::string(protocol2::FaultName(why)), true, protocol2::FaultText(why), {}, later ? 1.0 : 0.0, -1});
  std::string frame(protocol2::kHeaderBytes, '\0');
  protocol2::WriteHeader(
      {protocol2::FrameType::kError, false, static_cast<std::uint32_t>(json.size()), 0, one.request, 0},
      reinterpret_cast<std::byte*>(frame.data()));
  frame += json;
  (void)one.transport->Write(std::as_bytes(std::span(frame)), 0.0);
  farewells.Add(std::move(one.transport));
}

}  // namespace consac
