"""The contents of a page, for any kind of source: scene, poses, overlays, links, curves, marks."""
