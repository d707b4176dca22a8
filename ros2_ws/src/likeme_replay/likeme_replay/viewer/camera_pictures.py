"""Colour and depth of the camera, compressed, where the world has the camera."""

from __future__ import annotations

import cv2
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from likeme_core.camera_mount import CameraMount
from likeme_core.stamps import SECOND
from likeme_perception.rgbd import Intrinsics
from likeme_replay.viewer.scene_stream import Pace, SceneStream

#: Shortest time between two pictures in a recording, ns.
COLOUR_PERIOD, DEPTH_PERIOD = SECOND // 5, SECOND // 2
_JPEG_QUALITY = 85
#: Of each so many rows and columns one reading is kept.
_DEPTH_STEP = 2
_MILLIMETRES = 1000.0


class CameraPictures:
    """Logs `cell/camera` with `colour` (JPEG) and `depth` (16-bit PNG, mm, half the size)."""

    def __init__(self, stream: SceneStream, mount: CameraMount) -> None:
        self._stream = stream
        self._colour_pace, self._depth_pace = Pace(COLOUR_PERIOD), Pace(DEPTH_PERIOD)
        self._intrinsics: Intrinsics | None = None
        pose = mount.pose()
        stream.log_static(
            'cell/camera', rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
        )

    def set_intrinsics(self, intrinsics: Intrinsics) -> None:
        """The camera's from now on."""
        if intrinsics == self._intrinsics:
            return
        self._intrinsics = intrinsics
        for name, step in (('colour', 1), ('depth', _DEPTH_STEP)):
            pinhole = rr.Pinhole(
                focal_length=(intrinsics.fx / step, intrinsics.fy / step),
                principal_point=(intrinsics.cx / step, intrinsics.cy / step),
                width=intrinsics.width // step,
                height=intrinsics.height // step,
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=0.12,
            )
            self._stream.log_static(f'cell/camera/{name}', pinhole)

    def wants_colour(self, stamp: int) -> bool:
        """Whether a colour image of a stamp would be kept; asked once for each."""
        return self._colour_pace.due(stamp)

    def wants_depth(self, stamp: int) -> bool:
        """Whether a depth image of a stamp would be kept; asked once for each."""
        return self._depth_pace.due(stamp)

    def show_colour(self, stamp: int, rgb: NDArray[np.uint8]) -> None:
        """An image (H, W, 3)."""
        bgr = cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR)
        _, data = cv2.imencode('.jpg', bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        picture = rr.EncodedImage(contents=data.tobytes(), media_type='image/jpeg')
        self._stream.log(stamp, 'cell/camera/colour', picture)

    def show_depth(self, stamp: int, depth: NDArray[np.float32]) -> None:
        """A depth image (H, W), m, NaN or 0 where there is no reading."""
        small = np.nan_to_num(depth[::_DEPTH_STEP, ::_DEPTH_STEP]) * _MILLIMETRES
        _, data = cv2.imencode('.png', np.clip(small, 0, 65535).astype(np.uint16))
        picture = rr.EncodedDepthImage(
            data.tobytes(),
            media_type='image/png',
            meter=_MILLIMETRES,
            colormap=rr.components.Colormap.Grayscale,
        )
        self._stream.log(stamp, 'cell/camera/depth', picture)
