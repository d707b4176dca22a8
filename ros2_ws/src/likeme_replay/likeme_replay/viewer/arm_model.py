"""The arm of a robot_description, moved by joint states."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

import rerun as rr
from rerun.urdf import UrdfTree

from likeme_core.stamps import SECOND
from likeme_replay.viewer.scene_stream import Pace, SceneStream

#: Shortest time between two joint states in a recording, ns.
JOINT_PERIOD = SECOND // 15
#: The frame of everything in `cell`.
BASE_FRAME = 'base_link'
#: Entity of the arm; the library takes one without a slash alone.
ARM = 'arm'


class ArmModel:
    """Logs `arm/NAME` (links with their meshes), `arm/joints/*` and `joints`.

    Attributes:
        root: frame of the model's root link; '' before there is a model.
    """

    def __init__(self, stream: SceneStream) -> None:
        self._stream = stream
        self._pace = Pace(JOINT_PERIOD)
        self._tree: UrdfTree | None = None
        self._names: tuple[str, ...] = ()
        self.root = ''
        # What is logged under `cell` without a frame is in base_link.
        stream.log_static(
            'cell/base', rr.Transform3D(parent_frame='tf#/cell', child_frame=BASE_FRAME)
        )

    def load(self, urdf: str) -> None:
        """Show the model; meshes of packages that are not installed are left out.

        Raises:
            ValueError: it is no URDF.
        """
        with tempfile.TemporaryDirectory(prefix='likeme-') as folder:
            path = Path(folder, 'robot.urdf')
            try:
                path.write_bytes(_without_collision_shapes(urdf))
                tree = UrdfTree.from_file_path(
                    path, ARM, static_transform_entity_path=f'{ARM}/fixed_joints'
                )
                tree.log_urdf_to_recording(self._stream.recording)
            except (RuntimeError, ElementTree.ParseError) as error:
                raise ValueError(f'Expected a URDF on robot_description, got: {error}') from None
        self._tree, self.root = tree, tree.root_link().name
        if self.root != BASE_FRAME:
            self.place(BASE_FRAME, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))

    def place(
        self,
        parent: str,
        translation: tuple[float, float, float],
        rotation: tuple[float, float, float, float],
    ) -> None:
        """Where the root link is: m and quaternion (x, y, z, w) in a parent frame."""
        self._stream.log_static(
            f'{ARM}/base',
            rr.Transform3D(
                translation=translation,
                quaternion=rr.Quaternion(xyzw=rotation),
                parent_frame=parent,
                child_frame=self.root,
            ),
        )

    def move(self, stamp: int, positions: Mapping[str, float]) -> None:
        """Joint positions by their names, rad or m; joints of no model are plotted only."""
        if not positions or not self._pace.due(stamp):
            return
        self._plot(stamp, tuple(positions), list(positions.values()))
        for name, value in positions.items():
            joint = None if self._tree is None else self._tree.get_joint_by_name(name)
            if joint is not None and joint.joint_type != 'fixed':
                pose = joint.compute_transform(value, clamp=False)
                self._stream.log(stamp, f'{ARM}/joints/{name}', pose)

    def _plot(self, stamp: int, names: tuple[str, ...], values: Sequence[float]) -> None:
        if names != self._names:
            self._names = names
            self._stream.log_static('joints', rr.SeriesLines(names=names))
        self._stream.log(stamp, 'joints', rr.Scalars(values))


def _without_collision_shapes(urdf: str) -> bytes:
    """The model as it looks: collision shapes would cover the meshes."""
    root = ElementTree.fromstring(urdf)
    for link in root.iter('link'):
        for shape in link.findall('collision'):
            link.remove(shape)
    return ElementTree.tostring(root)
