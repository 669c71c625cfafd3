"""MORSE's builder: its scripts become deployments.

`script` runs one in a process of its own, where `record` notes what it makes; `export` writes the deployment. Robots,
components and scenes of MORSE are in `robots.yaml`, `components.yaml` and `scenes.yaml`.
"""
