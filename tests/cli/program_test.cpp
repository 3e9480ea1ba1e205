// The built program from outside: every bad input is one line and an exit code, never a hang, and nothing is lost.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/conformance_frames.h"
#include "consac/env/buffer.h"
#include "consac/model/model_file.h"
#include "consac/nn/kernels.h"
#include "consac/server/env_client.h"
#include "tests/cli/program_fixture.h"
#include "tests/support.h"

namespace consac {
namespace {

using testing::ExpectRefusal;
using testing::Outcome;
using testing::Program;
using testing::ProgramTest;
using testing::RunProgram;
using testing::TextOf;

TEST_F(ProgramTest, UnknownNamesFindTheirNearest) {
  ExpectRefusal(RunProgram(folder(), {"trian"}), 2, "'train'");
  ExpectRefusal(RunProgram(folder(), {"train", "raod-v0"}), 2, "'road-v0'");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--algo", "pp2"}), 2, "'ppo");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--set", "learnin_rate=1"}), 2, "'learning_rate'");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--set", "gamma=2"}), 2, "gamma");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--set", "gamma"}), 2, "key=value");
  ExpectRefusal(RunProgram(folder(), {"train"}), 2, "nothing to train on");
  ASSERT_EQ(mkfifo((folder() + "/pipe").c_str(), 0600), 0);
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--config", "pipe"}), 2, "'pipe' is no regular file");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--config", "/dev/zero"}), 2, "'/dev/zero' is no regular");
  ExpectRefusal(RunProgram(folder(), {"serve", "rode-v0"}), 2, "'road-v0'");
  ExpectRefusal(RunProgram(folder(), {"list", "wrolds"}), 2, "'worlds'");
  ExpectRefusal(RunProgram(folder(), {"bench", "--only", "cartpol"}), 2, "'cartpole'");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--frobnicate"}), 2, "--frobnicate");
}

/// The first hundred steps of the row only fill the replay.
TEST_F(ProgramTest, BenchCountsUpdatesWhereOneIsInAStep) {
  const Outcome run = RunProgram(folder(), {"bench", "--only", "td3", "--repeats", "1", "--processor-time", "--json"});
  ASSERT_EQ(run.code, 0) << run.error;
  const nlohmann::json row = nlohmann::json::parse(run.out)["rows"][0];
  EXPECT_EQ(row["unit"], "k updates/s");
  EXPECT_NEAR(1e3 * row["value"].get<double>() * row["seconds"].get<double>(), 10000 - 100, 1e-3);
}

TEST_F(ProgramTest, BenchSaysWhyATrainingFails) {
  ASSERT_EQ(setenv("TMPDIR", "/proc", 1), 0);
  const Outcome run = RunProgram(folder(), {"bench", "--only", "td3", "--repeats", "1"});
  ASSERT_EQ(unsetenv("TMPDIR"), 0);
  ExpectRefusal(run, 1, "'/proc/consac_bench_");
  EXPECT_NE(run.out.find("nan k updates/s"), std::string::npos) << run.out;
}

TEST_F(ProgramTest, NumbersThatCannotBeMeantAreRefusedByEveryVerb) {
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--steps", "0", "--name", "z"}), 2, "at least 1");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--seed", "-1"}), 2, "seed = '-1'");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--seed", "99999999999999999999"}), 2, "seed");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--steps", "1.5"}), 2, "whole number");
  ExpectRefusal(RunProgram(folder(), {"train", "tcp://127.0.0.1:1", "--deadline", "nan"}), 2, "deadline_s");
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--rate", "nan"}), 2, "--rate");
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--port", "70000"}), 2, "from 0 to 65535");
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--port", "0", "--model", "a#b"}), 2, "--model: ");
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--port", "5", "--port", "6"}), 2,
                "--port is given more than");
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--protocol", "text1", "--token", "x"}), 2,
                "take --protocol 2");
  ExpectRefusal(RunProgram(folder(), {"play", "x", "--delay", "inf"}), 2, "--delay");
  ExpectRefusal(RunProgram(folder(), {"eval", "x", "--episodes", "0"}), 2, "at least 1");
  ExpectRefusal(RunProgram(folder(), {"eval", "x", "--episodes", "1e30"}), 2, "from 1 to 9000000000000000000");
  EXPECT_EQ(RunProgram(folder(), {"train", "road-v0", "--steps", "1e3", "--name", "e", "--no-table"}).code, 0);
}

TEST_F(ProgramTest, OptionsThatContradictAreRefused) {
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--forever"}), 2, "--forever");
  ExpectRefusal(RunProgram(folder(), {"train", "--resume", "--force", "--name", "x"}), 2, "--resume");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--name", ""}), 2, "--name is empty");
}

TEST_F(ProgramTest, AFullOrClosedOutputIsNoticedAndStopsNothing) {
  const std::string program = CONSAC_PROGRAM, there = "cd " + folder() + " && ";
  const auto code = [&](const std::string& command) {
    const int status = std::system((there + command).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  for (const char* arguments :
       {"list worlds", "list hyperparameters ppo2 --json", "train --help", "--version",
        "train road-v0 --steps 600 --name full", "train road-v0 --steps 300 --force --name json --json",
        "inspect runs/full/model.consac", "eval full road-v0 --episodes 2"}) {
    EXPECT_EQ(code(program + " " + arguments + " > /dev/full 2> told"), 6) << arguments;
    const std::string error = TextOf(folder() + "/told"),
                      verb = std::string(arguments).substr(0, std::string(arguments).find(' '));
    EXPECT_EQ(error,
              "consac" + (verb[0] == '-' ? "" : " " + verb) +
                  ": standard output could not be written: No space left on device; let it go where there is room\n");
  }
  EXPECT_TRUE(Policy::Load(folder() + "/runs/full/model.consac").ok()) << "nothing is lost";
  EXPECT_EQ(code("{ " + program + " list hyperparameters ppo2; echo $? > closed; } | true"), 0);
  EXPECT_EQ(TextOf(folder() + "/closed"), "0\n") << "a reader that leaves is no error";
  EXPECT_EQ(code("{ " + program + " train road-v0 --steps 2000 --name piped; echo $? > train; } | head -1 > one"), 0);
  EXPECT_EQ(TextOf(folder() + "/train"), "0\n");
  EXPECT_TRUE(Policy::Load(folder() + "/runs/piped/model.consac").ok()) << "it trains to its end all the same";
}

TEST_F(ProgramTest, WarningsThatNobodyTakesStopNothing) {
  const std::string there = "cd " + folder() + " && ", program = CONSAC_PROGRAM;
  (void)SmallRun("warned");
  const std::string resume = program + " train --resume --name warned --steps 900 --no-table";
  for (const char* away : {" 2> /dev/full", " 2>&1 | head -1 > one"}) {
    std::ofstream(folder() + "/runs/warned/checkpoints/step_000000999999.consac") << "damaged, which is a warning";
    const int status = std::system((there + "{ " + resume + "; echo $? > code; }" + away).c_str());
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(TextOf(folder() + "/code"), "0\n") << away;
  }
}

TEST_F(ProgramTest, EveryConformanceCaseHoldsForOurServer) {
  EnvServerOptions options;
  options.training_length = 1000000;
  const testing::ServedWorld engine("cartpole-v1", options);
  const Outcome outcome = RunProgram(folder(), {"doctor", "--conformance", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_EQ(outcome.out.find("FAILS"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("cases of protocol 2 hold"), std::string::npos) << outcome.out;
  ExpectRefusal(RunProgram(folder(), {"doctor", "--conformance", "tcp://127.0.0.1:1"}), 3, "nobody answers");
}

/// Begins a session at `port` and steps until it is over; false when nobody listens there for 3 s.
bool StepUntilTheEnd(int port) {
  const Endpoint endpoint{"127.0.0.1", port};
  Result<std::unique_ptr<Transport>> transport = ConnectTcp(endpoint, 1.0);
  for (const double end = Now() + 3.0; !transport.ok() && Now() < end; transport = ConnectTcp(endpoint, 1.0))
    usleep(10000);
  if (!transport.ok()) return false;
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  options.deadline_s = 12.0;  // so long it steps where nobody takes part (R77)
  options.reconnect = [&] { return ConnectTcp(endpoint, 1.0); };
  Result<std::unique_ptr<EnvClient>> client = EnvClient::Open(std::move(*transport), options);
  if (!client.ok()) return true;
  std::vector<BatchBuffer> buffers;
  std::vector<Batch> batches;
  for (const BehaviourSpec& behaviour : (*client)->spec().behaviours)
    batches.push_back(buffers.emplace_back(behaviour).batch());
  for (Status status = (*client)->Reset(1, batches); status.ok();) {
    for (std::size_t b = 0; b < batches.size(); ++b) {
      buffers[b].Advance();
      batches[b] = buffers[b].batch();
      const std::size_t row_bytes = (*client)->spec().behaviours[b].action_layout.row_bytes;
      std::memset(batches[b].actions, 0, batches[b].slots.size() * row_bytes);
      const Layout& layout = (*client)->spec().behaviours[b].action_layout;
      for (std::size_t slot = 0; batches[b].action_masks != nullptr && slot < batches[b].slots.size(); ++slot) {
        cli::MakeLegal(layout, batches[b].action_masks + slot * static_cast<std::size_t>(layout.mask_bytes),
                       batches[b].actions + slot * row_bytes);
      }
    }
    if ((*client)->prices_goals()) {
      const std::int64_t row_bytes = (*client)->spec().behaviours[0].observation_layout.row_bytes;
      const std::vector<std::byte> rows(static_cast<std::size_t>(2 * row_bytes));
      float rewards[2];
      if (!(*client)->PriceGoals(0, rows.data(), 2, rewards).ok()) return true;
    }
    status = (*client)->Step(batches, MoreSteps::kYes);
  }
  return true;
}

TEST_F(ProgramTest, EveryConformanceCaseHoldsForOurTrainer) {
  Program doctor(folder(), {"doctor", "--conformance-trainer", "tcp://127.0.0.1:0", "--timeout", "30"});
  const auto said = [&] { return doctor.out().find('\n') != std::string::npos; };
  for (int i = 0; i < 500 && !said(); ++i) usleep(10000);
  const std::string told = "listening on tcp://127.0.0.1:", line = doctor.out();
  ASSERT_EQ(line.rfind(told, 0), 0u) << line;
  const int port = std::atoi(line.c_str() + told.size());
  while (StepUntilTheEnd(port)) {
  }
  const Outcome outcome = doctor.Wait();
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_EQ(outcome.out.find("FAILS"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("cases of protocol 2 hold"), std::string::npos) << outcome.out;
  for (const char* name : {"nobody takes part for as long", "other goals have rewards, and", "REWARDS with infinity"})
    EXPECT_NE(outcome.out.find(std::string("holds        ") + name), std::string::npos) << outcome.out;
}

TEST_F(ProgramTest, ManyWorldsOfAnEngineAreLearnedOverProtocol2) {
  Program serve(folder(),
                {"serve", "cartpole-v1", "--envs", "8", "--port", "0", "--port-file", "port", "--sessions", "1"});
  std::string port;
  for (int i = 0; i < 500 && port.empty(); ++i) {
    port = TextOf(folder() + "/port");
    usleep(10000);
  }
  const Outcome trained = RunProgram(folder(), {"train", "tcp://127.0.0.1:" + port.substr(0, port.size() - 1),
                                                "--steps", "8192", "--name", "many", "--no-table", "--no-tensorboard"});
  EXPECT_EQ(trained.code, 0) << trained.error;
  EXPECT_NE(trained.out.find("protocol 2 in shared memory, 8 environments"), std::string::npos) << trained.out;
  EXPECT_NE(serve.Wait().out.find("session 1: 8192 steps"), std::string::npos);
}

TEST_F(ProgramTest, BeyondLoopbackNeedsAToken) {
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--host", "0.0.0.0", "--port", "0"}), 2, "--token");
}

TEST_F(ProgramTest, ForeignFilesSayWhatTheyAreNot) {
  std::ofstream(folder() + "/notes.txt") << "# these are only notes\n";
  ExpectRefusal(RunProgram(folder(), {"inspect", "notes.txt"}), 6, "no .consac file");
  ExpectRefusal(RunProgram(folder(), {"inspect", "/dev/null"}), 2, "no regular file");
}

TEST_F(ProgramTest, WhatAModelSaysOfItselfAddsNoLineOfItsOwn) {
  ModelFile file;
  file.spec_json = R"({"kind":"a\u001b[2J\ntraining completed","x":"\u202e\u009b2J"})";
  ASSERT_TRUE(file.Save(folder() + "/odd.consac").ok());
  const Outcome outcome = RunProgram(folder(), {"inspect", "odd.consac"});
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("kind         a\\x1b[2J\\x0atraining completed\n"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find_first_of("\x1b\x9b"), std::string::npos);
  EXPECT_EQ(outcome.out.find("\xe2\x80\xae"), std::string::npos) << "it would turn the direction of writing";
}

TEST_F(ProgramTest, PortsAndPeersThatAreNotThere) {
  auto listener = ListenTcp({"127.0.0.1", 0});
  const std::string port = std::to_string((*listener)->port());
  ExpectRefusal(RunProgram(folder(), {"serve", "road-v0", "--port", port}), 2, port);
  // Somebody listens but is no engine.
  Program trainer(folder(), {"train", "tcp://127.0.0.1:" + port, "--no-progress", "--no-table"});
  auto accepted = (*listener)->Accept(5.0);
  const std::string_view banner = "SSH-2.0-OpenSSH_9.2\r\n";
  ASSERT_TRUE((*accepted)->Write(std::as_bytes(std::span(banner)), 1.0).ok());
  ExpectRefusal(trainer.Wait(), 3, "SSH-2.0");
  Program doctor(folder(), {"doctor", "tcp://127.0.0.1:" + port});
  accepted = (*listener)->Accept(5.0);
  ASSERT_TRUE((*accepted)->Write(std::as_bytes(std::span(banner)), 1.0).ok());
  ExpectRefusal(doctor.Wait(), 3, "SSH-2.0");
  (*listener)->Close();
  ExpectRefusal(RunProgram(folder(), {"doctor", "tcp://127.0.0.1:" + port}), 3, "nobody answers");
  const Outcome nobody = RunProgram(folder(), {"train", "tcp://127.0.0.1:" + port, "--connect-timeout", "2"});
  ExpectRefusal(nobody, 3, "nobody answers");
  EXPECT_NE(nobody.out.find("waiting for an engine"), std::string::npos) << nobody.out;
  ExpectRefusal(RunProgram(folder(), {"train", "tcp://nowhere"}), 2, "tcp://host:port");
}

TEST_F(ProgramTest, BadConfigurationsNameFileAndLine) {
  std::ofstream(folder() + "/run.yaml") << "world: road-v0\nsteps: 100\ngama: 0.9\n";
  ExpectRefusal(RunProgram(folder(), {"train", "--config", "run.yaml"}), 2, "run.yaml:3");
  std::ofstream(folder() + "/run.yaml") << "world: [unclosed\n";
  ExpectRefusal(RunProgram(folder(), {"train", "--config", "run.yaml"}), 2, "run.yaml");
  ExpectRefusal(RunProgram(folder(), {"train", "--config", "absent.yaml"}), 2, "absent.yaml");
}

TEST_F(ProgramTest, ClosedStreamsLandInNoFile) {
  const std::string command = "cd " + folder() + " && " + CONSAC_PROGRAM +
                              " train road-v0 --steps 2000 --name closed --set n_steps=64 <&- >&- 2>&-";
  EXPECT_EQ(std::system(command.c_str()), 0);
  const std::string progress = TextOf(folder() + "/runs/closed/progress.csv");
  EXPECT_FALSE(progress.empty());
  EXPECT_EQ(progress.find("training"), std::string::npos) << progress;
  EXPECT_EQ(progress.find("---"), std::string::npos) << "a table";
}

TEST_F(ProgramTest, AFloodOfSessionsThatComeToNothingIsToldInAFewLines) {
  Program engine(folder(), {"serve", "road-v0", "--port", "0", "--port-file", "port"});
  for (int i = 0; i < 500 && TextOf(folder() + "/port").empty(); ++i) usleep(20000);
  for (int i = 0; i < 12; ++i) {
    auto talker = *ConnectTcp({"127.0.0.1", std::stoi(TextOf(folder() + "/port"))}, 2.0);
    ASSERT_TRUE(talker->Write(std::as_bytes(std::span(std::string_view("left\n"))), 2.0).ok());
    std::byte bytes[4096];
    while (talker->Read(bytes, 5.0).ok()) continue;
    usleep(200000);  // the next one is another session
  }
  engine.Signal(SIGINT);
  const Outcome outcome = engine.Wait();
  EXPECT_LT(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 9) << outcome.out;
  EXPECT_NE(outcome.out.find("more like it)"), std::string::npos) << outcome.out;
}

TEST_F(ProgramTest, ATokenMayComeFromTheEnvironment) {
  setenv("CONSAC_TOKEN", "sesame", 1);
  Program engine(folder(), {"serve", "road-v0", "--port", "0", "--port-file", "port"});
  for (int i = 0; i < 500 && TextOf(folder() + "/port").empty(); ++i) usleep(20000);
  const std::string port = TextOf(folder() + "/port");
  const std::string url = "tcp://127.0.0.1:" + port.substr(0, port.size() - 1);
  EXPECT_EQ(RunProgram(folder(), {"doctor", url}).code, 0);
  SmallRun("walker");
  EXPECT_EQ(RunProgram(folder(), {"eval", "walker", url, "--episodes", "1"}).code, 0);
  EXPECT_EQ(RunProgram(folder(), {"play", "walker", url, "--steps", "3"}).code, 0);
  const Outcome judged = RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--eval-every", "100", "--name",
                                               "judged", "--set", "eval_world=" + url, "eval_episodes=1"});
  EXPECT_NE(judged.out.find("evaluation after 300 steps"), std::string::npos) << judged.out;
  EXPECT_EQ(RunProgram(folder(), {"doctor", url, "--token", "wrong"}).code, 2) << "a flag overrules it";
  unsetenv("CONSAC_TOKEN");
  EXPECT_EQ(RunProgram(folder(), {"doctor", url}).code, 2);
  EXPECT_EQ(RunProgram(folder(), {"eval", "walker", url, "--episodes", "1"}).code, 2);
  EXPECT_EQ(RunProgram(folder(), {"eval", "walker", url, "--episodes", "1", "--token", "sesame"}).code, 0);
  EXPECT_EQ(RunProgram(folder(), {"play", "walker", url, "--steps", "3", "--token", "sesame"}).code, 0);
}

TEST_F(ProgramTest, EveryVerbHasHelpWithExamples) {
  for (const char* verb : {"demo", "serve", "train", "eval", "play", "list", "inspect", "bench", "doctor"}) {
    const Outcome outcome = RunProgram(folder(), {verb, "--help"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.out.find("Examples:\nconsac " + std::string(verb)), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("Exit codes"), std::string::npos);
  }
}

TEST_F(ProgramTest, TheVersionSaysTheCommitAndTheInstructionSets) {
  std::string sets;
  for (const std::string_view name : nn::InstructionSets()) sets.append(" ").append(name);
  EXPECT_THAT(RunProgram(folder(), {"--version"}).out,
              ::testing::MatchesRegex("consac " CONSAC_VERSION "\ncommit ([0-9a-f]+[+]?|unknown)\ninstruction sets" +
                                      sets + " \\(the first is used\\)\n"));
}

TEST_F(ProgramTest, ListsComeFromTheTables) {
  const std::string worlds_list = RunProgram(folder(), {"list", "worlds"}).out;
  for (const worlds::World& world : worlds::Worlds()) EXPECT_NE(worlds_list.find(world.id), std::string::npos);
  const std::string json = RunProgram(folder(), {"list", "hyperparameters", "ppo", "--json"}).out;
  EXPECT_NE(json.find("\"gae_lambda\""), std::string::npos);
  EXPECT_NE(RunProgram(folder(), {"list", "policies"}).out.find("MlpPolicy"), std::string::npos);
  const std::string one = RunProgram(folder(), {"list", "hyperparameters", "sac", "tau"}).out;
  EXPECT_NE(one.find("tau"), std::string::npos);
  EXPECT_EQ(one.find("gamma"), std::string::npos) << one;
  const std::vector<std::string> value_network = {"list", "hyperparameters", "sac", "value_network", "--json"};
  const auto with = [&](const std::string& preset) {
    std::vector<std::string> arguments = value_network;
    arguments.insert(arguments.end(), {"--preset", preset});
    return RunProgram(folder(), arguments);
  };
  EXPECT_NE(with("sb2").out.find("\"default\": \"true\""), std::string::npos);
  EXPECT_EQ(with("sb3").out, RunProgram(folder(), value_network).out);
  ExpectRefusal(RunProgram(folder(), {"list", "worlds", "--preset", "sb2"}), 2, "'list hyperparameters' alone");
  EXPECT_NE(with("sb4").error.find("there are no defaults 'sb4'; expected sb2 or sb3"), std::string::npos);
  const Outcome none = RunProgram(folder(), {"list", "hyperparameters", "sac", "gamm"});
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.error.find("unknown hyperparameter 'gamm' (did you mean 'gamma'?)"), std::string::npos) << none.error;
}

TEST_F(ProgramTest, TheDemoTellsTheWholeStory) {
  const Outcome outcome = RunProgram(folder(), {"demo", "--steps", "2000"});
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  for (const char* part :
       {"1. An engine", "2. The trainer", "3. The saved model", "observation [10,", "curve.png", "steps nearer"}) {
    EXPECT_NE(outcome.out.find(part), std::string::npos) << part;
  }
  EXPECT_FALSE(TextOf(folder() + "/runs/demo/curve.png").empty());
}

}  // namespace
}  // namespace consac
