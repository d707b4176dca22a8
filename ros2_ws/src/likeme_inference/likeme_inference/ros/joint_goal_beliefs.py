"""The topic joint_goal_belief: goals over all objects, after each of a person's attempts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rclpy.node import Node

from likeme_core.observations import TableSnapshot
from likeme_core.ros.qos import LATCHED
from likeme_core.world import World
from likeme_inference.joint_belief import JointBelief, ToldEvent, table_goal
from likeme_inference.joint_observer import JointObserver
from likeme_inference.messages import joint_belief_msg
from likeme_inference.ros.diagnostics import SessionDiagnostics
from likeme_inference.session_inputs import read_attempt
from likeme_inference.tabletop.values import TableGoal
from likeme_msgs.msg import Attempt, JointGoalBelief


class JointGoalBeliefs:
    """Gives table states and attempts to an observer and publishes what it believes.

    Publishes joint_goal_belief (JointGoalBelief, reliable, transient local, depth 1). Subscribes
    attempt (Attempt, reliable 10). All on behalf of its node.

    Attributes:
        observer: infers the goals.
        receiving: whether attempts are taken in; else they are dropped.
    """

    def __init__(
        self, node: Node, world: World, observer: JointObserver, health: SessionDiagnostics,
        believed: Callable[[JointBelief], None], stopped: Callable[[TableGoal], None],
    ) -> None:  # fmt: skip
        """Publish and subscribe.

        Args:
            node: that does it.
            world: of the messages.
            observer: see above.
            health: counts attempts.
            believed: takes each belief before it is published.
            stopped: takes the goal of a person who has stopped.
        """
        self.observer, self.receiving = observer, False
        self._believed, self._stopped = believed, stopped
        self._world, self._health, self._logger = world, health, node.get_logger()
        self._refusal = ''
        self._publisher = node.create_publisher(JointGoalBelief, 'joint_goal_belief', LATCHED)
        node.create_subscription(Attempt, 'attempt', self._on_attempt, 10)

    def look(self, table: TableSnapshot) -> None:
        """Take in a table state."""
        self._publish(self.observer.look(table))
        if self.observer.refusal != self._refusal:
            self._refusal = self.observer.refusal
            if self._refusal:
                self._logger.info(self._refusal)

    def take_up(self, events: Sequence[ToldEvent]) -> None:
        """Go on with a demonstration, and publish the belief that there was; see the observer."""
        belief = self.observer.take_up(events)
        if belief is not None:
            self._publisher.publish(joint_belief_msg(self._world, belief))

    def _on_attempt(self, msg: Attempt) -> None:
        if not self.receiving:
            self._health.counts['attempts while not active'] += 1
            return
        try:
            beliefs = self.observer.see(read_attempt(msg, self._world))
        except ValueError as error:
            self._health.drop('attempts', error)
            return
        self._health.counts['attempts'] += 1
        self._publish(beliefs)

    def _publish(self, beliefs: list[JointBelief]) -> None:
        for belief in beliefs:
            self._believed(belief)
            self._publisher.publish(joint_belief_msg(self._world, belief))
            self._logger.info(belief.sentence)
            goal = table_goal(belief, self.observer.settings.stop_delay)
            if goal is not None:
                self._stopped(goal)
