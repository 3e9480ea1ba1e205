// consac serve: be the engine's side for a built-in world, over text protocol 1.
#include <fmt/format.h>

#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/server/env_server.h"
#include "worlds/registry.h"

namespace consac::cli {
namespace {

struct ServeFlags {
  std::string world, host = "127.0.0.1", port_file, model;
  int port = 5005;
  std::int64_t steps = 100000, sessions = 0;
  std::uint64_t seed = 0;
  double rate = 0.0, deadline = 60.0, quiet_time = 0.002;
  bool no_newline = false, wait_after_end = false;
};

Result<std::unique_ptr<EnvServer>> OpenServer(const ServeFlags& flags, VectorEnv& env) {
  Endpoint endpoint;
  endpoint.host = flags.host;
  endpoint.port = flags.port;
  Result<std::unique_ptr<Listener>> listener = ListenTcp(endpoint);
  if (!listener.ok()) return listener.status();
  EnvServerOptions options;
  options.training_length = flags.model.empty() ? flags.steps : (flags.steps == 100000 ? 0 : flags.steps);
  options.model_name = flags.model;
  options.seed = flags.seed;
  options.terminator = flags.no_newline ? text1::Terminator::kNone : text1::Terminator::kNewline;
  options.min_step_s = flags.rate > 0.0 ? 1.0 / flags.rate : 0.0;
  options.deadline_s = flags.deadline;
  options.quiet_s = flags.quiet_time;
  options.wait_after_end = flags.wait_after_end;
  return EnvServer::Create(env, std::move(*listener), options);
}

int Serve(const ServeFlags& flags) {
  const std::atomic<bool>& stop = StopSignal();
  const Result<const worlds::World*> world = worlds::FindWorld(flags.world);
  if (!world.ok()) return Fail("serve", world.status());
  const std::unique_ptr<VectorEnv> env = (*world)->create(1);
  const Result<std::unique_ptr<EnvServer>> server = OpenServer(flags, *env);
  if (!server.ok()) return Fail("serve", server.status());
  const int port = (*server)->port();
  if (!flags.port_file.empty()) {
    const std::string text = std::to_string(port) + "\n";
    const Status written = WriteFileAtomically(flags.port_file, std::as_bytes(std::span(text)));
    if (!written.ok()) return Fail("serve", written);
  }
  fmt::print("serving {} on tcp://{}:{} (Ctrl-C stops)\n", flags.world, flags.host, port);
  std::fflush(stdout);
  for (std::int64_t session = 1; flags.sessions == 0 || session <= flags.sessions; ++session) {
    const Status status = (*server)->ServeSession(stop);
    if (status.code() == StatusCode::kCancelled) return 130;
    fmt::print("session {}: {} steps{}\n", session, (*server)->session_steps(),
               status.ok() ? "" : "; " + status.message());
    std::fflush(stdout);
    if (!status.ok() && flags.sessions == session) return ExitCode(status);
  }
  return 0;
}

}  // namespace

Action AddServe(CLI::App& app) {
  const auto flags = std::make_shared<ServeFlags>();
  app.add_option("world", flags->world, "a built-in world (consac list worlds)")->required();
  app.add_option("--host", flags->host, "address to listen on; anything but loopback lets other machines in");
  app.add_option("--port", flags->port, "port; 0 takes a free one")->check(CLI::Range(0, 65535));
  app.add_option("--port-file", flags->port_file, "write the port that is open to this file");
  app.add_option("--steps", flags->steps, "training length sent to the trainer")->check(CLI::NonNegativeNumber);
  app.add_option("--model", flags->model,
                 "model name sent to the trainer; without --steps it asks for that model to act");
  app.add_option("--seed", flags->seed, "seed of the world; session k uses seed + k");
  app.add_option("--rate", flags->rate, "steps per second, as an engine bound to its frames; 0: as fast as the trainer")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--sessions", flags->sessions, "stop after so many sessions; 0: never")->check(CLI::NonNegativeNumber);
  app.add_option("--deadline", flags->deadline, "seconds of a trainer's silence that end its session");
  app.add_option("--quiet-time", flags->quiet_time, "seconds between messages without newline");
  app.add_flag("--no-newline", flags->no_newline, "end no message with a newline, as the thesis' engine");
  app.add_flag("--wait-after-end", flags->wait_after_end,
               "wait for an answer to an episode's last observation, as some hand-made engines");
  return [flags] { return Serve(*flags); };
}

}  // namespace consac::cli
