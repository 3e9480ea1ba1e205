// Source of the control: servo position actuators of mujoco.readthedocs.io, XMLreference, actuator/position, with a
// velocity term; mj_step1 and mj_step2 with the bias forces applied between them. MuJoCo's structures are those of the
// header of the build; its library is loaded where a world asks for it, so that the program runs without.
#include "worlds/mujoco/mujoco.h"

#include "consac/base/text.h"

#ifdef CONSAC_WITH_MUJOCO

#include <dlfcn.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "consac/base/hooks.h"
#include "consac/robot/kinematics.h"

namespace consac::worlds {
namespace {

static_assert(sizeof(mjtNum) == sizeof(double), "MuJoCo is used in double precision");

constexpr double kTimestep = 0.002;  // s
constexpr double kServo = 50.0;      // rad/s: a servo has closed in on its target within some 0.1 s
constexpr double kPlaceOff = 1e-4;   // m, and
constexpr double kTurnOff = 1e-3;    // rad, that links may be from where the joint table has them

Status Unfit(const std::string& why) {
  return {StatusCode::kInvalidArgument, why};
}

// The library's functions.
struct Library {
  decltype(&mj_loadXML) loadXML = nullptr;
  decltype(&mj_deleteModel) deleteModel = nullptr;
  decltype(&mj_makeData) makeData = nullptr;
  decltype(&mj_deleteData) deleteData = nullptr;
  decltype(&mj_copyData) copyData = nullptr;
  decltype(&mj_resetData) resetData = nullptr;
  decltype(&mj_forward) forward = nullptr;
  decltype(&mj_step1) step1 = nullptr;
  decltype(&mj_step2) step2 = nullptr;
  decltype(&mj_name2id) name2id = nullptr;
  decltype(&mj_version) version = nullptr;
  decltype(&mj_versionString) versionString = nullptr;
  decltype(&mju_user_warning) user_warning = nullptr;
  decltype(&mju_user_error) user_error = nullptr;
  std::string failure;  // why it cannot be used

  template <class Function>
  void Find(void* library, const char* name, Function* function) {
    *function = reinterpret_cast<Function>(dlsym(library, name));
    if (*function == nullptr && failure.empty()) failure = std::string("it has no ") + name;
  }
};

// CONSAC_MUJOCO_LIBRARY of the environment, the one that was found when this was built, the system's.
Library LoadLibrary() {
  Library out;
  const char* chosen = std::getenv("CONSAC_MUJOCO_LIBRARY");
  const char* const places[] = {chosen != nullptr ? chosen : CONSAC_MUJOCO_LIBRARY, "libmujoco.so"};
  void* library = nullptr;
  for (const char* place : places) {
    if (library == nullptr && (chosen == nullptr || place == chosen)) library = dlopen(place, RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr && out.failure.empty()) out.failure = dlerror();
  }
  if (library == nullptr) return out;
  out.failure.clear();
  out.Find(library, "mj_version", &out.version);
  out.Find(library, "mj_versionString", &out.versionString);
  if (out.failure.empty() && out.version() != mjVERSION_HEADER)
    out.failure =
        std::string("it is version ") + out.versionString() + ", and this build was made with another one's header";
  out.Find(library, "mj_loadXML", &out.loadXML);
  out.Find(library, "mj_deleteModel", &out.deleteModel);
  out.Find(library, "mj_makeData", &out.makeData);
  out.Find(library, "mj_deleteData", &out.deleteData);
  out.Find(library, "mj_copyData", &out.copyData);
  out.Find(library, "mj_resetData", &out.resetData);
  out.Find(library, "mj_forward", &out.forward);
  out.Find(library, "mj_step1", &out.step1);
  out.Find(library, "mj_step2", &out.step2);
  out.Find(library, "mj_name2id", &out.name2id);
  out.Find(library, "mju_user_warning", &out.user_warning);
  out.Find(library, "mju_user_error", &out.user_error);
  return out;
}

const Library& Mujoco() {
  static const Library library = LoadLibrary();
  return library;
}

// MuJoCo would write MUJOCO_LOG.TXT where the program runs.
void TakeOverMessages() {
  *Mujoco().user_warning = [](const char* text) { Log(LogLevel::kWarning, "MuJoCo: " + Quote(text, 300)); };
  *Mujoco().user_error = [](const char* text) {
    Log(LogLevel::kError, "MuJoCo cannot go on: " + Quote(text, 300));
    std::_Exit(1);
  };
}

// How a joint of the table is found in the model.
struct Placed {
  const robot::Joint* joint;
  int position;  // in qpos
};

// What all copies of a robot share.
struct Model {
  explicit Model(const robot::Robot& table) : robot(table) {}
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;
  ~Model() { Mujoco().deleteModel(mujoco); }

  robot::Robot robot;
  mjModel* mujoco = nullptr;
  std::vector<int> positions, motors;  // [positions] of qpos, of ctrl; -1 where limits hold the joint
  std::vector<Placed> joints;          // all that move, those that follow included
  std::vector<int> bodies;             // [links], -1 none
};

class MujocoRobot final : public ReachDynamics {
 public:
  explicit MujocoRobot(std::shared_ptr<const Model> model) : model_(std::move(model)), data_(Mujoco().makeData(Raw())) {
    joints_.resize(model_->positions.size());
  }
  ~MujocoRobot() override { Mujoco().deleteData(data_); }
  MujocoRobot(const MujocoRobot&) = delete;
  MujocoRobot& operator=(const MujocoRobot&) = delete;

  std::unique_ptr<ReachDynamics> Clone() const override {
    auto clone = std::make_unique<MujocoRobot>(model_);
    Mujoco().copyData(clone->data_, Raw(), data_);
    clone->joints_ = joints_;
    return clone;
  }

  void Place(std::span<const double> joints) override {
    Mujoco().resetData(Raw(), data_);
    std::copy(joints.begin(), joints.end(), joints_.begin());
    for (const Placed& placed : model_->joints) data_->qpos[placed.position] = JointPosition(*placed.joint, joints);
    Tell(joints);
    Mujoco().forward(Raw(), data_);
    std::fill_n(data_->qacc_warmstart, Raw()->nv, 0.0);  // the same whatever was before
  }

  void Follow(std::span<const double> command, double seconds, std::span<double> joints) override {
    Tell(command);
    for (std::int64_t left = std::llround(seconds / kTimestep); left > 0; --left) {
      Mujoco().step1(Raw(), data_);
      std::copy_n(data_->qfrc_bias, Raw()->nv, data_->qfrc_applied);
      Mujoco().step2(Raw(), data_);
    }
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      if (model_->positions[i] >= 0) joints_[i] = data_->qpos[model_->positions[i]];
    }
    std::copy(joints_.begin(), joints_.end(), joints.begin());
  }

  // With these a step is what it would have been: everything else is computed from them in mj_step1.
  void Visit(Archive& archive) override {
    archive("time", data_->time);
    archive("qpos", std::span<double>(data_->qpos, static_cast<std::size_t>(Raw()->nq)));
    archive("qvel", std::span<double>(data_->qvel, static_cast<std::size_t>(Raw()->nv)));
    archive("warmstart", std::span<double>(data_->qacc_warmstart, static_cast<std::size_t>(Raw()->nv)));
    archive("physics_joints", std::span<double>(joints_));
  }

  std::optional<robot::Transform> LinkPose(std::int32_t link) const override {
    const int body = model_->bodies[static_cast<std::size_t>(link)];
    if (body < 0) return std::nullopt;
    const double *p = data_->xpos + 3 * body, *q = data_->xquat + 4 * body;
    return robot::Transform{{q[1], q[2], q[3], q[0]}, {p[0], p[1], p[2]}};
  }

 private:
  const mjModel* Raw() const { return model_->mujoco; }
  void Tell(std::span<const double> command) {
    for (std::size_t i = 0; i < command.size(); ++i) {
      if (model_->motors[i] >= 0) data_->ctrl[model_->motors[i]] = command[i];
    }
  }

  std::shared_ptr<const Model> model_;
  mjData* data_;
  std::vector<double> joints_;  // [positions]
};

// Finds the table's joints and links in the model.
Status Match(Model& model) {
  const mjModel* mujoco = model.mujoco;
  for (const robot::Joint& joint : model.robot.joints) {
    const int number = Mujoco().name2id(mujoco, mjOBJ_JOINT, joint.name.c_str());
    if (number >= 0 && (mujoco->jnt_type[number] == mjJNT_HINGE || mujoco->jnt_type[number] == mjJNT_SLIDE))
      model.joints.push_back({&joint, mujoco->jnt_qposadr[number]});
  }
  for (const std::int32_t number : model.robot.position_joints) {
    const robot::Joint& joint = model.robot.joints[static_cast<std::size_t>(number)];
    const int motor = Mujoco().name2id(mujoco, mjOBJ_ACTUATOR, joint.name.c_str());
    const auto placed = std::find_if(model.joints.begin(), model.joints.end(),
                                     [&](const Placed& each) { return each.joint == &joint; });
    const bool there = placed != model.joints.end();
    if ((!there || motor < 0) && joint.drive.lower < joint.drive.upper)
      return Unfit("it has no joint with a motor of the name " + Quote(joint.name) + ", which twin.json has");
    model.positions.push_back(there && motor >= 0 ? placed->position : -1);
    model.motors.push_back(there ? motor : -1);
  }
  for (const robot::Link& link : model.robot.links)
    model.bodies.push_back(Mujoco().name2id(mujoco, mjOBJ_BODY, link.name.c_str()));
  return Status::Ok();
}

// Makes each motor a servo that suits what it moves.
void SetMotors(mjModel* mujoco) {
  for (int motor = 0; motor < mujoco->nu; ++motor) {
    const int joint = mujoco->actuator_trnid[2 * motor];
    if (mujoco->actuator_trntype[motor] != mjTRN_JOINT || mujoco->actuator_biastype[motor] != mjBIAS_AFFINE) continue;
    const double inertia = mujoco->dof_M0[mujoco->jnt_dofadr[joint]], stiffness = inertia * kServo * kServo;
    mujoco->actuator_gainprm[mjNGAIN * motor] = stiffness;
    mujoco->actuator_biasprm[mjNBIAS * motor + 1] = -stiffness;
    mujoco->actuator_biasprm[mjNBIAS * motor + 2] = -2.0 * inertia * kServo;
  }
  mujoco->opt.timestep = kTimestep;
}

// Ok where its links are where the table has them, joints in the middle of their limits.
Status Compare(MujocoRobot& made, const robot::Robot& robot) {
  robot::PositionLimits limits = LimitsOf(robot);
  std::vector<double> joints;
  for (std::size_t i = 0; i < limits.lower.size(); ++i) {
    const double middle = 0.5 * (limits.lower[i] + limits.upper[i]);
    joints.push_back(std::isfinite(middle) ? middle : std::clamp(0.3, limits.lower[i], limits.upper[i]));
  }
  robot::Kinematics kinematics(robot);
  kinematics.Forward(joints);
  made.Place(joints);
  for (std::size_t link = 1; link < robot.links.size(); ++link) {
    const std::optional<robot::Transform> seen = made.LinkPose(static_cast<std::int32_t>(link));
    if (!seen.has_value()) continue;
    const robot::Transform off = Inverse(kinematics.links()[link]) * *seen;
    if (Norm(off.position) > kPlaceOff || Norm(RotationVector(off.rotation)) > kTurnOff)
      return Unfit("its link " + Quote(robot.links[link].name) + " is not where twin.json has it");
  }
  return Status::Ok();
}

}  // namespace

std::string MujocoVersion() {
  return Mujoco().failure.empty() ? Mujoco().versionString() : "";
}

Result<std::shared_ptr<const ReachDynamics>> LoadMujoco(const std::string& path, const robot::Robot& robot) {
  if (!Mujoco().failure.empty())
    return Status{StatusCode::kFailedPrecondition,
                  "MuJoCo's library cannot be used (" + Quote(Mujoco().failure, 300) +
                      "): install it (tools/setup.sh mujoco), or say where it is, CONSAC_MUJOCO_LIBRARY=libmujoco.so; "
                      "without it twin-reach-v0 is the same task, kinematic"};
  TakeOverMessages();
  const auto in_file = [&](const std::string& why) { return Unfit(Quote(path) + ": " + why); };
  auto model = std::make_shared<Model>(robot);
  char error[1000] = "";
  model->mujoco = Mujoco().loadXML(path.c_str(), nullptr, error, sizeof(error));
  for (char& c : error) c = c == '\n' ? ' ' : c;  // it writes several lines
  std::string_view why = error;
  while (why.ends_with(' ')) why.remove_suffix(1);
  if (model->mujoco == nullptr)
    return in_file("MuJoCo " + MujocoVersion() + " cannot take it: " + Quote(why, 300) +
                   "; import the robot again, with masses (--density) where it has none");
  SetMotors(model->mujoco);
  const Status matched = Match(*model);
  if (!matched.ok()) return in_file(matched.message() + "; import the robot again");
  auto made = std::make_shared<MujocoRobot>(std::move(model));
  const Status same = Compare(*made, robot);
  if (!same.ok()) return in_file(same.message() + "; import the robot again");
  return std::shared_ptr<const ReachDynamics>(std::move(made));
}

}  // namespace consac::worlds

#else

namespace consac::worlds {

std::string MujocoVersion() {
  return "";
}

Result<std::shared_ptr<const ReachDynamics>> LoadMujoco(const std::string& path, const robot::Robot&) {
  return Status{StatusCode::kFailedPrecondition,
                "this build has no MuJoCo to load " + Quote(path) +
                    " with: install it (tools/setup.sh mujoco, or your own: docs/twin.md) and build again; without it "
                    "twin-reach-v0 is the same task, kinematic"};
}

}  // namespace consac::worlds

#endif
