"""A robot from an MJCF file, MuJoCo's own format, as the elements of a URDF file, which is what is read of it.

MuJoCo reads and compiles the file, so classes, defaults, frames and units of angles mean what they do there. It opens
no other file: meshes are read as those of a URDF file, and MuJoCo has a ball without mass instead, for its pose.
Joints count from where the model starts.

Source of the format: the XML reference of MuJoCo, mujoco.readthedocs.io/en/stable/XMLreference.html.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from math import inf, isnan
from typing import Any, Final

import mujoco

from foosim.world.bodies.findings import BadRobot
from foosim.world.bodies.xml_tree import Element, read_xml
from foosim.world.matter.mesh import AssetError
from foosim.world.scene import ORIGIN, UPRIGHT, Quaternion, Vector, moved, rotate

KEPT: Final = 32
"""The count of files whose elements are kept."""
READ: Final = ("compiler", "default", "asset", "worldbody", "equality")
_SAVED: Final = "read the file that `mj_saveLastXML` writes"
REFUSED: Final = {
    "include": f"a part of another file: {_SAVED}",
    "model": f"a part of another file: {_SAVED}",
    "extension": "plugins of MuJoCo are not loaded",
    "replicate": f"a count of copies, without a bound: {_SAVED}",
    **dict.fromkeys(("flexcomp", "composite"), "a soft body: the links of a robot are rigid"),
    **dict.fromkeys(("connect", "weld"), "a loop: the bodies of a robot are a tree"),
}
"""Elements without which it would be another robot, or for which MuJoCo would open a file or take any amount of memory.
Their names count in any case: MuJoCo takes `INCLUDE` for `include`, too."""
SIZES: Final = (
    *("memory", "nstack", "nconmax", "njmax", "nuser_body", "nuser_jnt", "nuser_geom", "nuser_site", "nuser_cam"),
    *("nuser_tendon", "nuser_actuator", "nuser_sensor"),
)
"""Sizes of memory that a file may set, and its robot does not need."""
SHOWN_GROUPS: Final = 3
"""A viewer shows shapes of the groups below this one."""
UNPAINTED: Final = (0.5, 0.5, 0.5, 1.0)
"""The colour of a shape without one in its file."""
JOINTS: Final = {mujoco.mjtJoint.mjJNT_FREE: "floating", mujoco.mjtJoint.mjJNT_BALL: "spherical"}
_LINE: Final = re.compile(r",? ?line (\d+)")


@lru_cache(maxsize=KEPT)
def urdf_of(path: str, content: bytes) -> Element:
    """Return the robot in the MJCF file of this path, as URDF. Raises AssetError, a BadRobot for several errors."""
    root = read_xml(path, content)
    if root.tag != "mujoco":
        raise root.error("no MJCF: the outermost element is mujoco", root.tag)
    errors = [found.error(REFUSED[tag], found.tag) for found in root.below() if (tag := found.tag.lower()) in REFUSED]
    if errors:
        raise BadRobot([*map(str, errors)], ())
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)  # by default it writes MUJOCO_LOG.TXT; engines fail by their warnings
    try:
        spec = mujoco.MjSpec.from_string(content.decode("utf-8", "replace"))
        made = _Made(path, spec)
        m = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        what = " ".join(str(error).split())
        line = _LINE.search(what)
        place = f"{path}:{line[1]}" if line else path
        raise AssetError(f"{place}: MuJoCo refuses it: {_LINE.sub('', what)}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    return Element(path, root.line, "robot", {"name": spec.modelname}, [*made.elements(m), *_passed_over(root)])


def _passed_over(root: Element) -> Iterator[Element]:
    """Yield the elements of a file beside its robot."""
    yield from (child for child in root.children if child.tag not in READ)
    for world in root.all_of("worldbody"):
        yield from world.all_of("geom")
        yield from world.below("light", "camera", "site", "freejoint")


class _Made:
    """The elements of a URDF file for the model that MuJoCo compiles."""

    def __init__(self, path: str, spec: Any) -> None:
        """Take the meshes and equalities out of a model. Raises BadRobot."""
        self._path, self._spec = path, spec
        self._stood_in: list[tuple[Any, Element]] = []
        """Shapes for which MuJoCo has a ball, and what they are."""
        self._mimics: dict[str, list[Element]] = {}
        """How a joint follows others, by the equalities of the model."""
        spec.compiler.discardvisual = spec.compiler.fusestatic = False
        meshes = {mesh.name: mesh for mesh in spec.meshes}
        errors = []
        for geom in spec.geoms:
            kind = geom.type.name.removeprefix("mjGEOM_").lower()
            if kind not in ("mesh", "hfield", "sdf") and not geom.meshname:
                continue
            if geom.meshname and geom.meshname not in meshes:
                errors.append(self._element(geom, kind).error("no mesh of this name", geom.meshname))
                continue
            if self._weighs(geom):
                what = "a body without inertial, whose mass is that of a mesh: `saveinertial` of compiler writes it"
                errors.append(self._element(geom.parent, "body").error(what, geom.parent.name))
            self._stood_in.append((geom, self._mesh(geom, kind, meshes.get(geom.meshname))))
            geom.type, geom.size, geom.mass = mujoco.mjtGeom.mjGEOM_SPHERE, [1.0, 0.0, 0.0], 0.0
            geom.meshname = geom.hfieldname = ""
        for equality in filter(lambda one: one.active, spec.equalities):
            offset, ratio, *more = (float(part) for part in equality.data[:5])
            if equality.type != mujoco.mjtEq.mjEQ_JOINT or any(more) or not equality.name2:
                what = "an unsupported equality: valid is the position of a joint as a line of that of another"
                errors.append(self._element(equality, "equality").error(what, equality.name1))
            its = {"joint": equality.name2, "multiplier": repr(ratio), "offset": repr(offset)}
            self._mimics.setdefault(equality.name1, []).append(self._element(equality, "mimic", its))
        if errors:
            raise BadRobot([*map(str, errors)], ())
        for material in spec.materials:
            material.textures = [""] * len(material.textures)
        for part in (*spec.meshes, *spec.textures, *spec.hfields, *spec.skins, *spec.sensors, *spec.keys):
            spec.delete(part)
        for size in SIZES:
            setattr(spec, size, -1)
        spec.nuserdata = spec.nkey = 0
        for actuator in spec.actuators:
            actuator.nsample, actuator.delay = 0, 0.0

    def _weighs(self, geom: Any) -> bool:
        """Whether a shape has a share in the mass of its body."""
        low, high = self._spec.compiler.inertiagrouprange
        inertial = geom.parent.explicitinertial and int(self._spec.compiler.inertiafromgeom) != 1
        mass = geom.density if isnan(geom.mass) else geom.mass
        return mass > 0.0 and not inertial and low <= geom.group <= high and geom.parent.name != "world"

    def _mesh(self, geom: Any, kind: str, mesh: Any) -> Element:
        """Return the shape of a mesh, and for one beyond URDF a shape that is refused there."""
        if kind != "mesh" or mesh is None:
            return self._element(geom, f"{kind} of a mesh" if geom.meshname else kind)
        if any(mesh.refpos) or list(mesh.refquat) != [1.0, 0.0, 0.0, 0.0]:
            return self._element(geom, "mesh with refpos or refquat")
        file = posixpath.basename(mesh.file) if self._spec.strippath else mesh.file
        filename = posixpath.join(self._spec.compiler.meshdir, file)
        return self._element(geom, "mesh", {"filename": filename, "scale": _text(mesh.scale)})

    def _element(
        self, of: Any, tag: str, attributes: dict[str, str] | None = None, children: Sequence[Element] = ()
    ) -> Element:
        return Element(self._path, _line_of(of), tag, attributes or {}, [*children])

    def elements(self, m: Any) -> Iterator[Element]:
        """Yield the links and joints of the compiled model."""
        shapes = {int(geom.id): shape for geom, shape in self._stood_in}
        of_body: dict[int, list[Element]] = {}
        for geom in sorted(self._spec.geoms, key=_number):
            number = int(geom.id)
            shape = shapes.get(number) or self._primitive(geom, m)
            of_body.setdefault(int(m.geom_bodyid[number]), []).extend(self._owners(geom, shape, m))
        ends: dict[int, tuple[str, Vector]] = {}
        """The link of each body, and the origin of that link in the frame of the body."""
        for body in sorted(self._spec.bodies, key=_number)[1:]:
            parent = int(m.body_parentid[body.id])
            name = body.name or f"body{body.id}"
            joints = sorted(body.joints, key=_number)
            parts = self._inertial(body, m)
            above = ends.get(parent, ("world", ORIGIN))
            place = _vector(m.body_pos[body.id]), _xyzw(m.body_quat[body.id])
            if parent == 0:
                place = ORIGIN, UPRIGHT
                if joints and joints[0].type == mujoco.mjtJoint.mjJNT_FREE:
                    parts.append(self._element(joints.pop(), "freejoint"))
                if joints:
                    yield self._element(body, "link", {"name": above[0]})
            origin = ORIGIN
            for index, joint in enumerate(joints or [None] * (parent > 0)):
                anchor = ORIGIN if joint is None else _vector(m.jnt_pos[joint.id])
                if index == 0:
                    at = moved(moved(place[0], rotate(place[1], anchor), 1.0), above[1], -1.0), place[1]
                else:
                    at = moved(anchor, origin, -1.0), UPRIGHT
                child = name if index >= len(joints) - 1 else f"{name}.{index + 1}"
                if child != name:
                    yield self._element(body, "link", {"name": child})
                yield self._joint(joint or body, m, self._origin(body, *at), above[0], child)
                above, origin = (child, ORIGIN), anchor
            parts += of_body.get(int(body.id), [])
            for part in parts:
                for its in part.all_of("origin"):
                    shifted = moved(_vector(its.attributes["xyz"].split()), origin, -1.0)
                    its.attributes["xyz"] = _text(shifted)
            yield self._element(body, "link", {"name": name}, parts)
            ends[int(body.id)] = name, origin

    def _origin(self, of: Any, position: Iterable[float], orientation: Iterable[float]) -> Element:
        return self._element(of, "origin", {"xyz": _text(position), "quat_xyzw": _text(orientation)})

    def _inertial(self, body: Any, m: Any) -> list[Element]:
        """Return the mass of a body, and what its weight has beside that."""
        number = body.id
        x, y, z = map(repr, _vector(m.body_inertia[number]))
        parts = [
            self._element(body, "mass", {"value": repr(float(m.body_mass[number]))}),
            self._element(body, "inertia", {"ixx": x, "iyy": y, "izz": z}),
            self._origin(body, _vector(m.body_ipos[number]), _xyzw(m.body_iquat[number])),
        ]
        found = [self._element(body, "inertial", children=parts)] if m.body_mass[number] > 0.0 else []
        return found + ([self._element(body, "gravcomp")] if m.body_gravcomp[number] else [])

    def _primitive(self, geom: Any, m: Any) -> Element:
        kind = mujoco.mjtGeom(m.geom_type[geom.id]).name.removeprefix("mjGEOM_").lower()
        size = _vector(m.geom_size[geom.id])
        if kind == "box":
            return self._element(geom, kind, {"size": _text(2.0 * half for half in size)})
        return self._element(geom, kind, {"radius": repr(size[0]), "length": repr(2.0 * size[1])})

    def _owners(self, geom: Any, shape: Element, m: Any) -> Iterator[Element]:
        """Yield the collision and the visual of a shape."""
        number = geom.id
        colour = m.geom_rgba[number]
        if m.geom_matid[number] >= 0 and tuple(geom.rgba) == UNPAINTED:
            colour = m.mat_rgba[m.geom_matid[number]]
        painted = self._element(geom, "material", children=[self._element(geom, "color", {"rgba": _text(colour)})])
        for owner, is_one in (
            ("collision", m.geom_contype[number] or m.geom_conaffinity[number]),
            ("visual", geom.group < SHOWN_GROUPS),
        ):
            if is_one:
                at = self._origin(geom, _vector(m.geom_pos[number]), _xyzw(m.geom_quat[number]))
                yield self._element(
                    geom, owner, children=[at, self._element(geom, "geometry", children=[shape]), painted]
                )

    def _joint(self, of: Any, m: Any, origin: Element, parent: str, child: str) -> Element:
        """Return the joint of a link; `of` is one of the model, or the body of a link that is fixed."""
        ends = [self._element(of, "parent", {"link": parent}), self._element(of, "child", {"link": child})]
        if not isinstance(of, mujoco.MjsJoint):
            return self._element(of, "joint", {"name": child, "type": "fixed"}, [origin, *ends])
        number = int(of.id)
        dof, is_limited = m.jnt_dofadr[number], bool(m.jnt_limited[number])
        turning = "revolute" if is_limited else "continuous"
        kind = {**JOINTS, mujoco.mjtJoint.mjJNT_SLIDE: "prismatic"}.get(of.type, turning)
        effort, limit = self._effort(number, m), dict[str, str]()
        if is_limited:
            low, high = map(float, m.jnt_range[number] - m.qpos0[m.jnt_qposadr[number]])
            limit = {"lower": repr(low), "upper": repr(high)}
        if effort < inf:
            limit["effort"] = repr(effort)
        parts = [
            self._element(of, "axis", {"xyz": _text(m.jnt_axis[number])}),
            self._element(of, "dynamics", {"damping": repr(float(m.dof_damping[dof]))}),
        ]
        if limit:
            parts.append(self._element(of, "limit", limit))
        passed = (("armature", m.dof_armature[dof]), ("frictionloss", m.dof_frictionloss[dof]))
        for tag, value in (*passed, ("stiffness", m.jnt_stiffness[number])):
            if value:
                parts.append(self._element(of, tag))
        parts += self._mimics.get(of.name, [])
        return self._element(of, "joint", {"name": of.name or f"joint{number}", "type": kind}, [origin, *ends, *parts])

    def _effort(self, joint: int, m: Any) -> float:
        """Return the greatest force of a joint: that of its actuators, and of the joint itself."""
        most = 0.0
        for actuator in range(m.nu):
            if m.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT or m.actuator_trnid[actuator, 0] != joint:
                continue
            force = inf
            if m.actuator_forcelimited[actuator]:
                force = float(abs(m.actuator_forcerange[actuator]).max())
            elif m.actuator_ctrllimited[actuator] and not m.actuator_biastype[actuator]:
                force = float(abs(m.actuator_gainprm[actuator, 0] * m.actuator_ctrlrange[actuator]).max())
            most = max(most, force * abs(float(m.actuator_gear[actuator, 0])))
        limited = float(abs(m.jnt_actfrcrange[joint]).max()) if m.jnt_actfrclimited[joint] else inf
        return min(most or inf, limited)


def _number(element: Any) -> int:
    return int(element.id)


def _line_of(element: Any) -> int:
    line = re.search(r"line (\d+)", element.info)
    return int(line[1]) if line else 1


def _vector(array: Iterable[Any]) -> Vector:
    x, y, z = map(float, array)
    return x, y, z


def _xyzw(array: Iterable[Any]) -> Quaternion:
    w, x, y, z = map(float, array)
    return x, y, z, w


def _text(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
