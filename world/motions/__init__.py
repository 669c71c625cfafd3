"""Motions: how entities without rigid-body dynamics go on, one file each."""
