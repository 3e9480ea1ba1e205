// The whole report, as the training loop drives it: definitions of the shown numbers, resume, full disks, allocations.
#include "consac/run/report.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>

#include "report/console_table.h"
#include "report/report_on.h"
#include "run/test/report/files.h"
#include "tests/allocation_counter.h"

namespace consac::run {
namespace {

const std::atomic<bool> kGoesOn{false};  // nobody stops

constexpr learn::Metric kSb2Metrics[] = {{"policy_loss", "loss/policy_gradient_loss", -0.0125, true},
                                         {"value_loss", "loss/value_function_loss", 33.5, true},
                                         {"explained_variance", "", 0.51234, false},
                                         {"", "input_info/old_value_pred", 1.5, false}};
constexpr learn::Metric kSb3Metrics[] = {{"train/loss", "train/loss", 0.2451, false},
                                         {"train/n_updates", "train/n_updates", 12340.0, false}};

// A report that prints to a file in memory.
class Printed {
 public:
  explicit Printed(const ReportOptions& options, bool terminal = false)
      : stream_(std::tmpfile()), report_(std::move(*ReportOn(options, {stream_, terminal, false, 120}))) {}
  ~Printed() {
    report_.reset();
    std::fclose(stream_);
  }
  Printed(const Printed&) = delete;
  Printed& operator=(const Printed&) = delete;
  Report* operator->() { return report_.get(); }
  /// The only behaviour's agents go on to `steps`.
  void Step(std::int64_t steps, double reward) {
    const BehaviourStep step{steps - steps_, reward};
    steps_ = steps;
    report_->OnStep(steps, {&step, 1});
  }
  /// A resumed run stands at `steps`.
  void GoOnFrom(std::int64_t steps) { steps_ = steps; }
  /// The only behaviour's learner has made an update.
  void Update(std::span<const learn::Metric> metrics, std::int64_t steps, std::int64_t updates,
              std::int64_t steps_per_update) {
    const UpdateReport update{0, metrics, updates, steps_per_update, updates};
    report_->OnUpdates({&update, 1}, steps);
  }
  /// What was printed since the last call.
  std::string Text() {
    std::fflush(stream_);
    const long end = std::ftell(stream_);
    std::string text(static_cast<std::size_t>(end - read_), '\0');
    std::fseek(stream_, read_, SEEK_SET);
    text.resize(std::fread(text.data(), 1, text.size(), stream_));
    std::fseek(stream_, end, SEEK_SET);
    read_ = end;
    return text;
  }

 private:
  std::FILE* stream_;
  std::unique_ptr<Report> report_;
  long read_ = 0;
  std::int64_t steps_ = 0;
};

ReportOptions Options(const std::string& directory = "") {
  ReportOptions options;
  options.directory = directory;
  options.world_id = "road-v0";
  options.algorithm = "ppo2";
  options.behaviours[0].slots = 4;
  options.total_steps = 100000;
  options.progress = false;
  return options;
}

std::string EventsOf(const std::string& folder) {
  std::string bytes;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) bytes += TextOf(entry.path().string());
  return bytes;
}

TEST(Report, StableBaselines2NumbersAsDefined) {
  FakeClock clock;
  Printed report(Options());
  clock.now += 30.0;  // an engine that was waited for
  report.Step(4, 1.0);
  clock.now += 2.0;
  report.Step(512, 1.0);
  report.Update(kSb2Metrics, 512, 1, 512);
  EXPECT_EQ(report.Text(),
            "---------------------------------\n"
            "| explained_variance | 0.512    |\n"
            "| fps                | 256      |\n"
            "| n_updates          | 1        |\n"
            "| policy_loss        | -0.0125  |\n"
            "| serial_timesteps   | 128      |\n"
            "| time_elapsed       | 0        |\n"
            "| total_timesteps    | 512      |\n"
            "| value_loss         | 33.5     |\n"
            "---------------------------------\n");
  clock.now += 1.0;
  report->OnEpisode({0, 20.0, 100, 800});
  report->OnEpisode({1, 10.0, 51, 804});
  report.Step(1024, 1.0);
  report.Update(kSb2Metrics, 1024, 2, 512);
  EXPECT_EQ(report.Text(),
            "---------------------------------\n"
            "| ep_len_mean        | 75.5     |\n"
            "| ep_reward_mean     | 15       |\n"
            "| explained_variance | 0.512    |\n"
            "| fps                | 512      |\n"
            "| n_updates          | 2        |\n"
            "| policy_loss        | -0.0125  |\n"
            "| serial_timesteps   | 256      |\n"
            "| time_elapsed       | 2        |\n"
            "| total_timesteps    | 1024     |\n"
            "| value_loss         | 33.5     |\n"
            "---------------------------------\n");
}

TEST(Report, StableBaselines3NumbersAsDefined) {
  FakeClock clock;
  ReportOptions options = Options();
  options.style = learn::LogStyle::kStableBaselines3;
  Printed report(options);
  report.Step(4, 1.0);
  clock.now += 2.5;
  report->OnEpisode({0, 20.0, 100, 400});
  report.Update(kSb3Metrics, 512, 1, 512);
  EXPECT_EQ(report.Text(),
            "---------------------------------\n"
            "| rollout/           |          |\n"
            "|    ep_len_mean     | 100      |\n"
            "|    ep_rew_mean     | 20       |\n"
            "| time/              |          |\n"
            "|    fps             | 204      |\n"
            "|    iterations      | 1        |\n"
            "|    time_elapsed    | 2        |\n"
            "|    total_timesteps | 512      |\n"
            "| train/             |          |\n"
            "|    loss            | 0.245    |\n"
            "|    n_updates       | 12340    |\n"
            "---------------------------------\n");
}

TEST(Report, LogIntervalQuietensTheTableNotTheFiles) {
  const TestFolder folder;
  FakeClock clock;
  ReportOptions options = Options(folder.path());
  options.log_interval = 3;
  Printed report(options);
  int tables = 0;
  for (int update = 1; update <= 7; ++update) {
    report.Update(kSb2Metrics, 512 * update, update, 512);
    tables += report.Text().empty() ? 0 : 1;
  }
  EXPECT_EQ(tables, 3) << "1 (as Stable Baselines 2 does), 3 and 6";
  const std::string csv = TextOf(folder.File("progress.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 8);
}

// An algorithm that learns far more often than it reports: every third of its reports, whatever its updates are by
// then.
TEST(Report, LogIntervalCountsReports) {
  const TestFolder folder;
  FakeClock clock;
  ReportOptions options = Options(folder.path());
  options.log_interval = 3;
  Printed report(options);
  std::string shown;
  for (const int episodes : {4, 8, 12, 16, 20, 24, 28}) {
    const std::int64_t updates = 37 * episodes;
    const UpdateReport update{0, kSb2Metrics, updates, 0, episodes / 4};
    report->OnUpdates({&update, 1}, 4 * updates);
    if (!report.Text().empty()) shown += std::to_string(episodes) + " ";
  }
  EXPECT_EQ(shown, "4 12 24 ") << "the first (as Stable Baselines 2 does), the third and the sixth";
}

int TablesIn(const std::string& text) {
  int tables = 0;
  for (std::size_t at = 0; (at = text.find("| n_updates", at)) != std::string::npos; ++at) ++tables;
  return tables;
}

TEST(Report, ATerminalIsNotFloodedAndShowsTheLastTable) {
  const TestFolder folder;
  FakeClock clock;
  for (const bool terminal : {false, true}) {
    Printed report(Options(folder.path()), terminal);
    for (int update = 1; update <= 350; ++update) {
      clock.now += 0.01;
      report.Step(512 * update, 1.0);
      report.Update(kSb2Metrics, 512 * update, update, 512);
    }
    const std::string text = report.Text();
    EXPECT_EQ(TablesIn(text), terminal ? 4 : 350) << "the first, and one a second";
    EXPECT_EQ(text.find("| total_timesteps    | 179200 ") == std::string::npos, terminal);
    ASSERT_TRUE(report->Finish().ok());
    const std::string end = report.Text();
    EXPECT_EQ(TablesIn(end), terminal ? 1 : 0);
    EXPECT_EQ(end.find("| total_timesteps    | 179200 ") != std::string::npos, terminal) << end;
    const std::string csv = TextOf(folder.File("progress.csv"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 351) << "the files have all of them";
  }
}

TEST(Report, EveryTableIsShownOnATerminalWhereThatIsAskedFor) {
  FakeClock clock;
  ReportOptions options = Options();
  options.table_every_s = 0.0;
  Printed report(options, true);
  for (int update = 1; update <= 10; ++update) report.Update(kSb2Metrics, 512 * update, update, 512);
  EXPECT_EQ(TablesIn(report.Text()), 10);
}

TEST(Report, ATableThatWasHeldBackComesWhenItsTimeHasCome) {
  FakeClock clock;
  Printed report(Options(), true);
  report.Update(kSb2Metrics, 512, 1, 512);
  clock.now += 0.5;
  report.Update(kSb2Metrics, 1024, 2, 512);
  EXPECT_EQ(TablesIn(report.Text()), 1);
  for (int step = 1025; step <= 1035; ++step) {
    clock.now += 0.1;
    report.Step(step, 1.0);
  }
  EXPECT_EQ(TablesIn(report.Text()), 1);
}

/// Two behaviours, 3 and 1 agents.
ReportOptions Two(const std::string& directory = "") {
  ReportOptions options = Options(directory);
  options.behaviours = {{"hunter", 3}, {"prey", 1}};
  return options;
}

/// One second, some episodes, then both have learned at once.
void UpdateBoth(Printed& report, FakeClock& clock, std::span<const learn::Metric> metrics) {
  const BehaviourStep steps[2] = {{3, 6.0}, {1, -1.0}};
  report->OnStep(4, steps);
  clock.now += 1.0;
  report->OnEpisode({0, 20.0, 100, 400, 0});
  report->OnEpisode({0, -4.0, 10, 404, 1});
  report->OnStep(512, steps);
  const UpdateReport updates[2] = {{0, metrics, 1, 384, 1}, {1, metrics, 1, 128, 1}};
  report->OnUpdates(updates, 512);
}

TEST(Report, TwoBehavioursHaveNumbersOfTheirOwnInOneTable) {
  FakeClock clock;
  Printed report(Two());
  UpdateBoth(report, clock, std::span(kSb2Metrics).first(1));
  EXPECT_EQ(report.Text(),
            "----------------------------------\n"
            "| total_timesteps     | 512      |\n"
            "| hunter/             |          |\n"
            "|    ep_len_mean      | 100      |\n"
            "|    ep_reward_mean   | 20       |\n"
            "|    fps              | 512      |\n"
            "|    n_updates        | 1        |\n"
            "|    policy_loss      | -0.0125  |\n"
            "|    serial_timesteps | 128      |\n"
            "|    time_elapsed     | 0        |\n"
            "| prey/               |          |\n"
            "|    ep_len_mean      | 10       |\n"
            "|    ep_reward_mean   | -4       |\n"
            "|    fps              | 512      |\n"
            "|    n_updates        | 1        |\n"
            "|    policy_loss      | -0.0125  |\n"
            "|    serial_timesteps | 128      |\n"
            "|    time_elapsed     | 0        |\n"
            "----------------------------------\n");
}

TEST(Report, TwoBehavioursShareNoKeyTagOrFile) {
  const TestFolder folder;
  FakeClock clock;
  Printed report(Two(folder.path()));
  UpdateBoth(report, clock, kSb2Metrics);
  clock.now += 1.0;
  const UpdateReport second{1, kSb2Metrics, 2, 128, 2};
  report->OnUpdates({&second, 1}, 640);
  ASSERT_TRUE(report->Finish().ok());
  report->DrawCurves(kGoesOn);
  const std::string csv = TextOf(folder.File("progress.csv"));
  EXPECT_EQ(
      csv.rfind("total_timesteps,hunter/ep_len_mean,hunter/ep_reward_mean,hunter/explained_variance,hunter/fps,", 0),
      0u)
      << csv;
  EXPECT_NE(csv.find("\n640,,,,,,,,,,10.0,-4.0,0.51234,128,2,"), std::string::npos)
      << csv << "fps of prey is of its own last update; what hunter did not learn is empty";
  for (const char* file : {"hunter.monitor.csv", "prey.monitor.csv", "hunter.curve.svg", "prey.curve.png"})
    EXPECT_TRUE(std::filesystem::exists(folder.File(file))) << file;
  EXPECT_NE(TextOf(folder.File("prey.monitor.csv")).find("\nr,l,t\n-4.0,10,1.0\n"), std::string::npos);
  const std::string events = EventsOf(folder.File("tensorboard/PPO2_1"));
  for (const char* tag : {"hunter/episode_reward", "prey/episode_reward", "hunter/loss/value_function_loss",
                          "prey/loss/value_function_loss"}) {
    EXPECT_NE(events.find(tag), std::string::npos) << tag;
  }
}

// The table of progress.csv is read back where a run goes on, and a slash makes sections.
TEST(Report, ANameWithACommaOrASlashIsOneColumnAndOneSection) {
  const TestFolder folder;
  FakeClock clock;
  ReportOptions options = Two(folder.path());
  options.behaviours[0].name = "hunter, red/left";
  Printed report(options);
  UpdateBoth(report, clock, kSb2Metrics);
  ASSERT_TRUE(report->Finish().ok());
  const std::string csv = TextOf(folder.File("progress.csv"));
  EXPECT_EQ(csv.rfind("total_timesteps,hunter%2C red%2Fleft/ep_len_mean,hunter%2C red%2Fleft/", 0), 0u) << csv;
  const std::string header = csv.substr(0, csv.find('\n')),
                    row = csv.substr(header.size() + 1, csv.find('\n', header.size() + 1) - header.size() - 1);
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(row.begin(), row.end(), ',')) << csv;
  EXPECT_TRUE(std::filesystem::exists(folder.File("hunter%2C red%2Fleft.monitor.csv")));
}

TEST(Report, TwoBehavioursOfTheSecondGenerationToo) {
  const TestFolder folder;
  FakeClock clock;
  ReportOptions options = Two(folder.path());
  options.style = learn::LogStyle::kStableBaselines3;
  Printed report(options);
  UpdateBoth(report, clock, kSb3Metrics);
  const std::string table = report.Text();
  const std::size_t section = table.find("\n| hunter/ ");
  ASSERT_NE(section, std::string::npos) << table;
  EXPECT_EQ(table.find("|    rollout/ep_len_mean"), table.find('\n', section + 1) + 1) << table;
  ASSERT_TRUE(report->Finish().ok());
  const std::string csv = TextOf(folder.File("progress.csv"));
  EXPECT_EQ(csv.rfind("hunter/rollout/ep_len_mean,hunter/rollout/ep_rew_mean,hunter/time/fps,", 0), 0u) << csv;
  const std::string events = EventsOf(folder.File("tensorboard/PPO2_1"));
  for (const char* tag : {"hunter/rollout/ep_rew_mean", "prey/time/fps", "prey/train/loss"})
    EXPECT_NE(events.find(tag), std::string::npos) << tag;
}

// However often each of two learns, neither keeps the other from being seen.
TEST(Report, ATableThatWasHeldBackShowsEveryBehaviour) {
  FakeClock clock;
  Printed report(Two(), true);
  for (int update = 1; update <= 250; ++update) {
    for (std::size_t b = 0; b < 2; ++b) {
      clock.now += 0.005;
      const UpdateReport one{b, kSb2Metrics, update, 64, update};
      report->OnUpdates({&one, 1}, 128 * update + static_cast<std::int64_t>(b));
    }
  }
  const std::string text = report.Text();
  EXPECT_EQ(TablesIn(text), 0) << "they stand in sections";
  for (const char* name : {"| hunter/ ", "| prey/ "}) {
    int shown = 0;
    for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos; ++at) ++shown;
    EXPECT_GE(shown, 2) << name;
    EXPECT_LE(shown, 3) << name;
  }
}

TEST(Report, AResumedRunKnowsEveryBehaviour) {
  FakeClock clock;
  Printed killed(Two());
  UpdateBoth(killed, clock, kSb2Metrics);
  StateWriter checkpoint;
  killed->Visit(checkpoint);
  Printed resumed(Two());
  StateReader reader(checkpoint.fields());
  resumed->Visit(reader);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  EXPECT_EQ(resumed->mean_episode_reward(0), 20.0);
  EXPECT_EQ(resumed->mean_episode_reward(1), -4.0);
}

TEST(Report, MeansAreOverTheLastHundredEpisodes) {
  Printed report(Options());
  EXPECT_TRUE(std::isnan(report->mean_episode_reward(0)));
  EXPECT_TRUE(std::isnan(report->mean_episode_length(0)));
  for (int i = 1; i <= 250; ++i) report->OnEpisode({0, static_cast<double>(i), 2 * i, 10 * i});
  EXPECT_DOUBLE_EQ(report->mean_episode_reward(0), 200.5);
  EXPECT_DOUBLE_EQ(report->mean_episode_length(0), 401.0);
}

TEST(Report, WritesEveryFile) {
  const TestFolder folder;
  FakeClock clock;
  Printed report(Options(folder.path()));
  report.Step(4, 1.0);
  clock.now += 1.5;
  report->OnEpisode({0, 20.0, 100, 400});
  report.Update(kSb2Metrics, 512, 1, 512);
  ASSERT_TRUE(report->Finish().ok());
  report->DrawCurves(kGoesOn);
  EXPECT_EQ(TextOf(folder.File("progress.csv")),
            "ep_len_mean,ep_reward_mean,explained_variance,fps,n_updates,policy_loss,serial_timesteps,time_elapsed,"
            "total_timesteps,value_loss\n"
            "100.0,20.0,0.51234,341,1,-0.0125,128,0.0,512,33.5\n");
  const std::string monitor = TextOf(folder.File("monitor.csv"));
  EXPECT_EQ(monitor.rfind("#{\"t_start\":", 0), 0u);
  EXPECT_NE(monitor.find("\nr,l,t\n20.0,100,1.5\n"), std::string::npos);
  const std::string events = EventsOf(folder.File("tensorboard/PPO2_1"));
  for (const char* tag :
       {"episode_reward", "loss/policy_gradient_loss", "loss/value_function_loss", "input_info/old_value_pred"}) {
    EXPECT_NE(events.find(tag), std::string::npos) << tag;
  }
  EXPECT_EQ(events.find("explained_variance"), std::string::npos) << "it has no tag";
  EXPECT_TRUE(std::filesystem::exists(folder.File("curve.svg")));
  EXPECT_TRUE(std::filesystem::exists(folder.File("curve.png")));
}

TEST(Report, StableBaselines3TagsOfTheTable) {
  const TestFolder folder;
  ReportOptions options = Options(folder.path());
  options.style = learn::LogStyle::kStableBaselines3;
  options.algorithm = "ppo";
  Printed report(options);
  report->OnEpisode({0, 20.0, 100, 400});
  report.Update(kSb3Metrics, 512, 1, 512);
  ASSERT_TRUE(report->Finish().ok());
  const std::string events = EventsOf(folder.File("tensorboard/PPO_1"));
  for (const char* tag : {"rollout/ep_rew_mean", "rollout/ep_len_mean", "time/fps", "train/loss", "train/n_updates"}) {
    EXPECT_NE(events.find(tag), std::string::npos) << tag;
  }
  for (const char* tag : {"time/iterations", "time/total_timesteps", "episode_reward"})
    EXPECT_EQ(events.find(tag), std::string::npos) << tag;
}

// Updates of 512 steps, one episode in each, `clock` a second further.
void Train(Printed& report, FakeClock& clock, int from, int to) {
  for (int update = from; update <= to; ++update) {
    for (int step = 512 * (update - 1) + 4; step <= 512 * update; step += 4) {
      report.Step(step, 2.0);
      if (step == 512 * update - 100) report->OnEpisode({0, static_cast<double>(update % 7), 500 + update, step});
    }
    clock.now += 1.0;
    report.Update(kSb2Metrics, 512 * update, update, 512);
  }
}

TEST(Report, AResumedRunShowsWhatOneNeverInterruptedShows) {
  const TestFolder whole_folder, folder_of_both;
  const std::string folder = folder_of_both.File("killed"), whole_path = folder_of_both.File("whole");
  std::filesystem::create_directories(folder);
  std::filesystem::create_directories(whole_path);
  FakeClock clock;
  Printed whole(Options(whole_path));
  Train(whole, clock, 1, 6);

  StateWriter checkpoint;
  {
    Printed killed(Options(folder));
    Train(killed, clock, 1, 3);
    killed->Visit(checkpoint);
    Train(killed, clock, 4, 5);
  }
  clock.now += 3600.0;
  ReportOptions options = Options(folder);
  options.append = true;
  options.resume_step = 512 * 3;
  Printed resumed(options);
  StateReader reader(checkpoint.fields());
  resumed->Visit(reader);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  resumed.GoOnFrom(512 * 3);
  Train(resumed, clock, 4, 6);
  EXPECT_EQ(resumed->mean_episode_reward(0), whole->mean_episode_reward(0));
  for (Printed* report : {&whole, &resumed}) {
    ASSERT_TRUE((*report)->Finish().ok());
    (*report)->DrawCurves(kGoesOn);
  }
  EXPECT_EQ(TextOf(folder + "/progress.csv"), TextOf(whole_path + "/progress.csv"));
  EXPECT_TRUE(TextOf(folder + "/curve.png") == TextOf(whole_path + "/curve.png"));
  const auto rows = [](const std::string& text) { return text.substr(text.find('\n')); };
  EXPECT_EQ(rows(TextOf(folder + "/monitor.csv")), rows(TextOf(whole_path + "/monitor.csv")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder + "/tensorboard/PPO2_1"), {}), 2);
}

// Of hundreds of behaviours drawing takes long, and whoever has stopped the run waits.
TEST(Report, WhoStopsWaitsForFewCurves) {
  const TestFolder folder;
  ReportOptions options = Options(folder.path());
  options.behaviours.clear();
  for (int i = 0; i < 20; ++i) options.behaviours.push_back({"b" + std::to_string(i), 1});
  Printed report(options);
  (void)report.Text();
  double now = 1000.0;
  Hooks hooks;  // each look at the clock is half a second later
  hooks.user = &now;
  hooks.now = [](void* user) { return *static_cast<double*>(user) += 0.5; };
  SetHooks(hooks);
  const std::atomic<bool> stopped{true};
  report->DrawCurves(stopped);
  SetHooks({});
  EXPECT_TRUE(std::filesystem::exists(folder.File("b0.curve.svg")));
  EXPECT_FALSE(std::filesystem::exists(folder.File("b19.curve.svg")));
  EXPECT_NE(report.Text().find("of 20 curves are drawn"), std::string::npos);
  report->DrawCurves(kGoesOn);
  EXPECT_TRUE(std::filesystem::exists(folder.File("b19.curve.svg")));
}

#if !defined(_WIN32)  // where a folder with an open file is not moved
// Between the look at the folder and the picture's file, where a path alone would be another run's.
TEST(Report, ACurveIsDrawnInTheFolderThatWasLookedAtWhereverThatIsMoved) {
  namespace fs = std::filesystem;
  const TestFolder folder;
  const std::string here = folder.File("here"), moved = folder.File("moved");
  fs::create_directories(here);
  ReportOptions options = Options(here);
  options.may_write = [&] {
    if (fs::exists(moved)) return Status(StatusCode::kDataLoss, "it is another run's now");
    fs::rename(here, moved);
    fs::create_directories(here);
    return Status::Ok();
  };
  Printed report(options);
  report->DrawCurves(kGoesOn);
  EXPECT_TRUE(fs::exists(moved + "/curve.svg"));
  EXPECT_TRUE(fs::is_empty(here));
  EXPECT_NE(report.Text().find("warning: there is no curve: it is another run's now"), std::string::npos);
}
#endif

TEST(Report, FilesThatCannotBeOpenedAreNamed) {
  const auto report = Report::Open(Options("/nowhere"));
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.status().message().find("/nowhere/progress.csv"), std::string::npos);
}

#if !defined(_WIN32)
TEST(Report, AFullDiskIsSaidOnceForEachFileAndTrainingGoesOn) {
  const TestFolder folder;
  FakeClock clock;
  ReportOptions options = Options(folder.path());
  options.console_table = false;
  Printed report(options);
  const FileSizeLimit limit(2000);
  Train(report, clock, 1, 60);
  const std::string said = report.Text();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2) << said;
  for (const std::string& file : {folder.File("progress.csv"), folder.File("tensorboard/PPO2_1/events.")}) {
    EXPECT_NE(said.find("error: cannot write '" + file), std::string::npos) << said;
  }
  EXPECT_NE(said.find("training goes on"), std::string::npos) << said;
  EXPECT_EQ(TextOf(folder.File("progress.csv")).back(), '\n') << "whole rows only";
  EXPECT_EQ(report->Finish().code(), StatusCode::kResourceExhausted);
}
#endif

TEST(Report, PlainProgressEveryFewSeconds) {
  FakeClock clock;
  ReportOptions options = Options();
  options.progress = true;
  Printed report(options);
  int lines = 0;
  for (int step = 4; step <= 40000; step += 4) {
    clock.now += 0.001;
    report.Step(step, 4.0);
    const std::string text = report.Text();
    lines += text.empty() ? 0 : 1;
    if (!text.empty()) {
      EXPECT_EQ(text.rfind(" 20% | 20,0", 0), 0u) << text;
      EXPECT_NE(text.find(" of 100,000 steps | 4,000 steps/s | no episode yet | 0:20 left\n"), std::string::npos)
          << text;
    }
  }
  EXPECT_EQ(lines, 1) << "10 s at one line in 5 s, counted from the first step";
  ASSERT_TRUE(report->Finish().ok());
  EXPECT_EQ(report.Text().substr(0, 46), " 40% | 40,000 of 100,000 steps | 4,000 steps/s");
}

TEST(Report, BarIsRedrawnAtMostTenTimesASecond) {
  FakeClock clock;
  ReportOptions options = Options();
  options.progress = true;
  Printed report(options, true);
  for (int step = 1; step <= 20000; ++step) {
    clock.now += 0.0001;
    report.Step(step, 1.0);
  }
  const std::string text = report.Text();
  const auto bars = std::count(text.begin(), text.end(), '\r');
  EXPECT_GE(bars, 15);
  EXPECT_LE(bars, 20);
  EXPECT_EQ(text.find('\n'), std::string::npos);
}

TEST(Report, ASlowEngineIsFollowedStepByStep) {
  FakeClock clock;
  ReportOptions options = Options();
  options.progress = true;
  Printed report(options, true);
  for (int step = 1; step <= 20; ++step) {
    clock.now += 0.5;
    report.Step(step, 1.0);
  }
  const std::string text = report.Text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 19) << "each step but the first, which starts the clock";
}

// An agent that never leaves the road any more: what its last episodes brought is long ago.
TEST(Report, WithoutEpisodeEndsTheRewardOfAStepIsShown) {
  const TestFolder folder;
  FakeClock clock;
  ReportOptions options = Options(folder.path());
  options.progress = true;
  Printed report(options);
  for (int step = 4; step <= 50000; step += 4) {
    report.Step(step, step < 5000 ? 2.0 : 3.6);
    if (step < 5000 && step % 100 == 0) report->OnEpisode({0, 50.0, 25, step});
  }
  ASSERT_TRUE(report->Finish().ok());
  EXPECT_NE(report.Text().find("reward per step 0.9 |"), std::string::npos);
}

TEST(Report, NeitherStepsNorEpisodesAllocate) {
  const TestFolder folder;
  const FakeClock clock;  // a line after some seconds may allocate
  ReportOptions options = Options(folder.path());
  options.progress = true;
  options.total_steps = 100000000;
  for (const bool terminal : {false, true}) {
    Printed report(options, terminal);
    const auto run = [&](int from, int to) {
      for (int step = from; step < to; ++step) {
        report.Step(step, 1.0);
        if (step % 3 == 0) report->OnEpisode({0, 0.1 * step, 3, step});
      }
    };
    run(1, 1000);
    const std::int64_t before = consac::testing::AllocationCount();
    run(1000, 200000);
    EXPECT_EQ(consac::testing::AllocationCount(), before);
    report->Line("a line may allocate");
    EXPECT_GT(consac::testing::AllocationCount(), before) << "the counter must be able to see one";
  }
}

}  // namespace
}  // namespace consac::run
