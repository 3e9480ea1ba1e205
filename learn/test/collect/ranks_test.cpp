// One training on several ranks: what is summed is summed over all of them, and all end with the same bits. The ranks
// here are threads that meet.
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <functional>
#include <limits>
#include <mutex>
#include <numeric>
#include <thread>

#include "buffer/moments.h"
#include "collect/shared_moments.h"
#include "collect/sums.h"
#include "consac/base/rng.h"
#include "learn/test/algo/training_harness.h"
#include "optim/gradient_step.h"

namespace consac::learn {
namespace {

/// Where a number of threads wait for each other, again and again. (std::barrier hangs under Wine.)
class MeetingPoint {
 public:
  explicit MeetingPoint(std::int64_t size) : size_(size) {}
  void Wait() {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::int64_t round = round_;
    if (++here_ == size_) {
      here_ = 0;
      ++round_;
      all_here_.notify_all();
    }
    all_here_.wait(lock, [&] { return round_ != round; });
  }

 private:
  const std::int64_t size_;
  std::int64_t here_ = 0, round_ = 0;
  std::mutex mutex_;
  std::condition_variable all_here_;
};

/// Threads as the ranks of one training.
class ThreadRanks {
 public:
  explicit ThreadRanks(std::int64_t size) : seats_(static_cast<std::size_t>(size)), meeting_(size) {
    for (std::int64_t rank = 0; rank < size; ++rank) seats_[static_cast<std::size_t>(rank)] = {this, rank, {}};
  }

  /// Runs `body(ranks)` on each.
  void Run(const std::function<void(const Communicator&)>& body) {
    std::vector<std::thread> threads;
    for (Seat& seat : seats_) threads.emplace_back([&] { body(seat.communicator()); });
    for (std::thread& thread : threads) thread.join();
  }

 private:
  struct Seat {
    ThreadRanks* all;
    std::int64_t rank;
    std::span<std::byte> numbers;

    Communicator communicator() {
      return {rank,
              static_cast<std::int64_t>(all->seats_.size()),
              [](void* user, double* at, std::int64_t n) { static_cast<Seat*>(user)->Sum(std::span(at, at + n)); },
              [](void* user, float* at, std::int64_t n) { static_cast<Seat*>(user)->Sum(std::span(at, at + n)); },
              [](void* user, std::byte* at, std::int64_t n) { static_cast<Seat*>(user)->Take(std::span(at, at + n)); },
              this};
    }
    template <class Number>
    void Sum(std::span<Number> own) {
      std::vector<Number> total(own.size());
      Meet(std::as_writable_bytes(own), [&] {
        for (const Seat& other : all->seats_) {
          const auto* theirs = reinterpret_cast<const Number*>(other.numbers.data());
          for (std::size_t i = 0; i < total.size(); ++i) total[i] += theirs[i];
        }
      });
      std::copy(total.begin(), total.end(), own.begin());
    }
    void Take(std::span<std::byte> own) {
      std::vector<std::byte> first(own.size());
      Meet(own, [&] { std::memcpy(first.data(), all->seats_[0].numbers.data(), first.size()); });
      std::copy(first.begin(), first.end(), own.begin());
    }
    /// Reads what everybody has brought; nobody goes on before all have read.
    void Meet(std::span<std::byte> own, const std::function<void()>& read) {
      numbers = own;
      all->meeting_.Wait();
      for (const Seat& other : all->seats_) EXPECT_EQ(other.numbers.size(), own.size());
      read();
      all->meeting_.Wait();
    }
  };

  std::vector<Seat> seats_;
  MeetingPoint meeting_;
};

constexpr std::int64_t kRanks = 3;

TEST(Ranks, MomentsAreThoseOfEverybodysRows) {
  std::vector<double> column(30);
  Rng rng(1, 1);
  for (double& number : column) number = rng.Uniform();
  std::vector<std::int32_t> rows(column.size());
  std::iota(rows.begin(), rows.end(), 0);
  const auto read = [&](std::size_t row) { return column[row]; };
  const Moments whole(rows, read);
  ThreadRanks(kRanks).Run([&](const Communicator& ranks) {
    const Moments moments(std::span<const std::int32_t>(rows).subspan(static_cast<std::size_t>(ranks.rank) * 10, 10),
                          read, ranks);
    EXPECT_EQ(moments.count, 30.0);
    EXPECT_NEAR(moments.mean, whole.mean, 1e-12);
    EXPECT_NEAR(moments.variance, whole.variance, 1e-12);
  });
}

TEST(Ranks, RunningMomentsMeetAndAreAlike) {
  constexpr int kRounds = 4;
  std::vector<float> samples(kRanks * kRounds * 5 * 2);
  Rng rng(2, 2);
  for (float& number : samples) number = static_cast<float>(3.0 * rng.Uniform());
  RunningMoments whole(2);
  whole.Update(samples.data(), kRanks * kRounds * 5);
  std::vector<RunningMoments> of(kRanks);
  ThreadRanks(kRanks).Run([&](const Communicator& ranks) {
    SharedMoments moments(2, ranks);
    for (int round = 0; round < kRounds; ++round) {
      moments.Update(samples.data() + (round * kRanks + ranks.rank) * 10, 5);
      if (round % 2 == 1) moments.Share();
    }
    of[static_cast<std::size_t>(ranks.rank)] = moments.now();
  });
  for (const RunningMoments& moments : of) {
    EXPECT_EQ(moments.mean, of[0].mean);
    EXPECT_EQ(moments.variance, of[0].variance);
    EXPECT_NEAR(moments.count, whole.count, 1e-9);
    for (std::size_t d = 0; d < 2; ++d) {
      EXPECT_NEAR(moments.mean[d], whole.mean[d], 1e-9);
      EXPECT_NEAR(moments.variance[d], whole.variance[d], 1e-9);
    }
  }
}

constexpr const char* kOne[] = {"one"};

TEST(Ranks, AMinibatchesMeansAreOverAllRows) {
  ThreadRanks(kRanks).Run([](const Communicator& ranks) {
    LossLog<kOne> log(10, ranks);
    log.BeginUpdate();
    log.BeginPass();
    log.block(0) = {{static_cast<double>(ranks.rank + 1)}};
    log.AddMinibatch(2, 2 * kRanks);
    EXPECT_DOUBLE_EQ(log.last()[0], (1.0 + 2.0 + 3.0) / 6.0);
  });
}

TEST(Ranks, AGradientIsTheSumAndLeftOutByAllOrByNone) {
  ThreadRanks(kRanks).Run([](const Communicator& ranks) {
    GradientStep step(Optimiser(Adam(2, {})), 0.0, ranks);
    std::vector<float> parameters{1.0f, 2.0f}, gradient{1.0f, static_cast<float>(ranks.rank)};
    EXPECT_TRUE(step.Apply(parameters, gradient, 0.1f));
    EXPECT_EQ(gradient, (std::vector<float>{3.0f, 3.0f}));
    gradient = {ranks.rank == 1 ? std::numeric_limits<float>::quiet_NaN() : 0.0f, 0.0f};
    EXPECT_FALSE(step.Apply(parameters, gradient, 0.1f)) << ranks.rank;
  });
}

/// Trains on `ranks` with worlds and a seed of each rank's own; returns every rank's parameters.
std::vector<std::vector<float>> Trained(const char* algorithm, const Settings& values, const Space& space) {
  std::vector<std::vector<float>> parameters(kRanks);
  ThreadRanks(kRanks).Run([&](const Communicator& ranks) {
    IdentityEnv env(space, 4);
    Setting setting{algorithm, values, 1000, static_cast<std::uint64_t>(10 + ranks.rank)};
    setting.ranks = ranks;
    const std::unique_ptr<Learner> learner = Make(env, setting);
    BatchBuffer first(env.spec().behaviours[0]);
    Begin(env, *learner, first);
    for (int i = 0; i < 64; ++i) Step(env, *learner, first.batch().slots);
    EXPECT_GE(learner->updates(), 4);
    const PolicyData model = learner->Snapshot();
    std::vector<float>& own = parameters[static_cast<std::size_t>(ranks.rank)];
    own = model.parameters;
    own.insert(own.end(), model.log_std.begin(), model.log_std.end());
    own.insert(own.end(), model.normaliser.mean.begin(), model.normaliser.mean.end());
    own.insert(own.end(), model.normaliser.scale.begin(), model.normaliser.scale.end());
  });
  return parameters;
}

TEST(Ranks, EveryRankEndsWithTheSameModel) {
  const std::pair<const char*, Settings> trainings[] = {
      {"ppo2", {{"n_steps", "16"}, {"nminibatches", "2"}, {"norm_obs", "true"}, {"norm_reward", "true"}}},
      {"ppo2", {{"n_steps", "16"}, {"target_kl", "1e-6"}, {"learning_rate", "0.01"}}},
      {"a2c", {{"n_steps", "5"}, {"norm_obs", "true"}, {"normalize_advantage", "true"}}},
      {"dqn", {{"learning_starts", "8"}, {"norm_obs", "true"}, {"grad_clip", "variable"}}},
      {"sac", {{"learning_starts", "8"}, {"norm_obs", "true"}, {"net_arch", "[8]"}, {"batch_size", "16"}}},
      {"sac", {{"learning_starts", "8"}, {"use_sde", "true"}, {"net_arch", "[8]"}, {"batch_size", "16"}}},
      {"ppo", {{"n_steps", "16"}, {"use_sde", "true"}, {"batch_size", "32"}}},
      {"td3", {{"learning_starts", "8"}, {"norm_obs", "true"}, {"net_arch", "[8]"}, {"batch_size", "16"}}},
      {"td3", {{"learning_starts", "8"}, {"n_critics", "3"}, {"net_arch", "[8]"}, {"batch_size", "16"}}},
      {"ddpg",
       {{"learning_starts", "8"},
        {"norm_obs", "true"},
        {"net_arch", "[8]"},
        {"batch_size", "16"},
        {"critic_l2_reg", "0.1"},
        {"normalize_returns", "true"},
        {"enable_popart", "true"},
        {"param_noise", "true"},
        {"param_noise_adaption_interval", "3"}}}};
  for (const auto& [algorithm, values] : trainings) {
    const auto parameters = Trained(
        algorithm, values, std::string_view(algorithm) == "dqn" ? *Space::Discrete(5) : *Space::Box(-1, 1, {2}));
    EXPECT_EQ(parameters[1], parameters[0]) << algorithm;
    EXPECT_EQ(parameters[2], parameters[0]) << algorithm;
  }
}

}  // namespace
}  // namespace consac::learn
