"""The Light panel: each light group on or off, its intensity, colour temperature and colour."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from lambent.core.light_mix import AS_BAKED, LEAST_K, MOST_K, WHITE, GroupMix, LightMix
from lambent.realtime.group_arrays import BAKE_GROUPS, FIELDS_FOLLOW, NO_GROUPS
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.modes.walk.light_keys import key_times
from lambent.viewer.modes.walk.lights import Lights
from lambent.viewer.modes.walk.recording import Recordings
from lambent.viewer.navigation import PathPlay
from lambent.viewer.panels.widgets import check, press, rgb, slider, wrapped

BRIGHTEST = 4.0  # of the slider: times as baked
WARM_K, COOL_K = 1800.0, 12000.0  # of the slider
USUAL_K = 6500.0


def draw(lights: Lights, recordings: Recordings) -> None:
    if not lights.groups:
        wrapped([f"{NO_GROUPS}: {BAKE_GROUPS}"])
        return
    play = recordings.navigation.path
    if play is not None and recordings.track_of(play.path) is not None and not recordings.keying:
        wrapped(["the light follows the walk that is shown; move to take it over"])
    for group in lights.groups:
        mix = lights.mix.of(group.name)
        lights.mix = lights.mix.changed(group.name, _row(group, mix))
    imgui.begin_disabled(not lights.mix.groups)
    if press("reset all light", "shows all light as it was baked", -1):
        lights.mix = LightMix()
    imgui.end_disabled()
    if play is not None:
        _keys(recordings, play)
    if lights.fields:
        wrapped([FIELDS_FOLLOW])


def _keys(recordings: Recordings, play: PathPlay) -> None:
    """Keys of the mix along the path that is shown: films of it have the same light."""
    imgui.separator_text(f"light along {play.path.name}")
    if play.path == recordings.recorder.draft:
        imgui.text_wrapped("Save the recorded walk, then set keys.")
        return
    meaning = "while the walk rests the picture shows the mix above, to be set as a key, not the light of the walk"
    recordings.keying = check("set keys", recordings.keying, meaning)
    imgui.same_line()
    imgui.begin_disabled(not recordings.keying)
    if press(f"key at {play.time_s:.1f} s###set key", "the mix above is the light of the walk at this moment"):
        recordings.set_key()
    imgui.end_disabled()
    for time_s in key_times(recordings.track_of(play.path)):
        if press(f"{time_s:.1f} s##key", "stands there, with the mix of this key above", small=True):
            recordings.go_to_key(time_s)
        imgui.same_line()
        if press(f"x##key {time_s}", "removes this key of light; the view stays", small=True):
            recordings.drop_key(time_s)


def _row(group: LightGroupRecord, mix: GroupMix) -> GroupMix:
    """One group; a change of a slider or of a colour switches it on."""
    name = group.name
    imgui.separator_text(f"{name}  {group.share:.0%}")
    members = ", ".join(group.members)
    on = check(f"on##{name}", mix.on, f"switches {members} on or off")
    imgui.same_line()
    intensity = slider(
        f"##times {name}", mix.intensity, 0.0, BRIGHTEST, f"times as bright as baked: {members}", unit=" x"
    )
    imgui.same_line()
    if press(f"reset##{name}", "as it was baked", small=True):
        return AS_BAKED
    is_tinted = check(f"black body##{name}", mix.temperature_k is not None, "tints the light as a black body shines")
    kelvin = mix.temperature_k if is_tinted else None
    if is_tinted:
        meaning = "temperature of the black body: 2700 K is a light bulb, 6500 K daylight"
        low, high = max(WARM_K, LEAST_K), min(COOL_K, MOST_K)
        imgui.same_line()
        kelvin = slider(f"##kelvin {name}", mix.temperature_k or USUAL_K, low, high, meaning, log=True, unit=" K")
    colour = rgb(f"colour##{name}", mix.colour, 1.0, "a filter before the light; how dark it is does not matter")
    colour = colour if any(colour) else WHITE
    changed = (intensity, colour) != (mix.intensity, mix.colour)
    return replace(mix, on=on or changed, intensity=intensity, temperature_k=kelvin, colour=colour)
