"""Everything that the viewer shows of a cell, and how it is laid out."""

from __future__ import annotations

from functools import partial

import rerun as rr
import rerun.blueprint as rrb

from likeme_core.world import World
from likeme_replay.viewer.arm_model import ARM, ArmModel
from likeme_replay.viewer.camera_pictures import CameraPictures
from likeme_replay.viewer.cell_scene import CellScene
from likeme_replay.viewer.scene_stream import TIMELINE, SceneStream
from likeme_replay.viewer.seen_table import SeenTable
from likeme_replay.viewer.story import STORY, Story

_COLUMNS = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=['loglevel', 'body'])


class Scene:
    """The parts of a scene, each with its entities.

    Attributes:
        pictures, arm, story: see their classes.
    """

    def __init__(self, recording: rr.RecordingStream, world: World) -> None:
        stream = SceneStream(recording)
        recording.send_recording_name(f'LikeMe {world.label}')
        self._cell = CellScene(stream, world)
        self.pictures = CameraPictures(stream, world.camera)
        self.arm = ArmModel(stream)
        self.story = Story(stream, world)

    def show_table(self, table: SeenTable) -> None:
        """Show what is where in one frame."""
        self._cell.show_table(table)
        self.story.show_view(table.stamp, table.hand_in_view, table.reason)


def layout(world: World) -> rrb.Blueprint:
    """Scene and camera above, plots over time and the text log below."""
    x, y = world.table.top.centre
    eye = rrb.EyeControls3D(
        position=(x + 0.9, y - 0.75, 0.85), look_target=(x - 0.1, y, 0.15), eye_up=(0, 0, 1)
    )
    probability = rrb.ScalarAxis(range=(-0.05, 1.05), zoom_lock=True)
    # All plots show the same span of time.
    plot = partial(rrb.TimeSeriesView, axis_x=rrb.TimeAxis(link='LinkToGlobal'))
    states = [
        plot(
            origin=f'states/{name}',
            name=f'State of {name}',
            axis_y=probability,
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=number == 0),
        )
        for number, name in enumerate(world.objects)
    ]
    plots = [
        plot(origin='beliefs', name='Goal posterior', axis_y=probability),
        plot(origin='decisions', name='Predicted success', axis_y=probability),
        plot(origin='joint_beliefs', name='Goals of the whole table', axis_y=probability),
        plot(origin='success', name='Success of each action', axis_y=probability),
        plot(origin='joints', name='Joints (rad, m)'),
    ]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                rrb.Spatial3DView(
                    origin='cell', name='Cell', eye_controls=eye,
                    contents=['$origin/**', f'/{ARM}/**'],
                ),
                rrb.Vertical(
                    rrb.Spatial2DView(
                        origin='cell/camera/colour', contents='$origin', name='Camera'
                    ),
                    rrb.TextLogView(origin=STORY, name='Story', columns=_COLUMNS),
                    row_shares=[3, 2],
                ),
                column_shares=[5, 4],
            ),
            rrb.Horizontal(
                rrb.Tabs(*states, name='States') if len(states) > 4 else rrb.Vertical(*states),
                rrb.Vertical(*plots[:2]),
                rrb.Tabs(*plots[2:]),
            ),
            row_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=TIMELINE, state='collapsed'),
        rrb.SelectionPanel(state='hidden'),
        rrb.BlueprintPanel(state='hidden'),
        auto_views=False,
    )  # fmt: skip
