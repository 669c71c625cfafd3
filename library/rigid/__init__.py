"""Rigid bodies of any kind: primitives, URDF, joints, grippers."""
