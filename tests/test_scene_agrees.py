"""What perception is told about the cell is what the cell is."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_arm_sim.scene import Scene
from likeme_arm_sim.toys import TOYS
from likeme_inference.tabletop.model_file import shipped
from likeme_perception.catalogue import load_catalogue
from likeme_perception.config import PerceptionConfig


def test_the_default_camera_pose_and_areas_are_the_scenes() -> None:
    scene, config = Scene(), PerceptionConfig()
    pose = config.camera_pose()
    assert pose is not None
    np.testing.assert_allclose(pose, scene.camera.pose(), atol=1e-5)
    table = scene.table
    for ours, theirs in ((config.table, table.top), (config.work_area, table.work_area)):
        assert ours is not None
        assert (ours.x_min, ours.x_max) == pytest.approx((theirs.x_min, theirs.x_max))
        assert (ours.y_min, ours.y_max) == pytest.approx((theirs.y_min, theirs.y_max))
    assert config.blue_line_y == pytest.approx(table.blue_line_y)


def test_every_toy_is_in_the_catalogue_and_in_the_model() -> None:
    catalogue = {entry.name for entry in load_catalogue(None).objects}
    assert catalogue == set(TOYS) == set(Scene().objects) == set(shipped().objects)
