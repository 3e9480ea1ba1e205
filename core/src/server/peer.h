#pragma once
// Whose fault it was: in lines of who may have several peers. Private to core/server.

#include <string>
#include <utility>

#include "consac/base/status.h"

namespace consac {

/// What somebody said that cannot be used, behind `who.peer()`, a transport's or a session's, where it does not begin
/// with that. Anything else as it is. For the last caller before people alone: behind an address protocol2::FaultName
/// finds no name any more. The status is made before this is called: what makes it may give a client another transport.
template <class Who>
Status NamingPeer(Status&& status, const Who& who) = delete;
template <class Who>
Status NamingPeer(const Status& status, const Who& who) {
  const bool said = status.code() == StatusCode::kProtocol || status.code() == StatusCode::kDataLoss ||
                    status.code() == StatusCode::kNonFinite;
  const std::string peer = who.peer();
  if (!said || status.message().starts_with(peer)) return status;
  return {status.code(), peer + ": " + status.message()};
}

}  // namespace consac
