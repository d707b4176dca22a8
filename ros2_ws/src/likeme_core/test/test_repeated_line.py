from __future__ import annotations

from likeme_core.repeated_line import RepeatedLine


def test_a_line_that_repeats_is_written_once_a_period_with_a_count() -> None:
    now = [100.0]
    lines = RepeatedLine(5.0, lambda: now[0])
    assert lines.line('locked') == 'locked'
    assert [lines.line('locked') for _ in range(3)] == [None] * 3
    now[0] += 5.0
    assert lines.line('locked') == 'locked (3 more like it)'
    assert lines.line('full') == 'full'
    assert lines.line('locked') == 'locked'
    now[0] += 6.0
    assert lines.line('locked') == 'locked'
