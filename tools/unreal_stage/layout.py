"""What lies where in the plugin after staging: path in the plugin -> bytes. Nothing is written here.

ConsacCore and ConsacLearn hold sources and are of type External: Unreal compiles nothing in them. The module Consac
compiles them, by one small file for each source in Private/Staged: so every function is linked in the one binary that
calls it, and no header of core needs an export macro (docs/unreal.md, "How it is linked")."""
import hashlib
import pathlib
import re

from version import version_of  # tools/version.py

from . import third_party
from .third_party import LIBRARIES, Missing

MODULES = {"ConsacCore": ("core",), "ConsacLearn": ("learn", "engines/host")}
# Worlds that an agent in the engine is in too, and what they stand on; by the paths of the repository, below ConsacLearn's Private.
WORLDS = ("worlds/batched.h", "worlds/robot_reach", "worlds/yumi_reach")
STAGED = "Source/Consac/Private/Staged"
THIRD_PARTY = "Source/ConsacCore/ThirdParty"
FOLDERS = tuple(f"Source/{module}" for module in MODULES) + (STAGED,)
MANIFEST = "MANIFEST.sha256"
NOTICE = "// Copyright CONSAC authors. MIT License.\n// Written by tools/stage_unreal.py; the next staging overwrites it.\n"

PRAGMAS = """#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF  // as in the trainer: the same kernels give the same bits
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#pragma warning(disable : 4668 4191)  // inside Windows' own headers: macros that #if finds undefined, casts of functions
#endif
// The project's own builds define this, and have no warning. What a newer compiler finds must not stop a game's build.
#if !defined(CONSAC_ALL_WARNINGS)
#if defined(__clang__)
#pragma clang diagnostic ignored "-Wall"
#pragma clang diagnostic ignored "-Wextra"
#pragma clang diagnostic ignored "-Wshadow"
#pragma clang diagnostic ignored "-Wundef"
#elif defined(_MSC_VER)
#pragma warning(push, 0)
#pragma warning(disable : 4668 4191 4702)  // which this level does not silence everywhere
#endif
#endif
"""


def sources_of(root: pathlib.Path) -> dict[str, pathlib.Path]:
    """path in the plugin -> file of the repository, of everything of ours that is copied."""
    found: dict[str, pathlib.Path] = {}
    for module, parts in MODULES.items():
        for part in parts:
            for folder, place in (("include", "Public"), ("src", "Private")):
                base = root / part / folder
                for path in sorted(base.rglob("*")):
                    if path.suffix in (".h", ".cpp"):
                        target = f"Source/{module}/{place}/{path.relative_to(base).as_posix()}"
                        if target in found:
                            raise Missing(f"{path} and {found[target]} would both be {target}; rename one")
                        found[target] = path
    for path in world_files(root):
        found[f"Source/ConsacLearn/Private/{path.relative_to(root).as_posix()}"] = path
    return found


def world_files(root: pathlib.Path) -> list[pathlib.Path]:
    """The files of WORLDS without their tests."""
    named = [root / name for name in WORLDS]
    found = [path for place in named for path in (sorted(place.iterdir()) if place.is_dir() else [place])]
    return [path for path in found if path.suffix in (".h", ".cpp") and not path.name.endswith("_test.cpp")]


def cmake_words(path: pathlib.Path, pattern: str) -> list[str]:
    found = re.search(pattern, path.read_text(encoding="utf-8"), re.S)
    if not found:
        raise Missing(f"{path} no longer says '{pattern}'; correct tools/unreal_stage/layout.py")
    return found.group(1).split()


def prefix(root: pathlib.Path) -> bytes:
    """The header in front of every compiled source: the definitions that CMake gives too."""
    everywhere = cmake_words(root / "CMakeLists.txt", r"set\(CONSAC_EMBED_DEFINITIONS ([^)]*)\)")
    windows = cmake_words(root / "core/CMakeLists.txt", r"if\(WIN32\)\s*target_compile_definitions\(consac_core PRIVATE ([^)]*)\)")

    def define(word: str) -> str:
        name, _, value = word.partition("=")
        return f"#ifndef {name}\n#define {name}{' ' + value if value else ''}\n#endif\n"

    text = NOTICE + "\n#pragma once\n// What every staged source is compiled with. No header of Unreal comes before or after this one.\n"
    text += "// Another plugin may bring its own copy of these libraries into one game: ours go by names of their own.\n"
    text += "".join(f"#define {name} consac_{name}\n" for name in third_party.NAMES)
    text += "".join(map(define, everywhere))
    text += "#if defined(_WIN32)\n" + "".join(map(define, windows)) + "#endif\n"
    text += PRAGMAS
    return text.encode()


def wrapper(module: str, name: str) -> tuple[str, bytes]:
    """(path, text) of the file that compiles one staged source; its name is unique in the module Consac."""
    flat = re.sub(r"\W+", "_", re.sub(r"^(Private|ThirdParty/\w+)/", "", name).rsplit(".", 1)[0])
    text = f'{NOTICE}\n#include "ConsacStaged.h"\n\n#include "../../../{module}/{name}"\n'
    return f"{STAGED}/{module}_{flat}.cpp", text.encode()


def build_file(module: str, root: pathlib.Path) -> bytes:
    folders = ['"Public"', '"Private"']
    system, libraries, depends = [], [], []
    if module == "ConsacCore":
        system = [f'"ThirdParty", "{library.name}"' for library in LIBRARIES]
        libraries = cmake_words(root / "core/CMakeLists.txt", r"target_link_libraries\(consac_core PUBLIC (ws2_32[^)]*)\)")
    else:
        depends = ["ConsacCore"]
    lines = [*NOTICE.splitlines(), "using System.IO;", "using UnrealBuildTool;", "",
             "// Sources alone: the module Consac compiles them.",
             f"public class {module} : ModuleRules", "{",
             f"\tpublic {module}(ReadOnlyTargetRules Target) : base(Target)", "\t{",
             "\t\tType = ModuleType.External;", "\t\tPCHUsage = PCHUsageMode.NoPCHs;",
             "\t\tCppStandard = CppStandardVersion.Cpp20;"]
    lines += [f'\t\tPublicDependencyModuleNames.Add("{name}");' for name in depends]
    lines += [f"\t\tPublicIncludePaths.Add(Path.Combine(ModuleDirectory, {folder}));" for folder in folders]
    lines += [f"\t\tPublicSystemIncludePaths.Add(Path.Combine(ModuleDirectory, {folder}));" for folder in system]
    if libraries:
        lines += ["\t\tif (Target.Platform == UnrealTargetPlatform.Win64)", "\t\t{",
                  *(f'\t\t\tPublicSystemLibraries.Add("{name}.lib");' for name in libraries), "\t\t}"]
    return "\n".join([*lines, "\t}", "}", ""]).encode()


def third_party_files(sources: list[bytes], root: pathlib.Path, system: pathlib.Path) -> dict[str, bytes]:
    found, licences = third_party.gather(sources, system, root / "build/windows-needs")
    files = {f"{THIRD_PARTY}/{third_party.library_of(name).name}/{name}": text for name, text in found.items()}
    for name, text in files.items():
        third_party.refuse_copyleft(name, text)
    table = "What CONSAC stands on. Each folder has its licence.\n\n"
    for library in LIBRARIES:
        files[f"{THIRD_PARTY}/{library.name}/LICENSE.txt"] = third_party.debian_copyright(library)
        table += f"{library.name} {third_party.version(library)}: {library.what}\n"
    table += "\nChanged: " + ", ".join(third_party.CUTS) + " starts nothing while Windows loads the plugin; each asio::io_context starts Winsock.\n"
    for name, text in licences.items():
        files[f"{THIRD_PARTY}/highway/{name}"] = text
    files[f"{THIRD_PARTY}/README.txt"] = table.encode()
    return files


def manifest(files: dict[str, bytes], folder: str) -> bytes:
    """Lines that sha256sum -c reads, of a folder's files."""
    names = sorted(name for name in files if name.startswith(folder + "/") and not name.endswith("/" + MANIFEST))
    return "".join(f"{hashlib.sha256(files[n]).hexdigest()}  {n.removeprefix(folder + '/')}\n" for n in names).encode()


def plan(root: pathlib.Path, system: pathlib.Path) -> dict[str, bytes]:
    """Everything that staging writes."""
    ours = sources_of(root)
    files = {name: path.read_bytes() for name, path in ours.items()}
    files |= third_party_files(list(files.values()), root, system)
    files[f"{STAGED}/ConsacStaged.h"] = prefix(root)
    for name in sorted(files):
        module, _, inner = name.removeprefix("Source/").partition("/")
        if module in MODULES and inner.endswith((".cpp", ".cc")):
            path, text = wrapper(module, inner)
            if path in files:
                raise Missing(f"two sources would be compiled by {path}; rename one")
            files[path] = text
    for module in MODULES:
        files[f"Source/{module}/{module}.Build.cs"] = build_file(module, root)
        files[f"Source/{module}/VERSION.txt"] = (version_of(root) + "\n").encode()
    for folder in FOLDERS:
        files[f"{folder}/{MANIFEST}"] = manifest(files, folder)
    return files
