"""Shows each planned motion before it begins, and in step mode asks for it."""

from __future__ import annotations

import threading
from collections.abc import Callable

from geometry_msgs.msg import Point
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool
from visualization_msgs.msg import Marker, MarkerArray

from likeme_arm.messages import BASE_FRAME
from likeme_arm.real_arm.trajectory import Trajectory
from likeme_arm.tool_pose import Vector
from likeme_core.ros.qos import LATCHED

#: Width of the line, m; RGBA.
LINE_WIDTH, COLOUR = 0.006, (1.0, 0.55, 0.0, 1.0)
#: s between two looks at the hold while a person is asked.
ASKING_PERIOD = 0.05
NOTHING_ASKED = 'No motion waits to be allowed.'


class PlannedPath:
    """Publishes `planned_path` (MarkerArray, latched): the way of the grasp point.

    In step mode also `arm/next_motion` (String, latched; empty: none waits) and serves
    `arm/allow_motion` (SetBool; false ends the request).
    """

    def __init__(self, node: Node, step: bool, interrupted: Callable[[], bool]) -> None:
        """interrupted: whether the motion under way must end, asked while a person is."""
        self._node, self._interrupted = node, interrupted
        self._path_pub = node.create_publisher(MarkerArray, 'planned_path', LATCHED)
        self._answered = threading.Event()
        self._asking, self._allowed = False, False
        self._next_pub = None
        if step:
            self._next_pub = node.create_publisher(String, 'arm/next_motion', LATCHED)
            node.create_service(SetBool, 'arm/allow_motion', self._on_allow)

    def announce(self, phase: str, trajectory: Trajectory, way: Vector) -> bool:
        """Show a motion; in step mode wait until it is allowed or refused."""
        self._path_pub.publish(MarkerArray(markers=[self._marker(way)]))
        if self._next_pub is None:
            return True
        x, y, z = way[-1]
        text = f'{phase}, {trajectory.duration:.1f} s, to x {x:.2f}, y {y:.2f}, z {z:.2f} m'
        self._answered.clear()
        self._allowed, self._asking = False, True
        self._next_pub.publish(String(data=text))
        while not self._answered.wait(ASKING_PERIOD) and not self._interrupted():
            pass
        self._asking = False
        self._next_pub.publish(String())
        return self._allowed

    def _on_allow(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = self._asking
        if not self._asking:
            response.message = NOTHING_ASKED
            return response
        self._allowed = request.data
        self._answered.set()
        response.message = 'The motion begins.' if request.data else 'The request ends.'
        return response

    def _marker(self, way: Vector) -> Marker:
        marker = Marker(ns='planned_path', type=Marker.LINE_STRIP, action=Marker.ADD)
        marker.header.frame_id = BASE_FRAME
        marker.header.stamp = self._node.get_clock().now().to_msg()
        marker.pose.orientation.w = 1.0
        marker.scale.x = LINE_WIDTH
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = COLOUR
        marker.points = [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in way]
        return marker
