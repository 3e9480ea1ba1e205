// The engine's end of protocol 2. One request at a time: each is carried out once, its answer kept until the next, so
// that a trainer whose connection broke may ask again.
#if defined(_WIN32)
#include <random>
#else
#include <unistd.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/env/buffer.h"
#include "consac/protocol/protocol2.h"
#include "server/limits.h"
#include "server/session.h"
#include "server/shared_channel.h"

namespace consac {
namespace {

using protocol2::Autoreset;
using protocol2::Blocks;
using protocol2::Fault;
using protocol2::Frame;
using protocol2::FrameHeader;
using protocol2::FrameType;

constexpr std::size_t kLargestPing = 64;
constexpr unsigned kSharedLooks = 16;  // polls in vain between such looks

/// Equal texts, in a time that does not tell where they differ.
bool SameSecret(std::string_view a, std::string_view b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference = static_cast<unsigned char>(difference | (a[i] ^ (i < b.size() ? b[i] : '\0')));
  }
  return difference == 0;
}

/// 128 bits that nobody can guess, in hex: what a session is taken up with.
std::string MakeToken() {
  static constexpr char kHex[] = "0123456789abcdef";
  unsigned char bytes[16] = {};
#if defined(_WIN32)
  std::random_device device;
  for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(device());
#else
  (void)!getentropy(bytes, sizeof(bytes));
#endif
  std::string token;
  for (const unsigned char byte : bytes) {
    token += kHex[byte >> 4];
    token += kHex[byte & 15];
  }
  return token;
}

/// Rows of 8-byte words, so that what lies in it is aligned.
class AlignedBytes {
 public:
  void Resize(std::size_t bytes) { words_.assign((bytes + 7) / 8, 0); }
  std::byte* data() { return reinterpret_cast<std::byte*>(words_.data()); }

 private:
  std::vector<std::uint64_t> words_;
};

class Session2Server final : public Session2 {
 public:
  explicit Session2Server(const SessionHost& host)
      : env_(host.env), spec_(host.env.spec()), options_(host.options), steps_(host.steps), blocks_(spec_) {
    const std::size_t header = protocol2::kHeaderBytes;
    result_.Resize(header + blocks_.largest_result);
    actions_.Resize(blocks_.step_bytes);
    pending_.resize(blocks_.environments);
    stepped_.resize(blocks_.environments);
    result_at_ = result_.data();
    for (std::size_t b = 0; b < spec_.behaviours.size(); ++b) {
      whole_.emplace_back(spec_.behaviours[b]);
      some_.emplace_back(spec_.behaviours[b]);
      batches_.push_back(whole_[b].batch());
      some_batches_.push_back(some_[b].batch());
      some_slots_.emplace_back().reserve(static_cast<std::size_t>(spec_.behaviours[b].slots));
      stashed_.emplace_back(static_cast<std::size_t>(spec_.behaviours[b].slots) *
                            spec_.behaviours[b].observation_layout.row_bytes);
    }
    PlaceBatches();
  }

  void Connect(std::unique_ptr<Transport> transport, std::span<const std::byte> first) override {
    LeaveSharedMemory();
    transport_ = std::move(transport);
    reader_ = protocol2::FrameReader();
    std::memcpy(reader_.Writable().data(), first.data(), first.size());
    reader_.Commit(first.size());
    phase_ = Phase::kHello;
    finished_ = through_memory_ = begins_next_ = false;
    if (step_waits_) --request_;  // was asked for, but not carried out: it may be asked for again
    step_waits_ = false;
    connected_at_ = last_heard_ = Now();
  }

  Result<bool> Pump(double timeout_s) override {
    if (phase_ < Phase::kBegin && Now() - connected_at_ > options_.handshake_s)
      return Fatal({StatusCode::kDeadlineExceeded, "the handshake with " + transport_->peer() + " took more than " +
                                                       NumberText(options_.handshake_s) + " s"});
    if (step_waits_) {
      const double left = not_before_ - Now();
      if (left > 0.0 && timeout_s <= 0.0) return false;
      if (left > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left, timeout_s)));
      if (Now() < not_before_) return false;
      step_waits_ = false;
      const Status stepped = StepWorlds();
      through_memory_ = false;
      if (!stepped.ok()) return stepped;
      return true;
    }
    if (shared_.has_value() && shared_->request_turn.Await(std::min(timeout_s, kSharedWait))) {
      CONSAC_RETURN_IF_ERROR(HandleShared());
      return true;
    }
    if (shared_.has_value()) {
      // Now and then the connection beside it.
      if (++shared_idle_ % kSharedLooks != 0 && timeout_s <= 0.0) return false;
      timeout_s = 0.0;
    }
    Frame frame;
    Result<bool> whole = reader_.Next(&frame);
    if (whole.ok() && !*whole) {
      const Result<std::size_t> count = transport_->Read(reader_.Writable(), timeout_s);
      if (!count.ok()) return count.status();
      if (*count == 0) return CheckTime();
      reader_.Commit(*count);
      last_heard_ = Now();
      whole = reader_.Next(&frame);
    }
    if (!whole.ok()) return Fatal(whole.status());
    if (!*whole) return CheckTime();
    const Status status = Handle(frame);
    if (!status.ok()) return status;
    return true;
  }

  Status End(const Status& why) override {
    if (why.code() == StatusCode::kCancelled)
      (void)SendJson(FrameType::kGoAway, 0, "{\"reason\":" + ("\"" + why.message() + "\"") + "}");
    transport_->Close();
    // Whoever connected and never said a good HELLO leaves the session that waits as it was.
    if (phase_ != Phase::kHello) {
      broke_at_ = Now();
      resumable_ = !finished_ && phase_ == Phase::kRun && why.code() == StatusCode::kUnavailable;
    }
    if (finished_ || why.code() != StatusCode::kUnavailable) return finished_ ? Status::Ok() : why;
    if (phase_ != Phase::kRun) return {StatusCode::kUnavailable, "the trainer left before the session began"};
    return {StatusCode::kUnavailable, "the trainer left after " + std::to_string(steps_.load()) + " of " +
                                          std::to_string(options_.training_length) + " steps: " + why.message()};
  }

  std::string peer() const override { return transport_->peer(); }
  bool finished() const override { return finished_; }
  void Forget() override { resumable_ = false; }
  bool resumable() const override { return resumable_ && Now() - broke_at_ < options_.resume_s; }

  void SetPaused(bool paused) override {
    if (phase_ == Phase::kRun) (void)SendFrame(paused ? FrameType::kPaused : FrameType::kResumed, 0, {});
  }

 private:
  enum class Phase : std::uint8_t { kHello, kConfigure, kBegin, kRun };  // kBegin: before the first RESET

  std::byte* Payload() { return result_at_ + protocol2::kHeaderBytes; }

  /// The world writes its observations where RESULT is sent from.
  void PlaceBatches() {
    for (std::size_t b = 0; b < batches_.size(); ++b) {
      batches_[b].next_observations = Payload() + blocks_.behaviours[b].observations;
      batches_[b].actions = actions_.data() + blocks_.behaviours[b].actions;
      if (spec_.behaviours[b].masks_actions)
        batches_[b].next_action_masks = reinterpret_cast<std::uint8_t*>(Payload() + blocks_.behaviours[b].masks);
    }
  }

  // ---- shared memory

  Status EnterSharedMemory() {
    Result<SharedChannel> channel = SharedChannel::Create(blocks_);
    if (!channel.ok()) return channel.status();
    LeaveSharedMemory();
    std::memcpy(channel->result(), result_at_, protocol2::kHeaderBytes + blocks_.largest_result);
    shared_ = std::move(*channel);
    result_at_ = shared_->result();
    PlaceBatches();
    return Status::Ok();
  }

  /// What was answered last stays, should it be asked for again.
  void LeaveSharedMemory() {
    if (!shared_.has_value()) return;
    std::memcpy(result_.data(), result_at_, protocol2::kHeaderBytes + blocks_.largest_result);
    result_at_ = result_.data();
    shared_.reset();
    through_memory_ = false;
    PlaceBatches();
  }

  Status HandleShared() {
    std::byte head[protocol2::kHeaderBytes];
    std::memcpy(head, shared_->request(), sizeof(head));
    const Result<FrameHeader> header = protocol2::ReadHeader(head, shared_->request_bytes - sizeof(head));
    if (!header.ok()) return Fatal(header.status());
    last_heard_ = Now();
    through_memory_ = true;
    const Status status = Handle({*header, {shared_->request() + sizeof(head), header->length}});
    if (!step_waits_) through_memory_ = false;
    return status;
  }

  /// Sends an answer the way its request came.
  Status Deliver(std::span<const std::byte> frame) {
    if (!through_memory_ || frame.size() > shared_->result_bytes) return transport_->Write(frame, options_.write_s);
    if (frame.data() != shared_->result()) std::memcpy(shared_->result(), frame.data(), frame.size());
    shared_->result_turn.Take();
    return Status::Ok();
  }

  // ---- frames out

  Status SendFrame(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    control_.resize(protocol2::kHeaderBytes + payload.size());
    FrameHeader header{type, false, static_cast<std::uint32_t>(payload.size()), 0, request, session_};
    protocol2::WriteHeader(header, control_.data());
    if (!payload.empty()) std::memcpy(control_.data() + protocol2::kHeaderBytes, payload.data(), payload.size());
    return transport_->Write(control_, options_.write_s);
  }
  Status SendJson(FrameType type, std::uint64_t request, const std::string& json) {
    return SendFrame(type, request, std::as_bytes(std::span(json)));
  }

  /// The answer to a request: kept, should it be asked for again.
  Status Answer(FrameType type, const std::string& json) {
    const auto payload = std::as_bytes(std::span(json));
    answer_.resize(protocol2::kHeaderBytes + payload.size());
    FrameHeader header{type, false, static_cast<std::uint32_t>(payload.size()), 0, request_, session_};
    protocol2::WriteHeader(header, answer_.data());
    std::memcpy(answer_.data() + protocol2::kHeaderBytes, payload.data(), payload.size());
    answer_is_result_ = false;
    return Deliver(answer_);
  }

  Status Repeat() {
    if (!answer_is_result_) return Deliver(answer_);
    return Deliver({result_at_, result_size_});
  }

  /// Tells the trainer and lets the session go on.
  Status Refuse(const Status& why, const std::string& path = {}) {
    protocol2::ErrorMessage error{std::string(protocol2::FaultName(why)),
                                  false,
                                  protocol2::FaultText(why),
                                  path,
                                  0.0,
                                  std::exchange(blamed_, -1)};
    return Answer(FrameType::kError, protocol2::EncodeError(error));
  }

  /// Tells the trainer and ends the connection.
  Status Fatal(const Status& why) {
    protocol2::ErrorMessage error{std::string(protocol2::FaultName(why)), true, protocol2::FaultText(why), {}, 0.0, -1};
    (void)SendJson(FrameType::kError, request_, protocol2::EncodeError(error));
    return why;
  }

  // ---- frames in

  Result<bool> CheckTime() {
    const double now = Now();
    if (now - last_heard_ > options_.deadline_s) {
      return Status{StatusCode::kDeadlineExceeded, transport_->peer() + " is silent for " +
                                                       NumberText(options_.deadline_s) + " s; its session is over"};
    }
    return false;
  }

  Status Handle(const Frame& frame) {
    const FrameHeader& header = frame.header;
    const auto type = static_cast<std::uint16_t>(header.type);
    switch (header.type) {
      case FrameType::kPing:
        if (frame.payload.size() > kLargestPing) return Fatal(Fault("MALFORMED", "a PING has more than 64 bytes"));
        return SendFrame(FrameType::kPong, 0, frame.payload);
      case FrameType::kPong:
        return Status::Ok();
      case FrameType::kBye:
        finished_ = true;
        return Status::Ok();
      case FrameType::kHello:
        if (phase_ == Phase::kHello) return OnHello(frame);
        break;
      default:
        break;
    }
    if ((type & protocol2::kOptionalType) != 0) return Status::Ok();
    if (phase_ == Phase::kHello) return Fatal(Fault("BAD_STATE", "a session begins with HELLO"));
    if (header.request == request_ && (answer_is_result_ || !answer_.empty())) return Repeat();
    if (header.request != request_ + 1) {
      // Not carried out and not counted.
      protocol2::ErrorMessage error{
          "BAD_STATE",
          false,
          "request " + std::to_string(header.request) + " does not follow request " + std::to_string(request_),
          {},
          0.0};
      return SendJson(FrameType::kError, header.request, protocol2::EncodeError(error));
    }
    request_ = header.request;
    switch (header.type) {
      case FrameType::kConfigure:
        return OnConfigure(frame);
      case FrameType::kReset:
        return OnReset(frame.payload);
      case FrameType::kStep:
        return OnStep(frame.payload);
      case FrameType::kRender:
        return Refuse(Fault("UNSUPPORTED", "this engine sends no pictures"));
      case FrameType::kHello:
        return Refuse(Fault("BAD_STATE", "HELLO was said already"));
      default:
        return Refuse(Fault("UNKNOWN_MESSAGE", "a frame of type " + std::to_string(type) + " is not known"));
    }
  }

  Status OnHello(const Frame& frame) {
    const Result<protocol2::Hello> hello = protocol2::ParseHello(frame.payload);
    if (!hello.ok()) return Fatal(hello.status());
    if (hello->lowest > protocol2::kVersion || hello->highest < protocol2::kVersion) {
      return Fatal(Fault("UNSUPPORTED_VERSION", "this engine speaks protocol " + std::to_string(protocol2::kVersion) +
                                                    ", the trainer " + std::to_string(hello->lowest) + " to " +
                                                    std::to_string(hello->highest) + "; update the older one"));
    }
    if (!options_.token.empty() && !SameSecret(options_.token, hello->token))
      return Fatal(Fault("AUTH_FAILED", "the access token is missing or wrong; give the engine's --token"));
    protocol2::Welcome welcome;
    if (!hello->resume.empty()) {
      if (!resumable() || !SameSecret(resume_, hello->resume))
        return Fatal(Fault("AUTH_FAILED", "that session is over; begin a new one"));
      welcome.resumed = true;
      phase_ = Phase::kRun;
    } else {
      ++session_;
      request_ = 0;
      answer_.clear();
      answer_is_result_ = false;
      std::fill(pending_.begin(), pending_.end(), std::uint8_t{0});
      resume_ = MakeToken();
      steps_ = 0;
      phase_ = Phase::kConfigure;
    }
    resumable_ = false;
    welcome.server = std::string("consac ") + kVersion;
    welcome.session = session_;
    welcome.resume = resume_;
    if (std::find(hello->capabilities.begin(), hello->capabilities.end(), kSharedMemory) != hello->capabilities.end())
      welcome.capabilities.emplace_back(kSharedMemory);
    welcome.max_frame = std::min(hello->max_frame, protocol2::kLargestFrame);
    welcome.last_request = request_;
    reader_.SetLimit(welcome.max_frame);
    return SendJson(FrameType::kWelcome, frame.header.request, protocol2::EncodeWelcome(welcome));
  }

  Status OnConfigure(const Frame& frame) {
    if (phase_ == Phase::kRun) return Refuse(Fault("BAD_STATE", "CONFIGURE comes before the first RESET"));
    const Result<protocol2::Configure> configure = protocol2::ParseConfigure(frame.payload);
    if (!configure.ok()) return Refuse(configure.status());
    if (!configure->expect_json.empty()) {
      std::string path;
      const Status same = protocol2::CompareBehaviours(configure->expect_json, protocol2::BehavioursJson(spec_), &path);
      if (!same.ok()) return Refuse(same, path);
    }
    if (configure->autoreset != Autoreset::kSameStep && !env_.steps_some())
      return Refuse(Fault("UNSUPPORTED", "this engine begins the next episode in the same step only"));
    autoreset_ = configure->autoreset;
    protocol2::SpecMessage spec;
    spec.env = spec_;
    spec.autoreset = autoreset_;
    spec.training_length = options_.training_length;
    spec.model_name = options_.model_name;
    LeaveSharedMemory();
    if (configure->shared_memory) {
      const Status shared = EnterSharedMemory();
      if (!shared.ok()) return Refuse(Fault("UNSUPPORTED", shared.message()));
      spec.shared_memory = shared_->Spec();
    }
    phase_ = Phase::kBegin;
    return Answer(FrameType::kSpec, protocol2::EncodeSpec(spec));
  }

  Status OnReset(std::span<const std::byte> payload) {
    if (phase_ < Phase::kBegin) return Refuse(Fault("BAD_STATE", "RESET comes after CONFIGURE"));
    std::uint32_t flags = 0;
    if (payload.size() < blocks_.seeds) return Refuse(Fault("WRONG_SIZE", "RESET is too short"));
    std::memcpy(&flags, payload.data(), sizeof(flags));
    const bool seeded = (flags & protocol2::kWithSeeds) != 0;
    if (seeded && payload.size() < blocks_.options) return Refuse(Fault("WRONG_SIZE", "RESET has too few seeds"));
    // Copied, since in shared memory it might change while it is looked at.
    std::transform(payload.data() + protocol2::kActiveOffset,
                   payload.data() + protocol2::kActiveOffset + blocks_.environments, stepped_.begin(),
                   [](std::byte b) { return b != std::byte{0} ? 1 : 0; });
    const bool all = std::all_of(stepped_.begin(), stepped_.end(), [](std::uint8_t chosen) { return chosen != 0; });
    std::vector<std::uint64_t> seeds(seeded ? blocks_.environments : 0);
    if (seeded) std::memcpy(seeds.data(), payload.data() + blocks_.seeds, seeds.size() * sizeof(seeds[0]));
    if (phase_ == Phase::kBegin && !all) return Refuse(Fault("BAD_STATE", "the first RESET is of every environment"));
    BeginResult();
    if (phase_ == Phase::kBegin && !seeded) {
      env_.Reset(options_.seed + session_ - 1, batches_);
      for (std::size_t world = 0; world < blocks_.environments; ++world) MarkFirst(world);
    } else {
      const Status reset = ResetChosen(seeds, all);
      if (!reset.ok()) return Refuse(reset);
    }
    phase_ = Phase::kRun;
    return SendResult();
  }

  /// The environments that stepped_ names; `seeds` may be empty. An engine that can only begin all of them together
  /// takes seeds that follow one another.
  Status ResetChosen(const std::vector<std::uint64_t>& seeds, bool all) {
    for (std::size_t world = 0; world < blocks_.environments; ++world) {
      if (stepped_[world] == 0) continue;
      const Status reset = ResetOne(world, seeds.empty() ? std::nullopt : std::optional<std::uint64_t>(seeds[world]));
      if (reset.ok()) continue;
      bool follow = all && world == 0 && !seeds.empty();
      for (std::size_t i = 1; i < seeds.size(); ++i) follow = follow && seeds[i] == seeds[0] + i;
      if (!follow) return reset;
      env_.Reset(seeds[0], batches_);
      for (std::size_t each = 0; each < blocks_.environments; ++each) {
        pending_[each] = 0;
        MarkFirst(each);
      }
      return Status::Ok();
    }
    return Status::Ok();
  }

  Status ResetOne(std::size_t world, std::optional<std::uint64_t> seed) {
    if (!seed.has_value() && pending_[world] != 0) {
      BeginNext(world);
      return Status::Ok();
    }
    if (!env_.ResetWorld(static_cast<std::int32_t>(world), seed, batches_))
      return Fault("UNSUPPORTED", "this engine cannot reset single environments or take seeds");
    pending_[world] = 0;
    MarkFirst(world);
    return Status::Ok();
  }

  Status OnStep(std::span<const std::byte> payload) {
    if (phase_ != Phase::kRun) return Refuse(Fault("BAD_STATE", "STEP comes after the first RESET"));
    if (payload.size() != blocks_.step_bytes) {
      return Refuse(Fault("WRONG_SIZE", "STEP has " + std::to_string(payload.size()) + " bytes, expected " +
                                            std::to_string(blocks_.step_bytes)));
    }
    std::memcpy(actions_.data(), payload.data(), payload.size());
    const Status fits = CheckStep();
    if (!fits.ok()) return Refuse(fits);
    if (options_.min_step_s > 0.0) {
      not_before_ = last_step_ + options_.min_step_s;
      step_waits_ = true;
      return Status::Ok();
    }
    return StepWorlds();
  }

  /// Which environments are stepped, and whether their actions are legal.
  Status CheckStep() {
    const std::byte* active = actions_.data() + protocol2::kActiveOffset;
    stepped_count_ = 0;
    for (std::size_t world = 0; world < blocks_.environments; ++world) {
      const bool wanted = active[world] != std::byte{0};
      if (wanted && pending_[world] != 0 && autoreset_ == Autoreset::kDisabled) {
        blamed_ = static_cast<std::int64_t>(world);
        return Fault("RESET_REQUIRED", "environment " + std::to_string(world) + " has ended; reset it first");
      }
      stepped_[world] = wanted && pending_[world] == 0 ? 1 : 0;
      begins_next_ = begins_next_ || (wanted && pending_[world] != 0);
      stepped_count_ += stepped_[world];
    }
    if (stepped_count_ < blocks_.environments && !env_.steps_some())
      return Fault("UNSUPPORTED", "this engine steps all of its environments together");
    for (std::size_t b = 0; b < spec_.behaviours.size(); ++b) {
      const BehaviourSpec& behaviour = spec_.behaviours[b];
      for (std::int32_t slot = 0; slot < behaviour.slots; ++slot) {
        if (stepped_[WorldOf(behaviour, slot)] == 0) continue;
        const Status legal =
            CheckRow(behaviour.action_layout,
                     batches_[b].actions + static_cast<std::size_t>(slot) * behaviour.action_layout.row_bytes);
        if (legal.ok()) continue;
        blamed_ = static_cast<std::int64_t>(WorldOf(behaviour, slot));
        return Fault(legal.code() == StatusCode::kNonFinite ? "NON_FINITE" : "OUT_OF_RANGE",
                     "the action of slot " + std::to_string(slot) + " of '" + behaviour.name + "': " + legal.message());
      }
    }
    return Status::Ok();
  }

  static std::size_t WorldOf(const BehaviourSpec& behaviour, std::int32_t slot) {
    return static_cast<std::size_t>(slot) / behaviour.agents.size();
  }

  Status StepWorlds() {
    last_step_ = std::max(Now(), options_.min_step_s > 0.0 ? last_step_ + options_.min_step_s : 0.0);
    BeginResult();
    if (begins_next_) {
      const std::byte* active = actions_.data() + protocol2::kActiveOffset;
      for (std::size_t world = 0; world < blocks_.environments; ++world) {
        if (active[world] != std::byte{0} && pending_[world] != 0) BeginNext(world);
      }
      begins_next_ = false;
    }
    if (stepped_count_ == blocks_.environments) {
      env_.Step(batches_);
      for (std::size_t b = 0; b < batches_.size(); ++b) WriteOutcomes(b, batches_[b]);
    } else if (stepped_count_ > 0) {
      StepSome();
    }
    return SendResult();
  }

  /// Some environments only: their rows lie together for the world, and are put in their places afterwards.
  void StepSome() {
    for (std::size_t b = 0; b < batches_.size(); ++b) {
      const BehaviourSpec& behaviour = spec_.behaviours[b];
      const std::size_t action_bytes = behaviour.action_layout.row_bytes;
      std::vector<std::int32_t>& slots = some_slots_[b];
      slots.clear();
      for (std::int32_t slot = 0; slot < behaviour.slots; ++slot) {
        if (stepped_[WorldOf(behaviour, slot)] == 0) continue;
        std::memcpy(some_batches_[b].actions + slots.size() * action_bytes,
                    batches_[b].actions + static_cast<std::size_t>(slot) * action_bytes, action_bytes);
        slots.push_back(slot);
      }
      some_batches_[b].slots = slots;
    }
    env_.Step(some_batches_);
    for (std::size_t b = 0; b < batches_.size(); ++b) {
      const Batch& some = some_batches_[b];
      const std::size_t row_bytes = spec_.behaviours[b].observation_layout.row_bytes;
      for (std::size_t i = 0; i < some.slots.size(); ++i) {
        std::memcpy(batches_[b].next_observations + static_cast<std::size_t>(some.slots[i]) * row_bytes,
                    some.next_observations + i * row_bytes, row_bytes);
        if (!spec_.behaviours[b].masks_actions) continue;
        const auto mask_bytes = static_cast<std::size_t>(spec_.behaviours[b].action_layout.mask_bytes);
        std::memcpy(batches_[b].next_action_masks + static_cast<std::size_t>(some.slots[i]) * mask_bytes,
                    some.next_action_masks + i * mask_bytes, mask_bytes);
      }
      WriteOutcomes(b, some);
    }
  }

  // ---- the result

  std::byte* States(std::size_t b) { return Payload() + blocks_.behaviours[b].states; }

  /// Rows and firsts of before stay; everything else is 0 until a slot is stepped or reset.
  void BeginResult() {
    std::memset(Payload(), 0, 8);
    for (std::size_t b = 0; b < spec_.behaviours.size(); ++b) {
      const auto slots = static_cast<std::size_t>(spec_.behaviours[b].slots);
      std::memset(Payload() + blocks_.behaviours[b].rewards, 0, slots * sizeof(double));
      for (std::size_t i = 0; i < slots; ++i) {
        States(b)[i] = (States(b)[i] & std::byte{protocol2::kFirst}) | std::byte{protocol2::kActive};
      }
    }
    has_finals_ = false;
    final_end_ = blocks_.result_bytes;
  }

  void MarkFirst(std::size_t world) {
    for (std::size_t b = 0; b < spec_.behaviours.size(); ++b) {
      const std::size_t agents = spec_.behaviours[b].agents.size();
      for (std::size_t i = world * agents; i < (world + 1) * agents; ++i)
        States(b)[i] = std::byte{protocol2::kFirst | protocol2::kActive};
    }
  }

  /// The episode that the world has begun already becomes visible.
  void BeginNext(std::size_t world) {
    for (std::size_t b = 0; b < spec_.behaviours.size(); ++b) {
      const std::size_t row_bytes = spec_.behaviours[b].observation_layout.row_bytes;
      const std::size_t agents = spec_.behaviours[b].agents.size();
      std::memcpy(batches_[b].next_observations + world * agents * row_bytes,
                  stashed_[b].data() + world * agents * row_bytes, agents * row_bytes);
    }
    pending_[world] = 0;
    MarkFirst(world);
  }

  /// Rewards, states and, for episodes that ended, where both observations go. `batch` holds the slots that were
  /// stepped.
  void WriteOutcomes(std::size_t b, const Batch& batch) {
    const BehaviourSpec& behaviour = spec_.behaviours[b];
    const std::size_t row_bytes = behaviour.observation_layout.row_bytes;
    std::byte* rows = batches_[b].next_observations;
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(batch.slots[i]);
      const auto reward = static_cast<double>(batch.rewards[i]);
      std::memcpy(Payload() + blocks_.behaviours[b].rewards + slot * sizeof(reward), &reward, sizeof(reward));
      auto state = static_cast<unsigned>(protocol2::kActive);
      if (batch.terminated[i] != 0) state |= protocol2::kTerminated;
      if (batch.truncated[i] != 0) state |= protocol2::kTruncated;
      if (state != protocol2::kActive) {
        const std::byte* last = batch.final_observations + i * row_bytes;
        if (autoreset_ == Autoreset::kSameStep) {
          state |= protocol2::kFinal | protocol2::kFirst;
          std::memcpy(Payload() + final_end_, last, row_bytes);
          final_end_ += row_bytes;
          has_finals_ = true;
        } else {
          std::memcpy(stashed_[b].data() + slot * row_bytes, rows + slot * row_bytes, row_bytes);
          std::memcpy(rows + slot * row_bytes, last, row_bytes);
          pending_[WorldOf(behaviour, static_cast<std::int32_t>(slot))] = 1;
          state &= ~static_cast<unsigned>(protocol2::kActive);
        }
      }
      States(b)[slot] = static_cast<std::byte>(state);
    }
    steps_.fetch_add(batch.rows(), std::memory_order_relaxed);
    final_end_ = protocol2::AlignBlock(final_end_);
  }

  Status SendResult() {
    const std::size_t size = has_finals_ ? final_end_ : blocks_.result_bytes;
    const std::uint32_t parts = has_finals_ ? protocol2::kPartFinals : 0;
    std::memcpy(Payload(), &parts, sizeof(parts));
    FrameHeader header{FrameType::kResult, false, static_cast<std::uint32_t>(size), 0, request_, session_};
    protocol2::WriteHeader(header, result_at_);
    result_size_ = protocol2::kHeaderBytes + size;
    answer_is_result_ = true;
    return Deliver({result_at_, result_size_});
  }

  VectorEnv& env_;
  const EnvSpec& spec_;
  const EnvServerOptions& options_;
  std::atomic<std::int64_t>& steps_;
  const Blocks blocks_;

  // The connection.
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_;
  Phase phase_ = Phase::kHello;
  double connected_at_ = 0.0, last_heard_ = 0.0, broke_at_ = 0.0;
  bool finished_ = false, resumable_ = false;

  // The session.
  std::uint32_t session_ = 0;
  std::uint64_t request_ = 0;  // number of the latest
  std::string resume_;
  Autoreset autoreset_ = Autoreset::kSameStep;
  std::vector<std::byte> answer_, control_;  // latest answer that is no RESULT; frames between
  bool answer_is_result_ = false;
  std::size_t result_size_ = 0;

  std::optional<SharedChannel> shared_;
  bool through_memory_ = false;  // the request under way came that way
  unsigned shared_idle_ = 0;

  // The step.
  AlignedBytes result_, actions_;   // RESULT with its header; STEP's payload
  std::byte* result_at_ = nullptr;  // where RESULT is built: result_, or shared memory
  std::vector<BatchBuffer> whole_, some_;
  std::vector<Batch> batches_, some_batches_;  // of all slots, in place; of some, gathered
  std::vector<std::vector<std::int32_t>> some_slots_;
  std::vector<std::vector<std::byte>> stashed_;    // first rows of episodes that are not visible yet
  std::vector<std::uint8_t> pending_, stepped_;    // per environment: has ended; is stepped now
  std::int64_t blamed_ = -1;                       // environment that a refusal speaks of
  std::size_t stepped_count_ = 0, final_end_ = 0;  // final_end_: behind the final rows so far, in the payload
  bool begins_next_ = false, step_waits_ = false, has_finals_ = false;
  double not_before_ = 0.0, last_step_ = 0.0;
};

}  // namespace

std::unique_ptr<Session2> Session2::Create(const SessionHost& host) {
  return std::make_unique<Session2Server>(host);
}

void TurnAway2(Transport& transport) {
  const std::string json = protocol2::EncodeError(
      {"CAPACITY", true, "another trainer is connected to this engine; try again when it has left", {}, 1.0, -1});
  std::vector<std::byte> frame(protocol2::kHeaderBytes + json.size());
  protocol2::WriteHeader({FrameType::kError, false, static_cast<std::uint32_t>(json.size()), 0, 0, 0}, frame.data());
  std::memcpy(frame.data() + protocol2::kHeaderBytes, json.data(), json.size());
  (void)transport.Write(frame, 0.0);
}

}  // namespace consac
