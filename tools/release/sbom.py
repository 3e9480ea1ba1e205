"""A bill of materials in CycloneDX's JSON (1.6): one program, and what is linked into it. The same bytes each time."""
import hashlib
import json
import time
import uuid

from .components import Component


def licences(expression: str) -> list[dict]:
    compound = any(word in expression.split() for word in ("AND", "OR", "WITH"))
    return [{"expression": expression}] if compound else [{"license": {"id": expression}}]


def sbom(name: str, version: str, target: str, program: bytes, parts: list[tuple[Component, str]], epoch: int,
         needed: list[tuple[str, str]] = ()) -> bytes:
    """`parts`: a component and its version, each. `needed`: packages of Debian that are asked for, not linked in."""
    top = f"{name}@{version}-{target}"
    digest = hashlib.sha256(program).hexdigest()
    rows = [{"type": "library", "bom-ref": part.name, "name": part.name, "version": number, "licenses": licences(part.licence),
             "purl": f"{part.purl}@{number}", "scope": "required"} for part, number in parts]
    rows += [{"type": "library", "bom-ref": f"debian:{package}", "name": package, "version": number,
              "purl": f"pkg:deb/debian/{package}@{number}?distro=debian-12", "scope": "required",
              "properties": [{"name": "consac:linked", "value": "dynamically, from the system"}]} for package, number in needed]
    told = {
        "bomFormat": "CycloneDX", "specVersion": "1.6", "version": 1,
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, top + digest)}",
        "metadata": {
            "timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(epoch)),
            "component": {"type": "application", "bom-ref": top, "name": name, "version": version, "licenses": licences("MIT"),
                          "hashes": [{"alg": "SHA-256", "content": digest}],
                          "properties": [{"name": "consac:target", "value": target}]},
        },
        "components": rows,
        "dependencies": [{"ref": top, "dependsOn": [row["bom-ref"] for row in rows]}],
    }
    return (json.dumps(told, indent=1) + "\n").encode()
