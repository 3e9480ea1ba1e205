#!/usr/bin/env python3
"""Robots that nobody here made: imports those of tests/slow/robots.txt and judges where their links are by other people's programs,
pinocchio for URDF and MuJoCo for MJCF, at random joint positions. Writes the table bench/results/robots.md; exits 1 where a robot is
judged to be elsewhere, or does what robots.txt does not say. It takes the packages of robots.txt, unpacked below one folder, each in
a folder of its name, and pinocchio, mujoco and numpy to judge by: tools/setup.sh robots. `make robots`, a part of `make test-slow`, runs it.

    .venv-judges/bin/python tests/slow/robots.py build/robots bench/results/robots.md [--only WORD] [--validator build/judges]

MJCF that includes other files is refused by `consac twin import`; it is given what MuJoCo saves of it, as the refusal says."""
import argparse
import dataclasses
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import mujoco
import numpy as np
import pinocchio

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONSAC = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/release")).resolve() / "cli/consac"
ROBOTS = ROOT / "tests/slow/robots.txt"
POSES = 5          # of each robot: 0, and random ones within a radian and 10 cm
TOLERANCE = 1e-5   # m, rad
VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])), {maxIssues: 5}).then(report => {
  console.log(JSON.stringify([report.issues.numErrors, report.issues.numWarnings]));
});"""


@dataclasses.dataclass
class Row:
    """One robot: what the list says, and what came of it."""
    package: str
    file: str
    options: list
    expected: str              # "" it imports; else what its refusal says
    name: str = ""
    format: str = ""
    links: int = 0
    moving: int = 0
    meshes: int = 0
    triangles: int = 0
    seconds: float = 0.0
    error: float | None = None  # the greatest, m and rad
    gltf: str = "-"
    refusal: str = ""
    fault: str = ""


def read_list(path: pathlib.Path):
    """PACKAGE FILE [OPTION...] [! WORDS OF ITS REFUSAL], one a line."""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            given, _, expected = line.partition(" ! ")
            package, file, *options = given.split()
            yield Row(package, file, options, expected.strip())


def about(folder: pathlib.Path):
    """Version and licence of an unpacked package."""
    text = next(folder.glob("*.dist-info/METADATA")).read_text(encoding="utf-8").split("\n\n")[0]
    field = lambda name: (re.findall(rf"^{name}: (.+)$", text, re.M) or [""])[0].strip()
    licence = field("License-Expression") or field("License") or field("Classifier: License").split(" :: ")[-1]
    if not licence:
        files = [*folder.glob("*.dist-info/LICENSE*"), *folder.glob("*.dist-info/licenses/LICENSE*")]
        words = files[0].read_text(encoding="utf-8", errors="replace")[:2000] if files else ""
        known = (("Apache License", "Apache-2.0"), ("MIT License", "MIT"), ("Permission is hereby granted, free of charge", "MIT"))
        licence = next((name for sign, name in known if sign in words), "see package")
    short = {"MIT License": "MIT", "Apache License, Version 2.0": "Apache-2.0", "Apache Software License": "Apache-2.0", "zlib": "Zlib"}
    return field("Version"), short.get(licence, licence)


def consac(*arguments):
    done = subprocess.run([CONSAC, "twin", *map(str, arguments)], capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        raise ValueError(done.stderr.strip())
    return json.loads(done.stdout)


def matrix(quaternion, position):
    """4x4 of a quaternion x, y, z, w."""
    x, y, z, w = np.asarray(quaternion, dtype=float) / np.linalg.norm(quaternion)
    out = np.eye(4)
    out[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                   [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                   [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    out[:3, 3] = position
    return out


def difference(a, b) -> float:
    """The greater of metres and radians between two frames."""
    turn = a[:3, :3].T @ b[:3, :3]
    sine = np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    return float(max(np.linalg.norm(a[:3, 3] - b[:3, 3]), np.arctan2(sine, (np.trace(turn) - 1) / 2)))


class Twin:
    """An import, asked where its links are in the frames of the file that it was made of."""

    def __init__(self, folder):
        self.folder = folder
        self.table = json.loads((folder / "twin.json").read_text(encoding="utf-8"))
        self.joints = self.table["joints"]
        self.leaders = [each for each in self.joints if each["type"] != "fixed" and not each.get("mimic")]

    def positions(self, rng, reach):
        """What each joint of the file has: those that move by themselves at random within `reach`, their followers as they follow."""
        chosen = {each["name"]: reach * rng.uniform(-1, 1) * (0.1 if each["type"] == "prismatic" else 1.0) for each in self.leaders}
        for each in self.joints:
            if each.get("mimic"):
                mimic = each["mimic"]
                chosen[each["name"]] = mimic["multiplier"] * chosen[mimic["joint"]] + mimic["offset"]
        return chosen

    def links(self, positions):
        given = ["--q=" + ",".join(repr(float(positions[each["name"]])) for each in self.leaders)] if self.leaders else []
        rows = consac("fk", self.folder, "--json", *given)
        turns = [np.eye(4)] + [matrix(each["axis_turn"], (0, 0, 0)) for each in self.joints]
        return {row["link"]: matrix(row["rotation"], row["position"]) @ turn.T for row, turn in zip(rows, turns, strict=True)}


def judge_urdf(file, twin, rng) -> float:
    """By pinocchio: the greatest difference of any link."""
    model = pinocchio.buildModelFromUrdf(str(file))
    data, worst = model.createData(), 0.0
    for pose in range(POSES):
        positions = twin.positions(rng, 1.0 if pose else 0.0)
        q = pinocchio.neutral(model)
        for joint, name in enumerate(model.names):
            if name in positions and model.nqs[joint] == 1:
                q[model.idx_qs[joint]] = positions[name]
            elif name in positions and model.nqs[joint] == 2:
                q[model.idx_qs[joint]:][:2] = np.cos(positions[name]), np.sin(positions[name])
        pinocchio.framesForwardKinematics(model, data, q)
        ours = twin.links(positions)
        theirs = {frame.name: data.oMf[i].homogeneous for i, frame in enumerate(model.frames) if frame.type == pinocchio.FrameType.BODY}
        missing = set(ours) - set(theirs)
        if missing:
            raise AssertionError(f"pinocchio knows no link {sorted(missing)[0]}")
        worst = max(worst, *(difference(ours[name], theirs[name]) for name in ours))
    return worst


def judge_mjcf(model, twin, rng) -> float:
    """By MuJoCo: the greatest difference of any body."""
    data, worst = mujoco.MjData(model), 0.0
    names = [twin.table["root"]] + [each["child"] for each in twin.joints]
    bodies = [name for name in names if not re.search(r"_before_\d+$", name)]  # those between the joints of one body are ours
    joints = [i for i in range(model.njnt) if model.jnt_type[i] in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))]
    moving = [each["name"] for each in twin.joints if each["type"] != "fixed"]
    if len(bodies) != model.nbody or len(joints) != len(moving):
        raise AssertionError(f"MuJoCo has {model.nbody} bodies and {len(joints)} joints, the twin {len(bodies)} and {len(moving)}")
    for pose in range(POSES):
        positions = twin.positions(rng, 1.0 if pose else 0.0)
        data.qpos[:] = model.qpos0
        for i, name in zip(joints, moving, strict=True):
            data.qpos[model.jnt_qposadr[i]] += positions[name]
        mujoco.mj_kinematics(model, data)
        ours = twin.links(positions)
        for body, name in enumerate(bodies):
            last = model.body_jntadr[body] + model.body_jntnum[body] - 1
            pivot = model.jnt_pos[last] if model.body_jntnum[body] and last in joints else np.zeros(3)
            theirs = matrix(np.roll(data.xquat[body], -1), data.xpos[body])
            worst = max(worst, difference(ours[name] @ matrix((0, 0, 0, 1), -pivot), theirs))
    return worst


def saved_by_mujoco(file, model):
    """One file without includes, beside the one it is of."""
    saved = file.with_name(file.stem + ".saved.xml")
    mujoco.mj_saveLastXML(str(saved), model)
    return saved


def gltf_issues(file, validator) -> str:
    done = subprocess.run(["node", "-e", VALIDATE, file], cwd=validator, capture_output=True, text=True, check=True)
    errors, warnings = json.loads(done.stdout)
    return "valid" if errors == 0 and warnings == 0 else f"{errors} errors, {warnings} warnings"


def try_robot(row: Row, folder: pathlib.Path, validator) -> None:
    package = folder / row.package
    file = package / row.file
    text = file.read_text(encoding="utf-8", errors="replace")
    row.format = "MJCF" if re.search(r"<mujoco\b", text) and "<robot" not in text else "URDF"
    model = mujoco.MjModel.from_xml_path(str(file)) if row.format == "MJCF" and not row.expected else None
    if model is not None and "<include " in text:
        file, row.format = saved_by_mujoco(file, model), "MJCF, saved"
        model = mujoco.MjModel.from_xml_path(str(file))
    options = [f"{name}={package / path}" for name, path in (option.rsplit("=", 1) for option in row.options)]
    with tempfile.TemporaryDirectory() as out:
        begin = time.perf_counter()
        report = consac("import", file, "-o", pathlib.Path(out) / "twin", "--json", "--root", package, *options)
        row.seconds = time.perf_counter() - begin
        twin = Twin(pathlib.Path(out) / "twin")
        row.name, row.links, row.moving = twin.table["name"], report["links"], report["positions"]
        row.meshes, row.triangles = report["meshes"], report["triangles"]
        rng = np.random.default_rng(1)
        row.error = judge_mjcf(model, twin, rng) if model is not None else judge_urdf(file, twin, rng)
        if validator:
            row.gltf = gltf_issues(pathlib.Path(out) / "twin/twin.glb", validator)


def one(row: Row, folder: pathlib.Path, validator) -> None:
    try:
        try_robot(row, folder, validator)
    except ValueError as refusal:
        row.refusal = str(refusal).replace(str(folder) + "/" + row.package + "/", "").removeprefix("consac twin: ").replace("|", "\\|")
        if not row.expected or row.expected not in row.refusal or "\n" in row.refusal:
            row.fault = f"refused: {row.refusal}"
        return
    except AssertionError as fault:
        row.fault = str(fault)
        return
    if row.expected:
        row.fault = f"imports, though {row.expected!r} was expected"
    elif not row.error <= TOLERANCE or "error" in row.gltf and not row.gltf.startswith("0 "):
        row.fault = f"{row.error:.2g} m or rad from its judge; glTF {row.gltf}"


def table(rows, folder) -> str:
    imported = [row for row in rows if not row.refusal]
    judges = f"pinocchio {pinocchio.__version__} (URDF) and MuJoCo {mujoco.__version__} (MJCF)"
    out = ["# Robots that nobody here made", "",
           f"Written by `tests/slow/robots.py` from the robots of other people's Python packages: {len(imported)} import, {len(rows) - len(imported)} say why not. Every link "
           f"of those that import is where {judges} have it, at 0 and at {POSES - 1} random poses; \"apart\" is the greatest difference, in metres or radians. "
           "\"glTF\" is what Khronos' validator says of `twin.glb`. \"MJCF, saved\" includes other files, and was saved as one by MuJoCo. Licences are the packages'; single "
           "robots in them may have another. Seconds are of a busy machine: for scale only.", "",
           "| robot | package | licence | format | links | moving | meshes | triangles | s | apart | glTF |", "|---|---|---|---|---|---|---|---|---|---|---|"]
    for row in imported:
        version, licence = about(folder / row.package)
        apart = f"{row.error:.0e}" if row.error is not None else "-"
        out.append(f"| {row.name} (`{pathlib.PurePath(row.file).name}`) | {row.package} {version} | {licence} | {row.format} | {row.links} | {row.moving} | {row.meshes} | "
                   f"{row.triangles} | {row.seconds:.1f} | {apart} | {row.gltf} |")
    out += ["", "## What does not import, and what it says", "", "| file | package | licence | why |", "|---|---|---|---|"]
    for row in rows:
        if row.refusal:
            version, licence = about(folder / row.package)
            out.append(f"| `{pathlib.PurePath(row.file).name}` | {row.package} {version} | {licence} | {row.refusal} |")
    return "\n".join(out) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("table", type=pathlib.Path)
    parser.add_argument("--only", default="", help="robots whose file or package holds this word; no table is written")
    parser.add_argument("--validator", type=pathlib.Path, help="folder whose node_modules has gltf-validator")
    options = parser.parse_args()
    folder, written = options.folder.resolve(), options.table.resolve()
    validator = options.validator.resolve() if options.validator else None
    os.chdir(folder)  # where MuJoCo logs
    rows = [row for row in read_list(ROBOTS) if options.only in row.package + "/" + row.file]
    for row in rows:
        one(row, folder, validator)
        what = row.fault or (f"refused: {row.refusal}" if row.refusal else f"{row.links} links, {row.error:.0e} apart, glTF {row.gltf}")
        print(("FAULT " if row.fault else "") + f"{row.package} {row.file}: {what}", flush=True)
    if not options.only:
        written.write_text(table(rows, folder), encoding="utf-8")
    return 1 if any(row.fault for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
