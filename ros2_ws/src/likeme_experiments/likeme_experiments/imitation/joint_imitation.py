"""Joint goals shown in the simulated cell, and imitated there: camera, perception, arm and help.

One run, all by its seed:

1. The objects lie in drawn states within reach. A simulated person has a joint goal that asks for
   at least one change (evaluation/people.py), with the robot's transitions made more skilled.
2. The person acts until it stops: each act is chosen noisily rationally and carried out by the
   simulated hand. One that fails by the person's own transitions is given up halfway.
3. Perception reports attempts, a JointObserver infers the goal, and the session is told of it when
   the person has stopped.
4. The objects are put back; the robot imitates with what it sees, and is helped when it asks.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_core.observations import TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Mode, State
from likeme_core.world import World
from likeme_experiments.evaluation.people import SENSIBLE, Demonstrator, Person
from likeme_experiments.imitation.demonstration import new_perception
from likeme_inference.joint_belief import JointBelief, table_goal
from likeme_inference.joint_observer import JointObserver, JointSettings
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.goal_space import JointGoal, every_joint_goal
from likeme_inference.tabletop.imitation import Goals, ImitationSettings
from likeme_inference.tabletop.joint_goals import JointGoals, learned_transitions
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision, MotionReport, Outcome, Reply

#: s between two frames, and of the way after which a failing act is given up.
FRAME_PERIOD, GIVEN_UP = 1 / 15, 0.5
#: The person: skill of `person_values.skilled`, and acts at most.
SKILL, LONGEST = 0.8, 8
#: s for a table at rest to be told.
REST = 2.0
SETTINGS = JointSettings()
#: Decisions of the robot at most.
DECISIONS = 12


@dataclass
class JointRun:
    """What became of one run.

    Attributes:
        meant: changes that the person's goal asked for.
        inferred: changes that were inferred; None: none, or "none of these".
        probability: of the inferred changes.
        acts, failed: of the person.
        robot_acts, asked: of the robot.
        reached: whether all that was meant is where it is wanted in the end, truly.
    """

    meant: JointGoal
    inferred: JointGoal | None = None
    probability: float = 0.0
    acts: int = 0
    failed: int = 0
    robot_acts: int = 0
    asked: int = 0
    reached: bool = False
    sentences: list[str] = field(default_factory=list)

    @property
    def right(self) -> bool:
        """Whether the goal was inferred that was meant."""
        return self.inferred == self.meant


def joint_run(world: World, model: RobotModel, seed: int) -> JointRun:
    """Show a joint goal and have it imitated."""
    with _cell(world, seed) as cell:
        return _Run(world, model, cell, seed).play()


@contextmanager
def _cell(world: World, seed: int) -> Iterator[Cell]:
    cell = Cell(world, seed, CellSettings())
    try:
        yield cell
    finally:
        cell.physics_world.client.disconnect()


class _Run:
    def __init__(self, world: World, model: RobotModel, cell: Cell, seed: int) -> None:
        self._world, self._model, self._cell, self._seed = world, model, cell, seed
        self._rng = np.random.default_rng(seed)
        self._perception = new_perception(world, cell, None)
        self._observer = JointObserver(world, model, SETTINGS)
        self._session = ImitationSession(
            model, ImitationSettings(world, Mode.SEQUENTIAL, goals=Goals.JOINT, turn_delay=0.0)
        )
        self._beliefs: list[JointBelief] = []
        self._view: TableSnapshot | None = None
        self._due = 0.0

    def play(self) -> JointRun:
        start = self._set_up()
        goals = JointGoals.of(self._world, self._model)
        wanted = self._draw_goal(goals, start)
        run = JointRun(goals.change(wanted, start))
        self._demonstrate(goals, wanted, run)
        self._wait(SETTINGS.stop_delay + REST)
        stopped = [belief for belief in self._beliefs if belief.stopped]
        if not stopped:
            return run
        belief = stopped[-1]
        run.sentences.append(belief.sentence)
        goal = table_goal(belief, SETTINGS.stop_delay)
        if goal is None:
            return run
        run.inferred, run.probability = belief.changes[0]
        self._session.observe_table_goal(goal)
        self._cell.reset(self._world.objects, [int(x) for x in start], self._seed)
        self._imitate(run)
        truth = self._cell.true_states()
        run.reached = all(
            g is None or truth[name].state == g
            for name, g in zip(goals.objects, run.meant, strict=True)
        )
        return run

    def _set_up(self) -> tuple[State, ...]:
        reachable = [s for s in self._world.states if s not in self._world.out_of_reach]
        drawn = self._rng.integers(len(reachable), size=len(self._world.objects))
        start = tuple(reachable[int(k)] for k in drawn)
        self._cell.reset(self._world.objects, [int(x) for x in start], self._seed)
        self._wait(REST)
        return start

    def _draw_goal(self, goals: JointGoals, start: tuple[State, ...]) -> JointGoal:
        every = every_joint_goal(len(goals.objects), len(self._world.states))
        while True:
            goal = every[self._rng.integers(len(every))]
            if any(g is not None for g in goals.change(goal, start)):
                return goal

    def _demonstrate(self, goals: JointGoals, wanted: JointGoal, run: JointRun) -> None:
        transitions = learned_transitions(self._world, self._model)
        person = Demonstrator(self._world, transitions, Person(SENSIBLE, SKILL))
        for _ in range(LONGEST):
            truth = self._cell.true_states()
            states = [truth[name].state for name in goals.objects]
            where = [int(state) for state in states if state is not None]
            if len(where) < len(states):
                return
            chosen = person.next_act(where, wanted, self._rng)
            if chosen is None:
                return
            o, a = chosen
            action = self._world.actions[a]
            fails = person.moved(o, a, where[o], self._rng) != action.target
            self._cell.run_action(
                Actor.HUMAN, goals.objects[o], action, lambda _: None, self._tick,
                share=GIVEN_UP if fails else 1.0,
            )  # fmt: skip
            run.acts += 1
            run.failed += fails
            self._wait(1.0)

    def _imitate(self, run: JointRun) -> None:
        patience = 2 * SETTINGS.stop_delay
        session, until = self._session, self._cell.time + patience
        while session.state.table is not None and run.robot_acts + run.asked < DECISIONS:
            event = self._look()
            if isinstance(event, Decision) and event.kind is Kind.EXECUTE:
                run.robot_acts += 1
                self._act(event)
            elif isinstance(event, Decision) and event.kind is Kind.ASK_HUMAN:
                run.asked += 1
                self._help(event)
            elif event is None and self._cell.time > until:
                return
            if event is not None:
                run.sentences.append(event.sentence)
                until = self._cell.time + patience

    def _act(self, decision: Decision) -> None:
        assert decision.action is not None, 'Only actions are executed.'
        ended = self._cell.run_action(
            Actor.ROBOT, decision.object, decision.action, self._perception.look,
            others=self._perception.others,
        )  # fmt: skip
        finished = 0 if ended.finished is None else round(ended.finished * 1e9)
        report = MotionReport(MotionOutcome(int(ended.outcome)), ended.message, finished)
        self._session.motion_finished(report)

    def _help(self, decision: Decision) -> None:
        """Do by hand all that is asked for."""
        for name, goal in ((decision.object, decision.goal), *(decision.also or ())):
            action = self._world.action_to(goal)
            self._cell.run_action(Actor.HUMAN, name, action, lambda _: None, self._tick)
            self._wait(1.0)
        self._session.answered(Reply.DONE_BY_HAND, decision.object)

    def _look(self) -> Decision | Outcome | None:
        """The next table state, and what the session does."""
        self._cell.step(FRAME_PERIOD)
        event = self._session.look(self._perception.process_frame().snapshot)
        return event if isinstance(event, (Decision, Outcome)) else None

    def _wait(self, seconds: float) -> None:
        self._cell.step(seconds, self._tick)

    def _tick(self) -> None:
        """Look when a frame is due."""
        if self._cell.time < self._due:
            return
        self._due = self._cell.time + FRAME_PERIOD
        table = self._perception.process_frame()
        self._beliefs += self._observer.look(table.snapshot)
        self._session.look(table.snapshot)
        for attempt in table.attempts:
            self._beliefs += self._observer.see(attempt)
