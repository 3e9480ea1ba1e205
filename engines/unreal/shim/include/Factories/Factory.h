#pragma once
#include <vector>

#include "Templates/SubclassOf.h"
#include "UObject/Object.h"
#include "UObject/ObjectMacros.h"

class FFeedbackContext;

/// Makes assets of files: the editor asks those whose Formats name the file's ending.
class UFactory : public UObject {
 public:
  using Super = UObject;
  using ThisClass = UFactory;
  UFactory() { ShimAll().push_back(this); }
  explicit UFactory(FVTableHelper& helper) : UObject(helper) {}
  ~UFactory() override { std::erase(ShimAll(), this); }
  static UClass* StaticClass() {
    static UClass made("UFactory", UObject::StaticClass());
    return &made;
  }
  UClass* ShimClass() const override { return StaticClass(); }
  /// Of a file whose ending fits.
  virtual bool FactoryCanImport(const FString& file) {
    static_cast<void>(file);
    return true;
  }
  virtual UObject* FactoryCreateFile(UClass* cls, UObject* parent, FName name, EObjectFlags flags, const FString& file,
                                     const TCHAR* parameters, FFeedbackContext* warn, bool& canceled) = 0;

  /// For the shim: those of the running editor.
  static std::vector<UFactory*>& ShimAll() {
    static std::vector<UFactory*> all;
    return all;
  }
  bool ShimTakes(const std::string& ending) const {
    for (const FString& format : Formats)
      if (bEditorImport && Shim::Narrow(*format).rfind(ending + ";", 0) == 0) return true;
    return false;
  }

 protected:
  friend class IAssetTools;
  TSubclassOf<UObject> SupportedClass;
  TArray<FString> Formats;
  uint8 bCreateNew : 1 = 1;
  uint8 bEditorImport : 1 = 0;
  uint8 bText : 1 = 1;
  int32 ImportPriority = DefaultImportPriority;  // the highest is asked first
  static constexpr int32 DefaultImportPriority = 100;
};
