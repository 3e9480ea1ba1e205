// progress.csv: contents, new columns, and what a resume keeps.
#include "consac/learn/log/progress_csv.h"

#include <gtest/gtest.h>

#include "tests/files.h"
#include "tests/folder.h"

namespace consac::learn {
namespace {

using testing::Put;
using testing::TestFolder;
using testing::TextOf;

Row ShortRow(double steps) {
  return {{"fps", 10, CellKind::kInteger}, {"total_timesteps", steps, CellKind::kInteger}};
}

TEST(ProgressCsv, NewKeysBecomeColumnsOnTheRight) {
  const TestFolder folder;
  auto csv = std::move(*ProgressCsv::Open(folder.File("progress.csv"), {}));
  csv->Append(ShortRow(100));
  Row longer = ShortRow(200);
  longer.push_back({"ep_reward_mean", 1.0 / 3.0, CellKind::kDouble});
  csv->Append(longer);
  csv->Append(ShortRow(300));
  EXPECT_EQ(TextOf(folder.File("progress.csv")),
            "fps,total_timesteps,ep_reward_mean\n"
            "10,100,\n"
            "10,200,0.3333333333333333\n"
            "10,300,\n");
  EXPECT_TRUE(csv->status().ok());
}

TEST(ProgressCsv, AResumedRunDropsWhatItWillRepeat) {
  const TestFolder folder;
  const std::string path = folder.File("progress.csv");
  const ProgressCsv::Resume resume{true, "total_timesteps", 200};
  Put(path, "fps,total_timesteps\n1,100\n1,200\n1,300\n1,40");
  (*ProgressCsv::Open(path, resume))->Append(ShortRow(300));
  EXPECT_EQ(TextOf(path), "fps,total_timesteps\n1,100\n1,200\n10,300\n");
  Put(path, "cut in its first l");
  (*ProgressCsv::Open(path, resume))->Append(ShortRow(300));
  EXPECT_EQ(TextOf(path), "fps,total_timesteps\n10,300\n");
  std::filesystem::remove(path);
  (*ProgressCsv::Open(path, resume))->Append(ShortRow(300));
  EXPECT_EQ(TextOf(path), "fps,total_timesteps\n10,300\n");
}

// Of a long file only its end is read, and nothing is written again.
TEST(ProgressCsv, GoesOnInALongFileByItsEnd) {
  const TestFolder folder;
  const std::string path = folder.File("progress.csv");
  const std::string zeros(std::size_t{100} << 20, '\0');
  Put(path, "fps,total_timesteps\r\n" + zeros + "\n1,200\r\n1,300\r\n");
  const auto csv = ProgressCsv::Open(path, {true, "total_timesteps", 200});
  ASSERT_TRUE(csv.ok()) << csv.status().message();
  (*csv)->Append(ShortRow(300));
  EXPECT_TRUE((*csv)->status().ok()) << (*csv)->status().message();
  EXPECT_EQ(TextOf(path), "fps,total_timesteps\r\n" + zeros + "\n1,200\r\n10,300\n");
  std::filesystem::resize_file(path, std::uint64_t{2} << 30);
  const Status refused = ProgressCsv::Open(path, {true, "total_timesteps", 200}).status();
  EXPECT_EQ(refused.code(), StatusCode::kDataLoss);
  EXPECT_NE(refused.message().find("no log of this run"), std::string::npos) << refused.message();
}

TEST(ProgressCsv, ANewRunStartsAnew) {
  const TestFolder folder;
  Put(folder.File("progress.csv"), "a,b\n1,2\n");
  (*ProgressCsv::Open(folder.File("progress.csv"), {}))->Append(ShortRow(1));
  EXPECT_EQ(TextOf(folder.File("progress.csv")), "fps,total_timesteps\n10,1\n");
}

}  // namespace
}  // namespace consac::learn
