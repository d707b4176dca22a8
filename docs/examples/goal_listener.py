"""A node of your own: says what the person wants, whenever the robot believes something new.

./scripts/run.sh python docs/examples/goal_listener.py
"""

from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from likeme_msgs.msg import GoalBelief, World

#: The last message is sent to who comes later.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class GoalListener(Node):
    """Subscribes world (World) and goal_belief (GoalBelief), each reliable, transient local."""

    def __init__(self) -> None:
        super().__init__('goal_listener')
        self.regions: dict[str, list[str]] = {}
        self.create_subscription(World, 'world', self.on_world, LATCHED)
        self.create_subscription(GoalBelief, 'goal_belief', self.on_belief, LATCHED)

    def on_world(self, world: World) -> None:
        """Learn what the numbers in messages of this world mean."""
        self.regions[f'{world.name}@{world.digest}'] = list(world.regions)

    def on_belief(self, belief: GoalBelief) -> None:
        """Print P(G | x_i, x_f)."""
        names = self.regions.get(belief.world)
        if names is None:
            self.get_logger().warning(
                f'Expected the world {belief.world} on the topic world first.'
            )
            return
        goals = ', '.join(f'{n} {p:.2f}' for n, p in zip(names, belief.posterior, strict=True))
        print(
            f'{belief.object} from {names[belief.x_i]} to {names[belief.x_f]}: {goals}', flush=True
        )


def main() -> None:
    """Listen until Ctrl-C."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(GoalListener())
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
