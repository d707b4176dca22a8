"""`see --live` on a ROS domain of its own."""

from __future__ import annotations

from array import array
from pathlib import Path

import cv2
import numpy as np
import pytest
from domain_coordinator import domain_id
from sensor_msgs.msg import Image

from graph import Graph
from likeme_replay.ros import see_live
from likeme_replay.ros.waiting_node import ReplayFailedError

pytestmark = pytest.mark.graph
#: Of the pictures that are published.
COLOUR = (200, 40, 90)


def picture() -> Image:
    pixels = np.full((48, 64, 3), COLOUR, np.uint8)
    message = Image(height=48, width=64, encoding='rgb8', step=192)
    message.data = array('B', pixels.tobytes())
    return message


def test_what_perception_draws_is_written(tmp_path: Path) -> None:
    out, video = tmp_path / 'a.png', tmp_path / 'a.mp4'
    with Graph(tmp_path) as graph:
        overlay = graph.node.create_publisher(Image, 'table_overlay', 1)
        graph.node.create_timer(0.2, lambda: overlay.publish(picture()))
        runs = [
            graph.start('likeme_replay.camera_tools.see', '--live', '--out', str(path), *words)
            for path, words in ((out, ()), (video, ('--seconds', '1.5')))
        ]
        graph.until(lambda: not any(run.alive for run in runs), 20, 'their end')
        for run, path in zip(runs, (out, video), strict=True):
            assert run.wait(1) == 0, run.said
            assert run.said.startswith(f'Written: {path}')
    assert tuple(cv2.imread(str(out))[0, 0, ::-1]) == COLOUR
    found, frame = cv2.VideoCapture(str(video)).read()
    assert found
    assert frame.shape == (48, 64, 3)


def test_nobody_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(see_live, 'FIRST_PICTURE', 0.5)
    with domain_id() as domain, pytest.raises(ReplayFailedError, match='no perception_node is'):
        see_live.see_live(tmp_path / 'a.png', None, domain, network=False)
