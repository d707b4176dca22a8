"""Storage files in a folder without metadata.yaml: which numbers count parts of a bag."""

from __future__ import annotations

from pathlib import Path

import pytest
from sample_bags import BEGIN, CHATTER, TOPICS, text_record

from likeme_bags.reading import open_bag
from likeme_bags.writing import BagWriter

DATED = [f'{k}_run_2025_12_17-10_0{k}_50' for k in range(4)]
# Names, and the numbers that are missing.
NAMES: dict[str, tuple[list[str], str]] = {
    'as rosbag2 splits': ([f'run_{k}' for k in (0, 1, 2, 10, 3, 4, 5, 6, 7, 8, 9)], ''),
    'one missing': (['run_0', 'run_1', 'run_3', 'run_5'], '2, 4'),
    'the last of a ring buffer': (['run_3', 'run_4', 'run_5'], ''),
    'a ring buffer with a gap': (['run_3', 'run_5'], '4'),
    'number in front': (DATED, ''),
    'number in front, the first ones deleted': (DATED[2:], ''),
    'number in front, one missing': ([DATED[0], DATED[1], DATED[3]], '2'),
    'number in front of a name with a number': (['0_run_1', '1_run_1', '3_run_1'], '2'),
    'number in front, seconds in order': ([f'{k}_a_2025_12_17-10_00_5{k}' for k in (0, 1)], ''),
    'named by default': ([f'rosbag2_2025_12_17-10_00_50_{k}' for k in range(12)], ''),
    'named by default, one missing': (
        [f'rosbag2_2025_12_17-10_00_50_{k}' for k in (9, 10, 12)],
        '11',
    ),
    'years in front': (['2024_12_17_run', '2026_12_17_run'], ''),
    'days at the end': (['run_2025_12_17', 'run_2025_12_19'], ''),
    'times': (['run_10_00_10', 'run_10_00_40'], ''),
    'names alone': (['front', 'rear'], ''),
    'one without a number': (['run', 'run_1', 'run_2'], ''),
    'two bags': (['a_0', 'a_1', 'b_0', 'b_1'], ''),
    'two bags, one with a gap': (['a_0', 'a_1', 'b_0', 'b_2'], '1'),
    'dates alone': (['run_2025_12_17-10_00_10', 'run_2025_12_17-10_00_40'], ''),
    'stamps': (['run_1700000000', 'run_1700000060'], ''),
    'days': (['20251217_run', '20251219_run'], ''),
    'cameras': (['cam1', 'cam3'], ''),
}


@pytest.mark.parametrize('case', NAMES)
def test_a_gap_between_the_numbers_is_a_missing_file(tmp_path: Path, case: str) -> None:
    names, missing = NAMES[case]
    (tmp_path / 'bag').mkdir()
    for k, name in enumerate(names):
        with BagWriter(tmp_path / f'{k}') as writer:
            writer.add(TOPICS[0])
            writer.write(text_record(CHATTER, BEGIN + k, name))
        (tmp_path / f'{k}' / f'{k}.mcap').rename(tmp_path / 'bag' / f'{name}.mcap')
    with open_bag(tmp_path / 'bag') as bag:
        assert len(list(bag.records())) == len(names)
        assert bag.complete == (not missing)
        if missing:
            assert any(f'got no {missing}.' in warning for warning in bag.warnings)
