#!/usr/bin/env python3
"""Fails on an include against the arrows: a part may include only the parts its arrow names, and inside core and
learn a module only those before it. And on a thread or a descriptor that is taken past the one place whose failure is
a Status. Usage: check_includes.py [REPOSITORY]"""
import pathlib
import re
import sys

# part -> parts it may include, itself included
ARROWS = {
    "core": {"core"},
    "learn": {"learn", "core"},
    "worlds": {"worlds", "core"},
    "interop": {"interop", "core"},
    "twin": {"twin", "core"},
    "cad": {"cad", "twin", "core"},
    "engines/host": {"engines/host", "learn", "core"},
    "engines/c": {"engines/c", "engines/host", "learn", "core"},
    "run": {"run", "learn", "worlds", "core"},
    "cli": {"cli", "run", "learn", "worlds", "interop", "twin", "core"},
}
# modules, lowest first
MODULES = {
    "core": ["base", "robot", "space", "nn", "model", "env", "policy", "protocol", "transport", "server"],
    "learn": ["grad", "optim", "buffer", "collect", "algo", "log"],
}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^">]+)[">]')
EMBEDDED = ("core", "learn", "engines/host")
FORBIDDEN = re.compile(r"\b(throw|try|dynamic_cast|typeid|std::cout|std::cerr|std::stoi|std::stof|std::exit|std::abort)\b|\.at\(|\.value\(\)")
# What may fail where the system has no more of it: (how it is taken, the only files that may, what to use instead)
SCARCE = [
    (re.compile(r"\bstd::(thread\b(?!::)|jthread\b|async\b)|\bpthread_create\b|\b_beginthread"),
     ("core/src/base/thread.cpp",), "start it by consac::Thread, which may fail with a Status"),
    (re.compile(r"\basio::io_context\b|::socket\(|\baccept4?\(|\beventfd\("),
     ("core/src/transport/tcp.cpp",), "connect and accept by Transport and Listener, which may fail with a Status"),
    (re.compile(r"\bmemfd_create\b|\bshm_open\b"),
     ("core/src/transport/shared_memory_memfd.cpp", "core/src/transport/shared_memory_posix.cpp", "core/src/base/linux_calls.h"),
     "share memory by SharedRegion, which may fail with a Status"),
    (re.compile(r"\bstd::(o|i)?fstream\b|\bfopen\("),
     ("core/src/base/file.cpp", "cli/machine.cpp"), "read and write files by base/file.h or OutputFile, which may fail with a Status"),
]


def part_and_module(path: str):
    """Which part and module an include path or a file belongs to."""
    steps = path.split("/")
    if steps[0] == "consac" and steps[1] == "host":
        return "engines/host", None
    if steps[0] == "consac":
        if steps[1] in ("learn", "run", "interop", "twin"):
            return steps[1], steps[2] if len(steps) > 3 else None
        return "core", steps[1] if len(steps) > 2 else None
    if steps[0] in ARROWS:
        return steps[0], None
    return None, None


def module_of_file(file: pathlib.PurePath):
    """(part, module) of a source file."""
    steps = file.parts
    part = "/".join(steps[:2]) if steps[0] == "engines" else steps[0]
    if "include" in steps and "consac" in steps:
        rest = steps[steps.index("consac") + 1:]
        rest = rest[1:] if part != "core" else rest
        return part, rest[0] if len(rest) > 1 else None
    if "src" in steps:
        rest = steps[steps.index("src") + 1:]
        return part, rest[0] if len(rest) > 1 else None
    return part, None


def check_file(root: pathlib.Path, file: pathlib.Path):
    """Yields one line per fault."""
    relative = file.relative_to(root)
    part, module = module_of_file(relative)
    order = MODULES.get(part, [])
    for number, line in enumerate(file.read_text().splitlines(), 1):
        where = f"{relative}:{number}"
        code = line.split("//")[0]
        if part in EMBEDDED and FORBIDDEN.search(re.sub(r'"[^"]*"', '""', code)):
            yield f"{where}: '{code.strip()}' cannot live in an engine (no exceptions, no RTTI, no printing)"
        for taken, places, instead in SCARCE:
            if taken.search(re.sub(r'"[^"]*"', '""', code)) and str(relative) not in places:
                yield f"{where}: '{code.strip()}': {instead}"
        match = INCLUDE.match(line)
        if not match:
            continue
        target, target_module = part_and_module(match.group(1))
        if target is None:
            continue
        if target not in ARROWS[part]:
            yield f"{where}: {part} may not include {target} ('{match.group(1)}')"
        elif target == part and module in order and target_module in order and order.index(target_module) > order.index(module):
            yield f"{where}: module {module} may not include {target_module}, which stands above it"


def sources(root: pathlib.Path, parts):
    """The C++ files of `parts` that are no tests."""
    for part in parts:
        for file in sorted((root / part).rglob("*")):
            is_test = file.name.endswith("_test.cpp") or {"test", "ConsacTests"} & set(file.relative_to(root).parts[:-1])
            if file.suffix in (".h", ".cpp") and not is_test:
                yield file


def check_tree(root: pathlib.Path):
    """All faults of a repository."""
    return [fault for file in sources(root, ARROWS) for fault in check_file(root, file)]


if __name__ == "__main__":
    found = check_tree(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())
    print("\n".join(found) if found else "includes follow the arrows")
    sys.exit(1 if found else 0)
