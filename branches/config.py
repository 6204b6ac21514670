"""The former place of scenes; it goes with version 0.4."""

import warnings

from branches.scene.closed import ClosedScene as Config
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, load, parse
from branches.scene.sweep import Sweep as DiagramConfig

__all__ = ["Config", "ConfigError", "DiagramConfig", "dump", "load", "parse"]

warnings.warn("branches.config is branches.scene.parse from version 0.3 on", DeprecationWarning, stacklevel=2)
