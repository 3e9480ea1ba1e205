#!/usr/bin/env python3
"""What other people's programs say of the files that `consac twin import` writes, of YuMi, of the small arm's STEP file and of a robot with every
kind of joint and shape:
Khronos' glTF validator and three.js of twin.glb, OpenUSD and its validators (usdchecker's) and urdf-usd-converter of twin.usda, MuJoCo
of twin.xml, yourdfpy of twin.urdf. Each is asked where every link is, at YuMi's reference poses and at random ones. Writes the
table bench/results/twin_judges.md; exits 1 where one finds a fault. `make test-slow` runs it; tools/setup.sh judges installs what
it asks.

    .venv-judges/bin/python tests/slow/twin_judges.py bench/results/twin_judges.md --node build/judges --converter .venv-converter"""
import argparse
import dataclasses
import importlib.metadata
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import mujoco
import numpy as np
import yourdfpy
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdValidation

from robots import POSES, ROOT, Twin, consac, difference, gltf_issues, matrix

TOLERANCE = 2e-6  # m, rad: USD's and glTF's joint frames are float32
DATA = ROOT / "examples/robots"
YUMI = DATA / "yumi/yumi_description/urdf"
THREE = """
import {readFileSync} from 'fs';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
const [file, poses] = [process.argv[2], JSON.parse(readFileSync(process.argv[3]))];
const bytes = readFileSync(file), out = [];
const gltf = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
let triangles = 0;
gltf.scene.traverse(node => { if (node.isMesh) triangles += node.geometry.index.count / 3; });
for (const pose of poses) {
  const frames = {};
  gltf.scene.traverse(node => {
    const {joint, type} = node.userData;
    if (type === 'prismatic') node.position.x = pose[joint];
    else if (joint in pose) node.rotation.set(pose[joint], 0, 0);
  });
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse(node => { if (node.userData.link) frames[node.userData.link] = [...node.matrixWorld.elements]; });
  out.push(frames);
}
console.log(JSON.stringify({triangles, frames: out}));
"""
TO_Z_UP = matrix((np.sqrt(0.5), 0, 0, np.sqrt(0.5)), (0, 0, 0))


@dataclasses.dataclass
class Robot:
    """A robot, its twin, and what is asked of both."""
    name: str
    file: pathlib.Path
    options: list
    twin: Twin = None
    poses: list = dataclasses.field(default_factory=list)  # {joint: position}, those that follow too
    frames: list = dataclasses.field(default_factory=list)  # {link: 4x4} in the twin's frames
    report: dict = dataclasses.field(default_factory=dict)


def link(name, shape):
    body = ("<inertial><origin xyz='0.01 0.02 0.03' rpy='0.1 0.2 0.3'/><mass value='0.5'/>"
            "<inertia ixx='2e-3' ixy='1e-4' ixz='2e-4' iyy='3e-3' iyz='-1e-4' izz='4e-3'/></inertial>")
    place = "<origin xyz='0.01 0 0.05' rpy='0.2 0.1 0.4'/><geometry>" + shape + "</geometry>"
    return f"<link name='{name}'>{body}<visual>{place}</visual><collision>{place}</collision></link>"


def joint(name, kind, parent, child, more):
    return (f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/><origin xyz='0.1 0.02 0.3' rpy='0.3 -0.2 0.1'/>"
            f"<axis xyz='1 2 3'/>{more}</joint>")


def material(name, colour):
    effect = (f"<effect id='{name}-effect'><profile_COMMON><technique sid='c'><lambert><diffuse><color>{colour}</color></diffuse></lambert></technique>"
              "</profile_COMMON></effect>")
    return effect, f"<material id='{name}'><instance_effect url='#{name}-effect'/></material>", f"<instance_material symbol='{name}' target='#{name}'/>"


def two_colours() -> str:
    """A Collada mesh of two triangles, each of a colour."""
    effects, materials, bound = ("".join(each) for each in zip(material("red", "1 0 0 1"), material("glass", "0 0 1 0.5"), strict=True))
    faces = "".join(f"<triangles count='1' material='{name}'><input semantic='VERTEX' source='#v' offset='0'/><p>{corners}</p></triangles>"
                    for name, corners in (("red", "0 1 2"), ("glass", "0 2 3")))
    return (f"<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><library_effects>{effects}</library_effects>"
            f"<library_materials>{materials}</library_materials><library_geometries><geometry id='g'><mesh><source id='p'>"
            "<float_array id='f' count='12'>0 0 0 0.1 0 0 0.1 0.1 0 0 0.1 0.1</float_array></source><vertices id='v'><input semantic='POSITION' source='#p'/>"
            f"</vertices>{faces}</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='s'><node><instance_geometry url='#g'>"
            f"<bind_material><technique_common>{bound}</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>"
            "<scene><instance_visual_scene url='#s'/></scene></COLLADA>")


LIMIT = "<limit lower='-1' upper='2' effort='5' velocity='3'/>"
EVERYTHING = ("<robot name='every kind'>" + link("base", "<box size='0.1 0.2 0.3'/>") + link("turns", "<sphere radius='0.1'/>") +
              link("goes-on", "<cylinder radius='0.1' length='0.3'/>") + link("slides", "<cylinder radius='0.2' length='0.1'/>") +
              link("follows", "<box size='0.1 0.2 0.3'/>") + link("held", "<mesh filename='two_colours.dae'/>") + link("3rd", "<sphere radius='0.1'/>") +
              joint("a", "revolute", "base", "turns", LIMIT + "<dynamics damping='0.2' friction='0.1'/>") +
              joint("b", "continuous", "turns", "goes-on", "") + joint("c", "prismatic", "goes-on", "slides", LIMIT) +
              joint("d", "revolute", "turns", "follows", LIMIT + "<mimic joint='a' multiplier='-0.5' offset='0.25'/>") +
              joint("e", "fixed", "follows", "3rd", "") + joint("f", "revolute", "3rd", "held", "<limit lower='0' upper='0' effort='1' velocity='1'/>") +
              "</robot>")
ARM = DATA / "low_cost_robot_arm"
ROBOTS = [Robot("YuMi, URDF", YUMI / "yumi_calibrated.urdf", ["--srdf", YUMI / "yumi.srdf"]),
          Robot("small arm, STEP", ARM / "arm.step", ["--hints", ARM / "hints.json", "--density", "1200"]),
          Robot("every kind of joint and shape, URDF", None, [])]


def reference_poses(twin):
    """RobotStudio's, of both arms; none of another robot."""
    names = {each["name"] for each in twin.leaders}
    for row in json.loads((DATA / "yumi/reference_fk.json").read_text(encoding="utf-8"))["poses"]:
        chosen = {f"yumi_joint_{axis}_{side}": np.radians(q) for side in "rl" for axis, q in zip((1, 2, 7, 3, 4, 5, 6), row["q"], strict=True)}
        if set(chosen) <= names:
            yield chosen


def prepare(robot, folder):
    if robot.file is None:
        robot.file = folder.parent / "everything.urdf"
        robot.file.write_text(EVERYTHING, encoding="utf-8")
        robot.file.with_name("two_colours.dae").write_text(two_colours(), encoding="utf-8")
    robot.report = consac("import", robot.file, "-o", folder, "--json", *robot.options)
    twin = robot.twin = Twin(folder)
    rng = np.random.default_rng(1)
    robot.poses = [twin.positions(rng, 0.0), *(twin.positions(rng, 1.0) for _ in range(POSES))]
    for chosen in reference_poses(twin):
        robot.poses.append(twin.positions(rng, 0.0) | chosen)
    for each in twin.leaders:  # what limits hold stays there
        for pose in robot.poses:
            pose[each["name"]] = each["lower"] if each["lower"] is not None and each["lower"] == each["upper"] else pose[each["name"]]
    for pose in robot.poses:
        given = ",".join(repr(float(pose[each["name"]])) for each in twin.leaders)
        robot.frames.append({row["link"]: matrix(row["rotation"], row["position"]) for row in consac("fk", folder, "--json", "--q=" + given)})


def apart(robot, frames_of) -> float:
    """The greatest difference of any link at any pose; `frames_of(pose)` may leave links out that it does not know, but not all."""
    worst = 0.0
    for pose, ours in zip(robot.poses, robot.frames, strict=True):
        theirs = frames_of(pose)
        missing = set(ours) - set(theirs)
        assert not missing, f"it knows no link {sorted(missing)[0]}"
        worst = max(worst, *(difference(ours[link], theirs[link]) for link in ours))
    assert worst <= TOLERANCE, f"a link is {worst:.1e} m or rad elsewhere"
    return worst


def stage_of(file):
    stage = Usd.Stage.Open(str(file))
    assert stage, "it does not open"
    return stage


def called(prim) -> str:
    """What the robot's file calls it: prims have letters, digits and _ alone."""
    return prim.GetDisplayName() or prim.GetName()


def local_frame(joint, which):
    rotation = (joint.GetLocalRot0Attr() if which == 0 else joint.GetLocalRot1Attr()).Get()
    position = (joint.GetLocalPos0Attr() if which == 0 else joint.GetLocalPos1Attr()).Get()
    return matrix((*rotation.GetImaginary(), rotation.GetReal()), position)


@dataclasses.dataclass
class UsdJoint:
    """A joint of a stage, by the frames that its bodies have of it."""
    name: str
    parent: str
    child: str
    before: np.ndarray
    after: np.ndarray
    axis: np.ndarray = None
    slides: bool = False
    limits: tuple = ()


def usd_joints(stage):
    for prim in stage.Traverse():
        if not prim.IsA(UsdPhysics.Joint):
            continue
        joint = UsdPhysics.Joint(prim)
        bodies = [[called(stage.GetPrimAtPath(target)) for target in rel.GetTargets()] for rel in (joint.GetBody0Rel(), joint.GetBody1Rel())]
        row = UsdJoint(called(prim), (bodies[0] or ["world"])[0], bodies[1][0], local_frame(joint, 0), local_frame(joint, 1))
        if not prim.IsA(UsdPhysics.FixedJoint):
            row.slides = prim.IsA(UsdPhysics.PrismaticJoint)
            typed = (UsdPhysics.PrismaticJoint if row.slides else UsdPhysics.RevoluteJoint)(prim)
            row.axis = np.eye(3)["XYZ".index(typed.GetAxisAttr().Get())]
            row.limits = tuple(attribute.Get() if row.slides else np.radians(attribute.Get())
                               for attribute in (typed.GetLowerLimitAttr(), typed.GetUpperLimitAttr()))
        yield row


def usd_frames(joints, base, pose):
    """Links by the joints' frames alone."""
    frames, waiting = dict(base), list(joints)
    while waiting:
        ready = [row for row in waiting if row.parent in frames]
        assert ready, f"the joint {waiting[0].name} hangs on nothing"
        for row in ready:
            waiting.remove(row)
            motion = np.eye(4)
            if row.axis is not None and row.slides:
                motion[:3, 3] = row.axis * pose[row.name]
            elif row.axis is not None:
                motion = matrix((*(row.axis * np.sin(pose[row.name] / 2)), np.cos(pose[row.name] / 2)), (0, 0, 0))
            frames[row.child] = frames[row.parent] @ row.before @ motion @ np.linalg.inv(row.after)
    return frames


def usd_opens(robot, _options):
    stage = stage_of(robot.twin.folder / "twin.usda")
    joints = [row for row in usd_joints(stage) if row.name != "root_joint"]
    root = robot.twin.table["root"]
    worst = apart(robot, lambda pose: usd_frames(joints, {root: np.eye(4)}, pose))
    cache = UsdGeom.XformCache()
    rest = {called(prim): np.array(cache.GetLocalToWorldTransform(prim)).T for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)}
    worst = max(worst, *(difference(robot.frames[0][link], rest[link]) for link in robot.frames[0]))
    shown = sum(len(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get()) for prim in stage.Traverse()
                if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != "guide")
    assert worst <= TOLERANCE, f"a link stands {worst:.1e} m or rad elsewhere"
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0, "its units are others"
    size = (robot.twin.folder / "twin.usda").stat().st_size
    return f"{len(joints)} joints, {shown} triangles shown, {size / 2**20:.1f} MiB; {worst:.0e} apart"


def usd_checks(robot, _options):
    stage = stage_of(robot.twin.folder / "twin.usda")
    registry = UsdValidation.ValidationRegistry()
    names = [each.name for each in registry.GetAllValidatorMetadata() if not each.isSuite]
    errors = UsdValidation.ValidationContext(registry.GetOrLoadValidatorsByName(names)).Validate(stage)
    assert not errors, f"{errors[0].GetName()}: {errors[0].GetMessage()}"
    return f"{len(names)} validators find nothing"


def usd_converted(robot, options):
    own = robot.file.suffix == ".urdf"
    file = robot.file if own else robot.twin.folder / "twin.urdf"
    with tempfile.TemporaryDirectory() as out:
        package = file.parent.parent
        subprocess.run([options.converter / "bin/urdf_usd_converter", file, out + "/usd", "--package", f"{package.name}={package}"],
                       check=True, capture_output=True)
        stage = stage_of(next(pathlib.Path(out, "usd").glob("*.usda")))
        joints = list(usd_joints(stage))
        default = called(stage.GetDefaultPrim())
    ours = {row.name: row for row in usd_joints(stage_of(robot.twin.folder / "twin.usda"))}
    pairs = [pair for row in joints if row.axis is not None and ours[row.name].axis is not None
             for pair in zip(row.limits, ours[row.name].limits, strict=True)]
    limits = max((abs(a - b) for a, b in pairs if a != b), default=0.0)
    assert limits <= TOLERANCE, f"a limit differs by {limits:.1e}"
    turns = {each["child"]: matrix(each["axis_turn"], (0, 0, 0)) for each in robot.twin.joints} if own else {}

    def frames(pose):  # it knows the root and what is fixed to it as the robot itself
        base = next(row.parent for row in joints if row.parent not in {each.child for each in joints})
        start = next(link for link in (base, robot.twin.table["root"]) if link in robot.frames[0])
        theirs = usd_frames(joints, {base: robot.frames[0][start]}, pose)
        return {link: frame @ turns.get(link, np.eye(4)) for link, frame in theirs.items() if link in robot.frames[0]}
    worst, known = 0.0, set()
    for pose, own in zip(robot.poses, robot.frames, strict=True):
        theirs = frames(pose)
        known |= set(theirs)
        worst = max(worst, *(difference(own[link], theirs[link]) for link in theirs))
    assert worst <= TOLERANCE and len(known) >= len(joints), f"a link is {worst:.1e} m or rad elsewhere ({len(known)} of {default})"
    return f"{len(joints)} joints, {len(known)} links: {worst:.0e} apart, limits {limits:.0e}"


def gltf_valid(robot, options):
    said = gltf_issues(robot.twin.folder / "twin.glb", options.node)
    assert said == "valid", said
    return said


def three_opens(robot, options):
    program, poses = options.node / "three.mjs", options.node / "poses.json"
    program.write_text(THREE, encoding="utf-8")
    poses.write_text(json.dumps(robot.poses), encoding="utf-8")
    done = subprocess.run(["node", program, robot.twin.folder / "twin.glb", poses], capture_output=True, text=True, check=True)
    read = json.loads(done.stdout)
    rows = iter(read["frames"])
    root = {robot.twin.table["root"]: np.eye(4)}
    up = lambda elements: TO_Z_UP @ np.array(elements).reshape(4, 4).T @ np.linalg.inv(TO_Z_UP)
    worst = apart(robot, lambda _pose: root | {link: up(elements) for link, elements in next(rows).items()})
    return f"{read['triangles']} triangles; {worst:.0e} apart"


def mujoco_opens(robot, _options):
    model = mujoco.MjModel.from_xml_path(str(robot.twin.folder / "twin.xml"))
    data = mujoco.MjData(model)

    def frames(pose):
        for i in range(model.njnt):
            data.qpos[model.jnt_qposadr[i]] = pose[model.joint(i).name]
        mujoco.mj_kinematics(model, data)
        bodies = {model.body(i).name: matrix(np.roll(data.xquat[i], -1), data.xpos[i]) for i in range(1, model.nbody)}
        return {robot.twin.table["root"]: np.eye(4)} | bodies
    return f"{model.njnt} joints, {model.nu} actuators, {model.neq} mimics; {apart(robot, frames):.0e} apart"


def yourdfpy_opens(robot, _options):
    model = yourdfpy.URDF.load(str(robot.twin.folder / "twin.urdf"))
    root = robot.twin.table["root"]

    def frames(pose):
        model.update_cfg({name: pose[name] for name in model.actuated_joint_names})
        return {link: model.get_transform(link, root) for link in model.link_map}
    return f"{len(model.joint_map)} joints, {len(model.scene.geometry)} meshes; {apart(robot, frames):.0e} apart"


JUDGES = [("gltf-validator", "twin.glb", gltf_valid), ("three", "twin.glb", three_opens), ("usd-core", "twin.usda", usd_opens),
          ("usd-core, as usdchecker", "twin.usda", usd_checks), ("urdf-usd-converter", "twin.usda", usd_converted),
          ("mujoco", "twin.xml", mujoco_opens), ("yourdfpy", "twin.urdf", yourdfpy_opens)]


def version(name, options):
    name = name.split(",")[0]
    if (options.node / "node_modules" / name).exists():
        return json.loads((options.node / "node_modules" / name / "package.json").read_text(encoding="utf-8"))["version"]
    if name == "urdf-usd-converter":
        return next(options.converter.glob("lib/python*/site-packages/urdf_usd_converter-*.dist-info")).name.split("-")[1].removesuffix(".dist")
    return importlib.metadata.version(name)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=pathlib.Path)
    parser.add_argument("--node", type=pathlib.Path, required=True, help="folder whose node_modules has gltf-validator and three")
    parser.add_argument("--converter", type=pathlib.Path, required=True, help="Python environment of urdf-usd-converter, whose OpenUSD is another")
    options = parser.parse_args()
    options.node, options.converter = options.node.resolve(), options.converter.absolute()
    rows, faults = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for i, robot in enumerate(ROBOTS):
            prepare(robot, pathlib.Path(folder) / str(i))
        for name, file, judge in JUDGES:
            for robot in ROBOTS:
                try:
                    said = judge(robot, options)
                except (AssertionError, subprocess.CalledProcessError, ValueError) as fault:
                    said = "FAULT: " + re.sub(r"\s+", " ", str(getattr(fault, "stderr", "") or fault))[-300:]
                    faults += 1
                if said is None:
                    continue
                rows.append(f"| {name} | {version(name, options)} | `{file}` | {robot.name} | {said} |")
                print(rows[-1], flush=True)
    head = ["# What other people's programs say of a twin", "",
            "Written by `tests/slow/twin_judges.py` (`make test-slow`). Each opens what `consac twin import` writes and says where every link is, with every joint at 0, at "
            f"{POSES} random poses and, of YuMi, at the ten of RobotStudio; \"apart\" is the greatest difference from `consac twin fk`, in metres or radians (USD's joint "
            "frames are float32). usdchecker's validators are all of OpenUSD's; urdf-usd-converter makes USD of the same URDF, and is compared joint by joint (of the STEP file, of twin.urdf).", "",
            "| judge | version | file | robot | says |", "|---|---|---|---|---|"]
    options.table.write_text("\n".join(head + rows) + "\n", encoding="utf-8")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
