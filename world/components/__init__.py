"""Components in the frames of a layout: their base classes, views, building and sampling."""
