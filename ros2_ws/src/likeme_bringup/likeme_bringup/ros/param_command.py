"""CLI client of node parameters: `list`, `get` and `set`, as `ros2 param` has them.

Exit codes: 0 done, 1 refused, 2 wrong usage, 3 the node is not there, 130 Ctrl-C.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, NoReturn

import rclpy
import typer
import yaml
from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

from likeme_bringup.nearest_names import nearest
from likeme_bringup.ros.cell_commands import application, report
from likeme_bringup.ros.service_client import DISCOVERY_TIMEOUT, CallResult, client_node, domain_of
from likeme_core.cli import Domain, Network

#: End of the service by which a node lists its parameters.
LISTS = '/list_parameters'
#: s between two looks at the nodes; two that are alike are believed.
SETTLE = 1.0
START = 'is the cell running? Start it: ./scripts/start_cell.sh'
NodeName = Annotated[str, typer.Argument(metavar='NODE', help='e.g. inference_node.')]
Name = Annotated[str, typer.Argument(metavar='NAME', help='Of the parameter.')]


def list_command(
    node_name: Annotated[
        str, typer.Argument(metavar='[NODE]', help='e.g. inference_node; none: list the nodes.')
    ] = '',
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Every parameter of a node, with its value and description; without a node: the nodes."""
    if not node_name:
        list_nodes(network, domain)
    with parameters_of(node_name, network, domain) as parameters:
        names = sorted(parameters.names())
        lines = [
            f'{about.name}: {flow(value)}   # {about.description.rstrip(".")}{limits(about)}'
            for about, value in zip(
                parameters.descriptions(names), parameters.values(names), strict=True
            )
            if about.description
        ]
    report(CallResult(0, '\n'.join(lines)))


def get_command(
    node_name: NodeName, name: Name, network: Network = False, domain: Domain = 0
) -> None:
    """The value of one parameter."""
    with parameters_of(node_name, network, domain) as parameters:
        parameters.description(name)
        (value,) = parameters.values([name])
    report(CallResult(0, flow(value)))


def set_command(
    node_name: NodeName,
    name: Name,
    value: Annotated[str, typer.Argument(metavar='VALUE', help='As in YAML.')],
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Change one parameter; nodes use it at once, or from their next decision on."""
    with parameters_of(node_name, network, domain) as parameters:
        about = parameters.description(name)
        answer = parameters.set(name, parsed(value, about))
    if not answer.successful:
        report(CallResult(1, answer.reason or f'{node_name} refused.'))
    report(CallResult(0, f'{node_name}: {name} is {value} now.'))


def list_nodes(network: bool, domain: int) -> NoReturn:
    """The nodes that have parameters."""
    with client_node(network, domain) as node:
        names = parameter_nodes(node)
    if not names:
        report(CallResult(3, f'No node with parameters on ROS domain {domain}: {START}'))
    report(CallResult(0, '\n'.join(names)))


def parameter_nodes(node: Node) -> list[str]:
    """Names of the other nodes that serve their parameters, after a while of discovery."""
    deadline = time.monotonic() + DISCOVERY_TIMEOUT
    names: set[str] = set()
    while time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=SETTLE)
        found = {
            name.removesuffix(LISTS)
            for name, _ in node.get_service_names_and_types()
            if name.endswith(LISTS)
        } - {node.get_fully_qualified_name()}
        if found and found == names:
            break
        names = found
    return sorted(names)


class Parameters:
    """The parameters of one running node, over its services."""

    def __init__(self, node: Node, name: str) -> None:
        self._node, self._name = node, name
        self._client = AsyncParameterClient(node, name)
        if not self._client.wait_for_services(DISCOVERY_TIMEOUT):
            # This client is listed as if it served the name.
            there = [each for each in parameter_nodes(node) if each.strip('/') != name.strip('/')]
            known = (
                f'The nearest: {", ".join(nearest(name, there) or there)}.'
                if there
                else f'No other node is there: {START}'
            )
            report(
                CallResult(3, f'There is no node {name} on ROS domain {domain_of(node)}. {known}')
            )

    def names(self) -> list[str]:
        """Names of all."""
        return list(self._answer(self._client.list_parameters()).result.names)

    def descriptions(self, names: list[str]) -> list[ParameterDescriptor]:
        """Type, description and range of each."""
        return list(self._answer(self._client.describe_parameters(names)).descriptors)

    def values(self, names: list[str]) -> list[Any]:
        """Value of each."""
        answer = self._answer(self._client.get_parameters(names))
        return [parameter_value_to_python(value) for value in answer.values]

    def set(self, name: str, value: Any) -> Any:
        """Change one; the result of the node."""
        return self._answer(self._client.set_parameters([Parameter(name, value=value)])).results[0]

    def description(self, name: str) -> ParameterDescriptor:
        """Type, description and range of one; exits with a message if there is none."""
        names = self.names()
        if name not in names:
            report(
                CallResult(2, f'{self._name} has no parameter {name}: {", ".join(sorted(names))}.')
            )
        return self.descriptions([name])[0]

    def _answer(self, future: Any) -> Any:
        rclpy.spin_until_future_complete(self._node, future, timeout_sec=DISCOVERY_TIMEOUT)
        if not future.done():
            report(CallResult(3, f'{self._name} gave no answer within {DISCOVERY_TIMEOUT:g} s.'))
        return future.result()


@contextmanager
def parameters_of(node_name: str, network: bool, domain: int) -> Iterator[Parameters]:
    """The parameters of a running node."""
    with client_node(network, domain) as node:
        yield Parameters(node, node_name)


def parsed(text: str, about: ParameterDescriptor) -> Any:
    """A value parsed as YAML; whole numbers become floats where the parameter is one.

    Raises:
        typer.BadParameter: it is no YAML.
    """
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise typer.BadParameter(f'expected a value as in YAML, got {text!r}.') from error
    if about.type == ParameterType.PARAMETER_STRING:
        return text
    if about.type == ParameterType.PARAMETER_DOUBLE and type(value) is int:
        return float(value)
    if about.type == ParameterType.PARAMETER_DOUBLE_ARRAY and isinstance(value, list):
        return [float(each) if type(each) is int else each for each in value]
    return value


def flow(value: Any) -> str:
    """A parameter value as YAML on one line."""
    plain = list(value) if not isinstance(value, (str, bool, int, float)) else value
    text = yaml.safe_dump(plain, default_flow_style=True, width=1000)
    return text.removesuffix('\n').removesuffix('\n...')


def limits(about: ParameterDescriptor) -> str:
    """The permitted range in words, or nothing."""
    ranges = [*about.floating_point_range, *about.integer_range]
    return f' ({ranges[0].from_value:.6g} to {ranges[0].to_value:.6g})' if ranges else ''


def param() -> None:
    """Entry point of `param`."""
    application(('list', list_command), ('get', get_command), ('set', set_command))()


if __name__ == '__main__':
    param()
