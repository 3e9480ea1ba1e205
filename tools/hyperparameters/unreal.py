"""ConsacHyperparameters.h and .cpp: for each algorithm a data asset with a property for each hyperparameter."""
import math
import textwrap
from decimal import Decimal

from .table import Algorithm, Row, pascal

HEAD = "// Copyright CONSAC authors. MIT License.\n// Written by tools/generate_hyperparameters.py from the program's own table; do not edit.\n\n"
CATEGORY = 'Category="Consac|Hyperparameters"'


def enum_names(algorithms: list[Algorithm]) -> dict[tuple[str, ...], str]:
    """choices -> name of their enum, which is the name of the first hyperparameter that offers them."""
    names: dict[tuple[str, ...], str] = {}
    for algorithm in algorithms:
        for row in algorithm.rows:
            if row.kind == "choice" and row.choices not in names:
                name = "EConsac" + pascal(row.name)
                names[row.choices] = name if name not in names.values() else f"EConsac{pascal(algorithm.name)}{pascal(row.name)}"
    return names


def enumerator(choice: str) -> str:
    return pascal(choice) if choice[:1].isalpha() else "N" + pascal(choice)


def comment(text: str, indent: str = "") -> str:
    text = text.replace("*/", "* /")
    if len(text) < 108:
        return f"{indent}/** {text} */\n"
    lines = textwrap.wrap(text, 112)
    return f"{indent}/**\n" + "".join(f"{indent} * {line}\n" for line in lines) + f"{indent} */\n"


def real(text: str) -> str:
    value = "0" if text == "none" else text
    return value if any(c in value for c in ".eE") else value + ".0"


def bound(value: float) -> str:
    return str(int(value)) if value == int(value) else repr(value)


def clamp(row: Row) -> list[str]:
    # Without an exponent, which the header tool does not know.
    return [f'{name}="{Decimal(bound(value)):f}"' for name, value in (("ClampMin", row.low), ("ClampMax", row.high)) if not math.isinf(value)]


def property_name(row: Row) -> str:
    return ("b" if row.kind == "boolean" else "") + pascal(row.name)


def default(row: Row, enums: dict) -> str:
    """'= value' of the property."""
    if row.kind == "boolean":
        return row.default
    if row.kind == "choice":
        return f"{enums[row.choices]}::{enumerator(row.default)}"
    if row.kind == "text":
        return f'TEXT("{row.default}")'
    if row.kind == "integer":
        return str(max(int(float(row.default)), 0)) if row.default != "none" else bound(max(row.low, 0))
    if row.kind == "schedule":
        linear = row.default.startswith("lin_")
        return f"FConsacSchedule({real(row.default.removeprefix('lin_'))}, {'true' if linear else 'false'})"
    return real(row.default)


def type_of(row: Row, enums: dict) -> str:
    return {"boolean": "bool", "integer": "int32", "real": "double", "schedule": "FConsacSchedule", "text": "FString",
            "choice": enums.get(row.choices, "")}[row.kind]


def declaration(row: Row, enums: dict) -> str:
    out, meta = "", clamp(row) if row.kind in ("real", "integer") else []
    if row.optional:
        toggle = f"bSet{pascal(row.name)}"
        out += comment(f"Whether {row.name} is set at all.", "\t")
        out += f"\tUPROPERTY(EditAnywhere, BlueprintReadWrite, {CATEGORY}, meta=(InlineEditConditionToggle))\n"
        out += f"\tbool {toggle} = {'false' if row.default == 'none' else 'true'};\n\n"
        meta.append(f'EditCondition="{toggle}"')
    ending = f", meta=({', '.join(meta)})" if meta else ""
    out += comment(row.tooltip, "\t")
    out += f"\tUPROPERTY(EditAnywhere, BlueprintReadWrite, {CATEGORY}{ending})\n"
    return out + f"\t{type_of(row, enums)} {property_name(row)} = {default(row, enums)};\n\n"


SCHEDULE = """/** A number that stays, or goes down to nothing over the training. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacSchedule
{
	GENERATED_BODY()

	FConsacSchedule() = default;
	FConsacSchedule(double InValue, bool bInLinear) : Value(InValue), bLinear(bInLinear) {}

	/** The value; at the start, where it goes down. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	double Value = 0.0;

	/** Times the part of the training that is left: 1 at its start, 0 at its end. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bLinear = false;
};

"""


def class_name(algorithm: Algorithm) -> str:
    return f"UConsac{pascal(algorithm.name)}Hyperparameters"


def header(algorithms: list[Algorithm]) -> str:
    enums = enum_names(algorithms)
    out = HEAD + '#pragma once\n\n#include "CoreMinimal.h"\n#include "ConsacHyperparametersBase.h"\n#include "ConsacHyperparameters.generated.h"\n\n'
    for choices, name in enums.items():
        out += comment(f"What {name[1:].removeprefix('Consac')} may be.") + f"UENUM(BlueprintType)\nenum class {name} : uint8\n{{\n"
        out += ",\n".join(f'\t{enumerator(choice)} UMETA(DisplayName="{choice}")' for choice in choices) + "\n};\n\n"
    out += SCHEDULE
    for algorithm in algorithms:
        out += comment(f"Hyperparameters of {algorithm.name}: {algorithm.what}.")
        out += f"UCLASS(BlueprintType)\nclass CONSAC_API {class_name(algorithm)} : public UConsacHyperparameters\n{{\n\tGENERATED_BODY()\n\npublic:\n"
        out += "".join(declaration(row, enums) for row in algorithm.rows)
        out += "\tvirtual FString GetAlgorithm() const override;\n\tvirtual void Collect(TArray<FConsacHyperparameter>& Into) const override;\n};\n\n"
    return out.rstrip("\n") + "\n"


ADD = {"boolean": "AddBoolean", "integer": "AddInteger", "real": "AddReal"}


def collect(row: Row) -> str:
    """The statement that adds a property as the program reads it."""
    name = property_name(row)
    value = f"ConsacTextOf({name})" if row.kind in ("schedule", "choice") else name
    add = f'{ADD.get(row.kind, "AddText")}(Into, TEXT("{row.name}"), {value});'
    if not row.optional:
        return f"\t{add}\n"
    none = f'AddText(Into, TEXT("{row.name}"), TEXT("none"));'
    return f"\tif (bSet{pascal(row.name)})\n\t{{\n\t\t{add}\n\t}}\n\telse\n\t{{\n\t\t{none}\n\t}}\n"


HELPERS = """namespace
{
FString ConsacTextOf(const FConsacSchedule& Schedule)
{
	return FString::Printf(TEXT("%s%.17g"), Schedule.bLinear ? TEXT("lin_") : TEXT(""), Schedule.Value);
}

"""


def source(algorithms: list[Algorithm]) -> str:
    out = HEAD + '#include "ConsacHyperparameters.h"\n\n' + HELPERS
    for choices, name in enum_names(algorithms).items():
        out += f"FString ConsacTextOf({name} Value)\n{{\n\tswitch (Value)\n\t{{\n"
        out += "".join(f'\tcase {name}::{enumerator(choice)}:\n\t\treturn TEXT("{choice}");\n' for choice in choices)
        out += f'\t}}\n\treturn TEXT("{choices[0]}");\n}}\n\n'
    out = out.rstrip("\n") + "\n}\n\n"
    for algorithm in algorithms:
        name = class_name(algorithm)
        out += f'FString {name}::GetAlgorithm() const\n{{\n\treturn TEXT("{algorithm.name}");\n}}\n\n'
        out += f"void {name}::Collect(TArray<FConsacHyperparameter>& Into) const\n{{\n"
        out += "".join(collect(row) for row in algorithm.rows) + "}\n\n"
    return out.rstrip("\n") + "\n"
