#!/usr/bin/env python3
"""Writes what Unreal's header tool would: a <Name>.generated.h for every reflected header of a plugin, and one source that
takes the address of every UFUNCTION, so that one without a definition does not link, and registers every subsystem.

  generate.py PLUGIN_FOLDER OUTPUT_FOLDER
"""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "tools"))
from unreal_lint.model import Plugin  # noqa: E402


def class_body(type_) -> list[str]:
    """What GENERATED_BODY stands for in a UCLASS; access is private after it, as in Unreal."""
    own = any(member.name == type_.name for member in type_.members)
    base = type_.bases[0]
    return ["public:", f"using Super = {base};", f"using ThisClass = {type_.name};",
            f"{type_.name}(const {type_.name}&) = delete;", f"{type_.name}& operator=(const {type_.name}&) = delete;",
            *native_events(type_), *([] if own else [f"{type_.name}() = default;"]),
            f"explicit {type_.name}(FVTableHelper& helper) : Super(helper) {{}}",
            f"virtual void ShimReferences(Shim::References& references) const override {{ Super::ShimReferences(references); {added(type_)} }}",
            f"void ShimLoad(const {type_.name}& saved) {{ (void)saved; {kept(type_)} }}",
            f'static UClass* StaticClass() {{ static UClass made("{type_.name}", {base}::StaticClass()); return &made; }}',
            "friend struct ShimAddresses;", "virtual UClass* ShimClass() const override { return StaticClass(); }", "private:"]


def event_parts(member) -> tuple[str, str, str]:
    """(parameters, arguments, const) of an event as the header writes them."""
    parameters = ", ".join(f"{parameter.type} {parameter.name}" for parameter in member.parameters)
    return parameters, ", ".join(parameter.name for parameter in member.parameters), " const" if "const" in member.words_after else ""


def native_events(type_) -> list[str]:
    """What the header tool declares for each BlueprintNativeEvent, and where a test puts what a Blueprint overrides it with."""
    lines = []
    for member in type_.members:
        if member.kind == "UFUNCTION" and member.has("BlueprintNativeEvent"):
            parameters, _, const = event_parts(member)
            lines += [f"virtual {member.type} {member.name}_Implementation({parameters}){const};",
                      f"std::function<{member.type}({parameters})> shim_blueprint_{member.name};"]
    return lines


def added(type_) -> str:
    """Says what a type's reflected members keep alive."""
    return " ".join(f"references.Add({member.name});" for member in type_.members if member.kind == "UPROPERTY")


def kept(type_) -> str:
    """What comes back of an object that was saved: its reflected members that are not Transient."""
    return " ".join(f"{member.name} = saved.{member.name};" for member in type_.members
                    if member.kind == "UPROPERTY" and not member.has("Transient"))


def generated_header(file) -> str:
    file_id = "SHIM_" + re.sub(r"\W", "_", file.name).upper()
    lines = ["#pragma once", "#undef CURRENT_FILE_ID", f"#define CURRENT_FILE_ID {file_id}"]
    for type_ in file.types:
        for token in type_.body:
            if token.kind == "word" and token.text == "GENERATED_BODY":
                body = class_body(type_) if type_.kind == "UCLASS" else [
                    f"template <class R> void ShimReferences(R& references) const {{ (void)references; {added(type_)} }}"]
                lines.append(f"#define {file_id}_{token.line}_GENERATED_BODY " + " ".join(body))
    return "\n".join(lines) + "\n"


def bases(plugin: Plugin, type_):
    while type_.bases:
        yield type_.bases[0]
        if type_.bases[0] not in plugin.by_name:
            return
        type_ = plugin.by_name[type_.bases[0]]


def source_of(plugin: Plugin) -> str:
    includes, lines, bodies = set(), [], []
    for file, type_ in plugin.types:
        if type_.kind != "UCLASS":
            continue
        includes.add(file.name)
        lines.append(f"Shim::AddReflected(&HotReloaded<{type_.name}>);")
        lines.append(f"Shim::AddCopier({type_.name}::StaticClass(), {{&Made<{type_.name}>, &Loaded<{type_.name}>}});")
        for member in type_.members:
            if member.kind != "UFUNCTION":
                continue
            if member.has("BlueprintImplementableEvent"):
                raise SystemExit(f"{file.path}:{member.line}: the shim has no events without a body; use BlueprintNativeEvent or a delegate")
            if member.has("BlueprintNativeEvent"):
                parameters, arguments, const = event_parts(member)
                bodies.append(f"{member.type} {type_.name}::{member.name}({parameters}){const} {{\n  return shim_blueprint_{member.name} ? "
                              f"shim_blueprint_{member.name}({arguments}) : {member.name}_Implementation({arguments});\n}}")
            includes.add(file.name)
            lines.append(f"Addressed(&{type_.name}::{member.name});")
        for base in {"UGameInstanceSubsystem", "UWorldSubsystem"} & set(bases(plugin, type_)):
            lines.append(f"Shim::AddSubsystem([]() -> {base}* {{ return new {type_.name}(); }});")
    body, thunks = "\n".join(f"    {line}" for line in lines), "\n".join(bodies)
    return "\n".join([f'#include "{name}"' for name in sorted(includes)]) + f"""
#include "Shim/Runtime.h"
#include "Subsystems/GameInstanceSubsystem.h"
#include "Subsystems/WorldSubsystem.h"
#include "UObject/UObjectGlobals.h"

// Events that a Blueprint may override.
{thunks}

/// A friend of every reflected class.
struct ShimAddresses {{
  template <class T>
  static void Addressed(T function) {{
    [[maybe_unused]] static volatile T kept = function;
  }}
  template <class T>
  static void HotReloaded() {{
    if constexpr (!std::is_abstract_v<T>) {{
      FVTableHelper helper;
      std::unique_ptr<UObject> made(new T(helper));
      made->BeginDestroy();
    }}
  }}
  template <class T>
  static UObject* Made(UObject* outer) {{
    if constexpr (std::is_abstract_v<T>) return nullptr;
    else return NewObject<T>(outer);
  }}
  template <class T>
  static void Loaded(UObject& into, const UObject& saved) {{
    static_cast<T&>(into).ShimLoad(static_cast<const T&>(saved));
  }}
  static bool Take() {{
{body}
    return true;
  }}
}};
bool ShimGenerated() {{
  static const bool done = ShimAddresses::Take();
  return done;
}}
"""


def main() -> None:
    plugin, out = Plugin(pathlib.Path(sys.argv[1])), pathlib.Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    files = {"generated.cpp": source_of(plugin)}
    for file in plugin.written:
        if file.is_header and any(type_.kind for type_ in file.types):
            files[file.name.removesuffix(".h") + ".generated.h"] = generated_header(file)
    for name, text in files.items():
        path = out / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
