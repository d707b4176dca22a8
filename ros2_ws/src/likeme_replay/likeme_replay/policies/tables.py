"""Policies of the world's label, of table states and of perception's acknowledgements."""

from __future__ import annotations

from typing import Any

from likeme_core.stamps import stamp_ns
from likeme_replay.policies.policy import Bounds, Found, Policy, distribution
from likeme_replay.policies.seen import TIME_JUMP, UNKNOWN, Recent, Seen, stamp_of

#: Kinds of likeme_msgs/FrameDone.
READ, REFUSED = 1, 2
#: Nodes with whose new run stamps may begin anew: the simulated camera's, and perception.
TIME_KEEPERS = ('arm_driver', 'perception_node')


class OneWorld(Policy):
    """Every message with a world's label carries that of the topic `world`."""

    def _check(self, message: Any, _: float) -> Found:
        world = self.seen.world
        if world is None:
            return
        label = f'{world.name}@{world.digest}'
        given = getattr(message, 'world', '')
        if given not in ('', label):
            yield f'Expected the world {label}, got {given!r}.'

    on_table_state = on_demonstration = on_goal_belief = on_decision = on_outcome = _check
    on_motion = _check


class WorldStays(Policy):
    """All nodes publish the same world, and it never changes."""

    def on_world(self, message: Any, _: float) -> Found:
        before = self.seen.world
        if before is None:
            return
        labels = [f'{each.name}@{each.digest}' for each in (before, message)]
        if labels[0] != labels[1] or list(before.regions) != list(message.regions):
            yield f'Expected the world to stay {labels[0]}, got {labels[1]}.'


class EveryObjectListed(Policy):
    """Every table state lists every object of the world once, in its order."""

    def on_table_state(self, message: Any, _: float) -> Found:
        if self.seen.world is None:
            return
        names, known = [item.name for item in message.objects], list(self.seen.world.objects)
        if names != known:
            yield f'Expected the objects {known}, got {names}.'


class StateProbabilities(Policy):
    """The probabilities of every object's state are as many as the regions and sum to 1."""

    def on_table_state(self, message: Any, _: float) -> Found:
        for item in message.objects:
            what = f'the state probabilities of {item.name}'
            yield from distribution(item.state_probability, self.regions, what)


class StatesAreRegions(Policy):
    """Every state in a table state is the number of a region, or UNKNOWN."""

    def on_table_state(self, message: Any, _: float) -> Found:
        for item in message.objects:
            known = self.regions is None or item.state < self.regions
            if not known and item.state != UNKNOWN:
                yield f'Expected a region of {item.name}, got {item.state}.'


class SettledTableRests(Policy):
    """A settled table has no hand and no arm over it, and every object on it is settled."""

    def on_table_state(self, message: Any, _: float) -> Found:
        if not message.settled:
            return
        moving = [item.name for item in message.objects if not item.settled]
        if message.hand_in_view or message.arm_in_view or moving:
            limbs = f'hand {message.hand_in_view}, arm {message.arm_in_view}'
            yield f'Expected a settled table at rest, got {limbs}, not settled: {moving}.'


class SeenObjectsHaveTimes(Policy):
    """An object that is visible was last seen in this very frame, no object in a later one."""

    def on_table_state(self, message: Any, _: float) -> Found:
        stamp = stamp_of(message)
        for item in message.objects:
            seen = stamp_ns(item.last_seen)
            if seen > stamp or (item.visible and seen != stamp):
                yield f'Expected {item.name} last seen at {stamp} ns, got {seen} ns.'


class StampsRise(Policy):
    """Stamps of table states go forward, unless time begins anew: with a jump, or a new run.

    A jump is one of more than 1 s. Simulated time that runs faster than the clock goes back when
    the simulated camera is started again; perception, started again, does not know its last stamp.
    """

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._runs: dict[str, str] = {}
        self._anew_until = float('-inf')

    def on_heartbeat(self, message: Any, now: float) -> Found:
        name = message.node.rpartition('/')[2]
        if name in TIME_KEEPERS and self._runs.setdefault(name, message.run) != message.run:
            self._runs[name], self._anew_until = message.run, now + self.bounds.recovery
        yield from ()

    def on_table_state(self, message: Any, now: float) -> Found:
        newest = self.seen.newest_table
        if newest is None:
            return
        back = stamp_of(newest) - stamp_of(message)
        if back > 0 and now <= self._anew_until:
            self._anew_until = float('-inf')
        elif 0 <= back <= TIME_JUMP:
            yield f'Expected a stamp after {stamp_of(newest)} ns, got {stamp_of(message)} ns.'


class FramesDoneOnce(Policy):
    """Perception acknowledges each frame once, and says why it refused one."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._done: Recent[bool] = Recent(1000)

    def on_frame_done(self, message: Any, _: float) -> Found:
        if message.kind == REFUSED and not message.reason:
            yield 'Expected the reason of a refusal, got none.'
        if message.kind not in (READ, REFUSED):
            return
        stamp = stamp_of(message)
        if message.kind == READ and stamp in self._done:
            yield f'Expected one acknowledgement of the frame of {stamp} ns, got another.'
        if message.kind == READ:
            self._done[stamp] = True


class FramesReadAreTold(Policy):
    """A frame acknowledged with a table state has one with its stamp."""

    def on_frame_done(self, message: Any, now: float) -> Found:
        if message.kind != READ or not message.table_state or self.seen.first_stamp is None:
            return
        stamp, missed = stamp_of(message), self.seen.missed('table_state', now)
        if stamp >= self.seen.first_stamp and stamp not in self.seen.tables and not missed:
            yield f'Expected a table state of {stamp} ns, got none before its acknowledgement.'
