// How a session with an engine begins, and how it is taken up again over a new connection.
#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>

#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/protocol/text1.h"
#include "server/client2.h"
#include "server/clients.h"
#include "server/limits.h"

namespace consac {

using protocol2::Frame;
using protocol2::FrameType;

Status Client2::AskForSpec(bool share) {
  protocol2::Configure configure;
  configure.shared_memory = share;
  const Result<Frame> answer = Request(FrameType::kConfigure, protocol2::EncodeConfigure(configure));
  const bool unsupported = answer.status().code() == StatusCode::kInvalidArgument && refused_ && open_;
  if (share && unsupported) return AskWithoutSharing(answer.status());
  if (!answer.ok()) return answer.status();
  if (answer->header.type != FrameType::kSpec) return Unexpected(*answer, "SPEC");
  const auto agree = [&](std::string_view name) { return protocol2::HasCapability(welcome_.capabilities, name); };
  const protocol2::Agreed agreed{agree(kParameters), agree(kStatistics), agree(kGroups)};
  Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(answer->payload, agreed);
  if (!spec.ok()) return spec.status();
  if (spec->autoreset != configure.autoreset) {
    return {StatusCode::kProtocol, transport_->peer() + " begins episodes in another way than same_step, which was " +
                                       "asked for; an engine that cannot answers UNSUPPORTED (R31)"};
  }
  blocks_ = Blocks(spec->env);
  if (share) {
    Result<SharedChannel> channel = SharedChannel::Open(spec->shared_memory, blocks_);
    if (!channel.ok()) return AskWithoutSharing(channel.status());
    shared_ = std::move(*channel);
  }
  spec_ = std::move(spec->env);
  group_rewards_.assign(blocks_.environments * blocks_.groups, 0.0f);
  parameters_.assign(blocks_.environments * blocks_.parameters, std::numeric_limits<double>::quiet_NaN());
  check_ = protocol2::ResultCheck(spec_, configure.autoreset,
                                  options_.refuse_non_finite ? protocol2::Numbers::kJudged : protocol2::Numbers::kLeft,
                                  agreed);
  present_.clear();
  for (const BehaviourSpec& behaviour : spec_.behaviours)
    present_.emplace_back(static_cast<std::size_t>(behaviour.slots), std::uint8_t{1});
  request_ask_ = {spec->training_length, spec->model_name};
  message_.reserve(protocol2::kHeaderBytes + std::max(blocks_.step_bytes, blocks_.options) + blocks_.parameter_bytes());
  return Status::Ok();
}

Status Client2::AskWithoutSharing(const Status& why) {
  Log(LogLevel::kInfo, why.message() + "; going on over TCP");
  refused_ = false;
  return AskForSpec(false);
}

Status Client2::SayHello() {
  protocol2::Hello hello;
  hello.client = std::string("consac ") + kVersion;
  hello.token = options_.token;
  hello.resume = welcome_.resume;
  for (const std::string_view name : {kRelabelling, kParameters, kStatistics, kGroups})
    hello.capabilities.emplace_back(name);
  if (options_.shared_memory) hello.capabilities.emplace_back(kSharedMemory);
  CONSAC_RETURN_IF_ERROR(SendControl(FrameType::kHello, protocol2::EncodeHello(hello)));
  reader_ = protocol2::FrameReader();
  paused_ = false;
  const Result<Frame> answer = ReadAnswer(0, std::min(options_.setup_timeout_s, options_.deadline_s));
  if (!answer.ok()) return HelloFailed(answer.status());
  if (answer->header.type != FrameType::kWelcome) return Unexpected(*answer, "WELCOME");
  Result<protocol2::Welcome> welcome = protocol2::ParseWelcome(answer->payload);
  if (!welcome.ok()) return welcome.status();
  for (const std::string& agreed : welcome->capabilities) {
    if (protocol2::HasCapability(hello.capabilities, agreed)) continue;
    return {StatusCode::kProtocol,
            transport_->peer() + " agrees to capability " + Quote(agreed) + ", which was not asked for (R21)"};
  }
  CONSAC_RETURN_IF_ERROR(CheckTakenUp(hello, *welcome));
  welcome_ = std::move(*welcome);
  reader_.SetLimit(welcome_.max_frame);
  return Status::Ok();
}

Status Client2::CheckTakenUp(const protocol2::Hello& hello, const protocol2::Welcome& welcome) const {
  const bool same = !hello.resume.empty() && welcome.session == welcome_.session;
  if (welcome.resumed ? !same : !hello.resume.empty()) {
    return {StatusCode::kProtocol, transport_->peer() + " answered with session " + std::to_string(welcome.session) +
                                       (welcome.resumed ? ", resumed," : ", a new one,") + " to a HELLO that " +
                                       (hello.resume.empty() ? "resumes none" : "resumes session ") +
                                       (hello.resume.empty() ? "" : std::to_string(welcome_.session)) + " (R24)"};
  }
  if (!welcome.resumed) return Status::Ok();
  if (welcome.last_request != request_ && welcome.last_request + 1 != request_) {
    return {StatusCode::kProtocol, transport_->peer() + " says that request " + std::to_string(welcome.last_request) +
                                       " was the last, not " + std::to_string(request_) + " or the one before (R24)"};
  }
  const std::string lost = protocol2::LackingCapability(welcome.capabilities, welcome_.capabilities);
  const std::string gained = protocol2::LackingCapability(welcome_.capabilities, welcome.capabilities);
  if (lost.empty() && gained.empty()) return Status::Ok();
  return {StatusCode::kProtocol, transport_->peer() + " takes session " + std::to_string(welcome.session) + " up with" +
                                     (lost.empty() ? " capability " : "out capability ") +
                                     Quote(lost.empty() ? gained : lost) + ", which it has" +
                                     (lost.empty() ? " not (R28)" : " (R28)")};
}

Status Client2::HelloFailed(const Status& why) const {
  if (why.code() == StatusCode::kProtocol && protocol2::FaultName(why) == "BAD_MAGIC") {
    const auto bytes = reader_.pending();
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.starts_with("D#") || text.starts_with("B#"))
      return {StatusCode::kFailedPrecondition, "the engine speaks text protocol 1"};
    const std::string_view line = text.substr(0, text.find('\n'));
    if (line.starts_with(text1::kBusyPrefix))
      return {StatusCode::kUnavailable, transport_->peer() + " is " + std::string(line)};
    return {StatusCode::kProtocol, transport_->peer() + " is no CONSAC engine: its first bytes are " + Quote(line)};
  }
  if (why.code() != StatusCode::kDeadlineExceeded) return why;
  return {StatusCode::kDeadlineExceeded, transport_->peer() + " accepts connections but answers nothing; an engine " +
                                             "sends a setup or answers HELLO, so is this another service?"};
}

Status Client2::Unexpected(const Frame& frame, const char* expected) const {
  return {StatusCode::kProtocol, transport_->peer() + " answered with a frame of type " +
                                     std::to_string(static_cast<int>(frame.header.type)) + ", expected " + expected};
}

Status Client2::ConnectAnew(const Status& why, double start, Said said) {
  open_ = false;
  shared_.reset();
  if (!options_.reconnect || spec_.behaviours.empty() || welcome_.resume.empty()) return why;
  if (said == Said::kNotYet) {
    warnings_.Say(why.message() + "; trying for " + NumberText(options_.resume_s) + " s to go on with the session");
  }
  while (Now() - start < options_.resume_s) {
    if (options_.stop != nullptr && options_.stop->load())
      return {StatusCode::kCancelled, "stopped while connecting anew"};
    Result<std::unique_ptr<Transport>> transport = options_.reconnect();
    if (transport.ok()) {
      transport_ = std::move(*transport);
      const Status hello = SayHello();
      refused_ = false;
      if (hello.ok() && welcome_.resumed) return Status::Ok();
      if (hello.code() != StatusCode::kUnavailable && hello.code() != StatusCode::kDeadlineExceeded)
        return {why.code(), why.message() + "; the session could not be taken up again: " + hello.message()};
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kRetryPause));
  }
  return why;
}

Result<std::unique_ptr<EnvClient>> OpenClient2(std::unique_ptr<Transport> transport, const EnvClientOptions& options) {
  auto client = std::make_unique<Client2>(std::move(transport), options);
  CONSAC_RETURN_IF_ERROR(client->Begin());
  return std::unique_ptr<EnvClient>(std::move(client));
}

}  // namespace consac
