// The server of `consac twin view` by itself: what no test of the program can bring about.
#include "cli/http_server.cpp"  // the program is no library

#include <gtest/gtest.h>

#include <chrono>

namespace consac::cli {
namespace {

int StatusOf(const std::string& host, int port) {
  const HttpReading reading = ReadHttpRequest("GET / HTTP/1.1\r\nHost: " + host + "\r\n\r\n", port);
  return reading.complete ? 200 : reading.error.status;
}

TEST(HttpServer, BrowsersLeaveOutPort80AndNoOther) {
  for (const char* host : {"127.0.0.1", "localhost", "127.0.0.1:80", "LocalHost:80"})
    EXPECT_EQ(StatusOf(host, 80), 200) << host;
  EXPECT_EQ(StatusOf("127.0.0.1:8080", 80), 403);
  EXPECT_EQ(StatusOf("evil.example", 80), 403);
  EXPECT_EQ(StatusOf("127.0.0.1", 8080), 403);
  const std::string page = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: http://";
  EXPECT_TRUE(ReadHttpRequest(page + "127.0.0.1\r\n\r\n", 80).complete);
  EXPECT_EQ(ReadHttpRequest(page + "evil.example\r\n\r\n", 80).error.status, 403);
}

TEST(HttpServer, WhoHasSaidAllStillTakesAllOfALongAnswer) {
  constexpr double kPatience = 30.0;                   // s
  const std::string body(std::size_t{32} << 20, 'x');  // more than the system holds on its way
  Result<HttpServer> server = HttpServer::Open(0, kPatience);
  ASSERT_TRUE(server.ok()) << server.status().message();
  const Endpoint here{"127.0.0.1", server->port()};
  const std::unique_ptr<Transport> peer = std::move(*ConnectTcp(here, kPatience));
  const std::string asked = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(here.port) + "\r\n\r\n";
  ASSERT_TRUE(peer->Write(std::as_bytes(std::span(asked)), kPatience).ok());
  peer->CloseWriting();
  const auto handler = [&](const HttpRequest&) {
    HttpResponse response;
    response.view = body;
    return response;
  };
  std::size_t came = 0;
  std::vector<std::byte> bytes(std::size_t{1} << 16);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience);
  while (std::chrono::steady_clock::now() < end) {
    ASSERT_TRUE(server->Poll(handler, 0.0).ok());
    const Result<std::size_t> read = peer->Read(bytes, 0.0);
    if (!read.ok()) break;
    came += *read;
  }
  EXPECT_GT(came, body.size()) << "the head and all of the body";
}

}  // namespace
}  // namespace consac::cli
