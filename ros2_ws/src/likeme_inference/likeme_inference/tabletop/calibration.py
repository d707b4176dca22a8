"""What was predicted of actions, beside what became of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from likeme_core.outcomes import Actor
from likeme_inference.tabletop.promise import WINDOW, Promise
from likeme_inference.tabletop.values import Outcome, Result


@dataclass(frozen=True)
class Calibration:
    """The latest WINDOW actions of the robot whose end was seen.

    Attributes:
        actions: predicted success, and whether the goal was reached, oldest first.
    """

    actions: tuple[tuple[float, bool], ...] = ()

    def after(self, outcome: Outcome) -> Calibration:
        """With an outcome; unchanged if the robot did not act, or its end was not seen."""
        seen = outcome.result in (Result.REACHED, Result.MISSED)
        if outcome.actor is not Actor.ROBOT or not seen or math.isnan(outcome.predicted_success):
            return self
        action = outcome.predicted_success, outcome.result is Result.REACHED
        return Calibration((*self.actions, action)[-WINDOW:])

    @property
    def promised(self) -> float:
        """Mean predicted success; NaN without actions."""
        return _mean([predicted for predicted, _ in self.actions])

    @property
    def realised(self) -> float:
        """Share of actions that reached their goal; NaN without actions."""
        return _mean([float(reached) for _, reached in self.actions])

    def sentence(self, promise: Promise | None = None) -> str:
        """For people; promise: that is kept, if one is."""
        if promise is not None:
            counting = ' times, help counting' if promise.recent else ''
            return f'I {promise.sentence}{counting}.'
        if not self.actions:
            return 'I have seen the end of no action yet.'
        times = f'last {len(self.actions)} actions' if len(self.actions) > 1 else 'last action'
        return f'I promised {self.promised:.0%} and kept {self.realised:.0%} of my {times}.'


def _mean(values: list[float]) -> float:
    return sum(values) / len(values) if values else math.nan
