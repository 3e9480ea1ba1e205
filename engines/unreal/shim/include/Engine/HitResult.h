#pragma once
struct FHitResult {
  float Time = 1.0f;
};
