"""Whether descriptor, build files, node table, documents and graphs say the same. One line for each difference."""
import re

from unreal_lint.build import strict
from unreal_lint.model import CORE_MODULES, Plugin

from .engine import BY_NAME

# The thesis' nodes by their names there (issue of the plugin); each is a node of the table.
THESIS = ("Create Socket", "Open Socket", "Close Socket", "Check Connection", "Accept Connection", "Check Pending Data",
          "Accept Pending Data", "Send Data", "Close Connection", "Compile Environment Message", "Compile Training Data",
          "Wait And Accept Message", "Decode Action", "Setup Environment", "Training Connection", "Training", "Training Completed",
          "Load Model", "Model Connection")
COMPILES_STAGED = {"PCHUsage": "PCHUsageMode.NoPCHs", "bUseUnity": "false", "FPSemantics": "FPSemanticsMode.Precise"}
BOLD = re.compile(r"\*\*([^*\n]+)\*\*")
IMAGE = re.compile(r"\]\(images/(unreal-[\w-]+\.svg)\)")


def modules(plugin: Plugin, version: str):
    """The descriptor against the build files."""
    descriptor = strict(plugin.descriptors[0][1])
    listed = {m["Name"] for m in descriptor["Modules"]}
    builds = {build.module: build for build in plugin.builds}
    if descriptor.get("VersionName") != version:
        yield f"Consac.uplugin: VersionName is '{descriptor.get('VersionName')}', the project is {version}"
    for name in sorted(listed - set(builds)):
        yield f"Consac.uplugin: module {name} has no build file"
    for name in sorted(set(builds) - listed - set(CORE_MODULES)):
        yield f"{builds[name].path}: module {name} is not in Consac.uplugin"
    for name in sorted(listed & set(CORE_MODULES)):
        yield f"Consac.uplugin: {name} holds sources alone and can not be loaded; remove it from Modules"
    consac = builds["Consac"]
    for name in sorted(set(CORE_MODULES) - {n for n, _, _ in consac.private}):
        yield f"{consac.path}: {name} belongs into PrivateDependencyModuleNames; the sources staged from it are compiled here"
    for name, value in COMPILES_STAGED.items():
        if consac.settings.get(name) != value:
            yield f"{consac.path}: {name} must be {value}: the staged sources are compiled here"
    for build in builds.values():
        if build.module not in CORE_MODULES and build.settings.get("CppStandard") != "CppStandardVersion.Cpp20":
            yield f"{build.path}: CppStandard must be CppStandardVersion.Cpp20"


def thesis(table: dict):
    names = {row["node"] for row in table["nodes"]}
    for name in THESIS:
        if name not in names:
            yield f"nodes.json: the thesis' node '{name}' is missing"


def table_rows(table: dict):
    """What every node must have, so that a Blueprint user finds and understands it."""
    seen = set()
    for row in table["nodes"]:
        key = (row["node"], row["class"] if row["kind"] == "event" else "")
        if key in seen:
            yield f"{row['header']}: two nodes are called '{row['node']}'; give one another DisplayName"
        seen.add(key)
        if len(row["tooltip"]) < 10:
            yield f"{row['header']}: {row['function']} has no tooltip; write a /** comment */ above it"
        if not row["category"].startswith("Consac|"):
            yield f"{row['header']}: {row['function']} is in category '{row['category']}'; begin with Consac|"
        pins = {p["pin"] for p in row["pins"]}
        if "Failed" in pins and "Error" not in pins:
            yield f"{row['header']}: {row['function']} can fail and does not say why; add FString& Error"
    for row in table["properties"] + table["types"]:
        if len(row["tooltip"]) < 5:
            yield f"{row.get('header', row.get('class'))}: {row.get('property', row.get('type'))} has no tooltip; write a /** comment */ above it"


def document(name: str, text: str, table: dict, pictures: set[str]):
    """Names in bold are nodes, properties or types; pictures are drawn from graphs."""
    from .nodes import display
    known = {row["node"] for row in table["nodes"]} | {row["property"] for row in table["properties"]} | set(BY_NAME)
    known |= {display(row["type"][1:]) for row in table["types"]} | {display(v["value"]) for row in table["types"] for v in row.get("values", [])}
    known |= {display(re.sub(r"^Consac|Component$", "", row["type"][1:])) for row in table["types"]}
    known |= {"Consac " + display(re.sub(r"^Consac|Component$", "", row["type"][1:])) for row in table["types"]}
    known |= {display(p["pin"]) for row in table["nodes"] for p in row["pins"]}
    for number, line in enumerate(text.split("\n"), 1):
        for found in BOLD.findall(line):
            if found not in known:
                yield f"{name}:{number}: '{found}' is no node, pin, property or type of the plugin"
        for found in IMAGE.findall(line):
            if found not in pictures:
                yield f"{name}:{number}: there is no graph for the picture {found}"
    for picture in sorted(pictures - set(IMAGE.findall(text))):
        yield f"{name}: shows no picture {picture}"
