#include "consac/base/text.h"
#include "consac/transport/transport.h"

namespace consac {

Result<Endpoint> Endpoint::Parse(std::string_view url) {
  constexpr std::string_view kScheme = "tcp://";
  std::string_view text = url;
  if (text.starts_with(kScheme)) text.remove_prefix(kScheme.size());
  const std::size_t colon = text.rfind(':');
  std::int64_t port = 0;
  if (colon == std::string_view::npos || colon == 0 || text.find('/') != std::string_view::npos ||
      !ParseNumber(text.substr(colon + 1), &port) || port < 0 || port > 65535) {
    return Status{StatusCode::kInvalidArgument,
                  Quote(url) + " is no endpoint; expected tcp://host:port with a port from 0 to 65535"};
  }
  Endpoint endpoint;
  std::string_view host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);  // of IPv6
  endpoint.host = host;
  endpoint.port = static_cast<int>(port);
  return endpoint;
}

}  // namespace consac
