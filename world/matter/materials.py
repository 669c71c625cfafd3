"""The effect of things on radio waves that pass through them: the names of materials, and the schema.

In a deployment a thing's `radio` is a material's name (`radio: concrete`), a material with the thickness of a shell
(`{is: glass, thickness: 6 mm}`), a fixed loss (`{loss: 5 dB}`), or `none`. Names are those of Recommendation ITU-R
P.2040 (effects of building materials and structures on radiowave propagation), table 3; the vHub computes the loss of
such a material at a frequency.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.names import nearest_quoted
from foosim.common.spec_base import Length, SpecBase
from foosim.common.units import Quantity, custom_error

MaterialName = Literal["concrete", "brick", "plasterboard", "wood", "glass", "chipboard", "metal"]
MATERIALS: Final[tuple[MaterialName, ...]] = (
    "concrete",
    "brick",
    "plasterboard",
    "wood",
    "glass",
    "chipboard",
    "metal",
)
NONE: Final = "none"
"""In place of a material: waves pass without loss."""

Loss = Annotated[float, Quantity(units.LEVEL, "0 dB", "200 dB")]


class RadioMaterial(SpecBase):
    """A material (`is`), with the `thickness` of a shell where it is one, or a fixed `loss` for each crossing."""

    is_: MaterialName | None = Field(default=None, alias="is")
    thickness_m: Length | None = Field(default=None, alias="thickness")
    loss_db: Loss | None = Field(default=None, alias="loss")

    @property
    def is_transparent(self) -> bool:
        return self.loss_db == 0.0

    @property
    def needs_chord(self) -> bool:
        """Whether the loss depends on the way through the thing: it is neither a shell nor a fixed loss."""
        return self.loss_db is None and self.thickness_m is None


def _from_text(value: object) -> object:
    """A material's name, or `none`, as the mapping that it abbreviates."""
    if not isinstance(value, str):
        return value
    if value == NONE:
        return {"loss": "0 dB"}
    if value not in MATERIALS:
        choices = (*MATERIALS, NONE)
        problem = f"not one of {', '.join(choices)}, and no mapping with is or loss"
        raise custom_error(BadValue(problem, value, nearest_quoted(value, choices)))
    return {"is": value}


_Text = Literal["concrete", "brick", "plasterboard", "wood", "glass", "chipboard", "metal", "none"]
Radio = Annotated[RadioMaterial, BeforeValidator(_from_text, json_schema_input_type=_Text | RadioMaterial)]


def _material(**keys: Any) -> RadioMaterial:
    return RadioMaterial.model_validate(keys)


UNKNOWN: Final = _material(loss="5 dB")
"""A body of unknown material: the loss of an internal wall in ns-3 (`InternalWallLoss`, building models)."""
OPEN: Final = _material(loss="0 dB")
"""A thing that waves pass without loss."""
CONCRETE: Final = _material(**{"is": "concrete"})
METAL: Final = _material(**{"is": "metal"})
WOOD: Final = _material(**{"is": "wood"})
PLASTIC: Final = _material(loss="0.5 dB")
"""Figures and balls. A judgement without a source, as P.2040 has no polymers: 3 cm of its wood lose 0.4 to 0.7 dB."""
