"""Components in the frames of a layout: what they see, how they are made, and how they are sampled."""
