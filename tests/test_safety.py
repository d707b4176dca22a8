"""docs/safety.md names a test for each threat, and the SROS2 policy names what the cell has."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[1]
ROWS = re.findall(r'^\| .+ \| .+ \| (`.+::.+`) \|$', (ROOT / 'docs/safety.md').read_text(), re.M)
THREATS = [(file, test) for row in ROWS for file, test in re.findall(r'`([^`]+)::(\w+)`', row)]
POLICY = ROOT / 'ros2_ws/src/likeme_bringup/config/sros2_policy.xml'
#: Of every ROS node.
COMMON = {'rosout', 'parameter_events', 'clock', 'diagnostics'}


def test_there_are_threats() -> None:
    assert len(ROWS) >= 18


@pytest.mark.parametrize(('file', 'test'), THREATS)
def test_every_threat_has_its_test(file: str, test: str) -> None:
    path = ROOT / file if file.startswith('tests/') else ROOT / 'ros2_ws' / 'src' / file
    assert re.search(rf'^def {test}\(', path.read_text(), re.M)


def names(root: ElementTree.Element, kind: str) -> set[str]:
    found = {(each.text or '') for each in root.iter(kind)}
    return {name for name in found if not name.startswith('~')}


def test_the_policy_names_topics_and_services_of_the_docs() -> None:
    root = ElementTree.parse(POLICY).getroot()
    topics = (ROOT / 'docs' / 'topics.md').read_text()
    known = set(re.findall(r'`/?([A-Za-z_]+(?:/[A-Za-z_]+)*)`', topics)) | COMMON
    assert names(root, 'topic') <= known
    assert names(root, 'service') <= known


def test_no_enclave_but_the_operators_may_resume() -> None:
    root = ElementTree.parse(POLICY).getroot()
    may = {
        enclave.get('path')
        for enclave in root.iter('enclave')
        for services in enclave.iter('services')
        if services.get('request') and 'cell/resume' in {s.text for s in services}
    }
    assert may == {'/likeme/operator'}
