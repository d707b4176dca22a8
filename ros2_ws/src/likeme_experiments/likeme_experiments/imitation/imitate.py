"""The robot's part of an episode: the session decides, the cell executes, the camera reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from likeme_core.observations import Demonstration
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action, Mode
from likeme_core.world import World
from likeme_experiments.evaluation.episode import ImitationResult
from likeme_experiments.evaluation.forecast import BUDGET, THRESHOLD, Estimate
from likeme_experiments.imitation.imitation_cell import ImitationCell
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import ImitationSettings
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision, Outcome, Remark, Reply


def settings_of(world: World, mode: Mode, estimate: Estimate) -> ImitationSettings:
    """Sequential mode asks when no action is left, the others by the paper's threshold."""
    threshold = 0.0 if mode is Mode.SEQUENTIAL else THRESHOLD
    return ImitationSettings(
        world, mode, threshold, action_budget=BUDGET, concentration=estimate.concentration,
        prior=estimate.prior, turn_delay=0.0,
    )  # fmt: skip


def imitate(
    cell: ImitationCell,
    model: RobotModel,
    settings: ImitationSettings,
    demonstrations: Sequence[Demonstration],
) -> ImitationResult:
    """Let the robot imitate what was demonstrated; if it asks for help, a human gives it."""
    session = ImitationSession(model, settings)
    for demonstration in demonstrations:
        # The cell's clock starts when the object has been put back.
        session.observe_demonstration(replace(demonstration, stamp=0, start=0, end=0))
    actions: tuple[Action, ...] = ()
    states: tuple[int | None, ...] = ()
    refused = 0
    output: Decision | Outcome | Remark | None = session.look(cell.start)
    while isinstance(output, Decision) and output.kind is Kind.EXECUTE:
        assert output.action is not None, 'A decision to execute has an action.'
        report, view = cell.execute(actions, output.action)
        actions = (*actions, output.action)
        refused += report.outcome is MotionOutcome.NOT_FREE
        if session.motion_finished(report) is None and session.look(view) is None:
            session.nothing_seen()
        states = (*states, view.states.get(output.object))
        output = session.look_again()
    if not isinstance(output, Decision) or output.kind is not Kind.ASK_HUMAN:
        return ImitationResult(actions, states, False, refused=refused)
    seen = cell.help(actions, output.goal)
    session.answered(Reply.DONE_BY_HAND)
    session.look(seen)
    return ImitationResult(actions, states, True, seen.states.get(output.object), refused)
