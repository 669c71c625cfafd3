"""Masses of a tree of links: each joint that moves needs one to move, so a link without a mass borrows from another.

Files have links without a mass between two joints (the x, y and yaw of a base that slides) and at the end of one (the
frame of a camera that pans). The equations of motion of such a link have no unique solution. It gets a thousandth of
the heaviest link that it carries, which changes the motion of the robot by as little; one that carries none gets a
thousandth of the nearest link with a mass that carries it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from foosim.world.bodies.findings import Findings
from foosim.world.bodies.inertia import Principal
from foosim.world.bodies.urdf_joints import Tree
from foosim.world.scene import MOVING, UPRIGHT

SHARE: Final = 0.001


def with_masses(tree: Tree, findings: Findings) -> Tree:
    """Return a tree in which each joint that moves has a mass to move."""
    numbers = {link.name: number for number, (link, _) in enumerate(tree)}
    parents = [-1 if joint is None else numbers[joint.parent] for _, joint in tree]
    movers: list[int] = []
    """Of each link the one that moves it: the first link of the rigid part that it belongs to."""
    for number, (_, joint) in enumerate(tree):
        movers.append(number if joint is None or joint.kind in MOVING else movers[parents[number]])
    masses = [link.mass for link, _ in tree]
    heaviest = [*range(len(tree))]
    """Of each link the heaviest among it and the links that it carries."""
    for number in range(len(tree) - 1, 0, -1):
        if masses[heaviest[number]] > masses[heaviest[parents[number]]]:
            heaviest[parents[number]] = heaviest[number]
    heavy = {movers[number] for number, mass in enumerate(masses) if mass > 0.0}
    found = list(tree)
    for number, (link, joint) in enumerate(tree):
        if joint is None or joint.kind not in MOVING or number in heavy:
            continue
        source = heaviest[number]
        if masses[source] == 0.0:
            source = parents[number]
            while source > 0 and masses[source] == 0.0:
                source = parents[source]
        if masses[source] == 0.0:
            source = heaviest[0]
        if masses[source] == 0.0:
            findings.error(link.element, f"the joint {joint.name} moves nothing: no link has a mass", link.name)
            continue
        lender = tree[source][0]
        x, y, z = lender.inertia.moments
        mass, mean = SHARE * masses[source], SHARE * (x + y + z) / 3.0
        lent = f"it has {mass:.3g} kg and moments of {mean:.3g} kg m2, a thousandth of {lender.name}"
        findings.note(link.element, f"link {link.name} has no mass and moves", lent)
        found[number] = replace(link, mass=mass, inertia=Principal((mean, mean, mean), UPRIGHT)), joint
    return found
