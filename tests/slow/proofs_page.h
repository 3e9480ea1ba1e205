#pragma once
// The page of the learning proofs: what came of each row, as Markdown that is read again where only some rows are run.
// Results are kept by what was run, not by a row's name: a row whose settings have changed is not measured yet. What a
// row needs is judged anew each time.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <istream>
#include <map>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/hash.h"

namespace consac::proofs {

constexpr int kSeeds = 5;

/// One claim: this world, learned so, reaches that.
struct Proof {
  std::string name;                                           ///< for the table
  std::string world;                                          ///< a built-in world
  std::string algorithm;                                      ///< a row of learn::Algorithms()
  std::int64_t steps;                                         ///< agent steps
  std::int32_t envs;                                          ///< copies of the world
  bool over_tcp;                                              ///< served by an EnvServer, text protocol 1
  std::string preset;                                         ///< of hyperparameters
  std::vector<std::pair<std::string, std::string>> settings;  ///< further hyperparameters, all that are set
  double median_at_least;                                     ///< what the median seed must reach
  double seeds_at_least;                                      ///< what the seeds must reach
  int seeds = kSeeds;                                         ///< so many of them
  bool success = false;                                       ///< judged by episodes that succeed, not by returns
};

/// What five seeds made of a row.
struct Outcome {
  std::vector<double> results;  ///< by seed
  double seconds = 0.0;         ///< of a run
};

/// Eight digits that stand for all that decides what a row's runs do.
inline std::string RunOf(const Proof& proof) {
  std::string text = fmt::format("{}|{}|{}|{}|{}|{}", proof.world, proof.algorithm, proof.steps, proof.envs,
                                 proof.over_tcp, proof.preset);
  for (const auto& [name, value] : proof.settings) text += fmt::format("|{}={}", name, value);
  if (proof.success) text += "|success";
  return fmt::format("{:08x}", Crc32c(std::as_bytes(std::span(text))));
}

/// Whether a row's claim holds.
inline bool Holds(const Proof& proof, const Outcome& outcome) {
  std::vector<double> sorted = outcome.results;
  if (sorted.size() != kSeeds || std::ranges::any_of(sorted, [](double r) { return std::isnan(r); })) return false;
  std::ranges::sort(sorted);
  return sorted[kSeeds / 2] >= proof.median_at_least &&
         sorted[static_cast<std::size_t>(kSeeds - proof.seeds)] >= proof.seeds_at_least;
}

/// What is known of runs, by RunOf, and what stands below the table.
struct Page {
  std::map<std::string, Outcome> outcomes;
  std::string notes;
};

constexpr std::string_view kNotMeasured = "Not measured yet: ";

/// The cells of a line of a table.
inline std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t at = 2, end; (end = line.find(" |", at)) != std::string::npos; at = end + 3)
    cells.push_back(line.substr(at, end - at));
  return cells;
}

/// The page as it lies there; nothing in it where there is none.
inline Page ReadPage(std::istream& in) {
  Page page;
  bool below = false;
  for (std::string line; std::getline(in, line);) {
    const bool row = line.starts_with("| ");
    below = below || row;
    if (row) {
      const std::vector<std::string> cells = Cells(line);
      if (cells.size() != 10) continue;
      Outcome outcome{{}, std::strtod(cells[7].c_str(), nullptr)};
      const char* at = cells[4].c_str();
      for (char* end; std::strtod(at, &end), end != at; at = *end == ',' ? end + 1 : end)
        outcome.results.push_back(std::strtod(at, nullptr));
      if (outcome.results.size() == kSeeds) page.outcomes[cells[9]] = std::move(outcome);
    } else if (below && !line.starts_with("|--") && !line.starts_with(kNotMeasured)) {
      page.notes += line + "\n";
    }
  }
  while (page.notes == "\n" || page.notes.ends_with("\n\n")) page.notes.pop_back();
  return page;
}

inline void WritePage(std::ostream& out, const std::vector<Proof>& proofs, const Page& page) {
  out << "# Learning proofs\n\n"
         "Written by `make test-slow`. Five seeds (1 to 5) a row. Result: mean return over 100 deterministic\n"
         "evaluation episodes; for the road the share of its 1,640 states in which the model steps nearer to the "
         "coin;\n"
         "where the claim is of success the share of the 100 episodes whose last step is where it should be.\n"
         "Settings: `tests/slow/learning_proofs.cpp` and the worlds' suggested ones; rows that Stable Baselines3 "
         "learns too\n"
         "have those of [sb3_curves.md](sb3_curves.md) and need its median less one standard error, or, where that is "
         "not\n"
         "measured yet, what the row asks of its seeds. `run` stands for world, algorithm, steps and settings: where "
         "they\n"
         "change, the row is measured anew. In Gymnasium's worlds: [ecosystem.md](ecosystem.md).\n\n"
         "| claim | world | algorithm | steps x worlds | seeds | median | needs median / seeds | s per run | holds | "
         "run |\n"
         "|---|---|---|---|---|---|---|---|---|---|\n";
  std::string missing;
  for (const Proof& proof : proofs) {
    const auto known = page.outcomes.find(RunOf(proof));
    if (known == page.outcomes.end()) {
      missing += fmt::format("{}`{}`", missing.empty() ? "" : ", ", proof.name);
      continue;
    }
    const Outcome& outcome = known->second;
    std::string seeds;
    for (const double result : outcome.results) seeds += fmt::format("{}{:.7g}", seeds.empty() ? "" : ", ", result);
    std::vector<double> sorted = outcome.results;
    std::ranges::sort(sorted);
    out << fmt::format("| {} | {} | {} | {} x {} | {} | {:.7g} | {:.4g} / {:.4g} in {} of {} | {:.2f} | {} | {} |\n",
                       proof.name, proof.world, proof.algorithm, proof.steps, proof.envs, seeds, sorted[kSeeds / 2],
                       proof.median_at_least, proof.seeds_at_least, proof.seeds, kSeeds, outcome.seconds,
                       Holds(proof, outcome) ? "yes" : "**no**", known->first);
  }
  out << page.notes;
  if (!missing.empty()) out << "\n" << kNotMeasured << missing << ".\n";
}

}  // namespace consac::proofs
