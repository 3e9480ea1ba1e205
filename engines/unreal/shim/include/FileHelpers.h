#pragma once
#include <string>

#include "UObject/Object.h"

class UWorld;

/// Saving, as the editor asks for it.
class FEditorFileUtils {
 public:
  /// False where the person says Cancel.
  static bool SaveDirtyPackages(const bool prompt, const bool maps, const bool content, const bool fast = false,
                                const bool notify = false, const bool can_be_declined = true) {
    check(prompt && maps && content && !fast && !notify && can_be_declined);
    ++shim_asked_;
    return shim_answer_;
  }
  static inline int shim_asked_ = 0;
  static inline bool shim_answer_ = true;
};

class UEditorLoadingAndSavingUtils : public UObject {
  SHIM_CLASS(UEditorLoadingAndSavingUtils, UObject)
  /// A level without a name, open in the editor; the one before is gone, saved or not. Null while a game plays there.
  static UWorld* NewBlankMap(bool save_existing_map);
  /// For tests: no level is open.
  static void ShimCloseLevel();
};
