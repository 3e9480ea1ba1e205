// Which protocol an engine speaks: a text engine sends its setup first, one of protocol 2 waits for HELLO.
#include "consac/server/env_client.h"

#include <array>

#include "server/clients.h"

namespace consac {
namespace {

constexpr double kTextWait = 0.1;  // s that a text engine has for its first bytes

}  // namespace

Result<std::unique_ptr<EnvClient>> EnvClient::Open(std::unique_ptr<Transport> transport,
                                                   const EnvClientOptions& options) {
  if (options.protocol == Protocol::kText1) return OpenTextClient(std::move(transport), options, {});
  if (options.protocol == Protocol::kAuto) {
    std::array<std::byte, 256> first;
    const Result<std::size_t> count = transport->Read(first, kTextWait);
    if (!count.ok()) return count.status();
    if (*count > 0) return OpenTextClient(std::move(transport), options, std::span(first).first(*count));
  }
  return OpenClient2(std::move(transport), options);
}

}  // namespace consac
