"""Pads whose influence is a multiple of what numbers of 16 bits tell apart."""

from dataclasses import replace

from fringeforce.models.int16_matrix import Packed
from fringeforce.models.pad import PadModel


def in_whole_numbers(model: PadModel) -> PadModel:
    """The nearest model that the compiled loops, which have it in 16 bits, take as it is."""
    packed = [Packed.of(quarter) for quarter in model.influence.quarters]
    quarters = tuple(part.numbers * part.scale[:, None] for part in packed)
    return replace(model, influence=replace(model.influence, quarters=quarters))
