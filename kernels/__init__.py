"""Kernels of rays and pictures: C beside twins in numpy of equal bits.

C has the two loops that numpy is slow at: the hits of rays, and the nearest triangle at each pixel. `C` is the module
that was compiled when foosim was installed, None where no C compiler was: then the twins compute the same, more slowly.
"""

from __future__ import annotations

from typing import Any, Final

try:
    from foosim.kernels import _kernels as _compiled  # type: ignore[attr-defined]
except ImportError:
    _compiled = None

C: Final[Any] = _compiled
"""The compiled functions; None without a C compiler."""
KERNELS: Final = "compiled" if C is not None else "in numpy: the same bits, more slowly; no C compiler built them"
"""What doctor reports of the kernels."""
