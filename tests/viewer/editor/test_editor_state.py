"""The editor without a window: steps, files, restrictions, the fit in the background."""

import json
import time

import pytest

from lambent.core.errors import UserError
from lambent.core.progress import Cancelled
from lambent.materials.document import Lobe, Material, Provenance, load_material
from lambent.viewer.background.work import Work
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.measurement import read_measurement, start_material
from lambent.viewer.editor.restrictions import Restrictions, lobe_names
from lambent.viewer.editor.subject import same_numbers
from lambent.viewer.edits.edits import MaterialEdits
from tests.viewer import waiting
from tests.viewer.editor.measured_specimens import BRASS, FROSTED, write_measurement


@pytest.fixture(scope="module")
def brass_file(tmp_path_factory):
    return write_measurement(tmp_path_factory.mktemp("measured") / "brass.txt", BRASS)


@pytest.fixture
def said(screen):
    """Messages so far."""
    return screen.messages


@pytest.fixture
def editor(screen):
    return Editor(MaterialEdits({"brass": BRASS}), "brass", screen)


def moved(material, **changes):
    return material.model_copy(update={"lobes": (material.lobes[0].model_copy(update=changes), *material.lobes[1:])})


def until(editor, condition):
    waiting.until(condition, editor.tick)


def test_a_drag_is_one_step_and_is_shown_at_once(editor, brass_file):
    editor.show_measurement(read_measurement(brass_file))
    editor.tick()
    error, image, curve = editor.shown.error, editor.shown.images["A"], editor.shown.curves["A", False][1]
    assert error < 0.01 * editor.measurement.lambertian["cuberoot"]
    for mx in (0.2, 0.3, 0.4):
        editor.subject.change(moved(editor.subject.material, mx=mx, my=mx))
        editor.tick()
        assert editor.shown.error > error
        error = editor.shown.error
    assert editor.shown.images["A"] is not image
    assert editor.shown.curves["A", False][1].max() < curve.max()
    editor.subject.edits.end_stroke()
    editor.subject.edits.undo()
    assert editor.subject.material == BRASS and not editor.subject.edits.can_undo
    until(editor, lambda: editor.shown.exact and editor.shown.layout["A"].pixels > 60)
    assert editor.shown.error == pytest.approx(editor.measurement.exact_errors(BRASS)["cuberoot"])


def test_what_is_compared_with(editor):
    editor.subject.reference = "as loaded"
    editor.subject.step(moved(BRASS, mx=0.3))
    editor.subject.step(moved(BRASS, mx=0.5))
    assert editor.subject.compared == BRASS
    editor.subject.reference = "before the last edit"
    assert editor.subject.compared.lobes[0].mx == 0.3
    editor.subject.reference = "as saved"
    assert editor.subject.compared is None
    editor.save()
    assert editor.subject.compared.lobes[0].mx == 0.5
    editor.tick()
    assert ("B", False) in editor.shown.curves
    editor.subject.reference = "nothing"
    editor.tick()
    assert ("B", False) not in editor.shown.curves and "B" not in editor.shown.images


def test_lobes_come_and_go_and_restrictions_follow(editor):
    editor.subject.add_lobe("reflection")
    editor.subject.add_lobe("transmission")
    assert [names["mx"] for names in lobe_names(editor.subject.material)] == ["mx", "mx_2", "t_mx"]
    editor.subject.restrictions.fix("mx_2", True)
    editor.subject.restrictions.fix("kd", True)
    editor.subject.restrictions.narrow("mx", (0.1, 0.2))
    editor.subject.remove_lobe(0)
    assert editor.subject.restrictions.fixed == {"mx", "kd"} and editor.subject.restrictions.ranges == {}
    editor.subject.turn_lobe(0, "transmission")
    assert [lobe.side for lobe in editor.subject.material.lobes] == ["transmission", "transmission"]
    assert editor.subject.restrictions.fixed == {"kd"}
    for _ in range(5):
        editor.subject.edits.undo()
    assert editor.subject.material == BRASS


def test_a_lobe_becomes_retro_and_turns_back(editor):
    editor.subject.add_lobe("retro")
    assert editor.subject.material.lobes[-1].r0 == (1.0, 1.0, 1.0)
    assert [names["mx"] for names in lobe_names(editor.subject.material)] == ["mx", "r_mx"]
    lobes = list(editor.subject.material.lobes)
    lobes[-1] = lobes[-1].model_copy(update={"alpha": -2.0})
    editor.subject.step(editor.subject.material.model_copy(update={"lobes": tuple(lobes)}))
    editor.subject.turn_lobe(1, "reflection")
    after = editor.subject.material
    assert [lobe.kind for lobe in after.lobes] == ["reflection", "reflection"] and after.lobes[1].alpha == 0
    assert type(after).model_validate(after.model_dump()) == after


def test_restrictions_of_a_fit():
    restrictions = Restrictions()
    material = Material(kd=(0.1, 0.2, 0.2), lobes=(Lobe(mx=0.1, my=0.2, r0=(0.2, 0.3, 0.4), k=0.5),))
    for name in ("kd", "ks", "r0", "my_2"):
        restrictions.fix(name, True)
    restrictions.narrow("mx", (0.05, 0.3))
    fix, ranges, unknown = restrictions.for_fit(material, 1)
    assert fix == {"kd": (0.1, 0.2, 0.2), "ks": 0.5, "r0": pytest.approx(0.3)}
    assert ranges == {"mx": (0.05, 0.3)} and unknown == ["my_2"]
    restrictions.fix("mx", True)
    assert restrictions.ranges == {}, "what is fixed has no interval"


def test_a_fit_comes_as_one_step_and_keeps_what_is_fixed(editor, brass_file, said):
    editor.show_measurement(read_measurement(brass_file))
    editor.subject.step(moved(BRASS, mx=0.5, my=0.5, alpha=0.0))
    editor.subject.restrictions.fix("alpha", True)
    editor.fit.distribution = "beckmann"
    editor.fit.start(editor.measurement, editor.metric)
    until(editor, lambda: editor.fit.work is None)
    found = editor.subject.material
    assert found.lobes[0].mx == pytest.approx(0.15, rel=0.05) and found.lobes[0].alpha == 0
    assert found.name == "brass" and found.provenance.source == "brass.txt"
    assert said[-1].text.startswith("fitted in")
    editor.subject.edits.undo()
    assert editor.subject.material.lobes[0].mx == 0.5


def test_a_cancelled_fit_leaves_the_material(editor, brass_file, said):
    editor.show_measurement(read_measurement(brass_file))
    editor.fit.lobes = "4"
    editor.fit.start(editor.measurement, editor.metric)
    editor.fit.stop(keep=False)
    until(editor, lambda: editor.fit.work is None)
    assert editor.subject.material == BRASS and not editor.subject.edits.can_undo
    assert "cancelled" in said[-1].text


def test_a_fit_that_cannot_be_is_said(editor, brass_file, said):
    editor.show_measurement(read_measurement(brass_file))
    editor.subject.add_lobe("transmission")
    editor.subject.restrictions.fix("t_mx", True)
    editor.fit.start(editor.measurement, editor.metric)
    until(editor, lambda: editor.fit.work is None)
    assert "not fitted" in said[-1].text and "does not transmit" in said[-1].text


def test_what_is_saved_says_that_it_was_edited(editor, brass_file, tmp_path):
    fitted = BRASS.model_copy(
        update={"provenance": Provenance(source="brass.txt", method="gradient", errors={"l1": 9.0})}
    )
    editor.subject.adopt(fitted)
    editor.show_measurement(read_measurement(brass_file))
    editor.subject.step(moved(fitted, mx=0.3))
    editor.files.name = "mine.json"
    editor.save()
    saved = load_material(tmp_path / "mine.json")
    assert same_numbers(saved, editor.subject.material) and not editor.subject.unsaved
    assert saved.provenance.method == "gradient" and "edited by hand after the fit" in saved.provenance.notes[-1]
    assert saved.provenance.errors == pytest.approx(editor.measurement.exact_errors(saved))
    editor.subject.step(fitted)
    editor.save()
    assert load_material(tmp_path / "mine.json").provenance == fitted.provenance, "as fitted, so no note"
    editor.subject.step(BRASS)
    editor.save()
    assert load_material(tmp_path / "mine.json").provenance is None, "as it was before the fit"


@pytest.mark.parametrize("name", ["", ".json", "brass.txt", "nowhere/brass.json"])
def test_a_bad_file_name_is_said_and_nothing_lost(editor, said, name):
    editor.subject.step(moved(BRASS, mx=0.3))
    editor.files.name = name
    editor.save()
    assert (
        said[-1].text.startswith("not saved") and editor.subject.unsaved and editor.subject.material.lobes[0].mx == 0.3
    )


def test_wrong_files_are_said_and_nothing_lost(editor, brass_file, tmp_path, said):
    editor.show_measurement(before := read_measurement(brass_file))
    junk, broken = tmp_path / "junk.bsdf", tmp_path / "broken.json"
    junk.write_bytes(b"\x00junk" * 50)
    broken.write_text(json.dumps({"kd": -1}))
    for text in ("", "/no/such/file", str(junk), str(broken), str(tmp_path / "light.hdr"), str(tmp_path)):
        count = len(said)
        editor.files.open(text)
        until(editor, lambda count=count: len(said) > count)
        assert said[-1].text.startswith("not loaded"), text
    assert editor.measurement is before and editor.subject.material == BRASS
    editor.files.open_compared(str(broken))
    assert editor.subject.document is None and said[-1].text.startswith("not loaded")


def test_files_are_taken_for_what_they_hold(editor, brass_file, tmp_path):
    FROSTED.save(tmp_path / "frosted.json")
    editor.files.open(f" '{tmp_path / 'frosted.json'}' ")
    assert same_numbers(editor.subject.material, FROSTED) and editor.files.name == str(tmp_path / "frosted.json")
    editor.subject.edits.undo()
    assert editor.subject.material == BRASS
    editor.files.open(f"file://{brass_file}")
    until(editor, lambda: editor.measurement is not None)
    assert editor.measurement.path == brass_file


def test_start_material(tmp_path):
    start = start_material(read_measurement(write_measurement(tmp_path / "frosted.txt", FROSTED)))
    assert [lobe.side for lobe in start.lobes] == ["reflection", "transmission"]
    assert start.kt_d == pytest.approx(FROSTED.kt_d, rel=0.25)


def test_a_table_of_few_tuples_has_an_error_and_no_curves(editor, tmp_path):
    rows = [f"{theta_i} 0 {theta_o} {phi} 0.1" for theta_i in (0, 40) for theta_o in (0, 60) for phi in (0, 180)]
    (tmp_path / "few.txt").write_text("\n".join(["theta_i phi_i theta_o phi_o f", *rows]))
    editor.show_measurement(measurement := read_measurement(tmp_path / "few.txt"))
    assert measurement.gathered == ()
    editor.tick()
    assert editor.shown.error > 0 and ("measured", False) not in editor.shown.curves and editor.shown.curves


def test_work_reports_its_end():
    ends = []
    work = Work(lambda progress: 6 * 7, ends.append)
    work.wait()
    assert work.poll() and ends == [42]

    def refused(progress):
        raise UserError("no")

    work = Work(refused, ends.append, lambda error: ends.append(error.message))
    work.wait()
    assert work.poll() and ends[-1] == "no"

    def broken(progress):
        raise ZeroDivisionError

    work = Work(broken, ends.append)
    work.wait()
    with pytest.raises(ZeroDivisionError):
        work.poll()


def test_work_is_cancelled_through_its_progress():
    def long(progress):
        for step in range(10**9):
            progress(step, 10**9, "steps")
            time.sleep(0.001)

    ends = []
    work = Work(long, ends.append)
    work.cancel()
    work.wait()
    assert work.poll() and ends == []
    assert isinstance(work._error, Cancelled)


def test_what_a_fit_leaves_alone_is_undone_too(editor):
    subject, edits = editor.subject, editor.subject.edits
    subject.add_lobe("reflection")
    subject.restrictions.fix("mx_2", True)
    edits.end_stroke()
    subject.restrictions.narrow("mx", (0.1, 0.2))
    edits.end_stroke()
    subject.remove_lobe(1)
    assert subject.restrictions.fixed == set() and set(subject.restrictions.ranges) == {"mx"}
    edits.undo()
    assert len(subject.material.lobes) == 2 and subject.restrictions.fixed == {"mx_2"}, "one step brings back both"
    edits.undo()
    assert subject.restrictions.ranges == {}
    edits.undo()
    assert subject.restrictions.fixed == set()
    edits.redo()
    edits.redo()
    assert subject.restrictions.fixed == {"mx_2"} and subject.restrictions.ranges == {"mx": (0.1, 0.2)}
    assert not edits.previous(subject.name).lobes[2:]
