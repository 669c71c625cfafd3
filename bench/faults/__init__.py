"""Faults on real processes: each kind again and again at random times, with the figures that it must hold.

`python -m bench.faults` runs the kinds (`kinds`), each on runs of its own (`cluster`), and every run must end with the
digests of an undisturbed rehearsal.
"""
