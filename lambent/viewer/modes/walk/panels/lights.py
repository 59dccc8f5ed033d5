"""The Light panel: each light group on or off, its intensity, colour temperature and colour."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from lambent.core.light.light_mix import AS_BAKED, LEAST_K, MOST_K, WHITE, GroupMix, LightMix
from lambent.realtime.light.group_arrays import BAKE_GROUPS, FIELDS_FOLLOW, NO_GROUPS
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.cameras.navigation import PathPlay
from lambent.viewer.modes.walk.light.light_keys import key_times
from lambent.viewer.modes.walk.light.lights import Lights
from lambent.viewer.modes.walk.views.recording import Recordings
from lambent.viewer.panels.widgets import check, press, rgb, slider, wrapped

BRIGHTEST = 4.0  # largest intensity of the slider, relative to the bake
WARM_K, COOL_K = 1800.0, 12000.0  # range of the slider
USUAL_K = 6500.0


def draw(lights: Lights, recordings: Recordings) -> None:
    if not lights.groups:
        wrapped([f"{NO_GROUPS}: {BAKE_GROUPS}"])
        return
    play = recordings.navigation.path
    if play is not None and recordings.track_of(play.path) is not None and not recordings.keying:
        wrapped(["the light follows the shown walk; move to control it yourself"])
    for group in lights.groups:
        mix = lights.mix.of(group.name)
        lights.mix = lights.mix.changed(group.name, _row(group, mix))
    imgui.begin_disabled(not lights.mix.groups)
    if press("reset all light", "resets all light groups to the bake", -1):
        lights.mix = LightMix()
    imgui.end_disabled()
    if play is not None:
        _keys(recordings, play)
    if lights.fields:
        wrapped([FIELDS_FOLLOW])


def _keys(recordings: Recordings, play: PathPlay) -> None:
    """Draw the light keys along the shown path, which its films use."""
    imgui.separator_text(f"light along {play.path.name}")
    if play.path == recordings.recorder.draft:
        imgui.text_wrapped("Save the recorded walk, then set light keys.")
        return
    meaning = "while the walk is paused, the picture shows the mix above, to be set as a key"
    recordings.keying = check("set keys", recordings.keying, meaning)
    imgui.same_line()
    imgui.begin_disabled(not recordings.keying)
    if press(f"key at {play.time_s:.1f} s###set key", "sets the mix above as the walk's light at this time"):
        recordings.set_key()
    imgui.end_disabled()
    for time_s in key_times(recordings.track_of(play.path)):
        if press(f"{time_s:.1f} s##key", "goes to this time and shows the mix of this key above", small=True):
            recordings.go_to_key(time_s)
        imgui.same_line()
        if press(f"x##key {time_s}", "removes this light key; the view stays", small=True):
            recordings.drop_key(time_s)


def _row(group: LightGroupRecord, mix: GroupMix) -> GroupMix:
    """Draw one group; a change of a slider or colour switches it on."""
    name = group.name
    imgui.separator_text(f"{name}  {group.share:.0%}")
    members = ", ".join(group.members)
    on = check(f"on##{name}", mix.on, f"switches {members} on or off")
    imgui.same_line()
    intensity = slider(
        f"##times {name}", mix.intensity, 0.0, BRIGHTEST, f"intensity, relative to the bake: {members}", unit=" x"
    )
    imgui.same_line()
    if press(f"reset##{name}", "resets this group to the bake", small=True):
        return AS_BAKED
    is_tinted = check(
        f"black body##{name}", mix.temperature_k is not None, "gives the light the colour of a black body"
    )
    kelvin = mix.temperature_k if is_tinted else None
    if is_tinted:
        meaning = "temperature of the black body: 2700 K is a light bulb, 6500 K daylight"
        low, high = max(WARM_K, LEAST_K), min(COOL_K, MOST_K)
        imgui.same_line()
        kelvin = slider(f"##kelvin {name}", mix.temperature_k or USUAL_K, low, high, meaning, log=True, unit=" K")
    colour = rgb(f"colour##{name}", mix.colour, 1.0, "colour filter; only its hue and saturation count")
    colour = colour if any(colour) else WHITE
    changed = (intensity, colour) != (mix.intensity, mix.colour)
    return replace(mix, on=on or changed, intensity=intensity, temperature_k=kelvin, colour=colour)
