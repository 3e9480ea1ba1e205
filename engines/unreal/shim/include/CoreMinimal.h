#pragma once
#include "Shim/Array.h"
#include "Shim/Delegates.h"
#include "Shim/Geometry.h"
#include "Shim/Macros.h"
#include "Shim/String.h"
