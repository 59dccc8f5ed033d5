"""The page's panel and card with many and long names: in view, without overlap, named, legible, in a sensible order."""

from __future__ import annotations

import pytest

from tests.site.conftest import served

pytestmark = pytest.mark.slow
LONG = "Wohnküche mit Blick auf die Straßenseite, " * 7 + "Öl."
FILL = """async (long) => {
  const { openPanel } = await import("/controls.js"), { openCard } = await import("/card.js");
  const named = (count, what) => Array.from({ length: count }, (_, i) => ({ name: i ? `${what} ${i}` : long }));
  const visit = Object.assign(new EventTarget(), {
    state: 0, exposureEv: 0, viewTransform: 2, motion: null, pivot: null,
    found: { thing: { name: long, material: "oak" } },
    manifest: {
      name: long, states: named(20, "state"), cameras: named(30, "view"), exposureEv: 0,
      visit: {
        caption: long, credit: long, viewTransforms: { filmic: 2, neutral: 1 }, paths: named(3, "walk"),
        finishes: named(20, "finish").map((one) => ({ ...one, facts: [["Measurement", long]] })),
        finishesOfStates: Array.from({ length: 20 }, (_, i) => ({ oak: i })),
      },
    },
  });
  openPanel(visit); openCard(visit); visit.dispatchEvent(new Event("change"));
}"""
BOXES = """() => ["panel", "card"].map((id) => {
  const one = document.getElementById(id), { left, top, right, bottom } = one.getBoundingClientRect();
  const [wide, tall] = [one.scrollWidth - one.clientWidth, one.scrollHeight - one.clientHeight];
  return { id, left, top, right, bottom, wide, tall };
})"""
CONTRASTS = """(wall) => {
  const rgba = (text) => { const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number); return [r, g, b, a]; };
  const over = ([r, g, b, a], below) => [r, g, b].map((x, i) => a * x + (1 - a) * below[i]);
  const level = (rgb) => rgb.map((x) => x / 255).map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4))
    .reduce((sum, x, i) => sum + [0.2126, 0.7152, 0.0722][i] * x, 0);
  const ground = (one) => {
    const below = one === document.body ? wall : ground(one.parentElement);
    return one === document.body ? wall : over(rgba(getComputedStyle(one).backgroundColor), below);
  };
  const texts = [...document.querySelectorAll("#panel *, #card *, #message, #said span")].filter((one) =>
    [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim()) && one.checkVisibility());
  return texts.map((one) => {
    const back = ground(one), ink = over(rgba(getComputedStyle(one).color), back), [a, b] = [level(ink), level(back)];
    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), one.tagName, one.textContent.slice(0, 20)];
  });
}"""
ORDER = """() => [...document.querySelectorAll("#picture, #panel :is(summary, button, input, select), #card button")]
  .filter((one) => one.checkVisibility() && !one.disabled)
  .map((one) => one.id || one.closest("[id]").id).filter((id, i, all) => id !== all[i - 1])"""
NAMED = (
    'application "box"', 'slider "Exposure"', 'combobox "View transform"', 'navigation "Views"',
    'navigation "Recorded walks"', 'navigation "Finishes and light"', 'group "Finishes"', 'button "Reset exposure"',
)  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("width", "height"), [(320, 568), (1280, 720), (568, 320)])
def test_many_and_long_names_fit(chromium, box_site, width, height):
    with chromium(flags=("--no-sandbox", "--disable-features=WebGPU")) as page, served(box_site) as address:
        page.set_viewport_size({"width": width, "height": height})
        page.goto(address)
        page.wait_for_selector("#message:has-text('WebGPU')")
        page.evaluate(FILL, LONG)
        panel, card = page.evaluate(BOXES)
        for box in (panel, card):
            assert 0 <= box["left"] < box["right"] <= width and 0 <= box["top"] < box["bottom"] <= height, box
            assert box["wide"] <= 0 and box["tall"] > 0, "scrolls down, not sideways"
        apart_px = max(card["left"] - panel["right"], panel["top"] - card["bottom"])
        assert apart_px >= min(40, 0.08 * width), "the picture shows between them"
        last = page.locator("#views button").last
        last.scroll_into_view_if_needed()
        assert last.is_visible() and page.locator("#views button").count() == 30
        for button in page.locator("#card button").all():
            button.scroll_into_view_if_needed()
        if width == 320:
            for wall in ((255, 255, 255), (0, 0, 0)):
                weak = [found for found in page.evaluate(CONTRASTS, wall) if found[0] < 4.5]
                assert not weak, "contrast over any room"
            order = page.evaluate(ORDER)
            wanted = ["picture", "finishes", "go", "orbit", "close", "name", "states", "views", "walks", "exposure"]
            assert order[: len(wanted)] == wanted
            tree = page.locator("body").aria_snapshot()
            assert [words for words in NAMED if words not in tree] == []
