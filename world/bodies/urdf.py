"""A robot from a URDF file: a tree of links with masses, joints and convex shapes, as data of a body.

Unsupported parts are refused with file, line and the valid choices: mimic joints, loops, planar and floating joints,
plugins, impossible masses and inertias. Parts that do not concern the body are passed over and noted. Visual geometry
is not read: a robot is drawn by its collision shapes. Pure: the contents of files are given.

Source of the format: the XML specification of URDF at wiki.ros.org/urdf/XML; `capsule` is an extension that Bullet and
newer tools of ROS share.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from foosim.world.bodies.inertia import MassOf, combined, placed, principal_of
from foosim.world.bodies.urdf_joints import JointPart, in_tree, read_joint
from foosim.world.bodies.urdf_links import LinkPart, materials_of, mesh_paths, read_link
from foosim.world.bodies.xml_tree import Element, read_xml
from foosim.world.scene import MOVING, ORIGIN, UPRIGHT, Body, Link, Quaternion, Shape, Vector, multiply, rotate

SUFFIX: Final = ".urdf"
SHAPES_MAX: Final = 256
KEPT: Final = 32
"""The count of files whose robots are kept."""
NOTED: Final = {
    "transmission": "actuators are the deployment's",
    "gazebo": "it is for another simulator",
    "safety_controller": "limits are the joint's",
    "calibration": "joints are where they are",
    "sensor": "sensors are the deployment's",
    "visual": "a robot is drawn by its collision shapes, in the colour of the first visual",
    "self_collision_checking": "contacts are the engine's",
    "contact": "surfaces are the deployment's",
    "friction": "joints have damping alone",
    "texture": "shapes have a colour",
}
"""Elements that are passed over, and the reasons."""
KNOWN: Final = {
    "robot": ("link", "joint", "material"),
    "link": ("inertial", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot as its file describes it. `links` are in their tree's order, from the root, which has a fixed joint.

    `joints` are the names of the joints, one for each link; the root's is empty. `notes` name the elements passed over.
    """

    name: str
    file: str
    links: tuple[Link, ...]
    joints: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def moving(self) -> tuple[str, ...]:
        """The names of the joints that move, in the order of their numbers."""
        pairs = zip(self.links, self.joints, strict=True)
        return tuple([joint for link, joint in pairs if link.joint in MOVING])

    @property
    def mass(self) -> float:
        """Of all links (kg)."""
        return sum(link.mass for link in self.links)


@lru_cache(maxsize=KEPT)
def meshes_of(path: str, content: bytes) -> tuple[str, ...]:
    """Return the files of the meshes that a URDF file names, inside the asset folder. Raises AssetError."""
    return tuple(mesh_paths(_robot_of(path, content)))


def place_of_mesh(path: str, content: bytes, mesh: str) -> str:
    """Return the `file:line` at which a URDF file names a mesh first."""
    return mesh_paths(_robot_of(path, content))[mesh].place


def read_urdf(path: str, files: Mapping[str, bytes]) -> Robot:
    """Return the robot in the URDF file of this path; its meshes are in `files`, too. Raises AssetError."""
    meshes = tuple([(mesh, files[mesh]) for mesh in meshes_of(path, files[path]) if mesh in files])
    return _read(path, files[path], meshes)


@lru_cache(maxsize=KEPT)
def _read(path: str, content: bytes, meshes: tuple[tuple[str, bytes], ...]) -> Robot:
    robot = _robot_of(path, content)
    _check_refused(robot)
    links = _links(robot, dict(meshes))
    names = {link.name for link in links}
    joints: list[JointPart] = []
    for element in robot.all_of("joint"):
        joint = read_joint(element, names)
        other = next((one for one in joints if one.name == joint.name), None)
        if other is not None:
            raise element.error(f"a joint with the name of that of line {other.line}", joint.name)
        joints.append(joint)
    tree = in_tree(path, links, joints)
    index = {link.name: number for number, (link, _) in enumerate(tree)}
    made = tuple([_link(link, joint, index) for link, joint in tree])
    named = tuple(["" if joint is None else joint.name for _, joint in tree])
    return Robot(robot.attributes.get("name", ""), path, made, named, tuple(_notes(robot)))


def _robot_of(path: str, content: bytes) -> Element:
    robot = read_xml(path, content)
    if any(key.startswith("xmlns:xacro") for key in robot.attributes) and [*_macros(robot)]:
        raise next(_macros(robot)).error("an unexpanded file of xacro: write the output of `xacro FILE`")
    if robot.tag != "robot":
        raise robot.error("no URDF: the outermost element is robot", robot.tag)
    return robot


def _macros(element: Element) -> Iterator[Element]:
    for child in element.children:
        if child.tag.startswith("xacro:") or any("${" in value for value in child.attributes.values()):
            yield child
        yield from _macros(child)


def _check_refused(robot: Element) -> None:
    """Refuse elements by name without which this would be another robot."""
    for element in robot.below("plugin"):
        name = element.attributes.get("filename") or element.attributes.get("name", "")
        what = "an unsupported plugin: sensors, actuators and rules are the deployment's; remove it here"
        raise element.error(what, name)
    for element in robot.all_of("loop_joint", "model", "include"):
        raise element.error("not a part of URDF that makes a tree of links", element.tag)


def _links(robot: Element, files: Mapping[str, bytes]) -> list[LinkPart]:
    colours = materials_of(robot)
    links: dict[str, LinkPart] = {}
    shapes = 0
    for element in robot.all_of("link"):
        link = read_link(element, colours, files)
        if link.name in links:
            raise element.error(f"a link with the name of that of line {links[link.name].line}", link.name)
        links[link.name] = link
        shapes += len(link.shapes)
        if shapes > SHAPES_MAX:
            raise element.error(f"more than {SHAPES_MAX} collision shapes")
    if not links:
        raise robot.error("a robot without links")
    if shapes == 0:
        raise robot.error("a robot without a collision shape: nothing would touch it, nor see it")
    return [*links.values()]


def _link(link: LinkPart, joint: JointPart | None, index: Mapping[str, int]) -> Link:
    made = Link(
        link.name, "fixed", link.shapes, link.mass.mass, link.moments, link.mass.centre, principal=link.principal
    )
    if joint is None:
        return made
    return replace(
        made,
        joint=joint.kind,
        joint_name=joint.name,
        axis=joint.axis,
        limits=joint.limits,
        parent=index[joint.parent],
        position=joint.place.position,
        orientation=joint.place.orientation,
        effort=joint.effort,
        speed=joint.speed,
        damping=joint.damping,
    )


def _notes(robot: Element) -> Iterator[str]:
    """Yield the elements that were passed over, each once, with its lines."""
    lines: dict[str, list[int]] = {}
    passed = [(child, robot) for child in robot.children if child.tag not in KNOWN["robot"]]
    for part in robot.all_of("link", "joint"):
        passed += [(child, part) for child in part.children if child.tag not in KNOWN[part.tag]]
        for dynamics in part.all_of("dynamics"):
            if dynamics.attributes.get("friction", "0").strip("0.") != "":
                lines.setdefault("friction", []).append(dynamics.line)
    for texture in robot.below("texture"):
        lines.setdefault("texture", []).append(texture.line)
    for element, _ in passed:
        lines.setdefault(element.tag, []).append(element.line)
    for tag, where in sorted(lines.items()):
        shown = ", ".join(map(str, where[:8])) + (", ..." if len(where) > 8 else "")
        why = NOTED.get(tag, "it is not part of a body")
        yield f"{tag} ({'line' if len(where) == 1 else 'lines'} {shown}): {why}"


# --- the body --------------------------------------------------------------------------------------------------------


def free_base_problem(robot: Robot) -> str:
    """Return why a robot cannot have a free base: one needs a mass; empty if it can."""
    if _base_mass(robot).mass > 0.0:
        return ""
    return f"a free robot whose first link {robot.links[0].name}, with all that is fixed to it, has no mass"


def body_of(
    robot: Robot,
    name: str,
    position: Vector,
    orientation: Quaternion,
    *,
    fixed: bool,
    surface: str,
    speed_limit: float = 0.0,
) -> Body:
    """Return a robot as the body `name`, the frame of its first link at this pose; its links are `name/LINK`.

    A fixed body's base has that pose. A free body's first link is free; where it has no mass of its own, it has that of
    the links that are fixed to it, which keep their shapes.
    """
    links = [replace(link, name=f"{name}/{link.name}", shapes=_with(link.shapes, surface)) for link in robot.links]
    if fixed:
        return Body(name, "urdf", position, tuple(links), orientation=orientation, antenna_link=0)
    assert not free_base_problem(robot), robot.name
    if links[0].mass == 0.0:
        links = _with_base_mass(robot, links)
    links[0] = replace(links[0], joint="free")
    return Body(name, "urdf", ORIGIN, tuple(links), speed_limit=speed_limit, antenna_link=0)


def start_of(body: Body, position: Vector, orientation: Quaternion) -> tuple[Vector, Quaternion]:
    """Return the slots `position` and `orientation` of a free body whose first link's frame has this pose."""
    link = body.links[0]
    x, y, z = rotate(orientation, link.centre_of_mass)
    turned = orientation if link.principal == UPRIGHT else multiply(orientation, link.principal)
    return (position[0] + x, position[1] + y, position[2] + z), turned


def _with(shapes: tuple[Shape, ...], surface: str) -> tuple[Shape, ...]:
    return tuple([replace(shape, surface=surface) for shape in shapes])


def _base(robot: Robot) -> dict[int, tuple[Vector, Quaternion]]:
    """Return the poses, in the first link's frame, of the links that are fixed to it, and its own."""
    poses: dict[int, tuple[Vector, Quaternion]] = {0: (ORIGIN, UPRIGHT)}
    for number, link in enumerate(robot.links[1:], 1):
        if link.joint == "fixed" and link.parent in poses:
            position, orientation = poses[link.parent]
            x, y, z = rotate(orientation, link.position)
            place = position[0] + x, position[1] + y, position[2] + z
            poses[number] = place, multiply(orientation, link.orientation)
    return poses


def _base_mass(robot: Robot) -> MassOf:
    """Return the mass of the first link with all that is fixed to it, in its frame."""
    parts = []
    for number, (position, orientation) in _base(robot).items():
        link = robot.links[number]
        x, y, z = link.inertia
        own = placed(MassOf(link.mass, ORIGIN, (x, 0.0, 0.0, y, 0.0, z)), link.centre_of_mass, link.principal)
        parts.append(placed(own, position, orientation))
    return combined(parts)


def _with_base_mass(robot: Robot, links: list[Link]) -> list[Link]:
    """Return links of which the first has the mass of all that is fixed to it, and these have none."""
    whole = _base_mass(robot)
    moments, axes = principal_of(whole.tensor)
    found = [
        replace(link, mass=0.0, inertia=ORIGIN, centre_of_mass=ORIGIN, principal=UPRIGHT) if number in held else link
        for held in [_base(robot)]
        for number, link in enumerate(links)
    ]
    found[0] = replace(found[0], mass=whole.mass, inertia=moments, centre_of_mass=whole.centre, principal=axes)
    return found
