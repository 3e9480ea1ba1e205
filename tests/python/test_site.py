"""The documentation: links of all Markdown files, and the pages that tools/build_site.py makes of headers and docstrings. Needs no mkdocs."""
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from site_pages import built, headers, links, prose, tree  # noqa: E402
from site_pages.navigation import navigation  # noqa: E402

FILES = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()


@pytest.fixture(scope="module")
def whole():
    return tree.Tree(ROOT, FILES)


def test_every_link_of_every_page_leads_somewhere():
    assert list(links.wrong(ROOT, FILES)) == []


@pytest.mark.parametrize("text, told", [
    ("[a](other.md)", None), ("[a](other.md#two-words)", None), ("[a](#here)", None), ("[a](folder)", None), ("`[a](nowhere.md)`", None),
    ("```\n[a](nowhere.md)\n```", None), ("[a](https://example.org/x.md)", None), ("[a](other.md#the-same-1)", None),
    ("[a](nowhere.md)", "page.md:3: nowhere.md leads to no file"), ("![a](folder/no.png)", "page.md:3: folder/no.png leads to no file"),
    ("[a](other.md#three)", "other.md has no heading"), ("[a](#there)", "page.md has no heading"), ("[a](other.md#the-same-2)", "no heading")])
def test_a_link_that_leads_nowhere_is_told(tmp_path, text, told):
    (tmp_path / "page.md").write_text(f"# Here\n\n{text}\n")
    (tmp_path / "other.md").write_text("# Two `words`\n## The same\n## The same\n")
    said = list(links.wrong(tmp_path, ["page.md", "other.md", "folder/file.h"]))
    assert (told is None and said == []) or (told is not None and len(said) == 1 and told in said[0])


def plain(text):
    """Letters and digits alone, as the reader sees them."""
    return re.sub(r"\W|_", "", text.replace("&lt;", "").replace("&gt;", ""))


@pytest.mark.parametrize("path", tree.Tree(ROOT, FILES).headers)
def test_a_headers_page_says_all_that_its_comments_say(whole, path):
    """Of what users may call. Declarations without a word are either destructors and their kind, or fields whose name says it."""
    shown = plain(whole.pages[whole.page_of(path)])
    public, missing = True, []
    for line in (ROOT / path).read_text().splitlines():
        if re.match(r"\S", line):
            public = True
        public = {"private:": False, "public:": True, "protected:": True}.get(line.strip(), public)
        said = re.search(r"///<? ?(.*)$", line)
        if public and said and not plain(said[1]) in shown:
            missing.append(line.strip())
    assert missing == []


def test_overloads_stand_together_and_private_things_nowhere():
    page = headers.page("core/include/consac/a/b.h", """#pragma once
// What it is.

#include <span>

namespace consac::a {

/// Sizes of [B, n_steps].
struct Sizes {
  int rows = 0;                                     ///< how many
  std::function<bool(int rows)> sane = nullptr;     ///< | asks *nobody*
  void (*told)(int) = nullptr;                      ///< called
};

/// Does.
class Thing {
 public:
  ~Thing();
  Thing(Thing&&) noexcept;
  /// By number.
  int Do(int number) { return number; }
  /// By name.
  int Do(const char* name);

 private:
  /// Secret.
  int hidden_;
};

inline constexpr int kMost = 3;  ///< of them

}  // namespace consac::a
""")
    assert page.count("### `Do`") == 1 and "int Do(int number);\n" in page and "int Do(const char* name);" in page
    assert "Secret" not in page and "hidden_" not in page and "~Thing" not in page and "Thing(Thing" not in page
    assert "| `std::function<bool(int rows)> sane = nullptr` | \\| asks \\*nobody\\* |" in page and "`void (*told)(int) = nullptr`" in page
    assert "Sizes of `[B, n_steps]`." in page and '#include "consac/a/b.h"  // namespace consac::a' in page
    assert "| `inline constexpr int kMost = 3` | of them |" in page


def test_comments_are_no_markup():
    assert prose.prose("a * b <c> of row_bytes:\n  shown(as, it_is);\nkept `a_b*` [0, n)") == \
        "a \\* b &lt;c&gt; of `row_bytes`:\n\n```cpp\nshown(as, it_is);\n```\n\nkept `a_b*` `[0, n)`"


def test_a_paragraph_that_hangs_is_no_example():
    assert prose.prose("Rows.  A row is\n       bytes.\nUnits. Seconds.\n\nUse:\n  do(it);\nthen stop") == \
        "**Rows.** A row is\nbytes.\n\n**Units.** Seconds.\n\nUse:\n\n```cpp\ndo(it);\n```\n\nthen stop"


def test_c_is_read_too():
    page = headers.page("engines/c/include/consac.h", """// What it is.
#ifndef CONSAC_H
#define CONSAC_H
#ifdef __cplusplus
extern "C" {
#endif

/// What came of it.
typedef int32_t consac_status;
enum {
  CONSAC_OK = 0,
  CONSAC_NOT_FOUND = 2,  ///< no such file
};

/// A row.
typedef struct {
  size_t size;  ///< of this
} consac_row;

/// Frees it.
CONSAC_API void consac_free(consac_row* row);

#ifdef __cplusplus
}
#endif
#endif
""")
    assert "## `consac_status`" in page and "| `CONSAC_NOT_FOUND = 2` | no such file |" in page and "| `CONSAC_OK = 0` |" in page and "`enum`" not in page and "``" not in page.replace("```", "")
    assert "## `consac_row`" in page and "| `size_t size` | of this |" in page
    assert "## `consac_free`\n\n```cpp\nCONSAC_API void consac_free(consac_row* row);\n```\n\nFrees it." in page


def test_pythons_page_has_what_the_package_names(whole):
    names = {name for name in re.findall(r"^## `(\w+)`$", whole.pages[tree.PYTHON], re.M)}
    sys.path.insert(0, str(ROOT / "python"))
    import consac
    assert names == set(consac.__all__) - {"__version__", "serve"} | {"Options"}


def test_every_page_is_in_the_navigation_once(whole):
    def pages(part):
        return [part] if isinstance(part, str) else [page for inner in (part if isinstance(part, list) else part.values()) for page in pages(inner)]
    named = pages(navigation(whole))
    assert len(named) == len(set(named)) and set(named) <= set(whole.pages)
    assert {name for name in whole.files if name.endswith(".md")} <= set(named)
    assert named[0] == "README.md"


def test_python_markdown_reads_lists_as_code_hosts_do():
    assert tree.as_markdown_of_python("Said:\n- one\n  more\n  - inner\n\n   ```sh\n   run\n   ```\n\nAs code:\n\n    run\n") == \
        "Said:\n\n- one\n    more\n    - inner\n\n    ```sh\n    run\n    ```\n\nAs code:\n\n    run\n"


@pytest.mark.parametrize("text, told", [
    ('<a href="b.html#there">', None), ('<a href="https://example.org/">', None), ('<a href="b.html#here">', "no such name"), ('<img src="c.png">', "leads to no file"),
    ('<script src="https://example.org/x.js">', "fetches"), ('<link href="//example.org/font.css">', "fetches")])
def test_what_is_wrong_in_a_built_site_is_told(tmp_path, text, told):
    (tmp_path / "a.html").write_text(text)
    (tmp_path / "b.html").write_text('<h1 id="there">')
    said = list(built.wrong(tmp_path))
    assert (told is None and said == []) or (told is not None and len(said) == 1 and told in said[0])
