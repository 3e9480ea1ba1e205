// Rows that are too many to copy: a checkpoint writes what is new, every checkpoint that stays can be read back whole,
// what none of them needs goes, and a damaged segment makes its checkpoint be passed over.
#include "row_segments.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#if !defined(_WIN32)
#include <sys/stat.h>
#endif

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <utility>

#include "consac/run/run_directory.h"
#include "tests/support.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// The latest `most` of a row of numbers.
class Numbers final : public StateRows {
 public:
  Numbers(std::int64_t most, std::size_t row_bytes) : most_(most), row_bytes_(row_bytes) {}
  void Add(std::int64_t count) {
    for (; count > 0; --count, ++end_) numbers_[end_] = 7 * end_ + salt;
    Forget();
  }
  std::size_t row_bytes() const override { return row_bytes_; }
  std::int64_t first_row() const override { return first_; }
  std::int64_t end_row() const override { return end_; }
  void CopyRows(std::int64_t from, std::int64_t count, std::byte* to) const override {
    for (std::int64_t row = from; row < from + count; ++row, to += row_bytes_) {
      std::memset(to, 0, row_bytes_);
      std::memcpy(to, &numbers_.at(row), sizeof(std::int64_t));
      copied += 1;
      if (on_copy) std::exchange(on_copy, {})();
    }
  }
  bool BeginRows(std::int64_t first, std::int64_t end) override {
    numbers_.clear();
    first_ = end_ = first;
    return end - first <= most_;
  }
  bool TakeRows(std::int64_t count, const std::byte* rows) override {
    for (; count > 0; --count, rows += row_bytes_) std::memcpy(&numbers_[end_++], rows, sizeof(std::int64_t));
    return end_ - first_ <= most_;
  }
  void Visit(Archive& archive) { archive("rows", static_cast<StateRows&>(*this)); }

  std::int64_t salt = 0;
  mutable std::int64_t copied = 0;
  mutable std::function<void()> on_copy;  // once: what happens while they are written

 private:
  void Forget() {
    for (; end_ - first_ > most_; ++first_) numbers_.erase(first_);
  }
  std::int64_t most_, first_ = 0, end_ = 0;
  std::size_t row_bytes_;
  std::map<std::int64_t, std::int64_t> numbers_;
};

std::unique_ptr<RunDirectory> OpenRun(const std::string& folder, ExistingRun existing) {
  auto directory = RunDirectory::Open(folder, "run", existing);
  EXPECT_TRUE(directory.ok()) << directory.status().message();
  std::ofstream(folder + "/run/config.yaml") << "x: 1\n";
  return directory.ok() ? std::move(*directory) : nullptr;
}

Status Save(RunDirectory& directory, Numbers& numbers, std::int64_t keep) {
  CheckpointWriter writer(directory.segments());
  writer("numbers", numbers);
  if (!writer.status().ok()) return writer.status();
  return directory.SaveCheckpoint(numbers.end_row(), writer.fields(), "{}", keep);
}

Status Load(RunDirectory& directory, Numbers& numbers) {
  const Result<StateMap> state = directory.LoadCheckpoint();
  if (!state.ok()) return state.status();
  CheckpointReader reader(*state, directory.segments());
  reader("numbers", numbers);
  return reader.status();
}

std::vector<std::string> SegmentFiles(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder + "/run/checkpoints")) {
    if (entry.path().extension() == kSegmentEnd) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(RowSegments, ACheckpointWritesWhatIsNewAndIsReadBackWhole) {
  testing::ScratchFolder scratch("segments");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(2500, 4000);  // segments below 1049 rows are small
  for (const std::int64_t more : {0, 1, 1200, 1100, 3, 2, 1, 1, 2000, 1500, 0, 12}) {
    numbers.Add(more);
    numbers.copied = 0;
    ASSERT_TRUE(Save(*directory, numbers, 2).ok());
    EXPECT_LE(numbers.copied, more + 20) << "what is there already is not written again";
    Numbers again(2500, 4000);
    const Status loaded = Load(*directory, again);
    ASSERT_TRUE(loaded.ok()) << loaded.message();
    EXPECT_EQ(HashState(numbers), HashState(again)) << more;
  }
  EXPECT_LE(SegmentFiles(scratch.path()).size(), 6u) << "what no checkpoint needs is gone";
}

TEST(RowSegments, ManySmallStepsMakeFewFiles) {
  testing::ScratchFolder scratch("small");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(3000, 16);
  for (int i = 0; i < 80; ++i) {
    numbers.Add(1 + i % 7);
    ASSERT_TRUE(Save(*directory, numbers, 1).ok());
  }
  EXPECT_LE(SegmentFiles(scratch.path()).size(), 12u);
  EXPECT_LE(numbers.copied, 80 * 4 * 10) << "each row a few times";
}

TEST(RowSegments, ACheckpointThatIsSavedOnceMoreTakesNoOthersPlace) {
  testing::ScratchFolder scratch("again");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(1000, 4000);
  numbers.Add(1200);
  ASSERT_TRUE(Save(*directory, numbers, 2).ok());
  const std::uint64_t first = HashState(numbers);
  numbers.Add(1300);  // none of the first one's rows is left
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(Save(*directory, numbers, 2).ok());
  fs::remove(scratch.path() + "/run/checkpoints/step_000000002500.consac");
  Numbers again(1000, 4000);
  const Status loaded = Load(*directory, again);
  ASSERT_TRUE(loaded.ok()) << loaded.message();
  EXPECT_EQ(HashState(again), first);
}

TEST(RowSegments, AsManyCheckpointsAsCanBeAskedForAreKeptAtNoCost) {
  testing::ScratchFolder scratch("kept");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(100, 4000);
  for (int i = 0; i < 3; ++i) {
    numbers.Add(200);
    ASSERT_TRUE(Save(*directory, numbers, std::numeric_limits<std::int64_t>::max()).ok());
  }
  EXPECT_EQ(SegmentFiles(scratch.path()).size(), 3u);
}

// A folder in the checkpoint's place: it cannot be written, and its segments can.
TEST(RowSegments, ThoseOfACheckpointThatCannotBeWrittenGoAndTheNextOneHasAllRows) {
  testing::ScratchFolder scratch("failed");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  const auto fail = [&](Numbers& numbers) {
    const std::string place = directory->File(fmt::format("checkpoints/step_{:012d}.consac", numbers.end_row()));
    fs::create_directory(place);
    EXPECT_FALSE(Save(*directory, numbers, 2).ok());
    fs::remove(place);
  };
  Numbers numbers(2500, 4000);
  numbers.Add(300);
  fail(numbers);
  EXPECT_TRUE(SegmentFiles(scratch.path()).empty()) << "there is no checkpoint yet that needs any";
  for (const std::int64_t more : {1200, 20, 2000}) {
    numbers.Add(more);
    ASSERT_TRUE(Save(*directory, numbers, 2).ok());
    const std::vector<std::string> standing = SegmentFiles(scratch.path());
    const std::uint64_t then = HashState(numbers);
    for (int tries = 0; tries < 3; ++tries) {
      numbers.Add(500);
      fail(numbers);
      EXPECT_EQ(SegmentFiles(scratch.path()), standing) << more;
    }
    Numbers before(2500, 4000);
    const Status loaded = Load(*directory, before);
    ASSERT_TRUE(loaded.ok()) << loaded.message();
    EXPECT_EQ(HashState(before), then) << "the checkpoint that stands is whole";
    ASSERT_TRUE(Save(*directory, numbers, 2).ok());
    Numbers again(2500, 4000);
    ASSERT_TRUE(Load(*directory, again).ok());
    EXPECT_EQ(HashState(again), HashState(numbers)) << "and so is the next one";
  }
}

#if !defined(_WIN32)  // where a folder with an open file is not moved
TEST(RowSegments, AFolderThatIsExchangedWhileOneIsWrittenIsNotWrittenTo) {
  testing::ScratchFolder scratch("exchanged");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  const std::string other = scratch.path() + "/other", theirs = "learner.rows_000000000000_000000000010.rows";
  fs::create_directories(other + "/checkpoints");
  for (const std::string& file : {std::string(".lock"), "checkpoints/" + theirs})
    std::ofstream(other + "/" + file) << "theirs";
  Numbers numbers(2500, 4000);
  numbers.Add(300);
  numbers.on_copy = [&] {
    fs::rename(directory->path(), scratch.path() + "/moved");
    fs::rename(other, directory->path());
  };
  EXPECT_THAT(Save(*directory, numbers, 1).message(), HasSubstr("belongs to another run now"));
  EXPECT_THAT(SegmentFiles(scratch.path()), ::testing::ElementsAre(::testing::EndsWith(theirs)));
  EXPECT_EQ(std::distance(fs::directory_iterator(directory->File("checkpoints")), fs::directory_iterator()), 1);
}
#endif

TEST(RowSegments, ADamagedOneMakesItsCheckpointBePassedOver) {
  testing::ScratchFolder scratch("damaged");
  std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(2500, 4000), before(2500, 4000);
  numbers.Add(1100);
  before.Add(1100);
  ASSERT_TRUE(Save(*directory, numbers, 3).ok());
  numbers.Add(500);
  ASSERT_TRUE(Save(*directory, numbers, 3).ok());
  const std::string newest = SegmentFiles(scratch.path()).back();
  std::fstream file(newest, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(100000);
  file.put('x');
  file.close();
  directory.reset();
  directory = OpenRun(scratch.path(), ExistingRun::kResume);
  Numbers again(2500, 4000);
  ASSERT_TRUE(Load(*directory, again).ok());
  EXPECT_EQ(HashState(before), HashState(again)) << "of the checkpoint before";
  // It goes on otherwise than it did then.
  again.salt = 1;
  again.Add(500);
  ASSERT_TRUE(Save(*directory, again, 3).ok());
  Numbers last(2500, 4000);
  ASSERT_TRUE(Load(*directory, last).ok());
  EXPECT_EQ(HashState(again), HashState(last));
  fs::remove(SegmentFiles(scratch.path()).front());
  EXPECT_THAT(Load(*directory, last).message(), HasSubstr("whole"));
}

#if defined(_WIN32)
constexpr const char* kWhyNot = "Permission denied";  // what its runtime says of a folder
#else
constexpr const char* kWhyNot = "no regular file";
#endif

// It may be whole, and then an older checkpoint would be gone on from for nothing.
TEST(RowSegments, OneThatCannotBeReadIsAnErrorThatLosesNothing) {
  testing::ScratchFolder scratch("unreadable");
  const std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(2500, 4000);
  for (const std::int64_t more : {1100, 1200}) {
    numbers.Add(more);
    ASSERT_TRUE(Save(*directory, numbers, 3).ok());
  }
  const std::string newest = SegmentFiles(scratch.path()).back();
  fs::rename(newest, scratch.path() + "/aside");
  Numbers again(2500, 4000);
  const auto refused = [&] {
    const Status status = Load(*directory, again);
    EXPECT_EQ(status.code(), StatusCode::kDataLoss);
    EXPECT_THAT(status.message(),
                AllOf(HasSubstr(fs::path(newest).filename().string()), HasSubstr(kWhyNot), HasSubstr("may be whole")));
    fs::remove(newest);
  };
  fs::create_directory(newest);  // which nobody can read, root neither
  refused();
#if !defined(_WIN32)
  ASSERT_EQ(mkfifo(newest.c_str(), 0600), 0);
  refused();
#endif
  fs::rename(scratch.path() + "/aside", newest);
  ASSERT_TRUE(Load(*directory, again).ok());
  EXPECT_EQ(HashState(numbers), HashState(again));
}

TEST(RowSegments, AnotherRowSizeIsRefusedAndForceClearsThem) {
  testing::ScratchFolder scratch("force");
  std::unique_ptr<RunDirectory> directory = OpenRun(scratch.path(), ExistingRun::kRefuse);
  Numbers numbers(50, 64), wider(50, 128), fewer(10, 64);
  numbers.Add(40);
  ASSERT_TRUE(Save(*directory, numbers, 3).ok());
  EXPECT_EQ(Load(*directory, wider).code(), StatusCode::kDataLoss);
  EXPECT_THAT(Load(*directory, fewer).message(), HasSubstr("'numbers/rows'"));
  directory.reset();
  directory = OpenRun(scratch.path(), ExistingRun::kOverwrite);
  EXPECT_TRUE(SegmentFiles(scratch.path()).empty());
}

}  // namespace
}  // namespace consac::run
