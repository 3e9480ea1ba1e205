#pragma once
#include "CoreMinimal.h"

#define WITH_DEV_AUTOMATION_TESTS 1

enum class EAutomationTestFlags : unsigned { EditorContext = 1, ClientContext = 2, EngineFilter = 4 };
constexpr EAutomationTestFlags operator|(EAutomationTestFlags a, EAutomationTestFlags b) {
  return static_cast<EAutomationTestFlags>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}

namespace EAutomationExpectedErrorFlags {
enum MatchType { Exact, Contains };
}

/// An error in the log that was not expected, or one that was and did not come, fails the test.
class FAutomationTestBase {
 public:
  explicit FAutomationTestBase(const char* shim_name);
  virtual ~FAutomationTestBase() = default;
  virtual bool RunTest(const FString& parameters) = 0;
  bool TestTrue(const TCHAR* what, bool value) { return ShimNote(what, value); }
  bool TestFalse(const TCHAR* what, bool value) { return ShimNote(what, !value); }
  bool TestEqual(const TCHAR* what, int32 actual, int32 expected) { return ShimNote(what, actual == expected); }
  bool TestEqual(const TCHAR* what, float actual, float expected, float tolerance = 1e-4f) {
    return ShimNote(what, actual - expected <= tolerance && expected - actual <= tolerance);
  }
  bool TestEqual(const TCHAR* what, const FString& actual, const FString& expected) {
    return ShimNote(what, actual == expected);
  }
  void AddExpectedError(const FString& pattern, EAutomationExpectedErrorFlags::MatchType match, int32 occurrences) {
    check(match == EAutomationExpectedErrorFlags::Contains && occurrences > 0);
    shim_expected_.push_back({pattern, occurrences});
  }
  /// For the shim: runs it, as the engine would.
  void ShimRun();
  /// For the shim: every test, what it is called, what did not hold.
  static std::vector<FAutomationTestBase*>& ShimAll();
  const char* ShimName() const { return shim_name_; }
  const std::vector<FString>& ShimFailures() const { return shim_failures_; }

 private:
  bool ShimNote(const TCHAR* what, bool held) {
    if (!held) shim_failures_.push_back(FString(what));
    return held;
  }
  struct ShimExpected {
    FString pattern;
    int32 left;
  };
  const char* shim_name_;
  std::vector<ShimExpected> shim_expected_;
  std::vector<FString> shim_failures_;
};

#define IMPLEMENT_SIMPLE_AUTOMATION_TEST(name, pretty, flags)          \
  class name final : public FAutomationTestBase {                      \
   public:                                                             \
    name() : FAutomationTestBase(pretty) { static_cast<void>(flags); } \
    bool RunTest(const FString& Parameters) override;                  \
  };                                                                   \
  static name shim_instance_of_##name;
