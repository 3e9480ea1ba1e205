#include "cad_model.h"

#include <nlohmann/json.hpp>

#include "cad_kinematics.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "files.h"
#include "read_model.h"

namespace consac::twin {

bool IsCad(const std::string& path) {
  const std::string ending = EndingOf(path);
  return ending == ".step" || ending == ".stp" || ending == ".iges" || ending == ".igs";
}

Result<CadFile> OpenCad(const std::string& path, const CadOptions& options, const ImportProgress& progress) {
  JointHints hints;
  if (!options.hints.empty()) {
    const Result<std::string> text = ReadText(options.hints);
    if (!text.ok()) return text.status();
    Result<JointHints> read = ReadHints(*text);
    if (!read.ok()) return Of(options.hints, read.status());
    hints = std::move(*read);
  }
  CadFile file;
  const Result<std::shared_ptr<CadOutput>> output = RunCadProgram(path, options, progress);
  if (!output.ok()) return output.status();
  file.output = *output;
  Result<CadAssembly> assembly = ReadCad(file.output->bytes());
  if (!assembly.ok()) return Of(path, assembly.status());
  file.assembly = std::move(*assembly);
  Result<CadRobot> found = FindJoints(file.assembly, hints);
  if (!found.ok()) return Of(options.hints.empty() ? path : options.hints, found.status());
  file.found = std::move(*found);
  if (options.kinematics.empty()) return file;
  const Result<robot::Robot> known = LoadRobot(options.kinematics);
  if (!known.ok()) return known.status();
  std::vector<std::string> said;
  const Status laid = LayOver(*known, file.found, &hints, &said);
  if (!laid.ok()) return Of(options.kinematics, laid);
  found = FindJoints(file.assembly, hints);
  if (!found.ok()) return Of(options.kinematics, found.status());
  file.found = std::move(*found);
  file.found.asked.insert(file.found.asked.end(), said.begin(), said.end());
  return file;
}

Result<CadRobot> FindCandidates(const std::string& path, const CadOptions& options, const ImportProgress& progress) {
  Result<CadFile> file = OpenCad(path, options, progress);
  if (!file.ok()) return file.status();
  return std::move(file->found);
}

std::string CandidatesText(const CadRobot& robot) {
  nlohmann::ordered_json json = {{"format", "consac-candidates"}, {"version", 1}};
  json["components"] = nlohmann::ordered_json::array();
  for (const CadGroup& each : robot.groups) json["components"].push_back(each.name);
  json["candidates"] = nlohmann::ordered_json::array();
  for (const JointCandidate& each : robot.candidates) {
    const robot::Vector3 &o = each.origin, &d = each.direction;
    json["candidates"].push_back({{"number", json["candidates"].size() + 1},
                                  {"kind", each.turns ? "turns" : "fixed"},
                                  {"first", robot.groups[static_cast<std::size_t>(each.first)].name},
                                  {"second", robot.groups[static_cast<std::size_t>(each.second)].name},
                                  {"origin", {o.x, o.y, o.z}},
                                  {"direction", {d.x, d.y, d.z}},
                                  {"score", each.score},
                                  {"reason", each.reason},
                                  {"verdict", each.verdict}});
  }
  json["asked"] = robot.asked;
  json["warnings"] = robot.warnings;
  return JsonText(json, 1) + "\n";
}

Model ModelOf(const CadFile& file) {
  Model model;
  model.format = file.assembly.format;
  model.robot = file.found.robot;
  model.warnings = file.assembly.warnings;
  for (const auto* lines : {&file.found.warnings, &file.found.asked})
    model.warnings.insert(model.warnings.end(), lines->begin(), lines->end());
  const std::vector<CadNode>& nodes = file.assembly.nodes;
  std::vector<bool> shows;  // [parts]
  for (std::size_t part = 0; part < file.assembly.parts.size(); ++part) {
    const Result<Triangles> triangles = TrianglesOf(file.assembly, part);
    shows.push_back(!triangles.ok() || triangles->count() > 0);  // a damaged one is told where it is read
    if (!shows.back())
      model.warnings.push_back("part " + Quote(file.assembly.parts[part].name) + " has no surface and is left out");
  }
  std::vector<std::optional<Colour>> colours(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const auto parent = static_cast<std::size_t>(nodes[n].parent);
    colours[n] = nodes[n].colour.has_value() || nodes[n].parent < 0 ? nodes[n].colour : colours[parent];
    const std::int32_t link = file.found.link_of_node[n];
    if (nodes[n].part < 0 || link < 0 || !shows[static_cast<std::size_t>(nodes[n].part)]) continue;
    Shape shape;
    shape.link = model.robot.links[static_cast<std::size_t>(link)].name;
    shape.name = file.found.path_of_node[n];
    shape.origin = Inverse(file.found.link_place[static_cast<std::size_t>(link)]) * file.found.place_of_node[n];
    shape.kind = ShapeKind::kMesh;
    shape.mesh = std::to_string(nodes[n].part);
    shape.has_colour = colours[n].has_value();
    shape.colour = colours[n].value_or(kDefaultColour);
    model.visuals.push_back(std::move(shape));
  }
  return model;
}

}  // namespace consac::twin
