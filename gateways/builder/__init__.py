"""MORSE's builder: its scripts become deployments.

`record` runs a script in a process of its own, `export` writes the deployment. What robots, components and scenes of
MORSE are here is in `robots.yaml`, `components.yaml` and `scenes.yaml`.
"""
