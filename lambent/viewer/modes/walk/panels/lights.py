"""The Light panel: each light group on or off, its intensity, colour temperature and colour."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from lambent.core.light.light_mix import AS_BAKED, LEAST_K, MOST_K, WHITE, GroupMix, LightMix, nearest_temperature_k
from lambent.realtime.light.group_arrays import BAKE_GROUPS, FIELDS_FOLLOW, NO_GROUPS
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.cameras.navigation import PathPlay
from lambent.viewer.modes.walk.light.light_keys import key_times
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.views.recording import Recordings
from lambent.viewer.panels.widgets import check, explain, press, px, slider, swatch, wrapped

BRIGHTEST = 400.0  # per cent of the baked intensity, of the slider
KELVIN_PX, FILTER_PX = 110.0, 44.0
WARM_K, COOL_K = 1800.0, 12000.0  # range of the slider
USUAL_K = 6500.0


def draw(state: WalkState) -> None:
    """Draw the panel; in the size *measure* with each group's share of all light."""
    lights, recordings, in_numbers = state.lights, state.recordings, state.screen.size == "measure"
    if not lights.groups:
        wrapped([f"{NO_GROUPS}: {BAKE_GROUPS}"])
        return
    play = recordings.navigation.path
    if play is not None and recordings.track_of(play.path) is not None and not recordings.keying:
        wrapped(["the light follows the shown walk; move to control it yourself"])
    for group in lights.groups:
        mix = lights.mix.of(group.name)
        lights.mix = lights.mix.changed(group.name, _row(group, mix, in_numbers))
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


def _row(group: LightGroupRecord, mix: GroupMix, in_numbers: bool) -> GroupMix:
    """Draw one group; a change of a slider or colour switches it on."""
    name = group.name
    imgui.separator_text(f"{name}  {group.share:.0%}" if in_numbers else name)
    members = ", ".join(group.members)
    on = check(f"on##{name}", mix.on, f"switches {members} on or off")
    imgui.same_line()
    meaning = f"brightness, 100 % as baked: {members}"
    percent = slider(f"##times {name}", 100 * mix.intensity, 0.0, BRIGHTEST, meaning, unit=" %%", digits=0)
    intensity = mix.intensity if percent == 100 * mix.intensity else percent / 100
    imgui.same_line()
    if press(f"reset##{name}", "resets this group to the bake", small=True):
        return AS_BAKED
    kelvin = _temperature(name, mix)
    imgui.same_line()
    colour = swatch(f"filter##{name}", mix.colour, "colour filter; only its hue and saturation count", px(FILTER_PX))
    colour = colour if any(colour) else WHITE
    if colour != WHITE:
        near_k = nearest_temperature_k(mix.tint)
        imgui.same_line()
        imgui.text_disabled("a colour" if near_k is None else f"about {near_k:.0f} K")
        explain("nearest colour temperature of white light under this filter, where there is one")
    changed = (intensity, colour) != (mix.intensity, mix.colour)
    return replace(mix, on=on or changed, intensity=intensity, temperature_k=kelvin, colour=colour)


def _temperature(name: str, mix: GroupMix) -> float | None:
    """Draw the switch of a colour temperature and its slider; None for the light as it is."""
    meaning = "gives the light this colour temperature: 2700 K is a light bulb, 6500 K daylight"
    if not check(f"K##{name}", mix.temperature_k is not None, meaning):
        return None
    low, high, now = max(WARM_K, LEAST_K), min(COOL_K, MOST_K), mix.temperature_k or USUAL_K
    imgui.same_line()
    imgui.set_next_item_width(px(KELVIN_PX))
    return slider(f"##kelvin {name}", now, low, high, meaning, log=True, unit=" K", digits=0)
