#!/usr/bin/env python3
"""Writes what follows from the Unreal plugin's headers and from the graphs in engines/unreal/graphs.

  tools/unreal_docs.py           writes engines/unreal/nodes.json, docs/unreal-nodes.md, the pictures docs/images/unreal-*.svg
                                 and the pasteable graphs engines/unreal/Consac/graphs/*.txt
  tools/unreal_docs.py --check   exit code 1 where one of them is stale, or where descriptor, build files, node table,
                                 documents and graphs disagree
"""
import argparse
import json
import pathlib
import sys

from unreal_docs import agreement, graph, nodes, pages, paste, picture
from unreal_lint.model import Plugin
from unreal_stage.layout import version_of

ROOT = pathlib.Path(__file__).resolve().parents[1]
PLUGIN, GRAPHS = "engines/unreal/Consac", "engines/unreal/graphs"
DOCUMENT = "docs/unreal.md"


def written(table: dict) -> str:
    """The table as JSON, a row a line, so that a change is seen as one."""
    parts = [f' "{key}": [\n' + ",\n".join("  " + json.dumps(row, ensure_ascii=False) for row in rows) + "\n ]" for key, rows in table.items()]
    return "{\n" + ",\n".join(parts) + "\n}\n"


def produce(root: pathlib.Path, plugin: Plugin) -> tuple[dict, dict[str, str], list[str]]:
    """(node table, path -> text of every generated file, what is wrong with the graphs)."""
    table = nodes.table(plugin)
    catalogue = graph.Catalogue(table)
    files = {"engines/unreal/nodes.json": written(table), "docs/unreal-nodes.md": pages.markdown(table)}
    wrong = []
    for path in sorted((root / GRAPHS).glob("*.graph")):
        found = graph.read(path.stem, path.read_text(encoding="utf-8"), catalogue)
        faults = found.faults or picture.overlaps(found)
        wrong += [f"{GRAPHS}/{path.name}:{line}: {message}" for line, message in faults]
        if not faults:
            files[f"docs/images/unreal-{path.stem}.svg"] = picture.svg(found)
            text = paste.paste(found, catalogue)
            files[f"{PLUGIN}/graphs/{path.stem}.txt"] = text
            wrong += [f"{PLUGIN}/graphs/{path.stem}.txt: {message}" for message in paste.faults(text, catalogue)]
    return table, files, wrong


def stale(root: pathlib.Path, files: dict[str, str]) -> list[str]:
    """Generated files that differ, and files that are generated no more."""
    found = [f"{name}: differs from the headers and graphs; run tools/unreal_docs.py" for name, text in files.items()
             if not (root / name).is_file() or (root / name).read_text(encoding="utf-8") != text]
    there = [*(root / "docs/images").glob("unreal-*.svg"), *(root / PLUGIN / "graphs").glob("*.txt")]
    return found + [f"{path.relative_to(root).as_posix()}: no graph draws it; remove it" for path in there
                    if path.relative_to(root).as_posix() not in files]


def check(root: pathlib.Path) -> list[str]:
    """Everything that is stale or disagrees."""
    plugin = Plugin(root / PLUGIN)
    table, files, wrong = produce(root, plugin)
    pictures = {name.rsplit("/", 1)[-1] for name in files if name.endswith(".svg")}
    text = (root / DOCUMENT).read_text(encoding="utf-8")
    return [*wrong, *stale(root, files), *agreement.modules(plugin, version_of(root)), *agreement.thesis(table),
            *agreement.table_rows(table), *agreement.document(DOCUMENT, text, table, pictures)]


def main() -> int:
    parser = argparse.ArgumentParser(description="Writes or checks what follows from the Unreal plugin's headers.")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="the repository")
    parser.add_argument("--check", action="store_true", help="write nothing; compare")
    options = parser.parse_args()
    if options.check:
        found = check(options.root)
        print("\n".join(found) or "headers, descriptor, build files, node table, documents and graphs agree")
        return 1 if found else 0
    _, files, wrong = produce(options.root, Plugin(options.root / PLUGIN))
    for name, text in files.items():
        (options.root / name).parent.mkdir(parents=True, exist_ok=True)
        (options.root / name).write_text(text, encoding="utf-8")
    print("\n".join([*wrong, f"wrote {len(files)} files"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
