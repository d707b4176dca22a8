"""Options that all command lines share."""

from __future__ import annotations

from typing import Annotated

import typer

#: Up to the greatest domain that DDS has ports for.
Domain = Annotated[int, typer.Option(min=0, max=232, envvar='ROS_DOMAIN_ID', help='ROS domain.')]
