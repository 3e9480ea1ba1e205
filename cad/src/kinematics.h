#pragma once
// The joints that a STEP file has of its own: AP242's kinematic pairs (ISO 10303-105), by which few programs write
// mechanisms. OpenCASCADE 7.6 reads the entities and has no place for them in its documents.

#include <STEPCAFControl_Reader.hxx>
#include <TDF_Label.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <functional>
#include <string>
#include <vector>

#include "consac/twin/cad.h"

namespace consac::cad {

/// What a file says of its joints.
struct OwnJoints {
  std::vector<twin::CadJoint> joints;
  std::vector<std::string> warnings;  ///< a line for each that is left out
};

/// The number of the node of a component's label; -1 where there is none, or more than one.
using NodeOf = std::function<std::int32_t(const TDF_Label&)>;

/// The joints of the file that `reader` has transferred; `metres` is the document's unit.
OwnJoints ReadOwnJoints(STEPCAFControl_Reader& reader, const Handle(XCAFDoc_ShapeTool) & shapes, double metres,
                        const NodeOf& node_of);

}  // namespace consac::cad
