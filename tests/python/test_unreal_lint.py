"""The lint of the Unreal plugin: a small good plugin passes; for every rule one change that is accepted and one that is
rejected; the tokenizer; the table of rules; the command."""
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from unreal_lint import check, declarations, model, rules, symbols, tokens  # noqa: E402

SYMBOLS = ROOT / "engines/unreal/symbols.csv"
PUBLIC, PRIVATE = "Source/Consac/Public/", "Source/Consac/Private/"
TYPES, SOCKET, LIBRARY, WAIT = (PUBLIC + name for name in (
    "ConsacTypes.h", "ConsacSocket.h", "ConsacLibrary.h", "ConsacWait.h"))
COMPONENT, EVENTS, CHANNEL = (PUBLIC + name for name in ("ConsacComponent.h", "ConsacEvents.h", "ConsacChannel.h"))
SOCKET_CPP, LIBRARY_CPP, WAIT_CPP, COMPONENT_CPP, MODULE_CPP = (PRIVATE + name for name in (
    "ConsacSocket.cpp", "ConsacLibrary.cpp", "ConsacWait.cpp", "ConsacComponent.cpp", "ConsacModule.cpp"))
BUILD, CORE_BUILD = "Source/Consac/Consac.Build.cs", "Source/ConsacCore/ConsacCore.Build.cs"
CORE_H = "Source/ConsacCore/Public/consac/env/step.h"
OWN = "// Copyright CONSAC authors. MIT License.\n"
HEADER = OWN + "#pragma once\n\n"

GOOD = {
    "Consac.uplugin": """{
  "FileVersion": 3,
  "FriendlyName": "CONSAC",
  "Modules": [
    { "Name": "ConsacCore", "PlatformAllowList": [ "Win64", "Linux" ], "Type": "Runtime", "LoadingPhase": "Default" },
    { "Name": "Consac", "PlatformAllowList": [ "Win64", "Linux" ], "Type": "Runtime", "LoadingPhase": "Default" }
  ]
}
""",
    "README.md": "CONSAC\n",
    "Config/FilterPlugin.ini": "[FilterPlugin]\n; what else is packed\n/README.md\n",
    BUILD: """// Copyright CONSAC authors.
using UnrealBuildTool;

public class Consac : ModuleRules
{
	public Consac(ReadOnlyTargetRules Target) : base(Target)
	{
		CppStandard = CppStandardVersion.Cpp20;
		PublicDependencyModuleNames.AddRange(new string[] { "Core", "CoreUObject", "Engine" });
		PrivateDependencyModuleNames.Add("ConsacCore");
	}
}
""",
    CORE_BUILD: """using UnrealBuildTool;
public class ConsacCore : ModuleRules
{
	public ConsacCore(ReadOnlyTargetRules Target) : base(Target)
	{
		bUseUnity = false;
		PublicDependencyModuleNames.Add("Core");
	}
}
""",
    CORE_H: "#pragma once\nnamespace consac { int Step(int action); }\n",
    "Source/ConsacCore/Private/ConsacCoreModule.cpp": OWN + """#include "Modules/ModuleManager.h"

IMPLEMENT_MODULE(FDefaultModuleImpl, ConsacCore)
""",
    MODULE_CPP: OWN + """#include "CoreMinimal.h"
#include "Logging/LogMacros.h"
#include "Modules/ModuleManager.h"

DEFINE_LOG_CATEGORY_STATIC(LogConsac, Log, All);
IMPLEMENT_MODULE(FDefaultModuleImpl, Consac)
""",
    TYPES: HEADER + """#include "CoreMinimal.h"
#include "ConsacTypes.generated.h"

UENUM(BlueprintType)
enum class EConsacStatus : uint8
{
	Ok UMETA(DisplayName="OK"),
	Failed
};

USTRUCT(BlueprintType)
struct CONSAC_API FConsacFloats
{
	GENERATED_BODY()

	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac")
	TArray<float> Values;

	UPROPERTY(EditAnywhere, Category="Consac", meta=(ClampMin="0", EditCondition="bLimited"))
	int32 Limit = 0;

	UPROPERTY(EditAnywhere, Category="Consac")
	uint8 bLimited : 1 = 0;
};
""",
    EVENTS: HEADER + """#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "ConsacEvents.generated.h"

UDELEGATE()
DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FConsacEvent, EConsacStatus, Status, int32, Step);
DECLARE_DYNAMIC_DELEGATE_OneParam(FConsacDone, int32, Step);
""",
    CHANNEL: HEADER + """#include "CoreMinimal.h"
#include "UObject/Interface.h"
#include "ConsacChannel.generated.h"

UINTERFACE(BlueprintType)
class CONSAC_API UConsacChannel : public UInterface
{
	GENERATED_BODY()
};

class CONSAC_API IConsacChannel
{
	GENERATED_BODY()

public:
	UFUNCTION(BlueprintCallable, BlueprintNativeEvent, Category="Consac")
	int32 Pending();
};
""",
    SOCKET: HEADER + """#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "Templates/PimplPtr.h"
#include "UObject/Object.h"
#include "UObject/ObjectPtr.h"
#include "ConsacSocket.generated.h"

struct FConsacSocketState;

UCLASS(BlueprintType, Blueprintable)
class CONSAC_API UConsacSocket : public UObject
{
	GENERATED_BODY()

public:
	UConsacSocket();

	UFUNCTION(BlueprintCallable, Category="Consac", meta=(ExpandEnumAsExecs="Status"))
	void OpenSocket(const FString& Host, EConsacStatus& Status, int32 Port = 0);

	UFUNCTION(BlueprintPure, Category="Consac")
	bool IsOpen() const;

	UFUNCTION(BlueprintNativeEvent, Category="Consac")
	void Accepted(int32 Peer);

	UFUNCTION(BlueprintImplementableEvent, Category="Consac")
	void Received(const FString& Text);

	virtual void BeginDestroy() override;

private:
	UPROPERTY()
	TObjectPtr<UConsacSocket> Parent;

	TPimplPtr<FConsacSocketState> State;
};
""",
    SOCKET_CPP: OWN + """#include "ConsacSocket.h"

#include <string>

#include "Containers/StringConv.h"
#include "Logging/LogMacros.h"

DEFINE_LOG_CATEGORY_STATIC(LogConsacSocket, Log, All);

struct FConsacSocketState
{
	std::string Host;
};

UConsacSocket::UConsacSocket() : State(MakePimpl<FConsacSocketState>())
{
}

void UConsacSocket::OpenSocket(const FString& Host, EConsacStatus& Status, int32 Port)
{
	FTCHARToUTF8 Narrow(*Host);
	State->Host = std::string(Narrow.Get(), Narrow.Length());
	UE_LOG(LogConsacSocket, Log, TEXT("%s:%d"), *Host, Port);
	Status = EConsacStatus::Ok;
}

bool UConsacSocket::IsOpen() const { return !State->Host.empty(); }

void UConsacSocket::Accepted_Implementation(int32 Peer) {}

void UConsacSocket::BeginDestroy()
{
	State.Reset();
	Super::BeginDestroy();
}
""",
    LIBRARY: HEADER + """#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "Kismet/BlueprintFunctionLibrary.h"
#include "UObject/Object.h"
#include "ConsacLibrary.generated.h"

class UConsacSocket;

UCLASS()
class CONSAC_API UConsacLibrary : public UBlueprintFunctionLibrary
{
	GENERATED_BODY()

public:
	UFUNCTION(BlueprintCallable, Category="Consac", meta=(WorldContext="Context"))
	static UConsacSocket* CreateSocket(UObject* Context, const FString& Name = TEXT(""));
};
""",
    LIBRARY_CPP: OWN + """#include "ConsacLibrary.h"

#include "ConsacSocket.h"
#include "UObject/UObjectGlobals.h"

UConsacSocket* UConsacLibrary::CreateSocket(UObject* Context, const FString& Name)
{
	return NewObject<UConsacSocket>(Context);
}
""",
    WAIT: HEADER + """#include "CoreMinimal.h"
#include "ConsacEvents.h"
#include "Kismet/BlueprintAsyncActionBase.h"
#include "UObject/Object.h"
#include "ConsacWait.generated.h"

UCLASS()
class CONSAC_API UConsacWait : public UBlueprintAsyncActionBase
{
	GENERATED_BODY()

public:
	UPROPERTY(BlueprintAssignable, Category="Consac")
	FConsacEvent OnMessage;

	UFUNCTION(BlueprintCallable, Category="Consac", meta=(BlueprintInternalUseOnly="true", WorldContext="Context"))
	static UConsacWait* WaitForMessage(UObject* Context, float Seconds = 5.0f);

	UFUNCTION()
	void Heard(EConsacStatus Status, int32 Step);

	virtual void Activate() override;
};
""",
    WAIT_CPP: OWN + """#include "ConsacWait.h"

#include "UObject/UObjectGlobals.h"

UConsacWait* UConsacWait::WaitForMessage(UObject* Context, float Seconds)
{
	UConsacWait* Action = NewObject<UConsacWait>();
	Action->RegisterWithGameInstance(Context);
	return Action;
}

void UConsacWait::Heard(EConsacStatus Status, int32 Step) {}

void UConsacWait::Activate()
{
	OnMessage.AddDynamic(this, &UConsacWait::Heard);
	OnMessage.Broadcast(EConsacStatus::Ok, 1);
	SetReadyToDestroy();
}
""",
    COMPONENT: HEADER + """#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "Components/SceneComponent.h"
#include "UObject/ObjectPtr.h"
#include "ConsacComponent.generated.h"

UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent))
class CONSAC_API UConsacComponent : public UActorComponent
{
	GENERATED_BODY()

public:
	UConsacComponent();

	virtual void BeginPlay() override;

	UPROPERTY(VisibleAnywhere, Category="Consac")
	TObjectPtr<USceneComponent> Root;
};
""",
    COMPONENT_CPP: OWN + """#include "ConsacComponent.h"

#include "consac/env/step.h"

UConsacComponent::UConsacComponent()
{
	PrimaryComponentTick.bCanEverTick = true;
	Root = CreateDefaultSubobject<USceneComponent>(TEXT("Root"));
}

void UConsacComponent::BeginPlay()
{
	Super::BeginPlay();
	consac::Step(1);
}
""",
}


def write(folder, files):
    for path, text in files.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(text if isinstance(text, bytes) else text.encode())


def changed(changes):
    """The good files after changes: (file, old, new); old '' appends, None writes the file."""
    files = dict(GOOD)
    for path, old, new in changes:
        if old is None:
            files[path] = new
        elif old == "":
            files[path] += new
        else:
            assert old in files[path], f"{old!r} is not in {path}"
            files[path] = files[path].replace(old, new)
    return files


@pytest.fixture(scope="module")
def lint(tmp_path_factory):
    """Findings in the good plugin after changes, in one folder that is put right again."""
    root = tmp_path_factory.mktemp("lint")
    plugin, table = root / "plugin", root / "symbols.csv"
    write(plugin, GOOD)

    def run(changes=()):
        rows = "".join(new for path, _, new in changes if path == "symbols.csv")
        table.write_text(SYMBOLS.read_text() + rows)
        files = {path: text for path, text in changed(c for c in changes if c[0] != "symbols.csv").items() if GOOD.get(path) != text}
        write(plugin, files)
        try:
            found = check.check(plugin, table)
            assert all(path == "." or (plugin / path).is_file() for path, _, _, _ in found), found
            return found
        finally:
            for path in files:
                (plugin / path).unlink()
            write(plugin, {path: GOOD[path] for path in files if path in GOOD})

    return run


PROPERTY = "\tUPROPERTY(EditAnywhere, Category=\"Consac\")\n\tuint8 bLimited"
FUNCTION = "\tUFUNCTION(BlueprintPure, Category=\"Consac\")\n\tbool IsOpen() const;"


def prop(text, specifiers='EditAnywhere, BlueprintReadWrite, Category="Consac"'):
    """One more property of the struct."""
    return [(TYPES, PROPERTY, f"\tUPROPERTY({specifiers})\n\t{text}\n\n{PROPERTY}")]


def fun(text, specifiers='BlueprintCallable, Category="Consac"'):
    """One more function of the socket; without a body in the .cpp, which only a linker asks for."""
    return [(SOCKET, FUNCTION, f"\tUFUNCTION({specifiers})\n\t{text}\n\n{FUNCTION}")]


def extra(text, includes="", name="ConsacExtra"):
    """One more header."""
    return [(f"{PUBLIC}{name}.h", None, f'{HEADER}#include "CoreMinimal.h"\n{includes}#include "{name}.generated.h"\n\n{text}\n')]


def struct(head="struct CONSAC_API FConsacExtra", body="GENERATED_BODY()", macro="USTRUCT()"):
    return f"{macro}\n{head}\n{{\n\t{body}\n}};"


def uclass(name="UConsacExtra", base="UObject", body="", macro="UCLASS()", api="CONSAC_API"):
    return f"{macro}\nclass {api} {name} : public {base}\n{{\n\tGENERATED_BODY()\n{body}\n}};"


def cpp(text, name="ConsacMore.cpp", includes='#include "CoreMinimal.h"\n'):
    return [(PRIVATE + name, None, OWN + includes + text + "\n")]


def inside(statement, path=COMPONENT_CPP, at="\tconsac::Step(1);\n"):
    """One more statement in BeginPlay."""
    return [(path, at, at + "\t" + statement + "\n")]


def edit(path, old, new):
    return [(path, old, new)]


OBJECT = '#include "UObject/Object.h"\n'
KEEPER = '#include "GameFramework/Actor.h"\n#include "UObject/ObjectPtr.h"\nclass UConsacSocket;\n'
POINTER = '#include "UObject/ObjectPtr.h"\n'
LOG = '#include "Logging/LogMacros.h"\n'
TICKER = '#include "Containers/Ticker.h"\n#include "UObject/WeakObjectPtrTemplates.h"\n'

LOADS = cpp('UObject* Find() { return LoadObject<UObject>(nullptr, TEXT("/Engine/Cube")); }', includes='#include "CoreMinimal.h"\n#include "UObject/Object.h"\n#include "UObject/UObjectGlobals.h"\n')
PROCESS = '#include "CoreMinimal.h"\n#include "HAL/PlatformProcess.h"\n'
PACKED = edit(COMPONENT_CPP, '#include "consac', '#include "Interfaces/IPluginManager.h"\n#include "consac') + edit(
    BUILD, '.Add("ConsacCore")', '.AddRange(new string[] { "ConsacCore", "Projects" })')
ENDS = edit(COMPONENT, "virtual void BeginPlay() override", "virtual void EndPlay(const EEndPlayReason::Type Why) override\n\t{\n\t\tRoot->DestroyComponent();\n"
            "\t\tSuper::EndPlay(Why);\n\t}\n\n\tvirtual void BeginPlay() override")

ENDS_BY_CALL = edit(COMPONENT, "virtual void BeginPlay() override", "void Clear()\n\t{\n\t\tRoot->DestroyComponent();\n\t}\n\n"
                    "\tvirtual void EndPlay(const EEndPlayReason::Type Why) override\n\t{\n\t\tClear();\n\t\tSuper::EndPlay(Why);\n\t}\n\n"
                    "\tvirtual void BeginPlay() override")

# rule -> [(accepted change, rejected change), ...]
CASES = {
    "R1": [(edit(TYPES, '#include "ConsacTypes.generated.h"', '#include "Containers/StringConv.h"\n#include "ConsacTypes.generated.h"'),
            edit(TYPES, '#include "ConsacTypes.generated.h"', '#include "ConsacTypes.generated.h"\n#include "Containers/StringConv.h"'))],
    "R2": [([(PRIVATE + "ConsacPlain.h", None, HEADER + '#include "CoreMinimal.h"\nint32 ConsacCount();\n')],
            [(PRIVATE + "ConsacPlain.h", None, HEADER + '#include "CoreMinimal.h"\n#include "ConsacPlain.generated.h"\nint32 ConsacCount();\n')]),
           ([], edit(TYPES, '#include "ConsacTypes.generated.h"\n', ""))],
    "R3": [(edit(TYPES, "#pragma once", "#  pragma once"), edit(TYPES, "#pragma once", "// #pragma once"))],
    "R4": [(edit(SOCKET_CPP, "#include <string>", "// UCLASS() is a word here\n#include <string>"),
            cpp("UENUM()\nenum class EConsacLate : uint8 { A };"))],
    "R5": [(cpp("", includes='#include "Containers/StringConv.h"\n'),
            edit(SOCKET_CPP, '#include "ConsacSocket.h"\n', '#include "Logging/LogMacros.h"\n#include "ConsacSocket.h"\n')),
           ([], edit(TYPES, '#include "CoreMinimal.h"', '#include "Containers/StringConv.h"\n#include "CoreMinimal.h"'))],
    "R6": [(edit(LIBRARY, '#include "UObject/Object.h"\n', "class UObject;\n"), edit(LIBRARY, '#include "UObject/Object.h"\n', "")),
           ([], edit(SOCKET, '#include "ConsacTypes.h"', '#include "ConsacGone.h"'))],
    "R7": [(edit(EVENTS, "UDELEGATE()\n", "UDELEGATE( )\n"), edit(EVENTS, "UDELEGATE()\n", ""))],
    "R8": [([(PRIVATE + "ConsacMore.cpp", None, OWN + "// naïve\n")],
            [(PRIVATE + "ConsacMore.cpp", None, b"\xef\xbb\xbf" + OWN.encode())]),
           ([], [(PRIVATE + "ConsacMore.cpp", None, OWN.encode() + b"// na\xefve\n")]),
           ([], edit(TYPES, OWN, ""))],
    "R9": [(cpp('#include "consac/env/step.h"'), edit(SOCKET, '#include "ConsacTypes.h"', '#include "ConsacTypes.h"\n#include "consac/env/step.h"')),
           (cpp("", includes="#include <vector>\n"), edit(SOCKET, '#include "ConsacTypes.h"', '#include "ConsacTypes.h"\n#include <vector>'))],
    "R10": [(extra(struct(body="// first\n\tGENERATED_BODY()")), extra(struct(body="float Value = 0;\n\tGENERATED_BODY()"))),
            ([], edit(CHANNEL, "class CONSAC_API IConsacChannel\n{\n\tGENERATED_BODY()\n", "class CONSAC_API IConsacChannel\n{\n"))],
    "R11": [(extra(uclass("AConsacExtra", "AActor"), '#include "GameFramework/Actor.h"\n'),
             extra(uclass("UConsacExtra", "AActor"), '#include "GameFramework/Actor.h"\n')),
            ([], extra(struct("struct CONSAC_API ConsacExtra")))],
    "R12": [(extra(uclass(base="UObject, public IConsacChannel"), OBJECT + '#include "ConsacChannel.h"\n'),
             extra(uclass(base="UObject, public UConsacSocket"), OBJECT + '#include "ConsacSocket.h"\n')),
            (extra(struct("struct CONSAC_API FConsacExtra : public FConsacFloats"), '#include "ConsacTypes.h"\n'),
             extra(struct("struct CONSAC_API FConsacExtra : public FConsacFloats, public FConsacOther"), '#include "ConsacTypes.h"\n'))],
    "R13": [(extra(struct() + "\ntemplate <typename TItem> struct TConsacPair { TItem First; };"), extra("template <typename TItem>\n" + struct())),
            ([], extra("namespace consac_ue {\n" + struct() + "\n}")),
            ([], extra(struct(body="GENERATED_BODY()\n" + struct("struct FConsacInner"))))],
    "R14": [(extra(struct(body="GENERATED_BODY()\n\tFConsacExtra() {}\n\texplicit FConsacExtra(int32 Count) {}")),
             extra(struct(body="GENERATED_BODY()\n\texplicit FConsacExtra(int32 Count) {}"))),
            (extra(uclass(body="public:\n\tUConsacExtra(const FObjectInitializer& Initializer);"), OBJECT),
             extra(uclass(body="public:\n\tUConsacExtra();\n\texplicit UConsacExtra(int32 Count);"), OBJECT))],
    "R15": [(extra(struct(body="GENERATED_BODY()\n\tint32 Count() const { return 0; }")),
             extra(struct(body='GENERATED_BODY()\n\tUFUNCTION(BlueprintCallable, Category="Consac")\n\tint32 Count() const { return 0; }')))],
    "R16": [(prop("double Reward = 0.0;"), prop("double Reward;")), (prop("FString Name;"), prop("EConsacStatus Status;"))],
    "R17": [(extra("UENUM(BlueprintType)\nenum class EConsacExtra : uint8 { A, B = 255 };"),
             extra("UENUM(BlueprintType)\nenum class EConsacExtra : int32 { A };")),
            ([], extra("UENUM(BlueprintType)\nenum class EConsacExtra : uint8 { A = 255, B };"))],
    "R18": [(extra("#if WITH_EDITOR\n" + struct() + "\n#endif"), extra("#if PLATFORM_WINDOWS\n" + struct() + "\n#endif")),
            ([], extra("#ifndef CONSAC_OFF\n" + struct() + "\n#endif"))],
    "R19": [(edit(TYPES, PROPERTY, "#if WITH_EDITORONLY_DATA\n\tUPROPERTY()\n\tFString Note;\n#endif\n" + PROPERTY),
             edit(TYPES, PROPERTY, "#if WITH_EDITOR\n\tUPROPERTY()\n\tFString Note;\n#endif\n" + PROPERTY)),
            ([], edit(SOCKET, FUNCTION, "#if WITH_EDITOR\n" + FUNCTION + "\n#endif"))],
    "R20": [(extra(struct("struct CONSAC_API FConsacMore")), extra(struct("struct CONSAC_API FExtra"))),
            ([], extra(struct("struct CONSAC_API FConsacSocket"))),
            ([], edit(EVENTS, "FConsacDone", "FDone"))],
    "R21": [([(PRIVATE + "ConsacPlain.h", None, HEADER)], [(PRIVATE + "Plain.h", None, HEADER)]),
            ([], [(PRIVATE + "ConsacTypes.h", None, HEADER)])],
    "R22": [([], edit(CHANNEL, "class CONSAC_API IConsacChannel", "class CONSAC_API IConsacOther")),
            (edit(CHANNEL, "UINTERFACE(BlueprintType)", "UINTERFACE()"), edit(CHANNEL, " : public UInterface", " : public UObject"))],
    "R23": [(extra(uclass("AConsacA", "AActor", macro="UCLASS(NotPlaceable)") + "\n" + uclass("AConsacB", "AConsacA"), '#include "GameFramework/Actor.h"\n'),
             extra(uclass("AConsacA", "AActor", macro="UCLASS(NotPlaceable)") + "\n" + uclass("AConsacB", "AConsacA", macro="UCLASS(Placeable)"),
                   '#include "GameFramework/Actor.h"\n')),
            ([], extra(struct(macro="USTRUCT(Immutable)")))],
    "R24": [(prop("TMap<FName, FConsacFloats> Table;"), prop("std::string Name;")), ([], prop("TSharedPtr<FConsacFloats> Shared;")),
            (fun("TArray<FVector> Path(const TMap<FName, int32>& Table);"), fun("void Path(const std::vector<float>& Points);")),
            (edit(EVENTS, "FConsacDone, int32, Step", "FConsacDone, const TArray<float>&, Values"), edit(EVENTS, "FConsacDone, int32, Step", "FConsacDone, size_t, Step")),
            ([], prop("TArray<size_t> Sizes;")), ([], prop("TEnumAsByte<EAnything> Channel;"))],
    "R25": [(prop("uint32 Seed = 0;", 'EditAnywhere, Category="Consac"'), prop("uint32 Seed = 0;")), (fun("void Seed(int64 Value);"), fun("void Seed(uint64 Value);"))],
    "R26": [(fun("void Give(UConsacSocket* Other);"), fun("void Give(FConsacFloats* Floats);")), ([], fun("void Give(UConsacSocket** Others);"))],
    "R27": [(prop("int32 Count = 0;"), prop("int32& Count;")), ([], prop("const int32 Count = 0;"))],
    "R28": [(prop("TArray<FConsacFloats> Rows;"), prop("TArray<TArray<float>> Rows;")), (prop("TMap<FString, int32> Table;"), prop("TMap<FText, int32> Table;")),
            ([], prop("TSet<FConsacFloats> Rows;"))],
    "R29": [(edit(SOCKET, "\tUPROPERTY()\n", "\tUPROPERTY(Transient)\n"), edit(SOCKET, "\tUPROPERTY()\n", "")),
            ([], edit(SOCKET, "TObjectPtr<UConsacSocket> Parent", "UConsacSocket* Parent = nullptr"))],
    "R30": [(edit(SOCKET, "\tUPROPERTY()\n", '\tUPROPERTY(BlueprintReadOnly, Category="Consac", meta=(AllowPrivateAccess="true"))\n'),
             edit(SOCKET, "\tUPROPERTY()\n", '\tUPROPERTY(BlueprintReadOnly, Category="Consac")\n'))],
    "R31": [(edit(WAIT, "UPROPERTY(BlueprintAssignable,", "UPROPERTY(BlueprintAssignable, BlueprintCallable,"), edit(WAIT, "FConsacEvent OnMessage", "FConsacDone OnMessage"))],
    "R32": [(prop("int32 Count = 0;", "Transient"), prop("int32 Count = 0;", "EditAnywhere"))],
    "R33": [(prop("int32 Count = 0;", 'EditAnywhere, Category="Consac", meta=(EditCondition="bLimited && Limit == 0")'),
             prop("int32 Count = 0;", 'EditAnywhere, Category="Consac", meta=(EditCondition="bUnlimited")')),
            ([], edit(TYPES, 'ClampMin="0"', "ClampMin=0")),
            (edit(TYPES, 'ClampMin="0"', 'ClampMin="-0.000001"'), edit(TYPES, 'ClampMin="0"', 'ClampMin="1e-06"')),
            (edit(TYPES, 'ClampMin="0"', 'ClampMin="0", Delta="0.5"'), edit(TYPES, 'ClampMin="0"', 'ClampMin="0", Delta=".5f"'))],
    "R34": [(edit(TYPES, "uint8 bLimited : 1 = 0;", "uint32 bLimited : 1 = 0;"), edit(TYPES, "uint8 bLimited : 1", "bool bLimited : 1")),
            ([], edit(TYPES, "uint8 bLimited : 1 = 0;", "uint8 Limited : 1 = 0;\n\tbool bLimited = false;"))],
    "R35": [(edit(COMPONENT, "VisibleAnywhere", "VisibleDefaultsOnly"), edit(COMPONENT, "VisibleAnywhere", "EditAnywhere"))],
    "R36": [(prop("int32 Counts[3] = {};", 'EditAnywhere, Category="Consac"'), prop("int32 Counts[3] = {};"))],
    "R37": [(fun("void Hidden();", ""), fun("void Shown();", "BlueprintCallable"))],
    "R38": [(edit(SOCKET, "\tUConsacSocket();", "\tUConsacSocket();\n\tvoid Close();\n\tvoid Close(int32 Code);"), fun("void OpenSocket(int32 Code);")),
            ([], edit(SOCKET, FUNCTION, '\tUFUNCTION(BlueprintCallable, Category="Consac")\n\ttemplate <typename TItem>\n\tvoid Any(TItem Item);\n' + FUNCTION)),
            ([], fun("virtual void Nothing() = 0;"))],
    "R39": [(edit(WAIT, "virtual void Activate() override;", "void Other();\n\tvirtual void Activate() override;"),
             edit(WAIT, "\tvirtual void Activate() override;", "\tUFUNCTION()\n\tvirtual void Activate() override;"))],
    "R40": [(fun("void Give(const UConsacSocket* Other);"), fun("void Give(const UConsacSocket& Other);")), ([], fun("void Give(TObjectPtr<UConsacSocket> Other);"))],
    "R41": [(fun("void Count(int32& Sum) const;", 'BlueprintPure, Category="Consac"'), fun("void Count(const int32& Sum) const;", 'BlueprintPure, Category="Consac"'))],
    "R42": [(edit(SOCKET, "void Received(const FString& Text);", "void Received(const TArray<float>& Values);"),
             edit(SOCKET, "void Received(const FString& Text);", "void Received(TArray<float> Values);")),
            ([], edit(SOCKET, "void Received(", "virtual void Received(")), ([], edit(SOCKET_CPP, "", "void UConsacSocket::Received(const FString& Text) {}\n"))],
    "R43": [(edit(SOCKET_CPP, "int32 Peer) {}", "int32 Peer)\n{\n}"), edit(SOCKET_CPP, "Accepted_Implementation", "Accepted"))],
    "R44": [([], edit(SOCKET, "UFUNCTION(BlueprintImplementableEvent,", "UFUNCTION(BlueprintImplementableEvent, BlueprintNativeEvent,")),
            (fun("void Run();", "Exec, SealedEvent"), fun("void Run();", 'BlueprintCallable, SealedEvent, Category="Consac"'))],
    "R45": [(edit(LIBRARY, 'WorldContext="Context"', 'WorldContext="Context", AutoCreateRefTerm="Name"'), edit(LIBRARY, 'WorldContext="Context"', 'WorldContext="World"'))],
    "R46": [(fun("bool Try();", 'BlueprintCallable, Category="Consac", meta=(ExpandEnumAsExecs="ReturnValue")'),
             fun("int32 Try();", 'BlueprintCallable, Category="Consac", meta=(ExpandEnumAsExecs="ReturnValue")')),
            ([], fun("bool Try() const;", 'BlueprintPure, Category="Consac", meta=(ExpandEnumAsExecs="ReturnValue")'))],
    "R47": [(edit(SOCKET, '#include "ConsacTypes.h"', '#include "ConsacTypes.h"\n#include "Engine/LatentActionManager.h"') + fun(
                "void Later(FLatentActionInfo Info);", 'BlueprintCallable, Category="Consac", meta=(Latent, LatentInfo="Info")'),
             fun("void Later(int32 Info);", 'BlueprintCallable, Category="Consac", meta=(Latent, LatentInfo="Info")'))],
    "R48": [(edit(WAIT, "meta=(BlueprintInternalUseOnly=\"true\", ", "meta=(BlueprintInternalUseOnly=\"true\", DisplayName=\"Wait\", "),
             edit(WAIT, 'BlueprintInternalUseOnly="true", ', "")), ([], edit(WAIT, "static UConsacWait*", "UConsacWait*"))],
    "R49": [(edit(EVENTS, "", "DECLARE_DYNAMIC_MULTICAST_DELEGATE(FConsacOver);\n"), edit(EVENTS, "", "DECLARE_DYNAMIC_MULTICAST_DELEGATE(ConsacOver);\n")),
            ([], edit(EVENTS, "FConsacDone, int32, Step", "FConsacDone, int32 Step")),
            ([], edit(EVENTS, "FConsacDone, int32, Step", "FConsacDone, (TMap<FName, int32>), Step")),
            ([], edit(WAIT, "\tUFUNCTION()\n", ""))],
    "R50": [(edit(SOCKET, '#include "ConsacTypes.h"', '#include "ConsacEvents.h"') + fun("void Then(FConsacDone Done);"),
             edit(SOCKET, '#include "ConsacTypes.h"', '#include "ConsacEvents.h"') + fun("void Then(FConsacEvent Done);"))],
    "R51": [(fun("int32 Sum(int32 A, int32 B) const;", 'BlueprintPure, Category="Consac", meta=(CommutativeAssociativeBinaryOperator="true")'),
             fun("int32 Sum(int32 A, float B) const;", 'BlueprintPure, Category="Consac", meta=(CommutativeAssociativeBinaryOperator="true")'))],
    "R52": [(fun("void Go(float Speed = -1.5f, bool bFast = true, EConsacStatus As = EConsacStatus::Ok);"), fun("void Go(int32 Speed = 2 * 3);")),
            (fun('void Go(FVector To = FVector(0.0, 1.0, 2.0), const FString& By = TEXT("car"));'), fun("void Go(int32 Speed = ConsacSpeed);"))],
    "R53": [(fun("void Adopt(UConsacSocket* NewParent);"), fun("void Adopt(UConsacSocket* Parent);"))],
    "R54": [([], edit(LIBRARY, "static UConsacSocket*", "UConsacSocket*")), (inside("(void)0;", LIBRARY_CPP, "{\n"), edit(LIBRARY_CPP, "NewObject<UConsacSocket>", "NewObject<UConsacLibrary>"))],
    "R55": [(fun("void Grow(UPARAM(ref) TArray<float>& Values);"), fun("void Grow(UPARAM(ref) const TArray<float>& Values);")),
            ([], fun("void Grow(UPARAM(ref) int32 Count);"))],
    "R56": [(prop("int32 Count = 0;", 'EditDefaultsOnly, Category="Consac", meta=(Units="s")'), prop("int32 Count = 0;", 'EditDefaultOnly, Category="Consac"')),
            ([], prop("int32 Count = 0;", 'EditAnywhere, Category="Consac", meta=(ClampMinimum="0")'))],
    "R57": [([(PRIVATE + "ConsacInner.h", None, f'{HEADER}#include "CoreMinimal.h"\n#include "ConsacInner.generated.h"\n{struct("struct FConsacInner")}\n')],
             extra(struct("struct FConsacExtra"))), ([], extra(uclass(macro="UCLASS(MinimalAPI)"), OBJECT))],
    "R58": [(edit(MODULE_CPP, "IMPLEMENT_MODULE(FDefaultModuleImpl, Consac)", "IMPLEMENT_MODULE( FDefaultModuleImpl , Consac );"),
             edit(MODULE_CPP, "FDefaultModuleImpl, Consac)", "FDefaultModuleImpl, Consacs)")),
            ([], edit(MODULE_CPP, "IMPLEMENT_MODULE", "// IMPLEMENT_MODULE")), ([], edit("Consac.uplugin", '"Name": "Consac",', '"Name": "Other",'))],
    "R59": [(edit(BUILD, "// Copyright", "// class Other\n// Copyright"), edit(BUILD, "class Consac :", "class Consacs :")), ([], edit(BUILD, " : base(Target)", ""))],
    "R60": [(edit(BUILD, "\t\tCppStandard", '\t\tif (Target.bBuildEditor)\n\t\t{\n\t\t\tPrivateDependencyModuleNames.Add("UnrealEd");\n\t\t}\n\t\tCppStandard'),
             edit(BUILD, '"Engine"', '"Engine", "UnrealEd"')), ([], edit(SOCKET_CPP, '#include "Logging/LogMacros.h"', '#include "Logging/LogMacros.h"\n#include "Editor.h"'))],
    "R61": [(edit(BUILD, '"Engine" });\n\t\tPrivateDependencyModuleNames.Add(', '"Engine" });\n\t\tPrivateDependencyModuleNames.AddRange(new string[] { "Projects" });\n\t\tPrivateDependencyModuleNames.Add(')
             + cpp("", includes='#include "Interfaces/IPluginManager.h"\n'), cpp("", includes='#include "Interfaces/IPluginManager.h"\n')),
            ([], edit(BUILD, ', "Engine" });', ' });\n\t\tPrivateDependencyModuleNames.Add("Engine");'))],
    "R62": [(edit(BUILD, "\t\tCppStandard", "\t\tbEnableExceptions = true;\n\t\tCppStandard") + inside("try { consac::Step(2); } catch (...) {}"),
             inside("try { consac::Step(2); } catch (...) {}")), (inside("// never throw"), inside("throw 1;")), ([], edit(CORE_H, "int Step", "int Try() { throw 1; } int Step"))],
    "R63": [(cpp('#define LOCTEXT_NAMESPACE "Consac"\n#undef LOCTEXT_NAMESPACE'), cpp('#define LOCTEXT_NAMESPACE "Consac"')), ([], cpp("#undef LOCTEXT_NAMESPACE"))],
    "R64": [(cpp("static int32 ConsacOne() { return 1; }") + cpp("static int32 ConsacTwo() { return 1; }", "ConsacLess.cpp"),
             cpp("static int32 ConsacOne() { return 1; }") + cpp("static int32 ConsacOne() { return 1; }", "ConsacLess.cpp")),
            (cpp("namespace ConsacA { const int32 kSize = 1; }") + cpp("namespace ConsacB { const int32 kSize = 1; }", "ConsacLess.cpp"),
             cpp("namespace { const int32 kSize = 1; }") + cpp("namespace { const int32 kSize = 1; }", "ConsacLess.cpp"))],
    "R65": [(cpp("#if defined(CONSAC_FAST) && WITH_EDITOR\n#endif"), cpp("#if CONSAC_FAST\n#endif")), ([], edit(COMPONENT, "virtual void BeginPlay() override", "virtual void BeginPlay()")),
            (cpp("struct FConsacBase { virtual ~FConsacBase() = default; virtual void Go() {} };"), cpp("struct FConsacBase { virtual void Go() {} };"))],
    "R66": [(edit(SOCKET_CPP, 'TEXT("%s:%d"), *Host, Port', 'TEXT("100%% %hs"), Narrow.Get()'), edit(SOCKET_CPP, "*Host, Port", "*Host")), ([], edit(SOCKET_CPP, "*Host, Port", "Host, Port")),
            ([], edit(SOCKET_CPP, "Socket, Log, TEXT", "Socket, Info, TEXT")), ([], edit(SOCKET_CPP, 'TEXT("%s:%d"), *Host, Port', "*Host"))],
    "R67": [(inside('const char* Name = "car";'), edit(COMPONENT_CPP, 'TEXT("Root")', '"Root"')), (inside('FString Name = TEXT("car");'), inside('FString Name = "car";'))],
    "R68": [(edit(COMPONENT_CPP, "= true;", "= true;\n\t// NewObject is for later"), edit(COMPONENT_CPP, "= true;", "= true;\n\tGetWorld();")), ([], inside('Root = CreateDefaultSubobject<USceneComponent>(TEXT("Late"));'))],
    "R69": [(edit(COMPONENT_CPP, "\tSuper::BeginPlay();\n\tconsac::Step(1);", "\tconsac::Step(1);\n\tSuper::BeginPlay();"), edit(COMPONENT_CPP, "\tSuper::BeginPlay();\n", "")),
            ([], extra(uclass("AConsacExtra", "AActor", "\tvirtual void Tick(float Seconds) override {}"), '#include "GameFramework/Actor.h"\n'))],
    "R70": [(edit(SOCKET, "\tTPimplPtr", "\tTPimplPtr<FConsacSocketState> Other;\n\tTPimplPtr"), edit(SOCKET, "TPimplPtr<", "TUniquePtr<"))],
    "R71": [(edit(COMPONENT_CPP, '#include "consac', TICKER + '#include "consac') + inside(
                "TWeakObjectPtr<UConsacComponent> Weak = this;\n\tFTSTicker::GetCoreTicker().AddTicker([Weak](float) { return Weak.IsValid(); });"),
             edit(COMPONENT_CPP, '#include "consac', TICKER + '#include "consac') + inside("FTSTicker::GetCoreTicker().AddTicker([this](float) { return true; });")),
            ([], inside("AddTicker([&](float) { return true; });")), ([], inside("UConsacComponent* Raw = this;\n\tAddTicker([Raw](float) { return true; });"))],
    "R72": [(edit("Consac.uplugin", '"FileVersion": 3,', '"FileVersion": 3,\n  "VersionName": "0.1",'), edit("Consac.uplugin", '"Default" }\n  ]', '"Default" },\n  ]')),
            ([], edit("Consac.uplugin", '"FileVersion": 3', '"FileVersion": 2')), ([], edit("Consac.uplugin", '"FriendlyName"', '"FriendName"')),
            ([], edit("Consac.uplugin", '"FileVersion": 3,', '"FileVersion": 3, "EngineVersion": "5.6.0",')), ([], edit("Consac.uplugin", '"Type": "Runtime"', '"Type": "Run"'))],
    "R73": [(edit(CORE_H, "int Step", "// check\n int checked(); int Step"), edit(CORE_H, "int Step", "int check(); int Step")), ([], edit(CORE_H, "#pragma once", "#pragma once\n#define ERROR 1"))],
    "R74": [(edit("Config/FilterPlugin.ini", "", "/Source/...\n/*.md\n"), edit("Config/FilterPlugin.ini", "", "/LICENSE\n"))],
    "R75": [(inside('const char* Folder = "Resources/Models";'), inside('const char* Folder = "../Source/Consac";')), ([], inside('const char* Folder = "C:/models";'))],
    "R76": [(inside("const FVector Place(0.0, 0.0, 0.0);"), inside("const FVector Place;")), ([], inside("const FQuat Straight;")),
            (inside("const FVector Place = FVector::ZeroVector;"), inside("const FVector Place = FVector();"))],
    "R77": [(cpp("void Limit(IConsoleVariable* Variable) { Variable->SetWithCurrentPriority(0.0f); }", includes='#include "CoreMinimal.h"\n#include "HAL/IConsoleManager.h"\n'),
             cpp("void Limit(IConsoleVariable* Variable) { Variable->Set(0.0f); }", includes='#include "CoreMinimal.h"\n#include "HAL/IConsoleManager.h"\n'))],
    "R78": [([], LOADS), (LOADS + edit("Consac.uplugin", '"Name": "Consac", "PlatformAllowList": [ "Win64", "Linux" ], "Type": "Runtime"', '"Name": "Consac", "PlatformAllowList": [ "Win64", "Linux" ], "Type": "Editor"'),
                                     LOADS)],
    "R79": [(edit(SOCKET_CPP, "\tState.Reset();", "\tif (State.IsValid())\n\t{\n\t\tState->Host.clear();\n\t}"), edit(SOCKET_CPP, "\tState.Reset();", "\tState->Host.clear();"))],
    "R80": [(fun("void Take(const FConsacFloats& Floats);", 'BlueprintCallable, Category="Consac", meta=(AutoCreateRefTerm="Floats")'),
             fun("void Take(const FConsacFloats& Floats);", 'BlueprintCallable, Category="Consac"'))],
    "R81": [(edit("Consac.uplugin", '"Name": "Consac", "PlatformAllowList": [ "Win64"', '"Name": "Consac", "PlatformAllowList": [ "Mac", "Win64"'),
             edit("Consac.uplugin", '"Name": "Consac", "PlatformAllowList": [ "Win64", "Linux" ],', '"Name": "Consac",')),
            ([], edit("Consac.uplugin", '"Name": "Consac", "PlatformAllowList": [ "Win64"', '"Name": "Consac", "PlatformAllowList": [ "Windows"'))],
    "R82": [(extra(uclass("UConsacExtra", "UWorldSubsystem", "\tUPROPERTY()\n\tTObjectPtr<UConsacSocket> Kept;"), '#include "Subsystems/WorldSubsystem.h"\n#include "UObject/ObjectPtr.h"\nclass UConsacSocket;\n'),
             extra(uclass("UConsacExtra", "UWorldSubsystem", "\tUPROPERTY()\n\tTObjectPtr<UConsacComponent> Kept;"), '#include "Subsystems/WorldSubsystem.h"\n#include "UObject/ObjectPtr.h"\nclass UConsacComponent;\n'))],
    "R83": [(cpp("void Go() { FPlatformProcess::CreateProc(nullptr, nullptr, true, true, true, nullptr, 0, nullptr, nullptr); }", includes=PROCESS),
             cpp("void Go() { FPlatformProcess::CreateProc(nullptr, nullptr, false, true, true, nullptr, 0, nullptr, nullptr); }", includes=PROCESS))],
    "R84": [(inside("Root->RegisterComponent();") + ENDS, inside("Root->RegisterComponent();")),
            (inside("Root->RegisterComponent();") + ENDS_BY_CALL,
             inside("Root->RegisterComponent();") + [(path, old, new.replace("\t\tClear();\n", "")) for path, old, new in ENDS_BY_CALL])],
    "R85": [(inside('IPluginManager::Get().FindPlugin(TEXT("Consac"))->GetBaseDir();') + PACKED + edit(BUILD, "\t\tCppStandard", '\t\tRuntimeDependencies.Add("a");\n\t\tCppStandard'),
             inside('IPluginManager::Get().FindPlugin(TEXT("Consac"))->GetBaseDir();') + PACKED)],
    "R86": [(inside("consac::Thread Other;"), inside("std::thread Other;")), ([], inside("std::async(nullptr);"))],
    "R87": [(inside("std::mutex Guard;") + edit(BUILD, "\t\tCppStandard", '\t\tPrivateDefinitions.Add("_DISABLE_CONSTEXPR_MUTEX_CONSTRUCTOR");\n\t\tCppStandard'),
             inside("std::mutex Guard;"))],
    "R88": [(extra(uclass("AConsacExtra", "AActor", "\tUPROPERTY(Transient, DuplicateTransient)\n\tTObjectPtr<UConsacSocket> Kept;"), KEEPER),
             extra(uclass("AConsacExtra", "AActor", "\tUPROPERTY(Transient)\n\tTObjectPtr<UConsacSocket> Kept;"), KEEPER)),
            (extra(uclass("AConsacExtra", "AActor", '\tUPROPERTY(EditAnywhere, Category="Consac")\n\tTObjectPtr<UConsacSocket> Kept;'), KEEPER),
             edit(COMPONENT_CPP, "\tRoot = CreateDefaultSubobject<USceneComponent>(TEXT(\"Root\"));\n", ""))],
    "A1": [(inside("GetOwner();"), inside("GetOwnerRole();")), (inside("Root->SetupAttachment(nullptr);"), inside("Root->AttachToComponent(nullptr);")),
           ([], inside("FPlatformMisc::NumberOfCores();")), ([], inside("FApp::GetBuildVersion();")), ([], inside("UE_CLOG(1);"))],
    "A2": [(cpp("", includes='#include "Misc/App.h"\n'), cpp("", includes='#include "Misc/Guid.h"\n'))],
    "A3": [([("symbols.csv", "", "FGuid,struct,Misc/Guid.h,Core,5.3-5.6,,unverified\n")], [("symbols.csv", "", "FGuid,struct,Misc/Guid.h,,5.3-5.6,,unverified\n")]),
           ([], [("symbols.csv", "", "FString,class,CoreMinimal.h,Core,5.3-5.6,,unverified\n")]), ([], [("symbols.csv", "", "FGuid,struct,Misc/Guid.h,Core,5.6,,unverified\n")]),
           ([], [("symbols.csv", "", "FGuid,struct,CoreMinimal.h,Engine,5.3-5.6,,unverified\n")]), ([], [("symbols.csv", "", "FGuid,struct\n")])],
}


def flat(which):
    return [pytest.param(rule, pair[which], id=f"{rule}-{number}") for rule, pairs in CASES.items()
            for number, pair in enumerate(pairs) if which or pair[0]]


def test_the_good_plugin_is_accepted(lint):
    assert lint() == []


@pytest.mark.parametrize("rule, changes", flat(0))
def test_an_accepted_case(lint, rule, changes):
    assert lint(changes) == []


@pytest.mark.parametrize("rule, changes", flat(1))
def test_a_rejected_case(lint, rule, changes):
    found = lint(changes)
    assert rule in {number for _, _, number, _ in found}, found
    assert all(line >= 1 and len(message) > 10 and "\n" not in message for _, line, _, message in found)


def test_every_rule_is_accounted_for():
    assert [rule.number for rule in rules.RULES] == [f"R{n}" for n in range(1, 89)] + ["A1", "A2", "A3"]
    for rule in rules.RULES:
        assert rule.title and (rule.function or rule.limit)
        if rule.function:
            assert rule.function.__name__ == rule.number.lower()
            assert rule.number in CASES, f"{rule.number} is not proven"


def test_the_table_of_rules_is_up_to_date():
    assert (ROOT / "docs/unreal-rules.md").read_text() == rules.markdown(), "run tools/unreal_lint.py --rules > docs/unreal-rules.md"


def test_rule_73_holds_for_the_core(tmp_path):
    write(tmp_path, GOOD)
    assert check.check(tmp_path, SYMBOLS, [ROOT / "core/include"]) == []


def test_the_command_prints_findings_and_fails(tmp_path):
    write(tmp_path, changed(CASES["R3"][0][1]))
    command = [sys.executable, str(ROOT / "tools/unreal_lint.py"), str(tmp_path)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 1
    assert re.search(r"ConsacTypes\.h:1: R3 no #pragma once; add it\n1 findings", result.stdout)
    write(tmp_path, GOOD)
    assert subprocess.run(command, capture_output=True).returncode == 0
    assert subprocess.run(command[:2] + [str(tmp_path / "none")], capture_output=True).returncode == 2


def words(text):
    return [(token.kind, token.text, token.line) for token in tokens.tokenize(text)]


def test_tokens_skip_comments_and_keep_lines():
    assert words("a // b \\\n c\n/* d\n*/ e") == [("word", "a", 1), ("word", "e", 4)]


def test_tokens_keep_strings_whole():
    assert [w[:2] for w in words(r"""f("a // \" b", L"/*", '"')""")] == [
        ("word", "f"), ("punct", "("), ("string", r'"a // \" b"'), ("punct", ","), ("string", 'L"/*"'), ("punct", ","),
        ("char", "'\"'"), ("punct", ")")]


def test_tokens_know_raw_strings():
    found = tokens.tokenize('R"x(a)" \n // "(b)x" c')
    assert [(t.kind, t.line) for t in found] == [("string", 1), ("word", 2)]
    assert tokens.string_value(found[0]) == 'a)" \n // "(b'


def test_tokens_know_numbers():
    assert [w[1] for w in words("1'000'000u 0x1Fp-3 .5f 1.5e+3 x1")] == ["1'000'000u", "0x1Fp-3", ".5f", "1.5e+3", "x1"]


def test_tokens_know_their_conditions():
    found = tokens.tokenize("#if A \\\n && B // c\na\n#else\nb\n#ifndef C\nc\n#endif\n#endif\nd")
    assert {t.text: t.conditions for t in found if t.kind == "word"} == {
        "a": ("A && B",), "b": ("!(A && B)",), "c": ("!(A && B)", "!defined C"), "d": ()}
    assert found[0].text == "#if A && B" and found[1].line == 3


def test_a_directive_begins_a_line():
    assert [w[0] for w in words("#define X(a) #a\n f(a # b)")] == ["directive", "word", "punct", "word", "punct", "word", "punct"]


def test_arguments_are_split_outside_of_brackets():
    found = tokens.split(tokens.tokenize("TMap<FName, int32> A, f(1, 2), b < c, d"))
    assert [tokens.spell(part) for part in found] == ["TMap<FName,int32>A", "f(1,2)", "b<c", "d"]


def test_members_are_read():
    [type_] = declarations.read_types(tokens.tokenize("""UCLASS(Abstract, meta=(DisplayName="A, B"))
        class CONSAC_API UConsacX final : public UObject, public IConsacY {
            GENERATED_BODY()
            int32 Hidden[2] = {1, 2};
        public:
            ~UConsacX();
            UFUNCTION(BlueprintCallable, Category="A|B")
            static TArray<int32> Make(const FString& Name = TEXT("a,b"), int32 Count = 3) { return {}; }
        };"""))
    assert (type_.kind, type_.name, type_.bases, type_.api) == ("UCLASS", "UConsacX", ["UObject", "IConsacY"], "CONSAC_API")
    assert type_.meta == {"DisplayName": "A, B"} and "Abstract" in type_.specifiers
    hidden, destructor, make = type_.members
    assert (hidden.name, hidden.type, hidden.array, hidden.initialised, hidden.access) == ("Hidden", "int32", True, True, "private")
    assert (destructor.name, destructor.access) == ("~UConsacX", "public")
    assert (make.name, make.type, make.words_before) == ("Make", "TArray<int32>", ("static",))
    assert [(p.type, p.name, tokens.spell(p.default)) for p in make.parameters] == [
        ("const FString&", "Name", 'TEXT("a,b")'), ("int32", "Count", "3")]


def test_the_table_of_symbols_reads_back():
    table = symbols.Table(SYMBOLS)
    assert len(table.rows) > 150 and not table.bad_lines
    assert table.by_name["UActorComponent"].include == "Components/ActorComponent.h"
    assert table.module_of["Engine/DeveloperSettings.h"] == "DeveloperSettings"


def test_a_new_symbol_has_its_page():
    # Those without one are of the table's beginning; the number only ever falls.
    assert sum(not row.page for row in symbols.Table(SYMBOLS).rows) <= 146
