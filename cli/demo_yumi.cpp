#include "cli/demo_yumi.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "cli/print.h"
#include "cli/twin_picture.h"
#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/run/actors.h"
#include "consac/run/training.h"
#include "consac/twin/import.h"
#include "worlds/registry.h"
#include "worlds/robot_reach/robot_reach.h"
#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kReachWorld = "yumi-reach-v0";
constexpr const char* kYumiFile = "examples/robots/yumi/yumi_description/urdf/yumi_calibrated.urdf";
constexpr int kTargets = 20, kPictured = 8, kColumns = 4, kSide = 320;  // pixels of a picture's side
constexpr std::uint64_t kTargetSeed = 1000;
constexpr PictureBall kGoal{{}, 0.025, {0.02f, 0.45f, 0.08f}}, kWay{{}, 0.008, {0.85f, 0.25f, 0.02f}};

// The URDF: as it was named, or in the repository from which, or within which, the program runs.
Result<std::string> FindYumi(const DemoYumiFlags& flags) {
  if (!flags.robot.empty()) return flags.robot;
  std::error_code error;
  if (fs::is_regular_file(ToPath(kYumiFile), error)) return std::string(kYumiFile);
  fs::path around = fs::absolute(ToPath(ProgramPath()), error).parent_path();
  for (int up = 0; up < 4 && !around.empty(); ++up, around = around.parent_path()) {
    if (fs::is_regular_file(around / kYumiFile, error)) return FromPath(around / kYumiFile);
  }
  return Status{StatusCode::kNotFound, "YuMi's description, " + Quote(kYumiFile) +
                                           ", is neither here nor around the program; run this in CONSAC's repository, "
                                           "or name the file: --robot yumi_calibrated.urdf"};
}

// The name of joint `i` of the world's arm, of a right or a left one.
std::string JointName(const worlds::ReachTask& task, std::size_t i, char side) {
  std::string name = task.robot.joints[static_cast<std::size_t>(task.robot.position_joints[i])].name;
  name.back() = side;
  return name;
}

// Where the joint's position stands among the robot's; -1 where there is no such joint, or it does not move by itself.
std::int32_t PositionOf(const robot::Robot& robot, const std::string& name) {
  const std::int32_t joint = robot.FindJoint(name);
  return joint < 0 ? -1 : robot.joints[static_cast<std::size_t>(joint)].position_index;
}

// Ok where the twin has the arm that learns.
Status CheckArm(const robot::Robot& twin, const worlds::RobotReach& reach) {
  for (std::size_t i = 0; i < reach.joints().size(); ++i) {
    const std::string name = JointName(reach.task(), i, 'r');
    if (PositionOf(twin, name) >= 0) continue;
    return {StatusCode::kInvalidArgument, Quote(twin.name) + " has no joint " + Quote(name) +
                                              " that moves, so it is no YuMi; any robot learns to reach in the world "
                                              "twin-reach-v0 (docs/worlds.md)"};
  }
  return Status::Ok();
}

// The twin's positions for those of the world's arm, by the joints' names; the left arm rests, if there is one.
std::vector<double> PoseOf(const robot::Robot& twin, const worlds::RobotReach& reach) {
  std::vector<double> pose(static_cast<std::size_t>(twin.positions()), 0.0);
  const auto set = [&](const std::string& name, double position) {
    const std::int32_t at = PositionOf(twin, name);
    if (at >= 0) pose[static_cast<std::size_t>(at)] = position;
  };
  const std::array<double, worlds::kYumiJoints> left = worlds::YumiLeftReadyPose();
  for (std::size_t i = 0; i < left.size(); ++i) {
    set(JointName(reach.task(), i, 'r'), reach.joints()[i]);
    set(JointName(reach.task(), i, 'l'), left[i]);
  }
  return pose;
}

// What became of the targets, and pictures of the first ones.
struct Reached {
  int targets = 0;
  double steps = 0.0;  // on the way, of those that were reached
  std::vector<PictureFrame> frames;
};

Result<Reached> ReachTargets(const robot::Robot& twin, const std::string& model) {
  const Result<const worlds::World*> world = worlds::FindWorld(kReachWorld);
  if (!world.ok()) return world.status();
  const std::unique_ptr<VectorEnv> env = (*world)->create(1);
  Result<run::Actors> actors = run::Actors::Load(std::vector<std::string>{model}, env->spec());
  if (!actors.ok()) return actors.status();
  const worlds::RobotReach& reach = (*world)->robot(*env);
  const auto point = [](std::span<const double> row) { return robot::Vector3{row[0], row[1], row[2]}; };
  Rng rng(kTargetSeed, StreamId("action_sampling"));
  Reached reached;
  for (int target = 0; target < kTargets; ++target) {
    env->ResetWorld(0, kTargetSeed + static_cast<std::uint64_t>(target), actors->batches());
    actors->Begin();
    PictureFrame frame;
    int arrived = -1;
    for (int step = 0; step + 1 < worlds::RobotReach::kSteps; ++step) {
      if (StopSignal().load()) return Status{StatusCode::kCancelled, "interrupted while the arm reached"};
      frame.positions = PoseOf(twin, reach);
      if (arrived < 0) {
        PictureBall way = kWay;
        way.at = point(reach.tools());
        frame.balls.push_back(way);
      }
      actors->Act(0, env->present(0), ActionMode::kDeterministic, rng);
      env->Step(actors->batches());
      if (actors->batches()[0].rewards[0] > -0.5f && arrived < 0) arrived = step + 1;
      if (actors->batches()[0].rewards[0] <= -0.5f) arrived = -1;
    }
    PictureBall goal = kGoal;
    goal.at = point(reach.goals());
    frame.balls.push_back(goal);
    reached.targets += arrived >= 0 ? 1 : 0;
    reached.steps += std::max(arrived, 0);
    if (target < kPictured) reached.frames.push_back(std::move(frame));
  }
  reached.steps /= std::max(reached.targets, 1);
  return reached;
}

run::RunConfig LearningOf(const DemoYumiFlags& flags, const worlds::World& world) {
  run::RunConfig config;
  config.world = kReachWorld;
  config.algorithm = "sac";
  config.steps = flags.steps;
  config.seed = static_cast<std::uint64_t>(flags.seed);
  config.directory = flags.directory, config.name = flags.name;
  config.force = true, config.table = false;
  config.hyperparameters = worlds::SuggestedSettings(world, config.algorithm);
  return config;
}

Result<twin::ImportReport> ImportTwin(const std::string& urdf, const std::string& into) {
  twin::ImportOptions options;
  options.output = into, options.replace = true;
  options.progress = [](std::size_t, std::size_t) { return !StopSignal().load(); };
  return twin::Import(urdf, options);
}

Status Tell(const DemoYumiFlags& flags) {
  CONSAC_RETURN_IF_ERROR(CheckFolderName("--name", flags.name));
  const Result<std::string> urdf = FindYumi(flags);
  if (!urdf.ok()) return urdf.status();
  const Result<const worlds::World*> world = worlds::FindWorld(kReachWorld);
  if (!world.ok()) return world.status();
  const std::unique_ptr<VectorEnv> env = (*world)->create(1);
  const worlds::RobotReach& reach = (*world)->robot(*env);

  Print("1. ABB's YuMi comes from {}.\n", *urdf);
  FlushOutput();
  std::error_code error;
  fs::create_directories(ToPath(flags.directory), error);
  const std::string twin_folder = flags.directory + "/" + FileNameOf(flags.name, "-twin");
  const Result<twin::ImportReport> twin = ImportTwin(*urdf, twin_folder);
  if (!twin.ok()) return twin.status();
  CONSAC_RETURN_IF_ERROR(CheckArm(twin->robot, reach));
  const Result<std::vector<std::byte>> glb = ReadRegularFile(twin_folder + "/twin.glb");
  if (!glb.ok()) return glb.status();
  const Result<TwinPicture> picture = TwinPicture::Read(twin->robot, *glb);
  if (!picture.ok()) return picture.status();
  const PictureFrame ready{PoseOf(twin->robot, reach), {}};
  const std::string portrait = twin_folder + ".png";
  CONSAC_RETURN_IF_ERROR(picture->WriteStrip(portrait, {&ready, 1}, 1, 2 * kSide, {}));
  Print("   The twin: {} links, {} joints that move, {} triangles. Its picture: {}\n\n", twin->robot.links.size(),
        twin->robot.positions(), picture->triangles(), portrait);
  Print("2. Its right arm learns to reach, {} steps of {} by sac with hindsight.\n\n", flags.steps, kReachWorld);
  FlushOutput();

  const Result<run::RunSummary> run = run::Train(LearningOf(flags, **world), StopSignal());
  if (!run.ok()) return run.status();
  if (run->interrupted) {
    const bool kept = !run->directory.empty();
    return {StatusCode::kCancelled,
            "interrupted; " + (kept ? "what was learned is in " + run->directory : "nothing was learned yet")};
  }
  const std::string& model = run->models[0].path;
  const Result<Reached> reached = ReachTargets(twin->robot, model);
  if (!reached.ok()) return reached.status();
  const std::string strip = run->directory + "/reach.png";
  CONSAC_RETURN_IF_ERROR(picture->WriteStrip(strip, reached->frames, kColumns, kSide, {}));
  Print("\n3. The arm reaches {} of {} targets it has not seen", reached->targets, kTargets);
  if (reached->targets > 0) Print(", in {:.1f} steps of {} s on average", reached->steps, worlds::RobotReach::kStep);
  Print(
      ".\n\nto look at      {1}\nmove it         {0} twin view {2} --model {3} --open\njudge it        {0} eval {3} "
      "--episodes 100\n",
      Argument(ProgramPath()), Argument(strip), Argument(twin_folder), Argument(model));
  return Status::Ok();
}

}  // namespace

int DemoYumi(const DemoYumiFlags& flags) {
  const Status told = Tell(flags);
  if (told.ok()) return 0;
  if (told.code() != StatusCode::kCancelled) return Fail("demo", told);
  PrintError("consac demo: {}\n", told.message());
  return 130;
}

}  // namespace consac::cli
