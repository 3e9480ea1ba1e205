#pragma once
struct FLatentActionInfo {};
