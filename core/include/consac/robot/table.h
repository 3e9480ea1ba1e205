#pragma once
// twin.json: the joint table as a file, for engines and for people. What `consac twin import` writes and an engine's
// component reads. Its members: docs/twin.md, format 1.

#include <string>
#include <string_view>
#include <vector>

#include "consac/robot/robot.h"

namespace consac::robot {

inline constexpr std::string_view kTableFormat = "consac-twin";  ///< its member "format"

/// Where a robot came from, for the table.
struct TableOrigin {
  std::string file;     ///< name of the file that was read, without folders
  std::string format;   ///< "urdf"
  std::string sha256;   ///< of that file
  std::string licence;  ///< what the file or its package says of it; "" nothing
};

/// What a glTF scene names a robot's nodes: link 0 by its name, and for joint j a node that stands still where the
/// joint is ("shoulder_frame") and one that moves ("shoulder"). Nodes are numbered so: 0 the base, 1 + 2 j and 2 + 2 j.
struct NodeNames {
  std::string base;                 ///< of link 0
  std::vector<std::string> frames;  ///< [J] stand still
  std::vector<std::string> joints;  ///< [J] move
};
/// Those names; where two would be the same, the later one has "_2" at its end.
NodeNames NodeNamesOf(const Robot& robot);

/// The table as JSON of several lines, the same for the same robot.
std::string WriteTable(const Robot& robot, const TableOrigin& origin);
/// The robot of such text. kDataLoss where it is no table, kInvalidArgument where its robot is none; both name what is
/// wrong with which joint. A table of a later format is refused with its number.
Result<Robot> ReadTable(std::string_view text);

}  // namespace consac::robot
