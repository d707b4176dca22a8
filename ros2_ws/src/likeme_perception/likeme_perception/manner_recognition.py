"""The manner of an act, from how high the object rose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp

from likeme_core.tabletop import Manner

#: Rise of what people set down somewhere else, and by how much less than its height of fall an
#: object rises that is let fall, m; measured with the simulated person (0.10 to 0.11,
#: 0.03 to 0.05).
CARRIED, BELOW_GRASP = 0.105, 0.04


def manner_probability(
    rise: float, place_rise: float, scale: float, manners: Sequence[Manner]
) -> dict[Manner, float]:
    """p(manner) of a rise above where the object lay; sums to 1.

    An object that was slid does not rise; one that was let fall rose to about the manner's height
    of fall. Between two manners lies a logistic transition.

    Args:
        rise: m.
        place_rise: at which sliding and lifting are equally likely, m.
        scale: width of every transition, m.
        manners: that the world's actions have; PLACE and PUSH are always considered.
    """
    p = {Manner.PUSH: 1.0}
    falls = sorted((m for m in manners if m.handling.fall), key=lambda m: m.handling.fall)
    borders = [(Manner.PLACE, place_rise)]
    lower = CARRIED
    for manner in falls:
        rise_to_fall = manner.handling.fall - BELOW_GRASP
        borders.append((manner, (lower + rise_to_fall) / 2))
        lower = rise_to_fall
    below = Manner.PUSH
    for manner, border in borders:
        above = 1 / (1 + exp(min(50.0, -(rise - border) / scale)))
        p[below], p[manner] = p[below] * (1 - above), p[below] * above
        below = manner
    return p


def with_missing_frames(p: Mapping[Manner, float], share: float) -> dict[Manner, float]:
    """p(manner) when a share of the motion was not seen.

    The rise that was seen is a lower bound then: in that share of the cases the manner is any of
    those that rise as high or higher, in the order of `p`.
    """
    order = list(p)
    mixed = dict.fromkeys(order, 0.0)
    for k, manner in enumerate(order):
        mixed[manner] += p[manner] * (1 - share)
        for higher in order[k:]:
            mixed[higher] += p[manner] * share / len(order[k:])
    return mixed
