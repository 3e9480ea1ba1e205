// The reader of requests to `consac twin view` on any bytes: what comes in pieces is read as what comes at once, and
// nothing is answered that does not name this machine.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "cli/http_server.cpp"  // the program is no library

namespace {

using namespace consac::cli;

constexpr int kPort = 8080;

void Require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const HttpReading whole = ReadHttpRequest(bytes, kPort);
  Require(!whole.complete || whole.error.status == 200);
  Require(whole.error.status == 200 || (whole.error.status >= 400 && whole.error.status < 500));
  if (!whole.complete) return 0;
  const HttpRequest& request = whole.request;
  Require(request.method == "GET" || request.method == "POST");
  Require(request.body.size() <= kMostBodyBytes && (request.method == "POST" || request.body.empty()));
  Require(bytes.find(":8080") != bytes.npos);
  std::size_t needed = size;  // a shorter beginning is not complete yet, or the same
  while (needed > 0 && ReadHttpRequest(bytes.substr(0, needed - 1), kPort).complete) --needed;
  const HttpReading least = ReadHttpRequest(bytes.substr(0, needed), kPort);
  Require(least.complete && least.request.body == request.body && least.request.path == request.path);
  return 0;
}
