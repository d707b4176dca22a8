"""The robot's part of an episode: the session decides, the stage carries out, the camera tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from likeme_core.observations import Demonstration
from likeme_core.tabletop import Action, Mode
from likeme_experiments.evaluation.episode import Ending
from likeme_experiments.evaluation.forecast import BUDGET, THRESHOLD, Estimate
from likeme_experiments.imitation.imitation_cell import Stage
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import Settings
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision, Outcome, Remark, Reply

Told = Decision | Outcome | Remark | None


def settings_of(mode: Mode, estimate: Estimate) -> Settings:
    """The robot's settings: sequential asks when it can do no more, interactive below half."""
    threshold = 0.0 if mode is Mode.SEQUENTIAL else THRESHOLD
    return Settings(
        mode, threshold, BUDGET, concentration=estimate.concentration,
        shared_prior=estimate.shared, turn_delay=0.0,
    )  # fmt: skip


def imitate(
    stage: Stage, model: RobotModel, settings: Settings, acts: Sequence[Demonstration]
) -> Ending:
    """Let the robot imitate what it saw; if it asks, a person does it by hand."""
    session = ImitationSession(model, settings)
    for act in acts:
        # The stage's clock starts when the object has been put back.
        session.observe_demonstration(replace(act, stamp=0, start=0, end=0))
    actions: tuple[Action, ...] = ()
    states: tuple[int | None, ...] = ()
    told: Told = session.look(stage.beginning)
    while isinstance(told, Decision) and told.kind is Kind.EXECUTE:
        assert told.action is not None, 'What is executed is an action.'
        report, view = stage.act(actions, told.action)
        actions = (*actions, told.action)
        if session.motion_finished(report) is None and session.look(view) is None:
            session.nothing_seen()
        states = (*states, view.states.get(told.object))
        told = session.look_again()
    if not isinstance(told, Decision) or told.kind is not Kind.ASK_HUMAN:
        return Ending(actions, states, False)
    seen = stage.help(actions, told.goal)
    session.answered(Reply.DONE_BY_HAND)
    session.look(seen)
    return Ending(actions, states, True, seen.states.get(told.object))
