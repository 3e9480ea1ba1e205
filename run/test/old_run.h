#pragma once
// What the tests of --force share: a run that another one takes the place of.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>

#include "consac/model/model_file.h"
#include "consac/run/run_directory.h"
#include "tests/files.h"

namespace consac::run {

using testing::Put;

/// Every file below a folder, with what is in it, but for the lock.
inline std::map<std::string, std::string> Contents(const std::string& folder) {
  std::map<std::string, std::string> files = testing::FilesBelow(folder);
  std::erase_if(files, [](const auto& file) { return file.first.ends_with("/.lock"); });
  return files;
}

/// Names of the files in which two folders differ.
inline std::string Differences(const std::map<std::string, std::string>& before,
                               std::map<std::string, std::string> after) {
  std::string names;
  for (const auto& [path, text] : before) {
    const auto same = after.find(path);
    if (same == after.end() || same->second != text) names += path + " ";
    if (same != after.end()) after.erase(same);
  }
  for (const auto& [path, text] : after) names += path + " ";
  return names;
}

/// Begins a new run in the place of root/run.
inline std::unique_ptr<RunDirectory> Overwrite(const std::string& root) {
  Result<std::unique_ptr<RunDirectory>> directory = RunDirectory::Open(root, "run", ExistingRun::kOverwrite);
  EXPECT_TRUE(directory.ok()) << directory.status().message();
  return directory.ok() ? std::move(*directory) : nullptr;
}

/// A run with everything that one writes, and things that somebody else has put beside them.
inline std::string OldRun(const std::string& root) {
  const std::string run = root + "/run/";
  std::filesystem::remove_all(run);
  ModelFile model;
  model.spec_json = R"({"kind": "policy", "interface": {"behaviour": "walker"}})";
  for (const char* file :
       {"config.yaml", "progress.csv", "monitor.csv", "curve.svg", "curve.png", "model.consac", "evaluations.csv",
        "checkpoints/step_000000000100.consac", "checkpoints/x.rows_000000000000_000000000100.rows",
        "tensorboard/PPO2_1/events.out.tfevents.1.host.2", "best/model.consac", "walker.monitor.csv",
        "walker.curve.svg", "walker.curve.png"})
    Put(run + file, "a run's");
  EXPECT_TRUE(model.Save(run + "walker.consac").ok());
  EXPECT_TRUE(model.Save(run + "best/walker.consac").ok());
  for (const char* file : {"notes.txt", "best.consac", "checkpoints/mine.txt", "tensorboard/mine.txt",
                           "tensorboard/PPO2_2/mine.txt", "checkpoints/best.consac", "my.curve.png", "best/mine.txt"})
    Put(run + file, "mine");
  EXPECT_TRUE(model.Save(run + "favourite.consac").ok());
  return run;
}

/// What the new run has written when it is saved.
inline const char* const kNewFiles[] = {"config.yaml", "model.consac", "checkpoints/step_000000000000.consac",
                                        "tensorboard/PPO2_1/events.out.tfevents.9.host.9"};

}  // namespace consac::run
