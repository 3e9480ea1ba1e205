// consac twin view: the page's server: which paths there are, and what they answer.
#include "cli/twin_view.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <span>

#include "cli/http_server.h"
#include "cli/print.h"
#include "cli/twin_play.h"
#include "cli/twin_pose.h"
#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/robot/kinematics.h"
#include "consac/twin/import.h"

namespace consac::cli {
namespace {

using PageJson = nlohmann::ordered_json;

constexpr double kPageWait = 0.05;  // s until the stop signal is looked at
constexpr JsonLimits kPoseLimits{kMostBodyBytes, 4096, 4};

std::string BytesAsText(const std::vector<std::byte>& bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// What the page shows, in memory: nothing is read once it is served.
struct ViewedTwin {
  robot::Robot robot;
  std::string table, scene;  // twin.json, twin.glb
};

Result<ViewedTwin> ReadViewed(const std::string& folder) {
  ViewedTwin viewed;
  Result<robot::Robot> robot = twin::LoadRobot(folder);
  if (!robot.ok()) return robot.status();
  viewed.robot = std::move(*robot);
  for (const auto& [file, text] : {std::pair("/twin.json", &viewed.table), std::pair("/twin.glb", &viewed.scene)}) {
    const Result<std::vector<std::byte>> bytes = ReadRegularFile(folder + file);
    if (!bytes.ok()) return bytes.status();
    *text = BytesAsText(*bytes);
  }
  return viewed;
}

// Imports a description into a folder that is gone again once its files are read.
Result<ViewedTwin> ImportViewed(const std::string& description, const twin::CadOptions& cad) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path place = fs::temp_directory_path(error) / ("consac-view-" + std::to_string(std::random_device()()));
  if (!error && !fs::create_directory(place, error) && !error) error = std::make_error_code(std::errc::file_exists);
  if (!error) fs::permissions(place, fs::perms::owner_all, error);  // the temporary folder is everybody's
  if (error)
    return Status{StatusCode::kDataLoss, "cannot make the folder " + Quote(FromPath(place)) +
                                             " to import into: " + error.message() +
                                             "; see that the folder for temporary files may be written to"};
  twin::ImportOptions options;
  options.output = FromPath(place / "twin");
  options.cad = cad;
  options.progress = [](std::size_t, std::size_t) { return !Stopped(); };
  const Result<twin::ImportReport> report = twin::Import(description, options);
  Result<ViewedTwin> viewed = report.ok() ? ReadViewed(options.output) : Result<ViewedTwin>(report.status());
  fs::remove_all(place, error);
  if (report.ok()) {
    for (const std::string& warning : report->warnings) Print("warning: {}\n", warning);
  }
  return viewed;
}

// Answers the page.
class ViewPage {
 public:
  ViewPage(const ViewedTwin& twin, std::optional<TwinPlay> play)
      : twin_(twin), play_(std::move(play)), kinematics_(twin.robot) {}

  HttpResponse Answer(const HttpRequest& request) {
    const bool posts = request.method == "POST";
    if (posts && request.path == "/pose") return Pose(request.body);
    if (posts && request.path == "/play" && play_.has_value()) return Play(request.body);
    if (!posts && request.path == "/play") return play_.has_value() ? Playing() : Of(nullptr);
    HttpResponse file;
    if (request.path == "/twin.json") {
      file.view = twin_.table;
    } else if (request.path == "/twin.glb") {
      file.type = "model/gltf-binary";
      file.view = twin_.scene;
    } else if (const ViewerFile* page = FindViewerFile(request.path)) {
      file.type = page->type;
      file.view = page->text;
    } else {
      return HttpResponse::Error(404, "there is nothing here");
    }
    return posts ? HttpResponse::Error(405, "this is read with GET") : file;
  }
  void Advance() {
    if (play_.has_value()) play_->Advance();
  }

 private:
  static HttpResponse Of(const PageJson& json) {
    HttpResponse response;
    response.text = JsonText(json);
    return response;
  }

  // {"positions": [rad or m, ...]} to where every link is, as `consac twin fk --json` says it.
  HttpResponse Pose(const std::string& body) {
    const Result<nlohmann::json> json = ReadJson<nlohmann::json>(body, kPoseLimits);
    const auto count = static_cast<std::size_t>(twin_.robot.positions());
    const std::string expected = "{\"positions\": [" + std::to_string(count) + " numbers]} is expected";
    if (!json.ok() || !json->is_object() || !json->contains("positions")) return HttpResponse::Error(400, expected);
    const nlohmann::json& given = (*json)["positions"];
    if (!given.is_array() || given.size() != count) return HttpResponse::Error(400, expected);
    std::vector<double> positions;
    for (const nlohmann::json& value : given) {
      if (!value.is_number() || !(std::abs(value.get<double>()) <= 1e6)) return HttpResponse::Error(400, expected);
      positions.push_back(value.get<double>());
    }
    kinematics_.Forward(positions);
    PageJson rows = PageJson::array();
    for (std::size_t i = 0; i < twin_.robot.links.size(); ++i) {
      const robot::Transform& at = kinematics_.links()[i];
      const robot::Vector3 turn = RollPitchYaw(at.rotation);
      rows.push_back(PoseRow(twin_.robot.links[i].name, at));
      rows.back()["rpy"] = {turn.x, turn.y, turn.z};
    }
    return Of(rows);
  }

  // {"do": "start"}
  HttpResponse Play(const std::string& body) {
    const Result<nlohmann::json> json = ReadJson<nlohmann::json>(body, kPoseLimits);
    const bool said = json.ok() && json->is_object() && json->contains("do") && (*json)["do"].is_string();
    if (!said || !play_->Do((*json)["do"].get<std::string>()))
      return HttpResponse::Error(400, "{\"do\": \"start\", \"pause\" or \"reset\"} is expected");
    return Playing();
  }
  HttpResponse Playing() const {
    const PlayState state = play_->State();
    PageJson joints = PageJson::object();
    for (const auto& [name, position] : state.joints) joints[name] = position;
    return Of({{"world", state.world},
               {"running", state.running},
               {"episode", state.episode},
               {"step", state.step},
               {"reward", state.reward},
               {"joints", joints},
               {"targets", state.targets},
               {"tools", state.tools}});
  }

  const ViewedTwin& twin_;
  std::optional<TwinPlay> play_;
  robot::Kinematics kinematics_;
};

void AskForBrowser(const std::string& url) {
#if defined(_WIN32)
  const std::string command = "start " + url;
#elif defined(__APPLE__)
  const std::string command = "open " + url;
#else
  const std::string command = "command -v xdg-open >/dev/null 2>&1 && (xdg-open " + url + " >/dev/null 2>&1 &)";
#endif
  if (std::system(command.c_str()) != 0) PrintError("consac twin: no browser could be asked for; open {}\n", url);
}

Result<ViewedTwin> OpenViewed(const std::string& input, const twin::CadOptions& cad) {
  std::error_code error;
  if (std::filesystem::is_directory(ToPath(input), error)) return ReadViewed(input);
  return ImportViewed(input, cad);
}

Status ServePage(const std::string& input, const ViewFlags& flags) {
  const std::atomic<bool>& stop = StopSignal();
  const Result<ViewedTwin> viewed = OpenViewed(input, flags.cad);
  if (!viewed.ok()) return viewed.status();
  std::optional<TwinPlay> play;
  if (!flags.model.empty()) {
    const Result<std::vector<std::string>> models = run::FindModels(flags.model, flags.runs);
    if (!models.ok()) return models.status();
    Result<TwinPlay> opened = TwinPlay::Open(*models, viewed->robot, flags.seed);
    if (!opened.ok()) return opened.status();
    play = std::move(*opened);
  }
  ViewPage page(*viewed, std::move(play));
  Result<HttpServer> server = HttpServer::Open(static_cast<int>(flags.port), flags.deadline_s);
  if (!server.ok()) return server.status();
  if (!flags.port_file.empty()) {
    const std::string text = std::to_string(server->port()) + "\n";
    CONSAC_RETURN_IF_ERROR(WriteFileAtomically(flags.port_file, std::as_bytes(std::span(text))));
  }
  const std::string url = "http://127.0.0.1:" + std::to_string(server->port()) + "/";
  Print("{} is shown at {} (Ctrl-C stops)\n", viewed->robot.name, url);
  FlushOutput();
  if (flags.open) AskForBrowser(url);
  std::string said;  // once, however often it is tried anew
  while (!stop.load()) {
    page.Advance();
    const Status taken = server->Poll([&](const HttpRequest& request) { return page.Answer(request); }, kPageWait);
    if (taken.ok() || taken.message() == said) continue;
    said = taken.message();
    PrintError("consac twin: {}\n", said);
  }
  return {StatusCode::kCancelled, ""};
}

}  // namespace

int ViewTwin(const std::string& input, const ViewFlags& flags) {
  const Status status = ServePage(input, flags);
  return status.code() == StatusCode::kCancelled ? 130 : Fail("twin", status);
}

}  // namespace consac::cli
