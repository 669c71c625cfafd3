"""How fast foosim is, and where the time goes: `python -m bench`. No tests: figures depend on the machine.

One file for each bench: a typed function that returns a dataclass, and a row of `benches`.
"""
