"""Seeded acts with injected faults, and what is held against them."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from arm_parts.live_arm import LiveArm
from likeme_arm_sim.stand_in.trajectory_follower import FaultKind
from likeme_core.outcomes import MotionOutcome
from likeme_core.world import World
from likeme_msgs.action import ExecuteAction

#: What a person does; the other faults are the stand-in's.
NONE, HOLD, CANCEL = 'none', 'hold', 'cancel'
KINDS = (NONE, HOLD, CANCEL, *(kind.value for kind in FaultKind))
#: Range of each fault's amount, see FaultKind.
AMOUNTS = {
    'drop': (0.0, 0.0), 'abort': (0.0, 0.0), 'stall': (0.1, 2.0), 'slow': (1.5, 4.0),
    'late': (0.1, 1.5), 'bump': (0.15, 0.3), 'silent': (0.1, 1.5),
}  # fmt: skip
#: s from a stop to rest (by the topic, where the driver does not know when its message arrives),
#: and for how long nothing may move then; rad.
BRAKING, WATCHED, MOVED = 1.5, 0.8, 0.01
#: s for an act.
TIMEOUT = 90.0


class Act(NamedTuple):
    """One act: what is asked for, where things are, what goes wrong."""

    object: str
    action: str
    places: dict[str, str]
    fault: str
    trajectory: int
    at: float
    amount: float
    seed: int


class ActResult(NamedTuple):
    """How it went.

    Attributes:
        outcome: None: there was none in time.
        message: the driver's.
        rest: s from the stop to rest; NaN without a stop.
        after_hold: greatest way of a joint after BRAKING s from a stop, rad.
        arrived: whether the object is in the action's region.
        seconds: of the whole act.
    """

    act: Act
    outcome: MotionOutcome | None
    message: str
    rest: float
    after_hold: float
    arrived: bool
    seconds: float


def draw_act(world: World, seed: int) -> Act:
    """An act by its seed alone."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(world.objects))
    action = world.actions[seed % len(world.actions)]
    on_table = [s.name for s in world.states if s not in world.out_of_reach]
    # Others lie elsewhere, or in three of ten acts on the table.
    crowded = rng.random() < 0.3
    places = {
        other: str(rng.choice(on_table)) if crowded else world.regions.elsewhere.name
        for other in world.objects
    }
    places[name] = str(rng.choice(on_table))
    fault = str(rng.choice(KINDS))
    amount = float(rng.uniform(*AMOUNTS.get(fault, (0.0, 0.0))))
    return Act(
        name, action.name, places, fault, int(rng.integers(0, 7)), float(rng.uniform(0.0, 1.5)),
        amount, seed,
    )  # fmt: skip


def carry_out(live: LiveArm, act: Act) -> ActResult:
    """One act with its fault, and back to a robot at rest."""
    fault = [act.fault, act.trajectory, act.at, act.amount]
    live.control(
        target=act.object, places=act.places, seed=act.seed,
        fault=fault if act.fault in AMOUNTS else None,
    )  # fmt: skip
    live.during(1.0)
    live.joints.clear()
    began = time.monotonic()
    stop_at = began + 2.0 * act.trajectory + act.at if act.fault in (HOLD, CANCEL) else np.inf
    goal = ExecuteAction.Goal(object=act.object, action=act.action)
    accepted = live.action.send_goal_async(goal)
    live.until(accepted.done, TIMEOUT, 'an accepted goal')
    handle: Any = accepted.result()
    done = handle.get_result_async()
    stopped = np.nan
    while not done.done() and time.monotonic() < began + TIMEOUT:
        if time.monotonic() > stop_at and np.isnan(stopped):
            stopped = time.monotonic()
            live.stop() if act.fault == HOLD else handle.cancel_goal_async()
        live.during(0.02)
    rest, after = np.nan, 0.0
    if not np.isnan(stopped):
        live.during(max(0.0, stopped + BRAKING + WATCHED - time.monotonic()))
        rest, after = _after(live, stopped)
    outcome, message = None, 'No outcome.'
    if done.done():
        answer: Any = done.result()
        outcome, message = MotionOutcome(answer.result.outcome), answer.result.message
    seconds = time.monotonic() - began
    live.control(fault=None)
    if live.held:
        live.resume()
    live.during(0.4)
    assert live.table is not None
    states = {item.name: item.state for item in live.table.objects}
    live.go_home()
    target = int(live.world.action(act.action).target)
    return ActResult(act, outcome, message, rest, after, states[act.object] == target, seconds)


def _after(live: LiveArm, stopped: float) -> tuple[float, float]:
    """When the arm came to rest after a stop, and how far it went after BRAKING s."""
    times = np.array([t for t, _ in live.joints if t >= stopped])
    ways = np.array([q for t, q in live.joints if t >= stopped])
    if len(times) < 2:
        return np.nan, 0.0
    late = times >= stopped + BRAKING
    after = float(np.ptp(ways[late], axis=0).max()) if late.any() else 0.0
    moving = np.abs(ways - ways[-1]).max(1) > MOVED / 2
    rest = float(times[moving][-1] - stopped) if moving.any() else 0.0
    return rest, after
