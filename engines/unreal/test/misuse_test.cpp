// Every node in every wrong order: random sequences of random nodes with random arguments, in worlds that come and go,
// with garbage collected between any two of them. Nothing crashes, nothing is left; whatever fails says why.
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>

#include "consac/nn/network.h"
#include "random_policy.h"

namespace consac::testing {
namespace {

/// A model of the road with random weights, as a file.
void WriteModel(const std::string& path) {
  Rng rng(1, 1);
  PolicyData data = RandomPolicyData(*Space::Box(0, 40, {2}), *Space::Discrete(3), 2, 3, {8}, rng);
  ASSERT_TRUE(Policy::Create(std::move(data), 1)->ToFile(1).Save(path).ok());
}

/// One sequence: objects that were made so far and the next random node on one of them.
class Sequence {
 public:
  /// Of each node: how often it succeeded, how often it failed.
  using Outcomes = std::map<std::uint32_t, std::array<long, 2>>;

  Sequence(std::uint64_t seed, const std::string& folder, Outcomes& outcomes)
      : rng_(seed, 7), folder_(folder), outcomes_(outcomes) {
    Restart();
    if (seed % 3 == 0) Connect();
  }

  void Do() {
    socket_held_.Hold(socket_);
    model_held_.Hold(model_);
    Shim::Collect();
    const std::uint32_t what = Pick(40);
    if (what < 12) {
      SocketNode(what);
    } else if (what < 16) {
      LibraryNode(what);
    } else if (what < 20) {
      ModelNode(what);
    } else if (what < 28) {
      EnvironmentNode(what);
    } else if (what < 36) {
      AgentNode(what);
    } else {
      GameNode(what);
    }
    if (checks_) {
      ++outcomes_[what][result_ == EConsacResult::Failed ? 1 : 0];
      ASSERT_EQ(result_ == EConsacResult::Failed, !error_.IsEmpty()) << "node " << what << ": " << Text(error_);
    }
    checks_ = false;
  }

 private:
  std::uint32_t Pick(std::uint32_t n) { return static_cast<std::uint32_t>(rng_.Below(n)); }

  float Number() {
    static const float kOdd[] = {0.0f,
                                 1.0f,
                                 -1.0f,
                                 40.0f,
                                 1e30f,
                                 -1e-30f,
                                 std::numeric_limits<float>::quiet_NaN(),
                                 std::numeric_limits<float>::infinity(),
                                 -std::numeric_limits<float>::infinity()};
    return kOdd[Pick(9)];
  }
  int32 Whole() {
    static const int32 kOdd[] = {
        0, 1, 2, 3, -1, 40, 65535, 65536, std::numeric_limits<int32>::max(), std::numeric_limits<int32>::min()};
    return kOdd[Pick(10)];
  }
  TArray<float> Numbers() {
    TArray<float> numbers;
    for (std::uint32_t k = Pick(5); k > 0; --k) numbers.Add(Pick(3) == 0 ? Number() : static_cast<float>(Pick(41)));
    return numbers;
  }
  FConsacSpace AnySpace() {
    if (Pick(2) == 0) return Pick(2) == 0 ? RoadSeen() : RoadDone();
    FConsacSpace space;
    space.Kind = static_cast<EConsacSpaceKind>(Pick(5));  // one beyond the last
    space.Size = Pick(3) == 0 ? Whole() : static_cast<int32>(Pick(5));
    // Refused, not allocated; now and then the largest that is not.
    if (space.Size > 100000) space.Size = Pick(100) == 0 ? 1 << 24 : Pick(2) == 0 ? 2000000000 : (1 << 24) + 1;
    for (std::uint32_t k = Pick(4); k > 0; --k) space.Low.Add(Number());
    for (std::uint32_t k = Pick(4); k > 0; --k) space.High.Add(Number());
    for (std::uint32_t k = Pick(4); k > 0; --k) space.Choices.Add(static_cast<int32>(Pick(5)) - 1);
    for (std::uint32_t k = Pick(3); k > 0; --k) space.Shape.Add(static_cast<int32>(Pick(5)) - 1);
    space.bBytes = Pick(2) == 0;
    return space;
  }
  FString AnyText() {
    static const char* const kOdd[] = {
        "", "1", "2\n", "0.5,-0.7", "1#2#3", "nan", "99999999999999999999", "Õ😀", "#", "D#3#0#B#2#0,0,40,40#10"};
    return Text(std::string(kOdd[Pick(10)]));
  }
  FString AnyPath() {
    static const char* const kOdd[] = {"", "/", "/nowhere/x", "model.consac", "broken.consac", "new.consac"};
    return Text(folder_ + "/" + kOdd[Pick(6)]);
  }
  FName AnyName() {
    static const TCHAR* const kOdd[] = {TEXT(""), TEXT("places"), TEXT("walk"), TEXT("fly")};
    return FName(kOdd[Pick(4)]);
  }

  void SocketNode(std::uint32_t what) {
    if (socket_ == nullptr || what == 0) {
      // Mostly a port of one's own; now and then the one that the last socket has.
      const int32 port = Pick(4) == 0 && socket_ != nullptr ? socket_->GetOpenPort() : Pick(8) == 0 ? Whole() : 0;
      if (port == 1 || port == 2 || port == 3 || port == 40 || port == 65535) return;
      socket_ = UConsacBlueprintLibrary::CreateConsacSocket(
          Pick(2) == 0 ? nullptr : actor_, Pick(8) == 0 ? AnyText() : FString(TEXT("127.0.0.1")), port);
      if (Pick(8) == 0) socket_->SetAddress(TEXT("127.0.0.1"), 0);
      return;
    }
    EConsacAnswer answer = EConsacAnswer::Failed;
    FString text;
    checks_ = what != 2 && what != 3 && what != 6 && what != 8 && what < 9;
    switch (what) {
      case 1:
        socket_->OpenSocket(result_, error_);
        break;
      case 2:
        socket_->CloseSocket();
        break;
      case 3:
        socket_->CheckConnection(answer, error_);
        break;
      case 4:
        socket_->AcceptConnection(result_, text, error_);
        break;
      case 5:
        socket_->SendData(AnyText(), result_, error_);
        break;
      case 6:
        socket_->CheckPendingData(answer, error_);
        break;
      case 7:
        socket_->AcceptPendingData(result_, text, error_);
        break;
      case 8:
        socket_->CloseConnection();
        break;
      case 9: {
        UConsacWaitMessageAction* action = UConsacWaitMessageAction::WaitAndAcceptMessage(
            Pick(4) == 0 ? nullptr : actor_, Pick(4) == 0 ? nullptr : socket_, Pick(2) == 0 ? Number() : 0.05f);
        // What a waiting node tells may close what it waits for.
        action->OnFailed.ShimBind(nullptr, [this](const FString&, const FString& error) {
          EXPECT_FALSE(error.IsEmpty());
          socket_->CloseConnection();
        });
        action->OnMessage.ShimBind(nullptr, [this](const FString&, const FString&) { socket_->CloseSocket(); });
        action->Activate();
        break;
      }
      case 10:
        // A client that comes, says something, and perhaps goes.
        if (socket_->IsOpen()) {
          auto client = ConnectTcp({"127.0.0.1", socket_->GetOpenPort()}, 0.2);
          if (client.ok()) {
            const std::string text_sent = Text(AnyText());
            (void)(*client)->Write(std::as_bytes(std::span(text_sent)), 0.1);
            if (Pick(2) == 0) client_ = std::move(*client);
          }
        }
        break;
      default:
        EXPECT_EQ(socket_->IsOpen(), socket_->GetOpenPort() > 0);
    }
  }

  /// The right order, so that what comes after it is tried as well.
  void Connect() {
    socket_ = UConsacBlueprintLibrary::CreateConsacSocket(actor_, TEXT("127.0.0.1"), 0);
    socket_->OpenSocket(result_, error_);
    auto client = ConnectTcp({"127.0.0.1", socket_->GetOpenPort()}, 1.0);
    if (!client.ok()) return;
    client_ = std::move(*client);
    EConsacAnswer answer = EConsacAnswer::No;
    FString text;
    for (int k = 0; k < 1000 && answer == EConsacAnswer::No; ++k) socket_->CheckConnection(answer, error_);
    socket_->AcceptConnection(result_, text, error_);
    (void)client_->Write(std::as_bytes(std::span(std::string_view("1\n2\n3\n"))), 0.1);
  }

  void LibraryNode(std::uint32_t what) {
    FString message;
    checks_ = true;
    if (what == 12) {
      UConsacBlueprintLibrary::CompileEnvironmentMessage(AnySpace(), Numbers(), Number(), Pick(2) == 0, result_,
                                                         message, error_);
    } else if (what == 13) {
      UConsacBlueprintLibrary::CompileTrainingData(AnySpace(), AnySpace(), Whole(), AnyText(), result_, message,
                                                   error_);
    } else if (what == 14) {
      FConsacAction action;
      UConsacBlueprintLibrary::DecodeAction(AnySpace(), AnyText(), result_, action, error_);
    } else {
      FConsacProgramSettings settings;
      settings.Program = AnyPath();
      settings.Program = settings.Program == Text(folder_ + "/") ? FString() : settings.Program;
      settings.RunName = AnyText();
      UConsacTrainerProgram* program = nullptr;
      // No file of the folder can be executed: nothing is started, everything is asked for.
      UConsacBlueprintLibrary::StartTrainerProgram(actor_, settings, result_, program, error_);
      if (program != nullptr) program->Stop();
      EXPECT_TRUE(program == nullptr || !program->IsRunning());
    }
  }

  void ModelNode(std::uint32_t what) {
    if (model_ == nullptr || what == 16) {
      UConsacModel* loaded = nullptr;
      UConsacBlueprintLibrary::LoadConsacModel(actor_, Pick(2) == 0 ? AnyPath() : Text(folder_ + "/model.consac"),
                                               result_, loaded, error_);
      ASSERT_EQ(loaded != nullptr, result_ == EConsacResult::Success);
      model_ = loaded != nullptr ? loaded : NewObject<UConsacModel>();
      checks_ = true;
      return;
    }
    FConsacAction action;
    TArray<float> numbers = Numbers();
    checks_ = true;
    if (what == 17) {
      model_->Predict(numbers, Pick(2) == 0, result_, action, error_);
    } else if (what == 18) {
      model_->PredictMany(numbers, Pick(2) == 0, result_, numbers, error_);
    } else {
      model_->CheckModelSpaces(AnySpace(), AnySpace(), result_, error_);
      EXPECT_FALSE(model_->DescribeModel().IsEmpty());
    }
  }

  void EnvironmentNode(std::uint32_t what) {
    EConsacConnection connection = EConsacConnection::Failed;
    EConsacTraining training = EConsacTraining::Failed;
    FConsacAction action;
    switch (what) {
      case 20:
        environment_->SetupEnvironment(AnySpace(), AnySpace(), Whole(), AnyText(), result_, error_,
                                       Pick(8) == 0 ? AnyText() : FString(TEXT("127.0.0.1")), Pick(8) == 0 ? -1 : 0);
        checks_ = true;
        break;
      case 21:
        environment_->SetupEnvironment(RoadSeen(), RoadDone(), 10, FString(), result_, error_, TEXT("127.0.0.1"), 0);
        checks_ = true;
        break;
      case 22:
        environment_->TrainingConnection(connection, error_);
        ASSERT_EQ(connection == EConsacConnection::Failed, !error_.IsEmpty());
        break;
      case 23:
        environment_->ModelConnection(Pick(3) == 0 ? nullptr : model_, result_, error_);
        checks_ = true;
        break;
      case 24:
        environment_->CloseTraining();
        break;
      case 25:
        environment_->LoopWaitSeconds = Pick(4) == 0   ? -1.0f
                                        : Pick(8) == 0 ? std::numeric_limits<float>::quiet_NaN()
                                                       : 0.0f;
        break;
      default:
        environment_->Train(Pick(3) == 0 ? Numbers() : TArray<float>{1.0f, 2.0f}, Pick(4) == 0 ? Number() : 1.0f,
                            Pick(4) == 0, training, action, error_);
        ASSERT_EQ(training == EConsacTraining::Failed, !error_.IsEmpty()) << Text(error_);
        (void)environment_->GetTrainingProgress();
        (void)environment_->GetTrainingPort();
        (void)environment_->IsTrainingCompleted();
        (void)environment_->GetTrainingParameter(AnyName());
        environment_->RecordTrainingStat(AnyName(), Number());
    }
  }

  void AgentNode(std::uint32_t what) {
    UConsacAgentComponent& agent = *agent_->agent;
    switch (what) {
      case 28:
        agent.SetObservationNumbers(AnyName(), Numbers());
        agent.SetObservationNumber(AnyName(), Number());
        break;
      case 29:
        agent.SetObservationVector(AnyName(), FVector(1.0, 2.0, static_cast<double>(Number())));
        agent.SetObservationChoice(AnyName(), Whole());
        break;
      case 30:
        agent.AddReward(Number());
        if (Pick(4) == 0) agent.Group = AnyName();
        agent.AddGroupReward(Number());
        UConsacBlueprintLibrary::AddGroupReward(Pick(4) == 0 ? nullptr : actor_, AnyName(), Number());
        break;
      case 31:
        agent.EndEpisode(Pick(2) == 0 ? EConsacEpisodeEnd::Terminated : EConsacEpisodeEnd::Truncated);
        break;
      case 32:
        (void)agent.GetActionChoice(AnyName()), (void)agent.GetActionNumber(AnyName(), Whole()),
            (void)agent.GetActionNumbers(AnyName()), (void)agent.GetEnvironmentParameter(AnyName());
        break;
      case 33:
        agent.SetActionChoice(AnyName(), Whole());
        agent.SetActionNumbers(AnyName(), Numbers());
        break;
      case 34:
        agent.SetChoiceAllowed(AnyName(), Whole(), Pick(2) == 0);
        break;
      default: {
        trainer_->Mode = static_cast<EConsacMode>(Pick(4));
        trainer_->TotalSteps = Pick(4) == 0 ? Whole() : 50;
        trainer_->MaxStepsPerTick = Whole() % 5;
        trainer_->FixedStepSeconds = Number();
        static const int32 kRooms[] = {0, 0, 1, 6, -1, 1000, 100000000, 2000000000};
        trainer_->RoomForAgents = kRooms[Pick(8)];
        trainer_->bFixedStep = Pick(2) == 0;
        trainer_->EnvironmentParameters.Reset();
        for (std::uint32_t k = Pick(4) == 0 ? Pick(3) : 0; k > 0; --k) {
          FConsacParameter parameter;
          parameter.Name = AnyName();
          parameter.Default = static_cast<double>(Number());
          parameter.bBounded = Pick(2) == 0;
          parameter.High = static_cast<double>(Number());
          parameter.Training = Pick(2) == 0 ? FString() : AnyText();
          trainer_->EnvironmentParameters.Add(parameter);
        }
        if (Pick(2) == 0) trainer_->StopTraining();
        if (Pick(2) == 0) trainer_->StartTraining(result_, error_), checks_ = true;
        if (Pick(4) == 0) trainer_->SaveModel(AnyText(), AnyPath(), result_, error_), checks_ = true;
        (void)trainer_->GetTrainerProgress(), (void)trainer_->GetTrainerPort();
      }
    }
  }

  void GameNode(std::uint32_t what) {
    game_->world().shim_paused_ = Pick(8) == 0;
    if (what == 36 && Pick(8) == 0) {
      Restart();
    } else if (what == 37 && Pick(8) == 0) {
      Shim::Destroy(*trainer_);
      SpawnTrainer();
    } else if (what == 38 && Pick(8) == 0) {
      // To another level, at once or with both for a while.
      agent_.reset();
      if (Pick(2) == 0) {
        game_->Travel();
      } else {
        UWorld& before = game_->world();
        game_->OpenWorld();
        for (std::uint32_t k = Pick(3); k > 0; --k) game_->Tick();
        game_->CloseWorld(before);
      }
      Populate();
    } else if (what == 38 && Pick(4) == 0) {
      // A level with a trainer comes, and goes, while another trainer drives.
      AConsacTrainer* first = trainer_;
      SpawnTrainer();
      trainer_->bAutoStart = true;
      game_->Tick();
      Shim::StreamOut(Pick(2) == 0 ? *first : *trainer_);
      if (!trainer_->shim_begun_) trainer_ = first;
    } else if (what == 39 && Pick(8) == 0) {
      // Somebody else plays in the same process.
      other_ = Pick(2) == 0 ? nullptr : std::make_unique<Shim::Game>(Pick(2) == 0 ? NM_Client : NM_ListenServer);
      if (other_ != nullptr) other_->Spawn<AConsacTrainer>();
    } else {
      if (other_ != nullptr) other_->Tick();
      UConsacBlueprintLibrary::RecordStat(Pick(4) == 0 ? nullptr : actor_, AnyName(), Number());
      game_->Tick();
    }
  }

  void SpawnTrainer() {
    trainer_ = game_->SpawnWith<AConsacTrainer>([](AConsacTrainer& made) {
      made.Port = 0;
      made.bAutoStart = false;
      made.LogSeconds = 0.0f;
      made.MaxWaitSeconds = 5.0f;
    });
  }

  void Restart() {
    agent_.reset();
    game_.reset();
    socket_held_.Hold(nullptr);
    model_held_.Hold(nullptr);
    Shim::Collect();
    client_.reset();
    socket_ = nullptr;
    model_ = nullptr;
    game_ = std::make_unique<Shim::Game>(Pick(8) == 0 ? NM_Client : NM_Standalone);
    Populate();
  }

  /// A world's actors.
  void Populate() {
    actor_ = game_->Spawn<AConsacTestActor>();
    environment_ = game_->AddComponent<UConsacEnvironmentComponent>(*actor_);
    agent_ = std::make_unique<RoadAgent>(*game_, 1);
    SpawnTrainer();
  }

  Rng rng_;
  const std::string folder_;
  Outcomes& outcomes_;
  std::unique_ptr<Shim::Game> other_;
  std::unique_ptr<Shim::Game> game_;
  Shim::Held socket_held_, model_held_;
  std::unique_ptr<RoadAgent> agent_;
  std::unique_ptr<Transport> client_;
  AActor* actor_ = nullptr;
  UConsacSocket* socket_ = nullptr;
  UConsacModel* model_ = nullptr;
  UConsacEnvironmentComponent* environment_ = nullptr;
  AConsacTrainer* trainer_ = nullptr;
  EConsacResult result_ = EConsacResult::Failed;
  FString error_;
  bool checks_ = false;
};

// ThreadSanitizer is slow, and what the nodes do has one thread: a part is enough for it.
#if defined(CONSAC_SANITIZED_THREADS)
constexpr std::uint64_t kSequences = 2000;
#else
constexpr std::uint64_t kSequences = 10000;
#endif

TEST(Misuse, TenThousandRandomSequencesOfAllNodes) {
  const ScratchFolder scratch("unreal_misuse");
  WriteModel(scratch.path() + "/model.consac");
  std::ofstream(scratch.path() + "/broken.consac") << "no model";
  const char* const only = std::getenv("CONSAC_SEQUENCE");  // to look at one again
  const std::uint64_t first = only != nullptr ? std::strtoull(only, nullptr, 10) : 0;
  Sequence::Outcomes outcomes;
  for (std::uint64_t seed = first; seed < (only != nullptr ? first + 1 : kSequences); ++seed) {
    Sequence sequence(seed, scratch.path(), outcomes);
    for (int k = 0; k < 30; ++k) {
      sequence.Do();
      if (HasFatalFailure() || HasNonfatalFailure()) FAIL() << "sequence " << seed << ", node " << k;
    }
  }
  if (only != nullptr) return;
  // Both ways of every node were gone; but Start Trainer Program (15) may only fail here, a right Setup Environment
  // (21) only succeed.
  EXPECT_GT(outcomes.size(), 12U);
  for (const auto& [node, counts] : outcomes) {
    EXPECT_TRUE(node == 21 || counts[1] > 100) << "node " << node << " hardly ever failed";
    EXPECT_TRUE(node == 15 || counts[0] > 10) << "node " << node << " hardly ever succeeded";
  }
}

}  // namespace
}  // namespace consac::testing
