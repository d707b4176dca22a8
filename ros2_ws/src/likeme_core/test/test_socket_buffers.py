from pathlib import Path
from xml.etree import ElementTree

from likeme_core.socket_buffers import WANTED, too_small

PROFILE = Path(__file__).parents[2] / 'likeme_bringup' / 'config' / 'fastdds.xml'


def test_small_limits_are_named_with_the_cure(tmp_path: Path) -> None:
    (tmp_path / 'rmem_max').write_text('212992\n')
    (tmp_path / 'wmem_max').write_text(f'{WANTED}\n')
    said = too_small(tmp_path)
    assert said is not None
    assert 'got net.core.rmem_max 212992: ' in said
    assert f'sudo sysctl -w net.core.rmem_max={WANTED}' in said


def test_large_and_hidden_limits_are_no_fault(tmp_path: Path) -> None:
    assert too_small(tmp_path) is None
    for name in ('rmem_max', 'wmem_max'):
        (tmp_path / name).write_text(str(2 * WANTED))
    assert too_small(tmp_path) is None


def test_they_are_what_the_profile_asks_for() -> None:
    root = ElementTree.parse(PROFILE).getroot()
    asked = [
        e.text for e in root.iter() if e.tag.endswith(('sendBufferSize', 'receiveBufferSize'))
    ]
    assert asked == [str(WANTED)] * 2
