// consac twin: a robot's description made a digital twin, and questions about it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/flags.h"
#include "cli/print.h"
#include "cli/twin_pose.h"
#include "cli/twin_view.h"
#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/robot/conventions.h"
#include "consac/robot/kinematics.h"
#include "consac/robot/self_collision.h"
#include "consac/twin/import.h"
#include "worlds/twin_reach/twin_reach.h"

namespace consac::cli {
namespace {

constexpr double kDegrees = 180.0 / robot::kPiRadians;  // in a radian

struct TwinFlags {
  std::string input, output = "twin", candidates = "candidates.json", root, srdf, link, convention = "robot", positions;
  std::string reach;  // file of twin-reach-v0 to write
  std::vector<std::string> packages;
  double density = 0.0, deflection_mm = 0.2;
  twin::CadOptions cad;
  bool force = false, json = false, degrees = false;
  ViewFlags view;
};

// Says how far a long reading is, once a second, and hears a signal.
twin::ImportProgress TellProgress(const TwinFlags& flags) {
  (void)StopSignal();
  return [told = std::chrono::steady_clock::now(), quiet = flags.json](std::size_t done, std::size_t of) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (!quiet && of > 0 && now - told > std::chrono::seconds(1)) {
      told = now;
      PrintError("consac twin: part {} of at most {}\n", done + 1, of);
    }
    return !Stopped();
  };
}

twin::CadOptions CadOptionsOf(const TwinFlags& flags) {
  twin::CadOptions options = flags.cad;
  options.deflection = flags.deflection_mm / 1000.0;
  return options;
}

int ImportTwin(const TwinFlags& flags) {
  twin::ImportOptions options;
  options.output = flags.output;
  options.replace = flags.force;
  options.root = flags.root;
  options.srdf = flags.srdf;
  options.density = flags.density;
  for (const std::string& package : flags.packages) {
    const std::size_t equals = package.find('=');
    if (equals == std::string::npos || equals == 0)
      return Fail("twin", {StatusCode::kInvalidArgument, "--package " + Quote(package) + ": NAME=FOLDER is expected"});
    options.packages[package.substr(0, equals)] = package.substr(equals + 1);
  }
  options.cad = CadOptionsOf(flags);
  options.progress = TellProgress(flags);
  const auto begin = std::chrono::steady_clock::now();
  const Result<twin::ImportReport> report = twin::Import(flags.input, options);
  if (!report.ok()) return Fail("twin", report.status());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (flags.json) {
    PrintLines(AsciiJsonText(nlohmann::json({{"output", flags.output},
                                             {"links", report->robot.links.size()},
                                             {"joints", report->robot.joints.size()},
                                             {"positions", report->robot.positions()},
                                             {"meshes", report->meshes},
                                             {"triangles", report->triangles},
                                             {"files", report->files},
                                             {"warnings", report->warnings}}),
                             2));
    return 0;
  }
  Print("{}: {} links, {} joints, {} of them move by themselves\n", report->robot.name, report->robot.links.size(),
        report->robot.joints.size(), report->robot.positions());
  if (report->meshes > 0)
    Print("{} meshes, {} triangles, in {:.2f} s; about {:.0f} MiB for the largest, one at a time\n", report->meshes,
          report->triangles, took.count(),
          static_cast<double>(report->most_triangles * twin::kBytesPerTriangle) / 1048576.0);
  for (const std::string& warning : report->warnings) Print("warning: {}\n", warning);
  std::vector<std::string_view> files;
  for (const std::string& file : report->files) {
    if (file.find('/') == std::string::npos) files.emplace_back(file);
  }
  Print("written to {}: {}{}\n", flags.output, Join(files), report->meshes > 0 ? " and the meshes" : "");
  return 0;
}

int ShowCandidates(const TwinFlags& flags) {
  const Result<twin::CadRobot> found = twin::FindCandidates(flags.input, CadOptionsOf(flags), TellProgress(flags));
  if (!found.ok()) return Fail("twin", found.status());
  const std::string text = CandidatesText(*found);
  const Status written = WriteFileAtomically(flags.candidates, std::as_bytes(std::span<const char>(text)));
  if (!written.ok()) return Fail("twin", written);
  if (flags.json) {
    PrintLines(text);
    return 0;
  }
  constexpr double kMillimetres = 1000.0;
  Print("{} components, {} pairs of them share axes\n", found->groups.size(), found->candidates.size());
  Print("{:>4} {:<5} {:>5}  {:<32} {:<28} {}\n", "", "", "score", "axis through, mm", "along", "what became of it");
  for (std::size_t i = 0; i < found->candidates.size(); ++i) {
    const twin::JointCandidate& each = found->candidates[i];
    const robot::Vector3 o = kMillimetres * each.origin, d = each.direction;
    Print("{:>4} {:<5} {:>5.2f}  {:<32} {:<28} {}\n", i + 1, each.turns ? "turns" : "fixed", each.score,
          fmt::format("{:.3f}, {:.3f}, {:.3f}", o.x, o.y, o.z), fmt::format("{:.4f}, {:.4f}, {:.4f}", d.x, d.y, d.z),
          each.verdict);
    Print("                 {} - {}: {}\n", found->groups[static_cast<std::size_t>(each.first)].name,
          found->groups[static_cast<std::size_t>(each.second)].name, each.reason);
  }
  for (const std::string& line : found->warnings) Print("warning: {}\n", line);
  for (const std::string& line : found->asked) Print("asked: {}\n", line);
  Print("written to {}\n", flags.candidates);
  return 0;
}

Result<std::vector<double>> ReadPositions(const TwinFlags& flags, const robot::Robot& robot) {
  std::vector<double> positions(robot.position_joints.size(), 0.0);
  if (flags.positions.empty()) return positions;
  std::vector<std::string> pieces;
  std::istringstream text(flags.positions);
  for (std::string piece; std::getline(text, piece, ',');) pieces.push_back(piece);
  const auto in_unit = [&](std::size_t i, double value) {
    const bool slides =
        robot.joints[static_cast<std::size_t>(robot.position_joints[i])].type == robot::JointType::kPrismatic;
    return flags.degrees && !slides ? value / kDegrees : value;
  };
  const bool named = flags.positions.find('=') != std::string::npos;
  if (!named && pieces.size() != positions.size())
    return Status{StatusCode::kInvalidArgument, "--q has " + std::to_string(pieces.size()) +
                                                    " numbers; the robot has " + std::to_string(positions.size()) +
                                                    " joints that move by themselves (consac twin check lists them)"};
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const std::size_t equals = pieces[i].find('=');
    std::size_t at = i;
    if (named) {
      const std::string name = pieces[i].substr(0, std::min(equals, pieces[i].size()));
      const std::int32_t joint = robot.FindJoint(name);
      const bool moves = joint >= 0 && robot.joints[static_cast<std::size_t>(joint)].mimics < 0 &&
                         robot.joints[static_cast<std::size_t>(joint)].position_index >= 0;
      if (!moves || equals == std::string::npos)
        return Status{StatusCode::kInvalidArgument, "--q names " + Quote(pieces[i]) +
                                                        "; JOINT=NUMBER of a joint that moves by "
                                                        "itself is expected (consac twin check lists them)"};
      at = static_cast<std::size_t>(robot.joints[static_cast<std::size_t>(joint)].position_index);
    }
    double value = 0.0;
    const std::string number = named ? pieces[i].substr(equals + 1) : pieces[i];
    if (!ParseHumanNumber(number, &value))
      return Status{StatusCode::kInvalidArgument, "--q holds " + Quote(number) + ", which is no number"};
    positions[at] = in_unit(at, value);
  }
  return positions;
}

// Where the links are is computed of any position; on stderr it is said which ones the robot cannot take.
void WarnOfLimits(const robot::Robot& robot, const std::vector<double>& positions, bool degrees) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const robot::Joint& joint = robot.joints[static_cast<std::size_t>(robot.position_joints[i])];
    if (positions[i] >= joint.drive.lower && positions[i] <= joint.drive.upper) continue;
    const bool slides = joint.type == robot::JointType::kPrismatic;
    const double unit = degrees && !slides ? kDegrees : 1.0;
    PrintError("consac twin: warning: {} = {:.6g} is beyond its limits {:.6g} to {:.6g} {}\n", joint.name,
               positions[i] * unit, joint.drive.lower * unit, joint.drive.upper * unit,
               slides    ? "m"
               : degrees ? "degrees"
                         : "rad");
  }
}

int ShowPose(const TwinFlags& flags) {
  const Result<robot::Robot> robot = twin::LoadRobot(flags.input);
  if (!robot.ok()) return Fail("twin", robot.status());
  const Result<std::vector<double>> positions = ReadPositions(flags, *robot);
  if (!positions.ok()) return Fail("twin", positions.status());
  if (!flags.positions.empty()) WarnOfLimits(*robot, *positions, flags.degrees);
  const robot::Convention convention = flags.convention == "gltf"     ? robot::Convention::kGltf
                                       : flags.convention == "unreal" ? robot::Convention::kUnreal
                                                                      : robot::Convention::kRobot;
  const std::int32_t only = robot->FindLink(flags.link);
  if (!flags.link.empty() && only < 0) {
    std::vector<std::string_view> known;
    for (const robot::Link& link : robot->links) known.emplace_back(link.name);
    return Fail("twin", {StatusCode::kNotFound, "no link " + Quote(flags.link) + Suggestion(flags.link, known)});
  }
  robot::Kinematics kinematics(*robot);
  kinematics.Forward(*positions);
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  if (!flags.json)
    Print("{:<28} {:>12} {:>12} {:>12}   {:>9} {:>9} {:>9} {:>9}\n", "link", "x", "y", "z", "qx", "qy", "qz", "qw");
  for (std::size_t i = 0; i < robot->links.size(); ++i) {
    if (only >= 0 && static_cast<std::int32_t>(i) != only) continue;
    const robot::Transform at = TransformIn(convention, kinematics.links()[i]);
    const auto& [q, p] = at;
    const std::string& name = robot->links[i].name;
    rows.push_back(PoseRow(name, at));
    if (!flags.json)
      Print("{:<28} {:>12.6f} {:>12.6f} {:>12.6f}   {:>9.6f} {:>9.6f} {:>9.6f} {:>9.6f}\n", name, p.x, p.y, p.z, q.x,
            q.y, q.z, q.w);
  }
  if (flags.json) PrintLines(AsciiJsonText(rows, 2));
  return 0;
}

int CheckTwin(const TwinFlags& flags) {
  const Result<robot::Robot> robot = twin::LoadRobot(flags.input);
  if (!robot.ok()) return Fail("twin", robot.status());
  Print("{}: {} links, {} joints, {} of them move by themselves\n", robot->name, robot->links.size(),
        robot->joints.size(), robot->positions());
  for (std::size_t i = 0; i < robot->position_joints.size(); ++i) {
    const robot::Joint& joint = robot->joints[static_cast<std::size_t>(robot->position_joints[i])];
    const bool turns = joint.type != robot::JointType::kPrismatic;
    const double unit = turns ? kDegrees : 1.0;
    Print("{:>3} {:<28} {:<10} {:>10.4g} to {:<10.4g} {}\n", i, joint.name, NameOf(joint.type),
          joint.drive.lower * unit, joint.drive.upper * unit, turns ? "degrees" : "m");
  }
  for (const std::string& line : twin::WideLimits(*robot)) Print("warning: {}\n", line);
  robot::Kinematics kinematics(*robot);
  const robot::SelfCollision collision(*robot);
  const robot::SelfCollision::Nearest nearest = collision.Find(kinematics.links());
  if (nearest.first < 0) return 0;
  const auto link = [&](std::int32_t capsule) {
    const auto of = static_cast<std::size_t>(robot->capsules[static_cast<std::size_t>(capsule)].link);
    return robot->links[of].name;
  };
  Print("at 0 the nearest capsules are {} and {}, {:.1f} mm {}\n", link(nearest.first), link(nearest.second),
        std::abs(nearest.distance) * 1000.0, nearest.distance < 0.0 ? "into each other" : "apart");
  if (nearest.distance < 0.0)
    Print(
        "that need not be a fault: 0 may be a pose that the robot never takes (its maker says which are clear), and a\n"
        "capsule is wider than its link; pairs that may always touch belong into an SRDF (import's --srdf)\n");
  return 0;
}

int ShowReach(const TwinFlags& flags) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::is_regular_file(ToPath(flags.input), error))
    return Fail("twin", {StatusCode::kInvalidArgument, Quote(flags.input) + " is a file; name the twin's folder"});
  const Result<std::shared_ptr<const worlds::ReachTask>> task = worlds::ReadTwinReach(flags.input);
  if (!task.ok()) return Fail("twin", task.status());
  // A file says where its twin is from where it lies itself.
  const fs::path folder = fs::absolute(ToPath(flags.reach), error).parent_path();
  const fs::path twin = flags.reach.empty() ? ToPath(flags.input) : fs::relative(ToPath(flags.input), folder, error);
  const std::string text = worlds::TwinReachText(**task, FromPath(error ? ToPath(flags.input) : twin));
  if (flags.reach.empty()) {
    PrintLines(text);
    return 0;
  }
  const Status written = WriteFileAtomically(flags.reach, std::as_bytes(std::span(text)));
  if (!written.ok()) return Fail("twin", written);
  Print("{} says what twin-reach-v0:{} is; change it as you like\n", flags.reach, flags.reach);
  return 0;
}

void AddCadFlags(CLI::App* app, TwinFlags* flags) {
  app->add_option("--hints", flags->cad.hints, "JSON file on links and joints of a CAD file (docs/twin.md)");
  app->add_option("--kinematics", flags->cad.kinematics,
                  "URDF or MJCF whose joints' names, limits and senses overrule what a CAD file's axes say");
  AddNumber(*app, "--deflection", &flags->deflection_mm, 0.001, 100.0,
            "mm by which triangles of a CAD file may leave its surfaces")
      ->capture_default_str();
  AddNumber(*app, "--angle", &flags->cad.angle, 0.05, 1.5, "rad between such triangles: what counts on small parts")
      ->capture_default_str();
  AddNumber(*app, "--cad-seconds", &flags->cad.seconds, 1.0, 1e6, "most time for reading a CAD file")
      ->capture_default_str();
  AddNumber(*app, "--cad-mebibytes", &flags->cad.mebibytes, 64.0, 1e7, "most memory for it")->capture_default_str();
}

}  // namespace

Action AddTwin(CLI::App& app) {
  auto flags = std::make_shared<TwinFlags>();
  // Without it each would show the examples of all.
  const auto examples = [](CLI::App* sub, const char* lines) {
    sub->footer(std::string("Examples:\n") + lines + "\n\nExit codes: " + kExitCodes);
  };
  app.require_subcommand(1);
  CLI::App* import =
      app.add_subcommand("import", "make twin.glb, twin.json, twin.urdf, twin.xml (MJCF) and a report of a robot");
  examples(
      import,
      "consac twin import robot.urdf -o twin\nconsac twin import arm.step --hints hints.json --density 1200 -o arm");
  import->add_option("file", flags->input, "the description: a URDF, an MJCF or a STEP file")->required();
  import->add_option("-o,--output", flags->output, "folder to make")->capture_default_str();
  import->add_option("--package", flags->packages, "NAME=FOLDER of package://NAME/..., once or more");
  import->add_option("--root", flags->root, "folder that meshes may be read from (default: the package's)");
  import->add_option("--srdf", flags->srdf, "file that names links which may touch");
  AddNumber(*import, "--density", &flags->density, 0.0, 1e6, "kg/m^3 of links whose mass the file does not say");
  import->add_flag("--force", flags->force, "replace an earlier import");
  import->add_flag("--json", flags->json, "print what was made as JSON");
  AddCadFlags(import, flags.get());
  CLI::App* candidates = app.add_subcommand("candidates", "where a STEP file's joints may be, with scores and reasons");
  examples(candidates,
           "consac twin candidates arm.step\nconsac twin candidates arm.step --hints hints.json -o found.json");
  candidates->add_option("file", flags->input, "the assembly: STEP or IGES")->required();
  candidates->add_option("-o,--output", flags->candidates, "file to write")->capture_default_str();
  candidates->add_flag("--json", flags->json, "print JSON");
  AddCadFlags(candidates, flags.get());
  CLI::App* fk = app.add_subcommand("fk", "where the links are for given joint positions");
  examples(fk,
           "consac twin fk twin --q 0.1,-0.4,0 --link tool\nconsac twin fk twin --degrees --q elbow=30 --convention "
           "unreal --json");
  fk->add_option("twin", flags->input, "folder of an import, its twin.json, or a URDF")->required();
  fk->add_option("--q", flags->positions,
                 "0.1,0.2,... for every joint, or JOINT=NUMBER,...; rad and m; without it all are 0");
  fk->add_flag("--degrees", flags->degrees, "joints that turn are given in degrees");
  fk->add_option("--link", flags->link, "this link alone");
  fk->add_option("--convention", flags->convention, "robot, gltf or unreal")
      ->check(CLI::IsMember({"robot", "gltf", "unreal"}))
      ->capture_default_str();
  fk->add_flag("--json", flags->json, "print JSON");
  CLI::App* check = app.add_subcommand("check", "read a twin and say what it is");
  examples(check, "consac twin check twin\nconsac twin check robot.urdf");
  check->add_option("twin", flags->input, "folder of an import, its twin.json, or a URDF")->required();
  CLI::App* reach = app.add_subcommand(
      "reach", "what twin-reach-v0 makes of a twin: tool, ready pose, goals; a file to change them in");
  examples(reach, "consac twin reach twin\nconsac twin reach twin -o task.json");
  reach->add_option("twin", flags->input, "folder of an import")->required();
  reach->add_option("-o,--output", flags->reach, "file to write; without it they are printed");
  CLI::App* view = app.add_subcommand("view", "show a twin in the browser: move its joints, let a model play");
  examples(view,
           "consac twin view twin --open\nconsac twin view twin --model reach --open\nconsac twin view arm.step "
           "--hints hints.json --open");
  view->add_option("twin", flags->input, "folder of an import, or a description")->required();
  view->add_option("--model", flags->view.model,
                   "model of yumi-reach-v0, of a variant or of twin-reach-v0, or the name of its run");
  view->add_option("--dir", flags->view.runs, "folder of the runs")->capture_default_str();
  AddWhole(*view, "--port", &flags->view.port, 0, 65535, "port on this machine; 0 takes a free one")
      ->capture_default_str();
  view->add_option("--port-file", flags->view.port_file, "write the port that is open to this file");
  AddNumber(*view, "--deadline", &flags->view.deadline_s, 0.01, 3600, "seconds that a browser's connection may take")
      ->capture_default_str();
  AddWhole(*view, "--seed", &flags->view.seed, 0, kMostWhole, "seed of the model's world");
  view->add_flag("--open", flags->view.open, "ask the system for a browser");
  AddCadFlags(view, flags.get());
  return [flags, import, candidates, fk, reach, view] {
    flags->view.cad = CadOptionsOf(*flags);
    if (view->parsed()) return ViewTwin(flags->input, flags->view);
    EndAtSignals();
    return import->parsed()       ? ImportTwin(*flags)
           : candidates->parsed() ? ShowCandidates(*flags)
           : fk->parsed()         ? ShowPose(*flags)
           : reach->parsed()      ? ShowReach(*flags)
                                  : CheckTwin(*flags);
  };
}

}  // namespace consac::cli
