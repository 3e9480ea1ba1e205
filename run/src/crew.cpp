#include "crew.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace consac::run {
namespace {

constexpr auto kBetweenAttempts = std::chrono::milliseconds(500);

}  // namespace

Crew::~Crew() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  sent_.notify_all();
  for (const std::unique_ptr<Member>& member : members_) {
    if (member->thread.joinable()) member->thread.join();
  }
}

void Crew::Add(std::unique_ptr<Worker> worker) {
  members_.push_back(std::make_unique<Member>());
  members_.back()->worker = std::move(worker);
}

void Crew::Step(std::size_t i, MoreSteps more, Where where) {
  Job job;
  job.kind = Job::Kind::kStep;
  job.more = more;
  if (where == Where::kAside) return Send(i, job);
  members_[i]->busy = true;
  ++under_way_;
  here_ = job;
  here_at_ = i;
}

void Crew::ConnectAnew(std::size_t i, std::uint64_t seed, const std::atomic<bool>& stop) {
  Job job;
  job.kind = Job::Kind::kConnect;
  job.seed = seed;
  job.stop = &stop;
  Send(i, job);
}

void Crew::Send(std::size_t i, const Job& job) {
  Member& member = *members_[i];
  member.busy = true;
  ++under_way_;
  {
    const std::lock_guard lock(mutex_);
    member.job = job;
    outcomes_.reserve(members_.size());
  }
  if (!member.thread.joinable()) member.thread = std::thread([this, i, &member] { Work(i, member); });
  sent_.notify_all();
}

void Crew::Work(std::size_t i, Member& member) {
  std::unique_lock lock(mutex_);
  while (true) {
    sent_.wait(lock, [&] { return over_ || member.job.kind != Job::Kind::kNone; });
    if (member.job.kind == Job::Kind::kNone) return;
    const Job job = std::exchange(member.job, Job());
    lock.unlock();
    Outcome outcome = Do(i, job, *member.worker);
    lock.lock();
    outcomes_.push_back(std::move(outcome));
    came_back_.notify_one();
  }
}

Crew::Outcome Crew::Do(std::size_t i, const Job& job, Worker& worker) {
  if (job.kind == Job::Kind::kStep) return {i, worker.Step(job.more), false};
  Status status(StatusCode::kCancelled, "stopped while connecting anew");
  while (!job.stop->load(std::memory_order_relaxed) && !over_) {
    status = worker.ConnectAnew(job.seed);
    const bool again = status.code() == StatusCode::kUnavailable || status.code() == StatusCode::kDeadlineExceeded;
    if (status.ok() || !again) break;
    std::this_thread::sleep_for(kBetweenAttempts);
  }
  return {i, status, true};
}

bool Crew::at_rest(std::size_t i) {
  if (!members_[i]->busy) return true;
  const std::lock_guard lock(mutex_);
  return std::any_of(outcomes_.begin(), outcomes_.end(), [i](const Outcome& outcome) { return outcome.worker == i; });
}

Crew::Outcome Crew::Next() {
  Outcome outcome;
  if (here_.kind != Job::Kind::kNone) {
    outcome = Do(here_at_, std::exchange(here_, Job()), *members_[here_at_]->worker);
  } else {
    std::unique_lock lock(mutex_);
    came_back_.wait(lock, [&] { return !outcomes_.empty(); });
    outcome = std::move(outcomes_.front());
    outcomes_.erase(outcomes_.begin());
  }
  members_[outcome.worker]->busy = false;
  --under_way_;
  return outcome;
}

}  // namespace consac::run
