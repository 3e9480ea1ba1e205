#include "consac/twin/import.h"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "cad_model.h"
#include "consac/base/file.h"
#include "consac/base/hash.h"
#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/robot/self_collision.h"
#include "consac/robot/table.h"
#include "consac/twin/mjcf.h"
#include "files.h"
#include "masses.h"
#include "pieces.h"
#include "read_model.h"
#include "scene.h"
#include "xml.h"

namespace consac::twin {
namespace {

using robot::Transform;
using robot::Vector3;

constexpr std::size_t kMostCadBytes = std::size_t{1} << 30;
constexpr double kLargestLink = 10.0, kSmallestLink = 1e-3;  // m; beyond them the unit is another

// What the package says of its licence; "" nothing.
std::string LicenceOf(const std::filesystem::path& root) {
  const Result<std::string> text = ReadText(FromPath(root / "package.xml"));
  if (!text.ok()) return "";
  const XmlReader xml(*text);
  return xml.status().ok() ? PrintableLine(xml.root().child_value("license")) : "";
}

// One import, step by step.
class Importer {
 public:
  Importer(const std::string& path, const ImportOptions& options)
      : path_(path), options_(options), finder_(path, options.root, options.packages) {}

  Result<ImportReport> Run() {
    for (const auto step : {&Importer::ChooseFolder, &Importer::Read, &Importer::Begin, &Importer::CopyMeshes,
                            &Importer::Measure, &Importer::AddBodies, &Importer::WriteAll}) {
      CONSAC_RETURN_IF_ERROR((this->*step)());
    }
    report_.robot = std::move(scene_.robot);
    return std::move(report_);
  }

 private:
  void Warn(std::string line) { report_.warnings.push_back(std::move(line)); }

  // Before a step's next part: tells how far it is; an error where nobody waits any longer.
  Status Next() {
    const bool wanted = !options_.progress || options_.progress(done_++, parts_);
    return wanted ? Status::Ok() : Status(StatusCode::kCancelled, "interrupted; nothing was written");
  }

  // The model, and its file's bytes.
  Result<Model> ReadFileAndModel(std::vector<std::byte>* bytes) {
    if (!IsCad(path_)) {
      std::string text;
      Result<Model> model = ReadModelAndText(path_, &text);
      const std::span<const std::byte> read = std::as_bytes(std::span<const char>(text));
      bytes->assign(read.begin(), read.end());
      return model;
    }
    Result<std::vector<std::byte>> read = ReadRegularFile(path_, kMostCadBytes);
    if (!read.ok()) return read.status();
    *bytes = std::move(*read);
    Result<CadFile> cad = OpenCad(path_, options_.cad, options_.progress);
    if (!cad.ok()) return cad.status();
    cad_ = std::move(*cad);
    return ModelOf(*cad_);
  }

  Status Read() {
    std::vector<std::byte> bytes;
    Result<Model> model = ReadFileAndModel(&bytes);
    if (!model.ok()) return model.status();
    const std::span<const std::byte> pieces[] = {bytes};
    origin_ = {FromPath(ToPath(path_).filename()), model->format, Sha256Hex(pieces), LicenceOf(finder_.root())};
    if (!options_.srdf.empty()) {
      const Result<std::string> pairs = ReadText(options_.srdf);
      if (!pairs.ok()) return pairs.status();
      const Status read = ReadSrdf(*pairs, &*model);
      if (!read.ok()) return Of(options_.srdf, read);
    }
    Result<robot::Robot> robot = MakeRobot(model->robot);
    if (!robot.ok()) return Of(path_, robot.status());
    scene_.robot = std::move(*robot);
    report_.warnings = model->warnings;
    for (std::string& line : WideLimits(scene_.robot)) Warn(std::move(line));
    Place(model->visuals, &scene_.visuals);
    Place(model->collisions, &scene_.collisions);
    Allow(model->allowed_collisions);
    // Copies, measures and writes meshes twice, and looks at links.
    parts_ = 4 * scene_.visuals.size() + 2 * scene_.collisions.size() + scene_.robot.links.size();
    return {};
  }

  void Allow(const std::vector<std::pair<std::string, std::string>>& pairs) {
    std::map<std::string_view, std::int32_t> numbers;
    for (const robot::Link& link : scene_.robot.links)
      numbers.emplace(link.name, static_cast<std::int32_t>(numbers.size()));
    std::set<std::pair<std::int32_t, std::int32_t>> known;
    std::vector<std::string> unknown;
    for (const auto& [first, second] : pairs) {
      const auto a = numbers.find(first), b = numbers.find(second);
      if (a == numbers.end() || b == numbers.end() || a == b) {
        unknown.push_back(Quote(first) + " and " + Quote(second));
        continue;
      }
      const auto pair = std::minmax({a->second, b->second});
      if (known.insert(pair).second) scene_.robot.allowed_collisions.push_back(pair);
    }
    WarnOf("pairs that may touch, but are not two links of the robot", unknown, "mend their names");
  }

  void Place(const std::vector<Shape>& shapes, std::vector<PlacedShape>* placed) {
    for (const Shape& shape : shapes) {
      const std::int32_t link = scene_.robot.FindLink(shape.link);
      const robot::Quaternion turn =
          link > 0 ? scene_.robot.joints[static_cast<std::size_t>(link) - 1].axis_turn : robot::Quaternion{};
      placed->push_back({shape, link, Transform{Inverse(turn), {}} * shape.origin, "", 0});
      placed->back().origin.rotation = Normalised(placed->back().origin.rotation);
      if (placed->back().shape.has_colour && shape.material.empty())
        placed->back().shape.material = shape.link + "_colour_" + std::to_string(placed->size());
    }
  }

  // Before anything is read: a CAD file takes its time.
  Status ChooseFolder() { return folder_.Choose(options_.output, options_.replace); }

  Status Begin() { return folder_.Open(); }

  // A name of its own below meshes/: the file's, else with the folder's, else with a number.
  std::string OutputName(const std::string& path) {
    const std::filesystem::path file = ToPath(path);
    const std::string stem = AsFolderName(FromPath(file.stem()), 100);
    const std::string folder = AsFolderName(FromPath(file.parent_path().filename()), 20);
    std::string name = stem;
    if (!used_.insert(LowerCase(name)).second) name = folder + "_" + stem;
    for (int n = 2; name != stem && !used_.insert(LowerCase(name)).second; ++n)
      name = folder + "_" + stem + "_" + std::to_string(n);
    return std::string(kMeshFolder) + "/" + FileNameOf(name, ".stl");
  }

  Status CopyMeshes() {
    std::vector<PlacedShape*> shapes;
    for (std::vector<PlacedShape>* list : {&scene_.visuals, &scene_.collisions}) {
      for (PlacedShape& shape : *list) {
        if (shape.shape.kind == ShapeKind::kMesh) shapes.push_back(&shape);
      }
    }
    std::map<std::string, std::size_t> by_path;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      CONSAC_RETURN_IF_ERROR(Next());
      const Result<std::string> path =
          cad_.has_value() ? Result<std::string>(shapes[i]->shape.mesh) : finder_.Find(shapes[i]->shape.mesh);
      if (!path.ok())
        return Of(path_, Status(path.status().code(),
                                "link " + Quote(shapes[i]->shape.link) + ": " + path.status().message()));
      const auto [known, is_new] = by_path.emplace(*path, scene_.files.size());
      if (is_new) CONSAC_RETURN_IF_ERROR(CopyMesh(shapes[i]->shape.mesh, *path));
      shapes[i]->file = scene_.files[known->second].output;
      shapes[i]->mesh = known->second;
    }
    return {};
  }

  Status CopyMesh(const std::string& name, const std::string& path) {
    std::size_t part = 0;  // of a CAD file
    if (cad_.has_value()) part = static_cast<std::size_t>(std::strtoull(name.c_str(), nullptr, 10));
    const Result<Triangles> triangles = cad_.has_value() ? TrianglesOf(cad_->assembly, part) : ReadMesh(path);
    if (!triangles.ok()) return triangles.status();
    const std::string known = cad_.has_value() ? AsFolderName(cad_->assembly.parts[part].name, 100) : "";
    scene_.files.push_back({cad_.has_value() ? cad_->assembly.parts[part].name : name,
                            OutputName(cad_.has_value() ? "part/" + known + ".stl" : path), triangles->count(),
                            triangles->parts});
    report_.meshes += 1;
    report_.triangles += triangles->count();
    report_.most_triangles = std::max(report_.most_triangles, triangles->count());
    report_.files.push_back(scene_.files.back().output);
    return WriteFileAtomically(folder_.file(scene_.files.back().output), WriteStl(*triangles));
  }

  // The triangles of a shape in its own frame, from what was copied.
  Result<Triangles> Load(ShapeKind kind, std::size_t file, Vector3 size) const {
    if (kind != ShapeKind::kMesh) return TrianglesOf(kind, size);
    const Result<std::vector<std::byte>> bytes = ReadFile(folder_.file(scene_.files[file].output));
    if (!bytes.ok()) return bytes.status();
    Result<Triangles> triangles = ReadStl(*bytes);
    if (!triangles.ok()) return triangles;
    if (triangles->count() != scene_.files[file].triangles)
      return Status{StatusCode::kDataLoss,
                    "mesh " + Quote(scene_.files[file].output) + " changed while it was imported"};
    triangles->parts = scene_.files[file].parts;
    Scale(size, &*triangles);
    return triangles;
  }

  Status Measure() {
    for (const PlacedShape& visual : scene_.visuals) {
      CONSAC_RETURN_IF_ERROR(Next());
      Geometry geometry{visual.shape.kind, visual.mesh, visual.shape.size, {}, 0, {}, {}};
      const auto known = std::find_if(scene_.geometries.begin(), scene_.geometries.end(),
                                      [&](const Geometry& each) { return SameGeometry(each, geometry); });
      scene_.visual_geometry.push_back(static_cast<std::size_t>(known - scene_.geometries.begin()));
      if (known != scene_.geometries.end()) continue;
      const Result<Triangles> triangles = Load(geometry.kind, geometry.file, geometry.size);
      if (!triangles.ok()) return triangles.status();
      const Mesh mesh = Weld(*triangles);
      geometry.parts = triangles->parts;
      geometry.vertices = mesh.positions.size() / 3;
      MeasureBox(mesh, visual, &geometry);
      scene_.geometries.push_back(std::move(geometry));
    }
    return {};
  }

  void MeasureBox(const Mesh& mesh, const PlacedShape& visual, Geometry* geometry) {
    for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
      const float y = mesh.positions[i + 1];
      const float point[3] = {mesh.positions[i], mesh.positions[i + 2], y == 0.0f ? 0.0f : -y};
      for (std::size_t k = 0; k < 3; ++k) {
        geometry->low[k] = i == 0 ? point[k] : std::min(geometry->low[k], point[k]);
        geometry->high[k] = i == 0 ? point[k] : std::max(geometry->high[k], point[k]);
      }
    }
    double longest = 0.0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, static_cast<double>(geometry->high[k]) - static_cast<double>(geometry->low[k]));
    if (!cad_.has_value() && (longest > kLargestLink || longest < kSmallestLink)) {  // CAD files say their unit
      Warn("link " + Quote(visual.shape.link) + ": what it looks like is " + NumberText(static_cast<float>(longest)) +
           " m long; if that is a wrong unit, " +
           (visual.shape.kind == ShapeKind::kMesh ? "set its mesh's scale (0.001 for millimetres)"
                                                  : "mend its size, in metres"));
    }
  }

  // A capsule for every link that has a shape, and masses where a density was given. What a link collides by counts,
  // or where it has nothing of the kind, what it looks like.
  Status AddBodies() {
    std::vector<std::vector<const PlacedShape*>> shapes(scene_.robot.links.size());
    for (const PlacedShape& shape : scene_.collisions) shapes[static_cast<std::size_t>(shape.link)].push_back(&shape);
    std::vector<bool> collides;
    for (const auto& each : shapes) collides.push_back(!each.empty());
    for (const PlacedShape& shape : scene_.visuals) {
      const auto link = static_cast<std::size_t>(shape.link);
      if (!collides[link]) shapes[link].push_back(&shape);
    }
    for (std::size_t link = 0; link < shapes.size(); ++link) {
      CONSAC_RETURN_IF_ERROR(Next());
      if (!shapes[link].empty()) CONSAC_RETURN_IF_ERROR(AddBody(link, shapes[link]));
    }
    return {};
  }

  // A corner counts once, however many triangles share it: else a capsule leans to where they are many.
  static void MakeUnique(std::vector<Vector3>* points) {
    const auto before = [](const Vector3& a, const Vector3& b) {
      return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    };
    std::sort(points->begin(), points->end(), before);
    points->erase(std::unique(points->begin(), points->end()), points->end());
  }

  Status AddBody(std::size_t link, const std::vector<const PlacedShape*>& shapes) {
    std::vector<Vector3> points;
    robot::Inertial sum;
    bool solid = true;
    const double mass = MassSaid(scene_.robot.links[link].name);
    std::vector<std::string> open;
    for (const PlacedShape* shape : shapes) {
      const Result<Triangles> triangles = Load(shape->shape.kind, shape->mesh, shape->shape.size);
      if (!triangles.ok()) return triangles.status();
      const std::vector<float>& corners = triangles->corners;
      std::vector<Vector3> own;
      own.reserve(corners.size() / 3);
      for (std::size_t i = 0; i < corners.size(); i += 3)
        own.push_back(shape->origin * Vector3{static_cast<double>(corners[i]), static_cast<double>(corners[i + 1]),
                                              static_cast<double>(corners[i + 2])});
      MakeUnique(&own);
      points.insert(points.end(), own.begin(), own.end());
      const bool weighed = options_.density > 0.0 || mass > 0.0;
      const std::optional<robot::Inertial> body = weighed ? SolidOf(*triangles) : std::nullopt;
      if (weighed && !body.has_value() && cad_.has_value()) open.push_back(Quote(shape->shape.name, 300));
      solid = solid && (body.has_value() || cad_.has_value());  // CAD files are full of surfaces without a volume
      if (body.has_value()) AddSolid(*body, shape->origin, &sum);
    }
    MakeUnique(&points);
    robot::Capsule capsule = robot::CapsuleAround(points);
    capsule.link = static_cast<std::int32_t>(link);
    scene_.robot.capsules.push_back(capsule);
    WarnOf("link " + Quote(scene_.robot.links[link].name) + ": parts that are not closed have no mass", open,
           "make solids of them, or say the link's mass in --hints");
    SetMass(&scene_.robot.links[link], solid, mass > 0.0 && sum.mass > 0.0 ? mass / sum.mass : options_.density, sum);
    return {};
  }

  // The mass that hints say of a link, kg; 0 none.
  double MassSaid(const std::string& link) const {
    if (!cad_.has_value()) return 0.0;
    const std::vector<robot::LinkDescription>& links = cad_->found.robot.links;
    const auto at = std::find_if(links.begin(), links.end(), [&](const auto& each) { return each.name == link; });
    return at == links.end() ? 0.0 : cad_->found.masses[static_cast<std::size_t>(at - links.begin())];
  }

  void SetMass(robot::Link* link, bool solid, double density, const robot::Inertial& sum) {
    if (link->inertial.has_value() || density <= 0.0) return;
    if (!solid || !(sum.mass > 0.0)) {
      Warn("link " + Quote(link->name) +
           (cad_.has_value() ? ": no part of it is closed, so it has no mass; make solids of them"
                             : ": its meshes are not closed, or are inside out, so it has no mass; mend them, or write "
                               "<inertial>"));
      return;
    }
    link->inertial = WithDensity(sum, density);
  }

  Status Put(const std::string& name, const std::string& text) {
    report_.files.push_back(name);
    return WriteFileAtomically(folder_.file(name), std::as_bytes(std::span<const char>(text)));
  }

  // A warning about things, if there are any; the first few are named.
  void WarnOf(const std::string& what, const std::vector<std::string>& quoted, const std::string& advice) {
    if (!quoted.empty()) Warn(what + ": " + FirstFew(quoted) + "; " + advice);
  }

  void WarnOfMasses() {
    std::vector<std::string> without;
    for (std::size_t link = 1; link < scene_.robot.links.size(); ++link) {
      if (!scene_.robot.links[link].inertial.has_value()) without.push_back(Quote(scene_.robot.links[link].name));
    }
    WarnOf("without a mass, since the file says none", without, "--density computes it from closed meshes");
  }

  Status WriteAll() {
    const LoadGeometry load = [this](const Geometry& each) -> Result<Triangles> {
      CONSAC_RETURN_IF_ERROR(Next());
      return Load(each.kind, each.file, each.size);
    };
    WarnOfMasses();
    CONSAC_RETURN_IF_ERROR(WriteGlb(scene_, load, folder_.file("twin.glb")));
    report_.files.push_back("twin.glb");
    CONSAC_RETURN_IF_ERROR(WriteUsd(scene_, load, folder_.file("twin.usda")));
    report_.files.push_back("twin.usda");
    CONSAC_RETURN_IF_ERROR(Put("twin.urdf", WriteUrdf(scene_.robot, scene_.visuals, scene_.collisions)));
    const MjcfText mjcf = WriteMjcf(scene_);
    std::vector<std::string> massless;
    for (const std::string& link : mjcf.massless) massless.push_back(Quote(link));
    WarnOf("MuJoCo refuses twin.xml, for these links move and weigh nothing", massless,
           cad_.has_value() ? "--density gives them masses, or say each link's mass in --hints"
                            : "write their <inertial>, or something they collide by");
    CONSAC_RETURN_IF_ERROR(Put("twin.xml", mjcf.text));
    const std::string table = robot::WriteTable(scene_.robot, origin_);
    const Result<robot::Robot> again = robot::ReadTable(table);  // too many long names or pairs are refused there
    if (!again.ok())
      return Of(path_, {again.status().code(), "nobody would read its joint table (" + again.status().message() +
                                                   "); shorten the names, or leave out links or pairs that may touch"});
    CONSAC_RETURN_IF_ERROR(Put(kTableName, table));
    if (cad_.has_value()) CONSAC_RETURN_IF_ERROR(Put("candidates.json", CandidatesText(cad_->found)));
    CONSAC_RETURN_IF_ERROR(Put(kReportName, Report()));
    return folder_.Commit();
  }

  std::string Report() const {
    nlohmann::ordered_json json;
    json["source"] = {{"file", origin_.file}, {"sha256", origin_.sha256}};
    json["links"] = scene_.robot.links.size();
    json["joints"] = scene_.robot.joints.size();
    json["positions"] = scene_.robot.positions();
    json["triangles"] = report_.triangles;
    json["meshes"] = nlohmann::ordered_json::array();
    for (const MeshFile& file : scene_.files)
      json["meshes"].push_back({{"name", file.name}, {"file", file.output}, {"triangles", file.triangles}});
    json["warnings"] = report_.warnings;
    json["files"] = report_.files;  // what a later import may replace
    return JsonText(json, 1) + "\n";
  }

  std::string path_;
  const ImportOptions& options_;
  MeshFinder finder_;
  OutputFolder folder_;
  std::optional<CadFile> cad_;  // of a CAD file, as long as its meshes are read
  Scene scene_;
  ImportReport report_;
  std::set<std::string> used_;  // names of mesh files in small letters
  robot::TableOrigin origin_;
  std::size_t done_ = 0, parts_ = 0;  // of the import, for whoever waits
};

}  // namespace

Result<ImportReport> Import(const std::string& path, const ImportOptions& options) {
  return Importer(path, options).Run();
}

}  // namespace consac::twin
