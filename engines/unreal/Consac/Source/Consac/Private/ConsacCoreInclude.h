// Copyright CONSAC authors. MIT License.
// The only place where headers of ConsacCore and ConsacLearn enter the plugin: Unreal's short macros are put aside.
#pragma once

#include "CoreMinimal.h"

THIRD_PARTY_INCLUDES_START
#pragma push_macro("check")
#pragma push_macro("verify")
#pragma push_macro("ensure")
#pragma push_macro("TEXT")
#pragma push_macro("PI")
#undef check
#undef verify
#undef ensure
#undef TEXT
#undef PI
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/file.h"
#include "consac/base/hooks.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/base/thread.h"
#include "consac/host/driver.h"
#include "consac/host/recorder.h"
#include "consac/host/socket.h"
#include "consac/host/tick_world.h"
#include "consac/policy/policy.h"
#include "consac/policy/training_facts.h"
#include "consac/robot/conventions.h"
#include "consac/robot/posture.h"
#include "consac/robot/table.h"
#include "worlds/yumi_reach/yumi_reach.h"
#pragma pop_macro("PI")
#pragma pop_macro("TEXT")
#pragma pop_macro("ensure")
#pragma pop_macro("verify")
#pragma pop_macro("check")
THIRD_PARTY_INCLUDES_END
