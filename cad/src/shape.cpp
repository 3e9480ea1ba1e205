#include "shape.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <IMeshTools_Parameters.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <gp_Cylinder.hxx>
#include <map>

namespace consac::cad {
namespace {

using robot::Vector3;

void TakeCylinder(const TopoDS_Face& face, double metres, twin::CadPart* part) {
  const BRepAdaptor_Surface surface(face);
  if (surface.GetType() != GeomAbs_Cylinder) return;
  const gp_Cylinder cylinder = surface.Cylinder();
  double u_low = 0, u_high = 0, v_low = 0, v_high = 0;
  BRepTools::UVBounds(face, u_low, u_high, v_low, v_high);
  const gp_Pnt at = cylinder.Location();
  const gp_Dir along = cylinder.Axis().Direction();
  twin::CadCylinder out;
  out.origin = {at.X() * metres, at.Y() * metres, at.Z() * metres};
  out.direction = {along.X(), along.Y(), along.Z()};
  out.radius = cylinder.Radius() * metres;
  out.from = v_low * metres, out.to = v_high * metres;
  out.sweep = u_high - u_low;
  // The surface's normal leads away from the axis where its frame is right-handed, the face's may be turned round.
  out.concave = (face.Orientation() == TopAbs_REVERSED) == static_cast<bool>(cylinder.Direct());
  part->cylinders.push_back(out);
}

bool TakeFace(const TopoDS_Face& face, double metres, std::vector<float>* corners) {
  TopLoc_Location location;
  const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
  if (mesh.IsNull()) return false;
  const gp_Trsf place = location.Transformation();
  const bool turned = face.Orientation() == TopAbs_REVERSED;
  for (int t = 1; t <= mesh->NbTriangles(); ++t) {
    int at[3];
    mesh->Triangle(t).Get(at[0], at[1], at[2]);
    if (turned) std::swap(at[1], at[2]);
    for (const int node : at) {
      const gp_Pnt point = mesh->Node(node).Transformed(place);
      for (const double each : {point.X(), point.Y(), point.Z()}) corners->push_back(static_cast<float>(each * metres));
    }
  }
  return true;
}

}  // namespace

void TakeShape(const TopoDS_Shape& shape, double metres, const Fineness& fineness, const ColourOfFace& colour_of,
               twin::CadPart* part, twin::Triangles* triangles, std::size_t* left_out) {
  IMeshTools_Parameters parameters;
  parameters.Deflection = fineness.deflection;
  parameters.Angle = fineness.angle;
  parameters.Relative = false;
  parameters.InParallel = false;
  parameters.CleanModel = true;
  const BRepMesh_IncrementalMesh mesher(shape, parameters);
  std::map<std::optional<twin::Colour>, std::vector<float>> corners;  // in an order of its own, the same every time
  for (TopExp_Explorer each(shape, TopAbs_FACE); each.More(); each.Next()) {
    const TopoDS_Face face = TopoDS::Face(each.Current());
    TakeCylinder(face, metres, part);
    if (!TakeFace(face, metres, &corners[colour_of(face)])) ++*left_out;
  }
  for (auto& [colour, list] : corners) {
    if (list.empty()) continue;
    triangles->parts.push_back({triangles->count(), list.size() / 9, colour});
    triangles->corners.insert(triangles->corners.end(), list.begin(), list.end());
  }
  const std::vector<float>& all = triangles->corners;
  const auto extend = [&](std::size_t i, double* low, double* high) {
    const double value = static_cast<double>(all[i]);
    *low = i < 3 ? value : std::min(*low, value);
    *high = i < 3 ? value : std::max(*high, value);
  };
  for (std::size_t i = 0; i + 2 < all.size(); i += 3) {
    extend(i, &part->low.x, &part->high.x);
    extend(i + 1, &part->low.y, &part->high.y);
    extend(i + 2, &part->low.z, &part->high.z);
  }
  BRepTools::Clean(shape);  // one part's triangles are in memory at a time
}

}  // namespace consac::cad
