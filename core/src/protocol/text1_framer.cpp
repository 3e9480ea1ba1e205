// Cuts a byte stream into text protocol 1's messages, with terminators or without.
#include <algorithm>
#include <cstring>

#include "consac/protocol/text1.h"

namespace consac::text1 {
namespace {

constexpr std::size_t kFirstRoom = 16384;
constexpr std::size_t kLeastRoom = 4096;

bool IsTerminator(char c) {
  return c == '\n' || c == '\r';
}

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

Framer::Framer() : buffer_(kFirstRoom) {}

void Framer::SetExpect(Expect expect, bool single_character) {
  expect_ = expect;
  single_character_ = single_character;
  scanned_ = 0;
  hashes_ = 0;
}

std::span<std::byte> Framer::Writable() {
  if (begin_ == end_) begin_ = end_ = 0;
  if (buffer_.size() - end_ < kLeastRoom && begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (buffer_.size() - end_ < kLeastRoom && buffer_.size() <= kMaxMessage) buffer_.resize(buffer_.size() * 2);
  return std::as_writable_bytes(std::span(buffer_).subspan(end_));
}

Status Framer::Commit(std::size_t count) {
  end_ += count;
  if (end_ - begin_ <= kMaxMessage) return Status::Ok();
  return {StatusCode::kProtocol,
          "a message is longer than " + std::to_string(kMaxMessage) + " bytes; text protocol 1 sends one line"};
}

// What ends one message, or the newline that follows one which was complete without it.
void Framer::SkipTerminators() {
  if (scanned_ > 0) return;
  while (begin_ < end_ && IsTerminator(buffer_[begin_])) ++begin_;
}

std::string_view Framer::Take(std::size_t length) {
  const std::string_view message(buffer_.data() + begin_, length);
  begin_ += length;
  scanned_ = 0;
  hashes_ = 0;
  return message;
}

std::string_view Framer::Next() {
  SkipTerminators();
  const std::size_t pending_bytes = end_ - begin_;
  for (; scanned_ < pending_bytes; ++scanned_) {
    const char c = buffer_[begin_ + scanned_];
    if (IsTerminator(c)) return Take(scanned_);
    // `done` is exactly one character, so an observation is complete with the one behind its second '#'.
    if (expect_ == Expect::kObservation && hashes_ == 2) return Take(scanned_ + 1);
    if (c == '#') ++hashes_;
    // A digit is such an action; a sign, or whatever else begins a line, is not the whole of it.
    if (expect_ == Expect::kAction && single_character_ && scanned_ == 0 && IsDigit(c)) return Take(1);
  }
  return {};
}

std::string_view Framer::Quiet() {
  SkipTerminators();
  return Take(end_ - begin_);
}

std::string_view Framer::pending() const {
  return {buffer_.data() + begin_, end_ - begin_};
}

}  // namespace consac::text1
