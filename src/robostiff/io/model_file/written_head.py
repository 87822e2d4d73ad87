"""How every model file begins."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from robostiff.io.model_file.written_parts import Value, Written
from robostiff.io.model_file.written_repeat import Text


class WrittenHead(Written):
    """What a robot is called, where it comes from, and its parameters."""

    robostiff: Literal[1]
    name: Text = Field(description="what the robot is called")
    title: str = ""
    source: Text = Field(description="where the numbers come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field(default_factory=dict)
