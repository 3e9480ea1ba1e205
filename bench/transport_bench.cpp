// What a step costs over each transport, beside its physical limit in the same run: bare ping-pong of the same bytes
// for TCP, memcpy for images. With the word `images` only these, five times.
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <thread>

#include "bench/peak.h"
#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "consac/server/env_server.h"

namespace {

using namespace consac;

/// A world that costs nothing: it counts.
class Counter final : public VectorEnv {
 public:
  Counter(Space observation, std::int32_t copies) {
    spec_.id = "counter";
    spec_.behaviours.push_back(BehaviourSpec::Of("default", std::move(observation), *Space::Discrete(2), copies));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override { Observe(batches[0]); }
  bool ResetWorld(std::int32_t, std::optional<std::uint64_t>, std::span<Batch> batches) override {
    Observe(batches[0]);
    return true;
  }
  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    std::fill_n(batch.rewards, batch.rows(), 1.0f);
    std::fill_n(batch.terminated, batch.rows(), std::uint8_t{0});
    std::fill_n(batch.truncated, batch.rows(), std::uint8_t{0});
    Observe(batch);
  }
  void Visit(Archive&) override {}

 private:
  void Observe(Batch& batch) {
    ++count_;
    std::memset(batch.next_observations, count_ & 63,
                static_cast<std::size_t>(batch.rows()) * spec_.behaviours[0].observation_layout.row_bytes);
  }
  EnvSpec spec_;
  int count_ = 0;
};

void PinTo(int core) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(core, &set);
  pthread_setaffinity_np(pthread_self(), sizeof(set), &set);
}

/// How both ends are joined.
struct Joint {
  Protocol protocol = Protocol::kProtocol2;
  bool shared_memory = false;
  int server_core = -1, client_core = -1;  // -1: the system's choice
};

/// Messages a second: the best of all windows of `window` messages in `repeats` sessions (0: a session is one window).
double MessagesPerSecond(const Space& observation, std::int32_t copies, const Joint& joint, int messages, int repeats,
                         int window = 0) {
  if (window == 0) window = messages;
  double best = 0.0;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    Counter world(observation, copies);
    EnvServerOptions server_options;
    server_options.training_length = std::int64_t{1} << 40;
    server_options.protocol = joint.protocol;
    auto server = EnvServer::Create(world, std::move(*ListenTcp({"127.0.0.1", 0})), server_options);
    std::atomic<bool> stop{false};
    std::thread engine([&] {
      if (joint.server_core >= 0) PinTo(joint.server_core);
      (void)(*server)->ServeSession(stop);
    });
    std::thread trainer([&] {
      if (joint.client_core >= 0) PinTo(joint.client_core);
      EnvClientOptions options;
      options.protocol = joint.protocol;
      options.shared_memory = joint.shared_memory;
      auto client = EnvClient::Open(*ConnectTcp({"127.0.0.1", (*server)->port()}, 1.0), options);
      if (!client.ok()) return;
      BatchBuffer buffer((*client)->spec().behaviours[0]);
      if (!(*client)->Reset(0, {&buffer.batch(), 1}).ok()) return;
      for (int done = 0; done < messages; done += window) {
        const double start = Now();
        for (int i = 0; i < window; ++i) {
          buffer.Advance();
          if (!(*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes).ok()) return;
        }
        best = std::max(best, window / (Now() - start));
      }
      (*client)->Close();
    });
    trainer.join();
    stop = true;
    engine.join();
  }
  return best;
}

/// Seconds that the world itself takes for a step, its rows in this core's caches; best window.
double StepSeconds(const Space& observation, std::int32_t copies, int windows, int window) {
  double best = 1e9;
  Counter world(observation, copies);
  BatchBuffer buffer(world.spec().behaviours[0]);
  for (int done = 0; done < windows; ++done) {
    const double start = Now();
    for (int i = 0; i < window; ++i) {
      buffer.Advance();
      world.Step({&buffer.batch(), 1});
    }
    best = std::min(best, (Now() - start) / window);
  }
  return best;
}

/// Seconds of the least that must happen to images between two cores: one draws them where the other then memcpys
/// them from, in turn. No frames, no checks, no sleep; best window.
double HandOverSeconds(std::size_t bytes, int count, int repeats, int window) {
  constexpr std::size_t kLine = 64;
  double best = 1e9;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    std::vector<std::byte> between(bytes + kLine), into(2 * bytes);
    std::byte* at = between.data() + (kLine - reinterpret_cast<std::uintptr_t>(between.data()) % kLine);
    alignas(kLine) std::atomic<int> asked{0};
    alignas(kLine) std::atomic<int> drawn{0};
    const auto await = [](const std::atomic<int>& word, int value) {
      // Yields now and then, should both share a core.
      for (unsigned spins = 1; word.load(std::memory_order_acquire) != value; ++spins) {
        if (spins % 4096 == 0) sched_yield();
      }
    };
    std::thread painter([&] {
      PinTo(0);
      for (int i = 1; i <= count; ++i) {
        await(asked, i);
        std::memset(at, i & 63, bytes);
        drawn.store(i, std::memory_order_release);
      }
    });
    PinTo(1);
    double start = Now();
    for (int i = 1; i <= count; ++i) {
      asked.store(i, std::memory_order_release);
      await(drawn, i);
      std::memcpy(into.data() + (i & 1) * bytes, at, bytes);
      asm volatile("" : : "r"(into.data()) : "memory");
      if (i % window != 0) continue;
      best = std::min(best, (Now() - start) / window);
      start = Now();
    }
    painter.join();
  }
  return best;
}

/// Round trips a second of so many bytes there and back, nothing parsed.
double PingPong(std::size_t there, std::size_t back, int count, int repeats) {
  double best = 0.0;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    auto listener = ListenTcp({"127.0.0.1", 0});
    auto near_end = ConnectTcp({"127.0.0.1", (*listener)->port()}, 1.0);
    auto far_end = (*listener)->Accept(1.0);
    const auto read = [](Transport& transport, std::span<std::byte> into) {
      for (std::size_t got = 0; got < into.size();) {
        const auto count_read = transport.Read(into.subspan(got), 1.0);
        if (!count_read.ok()) return;
        got += *count_read;
      }
    };
    std::thread echo([&] {
      std::vector<std::byte> request(there), answer(back);
      for (int i = 0; i < count; ++i) {
        read(**far_end, request);
        if (!(*far_end)->Write(answer, 1.0).ok()) return;
      }
    });
    std::vector<std::byte> request(there), answer(back);
    const double start = Now();
    for (int i = 0; i < count && (*near_end)->Write(request, 1.0).ok(); ++i) read(**near_end, answer);
    best = std::max(best, count / (Now() - start));
    echo.join();
  }
  return best;
}

/// Bytes a second that memcpy moves of an image's size, from where no cache has it; best window of so many.
double CopyRate(std::size_t bytes, std::size_t window) {
  constexpr std::size_t kImages = 8192;
  std::vector<std::byte> from(kImages * bytes, std::byte{1}), to(bytes);
  double best = 0.0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    double start = Now();
    for (std::size_t i = 0; i < kImages; ++i) {
      std::memcpy(to.data(), from.data() + i * bytes, bytes);
      asm volatile("" : : "r"(to.data()) : "memory");
      if ((i + 1) % window != 0) continue;
      best = std::max(best, static_cast<double>(window * bytes) / (Now() - start));
      start = Now();
    }
  }
  return best;
}

void Row(const char* what, double figure, const char* unit, double ratio, const char* of) {
  std::printf("| %s | %.4g %s | %.3g %s |\n", what, figure, unit, ratio, of);
  std::fflush(stdout);
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Images: what their way costs is a message's time less the world's own for drawing them. Each is measured beside its
/// limits at once, seven times, since how far apart the host puts two virtual cores changes from second to second.
void Images(std::int32_t copies, int messages) {
  const Space image = *Space::Box(0, 255, {84, 84, 4}, DType::kU8);
  constexpr std::size_t kImageBytes = 84 * 84 * 4;
  constexpr int kWindow = 128, kTimes = 7;  // images: short, so that other programs disturb all alike
  const int window = kWindow / copies;
  std::vector<double> rate, rate_less, of_bare, of_copy, of_copy_less;
  for (int time = 0; time < kTimes; ++time) {
    const double copy_s = kImageBytes / CopyRate(kImageBytes, kWindow);
    const double draw_s = StepSeconds(image, copies, messages / window, window) / copies;
    const double bare_s = HandOverSeconds(copies * kImageBytes, messages, 1, window) / copies;
    const Joint joint{Protocol::kProtocol2, true, 0, 1};
    const double image_s = 1.0 / (copies * MessagesPerSecond(image, copies, joint, messages, 1, window));
    rate.push_back(1.0 / image_s);
    rate_less.push_back(1.0 / (image_s - draw_s));
    of_bare.push_back(bare_s / image_s);
    of_copy.push_back(copy_s / image_s);
    of_copy_less.push_back(copy_s / (image_s - draw_s));
  }
  const std::string what = "84x84x4 images through shared memory, " + std::to_string(copies) + " a message";
  Row(what.c_str(), Median(rate), "images/s", Median(of_bare), "of a memset on one core and a memcpy on the other");
  Row("the same", Median(rate), "images/s", Median(of_copy), "of memcpy of such images out of memory");
  Row("the same less the world's drawing", Median(rate_less), "images/s", Median(of_copy_less), "of the same memcpy");
}

}  // namespace

int main(int count, char** words) {
  if (count == 2 && std::string_view(words[1]) == "images") {
    for (int repeat = 0; repeat < 5; ++repeat) {
      Images(1, 12800);
      Images(64, 200);
    }
    return 0;
  }
  const Space small = *Space::Box(-1, 1, {8});
  const Joint tcp, shared{Protocol::kProtocol2, true}, text{Protocol::kText1, false};
  std::printf("%s\n\n| what | figure | beside |\n|---|---|---|\n", bench::CpuName().c_str());
  // STEP of one environment is 32 + 24 bytes, its RESULT 32 + 56.
  const double bare = PingPong(56, 88, 30000, 5);
  const double one = MessagesPerSecond(small, 1, tcp, 30000, 5);
  Row("protocol 2 over TCP, one world of 8 floats", one, "steps/s", one / bare, "of bare ping-pong of these sizes");
  const double text_rate = MessagesPerSecond(small, 1, text, 30000, 3);
  Row("text protocol 1, one world of 8 floats", text_rate, "steps/s", text_rate / bare, "of the same ping-pong");
  const double many = 64 * MessagesPerSecond(small, 64, tcp, 10000, 5);
  Row("64 worlds in one message, TCP", many, "steps/s", many / one, "times the steps/s of 64 messages");
  const double memory = MessagesPerSecond(small, 1, shared, 300000, 5);
  Row("shared memory, one world of 8 floats, two cores", memory, "steps/s", memory / one, "times TCP");
  const double memory_many = 64 * MessagesPerSecond(small, 64, shared, 30000, 3);
  Row("64 worlds in one message, shared memory", memory_many, "steps/s", memory_many / memory, "times one world");
  Images(1, 12800);
  Images(64, 400);
  const double alone = MessagesPerSecond(small, 1, {Protocol::kProtocol2, true, 0, 0}, 20000, 3);
  Row("shared memory, both ends on one core", alone, "steps/s", alone / 5000, "times the 5,000 that are asked for");
  const double alone_tcp = MessagesPerSecond(small, 1, {Protocol::kProtocol2, false, 0, 0}, 20000, 3);
  Row("TCP, both ends on one core", alone_tcp, "steps/s", alone_tcp / 5000, "times the 5,000 that are asked for");
}
