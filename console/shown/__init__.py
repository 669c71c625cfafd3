"""What a page shows of a world, whatever it comes from: scene, poses, overlays, links, curves, marks."""
