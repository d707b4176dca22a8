"""Demonstrations, beliefs, decisions and outcomes: a text log, and plots over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import rerun as rr

from likeme_core.stamps import SECOND
from likeme_core.tabletop import Manner
from likeme_core.world import World
from likeme_core.world.values import PALETTE, UNKNOWN
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.values import Result
from likeme_replay.decision_log import LogEntry, LogEvent
from likeme_replay.viewer.scene_stream import Pace, SceneStream

#: Entity of the text log.
STORY = 'story'
_INFO, _WARNING = rr.TextLogLevel.INFO, rr.TextLogLevel.WARN
_SUCCESS_COLOUR, _THRESHOLD_COLOUR = (90, 200, 120), (235, 95, 95)
_ANYWHERE_COLOUR = (150, 150, 150)
#: ns between two points of a plot while its value holds.
_HOLD_PERIOD = SECOND


class Story:
    """Logs `story`, `beliefs`, `joint_beliefs`, `success` and `decisions`, each by OBJECT."""

    def __init__(self, stream: SceneStream, world: World) -> None:
        self._stream, self._world = stream, world
        self._reason = ''
        self._hand = False
        self._values: dict[str, list[float]] = {}
        self._hold_pace = Pace(_HOLD_PERIOD)
        states = [state.name for state in world.states]
        state_colours = [entry.colour for entry in world.region_entries]
        actions = [action.name for action in world.actions]
        action_colours = [PALETTE[k % len(PALETTE)] for k in range(len(actions))]
        for name in world.objects:
            self._plot(f'beliefs/{name}', [f'P({name} {s})' for s in states], state_colours)
            goals = [*(f'P({name} {s})' for s in states), f'P({name} need not change)']
            self._plot(f'joint_beliefs/{name}', goals, [*state_colours, _ANYWHERE_COLOUR])
            self._plot(f'success/{name}', [f'{name} {a}' for a in actions], action_colours)
            labels = [f'{name}: predicted success', 'threshold']
            self._plot(f'decisions/{name}', labels, [_SUCCESS_COLOUR, _THRESHOLD_COLOUR])

    def show_event(self, entry: LogEntry) -> None:
        """Show one event."""
        show = {
            LogEvent.DEMONSTRATION: self._show_demonstration,
            LogEvent.BELIEF: self._show_belief,
            LogEvent.DECISION: self._show_decision,
            LogEvent.OUTCOME: self._show_outcome,
        }[entry.event]
        show(entry.stamp, entry.fields)

    def show_joint_belief(
        self, stamp: int, marginals: Mapping[str, list[float]], sentence: str
    ) -> None:
        """Show what is wanted of all objects.

        marginals: of each object P(region), and P(it need not change) last.
        """
        for name, wanted in marginals.items():
            self._add(stamp, f'joint_beliefs/{name}', wanted)
        self._say(stamp, sentence, _INFO)

    def show_view(self, stamp: int, hand_in_view: bool, reason: str) -> None:
        """Say when a hand comes or leaves, and when frames begin or cease to tell anything.

        Plotted values go on until the next event.
        """
        if self._hold_pace.due(stamp):
            for path, values in self._values.items():
                self._stream.log(stamp, path, rr.Scalars(values))
        if reason != self._reason:
            self._reason = reason
            sentence = f'All states are UNKNOWN: {reason}.' if reason else 'Frames tell again.'
            self._say(stamp, sentence, _WARNING if reason else _INFO)
        if hand_in_view != self._hand:
            self._hand = hand_in_view
            self._say(stamp, f'A hand is {"in view" if hand_in_view else "out of view"}.', _INFO)

    def _show_demonstration(self, stamp: int, fields: Mapping[str, Any]) -> None:
        manner = Manner(fields['manner']).name.lower()
        self._say(
            stamp,
            f'Seen: {fields["object"]} from {self._state(fields["x_i"])} to '
            f'{self._state(fields["x_f"])} by {manner} ({fields["manner_probability"]:.2f}).',
            _INFO,
        )

    def _show_belief(self, stamp: int, fields: Mapping[str, Any]) -> None:
        name, posterior = fields['object'], [float(p) for p in fields['posterior']]
        self._add(stamp, f'beliefs/{name}', posterior)
        told = ', '.join(
            f'{s.name} {p:.2f}' for s, p in zip(self._world.states, posterior, strict=False)
        )
        self._say(stamp, f'Goal of the {name}: P(G | x_i, x_f) = {told}.', _INFO)

    def _show_decision(self, stamp: int, fields: Mapping[str, Any]) -> None:
        name, success = fields['object'], float(fields['predicted_success'])
        of_actions = [float(p) for p in fields['success_probability']]
        if of_actions:
            self._add(stamp, f'success/{name}', of_actions)
        if math.isfinite(success):
            self._add(stamp, f'decisions/{name}', [success, float(fields['threshold'])])
        asks = fields['kind'] in (Kind.ASK_HUMAN, Kind.NO_ACTION)
        self._say(stamp, fields['sentence'], _WARNING if asks else _INFO)

    def _show_outcome(self, stamp: int, fields: Mapping[str, Any]) -> None:
        missed = fields['result'] != Result.REACHED
        self._say(stamp, fields['sentence'], _WARNING if missed else _INFO)

    def _add(self, stamp: int, path: str, values: list[float]) -> None:
        self._values[path] = values
        self._stream.log(stamp, path, rr.Scalars(values))

    def _say(self, stamp: int, sentence: str, level: str) -> None:
        self._stream.log(stamp, STORY, rr.TextLog(sentence, level=level))

    def _state(self, number: int) -> str:
        known = self._world.state_at(number)
        return UNKNOWN if known is None else known.name

    def _plot(self, path: str, names: Sequence[str], colours: Sequence[Any]) -> None:
        step = rr.components.InterpolationMode.StepAfter
        lines = rr.SeriesLines(names=names, colors=colours, interpolation_mode=step)
        self._stream.log_static(path, lines)
