#include "document.h"

#include <IGESCAFControl_Reader.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <StepGeom_CartesianTransformationOperator3d.hxx>
#include <StepGeom_Direction.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TCollection_AsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDF_Tool.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Quaternion.hxx>
#include <gp_Trsf.hxx>
#include <map>
#include <type_traits>

#include "consac/base/file.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "kinematics.h"

namespace consac::cad {
namespace {

constexpr int kMostLevels = 100;
constexpr std::size_t kMostFileBytes = std::size_t{1} << 30;

std::string NameOf(const TDF_Label& label) {
  Handle(TDataStd_Name) name;
  if (!label.FindAttribute(TDataStd_Name::GetID(), name)) return "";
  const TCollection_AsciiString text(name->Get(), 0);  // UTF-8
  const std::string out = text.ToCString();
  return out.starts_with("=>[") ? "" : out;  // what OpenCASCADE calls the solids of a product
}

twin::Colour DisplayColour(const Quantity_Color& colour) {
  double rgb[3];
  colour.Values(rgb[0], rgb[1], rgb[2], Quantity_TOC_sRGB);
  const auto rounded = [](double value) { return std::round(value * 1e5) / 1e5; };  // OpenCASCADE counts in floats
  return {rounded(rgb[0]), rounded(rgb[1]), rounded(rgb[2]), 1.0};
}

// The document, node by node.
class Walk {
 public:
  Walk(const Handle(TDocStd_Document) & document, const Fineness& fineness, twin::CadWriter* out,
       const Progress& progress)
      : shapes_(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
        colours_(XCAFDoc_DocumentTool::ColorTool(document->Main())),
        fineness_(fineness),
        out_(*out),
        progress_(progress) {
    if (!XCAFDoc_DocumentTool::GetLengthUnit(document, metres_) || !(metres_ > 0.0)) metres_ = 0.001;
  }

  Status Run() {
    TDF_LabelSequence roots;
    shapes_->GetFreeShapes(roots);
    if (roots.IsEmpty()) return {StatusCode::kDataLoss, "it holds no shape"};
    TDF_LabelSequence all;
    shapes_->GetShapes(all);
    most_parts_ = static_cast<std::size_t>(all.Length());
    for (int i = 1; i <= roots.Length(); ++i) CONSAC_RETURN_IF_ERROR(Add(roots.Value(i), roots.Value(i), -1, "", 0));
    if (shown_ == 0) return {StatusCode::kDataLoss, "it holds no surface"};
    if (left_out_ > 0)
      out_.AddWarning(std::to_string(left_out_) + (left_out_ == 1 ? " face" : " faces") + " of " + HoledParts() +
                      " could not be made triangles and " + (left_out_ == 1 ? "is" : "are") + " missing");
    return {};
  }

  // After Run.
  void AddOwnJoints(STEPCAFControl_Reader& reader) {
    const auto node_of = [&](const TDF_Label& label) {
      const auto known = nodes_of_.find(EntryOf(label));
      return known == nodes_of_.end() ? -1 : known->second;
    };
    const OwnJoints own = ReadOwnJoints(reader, shapes_, metres_, node_of);
    for (std::size_t i = 0; i < std::min(own.joints.size(), twin::kMostCadJoints); ++i) out_.AddJoint(own.joints[i]);
    for (const std::string& warning : own.warnings) out_.AddWarning(warning);
  }

 private:
  // The first few by name.
  std::string HoledParts() const {
    constexpr std::size_t kNamed = 5;
    std::string names = holed_.size() == 1 ? "part" : "parts";
    for (std::size_t i = 0; i < std::min(holed_.size(), kNamed); ++i) names += (i > 0 ? ", " : " ") + Quote(holed_[i]);
    if (holed_.size() > kNamed) names += " and " + std::to_string(holed_.size() - kNamed) + " more";
    return names;
  }

  static std::string EntryOf(const TDF_Label& label) {
    TCollection_AsciiString entry;
    TDF_Tool::Entry(label, entry);
    return entry.ToCString();
  }

  // What stands at `place`, which refers to `product`.
  Status Add(const TDF_Label& place, const TDF_Label& product, std::int32_t parent, const std::string& above,
             int level) {
    twin::CadNode node;
    node.parent = parent;
    node.name = NameOf(place);
    if (node.name.empty()) node.name = NameOf(product);
    if (node.name.empty()) node.name = "part";
    const std::string path = above.empty() ? node.name : above + "/" + node.name;
    if (level > kMostLevels)
      return {StatusCode::kResourceExhausted,
              "assemblies are nested more than " + std::to_string(kMostLevels) + " deep at " + Quote(path, 300)};
    if (++nodes_ > twin::kMostCadNodes)
      return {StatusCode::kResourceExhausted,
              "it holds more than " + std::to_string(twin::kMostCadNodes) + " parts and assemblies; simplify it"};
    CONSAC_RETURN_IF_ERROR(Place(XCAFDoc_ShapeTool::GetLocation(place), path, &node.place));
    node.colour = ColourOf(place);
    const bool assembly = XCAFDoc_ShapeTool::IsAssembly(product);
    if (!assembly) {
      const Result<std::int32_t> part = PartOf(product);
      if (!part.ok()) return part.status();
      node.part = *part;
      ++shown_;
    } else if (!node.colour.has_value()) {
      node.colour = ColourOf(product);
    }
    out_.AddNode(node);
    const auto [known, is_new] = nodes_of_.emplace(EntryOf(place), static_cast<std::int32_t>(nodes_) - 1);
    if (!is_new) known->second = -1;  // it stands in several places
    if (!assembly) return {};
    const auto number = static_cast<std::int32_t>(nodes_) - 1;
    TDF_LabelSequence components;
    XCAFDoc_ShapeTool::GetComponents(product, components);
    for (int i = 1; i <= components.Length(); ++i) {
      TDF_Label referred;
      if (!XCAFDoc_ShapeTool::GetReferredShape(components.Value(i), referred)) continue;
      CONSAC_RETURN_IF_ERROR(Add(components.Value(i), referred, number, path, level + 1));
    }
    return {};
  }

  Status Place(const TopLoc_Location& location, const std::string& path, robot::Transform* place) const {
    const gp_Trsf trsf = location.Transformation();
    if (trsf.IsNegative())
      return {StatusCode::kInvalidArgument,
              Quote(path, 300) + " is placed as a mirror image; mirror its part itself and export again"};
    if (!(std::abs(trsf.ScaleFactor() - 1.0) < 1e-9))
      return {StatusCode::kInvalidArgument, Quote(path, 300) + " is placed with a scale of " +
                                                NumberText(trsf.ScaleFactor()) +
                                                "; scale its part itself and export again"};
    const gp_XYZ& p = trsf.TranslationPart();
    const gp_Quaternion q = trsf.GetRotation();
    place->position = {p.X() * metres_, p.Y() * metres_, p.Z() * metres_};
    place->rotation = robot::Normalised({q.X(), q.Y(), q.Z(), q.W()});
    return {};
  }

  std::optional<twin::Colour> ColourOf(const TDF_Label& label) const {
    Quantity_Color colour;
    for (const XCAFDoc_ColorType type : {XCAFDoc_ColorSurf, XCAFDoc_ColorGen}) {
      if (colours_->GetColor(label, type, colour)) return DisplayColour(colour);
    }
    return std::nullopt;
  }

  std::optional<twin::Colour> ColourOf(const TopoDS_Shape& shape) const {
    Quantity_Color colour;
    for (const XCAFDoc_ColorType type : {XCAFDoc_ColorSurf, XCAFDoc_ColorGen}) {
      if (colours_->GetColor(shape, type, colour)) return DisplayColour(colour);
    }
    return std::nullopt;
  }

  // Its triangles are written where it is met first.
  Result<std::int32_t> PartOf(const TDF_Label& product) {
    const auto [known, is_new] = parts_.emplace(EntryOf(product), static_cast<std::int32_t>(parts_.size()));
    if (!is_new) return known->second;
    progress_(parts_.size() - 1, most_parts_);
    twin::CadPart part;
    part.name = NameOf(product);
    twin::Triangles triangles;
    const TopoDS_Shape located = XCAFDoc_ShapeTool::GetShape(product);
    const TopoDS_Shape shape = located.Located(TopLoc_Location());
    const std::optional<twin::Colour> whole = ColourOf(product);
    const auto colour_of = [&](const TopoDS_Shape& face) {
      const std::optional<twin::Colour> own = ColourOf(face);
      return own.has_value() ? own : whole;
    };
    const std::size_t before = left_out_;
    TakeShape(shape, metres_, fineness_, colour_of, &part, &triangles, &left_out_);
    if (left_out_ > before) holed_.push_back(part.name.empty() ? "part" : part.name);
    if (triangles.count() > twin::kMostTriangles)
      return Status{StatusCode::kResourceExhausted, "part " + Quote(part.name) + " has " +
                                                        std::to_string(triangles.count()) +
                                                        " triangles; take a larger --deflection"};
    out_.AddPart(part, triangles);
    return known->second;
  }

  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colours_;
  Fineness fineness_;
  twin::CadWriter& out_;
  const Progress& progress_;
  double metres_ = 0.001;  // of the document's unit
  std::map<std::string, std::int32_t> parts_;
  std::map<std::string, std::int32_t> nodes_of_;  // by the place's label; -1 several
  std::vector<std::string> holed_;                // parts with a face that is missing
  std::size_t nodes_ = 0, shown_ = 0, left_out_ = 0, most_parts_ = 0;
};

// OpenCASCADE takes what it understands of a cut file: whether it is whole is looked at here.
Status CheckEnds(const std::string& path, bool step) {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path, kMostFileBytes);
  if (!bytes.ok()) return bytes.status();
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const std::string_view tail = text.substr(text.size() - std::min<std::size_t>(text.size(), 1000));
  if (step && text.substr(0, 4096).find("ISO-10303-21") == std::string_view::npos)
    return {StatusCode::kDataLoss, "it is no STEP file: 'ISO-10303-21;' is not at its beginning"};
  if (step && tail.find("END-ISO-10303-21") == std::string_view::npos)
    return {StatusCode::kDataLoss, "it is cut: 'END-ISO-10303-21;' is not at its end"};
  const std::size_t last = tail.find_last_not_of(" \t\r\n");  // of the terminate section, whose letter is in column 73
  const std::size_t begin = last == std::string_view::npos ? last : tail.find_last_of("\r\n", last);
  const std::string_view line = begin == std::string_view::npos ? std::string_view() : tail.substr(begin + 1);
  if (!step && (line.size() < 73 || line[72] != 'T'))
    return {StatusCode::kDataLoss, "it is no IGES file, or is cut: its last line is none of a terminate section"};
  return {};
}

double Determinant(const Handle(StepGeom_Direction) & a, const Handle(StepGeom_Direction) & b,
                   const Handle(StepGeom_Direction) & c) {
  const auto at = [](const Handle(StepGeom_Direction) & each, int i) {
    return i <= each->NbDirectionRatios() ? each->DirectionRatiosValue(i) : 0.0;
  };
  return at(a, 1) * (at(b, 2) * at(c, 3) - at(b, 3) * at(c, 2)) -
         at(a, 2) * (at(b, 1) * at(c, 3) - at(b, 3) * at(c, 1)) +
         at(a, 3) * (at(b, 1) * at(c, 2) - at(b, 2) * at(c, 1));
}

// OpenCASCADE places what a file mirrors or scales as if it did not, without a word.
Status CheckPlacements(const Handle(Interface_InterfaceModel) & model) {
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const auto place = Handle(StepGeom_CartesianTransformationOperator3d)::DownCast(model->Value(i));
    if (place.IsNull()) continue;
    const std::string which =
        "its entity #" + std::to_string(model->Number(place)) + " of " + std::to_string(model->NbEntities());
    const bool axes = place->HasAxis1() && place->HasAxis2() && place->HasAxis3();
    if (axes && Determinant(place->Axis1(), place->Axis2(), place->Axis3()) < 0.0)
      return {StatusCode::kInvalidArgument,
              which + " places a part as a mirror image; mirror the part itself and export again"};
    if (place->HasScale() && !(std::abs(place->Scale() - 1.0) < 1e-9))
      return {StatusCode::kInvalidArgument, which + " places a part with a scale of " + NumberText(place->Scale()) +
                                                "; scale the part itself and export again"};
  }
  return {};
}

template <class Reader>
Status Transfer(Reader* reader, const std::string& path, const Handle(TDocStd_Document) & document) {
  reader->SetColorMode(true);
  reader->SetNameMode(true);
  if (reader->ReadFile(path.c_str()) != IFSelect_RetDone)
    return {StatusCode::kDataLoss,
            "it is damaged, or takes more memory than --cad-mebibytes allows: OpenCASCADE cannot read it"};
  if constexpr (std::is_same_v<Reader, STEPCAFControl_Reader>)
    CONSAC_RETURN_IF_ERROR(CheckPlacements(reader->ChangeReader().WS()->Model()));
  Handle(TDocStd_Document) to = document;
  if (!reader->Transfer(to))
    return {StatusCode::kDataLoss, "it is damaged: OpenCASCADE makes no shape of it; export it again"};
  return {};
}

}  // namespace

Status Convert(const std::string& path, const Fineness& fineness, const twin::CadWriter::Sink& sink,
               const Progress& progress) {
  const std::string ending = FromPath(ToPath(path).extension());
  const bool step = ending.size() > 1 && (ending[1] == 's' || ending[1] == 'S');
  CONSAC_RETURN_IF_ERROR(CheckEnds(path, step));
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
  std::string unit = "millimetre";
  STEPCAFControl_Reader reader;  // its own joints are read in the end
  if (step) {
    CONSAC_RETURN_IF_ERROR(Transfer(&reader, path, document));
    TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles);
    if (!lengths.IsEmpty()) unit = lengths.First().ToCString();
  } else {
    IGESCAFControl_Reader iges;
    CONSAC_RETURN_IF_ERROR(Transfer(&iges, path, document));
  }
  twin::CadWriter out(sink, step ? "step" : "iges", unit);
  if (!step)
    out.AddWarning(
        "IGES holds geometry only: no assembly, no names, no joints; export STEP where the robot is to move");
  Walk walk(document, fineness, &out, progress);
  CONSAC_RETURN_IF_ERROR(walk.Run());
  if (step) walk.AddOwnJoints(reader);
  if (!out.End()) return {StatusCode::kResourceExhausted, "what is read cannot be written; is the disk full?"};
  return {};
}

}  // namespace consac::cad
