"""What the window remembers of its user, in one small file: its size, the scale of its letters, the first card."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lambent.core.errors import UserError, invalid
from lambent.core.files import write_text
from lambent.core.inputs import parse_json, read_bytes

Size = Literal["show", "design", "measure"]
SIZES: tuple[Size, ...] = get_args(Size)
FILE = "window.json"
MOST_BYTES = 1 << 16
LEAST_SCALE, MOST_SCALE = 0.7, 3.0


class Settings(BaseModel):
    """The remembered choices. Keys of later versions are kept as they are."""

    model_config = ConfigDict(extra="allow", frozen=True)

    size: Size = "design"
    scale: Annotated[float, Field(ge=LEAST_SCALE, le=MOST_SCALE)] = 1.0  # of letters and controls
    card_seen: bool = False


def settings_file() -> Path | None:
    """The file in the user's configuration folder; None where there is no such folder."""
    if sys.platform == "win32":
        folder = os.environ.get("APPDATA", "")
    elif sys.platform == "darwin":
        folder = str(Path("~/Library/Application Support").expanduser())
    else:
        # A relative path must be ignored (XDG Base Directory Specification).
        named = os.environ.get("XDG_CONFIG_HOME", "")
        folder = named if Path(named).is_absolute() else os.path.expanduser("~/.config")
    return Path(folder) / "lambent" / FILE if Path(folder).is_absolute() else None


def read_settings(file: Path) -> Settings:
    """Settings of a file, those of the first start without one; `UserError` if it cannot be read."""
    if not file.exists():
        return Settings()
    try:
        return Settings.model_validate(parse_json(read_bytes(file, MOST_BYTES), file))
    except ValidationError as error:
        raise invalid(error, file) from error


@dataclass
class Remembered:
    """The settings, and the `file` that keeps them, None for this window alone; `say` tells why they are not kept."""

    say: Callable[[str], None]
    file: Path | None = None
    now: Settings = field(default_factory=Settings)

    def open(self, file: Path | None) -> None:
        """Take the settings of a file; where it cannot be read, those of the first start."""
        self.file = file
        try:
            self.now = Settings() if file is None else read_settings(file)
        except (UserError, OSError) as error:
            self.say(f"the window starts as the first time: {error}")

    def set(self, **changes: object) -> None:
        """Change settings and keep them; an out-of-range value is a `ValidationError`."""
        now = Settings.model_validate({**self.now.model_dump(), **changes})
        if now == self.now:
            return
        self.now = now
        try:
            if self.file is not None:
                self.file.parent.mkdir(parents=True, exist_ok=True)
                write_text(self.file, now.model_dump_json(indent=1) + "\n")
        except (UserError, OSError) as error:
            self.say(f"not remembered: {error}")
