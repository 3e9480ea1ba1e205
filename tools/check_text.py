#!/usr/bin/env python3
"""Fails where text from outside could become a path, a terminal's line or a tree of JSON by another way than the one
place for it (consac/base/names.h and json.h), and where a secret is compared in a time that tells of it. As far as text can tell: it knows calls, not where a string came from.
Usage: check_text.py [REPOSITORY]"""
import pathlib
import re
import sys

from check_includes import sources

PARTS = ("core", "learn", "worlds", "interop", "twin", "cad/src", "run", "cli", "engines/host", "engines/c", "engines/godot/extension/src",
         "engines/unreal/Consac/Source")
NAMED = r"(?:\bname\b|\bName\b|\bbehaviour\b|\bmodel_name\b|\bclient\b|\bid\b)(?:\(\))?"

# what is looked for, where it may stand, what to do instead
RULES = (
    (re.compile(r"\bstd::(cout|cerr|clog)\b|\b(printf|puts|putchar)\(|\bfmt::print\(|\bfputs\("
                r"|\b(fprintf|fwrite)\([^;]*\b(stdout|stderr|stream)\b"),
     {"core/src/base/hooks.cpp", "run/src/output.cpp", "cli/print.h", "cli/print.cpp",
      "cad/src/main.cpp"},  # lines for consac twin, which shows nothing that does not show
     "prints by itself; use Log, Console or cli/print.h, which show nothing that does not show"),
    (re.compile(r"[jJ]son\w*::(parse|accept|sax_parse|from_cbor|from_msgpack|from_bson|from_ubjson)\(|\bjson::parse\("),
     {"core/include/consac/base/json.h", "core/src/base/json.cpp"},
     "reads JSON by itself; use ReadJson, which bounds depth, values and time"),
    (re.compile(r"\.dump\("), {"core/include/consac/base/json.h"},
     "writes JSON by itself; use JsonText or AsciiJsonText, which no byte makes throw"),
    (re.compile(NAMED + r"\s*\+\s*(?:\"\.|TEXT\(\"\.|ConsacPlugin::ToUtf8\(Ending)|\"/\"\s*\+\s*(?!(?:consac::)?FileNameOf)[\w.\->\[\]()]*\b(name|model_name|behaviour)\b"
                r"(?!\s*\+\s*\"/(config|model)\.)(?!\w)"),
     {"core/src/base/names.cpp",
      "core/src/protocol/protocol2_spec.cpp", "core/src/space/space.cpp", "core/src/policy/demonstration.cpp", "engines/host/src/recorder.cpp", "twin/src/cad_groups.cpp",
      "cad/src/document.cpp",  # in a tree
      "engines/godot/extension/src/binding/class.cpp",  # of a method, for an error
      "run/include/consac/run/run_directory.h", "run/src/run_directory.cpp", "run/src/resume.cpp",  # CheckFolderName is there
      "run/src/find_model.cpp", "run/src/run_files.cpp", "run/src/replaced_run.cpp"},  # of a folder that was listed
     "makes a path of a name; use FileNameOf, or CheckFolderName first"),
    (re.compile(r"\b(?:token|resume_|secret)(?:\(\))?\s*[!=]=|[!=]=\s*(?:\w+(?:\.|->))*(?:token|resume_|secret)\b|\b(?:strcmp|memcmp|compare)\([^;]*\b(?:token|resume_|secret)\b"),
     {"core/src/server/secret.cpp",
      "cli/conformance_conversation.cpp"},  # which got both from the server that it judges
     "compares a secret; use SameSecret, whose time does not tell where two differ"),
)

def check_file(root: pathlib.Path, file: pathlib.Path):
    """Yields one line per fault."""
    relative = file.relative_to(root).as_posix()
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        code = re.sub(r"^\s*//.*|^\s*\*.*", "", line)
        for pattern, allowed, instead in RULES:
            if relative not in allowed and pattern.search(code):
                yield f"{relative}:{number}: '{code.strip()}' {instead}"


def check_tree(root: pathlib.Path):
    """All faults of a repository."""
    return [fault for file in sources(root, PARTS) for fault in check_file(root, file)]


if __name__ == "__main__":
    found = check_tree(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())
    print("\n".join(found) if found else "text from outside goes through one place")
    sys.exit(1 if found else 0)
