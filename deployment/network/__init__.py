"""The network part of a deployment: rules of links, impairments, radios, presets, traces."""
