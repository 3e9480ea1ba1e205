#include "crew.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "consac/run/shortage.h"

namespace consac::run {
namespace {

constexpr auto kBetweenAttempts = std::chrono::milliseconds(500);

}  // namespace

Crew::~Crew() {
  Rest(0.0);
  for (const std::unique_ptr<Member>& member : members_) member->thread.Join();
}

void Crew::Add(std::unique_ptr<Worker> worker) {
  members_.push_back(std::make_unique<Member>());
  members_.back()->worker = std::move(worker);
  outcomes_.reserve(members_.size());
  here_.reserve(members_.size());
}

void Crew::Step(std::size_t i, MoreSteps more, Where where) {
  Job job;
  job.kind = Job::Kind::kStep;
  job.more = more;
  if (where == Where::kAside && StartThread(i).ok()) return Send(i, job);
  members_[i]->busy = true;
  ++under_way_;
  here_.emplace_back(i, job);
}

/// The thread of worker `i` runs. Where it cannot be started the caller does what it would have done.
Status Crew::StartThread(std::size_t i) {
  Member& member = *members_[i];
  if (member.thread.started()) return Status::Ok();
  const Status started = member.thread.Start([this, i] { Work(i); });
  if (!started.ok() && !std::exchange(said_no_thread_, true))
    Log(LogLevel::kWarning, "engines are waited for one after another: " + started.message());
  return started;
}

void Crew::ConnectAnew(std::size_t i, std::uint64_t seed, const std::atomic<bool>& stop) {
  Job job;
  job.kind = Job::Kind::kConnect;
  job.seed = seed;
  job.stop = &stop;
  const Status started = StartThread(i);
  if (started.ok()) return Send(i, job);
  members_[i]->busy = true;
  ++under_way_;
  const std::lock_guard lock(mutex_);
  outcomes_.push_back({i, started, true});
}

void Crew::Send(std::size_t i, const Job& job) {
  Member& member = *members_[i];
  member.busy = true;
  ++under_way_;
  {
    const std::lock_guard lock(mutex_);
    member.job = job;
  }
  sent_.notify_all();
}

void Crew::Work(std::size_t i) {
  Member& member = *members_[i];
  std::unique_lock lock(mutex_);
  while (true) {
    sent_.wait(lock, [&] { return over_ || member.job.kind != Job::Kind::kNone; });
    if (member.job.kind == Job::Kind::kNone) return;
    const Job job = std::exchange(member.job, Job());
    lock.unlock();
    Outcome outcome = Do(i, job);
    lock.lock();
    outcomes_.push_back(std::move(outcome));
    came_back_.notify_one();
  }
}

// Memory may run out on any thread: what is thrown there is the step's failure.
Crew::Outcome Crew::Do(std::size_t i, const Job& job) {
  Worker& worker = *members_[i]->worker;
  if (job.kind == Job::Kind::kStep) return {i, Guarded([&] { return worker.Step(job.more); }), false};
  return {i, Guarded([&] { return ConnectUntilStopped(worker, job); }), true};
}

Status Crew::ConnectUntilStopped(Worker& worker, const Job& job) {
  Status status(StatusCode::kCancelled, "stopped while connecting anew");
  while (!job.stop->load(std::memory_order_relaxed) && !over_) {
    status = worker.ConnectAnew(job.seed);
    const bool again = status.code() == StatusCode::kUnavailable || status.code() == StatusCode::kDeadlineExceeded;
    if (status.ok() || !again) break;
    std::this_thread::sleep_for(kBetweenAttempts);
  }
  return status;
}

void Crew::Rest(double patience_s) {
  std::unique_lock lock(mutex_);
  over_ = true;
  sent_.notify_all();
  came_back_.wait_for(lock, std::chrono::duration<double>(patience_s),
                      [&] { return outcomes_.size() + here_.size() >= under_way_; });
}

bool Crew::at_rest(std::size_t i) {
  if (!members_[i]->busy) return true;
  if (std::any_of(here_.begin(), here_.end(), [i](const auto& job) { return job.first == i; })) return true;
  const std::lock_guard lock(mutex_);
  return std::any_of(outcomes_.begin(), outcomes_.end(), [i](const Outcome& outcome) { return outcome.worker == i; });
}

Crew::Outcome Crew::Next() {
  Outcome outcome;
  std::unique_lock lock(mutex_);
  if (outcomes_.empty() && !here_.empty()) {
    lock.unlock();
    const auto [i, job] = here_.front();
    here_.erase(here_.begin());
    outcome = Do(i, job);
  } else {
    came_back_.wait(lock, [&] { return !outcomes_.empty(); });
    outcome = std::move(outcomes_.front());
    outcomes_.erase(outcomes_.begin());
  }
  members_[outcome.worker]->busy = false;
  --under_way_;
  return outcome;
}

}  // namespace consac::run
