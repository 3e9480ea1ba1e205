"""What Gymnasium's, PettingZoo's and Stable Baselines3's faces of an engine have in common: how they are opened, and what they refuse."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .client import Connection, open_engine
from .errors import ConsacError
from .text1 import TextConnection

RENDER_FPS = 30


@dataclass(frozen=True)
class Face:
    """What a face can show. Where it cannot, the text says what to use instead; None: it can."""

    autoreset: str | tuple[str, ...]  # as in CONFIGURE; of several the first that the engine knows
    text1: str | None = None
    environments: str | None = None
    agents: str | None = "use consac.ConsacParallelEnv"
    protocol: str | int = 2

    def open(self, url: str, render_mode: str | None, options: dict[str, Any]) -> tuple[Connection | TextConnection, list[str]]:
        """A connection with `options` as options.Options has them, and `protocol`, and the render modes that there are; ConsacError where it does not fit."""
        connection = open_engine(url, self.autoreset, {"protocol": self.protocol, **options})
        try:
            modes = ["rgb_array"] if "render" in connection.capabilities else []
            if isinstance(connection, Connection):
                agents = [agent for behaviour in connection.behaviours for agent in behaviour.agents]
                if self.agents and len(agents) != 1:
                    raise ConsacError(f"{url} has the agents {', '.join(agents[:8])}; {self.agents}")
                if self.environments and connection.environments != 1:
                    raise ConsacError(f"{url} offers {connection.environments} environments at once; {self.environments}")
            elif self.text1:
                raise ConsacError(f"{url} speaks text protocol 1, {self.text1}")
            if render_mode is not None and render_mode not in modes:
                raise ConsacError(f"render_mode={render_mode!r}; {url} has {modes or 'none'}")
        except BaseException:
            connection.close()
            raise
        return connection, modes
