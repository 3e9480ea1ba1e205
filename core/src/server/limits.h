#pragma once
// Times that both ends of a connection keep. Private to core/server.

#include <string_view>

namespace consac {

inline constexpr double kWriteTimeout = 10.0;  ///< s that a peer may take no data
inline constexpr double kStopLook = 0.1;       ///< s between looks at the stop flag
inline constexpr double kSharedWait = 0.02;    ///< s in shared memory between looks at the connection

inline constexpr std::string_view kSharedMemory = "shm";       ///< a capability's name
inline constexpr std::string_view kRendering = "render";       ///< a capability's name
inline constexpr std::string_view kRelabelling = "relabel";    ///< a capability's name
inline constexpr std::string_view kParameters = "parameters";  ///< a capability's name
inline constexpr std::string_view kStatistics = "statistics";  ///< a capability's name
inline constexpr std::string_view kGroups = "groups";          ///< a capability's name

}  // namespace consac
