// Source: ISO 10303-105 as AP242 uses it. A pair is a joint between two links, with a frame in each; a link stands for
// an occurrence by its representation. A revolute pair turns about Z, a prismatic one slides along X, unless the six
// flags of the pair name another axis.
#include "kinematics.h"

#include <Interface_InterfaceModel.hxx>
#include <STEPConstruct_Tool.hxx>
#include <STEPConstruct_UnitContext.hxx>
#include <StepGeom_Axis2Placement3d.hxx>
#include <StepGeom_CartesianPoint.hxx>
#include <StepGeom_Direction.hxx>
#include <StepGeom_GeomRepContextAndGlobUnitAssCtxAndGlobUncertaintyAssCtx.hxx>
#include <StepGeom_GeometricRepresentationContextAndGlobalUnitAssignedContext.hxx>
#include <StepKinematics_ActuatedKinPairAndOrderKinPair.hxx>
#include <StepKinematics_ContextDependentKinematicLinkRepresentation.hxx>
#include <StepKinematics_FullyConstrainedPair.hxx>
#include <StepKinematics_KinematicJoint.hxx>
#include <StepKinematics_KinematicLink.hxx>
#include <StepKinematics_KinematicLinkRepresentation.hxx>
#include <StepKinematics_KinematicLinkRepresentationAssociation.hxx>
#include <StepKinematics_LowOrderKinematicPairValue.hxx>
#include <StepKinematics_PrismaticPair.hxx>
#include <StepKinematics_PrismaticPairValue.hxx>
#include <StepKinematics_PrismaticPairWithRange.hxx>
#include <StepKinematics_ProductDefinitionRelationshipKinematics.hxx>
#include <StepKinematics_RevolutePair.hxx>
#include <StepKinematics_RevolutePairValue.hxx>
#include <StepKinematics_RevolutePairWithRange.hxx>
#include <StepRepr_GlobalUnitAssignedContext.hxx>
#include <StepRepr_ItemDefinedTransformation.hxx>
#include <StepRepr_NextAssemblyUsageOccurrence.hxx>
#include <TCollection_HAsciiString.hxx>
#include <XSControl_WorkSession.hxx>
#include <array>
#include <cmath>
#include <map>

#include "consac/base/text.h"

namespace consac::cad {
namespace {

using robot::Vector3;

std::string TextOf(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? std::string() : std::string(text->ToCString());
}

// What a link is in the document.
struct Link {
  std::int32_t node = -1;
  double metres = 0.001, radians = 1.0;  // of the units in which its frames are written
};

class Reading {
 public:
  Reading(STEPCAFControl_Reader& reader, const Handle(XCAFDoc_ShapeTool) & shapes, double metres, const NodeOf& node_of)
      : reader_(reader), shapes_(shapes), metres_(metres), node_of_(node_of) {}

  OwnJoints Run() {
    const Handle(Interface_InterfaceModel) model = reader_.ChangeReader().WS()->Model();
    for (int i = 1; i <= model->NbEntities(); ++i) {
      AddLink(Handle(StepKinematics_ContextDependentKinematicLinkRepresentation)::DownCast(model->Value(i)));
      AddValue(Handle(StepKinematics_PairValue)::DownCast(model->Value(i)));
    }
    for (int i = 1; i <= model->NbEntities(); ++i) {
      Handle(StepKinematics_KinematicPair) pair = Handle(StepKinematics_KinematicPair)::DownCast(model->Value(i));
      const auto driven = Handle(StepKinematics_ActuatedKinPairAndOrderKinPair)::DownCast(pair);
      if (!driven.IsNull()) pair = driven->GetOrderKinematicPair();
      if (!pair.IsNull()) AddPair(pair);
    }
    return std::move(out_);
  }

 private:
  void AddLink(const Handle(StepKinematics_ContextDependentKinematicLinkRepresentation) & use) {
    if (use.IsNull() || use->RepresentationRelation().IsNull() || use->RepresentedProductRelation().IsNull()) return;
    Handle(StepKinematics_KinematicLinkRepresentation) shown;
    for (const Handle(StepRepr_Representation) & each :
         {use->RepresentationRelation()->Rep1(), use->RepresentationRelation()->Rep2()}) {
      if (shown.IsNull()) shown = Handle(StepKinematics_KinematicLinkRepresentation)::DownCast(each);
    }
    const auto occurrence = Handle(StepRepr_NextAssemblyUsageOccurrence)::DownCast(
        use->RepresentedProductRelation()->Definition().ProductDefinitionRelationship());
    if (shown.IsNull() || shown->RepresentedLink().IsNull() || occurrence.IsNull()) return;
    const STEPConstruct_Tool tool(reader_.ChangeReader().WS());
    const TDF_Label label = STEPCAFControl_Reader::FindInstance(occurrence, shapes_, tool, reader_.GetShapeLabelMap());
    Link link;
    if (!label.IsNull()) link.node = node_of_(label);
    TakeUnits(shown->ContextOfItems(), &link);
    links_[shown->RepresentedLink().get()] = link;
  }

  void TakeUnits(const Handle(StepRepr_RepresentationContext) & context, Link* link) const {
    Handle(StepRepr_GlobalUnitAssignedContext) units;
    const auto plain = Handle(StepGeom_GeometricRepresentationContextAndGlobalUnitAssignedContext)::DownCast(context);
    const auto certain = Handle(StepGeom_GeomRepContextAndGlobUnitAssCtxAndGlobUncertaintyAssCtx)::DownCast(context);
    if (!plain.IsNull()) units = plain->GlobalUnitAssignedContext();
    if (!certain.IsNull()) units = certain->GlobalUnitAssignedContext();
    STEPConstruct_UnitContext factors;
    if (units.IsNull() || factors.ComputeFactors(units) != 0) {
      link->metres = metres_;
      return;
    }
    link->metres = factors.LengthFactor() * metres_;
    link->radians = factors.PlaneAngleFactor();
  }

  void AddValue(const Handle(StepKinematics_PairValue) & value) {
    if (value.IsNull() || value->AppliesToPair().IsNull()) return;
    const auto turned = Handle(StepKinematics_RevolutePairValue)::DownCast(value);
    const auto slid = Handle(StepKinematics_PrismaticPairValue)::DownCast(value);
    const auto any = Handle(StepKinematics_LowOrderKinematicPairValue)::DownCast(value);
    std::array<double, 6>& at = values_[value->AppliesToPair().get()];
    at = {};
    if (!turned.IsNull()) at.fill(turned->ActualRotation());
    if (!slid.IsNull()) at.fill(slid->ActualTranslation());
    if (!any.IsNull())
      at = {any->ActualTranslationX(), any->ActualTranslationY(), any->ActualTranslationZ(),
            any->ActualRotationX(),    any->ActualRotationY(),    any->ActualRotationZ()};
  }

  const Link* LinkOf(const Handle(StepShape_Vertex) & end) const {
    const auto known = links_.find(end.get());
    return known == links_.end() || known->second.node < 0 ? nullptr : &known->second;
  }

  void AddPair(const Handle(StepKinematics_KinematicPair) & pair) {
    twin::CadJoint joint;
    joint.name = pair->Joint().IsNull() ? std::string() : TextOf(pair->Joint()->Name());
    if (joint.name.empty()) joint.name = TextOf(pair->Name());
    const auto leave_out = [&](const std::string& why) {
      out_.warnings.push_back("its own joint " + Quote(joint.name) + " " + why + " and is left out");
    };
    const Link* first = pair->Joint().IsNull() ? nullptr : LinkOf(pair->Joint()->EdgeStart());
    const Link* second = pair->Joint().IsNull() ? nullptr : LinkOf(pair->Joint()->EdgeEnd());
    if (first == nullptr || second == nullptr) return leave_out("is between links of which one is no single component");
    joint.first = first->node, joint.second = second->node;
    const auto turns = Handle(StepKinematics_RevolutePair)::DownCast(pair);
    const auto slides = Handle(StepKinematics_PrismaticPair)::DownCast(pair);
    if (!Handle(StepKinematics_FullyConstrainedPair)::DownCast(pair).IsNull()) {
      out_.joints.push_back(joint);
      return;
    }
    if (turns.IsNull() && slides.IsNull()) return leave_out("neither turns nor slides");
    joint.type = turns.IsNull() ? robot::JointType::kPrismatic : robot::JointType::kRevolute;
    const double unit = turns.IsNull() ? first->metres : first->radians;
    const auto order = Handle(StepKinematics_LowOrderKinematicPair)::DownCast(pair);
    const bool flags[] = {order->TX(), order->TY(), order->TZ(), order->RX(), order->RY(), order->RZ()};
    int axis = turns.IsNull() ? 0 : 5;
    const int from = turns.IsNull() ? 0 : 3;
    if (int(flags[from]) + int(flags[from + 1]) + int(flags[from + 2]) == 1)
      for (int i = from; i < from + 3; ++i) axis = flags[i] ? i : axis;
    const auto frame =
        pair->ItemDefinedTransformation().IsNull()
            ? Handle(StepGeom_Axis2Placement3d)()
            : Handle(StepGeom_Axis2Placement3d)::DownCast(pair->ItemDefinedTransformation()->TransformItem1());
    if (frame.IsNull() || !TakeAxis(frame, axis % 3, first->metres, &joint)) return leave_out("has no frame");
    TakeLimits(pair, unit, &joint);
    const auto value = values_.find(pair.get());
    if (value != values_.end()) joint.drawn_at = value->second[static_cast<std::size_t>(axis)] * unit;
    out_.joints.push_back(joint);
  }

  static void TakeLimits(const Handle(StepKinematics_KinematicPair) & pair, double unit, twin::CadJoint* joint) {
    const auto turns = Handle(StepKinematics_RevolutePairWithRange)::DownCast(pair);
    const auto slides = Handle(StepKinematics_PrismaticPairWithRange)::DownCast(pair);
    if (!turns.IsNull()) {
      if (turns->HasLowerLimitActualRotation()) joint->lower = unit * turns->LowerLimitActualRotation();
      if (turns->HasUpperLimitActualRotation()) joint->upper = unit * turns->UpperLimitActualRotation();
    }
    if (!slides.IsNull()) {
      if (slides->HasLowerLimitActualTranslation()) joint->lower = unit * slides->LowerLimitActualTranslation();
      if (slides->HasUpperLimitActualTranslation()) joint->upper = unit * slides->UpperLimitActualTranslation();
    }
  }

  static Vector3 VectorOf(const Handle(StepGeom_Direction) & direction, const Vector3& otherwise) {
    if (direction.IsNull()) return otherwise;
    const auto at = [&](int i) {
      return i <= direction->NbDirectionRatios() ? direction->DirectionRatiosValue(i) : 0.0;
    };
    return {at(1), at(2), at(3)};
  }

  // Axis 0, 1 or 2 of the frame, in the first link's.
  static bool TakeAxis(const Handle(StepGeom_Axis2Placement3d) & frame, int axis, double metres,
                       twin::CadJoint* joint) {
    if (frame->Location().IsNull() || frame->Location()->NbCoordinates() != 3) return false;
    const auto at = [&](int i) { return metres * frame->Location()->CoordinatesValue(i); };
    joint->origin = {at(1), at(2), at(3)};
    Vector3 z = VectorOf(frame->HasAxis() ? frame->Axis() : nullptr, {0, 0, 1});
    Vector3 x = VectorOf(frame->HasRefDirection() ? frame->RefDirection() : nullptr, {1, 0, 0});
    if (!(Norm(z) > 1e-9)) return false;
    z = (1.0 / Norm(z)) * z;
    x = x - Dot(x, z) * z;
    if (!(Norm(x) > 1e-9)) x = std::abs(z.x) < 0.9 ? Vector3{1, 0, 0} - z.x * z : Vector3{0, 1, 0} - z.y * z;
    x = (1.0 / Norm(x)) * x;
    joint->direction = axis == 0 ? x : axis == 1 ? Cross(z, x) : z;
    return true;
  }

  STEPCAFControl_Reader& reader_;
  const Handle(XCAFDoc_ShapeTool) & shapes_;
  const double metres_;
  const NodeOf& node_of_;
  std::map<const Standard_Transient*, Link> links_;                    // by kinematic link
  std::map<const Standard_Transient*, std::array<double, 6>> values_;  // by pair: tx, ty, tz, rx, ry, rz
  OwnJoints out_;
};

}  // namespace

OwnJoints ReadOwnJoints(STEPCAFControl_Reader& reader, const Handle(XCAFDoc_ShapeTool) & shapes, double metres,
                        const NodeOf& node_of) {
  return Reading(reader, shapes, metres, node_of).Run();
}

}  // namespace consac::cad
