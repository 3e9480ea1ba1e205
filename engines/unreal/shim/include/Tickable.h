#pragma once
#include "CoreMinimal.h"

enum class ETickableTickType { Always };
struct TStatId {};
inline constexpr int STATGROUP_Tickables = 0;
#define RETURN_QUICK_DECLARE_CYCLE_STAT(name, group) return TStatId()

class FTickableGameObject {
 public:
  virtual ~FTickableGameObject() = default;
  virtual void Tick(float seconds) = 0;
  virtual bool IsTickable() const { return true; }
  virtual TStatId GetStatId() const = 0;
  virtual ETickableTickType GetTickableTickType() const { return ETickableTickType::Always; }
};
