"""A robot from a URDF file: a tree of links with masses, joints, convex shapes and looks, as data of a body.

A file is read as it is, as far as its robot can be computed. What would be another robot is an error: loops, planar and
floating joints, masses below 0. What does not concern the body is passed over, and what has one plain meaning is
mended; both are noted. All errors of a file are reported at once. Pure: the contents of files are given.

Source of the format: the XML specification of URDF at wiki.ros.org/urdf/XML; `capsule` is an extension that Bullet and
newer tools of ROS share.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from foosim.common.errors import show
from foosim.world.bodies.findings import Findings
from foosim.world.bodies.inertia import MassOf, combined, placed, principal_of, without_rounding
from foosim.world.bodies.urdf_joints import Following, JointPart, Tree, followers_of, in_tree, read_joint
from foosim.world.bodies.urdf_links import PACKAGE, LinkPart, mesh_path, meshes_in, read_link
from foosim.world.bodies.urdf_masses import with_masses
from foosim.world.bodies.urdf_values import name_of
from foosim.world.bodies.urdf_visuals import first_colour, materials_of, read_visuals
from foosim.world.bodies.xml_tree import BadElement, Element, read_xml
from foosim.world.scene import MOVING, ORIGIN, UPRIGHT, Body, Link, Mimic, Quaternion, Shape, Vector, multiply, rotate

SUFFIX: Final = ".urdf"
MJCF: Final = ".xml"
XACRO: Final = ".xacro"
SHAPES_MAX: Final = 256
"""Of collision: pairs of shapes that may touch are listed, and their count grows with its square."""
KEPT: Final = 32
"""The count of files whose robots are kept."""
NOTED: Final = {
    "transmission": "actuators are the deployment's",
    "gazebo": "it is for another simulator",
    "plugin": "sensors, actuators and rules are the deployment's",
    "ros2_control": "actuators are the deployment's",
    "safety_controller": "limits are the joint's",
    "calibration": "joints are where they are",
    "sensor": "sensors are the deployment's",
    "self_collision_checking": "contacts are the engine's",
    "contact": "surfaces are the deployment's",
    "friction": "joints have damping alone",
    "texture": "shapes have a colour",
    "actuator": "actuators are the deployment's",
    "geom": "scenery is the deployment's",
    "freejoint": "the deployment frees the base (`fixed: false`)",
    "gravcomp": "all bodies have their weight",
    **dict.fromkeys(("armature", "frictionloss", "stiffness"), "joints have damping alone"),
}
"""Elements that are passed over, and the reasons."""
KNOWN: Final = {
    "robot": ("link", "joint", "material"),
    "link": ("inertial", "collision", "visual"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}
REFUSED: Final = ("loop_joint", "model", "include", "deformable")
"""Elements without which this would be another robot."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot as its file describes it. `links` are in their tree's order, from the root, which has a fixed joint.

    `notes` are what a person should know of the file: passed over, mended, without effect.
    """

    name: str
    file: str
    links: tuple[Link, ...]
    notes: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints, one for each link; the root's is empty."""
        return tuple([link.joint_name for link in self.links])

    @property
    def moving(self) -> tuple[str, ...]:
        """The names of the joints that move, in the order of their numbers."""
        return tuple([link.joint_name for link in self.links if link.joint in MOVING])

    @property
    def mass(self) -> float:
        """Of all links (kg)."""
        return sum(link.mass for link in self.links)


def meshes_of(path: str, content: bytes) -> tuple[str, ...]:
    """Return the files of the meshes that a URDF file names, in the asset folder: of collisions, and `drawn_path` of
    those of visuals. A mesh with an invalid path is left out. Raises AssetError."""
    return tuple(_mesh_elements(path, content))


def place_of_mesh(path: str, content: bytes, mesh: str) -> str:
    """Return the `file:line` at which a URDF file names a mesh first."""
    return _mesh_elements(path, content)[mesh].place


def is_packaged(path: str, content: bytes, mesh: str) -> bool:
    """Whether a URDF file names a mesh by its package."""
    return _mesh_elements(path, content)[mesh].attributes["filename"].startswith(PACKAGE)


@lru_cache(maxsize=KEPT)
def _mesh_elements(path: str, content: bytes) -> dict[str, Element]:
    robot = _robot_of(path, content)
    found: dict[str, Element] = {}
    for part, path_of in (("collision", mesh_path), ("visual", _drawn_mesh)):
        for mesh in meshes_in(robot, part):
            try:
                found.setdefault(path_of(mesh), mesh)
            except BadElement:  # an error, or a note, where it is read
                continue
    return found


def _drawn_mesh(mesh: Element) -> str:
    from foosim.world.bodies.visual_meshes import drawn_path

    return drawn_path(mesh_path(mesh))


def read_urdf(path: str, files: Mapping[str, bytes]) -> Robot:
    """Return the robot in the URDF file of this path; its meshes are in `files`, too.

    Raises AssetError; where the file can be read as XML it is a BadRobot with all errors.
    """
    meshes = tuple([(mesh, files[mesh]) for mesh in meshes_of(path, files[path]) if mesh in files])
    return _read(path, files[path], meshes)


@lru_cache(maxsize=KEPT)
def _read(path: str, content: bytes, meshes: tuple[tuple[str, bytes], ...]) -> Robot:
    robot, findings = _robot_of(path, content), Findings()
    name = findings.read("", name_of, robot) if robot.attributes.get("name", "").strip() else ""
    _note_passed_over(robot, findings)
    for element in robot.all_of(*REFUSED):
        findings.error(element, "not a part of URDF that makes a tree of links", element.tag)
    links = _links(robot, dict(meshes), findings)
    joints = _joints(robot, [link.name for link in links], findings)
    tree, following = _tree(links, joints, findings)
    notes = findings.notes()
    index = {link.name: number for number, (link, _) in enumerate(tree)}
    at = {joint.name: number for number, (_, joint) in enumerate(tree) if joint is not None}
    made = tuple([_link(link, joint, index, at, following) for link, joint in tree])
    return Robot(name, path, made, notes)


def _robot_of(path: str, content: bytes) -> Element:
    if path.endswith(MJCF):
        from foosim.world.bodies.mjcf import urdf_of  # brings MuJoCo

        return urdf_of(path, content)
    robot = read_xml(path, content)
    macro = next(_macros(robot), None)
    if macro is not None or path.endswith(XACRO):
        element, text = macro or (robot, "")
        raise element.error(unexpanded(path, text))
    if robot.tag != "robot":
        raise robot.error("no URDF: the outermost element is robot", robot.tag)
    return robot


def unexpanded(path: str, text: str = "") -> str:
    """Return the problem of a file of xacro, with a text of it: the command that makes a URDF file of it."""
    name = path.rpartition("/")[2]
    out = name.removesuffix(XACRO).removesuffix(SUFFIX) + SUFFIX
    command = f"xacro {name} > {out if out != name else 'robot' + SUFFIX}"
    return f"a file of xacro{f', {show(text)},' if text else ','} which makes a URDF file of it: {command}"


def _macros(robot: Element) -> Iterator[tuple[Element, str]]:
    """Yield what is xacro's in a robot: its elements, and texts that it computes in a part that is read."""
    for child in robot.children:
        if child.tag.startswith("xacro:"):
            yield child, child.tag
        elif child.tag in KNOWN["robot"]:
            yield from _computed(child)


def _computed(element: Element) -> Iterator[tuple[Element, str]]:
    if element.tag.startswith("xacro:"):
        yield element, element.tag
    for text in element.attributes.values():
        if "${" in text or "$(" in text:
            yield element, text
    for child in element.children:
        yield from _computed(child)


def _links(robot: Element, files: Mapping[str, bytes], findings: Findings) -> list[LinkPart]:
    colours = materials_of(robot, findings)
    links: dict[str, LinkPart] = {}
    shapes = 0
    for element in robot.all_of("link"):
        link = read_link(element, first_colour(element, colours), files, findings)
        looks = tuple(read_visuals(element, colours, files, findings))
        before, shapes = shapes, shapes + sum(1 for _ in element.all_of("collision"))
        if before <= SHAPES_MAX < shapes:
            findings.error(element, f"more than {SHAPES_MAX} collision shapes")
        if link is None:
            continue
        if link.name in links:
            line = links[link.name].element.line
            findings.error(element, f"a link with the name of that of line {line}", link.name)
            continue
        links[link.name] = replace(link, visuals=looks)
    if not any(robot.all_of("link")):
        findings.error(robot, "a robot without links")
    elif shapes == 0:
        findings.error(robot, "a robot without a collision shape: nothing would touch it, nor see it")
    return [*links.values()]


def _joints(robot: Element, links: Sequence[str], findings: Findings) -> list[JointPart] | None:
    """Return the joints; None where one has no valid name or ends, without which the tree is unknown."""
    joints: dict[str, JointPart] = {}
    complete = True
    for element in robot.all_of("joint"):
        joint = read_joint(element, links, findings)
        if joint is None:
            complete = False
        elif joint.name in joints:
            line = joints[joint.name].element.line
            findings.error(element, f"a joint with the name of that of line {line}", joint.name)
            complete = False
        else:
            joints[joint.name] = joint
    return [*joints.values()] if complete else None


def _tree(
    links: Sequence[LinkPart], joints: Sequence[JointPart] | None, findings: Findings
) -> tuple[Tree, Mapping[str, Following]]:
    if not links or joints is None:
        return [], {}
    made, following = followers_of(joints, findings)
    tree: Tree = findings.read([], in_tree, links, made)
    return with_masses(tree, findings), following


def _link(
    link: LinkPart,
    joint: JointPart | None,
    index: Mapping[str, int],
    at: Mapping[str, int],
    following: Mapping[str, Following],
) -> Link:
    made = Link(
        link.name,
        "fixed",
        link.shapes,
        link.mass,
        link.inertia.moments,
        link.centre_of_mass,
        principal=link.inertia.axes,
        visuals=link.visuals,
    )
    if joint is None:
        return made
    its = following.get(joint.name)
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
        mimic=None if its is None else Mimic(at[its.leader], its.ratio, its.offset),
    )


def _note_passed_over(robot: Element, findings: Findings) -> None:
    """Note the elements that are passed over."""
    passed = [child for child in robot.children if child.tag not in (*KNOWN["robot"], *REFUSED)]
    for part in robot.all_of("link", "joint"):
        passed += [child for child in part.children if child.tag not in KNOWN[part.tag]]
        for dynamics in part.all_of("dynamics"):
            if dynamics.attributes.get("friction", "0").strip("0.") != "":
                _note_passed(dynamics, "friction", findings)
    for element in (*passed, *robot.below("texture")):
        _note_passed(element, element.tag, findings)
    for plugin in (plugin for element in passed for plugin in element.below("plugin")):
        _note_passed(plugin, "plugin", findings)


def _note_passed(element: Element, tag: str, findings: Findings) -> None:
    findings.note(element, f"passed over: {tag}", NOTED.get(tag, "it is not part of a body"))


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
    surfaces: Iterable[str],
    speed_limit: float = 0.0,
) -> Body:
    """Return a robot as the body `name`, the frame of its first link at this pose; its links are `name/LINK`, with the
    surface of each.

    A fixed body's base has that pose. A free body's first link is free; where it has no mass of its own, it has that of
    the links that are fixed to it, which keep their shapes.
    """
    links = [
        replace(link, name=f"{name}/{link.name}", shapes=_with(link.shapes, surface))
        for link, surface in zip(robot.links, surfaces, strict=False)
    ]
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


def poses_of(links: Sequence[Link]) -> list[tuple[Vector, Quaternion]]:
    """Return the poses of links in the frame of the first one, all joints at 0."""
    poses: list[tuple[Vector, Quaternion]] = [(ORIGIN, UPRIGHT)]
    for link in links[1:]:
        position, orientation = poses[link.parent]
        x, y, z = rotate(orientation, link.position)
        place = position[0] + x, position[1] + y, position[2] + z
        poses.append((place, multiply(orientation, link.orientation)))
    return poses


def _base(robot: Robot) -> dict[int, tuple[Vector, Quaternion]]:
    """Return the poses, in the first link's frame, of the links that are fixed to it, and its own."""
    held = {0}
    for number, link in enumerate(robot.links[1:], 1):
        if link.joint == "fixed" and link.parent in held:
            held.add(number)
    poses = poses_of(robot.links)
    return {number: poses[number] for number in sorted(held)}


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
    inertia = without_rounding(moments)
    found = [
        replace(link, mass=0.0, inertia=ORIGIN, centre_of_mass=ORIGIN, principal=UPRIGHT) if number in held else link
        for held in [_base(robot)]
        for number, link in enumerate(links)
    ]
    found[0] = replace(found[0], mass=whole.mass, inertia=inertia, centre_of_mass=whole.centre, principal=axes)
    return found
