// consac twin view: the page's server: which paths there are, and what they answer.
#include "cli/twin_view.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <span>

#include "cli/http_server.h"
#include "cli/print.h"
#include "cli/twin_hints.h"
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
  std::string candidates;    // candidates.json of a CAD file; "" none
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
  const Result<std::vector<std::byte>> candidates = ReadRegularFile(folder + "/candidates.json");
  if (candidates.ok()) viewed.candidates = BytesAsText(*candidates);
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

// Reads a CAD file again, with other hints.
using ReadAgain = std::function<Result<ViewedTwin>(const std::string& hints)>;

// Answers the page.
class ViewPage {
 public:
  ViewPage(ViewedTwin twin, std::optional<TwinPlay> play, std::optional<TwinHints> hints, ReadAgain read_again)
      : play_(std::move(play)), hints_(std::move(hints)), read_again_(std::move(read_again)) {
    Show(std::move(twin));
  }

  HttpResponse Answer(const HttpRequest& request) {
    const bool posts = request.method == "POST";
    if (posts && request.path == "/pose") return Pose(request.body);
    if (posts && request.path == "/play" && play_.has_value()) return Play(request.body);
    if (!posts && request.path == "/play") return play_.has_value() ? Playing() : Of(nullptr);
    if (posts && request.path == "/hints" && hints_.has_value()) return SaveHints(request.body);
    HttpResponse file;
    if (request.path == "/candidates") {
      file.text = hints_.has_value() ? hints_->Text(twin_.candidates) : "null";
    } else if (request.path == "/twin.json") {
      Give(twin_.table, &file);
    } else if (request.path == "/twin.glb") {
      file.type = "model/gltf-binary";
      Give(twin_.scene, &file);
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

  // A view, unless hints may bring another twin while it is still being sent.
  void Give(const std::string& text, HttpResponse* file) const {
    if (hints_.has_value()) file->text = text;
    if (!hints_.has_value()) file->view = text;
  }

  void Show(ViewedTwin twin) {
    kinematics_.reset();
    twin_ = std::move(twin);
    kinematics_.emplace(twin_.robot);
  }

  // What is saved is what imports: nothing is written before.
  HttpResponse SaveHints(const std::string& body) {
    const Result<std::string> hints = hints_->Asked(body);
    if (!hints.ok())
      return HttpResponse::Error(hints.status().code() == StatusCode::kFailedPrecondition ? 403 : 400,
                                 hints.status().message());
    Result<ViewedTwin> again = read_again_(*hints);
    if (!again.ok()) return HttpResponse::Error(400, again.status().message());
    const Status saved = hints_->Save(*hints);
    if (!saved.ok()) return HttpResponse::Error(500, saved.message());
    Show(std::move(*again));
    return Of({{"saved", true}});
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
    kinematics_->Forward(positions);
    PageJson rows = PageJson::array();
    for (std::size_t i = 0; i < twin_.robot.links.size(); ++i) {
      const robot::Transform& at = kinematics_->links()[i];
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

  ViewedTwin twin_;
  std::optional<robot::Kinematics> kinematics_;  // of twin_'s robot
  std::optional<TwinPlay> play_;
  std::optional<TwinHints> hints_;  // of a CAD file
  ReadAgain read_again_;
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
  // The file of hints may be one that the page is to begin.
  twin::CadOptions known = cad;
  if (!std::filesystem::exists(ToPath(cad.hints), error)) known.hints.clear();
  return ImportViewed(input, known);
}

// The CAD file with hints that are not saved yet.
Result<ViewedTwin> OpenWithHints(const std::string& input, const twin::CadOptions& cad, const std::string& hints) {
  const std::string beside = cad.hints + ".asked-" + std::to_string(std::random_device()());
  CONSAC_RETURN_IF_ERROR(WriteFileAtomically(beside, std::as_bytes(std::span<const char>(hints))));
  twin::CadOptions asked = cad;
  asked.hints = beside;
  Result<ViewedTwin> viewed = ImportViewed(input, asked);
  std::error_code error;
  std::filesystem::remove(ToPath(beside), error);
  if (viewed.ok()) return viewed;
  std::string said = viewed.status().message();
  if (const std::size_t at = said.find(beside); at != std::string::npos) said.replace(at, beside.size(), cad.hints);
  return Status(viewed.status().code(), said);
}

Status ServePage(const std::string& input, const ViewFlags& flags) {
  const std::atomic<bool>& stop = StopSignal();
  Result<ViewedTwin> viewed = OpenViewed(input, flags.cad);
  if (!viewed.ok()) return viewed.status();
  std::optional<TwinPlay> play;
  if (!flags.model.empty()) {
    const Result<std::vector<std::string>> models = run::FindModels(flags.model, flags.runs);
    if (!models.ok()) return models.status();
    Result<TwinPlay> opened = TwinPlay::Open(*models, viewed->robot, flags.seed);
    if (!opened.ok()) return opened.status();
    play = std::move(*opened);
  }
  // A model plays one robot; hints make another, of a CAD file alone.
  std::error_code error;
  const bool imported = std::filesystem::is_directory(ToPath(input), error);
  std::optional<TwinHints> hints;
  if (!viewed->candidates.empty() && !play.has_value()) hints.emplace(imported ? std::string() : flags.cad.hints);
  const std::string name = viewed->robot.name;
  ViewPage page(std::move(*viewed), std::move(play), std::move(hints),
                [&](const std::string& asked) { return OpenWithHints(input, flags.cad, asked); });
  Result<HttpServer> server = HttpServer::Open(static_cast<int>(flags.port), flags.deadline_s);
  if (!server.ok()) return server.status();
  if (!flags.port_file.empty()) {
    const std::string text = std::to_string(server->port()) + "\n";
    CONSAC_RETURN_IF_ERROR(WriteFileAtomically(flags.port_file, std::as_bytes(std::span(text))));
  }
  const std::string url = "http://127.0.0.1:" + std::to_string(server->port()) + "/";
  Print("{} is shown at {} (Ctrl-C stops)\n", name, url);
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
