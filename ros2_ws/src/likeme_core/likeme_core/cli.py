"""Options that all command lines share."""

from __future__ import annotations

from typing import Annotated

import typer

#: 232 is the greatest domain ID for which DDS has ports.
Domain = Annotated[int, typer.Option(min=0, max=232, envvar='ROS_DOMAIN_ID', help='ROS domain.')]
