#pragma once
// The workers of a run. One alone steps where it is called, several side by side, each waited for by a thread of its
// own; whoever has finished first is taken first. Private to run.

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "consac/base/thread.h"
#include "worker.h"

namespace consac::run {

/// Where a step is taken.
enum class Where : std::uint8_t {
  kHere,   ///< in Next
  kAside,  ///< on the worker's thread; in Next where the system gives none
};

/// Workers, and what they are doing.
class Crew {
 public:
  /// What a worker has come to.
  struct Outcome {
    std::size_t worker = 0;
    Status status;
    bool connected_anew = false;  ///< it took no step but a new connection
  };

  ~Crew();
  /// One more worker.
  void Add(std::unique_ptr<Worker> worker);
  std::size_t size() const { return members_.size(); }
  Worker& operator[](std::size_t i) { return *members_[i]->worker; }

  /// Worker `i` takes the step that it has acted for.
  void Step(std::size_t i, MoreSteps more, Where where);
  /// Worker `i` tries to get a new connection, again and again until it has one or `stop` is set.
  void ConnectAnew(std::size_t i, std::uint64_t seed, const std::atomic<bool>& stop);
  /// Workers that were sent and have not come back.
  std::size_t under_way() const { return under_way_; }
  /// Whether worker `i` is one of them.
  bool busy(std::size_t i) const { return members_[i]->busy; }
  /// Whether nothing is done with worker `i` just now: it was not sent, or has come back and waits to be taken.
  bool at_rest(std::size_t i);
  /// The worlds of workers at rest hear that their trainer lives.
  void KeepAlive() {
    for (std::size_t i = 0; i < members_.size(); ++i) {
      if (at_rest(i)) members_[i]->worker->link().KeepAlive();
    }
  }
  /// The next that comes back; waits for it.
  Outcome Next();
  /// Nobody is sent any more: waits until all have come back, but no longer than `patience_s`. Takes no memory.
  void Rest(double patience_s);

 private:
  struct Job {
    enum class Kind : std::uint8_t { kNone, kStep, kConnect } kind = Kind::kNone;
    MoreSteps more = MoreSteps::kYes;         // kStep
    std::uint64_t seed = 0;                   // kConnect
    const std::atomic<bool>* stop = nullptr;  // kConnect
  };
  struct Member {
    std::unique_ptr<Worker> worker;
    Thread thread;
    Job job;            // guarded by mutex_
    bool busy = false;  // known to the caller's thread only
  };

  void Send(std::size_t i, const Job& job);
  Status StartThread(std::size_t i);
  void Work(std::size_t i);
  Outcome Do(std::size_t i, const Job& job);
  Status ConnectUntilStopped(Worker& worker, const Job& job);

  std::vector<std::unique_ptr<Member>> members_;
  std::size_t under_way_ = 0;
  std::vector<std::pair<std::size_t, Job>> here_;  // what Next does itself, in this order
  bool said_no_thread_ = false;

  std::mutex mutex_;
  std::condition_variable sent_, came_back_;
  std::vector<Outcome> outcomes_;  // guarded by mutex_; in the order of coming back
  std::atomic<bool> over_ = false;
};

}  // namespace consac::run
