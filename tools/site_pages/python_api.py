"""The page of the Python package: what `consac.__all__` names, by its docstrings. The package is read, not imported."""
import ast
import inspect
import pathlib

from .prose import cell, code, prose


def constant(tree: ast.Module, name: str):
    return next(node.value for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == name)


def documented(node: ast.AST) -> str:
    return prose(inspect.cleandoc(ast.get_docstring(node) or ""))


def signature(node: ast.FunctionDef, name: str = "", bound: bool = False) -> str:
    arguments = node.args
    if bound:
        arguments = ast.arguments(**{**vars(arguments), "args": arguments.args[1:]})
    text = f"{name or node.name}({ast.unparse(arguments)})" + (f" -> {ast.unparse(node.returns)}" if node.returns else "")
    if len(text) > 100:  # one argument a line, which is read more easily than looked for
        parts = split_arguments(ast.unparse(arguments))
        text = f"{name or node.name}(\n" + "".join(f"    {part},\n" for part in parts) + ")" + (f" -> {ast.unparse(node.returns)}" if node.returns else "")
    return text


def split_arguments(text: str) -> list[str]:
    parts, level, start = [], 0, 0
    for place, c in enumerate(text):
        level += {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}.get(c, 0)
        if c == "," and level == 0:
            parts.append(text[start:place].strip())
            start = place + 1
    return [*parts, text[start:].strip()]


def said_behind(node: ast.AST, source: str) -> str:
    """The comment at the end of a statement's line."""
    return source.splitlines()[node.end_lineno - 1][node.end_col_offset:].strip().removeprefix("#").strip()


def described(node: ast.AST, name: str, source: str) -> list[str]:
    if isinstance(node, ast.FunctionDef):
        return [f"## {code(name)}", "", "```python", signature(node), "```", "", documented(node), ""]
    bases = ", ".join(ast.unparse(base) for base in node.bases)
    made = next((one for one in node.body if isinstance(one, ast.FunctionDef) and one.name == "__init__"), None)
    head = f"class {signature(made, name, bound=True)}" if made and not documented_private(made) else f"class {name}" + (f"({bases})" if bases else "")
    out = [f"## {code(name)}", "", "```python", head, "```", "", documented(node), ""]
    fields = [one for one in node.body if isinstance(one, ast.AnnAssign) and not one.target.id.startswith("_")]
    if fields:
        out += ["| | | |", "|---|---|---|", *(f"| {cell(code(one.target.id))} | {cell(code(ast.unparse(one.annotation)))} | {cell(prose(said_behind(one, source)))} |"
                                            for one in fields), ""]
    for one in node.body:
        if not isinstance(one, ast.FunctionDef) or one.name.startswith("_") or not ast.get_docstring(one):
            continue
        is_property = any(ast.unparse(decorator) in ("property", "cached_property", "functools.cached_property") for decorator in one.decorator_list)
        shown = f"{one.name}: {ast.unparse(one.returns)}" if is_property and one.returns else one.name if is_property else signature(one, bound=True)
        out += [f"### {code(f'{name}.{one.name}')}", "", "```python", shown, "```", "", documented(one), ""]
    return out


def documented_private(made: ast.FunctionDef) -> bool:
    """Whether nobody but the package makes one: its arguments are of the package's own insides."""
    return any(argument.arg.startswith("_") for argument in made.args.args[1:])


def page(package: pathlib.Path) -> str:
    init = ast.parse((package / "__init__.py").read_text(encoding="utf-8"))
    lazy = ast.literal_eval(constant(init, "_LAZY"))
    errors = [alias.name for node in init.body if isinstance(node, ast.ImportFrom) and node.module == "errors" for alias in node.names]
    out = ["# Python: consac", "", documented(init), "", "How it is used: [Python](../docs/python.md).", ""]

    def find(module: str, name: str) -> list[str]:
        folder = package / module
        for path in sorted(folder.glob("*.py")) if folder.is_dir() else [package / f"{module}.py"]:
            source = path.read_text(encoding="utf-8")
            for node in ast.parse(source).body:
                if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and node.name == name:
                    return described(node, name, source)
        raise LookupError(f"consac.__all__ names {name}, which {module} does not define as a class or a function")

    for name, module in {**lazy, **dict.fromkeys(errors, "errors"), "Options": "options"}.items():
        out += find(module, name)
    return "\n".join(out) + "\n"
