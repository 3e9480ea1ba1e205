// monitor.csv: contents, and what a resume keeps.
#include "report/monitor_csv.h"

#include <gtest/gtest.h>

#include <cstring>

#include "run/test/report/files.h"

namespace consac::run {
namespace {

TEST(MonitorCsv, IsStableBaselinesFormat) {
  const TestFolder folder;
  auto monitor = std::move(
      *MonitorCsv::Open(folder.File("monitor.csv"), "a \"world\"", 1700000000.25, learn::OpenMode::kTruncate));
  monitor->Append(21.0, 104, 0.5182041);
  monitor->Append(-1234.56789012, 200, 12345.0);
  monitor->Flush();
  EXPECT_EQ(TextOf(folder.File("monitor.csv")),
            "#{\"t_start\":1700000000.25,\"env_id\":\"a \\\"world\\\"\"}\n"
            "r,l,t\n"
            "21.0,104,0.518204\n"
            "-1234.56789,200,12345.0\n");
}

TEST(MonitorCsv, AResumedRunDropsEpisodesAfterTheCheckpoint) {
  const TestFolder folder;
  const std::string path = folder.File("monitor.csv");
  StateWriter checkpoint;
  {
    auto monitor = std::move(*MonitorCsv::Open(path, "w", 1.0, learn::OpenMode::kTruncate));
    monitor->Append(1.0, 10, 0.1);
    monitor->Visit(checkpoint);
    EXPECT_EQ(TextOf(path), "#{\"t_start\":1.0,\"env_id\":\"w\"}\nr,l,t\n1.0,10,0.1\n")
        << "a checkpoint writes out what it counts";
    monitor->Append(2.0, 20, 0.2);
  }
  const std::string at_kill = TextOf(path);
  ASSERT_NE(at_kill.find("2.0,20,0.2\n"), std::string::npos);
  Put(path, at_kill + "3.0,3");
  auto monitor = std::move(*MonitorCsv::Open(path, "w", 99.0, learn::OpenMode::kAppend));
  StateReader reader(checkpoint.fields());
  monitor->Visit(reader);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  monitor->Append(4.0, 40, 0.4);
  monitor->Flush();
  EXPECT_EQ(TextOf(path), "#{\"t_start\":1.0,\"env_id\":\"w\"}\nr,l,t\n1.0,10,0.1\n4.0,40,0.4\n");

  // What comes after the checkpoint is not looked at, however long; what it cannot have counted is refused unread.
  std::filesystem::resize_file(path, std::uint64_t{20} << 30);
  monitor = std::move(*MonitorCsv::Open(path, "w", 99.0, learn::OpenMode::kAppend));
  StateReader again(checkpoint.fields());
  monitor->Visit(again);
  ASSERT_TRUE(again.status().ok()) << again.status().message();
  EXPECT_EQ(TextOf(path), "#{\"t_start\":1.0,\"env_id\":\"w\"}\nr,l,t\n1.0,10,0.1\n");
  std::filesystem::resize_file(path, std::uint64_t{20} << 30);
  StateMap forged = checkpoint.fields();
  const std::uint64_t lines = std::uint64_t{20} << 30;
  std::memcpy(forged.at("bytes").bytes.data() + sizeof(lines), &lines, sizeof(lines));
  monitor = std::move(*MonitorCsv::Open(path, "w", 99.0, learn::OpenMode::kAppend));
  StateReader misled(forged);
  monitor->Visit(misled);
  EXPECT_NE(misled.status().message().find("no log of this run"), std::string::npos) << misled.status().message();
}

TEST(MonitorCsv, AFileThatAnEditorHasSavedAnewLosesNoEpisode) {
  const TestFolder folder;
  const std::string path = folder.File("monitor.csv");
  StateWriter checkpoint;
  {
    auto monitor = std::move(*MonitorCsv::Open(path, "w", 1.0, learn::OpenMode::kTruncate));
    for (int episode = 0; episode < 20; ++episode) monitor->Append(1.0, 10, 0.1);
    monitor->Visit(checkpoint);
  }
  const std::string counted = TextOf(path);
  StateMap of_before = checkpoint.fields();  // bytes alone
  of_before.at("bytes").bytes.resize(sizeof(std::uint64_t));
  const auto resumed = [&](const std::string& text, const StateMap& fields) {
    Put(path, text);
    auto monitor = std::move(*MonitorCsv::Open(path, "w", 99.0, learn::OpenMode::kAppend));
    StateReader reader(fields);
    monitor->Visit(reader);
    StateWriter next;
    monitor->Append(4.0, 40, 0.4);
    monitor->Visit(next);
    EXPECT_EQ(next.fields().at("bytes").bytes.size(), 2 * sizeof(std::uint64_t));
    return reader.status().ok() ? TextOf(path) : reader.status().message();
  };
  const std::string later = "2.0,20,0.2\n", next = "4.0,40,0.4\n";
  EXPECT_EQ(resumed(counted + later, of_before), counted + next);
  EXPECT_EQ(resumed(counted + later, checkpoint.fields()), counted + next);
  EXPECT_EQ(resumed("\xEF\xBB\xBF" + counted + later, checkpoint.fields()), "\xEF\xBB\xBF" + counted + next);
  const auto with_returns = [](std::string text) {
    for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += 2) text.insert(at, "\r");
    return text;
  };
  EXPECT_EQ(resumed(with_returns(counted + later), checkpoint.fields()), with_returns(counted) + next);
  EXPECT_EQ(resumed(counted.substr(0, counted.size() - 1), checkpoint.fields()), counted + next);
  EXPECT_NE(resumed("\r", checkpoint.fields()).find("has no end of a line"), std::string::npos);
  EXPECT_EQ(TextOf(path).front(), '\r') << "left as it was";
}

}  // namespace
}  // namespace consac::run
