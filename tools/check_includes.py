#!/usr/bin/env python3
"""Fails on an include against the arrows: a part may include only the parts its arrow names, and inside core and
learn a module only those before it. Usage: check_includes.py [REPOSITORY]"""
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
    "engines/host": {"engines/host", "learn", "core"},
    "run": {"run", "learn", "worlds", "core"},
    "cli": {"cli", "run", "learn", "worlds", "interop", "twin", "core"},
}
# modules, lowest first
MODULES = {
    "core": ["base", "space", "nn", "model", "env", "policy", "protocol", "transport", "server"],
    "learn": ["grad", "optim", "buffer", "algo"],
}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^">]+)[">]')
EMBEDDED = ("core", "learn", "engines/host")
FORBIDDEN = re.compile(r"\b(throw|try|dynamic_cast|typeid|std::cout|std::cerr|std::stoi|std::stof|std::exit|std::abort)\b|\.at\(|\.value\(\)")


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
    if "include" in steps:
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


def check_tree(root: pathlib.Path):
    """All faults of a repository."""
    faults = []
    for part in ARROWS:
        for file in sorted((root / part).rglob("*")):
            is_test = file.name.endswith("_test.cpp") or "test" in file.relative_to(root).parts[:-1]
            if file.suffix in (".h", ".cpp") and not is_test:
                faults.extend(check_file(root, file))
    return faults


if __name__ == "__main__":
    found = check_tree(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())
    print("\n".join(found) if found else "includes follow the arrows")
    sys.exit(1 if found else 0)
