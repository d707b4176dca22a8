"""A recording as a scene: of its own messages, or computed from its frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from likeme_bags.errors import BagError
from likeme_bags.reading import Bag
from likeme_bags.values import Record
from likeme_core.world import World
from likeme_perception.frame_reader import colour_of, depth_of, intrinsics_of
from likeme_replay import recorded_parameters
from likeme_replay.in_process import InProcessGraph
from likeme_replay.input_scheduler import FrameAck, run_replay
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import RecordedFrame, RecordedInputs, ReplayStep
from likeme_replay.source_adapters import adapted_source
from likeme_replay.viewer.message_scene import TABLE_STATE, TOPICS, MessageScene
from likeme_replay.viewer.scene import Scene
from likeme_replay.viewer.seen_table import of_observation

#: Told the log time (ns) that has been reached.
Progress = Callable[[int], None]


def settings_of(bag: Bag, world: str | None) -> recorded_parameters.Parameters:
    """The nodes' parameters that a bag was recorded with, in another world if one is named.

    Raises:
        ValueError: they are malformed, or the bag is of another world.
    """
    parameters = recorded_parameters.recorded(bag.custom)
    if world is not None:
        parameters = recorded_parameters.in_world(parameters, world)
    recorded_parameters.check_world(bag.custom, parameters)
    return parameters


def show_bag(
    bag: Bag,
    parameters: recorded_parameters.Parameters,
    world: World,
    scene: Scene,
    progress: Progress,
) -> str:
    """Show a whole bag; a sentence on what was shown.

    Raises:
        BagError: nothing in it can be shown.
    """
    if any(t.name.lstrip('/') == TABLE_STATE and t.type == TOPICS[TABLE_STATE] and t.count
           for t in bag.topics):  # fmt: skip
        return _show_messages(bag, world, scene, progress)
    return _show_computed(bag, parameters, scene, progress)


def _show_messages(bag: Bag, world: World, scene: Scene, progress: Progress) -> str:
    messages = MessageScene(scene, world)
    wanted = [t.name for t in bag.topics if TOPICS.get(t.name.lstrip('/')) == t.type]
    for record in bag.records(wanted):
        messages.hear(record)
        progress(record.stamp)
    if messages.other_world:
        raise BagError(f'{bag.path}: {messages.other_world}')
    unreadable = f', {messages.unreadable} could not be read' if messages.unreadable else ''
    return f'{messages.shown} messages as recorded{unreadable}.'


def _show_computed(
    bag: Bag, parameters: recorded_parameters.Parameters, scene: Scene, progress: Progress
) -> str:
    inputs = RecordedInputs(adapted_source({}, {})(bag, None, None))
    target = _ShownGraph(scene, parameters)

    def steps() -> Iterator[ReplayStep]:
        for step in inputs.steps():
            if isinstance(step, RecordedFrame):
                progress(step.depth.stamp)
            yield step

    counts = run_replay(steps(), inputs.live, target, scene.story.show_event)
    if not counts.frames:
        raise BagError(f'{bag.path}: expected frames of a camera, got 0.')
    why = f'; {counts.rejected} not read: {counts.first_rejection}' if counts.rejected else ''
    return (
        f'{counts.frames} frames; states, beliefs and decisions are not in the recording and '
        f'were computed from them{why}'.rstrip('.')
        + '.'
    )


class _ShownGraph(InProcessGraph):
    """Perception and inference in this process, whose frames and tables are shown."""

    def __init__(self, scene: Scene, parameters: recorded_parameters.Parameters) -> None:
        super().__init__(*(parameters.get(node) for node in recorded_parameters.NODES))
        self._scene = scene

    def show_frame(self, frame: RecordedFrame) -> FrameAck:
        """See ReplayTarget."""
        ack = super().show_frame(frame)
        pictures = self._scene.pictures
        try:
            pictures.set_intrinsics(intrinsics_of(_message(frame.info)))
            if pictures.wants_colour(frame.stamp):
                pictures.show_colour(frame.stamp, colour_of(_message(frame.colour)))
            if pictures.wants_depth(frame.stamp):
                pictures.show_depth(frame.stamp, depth_of(_message(frame.depth)))
        except ValueError:
            # The graph has said so by rejecting the frame.
            return ack
        if ack.table_state and self.table is not None:
            self._scene.show_table(of_observation(self.table))
        return ack


def _message(record: Record) -> Any:
    return definitions().read(record.data, record.type)
