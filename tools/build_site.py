#!/usr/bin/env python3
"""Builds the documentation site into build/site, from the repository's Markdown files, its public headers and the Python package.

    tools/build_site.py            build, and check every link of what was built (mkdocs-material: tools/setup.sh site)
    tools/build_site.py --pages    only write what mkdocs is given, into build/site-pages

Exit code 1 where a link leads nowhere, on a code host or in the site, or a page would fetch something from elsewhere.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys

from site_pages import built, links
from site_pages.navigation import navigation
from site_pages.tree import Tree

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGES, SITE = ROOT / "build/site-pages", ROOT / "build/site"


def tracked() -> list[str]:
    return subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()


def write(tree: Tree) -> None:
    shutil.rmtree(PAGES, ignore_errors=True)
    for name, text in tree.pages.items():
        path = PAGES / "docs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    for name in tree.pictures:
        path = PAGES / "docs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, path)
    for name in ("site.css", "iframe-worker.js"):
        shutil.copy(ROOT / "tools/site_pages" / name, PAGES / "docs" / name)
    settings = (ROOT / "tools/site_pages/mkdocs.yml").read_text(encoding="utf-8")
    (PAGES / "mkdocs.yml").write_text(settings + f"docs_dir: docs\nsite_dir: {json.dumps(str(SITE))}\nnav: {json.dumps(navigation(tree))}\n", encoding="utf-8")


def main() -> int:
    files = tracked()
    wrong = list(links.wrong(ROOT, files))
    if not wrong:
        tree = Tree(ROOT, files)
        write(tree)
        if "--pages" in sys.argv[1:]:
            return 0
        ended = subprocess.run([sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--clean", "-f", str(PAGES / "mkdocs.yml")],
                               env={**os.environ, "NO_MKDOCS_2_WARNING": "1"})
        if ended.returncode:
            return 1
        wrong = list(built.wrong(SITE))
        if not wrong:
            print(f"site: {len(tree.pages)} pages in {SITE.relative_to(ROOT)}; open {SITE.relative_to(ROOT)}/index.html")
    for line in wrong:
        print(f"site: {line}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
