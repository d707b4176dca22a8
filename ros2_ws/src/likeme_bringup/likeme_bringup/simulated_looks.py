"""What the camera of the simulated cell sees of an object: its entry in perception's catalogue."""

from __future__ import annotations

from dataclasses import replace

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_core.camera_mount import CAMERA_FRAME
from likeme_core.world import World
from likeme_perception.catalogue import Catalogue, CatalogueObject, catalogue_entry
from likeme_perception.config import world_config
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres

#: Tables on which an object is looked at, with other places and yaw angles.
TABLES = 8
#: s between the frames from which the table's plane is learned.
PERIOD = 1 / 30


def simulated_looks(world: World, name: str) -> CatalogueObject:
    """Colours and extents of an object, from frames of the simulated cell.

    Raises:
        ValueError: the object is not simulated, or perception does not find it.
    """
    alone = world.only(name)
    states = [state for state in world.states if state not in world.out_of_reach]
    cell = Cell(alone, 0, CellSettings(initial_states={}), arm_visible=False)
    lens = world.camera
    intrinsics = Intrinsics(lens.fx, lens.fy, lens.cx, lens.cy, lens.width, lens.height)
    samples = []
    for seed in range(TABLES):
        cell.reset([name], [states[seed % len(states)]], seed)
        config = replace(world_config(world), background_frames=3)
        perception = TabletopPerception(config, intrinsics, Catalogue(()))
        for _ in range(config.background_frames + 1):
            cell.step(PERIOD)
            images = cell.frame()
            frame = RgbdFrame(
                round(cell.time * 1e9), CAMERA_FRAME, images.rgb, depth_in_metres(images.depth_mm)
            )
            table = perception.process(frame)
        sample = perception.largest_unknown(frame, table)
        if sample is None:
            raise ValueError(f'Expected to see the {name} on the table, got nothing above it.')
        samples.append(sample)
    cell.physics_world.client.disconnect()
    return catalogue_entry(name, samples)
