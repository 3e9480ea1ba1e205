#include "cli/http_server.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <span>
#include <thread>

namespace consac::cli {
namespace {

constexpr double kLook = 0.002;  // s between looks at connections that are open
constexpr int kPortOfHttp = 80;  // where an address names none

// What a browser may do with the page: run its own scripts, ask this server, nothing else, and in no frame.
constexpr std::string_view kPageRules =
    "Cache-Control: no-store\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src "
    "'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Connection: close\r\n\r\n";

std::string_view ReasonOf(int status) {
  constexpr std::pair<int, std::string_view> kReasons[] = {
      {200, "OK"},          {400, "Bad Request"},       {403, "Forbidden"},         {404, "Not Found"},
      {405, "Not Allowed"}, {413, "Content Too Large"}, {415, "Unsupported Media"}, {431, "Headers Too Large"}};
  for (const auto& [code, reason] : kReasons) {
    if (code == status) return reason;
  }
  return "Error";
}

bool SameWord(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

std::string_view WithoutBlanks(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

// The headers that count; each may come once.
struct HttpHeaders {
  std::optional<std::string_view> host, origin, type, length, site, encoding;
};

// False where a line is no header, or one that counts comes twice.
bool ReadHttpHeaders(std::string_view lines, HttpHeaders* headers) {
  const std::pair<std::string_view, std::optional<std::string_view>*> known[] = {
      {"Host", &headers->host},           {"Origin", &headers->origin},
      {"Content-Type", &headers->type},   {"Content-Length", &headers->length},
      {"Sec-Fetch-Site", &headers->site}, {"Transfer-Encoding", &headers->encoding}};
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find("\r\n"), lines.size());
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 2, lines.size()));
    const std::size_t colon = line.find(':');
    if (colon == 0 || colon == std::string_view::npos) return false;
    const std::string_view name = line.substr(0, colon);
    if (name.find_first_of(" \t") != std::string_view::npos) return false;  // a folded line, or one that hides another
    for (const auto& [of, value] : known) {
      if (!SameWord(of, name)) continue;
      if (value->has_value()) return false;
      *value = WithoutBlanks(line.substr(colon + 1));
    }
  }
  return true;
}

bool IsOurs(std::string_view host, int port) {
  const std::string number = ":" + std::to_string(port);
  for (const std::string_view name : {"127.0.0.1", "localhost"}) {
    if (SameWord(host, std::string(name) + number)) return true;
    if (port == kPortOfHttp && SameWord(host, name)) return true;  // browsers leave it out
  }
  return false;
}

HttpReading Refused(int status, std::string_view line) {
  HttpReading reading;
  reading.error = HttpResponse::Error(status, line);
  return reading;
}

}  // namespace

HttpResponse HttpResponse::Error(int status, std::string_view line) {
  HttpResponse response;
  response.status = status;
  response.type = "text/plain; charset=utf-8";
  response.text = std::string(line) + "\n";
  return response;
}

HttpReading ReadHttpRequest(std::string_view bytes, int port) {
  const std::size_t head = bytes.find("\r\n\r\n");
  if (head == std::string_view::npos || head > kMostHeadBytes) {
    if (bytes.size() > kMostHeadBytes) return Refused(431, "the headers are too long");
    const std::string_view begin = bytes.substr(0, 1);
    if (!begin.empty() && begin != "G" && begin != "P") return Refused(405, "GET and POST are answered");
    return {};
  }
  if (bytes.substr(0, head).find('\0') != std::string_view::npos) return Refused(400, "this is no HTTP");
  const std::size_t line_end = bytes.find("\r\n");
  const std::string_view line = bytes.substr(0, line_end);
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  const std::string_view version = last == std::string_view::npos ? "" : line.substr(last + 1);
  if (first == std::string_view::npos || first == last || (version != "HTTP/1.1" && version != "HTTP/1.0"))
    return Refused(400, "this is no HTTP/1.1");
  HttpReading reading;
  reading.request.method = line.substr(0, first);
  reading.request.path = line.substr(first + 1, last - first - 1);
  if (reading.request.method != "GET" && reading.request.method != "POST")
    return Refused(405, "GET and POST are answered");
  HttpHeaders headers;
  const std::string_view lines = line_end == head ? "" : bytes.substr(line_end + 2, head - line_end - 2);
  if (!ReadHttpHeaders(lines, &headers)) return Refused(400, "a header is none, or comes twice");
  // A name that was made to lead here (DNS rebinding) is no name of ours, and another site's page tells its own.
  if (!headers.host.has_value() || !IsOurs(*headers.host, port))
    return Refused(403, "this page is at 127.0.0.1 and at no other name");
  constexpr std::string_view kScheme = "http://";
  if (headers.origin.has_value() &&
      !(headers.origin->starts_with(kScheme) && IsOurs(headers.origin->substr(kScheme.size()), port)))
    return Refused(403, "another site's page is not answered");
  if (headers.site.has_value() && *headers.site != "same-origin" && *headers.site != "none")
    return Refused(403, "another site's page is not answered");
  if (headers.encoding.has_value()) return Refused(400, "Transfer-Encoding is not read; say Content-Length");
  std::size_t length = 0;
  if (headers.length.has_value()) {
    const char* end = headers.length->data() + headers.length->size();
    const auto [at, error] = std::from_chars(headers.length->data(), end, length);
    if (error == std::errc::result_out_of_range)
      length = kMostBodyBytes + 1;
    else if (error != std::errc() || at != end)
      return Refused(400, "Content-Length is no number");
  }
  if (length > kMostBodyBytes) return Refused(413, "the body is too long");
  if (reading.request.method == "GET" && length > 0) return Refused(400, "a GET has no body");
  // Another site's page cannot send this type without asking first, and nobody answers that question.
  if (reading.request.method == "POST" &&
      !(headers.type.has_value() && SameWord(headers.type->substr(0, headers.type->find(';')), "application/json")))
    return Refused(415, "Content-Type: application/json is expected");
  if (bytes.size() < head + 4 + length) return {};
  reading.request.body = bytes.substr(head + 4, length);
  reading.complete = true;
  return reading;
}

Result<HttpServer> HttpServer::Open(int port, double budget_s) {
  Result<std::unique_ptr<Listener>> listener = ListenTcp({"127.0.0.1", port});
  if (!listener.ok()) return listener.status();
  HttpServer server;
  server.listener_ = std::move(*listener);
  server.port_ = server.listener_->port();
  server.budget_s_ = budget_s;
  return server;
}

bool HttpServer::Send(Connection& connection, bool* busy) {
  const HttpResponse& answer = connection.answer;
  const std::string_view body = answer.text.empty() ? answer.view : std::string_view(answer.text);
  while (connection.sent < connection.head.size() + body.size()) {
    const bool in_head = connection.sent < connection.head.size();
    const std::string_view rest = in_head ? std::string_view(connection.head).substr(connection.sent)
                                          : body.substr(connection.sent - connection.head.size());
    const Result<std::size_t> sent =
        connection.transport->WriteSome(std::as_bytes(std::span<const char>(rest.data(), rest.size())), 0.0);
    if (!sent.ok()) return false;
    if (*sent == 0) return true;
    connection.sent += *sent;
    *busy = true;
  }
  // What the peer still sends is read until it has the answer and goes: a reset would take the answer from it.
  if (!connection.told) connection.transport->CloseWriting();
  connection.told = true;
  return true;
}

// One connection's turn; false where it is over.
bool HttpServer::Go(Connection& connection, const Handler& handler, bool* busy) {
  std::array<std::byte, 4096> bytes;
  const bool answered = !connection.head.empty();
  if (!connection.heard) {
    const Result<std::size_t> read = connection.transport->Read(bytes, 0.0);
    if (!read.ok() && !answered) return false;
    connection.heard = !read.ok();  // a peer that has said all may still take its answer
    const std::size_t count = read.ok() ? *read : 0;
    *busy = *busy || count > 0;
    if (!answered && count == 0) return true;
    if (!answered) connection.in.append(reinterpret_cast<const char*>(bytes.data()), count);
  }
  if (!answered) {
    HttpReading reading = ReadHttpRequest(connection.in, port_);
    if (!reading.complete && reading.error.status == 200) return true;
    connection.answer = reading.complete ? handler(reading.request) : std::move(reading.error);
    const HttpResponse& answer = connection.answer;
    const std::size_t length = answer.text.empty() ? answer.view.size() : answer.text.size();
    connection.head = "HTTP/1.1 " + std::to_string(answer.status) + " " + std::string(ReasonOf(answer.status)) +
                      "\r\nContent-Type: " + std::string(answer.type) +
                      "\r\nContent-Length: " + std::to_string(length) + "\r\n" + std::string(kPageRules);
    connection.in.clear();
  }
  return Send(connection, busy) && !(connection.heard && connection.told);
}

Status HttpServer::Poll(const Handler& handler, double wait_s) {
  bool busy = false;
  for (auto each = connections_.begin(); each != connections_.end();) {
    const bool goes_on = Clock::now() < each->end && Go(*each, handler, &busy);
    each = goes_on ? std::next(each) : connections_.erase(each);
  }
  const double wait = busy ? 0.0 : connections_.empty() ? wait_s : std::min(wait_s, kLook);
  if (connections_.size() >= kMostConnections) {  // the next waits until one ends, at the latest when its budget does
    std::this_thread::sleep_for(std::chrono::duration<double>(wait));
    return {};
  }
  Result<std::unique_ptr<Transport>> accepted = listener_->Accept(wait);
  if (!accepted.ok()) {  // at once; the next look is not before its time
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(wait_s, kLook)));
    return accepted.status();
  }
  if (*accepted == nullptr) return {};
  const auto budget = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(budget_s_));
  connections_.push_back({std::move(*accepted), Clock::now() + budget, {}, {}, {}, 0, false, false});
  return {};
}

}  // namespace consac::cli
