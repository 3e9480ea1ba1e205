// consac serve: be the engine's side for a built-in world.
#include "cli/flags.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/base/names.h"
#include "consac/base/refusals.h"
#include "consac/base/text.h"
#include "consac/run/shortage.h"
#include "consac/server/env_server.h"
#include "worlds/registry.h"

namespace consac::cli {
namespace {

constexpr std::int64_t kDefaultSteps = 100000;

struct ServeFlags {
  std::string world, host = "127.0.0.1", port_file, model, token, protocol = "auto";
  std::int64_t port = 5005, steps = -1, sessions = 0, seed = 0, envs = 1, trainers = 16;  // steps: -1 is not given
  double rate = 0.0, deadline = 60.0, quiet_time = 0.002;
  bool no_newline = false, wait_after_end = false;
};

Result<std::unique_ptr<VectorEnv>> MakeWorlds(const ServeFlags& flags) {
  return worlds::MakeWorld(flags.world, static_cast<std::int32_t>(flags.envs));
}

Result<std::unique_ptr<EnvServer>> OpenServer(const ServeFlags& flags, VectorEnv& env) {
  Endpoint endpoint;
  endpoint.host = flags.host;
  endpoint.port = static_cast<int>(flags.port);
  Result<std::unique_ptr<Listener>> listener = ListenTcp(endpoint);
  if (!listener.ok()) return listener.status();
  EnvServerOptions options;
  const std::int64_t unless_given = flags.model.empty() ? kDefaultSteps : 0;  // 0 asks for the model to act
  options.training_length = flags.steps >= 0 ? flags.steps : unless_given;
  options.model_name = flags.model;
  options.token = flags.token;
  options.protocol = flags.protocol == "text1" ? Protocol::kText1
                     : flags.protocol == "2"   ? Protocol::kProtocol2
                                               : Protocol::kAuto;
  options.seed = static_cast<std::uint64_t>(flags.seed);
  options.terminator = flags.no_newline ? text1::Terminator::kNone : text1::Terminator::kNewline;
  options.min_step_s = flags.rate > 0.0 ? 1.0 / flags.rate : 0.0;
  options.deadline_s = flags.deadline;
  options.quiet_s = flags.quiet_time;
  options.wait_after_end = flags.wait_after_end;
  options.max_sessions = static_cast<std::int32_t>(flags.trainers);
  options.make_env = [flags] {
    auto worlds = run::Guarded([&] { return MakeWorlds(flags); });
    return worlds.ok() ? std::move(*worlds) : nullptr;
  };
  return EnvServer::Create(env, std::move(*listener), options);
}

int Serve(const ServeFlags& flags) {
  const std::atomic<bool>& stop = StopSignal();
  const Result<const worlds::World*> world = worlds::FindWorld(flags.world);
  if (!world.ok()) return Fail("serve", world.status());
  const Status named = flags.model.empty() ? Status::Ok() : CheckFolderName("model", flags.model);
  if (!named.ok()) return Fail("serve", {named.code(), "--model: " + named.message()});
  const Status exposure = CheckExposure({flags.host, static_cast<int>(flags.port)}, flags.token);
  if (!exposure.ok()) return Fail("serve", {exposure.code(), "--host, --token: " + exposure.message()});
  if (flags.protocol == "text1" && !flags.token.empty()) {
    return Fail("serve", {StatusCode::kInvalidArgument,
                          "--protocol text1 cannot ask for a token (--token or CONSAC_TOKEN), so nobody could be "
                          "served; take --protocol 2, or no token"});
  }
  const Result<std::unique_ptr<VectorEnv>> env = MakeWorlds(flags);
  if (!env.ok()) return Fail("serve", env.status());
  const run::MemoryReserve reserve(run::kFirstAid);  // sessions outlive a short moment
  const Result<std::unique_ptr<EnvServer>> server = OpenServer(flags, **env);
  if (!server.ok()) return Fail("serve", server.status());
  const int port = (*server)->port();
  if (!flags.port_file.empty()) {
    const std::string text = std::to_string(port) + "\n";
    const Status written = WriteFileAtomically(flags.port_file, std::as_bytes(std::span(text)));
    if (!written.ok()) return Fail("serve", written);
  }
  Print("serving {} on tcp://{}:{} (Ctrl-C stops)\n", flags.world, flags.host, port);
  FlushOutput();
  Refusals idle([](std::string_view line) { Print("{}\n", line); });
  std::int64_t stepped = 0;  // sessions in which a trainer has: no port scanner counts, and nobody who was turned away
  for (std::int64_t session = 1; flags.sessions == 0 || stepped < flags.sessions; ++session) {
    const std::int64_t before = (*server)->session_steps();
    const Status status = (*server)->ServeSession(stop);
    const std::int64_t steps = (*server)->session_steps();
    const std::string line =
        fmt::format("session {}: {} steps{}", session, steps, status.ok() ? "" : "; " + status.message());
    stepped += steps > 0 ? 1 : 0;
    if (steps == 0 && status.code() != StatusCode::kCancelled)
      idle.Say(line);
    else if (status.code() != StatusCode::kCancelled || steps != before)
      Print("{}\n", line);
    FlushOutput();
    if (status.code() == StatusCode::kCancelled) return 130;
    if (!status.ok() && stepped > 0 && stepped == flags.sessions) return ExitCode(status);
  }
  return 0;
}

}  // namespace

Action AddServe(CLI::App& app) {
  const auto flags = std::make_shared<ServeFlags>();
  app.add_option("world", flags->world, "a built-in world (consac list worlds)")->required();
  app.add_option("--host", flags->host, "address to listen on; anything but loopback lets other machines in");
  AddWhole(app, "--port", &flags->port, 0, 65535, "port; 0 takes a free one");
  AddWhole(app, "--envs", &flags->envs, 1, 1000000, "copies of the world in one session; more than 1 needs protocol 2");
  AddWhole(app, "--trainers", &flags->trainers, 1, 1000, "trainers at once; each has copies of its own");
  app.add_option("--protocol", flags->protocol, "auto, text1 or 2: what trainers may speak")
      ->check(CLI::IsMember({"auto", "text1", "2"}));
  AddToken(app, &flags->token, "access token that trainers must show; needs protocol 2");
  app.add_option("--port-file", flags->port_file, "write the port that is open to this file");
  AddWhole(app, "--steps", &flags->steps, 0, kMostWhole, "training length sent to the trainer; 100000 unless given");
  app.add_option("--model", flags->model,
                 "model name sent to the trainer; without --steps it asks for that model to act");
  AddWhole(app, "--seed", &flags->seed, 0, kMostWhole, "seed of the world; session k uses seed + k");
  AddNumber(app, "--rate", &flags->rate, 0, 1e9,
            "steps per second, as an engine bound to its frames; 0: as fast as the trainer");
  AddWhole(app, "--sessions", &flags->sessions, 0, kMostWhole,
           "stop after so many sessions in which a trainer has stepped; 0: never");
  AddNumber(app, "--deadline", &flags->deadline, 0, kMostSeconds,
            "seconds of a trainer's silence that end its session");
  AddNumber(app, "--quiet-time", &flags->quiet_time, 0, 1e3, "seconds between messages without newline");
  app.add_flag("--no-newline", flags->no_newline, "end no message with a newline, as the thesis' engine");
  app.add_flag("--wait-after-end", flags->wait_after_end,
               "wait for an answer to an episode's last observation, as some hand-made engines");
  return [flags] { return Serve(*flags); };
}

}  // namespace consac::cli
