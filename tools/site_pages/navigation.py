"""The order of the pages: a section takes what lies at its places, in the order in which a reader who begins at the README comes upon it."""
import posixpath
import re

from .headers import module_of
from .links import links, title
from .tree import HOME, INDEX, PYTHON, Tree

# A page goes to the first section that it fits.
SECTIONS = (
    ("Guide", r"docs/(?!unreal|algorithms/)|python/"),
    ("Engines", r"docs/unreal|engines/"),
    ("Algorithms", r"docs/algorithms/"),
    ("Worlds", r"worlds/"),
    ("Examples", r"examples/"),
    ("Protocols and files", r"spec/"),
    ("Measured", r"bench/"),
    ("Project", r""),
)


def reading_order(tree: Tree) -> list[str]:
    """Repository pages as they are found from the README; what nothing links to comes last."""
    order = [HOME]
    for name in order:
        order += list(dict.fromkeys(tree.page_of(link.path) for link in links(name, tree.text(name))
                                    if tree.page_of(link.path) in tree.files and tree.page_of(link.path).endswith(".md") and tree.page_of(link.path) not in order))
    return order + sorted(name for name in tree.files if name.endswith(".md") and name not in order)


def navigation(tree: Tree) -> list[dict]:
    """As mkdocs takes it."""
    sections: dict[str, list[dict]] = {name: [] for name, _ in SECTIONS}
    for page in reading_order(tree)[1:]:
        section = next(name for name, place in SECTIONS if re.match(place, page))
        sections[section].append({title(tree.text(page)) or page: page})
    by_module: dict[str, list[dict]] = {}
    for header in tree.headers:
        by_module.setdefault(module_of(header), []).append({posixpath.basename(header): tree.page_of(header)})
    reference = [{"C++ headers": INDEX}, {"Python": PYTHON}, *({module: pages} for module, pages in by_module.items())]
    return [{"Home": HOME}, *({name: pages} for name, pages in sections.items() if pages and name != "Project"), {"Reference": reference}, {"Project": sections["Project"]}]
