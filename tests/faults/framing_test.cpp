// Group B of docs/faults.md: framing and parsing. Each test is named after its row.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "consac/protocol/text1.h"
#include "tests/faults/fault_peers.h"

namespace consac {
namespace {

using namespace testing;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

std::span<const std::byte> Bytes(std::string_view text) {
  return std::as_bytes(std::span(text));
}

void Append(std::vector<std::byte>* all, const std::vector<std::byte>& frame) {
  all->insert(all->end(), frame.begin(), frame.end());
}

/// What a session of ours comes to when its engine answers the first STEP with `bytes` and then closes or waits.
Status StepAnsweredBy(const std::function<std::vector<std::byte>(const RawEngine&, std::uint64_t)>& bytes, bool close,
                      Batch* seen = nullptr) {
  RawEngine engine;
  std::atomic<bool> over{false};
  std::thread peer([&] {
    engine.Begin();
    engine.Send(bytes(engine, engine.Next().header.request));
    if (close) engine.Close();
    while (!over) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  Session session(engine.Connect(), Impatient(Way::kTcp));
  const Status status = session.Step();
  if (seen != nullptr) *seen = session.batch();
  over = true;
  peer.join();
  return status;
}

TEST(FaultB, B2_AWholeSessionInOneWriteIsAnsweredInOrder) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.blocks = Blocks(engine.spec());
  const std::vector<int> all(kCopies, 1);
  std::vector<std::byte> stream = FrameBytes(FrameType::kHello, 0, EncodeHello({}));
  Append(&stream, FrameBytes(FrameType::kConfigure, 1, "{}"));
  Append(&stream, FrameBytes(FrameType::kReset, 2, trainer.ResetPayload(1, all)));
  for (std::uint64_t i = 3; i < 10; ++i)
    Append(&stream, FrameBytes(FrameType::kStep, i, trainer.StepPayload({0, 1, 0, 1}, all)));
  trainer.Send(stream);
  EXPECT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  EXPECT_EQ(trainer.Next().header.type, FrameType::kSpec);
  for (std::uint64_t i = 2; i < 10; ++i) {
    const Frame frame = trainer.Next();
    EXPECT_EQ(frame.header.type, FrameType::kResult);
    EXPECT_EQ(frame.header.request, i);
  }
  EXPECT_EQ(engine.steps(), 7 * kCopies);
}

TEST(FaultB, B2_TextActionsInOneWriteAreOneStepEach) {
  EnvServerOptions options;
  options.protocol = Protocol::kText1;
  const Engine engine(std::make_unique<PlainWorld>(*Space::Box(0, 1, {1}), *Space::Discrete(3)), options);
  const auto trainer = engine.Connect();
  ASSERT_TRUE(Say(*trainer, "1\n2\r\n0\n1\n").ok());
  ASSERT_TRUE(Soon([&] { return engine.steps() == 4; }));
  const std::string heard = Listen(*trainer, 0.2);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), '\n'), 6) << heard;  // setup, first observation, four answers
}

TEST(FaultB, B3_AnEmptyPayloadIsRefusedWhereOneIsDue) {
  const Engine engine;
  {
    RawTrainer trainer(engine.Connect());
    trainer.Send(FrameType::kHello, 0, "");
    const Frame answer = trainer.Next();
    ASSERT_EQ(answer.header.type, FrameType::kError);
    EXPECT_EQ(ParseError(answer.payload)->code, "MALFORMED");
  }
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  EXPECT_EQ(trainer.ErrorOf(FrameType::kReset, 2, {}), "WRONG_SIZE");
  trainer.Ask(FrameType::kReset, 3, trainer.ResetPayload(1, std::vector<int>(kCopies, 1)));
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 4, {}), "WRONG_SIZE");
  EXPECT_EQ(engine.steps(), 0);
}

TEST(FaultB, B3_TheLimitOfWelcomeHoldsToTheByte) {
  const Engine engine;
  for (const std::size_t size : {4096u, 4097u}) {
    RawTrainer trainer(engine.Connect());
    Hello hello;
    hello.max_frame = 4096;
    trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
    const Frame welcome = trainer.Next();
    ASSERT_EQ(welcome.header.type, FrameType::kWelcome);
    EXPECT_EQ(ParseWelcome(welcome.payload)->max_frame, 4096u);
    trainer.Send(FrameType::kConfigure, 1, "{" + std::string(size - 2, ' ') + "}");
    const Frame answer = trainer.Next();
    if (size == 4096) {
      EXPECT_EQ(answer.header.type, FrameType::kSpec);
      trainer.Send(FrameType::kBye, 0, "");
      continue;
    }
    ASSERT_EQ(answer.header.type, FrameType::kError);
    EXPECT_EQ(ParseError(answer.payload)->code, "FRAME_TOO_LARGE");
  }
}

TEST(FaultB, B3_AClaimTakesNoMemory) {
  FrameReader reader(kLargestFrame);
  std::byte header[kHeaderBytes];
  WriteHeader({FrameType::kStep, false, static_cast<std::uint32_t>(kLargestFrame), 0, 1, 0}, header);
  std::memcpy(reader.Writable().data(), header, sizeof(header));
  reader.Commit(sizeof(header));
  Frame frame;
  const auto whole = reader.Next(&frame);
  ASSERT_TRUE(whole.ok());
  EXPECT_FALSE(*whole);
  EXPECT_LT(reader.Writable().size(), std::size_t{1} << 20) << "32 bytes have come, not 64 MiB";
}

TEST(FaultB, B4_AResultThatIsCutAnywhereAndThenTheEndChangesNothing) {
  const std::size_t size = kHeaderBytes + RawEngine().ResultPayload().size();
  for (std::size_t cut = 0; cut < size; cut += 7) {
    RawEngine engine;
    std::thread peer([&] {
      engine.Begin();
      const std::vector<std::byte> result =
          FrameBytes(FrameType::kResult, engine.Next().header.request, engine.ResultPayload(kTerminated | kActive));
      engine.Send(std::span(result).first(cut));
      engine.Close();
    });
    Session session(engine.Connect(), Impatient(Way::kTcp));
    session.batch().terminated[0] = 0;
    EXPECT_EQ(session.Step().code(), StatusCode::kUnavailable) << cut;
    EXPECT_EQ(session.batch().terminated[0], 0) << "no half of it is taken";
    peer.join();
  }
}

TEST(FaultB, B4_AnActionOfTextThatIsCutIsNotCarriedOut) {
  EnvServerOptions options;
  options.protocol = Protocol::kText1;
  options.quiet_s = 0.5;
  auto owned = std::make_unique<PlainWorld>(*Space::Box(0, 1, {1}), *Space::Box(-1, 1, {2}));
  const PlainWorld& world = *owned;
  const Engine engine(std::move(owned), options);
  auto cut = engine.Connect();
  ASSERT_TRUE(Say(*cut, "0.25,-0.").ok());
  cut->Close();
  Session next(engine.Connect(), Impatient(Way::kText1));
  EXPECT_TRUE(next.Step().ok());
  EXPECT_EQ(world.stepped(), 1);
}

// No later frame is looked for, and nobody is asked to begin again.
TEST(FaultB, B5_AStreamThatLostItsThreadIsTheEnd) {
  const Status status = StepAnsweredBy(
      [](const RawEngine& engine, std::uint64_t request) {
        std::vector<std::byte> bytes = FrameBytes(FrameType::kPong, 0, "x");
        Append(&bytes, std::vector<std::byte>(40, std::byte{7}));
        Append(&bytes, FrameBytes(FrameType::kResult, request, engine.ResultPayload()));
        return bytes;
      },
      false);
  EXPECT_EQ(status.code(), StatusCode::kProtocol);
  EXPECT_THAT(status.message(), HasSubstr("BAD_MAGIC"));
}

TEST(FaultB, B6_TheTrainerSkipsWhatItMayAndStopsAtWhatItMust) {
  const auto with = [](std::uint16_t type) {
    return StepAnsweredBy(
        [type](const RawEngine& engine, std::uint64_t request) {
          std::vector<std::byte> bytes = FrameBytes(static_cast<FrameType>(type), 77, "of a later version");
          Append(&bytes, FrameBytes(FrameType::kResult, request, engine.ResultPayload()));
          return bytes;
        },
        false);
  };
  EXPECT_TRUE(with(kOptionalType | 99).ok());
  EXPECT_EQ(with(99).code(), StatusCode::kProtocol);
}

TEST(FaultB, B9_RightMessagesInWrongStatesAreRefusedAndTheSessionGoesOn) {
  const Engine engine;
  {
    RawTrainer trainer(engine.Connect());
    trainer.Send(FrameType::kConfigure, 1, "{}");
    EXPECT_EQ(trainer.Next().header.type, FrameType::kError) << "before HELLO";
  }
  RawTrainer trainer(engine.Connect());
  const std::vector<int> all(kCopies, 1);
  trainer.blocks = Blocks(engine.spec());
  const auto code = [&](FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    trainer.Send(FrameBytes(type, request, payload));
    const Frame frame = trainer.Next();
    if (frame.header.type != FrameType::kError) return std::string("no error");
    const auto error = ParseError(frame.payload);
    return error->code + (error->ends_connection ? ", the end" : "");
  };
  const std::string hello = EncodeHello({});
  EXPECT_EQ(code(FrameType::kHello, 0, Bytes(hello)), "no error");
  EXPECT_EQ(code(FrameType::kHello, 0, Bytes(hello)), "BAD_STATE");
  EXPECT_EQ(code(FrameType::kReset, 1, trainer.ResetPayload(1, all)), "BAD_STATE") << "before CONFIGURE";
  EXPECT_EQ(code(FrameType::kStep, 2, trainer.StepPayload({0, 0, 0, 0}, all)), "BAD_STATE");
  EXPECT_EQ(code(FrameType::kConfigure, 3, Bytes("{}")), "no error");
  EXPECT_EQ(code(FrameType::kHello, 0, Bytes(hello)), "BAD_STATE");
  EXPECT_EQ(code(FrameType::kReset, 4, trainer.ResetPayload(1, all)), "no error");
  EXPECT_EQ(code(FrameType::kHello, 0, Bytes(hello)), "BAD_STATE");
  EXPECT_EQ(code(FrameType::kStep, 5, trainer.StepPayload({0, 0, 0, 0}, all)), "no error");
  EXPECT_EQ(engine.steps(), kCopies);
}

TEST(FaultB, B10_ANumberThatGoesBackwardsIsRefusedAndNotCarriedOut) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  const std::vector<int> all(kCopies, 1);
  trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, all));
  const std::vector<std::byte> step = trainer.StepPayload({0, 0, 0, 0}, all);
  trainer.Ask(FrameType::kStep, 3, step);
  trainer.Ask(FrameType::kStep, 4, step);
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 3, step), "BAD_STATE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 0, step), "BAD_STATE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, ~std::uint64_t{0}, step), "BAD_STATE");
  EXPECT_EQ(engine.steps(), 2 * kCopies);
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 5, step), "no error");
}

/// JSON that no message may be.
std::vector<std::string> Monsters(const std::string& members) {
  return {
      "{" + members + ",\"x\":" + std::string(10000, '[') + std::string(10000, ']') + "}",
      "{" + members + ",\"x\":" + std::string(65, '[') + std::string(65, ']') + "}",
      "{" + members + ",\"x\":1,\"x\":1}",
      "{" + members + ",\"y\":{\"x\":1,\"x\":1}}",
      "{" + members + ",\"x\":\"\xc3\x28\"}",
      "{" + members + ",\"x\":\"\xed\xa0\x80\"}",
      "{" + members + ",\"x\":NaN}",
      "{" + members + ",\"x\":Infinity}",
      "{" + members + ",\"x\":1e999}",
      "{" + members + ",\"x\":\"" + std::string(std::size_t{1} << 20, 'a') + "\"}",
      "{" + members,
      "{" + members + "} {}",
      "[" + members + "]",
      "null",
  };
}

TEST(FaultB, B11_MonstersOfJsonAreMalformedAtEitherEnd) {
  const auto parsers = {
      +[](std::span<const std::byte> payload) { return ParseHello(payload).status(); },
      +[](std::span<const std::byte> payload) { return ParseWelcome(payload).status(); },
      +[](std::span<const std::byte> payload) { return ParseConfigure(payload).status(); },
      +[](std::span<const std::byte> payload) { return ParseSpec(payload).status(); },
      +[](std::span<const std::byte> payload) { return ParseError(payload).status(); },
  };
  for (const std::string& monster : Monsters(R"("protocol":[2,2])")) {
    for (const auto& parse : parsers) {
      const Status status = parse(Bytes(monster));
      EXPECT_FALSE(status.ok()) << monster.substr(0, 60);
      EXPECT_EQ(FaultName(status), "MALFORMED") << monster.substr(0, 60);
      EXPECT_LT(status.message().size(), 300u) << "an error is a line, not the monster again";
    }
  }
}

TEST(FaultB, B11_DepthOf64AndAMebibyteAreStillTaken) {
  const std::string deep = R"({"protocol":[2,2],"x":)" + std::string(63, '[') + std::string(63, ']') + "}";
  EXPECT_TRUE(ParseHello(Bytes(deep)).ok());
  std::string large = R"({"protocol":[2,2],"x":")";
  large += std::string((std::size_t{1} << 20) - large.size() - 2, 'a') + "\"}";
  ASSERT_EQ(large.size(), std::size_t{1} << 20);
  EXPECT_TRUE(ParseHello(Bytes(large)).ok());
  large.insert(large.size() - 2, "a");
  EXPECT_FALSE(ParseHello(Bytes(large)).ok());
}

/// SPEC of one behaviour with that observation, whose row is whatever it has to be.
std::string SpecWith(const std::string& observation) {
  return R"({"id":"x","environments":1,"behaviours":[{"name":"default","agents":["agent"],"observation":)" +
         observation + R"(,"action":{"type":"discrete","n":2},"masks_actions":false,)" +
         R"("action_row":{"bytes":4,"leaves":[{"path":"","dtype":"I32","count":1,"offset":0}]},)" +
         R"("observation_row":{"bytes":8,"leaves":[{"path":"","dtype":"F32","count":2,"offset":0}]}}]})";
}

TEST(FaultB, B12_SpacesThatCannotBeAreRefusedBeforeAnythingIsMade) {
  EXPECT_TRUE(ParseSpec(Bytes(SpecWith(R"({"type":"box","shape":[2],"dtype":"F32","low":0,"high":1})"))).ok());
  std::string many;
  for (int i = 0; i < 5000; ++i)
    many += (i > 0 ? "," : "") + std::string(R"({"name":"","space":{"type":"discrete","n":1}})");
  std::string thick;  // each is large, none too large, together beyond all memory
  for (int i = 0; i < 1000; ++i) {
    thick += (i > 0 ? "," : "") + std::string(R"({"name":")") + std::to_string(i) +
             R"(","space":{"type":"discrete","n":268435456}})";
  }
  std::string deep = R"({"type":"discrete","n":2})";
  for (int i = 0; i < 17; ++i) deep = R"({"type":"tuple","spaces":[{"name":"0","space":)" + deep + "}]}";
  for (const std::string& observation : std::vector<std::string>{
           R"({"type":"box","shape":[65536,65536,65536,65536,2],"dtype":"F32","low":0,"high":1})",
           R"({"type":"box","shape":[4294967296,4294967296],"dtype":"F64","low":0,"high":1})",
           R"({"type":"box","shape":[-2],"dtype":"F32","low":0,"high":1})",
           R"({"type":"box","shape":[-2,-1],"dtype":"F32","low":0,"high":1})",
           R"({"type":"box","shape":[0],"dtype":"F32","low":[],"high":[]})",
           R"({"type":"box","shape":[2.5],"dtype":"F32","low":0,"high":1})",
           R"({"type":"box","shape":[9223372036854775807],"dtype":"U8","low":0,"high":1})",
           R"({"type":"discrete","n":4611686018427387904})", R"({"type":"discrete","n":-1})",
           R"({"type":"discrete","n":268435456})", R"({"type":"multi_binary","n":4611686018427387904})",
           R"({"type":"multi_discrete","nvec":[4611686018427387904,4611686018427387904]})",
           R"({"type":"tuple","spaces":[]})", R"({"type":"dict","spaces":[)" + many + "]}",
           R"({"type":"dict","spaces":[)" + thick + "]}", deep, R"({"type":"graph"})", "[]", "null"}) {
    const double start = Now();
    const Status status = ParseSpec(Bytes(SpecWith(observation))).status();
    EXPECT_FALSE(status.ok()) << observation.substr(0, 80);
    EXPECT_EQ(FaultName(status), "MALFORMED") << status.message();
    EXPECT_LT(status.message().size(), 500u);
    EXPECT_LT(Now() - start, 2.0) << observation.substr(0, 80);
  }
  // As many environments as memory has bytes.
  std::string spec = SpecWith(R"({"type":"box","shape":[2],"dtype":"F32","low":0,"high":1})");
  for (const char* environments : {"0", "-1", "9223372036854775807", "2000000"}) {
    std::string changed = spec;
    changed.replace(changed.find("\"environments\":1") + 15, 1, environments);
    EXPECT_FALSE(ParseSpec(Bytes(changed)).ok()) << environments;
  }
}

TEST(FaultB, B13_ObservationsThatAreNoneAreQuoted) {
  using namespace std::string_literals;
  const Layout layout = Layout::Of(*Space::Box(0, 10, {2}));
  const auto parse = [&](std::string_view message) {
    float row[2], reward = 0;
    bool done = false;
    return text1::ParseObservation(message, layout, false, reinterpret_cast<std::byte*>(row), &reward, &done);
  };
  for (const char* message : {"1,2e-1#-3#0", "+1,2#+1#0", "01,2.#.5#1"}) ASSERT_TRUE(parse(message).ok()) << message;
  for (const std::string& message : {"1,2#0"s,
                                     "1,2#0#0#"s,
                                     "#0#0"s,
                                     "1,#0#0"s,
                                     ",2#0#0"s,
                                     "1,,2#0#0"s,
                                     " 1,2#0#0"s,
                                     "1, 2#0#0"s,
                                     "1,2#0#0 "s,
                                     "1e400,2#0#0"s,
                                     "1,2#1e400#0"s,
                                     "0x10,2#0#0"s,
                                     "1,2#0x1#0"s,
                                     "1,2#0#0x"s,
                                     "1,2#0#00"s,
                                     "1,2#0#true"s,
                                     "1,2\0#0#0"s,
                                     "\0"s,
                                     "1,2#0#0\0"s,
                                     "\xEF\xBB\xBF"
                                     "1,2#0#0"s,
                                     "1;2#0#0"s,
                                     "1,2##0"s,
                                     "--1,2#0#0"s,
                                     "1_0,2#0#0"s,
                                     "1.2.3,2#0#0"s}) {
    const Status status = parse(message);
    EXPECT_FALSE(status.ok()) << message;
    EXPECT_THAT(status.message(), AllOf(HasSubstr("observation '"),
                                        AnyOf(HasSubstr("expected"), HasSubstr("is no "), HasSubstr("neither"))))
        << message;
    EXPECT_EQ(status.message().find_first_of("\n\r\0"s), std::string::npos) << "control characters are escaped";
  }
}

TEST(FaultB, B13_SetupsThatAreNoneAreQuoted) {
  using namespace std::string_literals;
  ASSERT_TRUE(text1::ParseSetup("D#3#0#B#1#0,1#10").ok());
  for (const std::string& message :
       {"D#3#0#B#1#0,1#"s, "#D#3#0#B#1#0,1#10"s, "D#3##0#B#1#0,1#10"s, "D#3#0#B#1##10"s, "D#3#0#B#1# 0,1#10"s,
        "D#+3#0#B#1#0,1#10"s, "D#0x3#0#B#1#0,1#10"s, "D#3#0#B#1#0,1e400#10"s, "D#3#0#B#1#0,1#1e1"s, "d#3#0#B#1#0,1#10"s,
        "D#3\0#0#B#1#0,1#10"s,
        "\xEF\xBB\xBF"
        "D#3#0#B#1#0,1#10"s}) {
    const auto setup = text1::ParseSetup(message);
    ASSERT_FALSE(setup.ok()) << message;
    EXPECT_THAT(setup.status().message(), HasSubstr("setup '"));
  }
}

TEST(FaultB, B15_DecimalCommasOfAPeerAreHintedAt) {
  const Layout layout = Layout::Of(*Space::Box(0, 10, {2}));
  const auto parse = [&](std::string_view message) {
    float row[2], reward = 0;
    bool done = false;
    return text1::ParseObservation(message, layout, false, reinterpret_cast<std::byte*>(row), &reward, &done).message();
  };
  EXPECT_THAT(parse("1,5,2,5#0#0"), AllOf(HasSubstr("4 numbers, expected 2"), HasSubstr("decimal commas")));
  EXPECT_THAT(parse("1,2#0,5#0"), AllOf(HasSubstr("'0,5'"), HasSubstr("decimal comma")));
  EXPECT_EQ(parse("1,5,2#0#0").find("decimal"), std::string::npos) << "three are just too many";
}

TEST(FaultB, B17_AnEngineOfAnotherVersionSaysWhichItSpeaks) {
  const Engine engine;
  for (const std::pair<int, int>& range : {std::pair(3, 9), std::pair(0, 1)}) {
    RawTrainer trainer(engine.Connect());
    Hello hello;
    hello.lowest = range.first;
    hello.highest = range.second;
    trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
    const Frame frame = trainer.Next();
    ASSERT_EQ(frame.header.type, FrameType::kError);
    const std::string json(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size());
    EXPECT_THAT(json, AllOf(HasSubstr("UNSUPPORTED_VERSION"), HasSubstr(R"("protocol":[2,2])"),
                            HasSubstr(std::to_string(range.first) + " to " + std::to_string(range.second)),
                            HasSubstr("update")));
  }
}

TEST(FaultB, B17_AnEngineThatChoosesAnotherVersionIsRefused) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Accept();
    (void)engine.Next();
    engine.Send(FrameType::kWelcome, 0, R"({"protocol":3,"server":"later","session":1,"max_frame":4096})");
    (void)engine.Next();
  });
  const Status status = EnvClient::Open(engine.Connect(), Impatient(Way::kTcp)).status();
  EXPECT_THAT(status.message(), HasSubstr("protocol 3"));
  peer.join();
}

// Flag 1 needs no agreement: a frame with its CRC is always understood. No other flag is.
TEST(FaultB, B18_EveryOtherFlagIsMalformed) {
  for (int bit = 1; bit < 16; ++bit) {
    std::vector<std::byte> frame = FrameBytes(FrameType::kPing, 0, "");
    const auto flags = static_cast<std::uint16_t>(1u << bit);
    std::memcpy(frame.data() + 6, &flags, sizeof(flags));
    const auto header = ReadHeader(frame.data(), kLargestFrame);
    ASSERT_FALSE(header.ok()) << bit;
    EXPECT_EQ(FaultName(header.status()), "MALFORMED");
  }
}

// MALFORMED is one of the specification's connection errors: after it the server closes.
TEST(FaultB, B11_MalformedJsonEndsTheConnectionAsTheSpecificationSays) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  ASSERT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  trainer.Send(FrameType::kConfigure, 1, "{\"autoreset\":");
  const Frame answer = trainer.Next();
  ASSERT_EQ(answer.header.type, FrameType::kError);
  const auto error = ParseError(answer.payload);
  EXPECT_EQ(error->code, "MALFORMED");
  EXPECT_TRUE(error->ends_connection);
  EXPECT_EQ(static_cast<int>(trainer.Next().header.type), 0) << "closed";
}

}  // namespace
}  // namespace consac
