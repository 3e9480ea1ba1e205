#pragma once
#define ENGINE_MAJOR_VERSION 5
#define ENGINE_MINOR_VERSION 3
#define UE_VERSION_OLDER_THAN(major, minor, patch) \
  (ENGINE_MAJOR_VERSION < (major) || (ENGINE_MAJOR_VERSION == (major) && ENGINE_MINOR_VERSION < (minor)))
