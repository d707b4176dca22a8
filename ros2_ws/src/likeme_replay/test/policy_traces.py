"""Traces of the graph's topics for tests of policies: plain messages with valid defaults."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace
from typing import Any

from likeme_replay.policies.monitor import PolicyMonitor

START, STEP = 1000.0, 0.05
MOTION = 'decision-1-a'
REGIONS, ACTIONS, OBJECTS = ['LEFT', 'RIGHT', 'OFF'], ['PUSH_LEFT', 'PUSH_RIGHT'], ['pear', 'bear']


def stamp(seconds: float) -> SimpleNamespace:
    return SimpleNamespace(sec=int(seconds), nanosec=round(seconds % 1 * 1e9))


def plain(time: float = START, **fields: Any) -> SimpleNamespace:
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp(time), frame_id='base'), **fields)


class Trace:
    """Messages with rising times, all taken by a monitor.

    Attributes:
        now: s; each message is one step later than the one before.
    """

    def __init__(self) -> None:
        self.now, self.monitor, self.inputs = START, PolicyMonitor(), 0

    @property
    def broken(self) -> set[str]:
        return set(self.monitor.counts)

    def hear(self, topic: str, message: Any, late: float = 0.0) -> None:
        """late: s from its sending to its arrival."""
        self.now += STEP
        self.monitor.hear(topic, message, self.now, self.now + late)

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.monitor.tick(self.now)

    def world(self, **changes: Any) -> None:
        fields = {'name': 'toys', 'digest': 'd', 'regions': REGIONS, 'actions': ACTIONS}
        self.hear('world', SimpleNamespace(**fields | {'objects': OBJECTS} | changes))

    def item(self, name: str = 'pear', state: int = 0, **changes: Any) -> SimpleNamespace:
        fields = {'state_probability': [0.2, 0.5, 0.3], 'visible': True, 'settled': True}
        seen = stamp(self.now + STEP)
        return SimpleNamespace(name=name, state=state, **{'last_seen': seen} | fields | changes)

    def table(
        self, pear: int = 0, time: float | None = None, bear: int = 0, **changes: Any
    ) -> float:
        """A settled table state; its stamp in s."""
        time = self.now + STEP if time is None else time
        seen = stamp(time)
        states = {'pear': pear, 'bear': bear}
        objects = [self.item(name, state, last_seen=seen) for name, state in states.items()]
        fields = {'hand_in_view': False, 'arm_in_view': False, 'settled': True, 'world': 'toys@d'}
        self.hear('table_state', plain(time, **fields | {'objects': objects} | changes))
        return time

    def demonstration(self, time: float, **changes: Any) -> None:
        fields = {
            'object': 'pear', 'x_i': 0, 'x_f': 1, 'x_i_probability': [1.0, 0.0, 0.0],
            'x_f_probability': [0.0, 1.0, 0.0], 'manner_probability': 1.0, 'world': 'toys@d',
            'start': stamp(time - 2), 'end': stamp(time - 1),
        }  # fmt: skip
        self.hear('demonstration', plain(time, **fields | changes))

    def belief(self, time: float, **changes: Any) -> None:
        fields = {
            'object': 'pear', 'x_i': 0, 'x_f': 1, 'prior': [0.4, 0.3, 0.3], 'goal': 1,
            'posterior': [0.1, 0.7, 0.2], 'model': 'm', 'world': 'toys@d',
        }  # fmt: skip
        self.hear('goal_belief', plain(time, **fields | changes))

    def decision(self, time: float, shown: float, **changes: Any) -> None:
        fields = {
            'id': 1, 'demonstration': stamp(shown), 'mode': 'interactive', 'object': 'pear',
            'x_i': 0, 'goal': 1, 'goal_posterior': [0.1, 0.7, 0.2], 'kind': 0, 'action': 1,
            'action_probability': [0.2, 0.8], 'success_probability': [0.0, 0.9],
            'predicted': [0.1, 0.9, 0.0], 'predicted_success': 0.9, 'actions_left': 1,
            'plan_value': 0.9, 'threshold': 0.5, 'model': 'm', 'world': 'toys@d',
        }  # fmt: skip
        self.hear('decision', plain(time, **fields | changes))

    def record(self, number: int, asking: str) -> None:
        """The record of a decision that follows."""
        text = json.dumps({'decision': {'id': number}, 'settings': {'asking': asking}})
        self.hear('decision_record', SimpleNamespace(data=text))

    def heard(self, kind: int, time: float = START, **changes: Any) -> None:
        self.inputs += 1
        fields = {'number': self.inputs, 'events': 1, 'refused': False, 'answer': 0}
        fields |= {'message': 'ann', 'motion_outcome': 0}
        self.hear('heard', plain(time, kind=kind, **fields | changes))

    def motion(self, state: int = 1, **changes: Any) -> None:
        fields = {
            'id': MOTION, 'actor': 0, 'world': 'toys@d', 'object': 'pear', 'action': 'PUSH_RIGHT',
            'outcome': 0, 'message': 'done' if state == 2 else '',
            'started': stamp(self.now - 1), 'finished': stamp(self.now if state == 2 else 0),
        }  # fmt: skip
        self.hear('motion', plain(self.now, state=state, **fields | changes))

    def outcome(self, time: float, **changes: Any) -> None:
        fields = {
            'decision_id': 1, 'object': 'pear', 'x_i': 0, 'goal': 1, 'x_f': 1, 'result': 0,
            'actor': 0, 'action': 1, 'predicted_success': 0.9, 'motion_outcome': 0,
            'world': 'toys@d',
        }  # fmt: skip
        self.hear('outcome', plain(time, **fields | changes))

    def hold(self, held: bool = False, change: int = 1, **changes: Any) -> None:
        self._hold('cell/hold_state', held, change, **changes)

    def told(self, held: bool = False, change: int = 1, **changes: Any) -> None:
        self._hold('cell/holds', held, change, **changes)

    def _hold(
        self, topic: str, held: bool, change: int, late: float = 0.0, **changes: Any
    ) -> None:
        fields = {'run': 'k', 'by': 'ann', 'reason': 'stopped'}
        self.hear(topic, plain(self.now, held=held, change=change, **fields | changes), late)

    def joints(self, speed: float = 0.0) -> None:
        self.hear('joint_states', plain(self.now, velocity=[0.0, -speed]))

    def beat(self, sequence: int, **changes: Any) -> None:
        fields = {'node': '/arm_driver', 'run': 'a', 'state': 1, 'message': '', 'version': '1'}
        self.hear('heartbeat', plain(self.now, sequence=sequence, **fields | changes))

    def frame_done(self, time: float, **changes: Any) -> None:
        fields = {'kind': 1, 'table_state': True, 'demonstrations': 0, 'reason': ''}
        self.hear('frame_done', plain(time, **fields | changes))

    def parameters_changed(self) -> None:
        changed = SimpleNamespace(node='/inference_node', changed_parameters=['goal_prior'])
        self.hear('parameter_events', changed)

    def questions(self, *pending: SimpleNamespace) -> None:
        self.hear('questions', SimpleNamespace(pending=list(pending)))

    def shown(self) -> float:
        """A world, a demonstration and its belief; the demonstration's stamp."""
        self.world()
        time = self.table(1)
        self.demonstration(time)
        self.belief(time)
        return time

    def decided(self, **changes: Any) -> float:
        """A demonstration and its decision; the decision's stamp."""
        shown = self.shown()
        time = self.table(0)
        self.decision(time, shown, **changes)
        return time

    def asked(self) -> float:
        """A decision to ask; its stamp."""
        return self.decided(**UNSURE)

    def moved(self) -> None:
        """A decision to act, and its motion from begin to end."""
        self.decided()
        self.motion()
        self.motion(2)


#: Changes of a decision that asks.
UNSURE: dict[str, Any] = {
    'kind': 1, 'success_probability': [0.0, 0.3], 'predicted': [0.7, 0.3, 0.0],
    'predicted_success': 0.3, 'plan_value': 0.3,
}  # fmt: skip
#: Changes of an outcome without an action by the robot.
BY_NOBODY: dict[str, Any] = {'action': 255, 'predicted_success': math.nan, 'motion_outcome': 255}

#: Changes of a motion by which nothing moved.
NOTHING_MOVED: dict[str, Any] = {'started': stamp(0), 'finished': stamp(0)}


def question(time: float, **changes: Any) -> SimpleNamespace:
    fields = {'id': 1, 'object': 'pear', 'x_i': 0, 'goal': 1, 'action': 1}
    return plain(time, **fields | {'predicted_success': 0.3, 'threshold': 0.5} | changes)
