"""Keys of the light along a camera path: tracks (`core.light.light_mix`) with a complete mix at each time."""

from __future__ import annotations

from collections.abc import Collection

from lambent.core.light.light_mix import AS_BAKED, LightMix, MixTrack

SAME_S = 0.05  # a new key replaces a key nearer than this


def key_times(track: MixTrack | None) -> tuple[float, ...]:
    """Times of all keys in seconds, increasing."""
    return () if track is None else tuple(sorted({time_s for keys in track.groups.values() for time_s, _ in keys}))


def mix_at(track: MixTrack, time_s: float) -> LightMix:
    """The mix of a key; a group without a key there has its previous key, else its first."""
    found = LightMix()
    for name, keys in track.groups.items():
        before = [mix for at, mix in keys if at <= time_s]
        found = found.changed(name, before[-1] if before else keys[0][1])
    return found


def with_key(track: MixTrack | None, time_s: float, mix: LightMix, groups: Collection[str]) -> MixTrack:
    """The track with this mix of all `groups` at a time, replacing a key nearer than `SAME_S`.

    At all other times, a group that is new in the track is as baked.
    """
    times = key_times(track)
    time_s = min((at for at in times if abs(at - time_s) < SAME_S), key=lambda at: abs(at - time_s), default=time_s)
    before = track.groups if track is not None else {}
    found = {}
    for name in sorted({*groups, *before}):
        keys = dict(before.get(name, [(at, AS_BAKED) for at in times]))
        found[name] = tuple(sorted({**keys, time_s: mix.of(name)}.items(), key=lambda key: key[0]))
    return MixTrack(found)


def without_key(track: MixTrack, time_s: float) -> MixTrack | None:
    """The track without its key at a time; None if nothing is left."""
    left = {name: tuple(key for key in keys if key[0] != time_s) for name, keys in track.groups.items()}
    kept = {name: keys for name, keys in left.items() if keys}
    return MixTrack(kept) if kept else None
