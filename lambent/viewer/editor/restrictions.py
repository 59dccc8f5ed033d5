"""Parameters that the user fixed or limited for a fit, by the fit's names; they follow added and removed lobes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from lambent.core.plain import Triple
from lambent.materials.document import KINDS, Kind, Material
from lambent.materials.fitting.parameters import SHAPE, parameter

Value = float | Triple
Kept = tuple[frozenset[str], tuple[tuple[str, tuple[float, float]], ...]]
DIFFUSE = ("kd", "kt_d")


def lobe_names(material: Material) -> list[dict[str, str]]:
    """Per lobe, attribute -> name of its parameter in a fit: lobes are counted per kind."""
    counts: dict[Kind, int] = dict.fromkeys(KINDS, 0)
    names = []
    for lobe in material.lobes:
        index = counts[lobe.kind]
        counts[lobe.kind] += 1
        names.append({base: parameter(lobe.kind, base, index) for base in ("k", *SHAPE)})
    return names


@dataclass
class Restrictions:
    """Fixed parameter names, and intervals of other parameters."""

    fixed: set[str] = field(default_factory=set)
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    keep: Callable[[Kept], None] = field(default=lambda kept: None, compare=False)  # called after every change

    @property
    def kept(self) -> Kept:
        """A frozen copy."""
        return frozenset(self.fixed), tuple(sorted(self.ranges.items()))

    def restore(self, kept: Kept) -> None:
        """Restore a frozen copy."""
        self.fixed, self.ranges = set(kept[0]), dict(kept[1])

    def fix(self, name: str, fixed: bool) -> None:
        """Fix a parameter, or set it free; a fixed one has no interval."""
        if fixed:
            self.fixed.add(name)
            self.ranges.pop(name, None)
        else:
            self.fixed.discard(name)
        self.keep(self.kept)

    def narrow(self, name: str, interval: tuple[float, float] | None) -> None:
        """Give a parameter an interval, or none; one with an interval is not fixed."""
        if interval is None:
            self.ranges.pop(name, None)
        else:
            self.ranges[name] = interval
            self.fixed.discard(name)
        self.keep(self.kept)

    def for_fit(
        self, material: Material, lobes: int
    ) -> tuple[dict[str, Value], dict[str, tuple[float, float]], list[str]]:
        """`fix` and `ranges` for a fit with `lobes` per side, and the names that this fit does not have."""
        from lambent.materials.fitting.parameters import known_parameters

        values = dict(_values(material))
        known = set(known_parameters(lobes))
        unknown = sorted((self.fixed | set(self.ranges)) - known | (self.fixed - set(values)))
        fix = {name: values[name] for name in sorted(self.fixed) if name in known and name in values}
        ranges = {name: interval for name, interval in sorted(self.ranges.items()) if name in known}
        return fix, ranges, unknown

    def follow(self, before: Material, after: Material, kept: list[int]) -> None:
        """Rename after lobes were added or removed; `kept[i]` is the index of lobe i of `after` in `before`, or -1."""
        old, new = lobe_names(before), lobe_names(after)
        renamed = {old[was][base]: new[now][base] for now, was in enumerate(kept) if was >= 0 for base in ("k", *SHAPE)}
        renamed |= {name: name for name in DIFFUSE}
        self.fixed = {renamed[name] for name in self.fixed if name in renamed}
        self.ranges = {renamed[name]: interval for name, interval in self.ranges.items() if name in renamed}
        self.keep(self.kept)


def _values(material: Material) -> Iterator[tuple[str, Value]]:
    for name in DIFFUSE:
        yield name, _plain(getattr(material, name))
    for lobe, names in zip(material.lobes, lobe_names(material), strict=True):
        for base, name in names.items():
            value = getattr(lobe, base)
            yield name, float(sum(value) / 3) if base == "r0" else _plain(value)  # a fit has one r0 for all channels


def _plain(value: Value) -> Value:
    """One number if all three are equal."""
    return value[0] if isinstance(value, tuple) and value[0] == value[1] == value[2] else value
