"""Perception on one frame, pairs of images, and the overlay."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from likeme_perception.blobs import mask_of
from likeme_perception.image_pairs import (
    find_pairs,
    intrinsics_file,
    read_frame,
    read_intrinsics,
    write_frame,
    write_intrinsics,
)
from likeme_perception.observation_report import text_report
from likeme_perception.overlay import draw
from likeme_perception.single_frame import look_at

ROOT = Path(__file__).resolve().parents[4]
SHARED = Path(os.environ.get('LIKEME_SHARED', ROOT.parent / 'shared')) / 'data' / 'rgbd'
needs_real_frames = pytest.mark.skipif(
    not SHARED.is_dir(), reason=f'the real RGB-D frames are not at {SHARED}'
)


def test_an_unknown_object_on_an_unknown_table_is_found(renderer, lemon) -> None:
    table, _ = look_at(renderer.frame(lemon(0.44, -0.02)), renderer.intrinsics)
    assert [abs(each.shape.length - 0.06) < 0.015 for each in table.unknown_objects] == [True]


def test_a_hand_is_found_with_an_image_of_the_empty_table(renderer, forearm) -> None:
    empty, frame = renderer.frame(), renderer.frame(forearm(0.5, 0.0, 0.08))
    table, _ = look_at(frame, renderer.intrinsics, empty)
    assert table.hand_in_view


def test_pairs_come_back_as_they_were_written(renderer, lemon, tmp_path) -> None:
    frames = [renderer.frame(lemon(0.44, y)) for y in (-0.1, 0.1)]
    for k, frame in enumerate(frames):
        write_frame(tmp_path, f'view_{k}', frame)
    write_intrinsics(tmp_path, renderer.intrinsics)
    pairs = find_pairs([tmp_path])
    assert [pair.name for pair in pairs] == ['view_0', 'view_1']
    for pair, frame in zip(pairs, frames, strict=True):
        read = read_frame(pair.colour, pair.depth)
        np.testing.assert_array_equal(read.rgb, frame.rgb)
        np.testing.assert_allclose(read.depth, frame.depth, atol=0.00051)
    assert intrinsics_file([tmp_path]) == tmp_path / 'intrinsics.json'
    assert read_intrinsics(intrinsics_file([tmp_path]), (240, 320)) == renderer.intrinsics


def test_a_folder_whose_pairs_lack_a_part(renderer, tmp_path) -> None:
    with pytest.raises(ValueError, match=r'Expected images NAME_color\.png .* got none'):
        find_pairs([tmp_path])
    write_frame(tmp_path, 'one', renderer.frame())
    (tmp_path / 'one_depth.png').unlink()
    with pytest.raises(ValueError, match=r'one_depth\.png beside one_color\.png, got no such'):
        find_pairs([tmp_path])
    with pytest.raises(ValueError, match='pairs COLOUR DEPTH of images, got 3 files'):
        find_pairs([tmp_path / name for name in 'abc'])


def test_states_hand_and_arm_are_drawn(renderer, catalogue, lemon, forearm) -> None:
    perception = renderer.perception(catalogue)
    frame = renderer.frame(lemon(0.45, 0.15), forearm(0.5, -0.1, 0.1))
    seen = perception.process(frame)
    image = draw(frame.rgb, seen, perception.background.view, perception.config.world, 'before')
    assert image.shape == (480, 640, 3)
    plain = cv2.resize(frame.rgb, (640, 480), interpolation=cv2.INTER_CUBIC)
    changed = np.abs(image.astype(int) - plain).max(axis=2) > 30
    assert changed[seen.hand[len(seen.hand) // 2] // 320 * 2].any()
    assert 0.01 < changed.mean() < 0.5


def test_an_unreadable_frame_says_why_in_the_picture(renderer, catalogue, lemon) -> None:
    perception = renderer.perception(catalogue)
    frame = renderer.frame(lemon(0.45, 0.15))
    perception.process(frame)
    dark = replace(frame, stamp=frame.stamp + 10**8, rgb=frame.rgb // 200)
    seen = perception.process(dark)
    assert seen.reason
    assert {each.reason for each in seen.objects} == {seen.reason}
    image = draw(dark.rgb, seen, perception.background.view)
    assert (image[20:60] == (255, 120, 100)).all(axis=2).any()


def test_what_a_hand_may_cover_is_unknown_because_of_it(
    renderer, catalogue, lemon, forearm
) -> None:
    perception = renderer.perception(catalogue)
    for _ in range(5):
        perception.process(renderer.frame(lemon(0.45, 0.0)))
    seen = perception.process(renderer.frame(forearm(0.35, 0.0, 0.12)))
    assert seen.object('lemon').state is None
    assert seen.object('lemon').reason == 'a hand may cover or hold it'
    assert 'lemon: UNKNOWN, a hand may cover or hold it' in text_report(seen)


@needs_real_frames
def test_real_objects_on_a_desk_are_segmented() -> None:
    camera = read_intrinsics(SHARED / 'mosd' / 'intrinsics.json', (480, 640))
    ious = []
    for color in sorted((SHARED / 'mosd').glob('*_color.png'))[:8]:
        frame = read_frame(color, Path(str(color).replace('color', 'depth')))
        _, perception = look_at(frame, camera)
        found = perception.background.foreground(frame) > 0
        label = cv2.imread(str(color).replace('color', 'label'), cv2.IMREAD_UNCHANGED) > 1
        ious.append((found & label).sum() / (found | label).sum())
    assert np.median(ious) > 0.97


@needs_real_frames
@pytest.mark.parametrize('name', ['human_puzzle_1', 'human_puzzle_3'])
def test_a_real_gloved_hand_is_found(name: str) -> None:
    folder = SHARED / 'hand'
    camera = read_intrinsics(folder / 'intrinsics.json', (480, 640))
    frame, empty = (
        read_frame(folder / f'{n}_color.png', folder / f'{n}_depth.png')
        for n in (name, 'empty_table_0')
    )
    table, _ = look_at(frame, camera, empty)
    assert table.hand_in_view
    red = frame.rgb[:, :, 0].astype(int) - frame.rgb[:, :, 1] > 60
    red = cv2.morphologyEx(red.astype(np.uint8), cv2.MORPH_OPEN, np.ones((9, 9)))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(red)
    glove = labels == 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA])
    assert mask_of(table.hand, frame.depth.shape)[glove].mean() > 0.75
