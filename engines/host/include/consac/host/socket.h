#pragma once
// The thesis' socket: for whoever sends and receives the messages of text protocol 1 by hand, node by node. Every call
// in any order is safe; what does not fit the moment is an error that says why.

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/protocol/text1.h"
#include "consac/transport/outbox.h"
#include "consac/transport/transport.h"

namespace consac::host {

/// A port and the one connection that was accepted on it. Nothing waits. One thread.
class Socket {
 public:
  /// Opens the port. kFailedPrecondition when it is open already, kAlreadyExists when somebody else has it.
  Status Open(const Endpoint& endpoint);
  /// Closes connection and port; closing a closed socket does nothing.
  void Close();
  /// Whether the port is open.
  bool open() const { return listener_ != nullptr; }
  /// The open port; 0 when closed.
  int port() const { return listener_ != nullptr ? listener_->port() : 0; }

  /// True when somebody waits to be accepted, or is connected.
  Result<bool> CheckConnection();
  /// Takes the one who waits. kFailedPrecondition when nobody does, or somebody is connected already.
  Status AcceptConnection();
  /// Whether somebody is connected.
  bool connected() const { return transport_ != nullptr; }
  /// "127.0.0.1:40312"; "" when nobody is connected.
  std::string peer() const { return transport_ != nullptr ? transport_->peer() : std::string(); }

  /// True when a whole message is there; sends on what the other end had not taken yet. kUnavailable once the other end
  /// has left, kDeadlineExceeded when it takes nothing for 10 s; the connection is then closed.
  Result<bool> CheckPendingData();
  /// Takes the message, without its terminator. kFailedPrecondition when none is there.
  Result<std::string> AcceptPendingData();
  /// Sends a message and its terminator; what is not taken at once waits for CheckPendingData. kFailedPrecondition when
  /// nobody is connected, kResourceExhausted when 1 MiB waits already: the message is then not sent.
  Status SendData(std::string_view message);
  /// Ends the connection; the port stays open.
  void CloseConnection();

 private:
  std::unique_ptr<Listener> listener_;
  std::unique_ptr<Transport> waiting_, transport_;
  text1::Framer framer_;
  Outbox outbox_;
  std::string message_;
  double last_byte_ = 0.0;
};

/// "D#3#0#B#2#0,0,40,40#20000": the first message of a session (the thesis' Compile Training Data).
Result<std::string> CompileTrainingData(const text1::Setup& setup);
/// "3,17#1#0": what an agent sees, its reward, whether its episode ended (the thesis' Compile Environment Message).
/// The error names what does not fit the space.
Result<std::string> CompileEnvironmentMessage(const Space& observation_space, std::span<const double> observation,
                                              double reward, bool done);
/// "1" or "0.25,-0.7" as numbers: one for a discrete action (the thesis' Decode Action).
Result<std::vector<double>> DecodeAction(const Space& action_space, std::string_view message);

}  // namespace consac::host
